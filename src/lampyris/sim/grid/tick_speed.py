"""Tick speed: the robot's speed at each tick, by the profile of the path that it plans to drive from there."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from lampyris.kernels.simulation.ticks import LAW_DISSERTATION, LAW_PHYSICAL
from lampyris.model.grid import frozen
from lampyris.model.path import path_of
from lampyris.model.profile import Profile
from lampyris.model.scene import Scene
from lampyris.motion.caps import COS_22_5, COS_67_5
from lampyris.motion.laws import registry as laws
from lampyris.motion.laws.dissertation import DEFAULT, DissertationLaw, dissertation_profile, ring_caps
from lampyris.motion.laws.physical import RULES, PhysicalLaw, rings_felt
from lampyris.motion.laws.rings import counted_around, ring_counts
from lampyris.typing import BoolGrid, Cell, Cells, Floats

SpeedLaw: TypeAlias = str | DissertationLaw | PhysicalLaw


class TickSpeed:
    """The speed of a robot that drives on, tick after tick.

    Parameters
    ----------
    scene : whose robot and map.
    law : ``physical``, ``dissertation``, or settings of one of them.

    Attributes
    ----------
    v : the present speed; what the next profile starts from.
    name, units : of the law.
    horizon : steps ahead that can be felt.

    Raises
    ------
    UsageError : no such law.
    """

    def __init__(self, scene: Scene, law: SpeedLaw) -> None:
        self.scene = scene
        self.v = 0.0
        self._last: Profile | tuple[Cells, Any, Any] | None = None
        self._resumed: tuple[float, Sequence[Cell], Sequence[Cell]] | None = None
        self._law = law
        self._known: tuple[Scene, tuple[int, Floats, NDArray[np.uint8], BoolGrid] | None] | None = None
        self.name = laws.name_of(law)
        self.units = laws.named(self.name).units
        if self.for_kernel() is None:  # what a law cannot do on this map it says at once
            laws.profile(path_of(np.array([scene.start]), scene.moves), scene, law=law)
        self._ours = law if isinstance(law, DissertationLaw) else DEFAULT
        # What lies farther ahead than the robot needs to brake from its top speed cannot bind it now. The
        # path is cut there, and the speed comes out the same to the last bit: each node's bound is a minimum
        # of two numbers, and the one that the cut changes is then the greater.
        if self.name == "dissertation":
            braking = self._ours.v_max / self._ours.braking
        else:
            robot = scene.robot
            braking = robot.v_max * robot.v_max / (2.0 * robot.d_max) / scene.grid.resolution
        self.horizon = math.ceil(min(braking, 1e6)) + 2

    def drive(self, route: Sequence[Cell], seen: Sequence[Cell]) -> tuple[float, str]:
        """Speed and binding cause at the second cell of ``route``, the one just entered.

        Parameters
        ----------
        route : the cell the robot came from, the one it stands on, and the rest of its plan.
        seen : cells that moving obstacles cover now.
        """
        self._resumed = None
        near = np.array(route[: self.horizon + 2], dtype=np.int32)
        if self.name == "dissertation":
            n1, n2 = ring_counts(
                near,
                self.scene.grid.blocked,
                seen,
                ring1=self._ours.ring1,
                ring2=self._ours.ring2,
                outside1=self._ours.outside1,
                outside2=self._ours.outside2,
            )
            # The first node lies behind: its speed has been driven, whatever stands around it by now.
            n1[0] = n2[0] = 0
            v, cause = dissertation_profile(near, n1.tolist(), n2.tolist(), law=self._ours, v0=self.v)
            self._last = (near, n1, n2)
        else:
            profile = laws.profile(
                path_of(near, self.scene.moves),
                self.scene,
                law=self._law,
                obstacles=seen,
                v0=self.v,
                on_infeasible="brake",
            )
            v, cause = profile.v, profile.cause
            self._last = profile
        self.v = float(v[1])
        return self.v, cause[1]

    def stop(self) -> None:
        """Stand still."""
        self.v = 0.0
        self._last = self._resumed = None

    def resume(self, before: float, v: float, route: Sequence[Cell], seen: Sequence[Cell]) -> None:
        """Take up the speed of a tick that was driven elsewhere; ``before`` is the speed before it, see :meth:`drive`."""
        self.v = v
        self._resumed = before, route, seen

    def for_kernel(self) -> tuple[int, Floats, NDArray[np.uint8], BoolGrid] | None:
        """The law as :func:`lampyris.kernels.simulation.ticks.advance` takes it: its number, its numbers, what counts around
        a node, the walls; None: the kernel does not know it."""
        if self._known is None or self._known[0] is not self.scene:
            self._known = self.scene, self._for_kernel()
        return self._known[1]

    def _for_kernel(self) -> tuple[int, Floats, NDArray[np.uint8], BoolGrid] | None:
        settings, scene = laws.settings_named(self._law), self.scene
        robot, grid = scene.robot, scene.grid
        if isinstance(settings, DissertationLaw):
            return LAW_DISSERTATION, *law_tables(settings), grid.blocked
        if type(settings) is not PhysicalLaw or robot.jerk_max is not None:
            return None
        # The kernel knows the limit, clearance and the obstacles' cells; in ticks obstacles have no velocities for `moving`.
        others = (getattr(settings, name) for name in RULES if name != "moving")
        if any(rule is not None for rule in others) or (settings.zones and scene.zones is not None):
            return None
        numbers = (
            robot.v_max, settings.creep * robot.v_max, robot.d_max, robot.a_max, grid.resolution, robot.radius,
            rings_felt(scene), float(settings.clearance),
        )  # fmt: skip
        return LAW_PHYSICAL, frozen(np.array(numbers)), frozen(np.zeros(1, dtype=np.uint8)), grid.blocked

    def caps(self) -> tuple[tuple[str, float], ...]:
        """What each rule alone allows at the cell entered last, by its cause, those that say something; none
        while the robot stands. Asked by who watches; a run that nobody watches does not pay for it."""
        if self._resumed is not None:
            (self.v, route, seen), self._resumed = self._resumed, None
            self.drive(route, seen)
        last = self._last
        if last is None:
            return ()
        if isinstance(last, Profile):
            found = last.caps
        else:
            near, n1, n2 = last
            found = ring_caps(near, n1.tolist(), n2.tolist(), law=self._ours)
        return tuple((cause, float(v[1])) for cause, v in found if np.isfinite(v[1]))


@lru_cache(maxsize=8)
def law_tables(law: DissertationLaw) -> tuple[Floats, NDArray[np.uint8]]:
    """The dissertation's law as kernels take it: its numbers, and what counts around a node by heading."""
    numbers = (
        law.v_max, law.v_min, law.ring1_drop, law.ring2_drop, law.a_straight, law.a_diagonal, law.braking,
        law.v_180, law.v_135, law.v_90, COS_22_5, COS_67_5,
    )  # fmt: skip
    counted = counted_around(law.ring1, law.ring2, law.outside1, law.outside2)
    return frozen(np.array(numbers)), frozen(counted)

"""Controllers by law: who drives, and the ceiling of speeds that it is given along each path."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

from lampyris.model.profile import Profile
from lampyris.model.robot import inscribed_disc
from lampyris.model.scene import Scene
from lampyris.motion.geometry.sampled_path import SampledPath
from lampyris.motion.laws import registry as laws
from lampyris.motion.laws.bounds import Constant, Optimum
from lampyris.motion.laws.dissertation import DissertationLaw
from lampyris.motion.laws.physical import PhysicalLaw
from lampyris.motion.laws.rpp import Rpp
from lampyris.sim.continuous.baseline_controllers import ByRings, Regulated
from lampyris.sim.continuous.control import Controller, Decision, State, under_ceiling
from lampyris.sim.continuous.leg import Ceiling
from lampyris.sim.continuous.lookahead import Foresight
from lampyris.sim.continuous.pose_replanner import outlined
from lampyris.sim.continuous.safe_controller import SafeController
from lampyris.sim.continuous.timetable import punctual
from lampyris.sim.traffic.motion_sources import Roster


@dataclass(frozen=True)
class Follow:
    """Drives its profile and looks at no obstacle: ``optimum`` and ``constant``."""

    def decide(self, state: State) -> Decision:
        """As fast as the ceiling and planned times allow."""
        return punctual(state, under_ceiling(state))


class Wheel(NamedTuple):
    """A law at the wheel: its name, its controller, what makes its ceiling, whether it counts cells."""

    name: str
    controller: Controller
    ceiling: Ceiling
    cells: bool


def wheel(
    scene: Scene, law: laws.SpeedLaw, obstacle_info: str, roster: Roster, *, poses: bool = False,
    known: Callable[[], Scene] | None = None,
) -> Wheel:  # fmt: skip
    """Who drives by a law, given by name or by settings.

    Parameters
    ----------
    obstacle_info : what our law uses of the obstacles; with ``tracks`` the roster's recorded ones are known.
    poses : whether curves of poses are driven, which have the robot's outline.
    known : the scene as it is known now, by which ceilings are made; None: ``scene``.

    Raises
    ------
    UsageError : ``LAW``: no such law.
    """
    settings: Any = laws.named(law).settings if isinstance(law, str) else law
    laws.settings_of(settings)  # refuses what is no law

    foresight = None
    if obstacle_info != "positions":
        foresight = Foresight(roster if obstacle_info == "tracks" else None)

    ground = outlined(scene) if poses else scene

    def ceiling(samples: SampledPath) -> Profile | None:
        return laws.profile(samples, ground if known is None else known(), law=settings)

    def limits(samples: SampledPath) -> Profile | None:
        return None

    table: dict[type, tuple[Callable[[Any], Controller], Ceiling]] = {
        PhysicalLaw: (lambda one: SafeController(scene, one, obstacle_info, foresight), ceiling),
        Constant: (lambda one: Follow(), ceiling),
        Optimum: (lambda one: Follow(), limits),
        DissertationLaw: (lambda one: ByRings(scene, one), limits),
        Rpp: (
            lambda one: Regulated(replace(scene, robot=inscribed_disc(scene.robot)) if poses else scene, one),
            limits,
        ),
    }
    make, static = table[type(settings)]
    name = getattr(settings, "name", "") or next(
        row.name for row in laws.LAWS.values() if type(row.settings) is type(settings)
    )
    return Wheel(name, make(settings), static, isinstance(settings, DissertationLaw))

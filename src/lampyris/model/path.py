"""Path: where to drive, from cell to cell or from pose to pose."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lampyris._core import elementary
from lampyris._core.arrays import cells_of, numbers_of, whole_of
from lampyris._core.predicates import numbers
from lampyris._core.values import Value
from lampyris.errors import SettingError, shown
from lampyris.model.grid import TERRAIN_UNIT
from lampyris.model.moves import Moves
from lampyris.typing import ByteGrid, Cells, Floats


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Path(Value):
    """A path from cell to cell by single steps of ``moves``.

    Parameters
    ----------
    cells : int32, (n, 2), x and y, start first, goal last; n >= 1.
    moves : the step set.
    steps : how many straights and diagonals (and knight's steps, for ``sixteen-connected``).
    paid : exact cost where the cells entered weigh differently (terrain); None: what the steps cost.

    Examples
    --------
    >>> import lampyris
    >>> scene = lampyris.Scene(lampyris.load_grid("guide"), start=(1, 8), goal=(8, 2))
    >>> path = lampyris.plan(scene, "astar").path
    >>> path.cells[0].tolist(), path.cost
    ([1, 8], 11.242640687119286)
    """

    cells: Cells
    moves: Moves
    steps: tuple[int, ...]
    paid: int | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "cells", cells_of("path", "cells", self.cells))
        if not isinstance(self.moves, Moves):
            raise SettingError("TYPE", shown(self.moves), where="path.moves", allowed="Moves")

    def _brief(self) -> str:
        ends = (
            [(x, y) for x, y in self.cells[[0, -1]].tolist()] if len(self.cells) else ["nowhere", "nowhere"]
        )
        return f"<Path of {len(self.cells)} cells from {ends[0]} to {ends[1]}, cost {self.cost:.6g}>"

    @property
    def exact(self) -> int:
        """Exact integer cost."""
        return self.moves.exact(self.steps) if self.paid is None else self.paid

    @property
    def cost(self) -> float:
        """Cost in cells of plain ground, the steps' costs summed."""
        return self.moves.value(self.exact)

    @property
    def arc(self) -> Floats:
        """Distance along the path at each node, in cells, shape (n,); a diagonal is sqrt 2 here, always."""
        d = np.diff(self.cells.astype(np.float64), axis=0)
        return np.concatenate(([0.0], np.cumsum(np.sqrt(d[:, 0] * d[:, 0] + d[:, 1] * d[:, 1]))))

    @property
    def heading(self) -> Floats:
        """Heading of the step that leaves each node (the last keeps its own), radians, y up; shape (n,)."""
        if len(self.cells) == 1:
            return np.zeros(1)
        d = np.diff(self.cells.astype(np.int64), axis=0)
        h = elementary.atan2(-d[:, 1], d[:, 0])
        return np.append(h, h[-1])


def count_steps(cells: Cells, moves: Moves) -> tuple[int, ...]:
    """How many straights, diagonals (and knight's steps, where the moves have them) a walk takes."""
    walk = np.asarray(cells).reshape(-1, 2)
    d = walk[1:] - walk[:-1]
    product = d[:, 0] * d[:, 1]
    oblique = int(np.count_nonzero(product))
    straight = len(product) - oblique
    if not moves.knight:
        return straight, oblique
    knights = int(np.count_nonzero(np.abs(product) == 2))
    return straight, oblique - knights, knights


def path_of(cells: Cells, moves: Moves, terrain: ByteGrid | None = None) -> Path:
    """A Path from its cells, on a map of that terrain (then with :meth:`Moves.weighed` moves)."""
    steps = count_steps(cells, moves)
    if terrain is None:
        return Path(cells, moves, steps)
    return Path(cells, moves, steps, int(step_costs(cells, moves, terrain).sum()))


def step_costs(cells: Cells, moves: Moves, terrain: ByteGrid | None = None) -> NDArray[np.int64]:
    """Exact cost of each step of a walk, int64, (n - 1,)."""
    walk = np.asarray(cells, dtype=np.int64).reshape(-1, 2)
    d = np.abs(np.diff(walk, axis=0))
    prices = np.array([moves.straight, moves.diagonal, moves.knight], dtype=np.int64)
    exact: NDArray[np.int64] = prices[d[:, 0] * d[:, 1]]
    if terrain is None:
        return exact
    entered = terrain[walk[1:, 1], walk[1:, 0]].astype(np.int64)
    weighed: NDArray[np.int64] = exact // TERRAIN_UNIT * (TERRAIN_UNIT + entered)
    return weighed


# ---- poses --------------------

Pose = tuple[float, float, float]
"""x, y (metres of the map frame, y up) and yaw (radians, counterclockwise from the x axis)."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class PosePath(Value):
    """Poses so dense that no point of the robot moves half a cell between two of them.

    Parameters
    ----------
    poses : float64 (n, 3): x, y (metres of the map frame, y up) and yaw (radians, in (-pi, pi]) of the base.
    gears : int8 (n - 1,): how each step between two poses is driven: 1 ahead (or sideways), -1 in reverse, 0
        turned in place.
    cost_m : what the planner minimised: length, with its prices for reversing, for changes of gear and for turning in
        place; metres.
    lower_bound_m : no path that the planner's bound speaks of costs less: of a lattice, any path in that lattice; of
        ``hybrid-astar``, any path of the robot at all; metres.
    prices : float64 (n - 1,): factors of the cost of each step, as files of motion primitives give them; None: 1.
    times : float64 (n, 2): when the robot reaches each pose and when it leaves it, seconds from the start; None: the
        planner plans no times. With times the cost is that of the time of arrival: a second of waiting costs as much
        as one of driving ahead.

    Raises
    ------
    SettingError : no pose, or arrays whose shapes do not fit; a bound above the cost.
    """

    poses: Floats
    gears: NDArray[np.int8]
    cost_m: float
    lower_bound_m: float
    prices: Floats | None = None
    times: Floats | None = None

    def __post_init__(self) -> None:
        poses = numbers_of("pose_path", "poses", self.poses, (None, 3))
        object.__setattr__(self, "poses", poses)
        gears = whole_of("pose_path", "gears", self.gears, (max(len(poses) - 1, 0),)).astype(np.int8)
        gears.setflags(write=False)
        object.__setattr__(self, "gears", gears)
        if self.prices is not None:
            prices = numbers_of("pose_path", "prices", self.prices, (max(len(poses) - 1, 0),))
            object.__setattr__(self, "prices", prices)
        if self.times is not None:
            times = numbers_of("pose_path", "times", self.times, (len(poses), 2))
            object.__setattr__(self, "times", times)
            if (np.diff(times.ravel()) < 0).any():
                raise SettingError(
                    "ARRAY", "a time before the last one", where="pose_path.times", allowed="rising times"
                )
        if len(poses) == 0:
            raise SettingError("ARRAY", "no pose", where="pose_path.poses", allowed="at least one")
        costs = numbers((self.lower_bound_m, self.cost_m), (2,))
        if costs is None or not 0 <= costs[0] <= costs[1] < math.inf:
            raise SettingError(
                "ARRAY",
                f"{shown(self.lower_bound_m)} and {shown(self.cost_m)}",
                where="pose_path.lower_bound_m",
                allowed="0 to cost_m",
            )

    def _brief(self) -> str:
        return f"<PosePath of {len(self.poses)} poses, {self.length_m:.6g} m, {self.reversals} reversals>"

    @property
    def length_m(self) -> float:
        """Distance that the base drives, metres, forwards and in reverse."""
        return math.fsum(self.step_lengths.tolist())

    @property
    def step_lengths(self) -> Floats:
        """Length of the arc of each step, metres, float64 (n - 1,)."""
        d = np.diff(self.poses, axis=0)
        chord = np.sqrt(d[:, 0] * d[:, 0] + d[:, 1] * d[:, 1])
        half = np.abs(np.remainder(d[:, 2] + np.pi, 2 * np.pi) - np.pi) / 2
        bent = half > 1e-9
        return np.where(
            bent, chord * np.where(bent, half, 1.0) / np.where(bent, elementary.sin(half), 1.0), chord
        )

    @property
    def turned_in_place(self) -> float:
        """Radians turned in place, either way."""
        turn = np.remainder(np.diff(self.poses[:, 2]) + np.pi, 2 * np.pi) - np.pi
        return math.fsum(np.abs(turn[self.gears == 0]).tolist())

    def steps_in(self, arm: float) -> Floats:
        """Length of each step where a radian turned in place counts as ``arm`` metres; metres, float64 (n - 1,)."""
        turn = np.remainder(np.diff(self.poses[:, 2]) + np.pi, 2 * np.pi) - np.pi
        return np.where(self.gears == 0, np.abs(turn) * arm, self.step_lengths)

    def yaw_at(self, s: Floats, arm: float = 0.0) -> Floats:
        """Yaw (radians, in (-pi, pi]) at distances, metres; of a turn that has no length, that after it.

        Parameters
        ----------
        arm : metres that a radian turned in place counts as.
        """
        ends = np.concatenate(([0.0], np.cumsum(self.steps_in(arm))))
        yaw = np.unwrap(self.poses[:, 2])
        at = np.clip(np.searchsorted(ends, s, side="right") - 1, 0, max(len(ends) - 2, 0))
        if len(ends) == 1:
            return np.full(np.shape(s), self.poses[0, 2])
        length = ends[at + 1] - ends[at]
        share = np.where(length > 0, (s - ends[at]) / np.where(length > 0, length, 1.0), 1.0)
        turned = yaw[at] + np.clip(share, 0.0, 1.0) * (yaw[at + 1] - yaw[at])
        return math.pi - np.remainder(math.pi - turned, 2 * math.pi)

    def gear_at(self, s: Floats, arm: float = 0.0) -> NDArray[np.int64]:
        """How it is driven at distances, metres: 1 ahead, -1 in reverse, 0 in place; of a change, what comes after it.

        Parameters
        ----------
        arm : metres that a radian turned in place counts as; 0: turns in place are left out.
        """
        lengths = self.steps_in(arm)
        driven = lengths > 0
        if not driven.any():
            return np.zeros(len(s), dtype=np.int64)
        ends = np.cumsum(lengths[driven])
        at = np.minimum(np.searchsorted(ends, s + 1e-9 * ends[-1], side="right"), len(ends) - 1)
        gears: NDArray[np.int64] = self.gears[driven][at].astype(np.int64)
        return gears

    @property
    def reversals(self) -> int:
        """How often it changes between driving ahead and in reverse."""
        driven = self.gears[self.gears != 0]
        return int(np.count_nonzero(np.diff(driven)))

    @property
    def bound(self) -> float:
        """The cost is so many times its lower bound, and so at most so many times the least; 1.0: it is the least."""
        if self.cost_m == self.lower_bound_m:
            return 1.0
        return self.cost_m / self.lower_bound_m if self.lower_bound_m > 0 else math.inf

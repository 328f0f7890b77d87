"""Tasks of episodes: goals with their exact fields, and the starts from which each can be reached."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lampyris._core.limits import MEMORY
from lampyris._core.scalars import MAX_SEED, SEED_RANGE, is_whole
from lampyris.errors import SceneError, SettingError, of_kind, shown
from lampyris.kernels.episodes.cells import LCG_MODULUS
from lampyris.kernels.simulation.draws import GOLDEN
from lampyris.model.field import Field
from lampyris.model.moves import Moves
from lampyris.model.scene import Scene
from lampyris.planning.field.layers import free_space, largest_region, moves_for
from lampyris.planning.field.many import solve_many
from lampyris.sim.traffic.obstacle_draws import mixed
from lampyris.typing import BoolGrid, Cell

MAX_GOALS = 4096
"""Most goals of one environment; each has a field of its own."""
MAX_EPISODES = 1_000_000
"""Most episodes at a time."""
_EACH = 16
"""Bytes of a cell for each goal."""
_STEPS = ("octile", "dissertation", "four-connected")


@dataclass(frozen=True, slots=True, eq=False)
class Tasks:
    """Where episodes begin and end.

    Parameters
    ----------
    scene : the map, the robot and its moves.
    free : where the robot's centre may be.
    fields : of each goal.
    starts : flat indices (y * width + x) of the starts of each goal.
    """

    scene: Scene
    free: BoolGrid
    moves: Moves
    fields: tuple[Field, ...]
    starts: tuple[NDArray[np.int64], ...]

    @classmethod
    def of(cls, scene: Scene, goals: int, random_start: bool, seed: int) -> Tasks:
        """Tasks on the map of a scene.

        Parameters
        ----------
        goals : how many goals are drawn from the largest free region; 0: the goal of the scene.
        random_start : whether episodes begin at any cell from which the goal can be reached, drawn each time, rather
            than at the start of the scene.
        seed : of the goals.

        Raises
        ------
        SceneError : a blocked goal, or a start from which the goal cannot be reached.
        SettingError : ``MOVES``, or an argument out of its range.
        LimitError : more memory than is allowed.
        """
        of_kind("scene", scene, Scene)
        of_kind("random_start", random_start, bool)
        if not is_whole(goals) or not 0 <= goals <= MAX_GOALS:
            allowed = f"a whole number from 0 to {MAX_GOALS:,}"
            raise SettingError("EPISODE_SETTING", shown(goals), where="goals", allowed=allowed)
        if not is_whole(seed, 0, MAX_SEED):
            raise SettingError("SEED", shown(seed), where="task_seed", allowed=SEED_RANGE)
        if goals and not random_start:
            raise SettingError(
                "EPISODE_SETTING", "False", where="random_start", allowed="True with goals that are drawn"
            )
        if scene.moves.name not in _STEPS:
            raise SettingError.of("MOVES", "moves", shown(scene.moves.name), allowed=", ".join(_STEPS))
        needed = max(goals, 1) * scene.grid.blocked.size * _EACH
        MEMORY.demand(-(-needed // 2**20), f"{max(goals, 1)} fields", instead="have fewer goals")
        free, moves = free_space(scene), moves_for(scene)
        wanted: list[Cell] = [scene.goal]
        if goals:
            region = largest_region(free)
            if len(region) < 2:
                raise SceneError("GOAL_OCCUPIED", "no two free cells are connected", where="map")
            rng = np.random.Generator(np.random.PCG64(seed))
            drawn = region[rng.integers(len(region), size=goals)]
            wanted = [(int(x), int(y)) for x, y in drawn]
        fields = tuple(solve_many(free, moves, wanted, terrain=scene.grid.terrain))
        x, y = scene.start
        own = np.array([y * scene.grid.width + x], dtype=np.int64)
        starts = tuple(
            np.flatnonzero(f.exact.ravel() > 0).astype(np.int64) if random_start else own for f in fields
        )
        for field, there in zip(fields, starts, strict=True):
            if not len(there) or field.exact.ravel()[there[0]] <= 0:
                what = f"the goal {field.goal} cannot be reached from {'any cell' if random_start else scene.start}"
                raise SceneError(
                    "NO_PATH", what, where="scenario", allowed="a start that a path joins to another cell"
                )
        return cls(scene, free, moves, fields, starts)


@dataclass(frozen=True, slots=True, eq=False)
class BorderedTasks:
    """Tasks as the kernels take them: the map with a border of blocked cells, flat.

    Parameters
    ----------
    width : of a row, with the border.
    border : cells on each side.
    shut : float32: 1 where the robot's centre may not be.
    starts, first, goals : see :func:`lampyris.kernels.episodes.cells.step_cells`.
    """

    width: int
    border: int
    shut: NDArray[np.float32]
    starts: NDArray[np.int64]
    first: NDArray[np.int64]
    goals: NDArray[np.int64]

    @classmethod
    def of(cls, tasks: Tasks, border: int) -> BorderedTasks:
        """With a border of so many cells."""
        columns = tasks.scene.grid.width
        width = columns + 2 * border
        starts = [(s // columns + border) * width + s % columns + border for s in tasks.starts]
        first = np.concatenate(([0], np.cumsum([len(s) for s in starts]))).astype(np.int64)
        goals = np.array(
            [(f.goal[1] + border) * width + f.goal[0] + border for f in tasks.fields], dtype=np.int64
        )
        return cls(
            width, border, bordered((~tasks.free).astype(np.float32), border, 1.0),
            np.concatenate(starts).astype(np.int64), first, goals,
        )  # fmt: skip

    def cells(self, index: NDArray[np.int64]) -> NDArray[np.int64]:
        """Cells (x, y) of indices; int64 (n, 2)."""
        return np.stack((index % self.width - self.border, index // self.width - self.border), axis=1)


def bordered(values: NDArray[Any], border: int, outside: float) -> NDArray[Any]:
    """An array of the map with a border around it, flat."""
    return np.pad(values, border, constant_values=outside).ravel()


def generators(seeds: NDArray[np.uint64]) -> NDArray[np.int64]:
    """States of the kernels' generators from seeds, by SplitMix64 (Steele, Lea, Flood 2014); int64 (n,)."""
    with np.errstate(over="ignore"):
        z = mixed(seeds.astype(np.uint64) + np.uint64(GOLDEN))
    return (z % np.uint64(LCG_MODULUS - 1) + np.uint64(1)).astype(np.int64)

"""Tracks: the obstacles of a world drawn once, without the robot, the same for all planners.

The traffic of the simulator itself moves them (:mod:`lampyris.sim.traffic.traffic`), with the world's seed, in a
world where the robot stands on the start and never leaves it. That robot has no effect: nobody of our own
making ever covers a cell that the robot covers at its start or goal, whether it is there or not, and nobody
crosses the path of one that does not move. So nothing that a planner does is in these tracks, and one world
has one set of them.

In a run they are :class:`lampyris.model.traffic.Recorded`: they wait for nobody. A robot that stands in the
path of one is hit.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from lampyris.errors import SettingError
from lampyris.model.scene import Scene
from lampyris.model.traffic import Obstacle, RandomWalk, Recorded
from lampyris.sim.grid.random_walkers import RandomWalkers, alone
from lampyris.sim.traffic.recorded import check_tracks
from lampyris.sim.traffic.traffic import Traffic, open_traffic
from lampyris.sim.world.cell_index import CellIndex, obstacle_shape, robot_shape
from lampyris.sim.world.world import Occupancy
from lampyris.typing import Cells

AT_ONCE = 64
"""Ticks drawn beyond those that were asked for: asking is a little more each time."""


class Replay:
    """The tracks of one world, drawn as far as they are asked for.

    Parameters
    ----------
    scene : where, with its traffic as it is specified.
    seed : of the world.

    Attributes
    ----------
    obstacles : what each obstacle is to a run: ``recorded``.

    Raises
    ------
    SettingError : ``TRAFFIC_RATE``: walkers that appear later; a recorded obstacle is there from tick 0.
    SceneError, LimitError : obstacles that do not fit: see :func:`lampyris.sim.traffic.traffic.open_traffic`.
    """

    def __init__(self, scene: Scene, seed: int) -> None:
        for spec in scene.traffic:
            if isinstance(spec, RandomWalk) and spec.rate is not None:
                raise SettingError(
                    "TRAFFIC_RATE",
                    f"a rate of {spec.rate:g} with replayed tracks",
                    allowed="tracks: live, or no rate: a replayed obstacle is there from tick 0",
                )
        self.scene = scene
        self._space = CellIndex(scene.grid)
        world = Occupancy(self._space, robot_shape(scene, self._space), self._space.number(scene.start))
        self._robot_cover = world.robot_cover
        traffic = open_traffic(scene, world, seed)
        self._advance: Callable[[int, int], NDArray[np.int64]]
        self._advance = _by_kernel(traffic) if alone(scene) else _one_by_one(traffic)
        self.obstacles = tuple(
            Obstacle("recorded", b.radius, False, b.footprint, b.outline) for b in traffic.obstacles
        )
        self._cells = self._as_cells(np.array([world.where], dtype=np.int64))

    def upto(self, ticks: int) -> Cells:
        """Where all obstacles are from tick 0 to ``ticks``; int32 (ticks + 1, obstacles, 2)."""
        over = len(self._cells)
        if ticks >= over:
            more = self._as_cells(self._advance(over, ticks + AT_ONCE))
            self._cells = np.concatenate((self._cells, more))
        return self._cells[: ticks + 1]

    def recorded(self, ticks: int) -> tuple[Recorded, ...]:
        """The same as obstacles of a scene, checked once more as every recorded track is."""
        at = self.upto(ticks).transpose(1, 0, 2).tolist()
        made = tuple(
            Recorded(tuple((x, y) for x, y in track), obstacle.radius, obstacle.outline)
            for track, obstacle in zip(at, self.obstacles, strict=True)
        )
        radii = dict.fromkeys(one.radius for one in made)
        of_radius = {
            r: obstacle_shape(self.scene.grid, self.scene.moves, self._space, r, None) for r in radii
        }
        shapes = [of_radius[one.radius] for one in made]
        check_tracks(self._space, list(zip(range(len(made)), made, shapes, strict=True)), self._robot_cover)
        return made

    def _as_cells(self, numbers: NDArray[np.int64]) -> Cells:
        y, x = np.divmod(numbers.reshape(-1, len(self.obstacles)), self._space.stride)
        return np.stack((x - 1, y - 1), axis=-1).astype(np.int32)


def _by_kernel(traffic: Traffic) -> Callable[[int, int], NDArray[np.int64]]:
    walkers = RandomWalkers(traffic)
    return lambda first, end: walkers.go(end - first)


def _one_by_one(traffic: Traffic) -> Callable[[int, int], NDArray[np.int64]]:
    def advance(first: int, end: int) -> NDArray[np.int64]:
        where = []
        for tick in range(first, end):
            traffic.advance(tick)
            where.append(list(traffic.world.where))
        return np.array(where, dtype=np.int64)

    return advance

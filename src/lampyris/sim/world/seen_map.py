"""Seen map: what a robot with a sensor knows of the walls, and what its planner is given of them.

The planner's session is opened on the map as it is known at tick 0: the walls that the robot sees from its start, and
free cells everywhere else. From then on it hears of walls through ``Change.blocked`` alone, so nothing that a planner
computes or keeps comes from a wall that has not been seen. Where unseen cells cost more, the planner is given terrain: that
of the map where cells have been seen, a multiple of its price elsewhere, and what changes of it through
``Change.terrain``. The robot looks at the end of each tick in which it moved, from
where it stands and in the direction of its move. Its planner is asked in the next tick if a new wall forbids a step of its
path; where unseen cells cost more, if any cell is new.

Terrain and speed zones are known from the beginning. Moving obstacles are reported wherever they are, as in every
simulation: the sensor is about walls.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from lampyris._core.defaults import UNSEEN_COST
from lampyris._core.elementary import direction
from lampyris.kernels.motion.visibility import sensed
from lampyris.model.change import Change
from lampyris.model.grid import MAX_TERRAIN, TERRAIN_UNIT, Grid, frozen
from lampyris.model.scene import Scene
from lampyris.model.settings.sensor import FULL_TURN, Sensor
from lampyris.planning.field.footprint import footprint
from lampyris.planning.field.layers import moves_for
from lampyris.planning.living_map import LivingMap
from lampyris.sim.world.cell_index import passed
from lampyris.typing import BoolGrid, ByteGrid, Cell

FOUND = "Walls seen on the path; replanned."
PRICED = "Cells seen, which cost less now, or are walls; replanned."


def bumper_reach(scene: Scene) -> int:
    """Columns and rows around the robot's cell within which its next step can touch a cell."""
    offsets = footprint(scene.robot.radius, scene.grid.resolution)
    return max(max(abs(dx), abs(dy)) for dx, dy in offsets) + scene.moves.reach


class SeenMap:
    """The walls that have been seen.

    Parameters
    ----------
    scene : as it really is.
    sensor : what sees.
    near : columns and rows within which every cell is seen; None: those that the next step of a simulation in ticks can touch.

    Attributes
    ----------
    scene : as it is known now: the scene with the walls seen so far, and no edits.
    given : the same as the planner is given it, with what unseen cells cost in its terrain.
    seen : int32 (height * width,); the tick at which each cell was first seen, -1 never.
    cells : how many have been seen.
    """

    def __init__(self, scene: Scene, sensor: Sensor, near: int | None = None) -> None:
        grid = scene.grid
        self._opaque = frozen(grid.blocked.ravel())
        self._width, self._height = grid.width, grid.height
        self.seen = np.full(grid.blocked.size, -1, dtype=np.int32)
        self._near = bumper_reach(scene) if near is None else near
        # What is a whole number of cells, but for rounding, is within the range; no map is wider than the rest.
        far = min(sensor.range_m / grid.resolution, float(grid.width + grid.height))
        self._limit = int(far * far * (1.0 + 1e-9))
        wide = 2 * max(int(far) + 1, self._near) + 1
        self._found = np.zeros(min(wide * wide, int(np.count_nonzero(grid.blocked)) + 1), dtype=np.int64)
        self._least = direction(0.5 * sensor.field_of_view)[0]
        self._ahead = sensor.field_of_view < FULL_TURN
        self.cells = 0
        self._known: BoolGrid = np.zeros_like(grid.blocked)
        self.ground: tuple[tuple[Cell, int], ...] = ()
        """The free cells that were seen last, with their terrain value; none where unseen cells cost no more."""
        self._priced: ByteGrid | None = None
        if sensor.unseen_cost != UNSEEN_COST:
            self._real = np.zeros(grid.blocked.shape, np.uint8) if grid.terrain is None else grid.terrain
            self._priced = priced(self._real, sensor.unseen_cost)
        self.given = self.scene = replace(scene, edits=())
        first = self._look(scene.start, (0, 0), 0)
        self._show(first)
        self._living = LivingMap(self.scene)
        moves = moves_for(scene)
        self._sides = not moves.corner_cutting
        self._route: Sequence[Cell] = ()
        self._touched: frozenset[Cell] = frozenset()

    def look(self, robot: Cell, heading: Cell, tick: int) -> list[Cell]:
        """Look around at the end of a tick; the walls that are seen for the first time.

        Parameters
        ----------
        robot : where it stands.
        heading : its last move; (0, 0): none yet.
        """
        walls = self._look(robot, heading, tick)
        if walls or self.ground:
            self._show(walls)
        return walls

    @property
    def prices(self) -> bool:
        """Whether unseen cells cost more than seen ones."""
        return self._priced is not None

    def cuts(self, walls: Sequence[Cell], route: Sequence[Cell]) -> bool:
        """Take new walls into the robot's free space; whether they forbid a step of a path that was free before."""
        closed = self._living.take(Change(blocked=tuple(walls)))
        if route is not self._route:
            self._route, self._touched = route, frozenset(self._touches(route))
        return not self._touched.isdisjoint(closed)

    def _touches(self, route: Sequence[Cell]) -> list[Cell]:
        """Every cell that has to be free for a path: where it goes, and what its diagonal and long steps pass."""
        cells = list(route)
        for (x, y), (u, v) in pairwise(route):
            dx, dy = u - x, v - y
            if abs(dx * dy) == 2:
                cells += [(x + sx, y + sy) for sx, sy in passed(dx, dy)]
            elif dx and dy and self._sides:
                cells += [(u, y), (x, v)]
        return cells

    def _look(self, robot: Cell, heading: Cell, tick: int) -> list[Cell]:
        hx, hy = heading if self._ahead else (0, 0)
        walls, cells = sensed(
            self._opaque, self.seen, self._width, self._height, *robot, tick, self._limit, self._near, hx, hy,
            self._least, self._found,
        )  # fmt: skip
        self.cells += int(cells)
        numbers = self._found[: int(walls)].tolist()
        self.ground = () if self._priced is None else self._uncover(tick)
        return [(number % self._width, number // self._width) for number in numbers]

    def _uncover(self, tick: int) -> tuple[tuple[Cell, int], ...]:
        """Give the cells that were seen at this tick their own terrain again; those that are free."""
        assert self._priced is not None
        fresh = np.flatnonzero(self.seen == tick)
        fresh = fresh[~self._opaque[fresh]]
        rows, columns = np.divmod(fresh, self._width)
        values = self._real[rows, columns]
        self._priced[rows, columns] = values
        cells = zip(columns.tolist(), rows.tolist(), strict=True)
        return tuple(zip(cells, values.tolist(), strict=True))

    def _show(self, walls: Sequence[Cell]) -> None:
        """The scene as it is known, with these walls too."""
        for x, y in walls:
            self._known[y, x] = True
        given = self.scene.grid
        grid = Grid(
            self._known.copy(), resolution=given.resolution, origin=given.origin, name=given.name, terrain=given.terrain
        )  # fmt: skip
        self.given = self.scene = replace(self.scene, grid=grid)
        if self._priced is not None:
            self.given = replace(self.scene, grid=replace(grid, terrain=self._priced.copy()))


def priced(terrain: ByteGrid, factor: float) -> ByteGrid:
    """The terrain value at which each cell costs ``factor`` times what it does, to the nearest 63rd, at most the highest."""
    costs = np.floor((TERRAIN_UNIT + terrain.astype(np.float64)) * factor + 0.5) - TERRAIN_UNIT
    values: ByteGrid = np.minimum(costs, MAX_TERRAIN).astype(np.uint8)
    return values

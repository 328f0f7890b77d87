"""Placing: where obstacles stand at tick 0 and which routes they drive."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from lampyris.errors import SceneError
from lampyris.kernels.simulation.draws import ROUTE
from lampyris.model.grid import GridKey
from lampyris.model.moves import MOVES, Moves
from lampyris.model.scene import Scene
from lampyris.model.traffic import Crossing, Patrol, RandomWalk, Recorded
from lampyris.planning.field.footprint import footprint
from lampyris.planning.field.solve import solve
from lampyris.sim.traffic.obstacle_draws import (
    CROSSING,
    WALKERS,
    first_of,
    key_of,
    places,
    places_of_one_cell,
    uniforms,
)
from lampyris.sim.traffic.recorded import check_tracks
from lampyris.sim.world.cell_index import KEPT, SMALL_CELLS, CellIndex, Shape, obstacle_shape, shared
from lampyris.sim.world.world import Occupancy
from lampyris.typing import BoolGrid, Cell, Floats

_TRIES = 200
"""Draws for the path of one crossing obstacle before the map is called full."""

_NUMBERS = 2 + 2 * 33
"""Numbers of each draw: axis and direction; for either end 16 places and one that decides among all."""


class Placing:
    """Where all obstacles stand at tick 0.

    Places are held in a world of its own, so that the order of placing need not be the order of indices.
    """

    def __init__(self, scene: Scene, world: Occupancy, seed: int) -> None:
        self.scene = scene
        self.space: CellIndex = world.space
        self.trial = Occupancy(world.space, world.robot_shape, world.robot)
        # The first crossing specification draws the same wherever it stands among the others.
        self._keys: list[int] = []
        for k, spec in enumerate(scene.traffic):
            number = sum(type(one) is type(spec) for one in scene.traffic[:k])
            kind = {RandomWalk: WALKERS, Crossing: CROSSING}.get(type(spec))
            self._keys.append(0 if kind is None else key_of(seed, kind, number))
        self._shapes: dict[float, Shape] = {}
        self._regions: dict[float, BoolGrid] = {}
        self._held: list[int] = []
        recorded = [(k, s) for k, s in enumerate(scene.traffic) if isinstance(s, Recorded)]
        radii = dict.fromkeys(s.radius for _, s in recorded)
        shapes = {r: obstacle_shape(scene.grid, scene.moves, world.space, r, None) for r in radii}
        tracks = [(k, s, shapes[s.radius]) for k, s in recorded]
        self._recorded = [s for _, s in recorded]
        self._world = world
        self.lanes = check_tracks(world.space, tracks, self.trial.robot_cover) if tracks else None
        """Every cell that a recorded track ever covers; bool (height, width). None: there is no track."""

    @cached_property
    def _kept_clear(self) -> BoolGrid:
        """Cells that no obstacle of our own making covers; bool (height, width)."""
        shape = self.scene.grid.height, self.scene.grid.width
        kept_clear = np.zeros(shape, dtype=np.bool_) if self.lanes is None else self.lanes.copy()
        for end in (self.scene.start, self.scene.goal):
            for c in self._world.robot_shape.cover(self.space.number(end)):
                x, y = self.space.cell(c)
                kept_clear[y, x] = True
        return kept_clear

    def key(self, k: int) -> int:
        """The key of the draws of specification k."""
        return self._keys[k]

    def shape(self, radius: float) -> Shape:
        """The shape of obstacles of that radius (one for all of a kind: it remembers steps)."""
        if radius not in self._shapes and not self._recorded and shared(self.scene):
            # Where obstacles may be depends on the map and the robot's ends alone.
            ends = self.scene.start, self.scene.goal, self.scene.robot.radius
            bars = self._world.lane_bars(self._recorded, radius)
            if bars is None:
                self._shapes[radius] = _kept_shape(GridKey(self.scene.grid), *ends, self.scene.moves, radius)
        if radius not in self._shapes:
            bars = self._world.lane_bars(self._recorded, radius)
            grid, moves = self.scene.grid, self.scene.moves
            like = None if grid.blocked.size <= SMALL_CELLS else self._world.robot_shape
            self._shapes[radius] = obstacle_shape(
                grid, moves, self.space, radius, self._kept_clear, bars, like
            )
        return self._shapes[radius]

    def hold(self, k: int, shape: Shape, number: int) -> None:
        """Keep a place for specification k."""
        self.trial.add(shape, number)
        self._held.append(k)

    def given(self) -> dict[int, list[int]]:
        """Hold what stands where it must: tracks, walkers that begin on given cells, patrols. By
        specification: the cells of its obstacles, or the route of the patrol.
        """
        found: dict[int, list[int]] = {}
        for k, spec in enumerate(self.scene.traffic):
            if isinstance(spec, Recorded):
                found[k] = [self.space.number(spec.track[0])]
                self.hold(k, self.shape(spec.radius), found[k][0])
        for k, spec in enumerate(self.scene.traffic):
            if isinstance(spec, RandomWalk):
                found[k] = [self._start(k, spec, cell) for cell in spec.starts]
        for k, spec in enumerate(self.scene.traffic):
            if isinstance(spec, Patrol):
                found[k] = self.patrol(k, spec)
        return found

    def _start(self, k: int, spec: RandomWalk, cell: Cell) -> int:
        """Hold the given cell of a random walker."""
        shape, number = self.shape(spec.radius), self.space.number(cell)
        if not shape.is_open(number):
            x, y = cell
            why = "meets a wall" if not shape.free[y, x] else "covers the start, the goal or a recorded lane"
            raise SceneError(
                "OBSTACLE_START",
                f"obstacle {k} {why} where it begins, {cell}",
                allowed="cells where the obstacle's whole footprint is free",
            )
        self._hold_apart(k, shape, number, cell)
        return number

    def _hold_apart(self, k: int, shape: Shape, number: int, cell: Cell) -> None:
        """Hold a place, if nobody is there.

        Raises
        ------
        SceneError : ``OBSTACLE_START``, ``OBSTACLE_OVERLAP``: another obstacle is.
        """
        cover = shape.cover(number)
        if self.trial.robot_cover.intersection(cover):
            raise SceneError("OBSTACLE_START", f"obstacle {k} is on the robot at t = 0, {cell}")
        other = next((self.trial.taken[c] for c in cover if c in self.trial.taken), None)
        if other is not None:
            raise SceneError(
                "OBSTACLE_OVERLAP",
                f"obstacles {self._held[other]} and {k} are in one cell at {cell}, t = 0",
                allowed="first cells that are apart",
            )
        self.hold(k, shape, number)

    def patrol(self, k: int, spec: Patrol) -> list[int]:
        """The route of a patrol through all its waypoints."""
        shape = self.shape(spec.radius)
        route = [self.space.number(spec.waypoints[0])]
        for t, (x, y) in enumerate(spec.waypoints):
            if not shape.open[y, x]:
                why = (
                    "meets a wall"
                    if not shape.free[y, x]
                    else "covers the start, the goal or a recorded lane"
                )
                raise SceneError(
                    "OBSTACLE_TRACK",
                    f"obstacle {k} {why} at waypoint {t}, ({x}, {y})",
                    allowed="waypoints where the obstacle's whole footprint is free",
                )
        for t, (a, b) in enumerate(zip(spec.waypoints, spec.waypoints[1:], strict=False), 1):
            path = self.shortest_path(shape, a, b)
            if path is None:
                raise SceneError(
                    "OBSTACLE_TRACK",
                    f"obstacle {k} cannot reach waypoint {t}, {b}, from {a}",
                    allowed="waypoints joined by free cells",
                )
            route += path[1:]
        self._hold_apart(k, shape, route[0], spec.waypoints[0])
        return route

    def crossing(self, k: int, spec: Crossing) -> list[list[int]]:
        """The routes of crossing obstacles, drawn for each from draws of its own."""
        if spec.count == 0:
            return []
        shape = self.shape(spec.radius)
        if spec.radius not in self._regions:
            self._regions[spec.radius] = _region(self.scene, shape)
        sides = _sides(self._regions[spec.radius])
        routes: list[list[int]] = []
        for own in range(spec.count):
            route = self._draw_route(shape, sides, self.key(k), own)
            if route is None:
                raise self._full(k, "crossing obstacles", len(routes), spec.count)
            self.hold(k, shape, route[0])
            routes.append(route)
        return routes

    def _draw_route(
        self, shape: Shape, sides: tuple[tuple[_Side, _Side], tuple[_Side, _Side]], key: int, own: int
    ) -> list[int] | None:
        who = np.array([own], dtype=np.int64)
        for turn in range(_TRIES):
            count = np.arange(turn * _NUMBERS, (turn + 1) * _NUMBERS, dtype=np.int64)
            u = uniforms(key, ROUTE, who, count)
            near, far = sides[int(u[0] * 2.0)]
            if not len(near.cells):
                return None
            if u[1] < 0.5:
                near, far = far, near
            half = _NUMBERS // 2
            a, b = near.draw(u[2 : half + 1]), far.draw(u[half + 1 :])
            if self.trial.fits(shape, self.space.number(a)):
                path = self.shortest_path(shape, a, b)
                if path is not None:
                    return path
        return None

    def walkers(self, k: int, spec: RandomWalk) -> list[int]:
        """Places of random walkers without given ones: each uniformly among the cells that are legal when it
        is put.
        """
        shape, given = self.shape(spec.radius), len(spec.starts)
        size, count = (self.space.width, self.space.height), spec.count - given
        if shape.small and size[0] * size[1] <= SMALL_CELLS:
            found = places_of_one_cell(self.key(k), given, count, size, self.trial.opened(shape))
            if k + 1 < len(self.scene.traffic):  # behind the last nobody asks where they are
                self._held += [k] * len(self.trial.add_small(shape, found))
        else:
            drawn = places(
                self.key(k), given, count, size,
                lambda number: shape.is_open(number) and self.trial.fits(shape, number),
                lambda: self.space.numbers(self.trial.room(shape)),
            )  # fmt: skip
            found = []
            for number in drawn:
                self.hold(k, shape, number)
                found.append(number)
        if len(found) < spec.count - given:
            raise self._full(k, "random walkers", given + len(found), spec.count)
        return found

    def shortest_path(self, shape: Shape, a: Cell, b: Cell) -> list[int] | None:
        """A shortest path from a to b as cell numbers, or None. At corners bars count as walls."""
        moves = MOVES["dissertation" if shape.corner_cutting else "octile"]
        field = solve(shape.open, moves, b, stop=a)
        if field.exact[a[1], a[0]] < 0:
            return None
        (x, y), path = a, [self.space.number(a)]
        while (x, y) != b:
            dx, dy = moves.offsets[int(field.step[y, x])]
            x, y = x + dx, y + dy
            path.append(self.space.number((x, y)))
        return path

    def _full(self, k: int, what: str, fit: int, count: int) -> SceneError:
        return SceneError(
            "OBSTACLE_ROOM",
            f"obstacle specification {k}: {fit} of {count} {what} fit on the map",
            allowed="no more than the map has room for",
            todo="ask for fewer or smaller ones",
            setting="traffic.count",
        )


@lru_cache(maxsize=KEPT)
def _kept_shape(key: GridKey, start: Cell, goal: Cell, robot: float, moves: Moves, radius: float) -> Shape:
    """The shape of obstacles that keep clear of the robot's start and goal, and of nothing else."""
    grid = key.grid
    space, clear = CellIndex(grid), np.zeros(grid.blocked.shape, dtype=np.bool_)
    for x, y in (start, goal):
        for dx, dy in footprint(robot, grid.resolution):
            if grid.contains((x + dx, y + dy)):
                clear[y + dy, x + dx] = True
    return obstacle_shape(grid, moves, space, radius, clear)


def _region(scene: Scene, shape: Shape) -> BoolGrid:
    """The open cells that connect with the start or with the goal: the greater of the two regions.

    Where both are in walls, with the first free cell: nobody will drive there, but it is no mistake.
    """
    moves = MOVES["dissertation" if shape.corner_cutting else "octile"]
    free = shape.free
    seeds = [c for c in (scene.start, scene.goal) if free[c[1], c[0]]]
    if not seeds:
        ys, xs = np.nonzero(free)
        seeds = [(int(xs[0]), int(ys[0]))] if len(xs) else []
    greatest = np.zeros_like(free)
    for x, y in seeds:
        if not greatest[y, x]:
            region = solve(free, moves, (x, y)).exact >= 0
            if np.count_nonzero(region) > np.count_nonzero(greatest):
                greatest = region
    return greatest & shape.open


@dataclass(frozen=True, eq=False)
class _Side:
    """The cells of a region near one side of it.

    Attributes
    ----------
    cells : int64, (n, 2), row by row.
    corner, size : the strip of the map that holds them: its first x and y, its width and height.
    inside : bool, (height, width) of the map: which cells they are.
    """

    cells: NDArray[np.int64]
    corner: Cell
    size: Cell
    inside: BoolGrid

    def draw(self, u: Floats) -> Cell:
        """A cell drawn uniformly. A cell more or less on this side moves nobody who is not on it.

        Parameters
        ----------
        u : numbers in [0, 1), an odd count; pairs are a place in the strip each, the last decides among all.
        """
        for across, down in zip(u[:-1:2].tolist(), u[1:-1:2].tolist(), strict=True):
            x, y = self.corner[0] + int(across * self.size[0]), self.corner[1] + int(down * self.size[1])
            if self.inside[y, x]:
                return x, y
        numbers = self.cells[:, 1] * self.inside.shape[1] + self.cells[:, 0]
        y, x = divmod(first_of(numbers, float(u[-1])), self.inside.shape[1])
        return x, y


def _sides(region: BoolGrid) -> tuple[tuple[_Side, _Side], tuple[_Side, _Side]]:
    """Left and right, top and bottom: the cells of the region within its outer tenths."""
    ys, xs = np.nonzero(region)
    height, width = region.shape
    out = []
    for along, across in ((xs, False), (ys, True)):
        low, high = (int(along.min()), int(along.max())) if len(xs) else (0, 0)
        depth = max((high - low + 1) // 10, 1)
        pair = []
        for begin, side in ((low, along < low + depth), (high + 1 - depth, along > high - depth)):
            inside = np.zeros_like(region)
            inside[ys[side], xs[side]] = True
            corner, size = ((0, begin), (width, depth)) if across else ((begin, 0), (depth, height))
            cells = np.stack((xs[side], ys[side]), axis=1).astype(np.int64)
            pair.append(_Side(cells, corner, size, inside))
        out.append((pair[0], pair[1]))
    return out[0], out[1]

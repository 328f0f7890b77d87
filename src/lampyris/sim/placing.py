"""Placing: where obstacles stand at tick 0 and which routes they drive."""

from __future__ import annotations

import numpy as np

from lampyris.errors import SceneError
from lampyris.field.solve import solve
from lampyris.model.moves import MOVES
from lampyris.model.scene import Scene
from lampyris.model.traffic import Crossing, Patrol, RandomWalk, Recorded
from lampyris.sim.recorded import check_tracks
from lampyris.sim.space import Shape, Space, body_shape
from lampyris.sim.world import World
from lampyris.typing import BoolGrid, Cell

_TRIES = 200
"""Draws for the way of one crossing obstacle before the map is called full."""


class Placing:
    """Where everybody stands at tick 0.

    Places are held in a world of its own, so that the order of placing need not be the order of indices.
    """

    def __init__(self, scene: Scene, world: World, seed: int) -> None:
        self.scene = scene
        self.space: Space = world.space
        self.trial = World(world.space, world.robot_shape, world.robot)
        self._streams = [
            np.random.Generator(np.random.PCG64(np.random.SeedSequence((seed, 1 + k))))
            for k in range(len(scene.traffic))
        ]
        self._shapes: dict[float, Shape] = {}
        self._regions: dict[float, BoolGrid] = {}
        self._held: list[int] = []
        kept_clear = np.zeros((scene.grid.height, scene.grid.width), dtype=np.bool_)
        for end in (scene.start, scene.goal):
            for c in world.robot_shape.cover(world.space.number(end)):
                x, y = world.space.cell(c)
                kept_clear[y, x] = True
        recorded = [(k, s) for k, s in enumerate(scene.traffic) if isinstance(s, Recorded)]
        radii = dict.fromkeys(s.radius for _, s in recorded)
        shapes = {r: body_shape(scene, world.space, r, None) for r in radii}
        tracks = [(k, s, shapes[s.radius]) for k, s in recorded]
        self._recorded = [s for _, s in recorded]
        self._world = world
        self.lanes = check_tracks(world.space, tracks, self.trial.robot_cover)
        self._kept_clear = kept_clear | self.lanes

    def stream(self, k: int) -> np.random.Generator:
        """The draws of specification k."""
        return self._streams[k]

    def shape(self, radius: float) -> Shape:
        """The shape of obstacles of that radius (one for all of a kind: it remembers steps)."""
        if radius not in self._shapes:
            bars = self._world.lane_bars(self._recorded, radius)
            self._shapes[radius] = body_shape(self.scene, self.space, radius, self._kept_clear, bars)
        return self._shapes[radius]

    def hold(self, k: int, shape: Shape, number: int) -> None:
        """Keep a place for specification k."""
        self.trial.add(shape, number)
        self._held.append(k)

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
            way = self.way(shape, a, b)
            if way is None:
                raise SceneError(
                    "OBSTACLE_TRACK",
                    f"obstacle {k} cannot reach waypoint {t}, {b}, from {a}",
                    allowed="waypoints joined by free cells",
                )
            route += way[1:]
        cover = shape.cover(route[0])
        if self.trial.robot_cover.intersection(cover):
            raise SceneError("OBSTACLE_START", f"obstacle {k} is on the robot at t = 0, {spec.waypoints[0]}")
        other = next((self.trial.taken[c] for c in cover if c in self.trial.taken), None)
        if other is not None:
            raise SceneError(
                "OBSTACLE_OVERLAP",
                f"obstacles {self._held[other]} and {k} are in one cell at {spec.waypoints[0]}, t = 0",
                allowed="first waypoints that are apart",
            )
        self.hold(k, shape, route[0])
        return route

    def crossing(self, k: int, spec: Crossing) -> list[list[int]]:
        """The routes of crossing obstacles, drawn."""
        if spec.count == 0:
            return []
        shape, rng = self.shape(spec.radius), self.stream(k)
        if spec.radius not in self._regions:
            self._regions[spec.radius] = _region(self.scene, shape)
        sides = _sides(self._regions[spec.radius])
        routes: list[list[int]] = []
        for _ in range(spec.count):
            route = self._draw_route(shape, sides, rng)
            if route is None:
                raise self._full(k, "crossing obstacles", len(routes), spec.count)
            self.hold(k, shape, route[0])
            routes.append(route)
        return routes

    def _draw_route(
        self, shape: Shape, sides: list[tuple[list[Cell], list[Cell]]], rng: np.random.Generator
    ) -> list[int] | None:
        for _ in range(_TRIES):
            axis, back, u, v = rng.random(4).tolist()
            near, far = sides[int(axis * 2)]
            if not near:
                return None
            if back < 0.5:
                near, far = far, near
            a, b = near[int(u * len(near))], far[int(v * len(far))]
            if self.trial.fits(shape, self.space.number(a)):
                way = self.way(shape, a, b)
                if way is not None:
                    return way
        return None

    def walkers(self, k: int, spec: RandomWalk) -> list[int]:
        """Places of random walkers: each uniformly among the cells that are legal when it is put."""
        shape = self.shape(spec.radius)
        cells = self.space.numbers(self.trial.room(shape))
        # A random order, taken as far as it fits, is the same law as drawing anew among what is left.
        found: list[int] = []
        for each in self.stream(k).permutation(cells):
            if len(found) == spec.count:
                break
            number = int(each)
            if self.trial.fits(shape, number):
                self.hold(k, shape, number)
                found.append(number)
        if len(found) < spec.count:
            raise self._full(k, "random walkers", len(found), spec.count)
        return found

    def way(self, shape: Shape, a: Cell, b: Cell) -> list[int] | None:
        """A shortest way from a to b as cell numbers, or None. At corners bars count as walls."""
        moves = MOVES["dissertation" if shape.corner_cutting else "octile"]
        field = solve(shape.open, moves, b, stop=a)
        if field.exact[a[1], a[0]] < 0:
            return None
        (x, y), way = a, [self.space.number(a)]
        while (x, y) != b:
            dx, dy = moves.offsets[int(field.step[y, x])]
            x, y = x + dx, y + dy
            way.append(self.space.number((x, y)))
        return way

    def _full(self, k: int, what: str, fit: int, count: int) -> SceneError:
        return SceneError(
            "OBSTACLE_ROOM",
            f"obstacle specification {k}: {fit} of {count} {what} fit on the map",
            allowed="no more than the map has room for",
            todo="ask for fewer or smaller ones",
        )


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


def _sides(region: BoolGrid) -> list[tuple[list[Cell], list[Cell]]]:
    """Left and right, top and bottom: the cells of the region within its outer tenths, row by row."""
    ys, xs = np.nonzero(region)
    if not len(xs):
        return [([], []), ([], [])]
    out = []
    for along in (xs, ys):
        low, high = int(along.min()), int(along.max())
        depth = max((high - low + 1) // 10, 1)
        near, far = along < low + depth, along > high - depth
        out.append(
            tuple([(int(x), int(y)) for x, y in zip(xs[side], ys[side], strict=True)] for side in (near, far))
        )
    return out  # type: ignore[return-value]

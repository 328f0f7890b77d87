"""Traffic: the moving obstacles of one simulation, from the scene's specifications.

In each tick obstacles move in this order: recorded, crossing, patrols, random walkers; within a kind in
order of index. Indices follow the order of appearance, and at tick 0 the order of the scene's
specifications.

* **Recorded** tracks are replayed whatever the others do. They alone may cover the start or the goal.
* **Crossing** obstacles drive from a cell at one side of the robot's region to a cell at the far side and
  back forever (a side is the outer tenth of the region; side, cells and direction are drawn). They do not
  wait for the robot. They wait for other obstacles, and turn round after five ticks of that: two that meet
  head-on in a corridor would stand there forever, and a simulation about moving obstacles would become one
  about new walls.
* **Patrols** drive along their waypoints and back forever and wait while their next cell is taken, by
  whomever.
* Both turn round at a wall that has come into their path (:mod:`lampyris.sim.grid.editing`).
* **Random walkers** step to a uniformly chosen legal neighbour or stay.

None but recorded ones ever covers a cell that the robot covers at its start or goal, so nobody of our own
making can park on the goal; and none but they enters a cell that a recorded track ever covers, so that a
replay cannot run into any obstacle.

Every obstacle has draws of its own, whatever else happens, so two planners meet the same
obstacles as far as their own deeds allow, and a cell that is painted or an obstacle that is added moves only
those whose place or path it takes. Shortest paths come from the field.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Protocol

from lampyris.errors import LimitError
from lampyris.model.scene import Scene
from lampyris.model.traffic import (
    MAX_OBSTACLES,
    Crossing,
    Obstacle,
    ObstacleSpec,
    Patrol,
    RandomWalk,
    Recorded,
)
from lampyris.sim.traffic.obstacle_draws import first_of, steps
from lampyris.sim.traffic.placing import Placing
from lampyris.sim.traffic.recorded import position
from lampyris.sim.world.cell_index import Shape, Step
from lampyris.sim.world.world import Occupancy

TURN_AFTER = 5
"""Ticks a crossing obstacle waits for others before it turns round."""


class Driver(Protocol):
    """What moves the obstacles of one specification."""

    def advance(self, world: Occupancy, tick: int) -> None:
        """Move its obstacles one tick on."""
        ...


@dataclass
class Traffic:
    """All obstacles of a simulation with what drives them.

    Attributes
    ----------
    obstacles : what each is, in order of appearance.
    appears : the tick at which each came.
    """

    world: Occupancy
    obstacles: list[Obstacle] = field(default_factory=list)
    appears: list[int] = field(default_factory=list)
    drivers: list[Driver] = field(default_factory=list)
    recording: Recording | None = None
    walkers: list[Walkers] = field(default_factory=list)
    _spec: ObstacleSpec | None = None
    _alike: Obstacle = field(init=False)

    def add(self, shape: Shape, number: int, kind: str, spec: ObstacleSpec, tick: int = 0) -> int:
        """Put a new obstacle into the world; its index."""
        obstacle = self.world.add(shape, number)
        yields = kind in ("random-walk", "patrol")
        if self._spec is not spec:  # those of one specification are alike
            self._spec = spec
            self._alike = Obstacle(kind, spec.radius, yields, shape.offsets, spec.footprint)
        self.obstacles.append(self._alike)
        self.appears.append(tick)
        return obstacle

    def add_walkers(self, shape: Shape, numbers: list[int], spec: RandomWalk) -> list[int]:
        """Put random walkers into the world at tick 0; their indices."""
        if not (shape.small and numbers):
            return [self.add(shape, number, "random-walk", spec) for number in numbers]
        first = self.add(shape, numbers[0], "random-walk", spec)
        own = [first, *self.world.add_small(shape, numbers[1:])]
        self.obstacles += [self._alike] * (len(own) - 1)
        self.appears += [0] * (len(own) - 1)
        return own

    def advance(self, tick: int) -> list[int]:
        """Move every obstacle one tick on; the indices of obstacles that appeared."""
        self.world.begin()
        if self.recording is not None:
            self.recording.advance(self.world, tick)
        for driver in self.drivers:
            driver.advance(self.world, tick)
        return [obstacle for w in self.walkers for obstacle in w.appear(self, tick)]


# ---- the four kinds --------------------


@dataclass
class Recording:
    """All recorded tracks together: they move at one instant."""

    tracks: list[tuple[int, Recorded]]

    def advance(self, world: Occupancy, tick: int) -> None:
        """Replay one tick."""
        moves: list[tuple[int, Step]] = []
        for obstacle, one in self.tracks:
            (x0, y0), (x1, y1) = position(one, tick - 1), position(one, tick)
            if (x0, y0) != (x1, y1):
                moves.append((obstacle, (world.space.number((x1, y1)), x1 - x0, y1 - y0)))
        if moves:
            world.move_together(moves)


@dataclass
class Shuttle:
    """One obstacle that drives a route to its end and back, forever.

    Parameters
    ----------
    route : cell numbers, each 8-adjacent to the one before.
    yields : whether it waits for the robot.
    turn_after : ticks of waiting after which it turns round; None: never.
    """

    obstacle: int
    route: list[int]
    yields: bool
    turn_after: int | None
    at: int = 0
    ahead: int = 1
    waited: int = 0

    def advance(self, world: Occupancy, tick: int) -> None:
        """One step along the route, or wait."""
        for _ in range(2):
            step = self._next(world)
            if step is not None:
                break
            self.ahead = -self.ahead
        else:
            return  # a route of one cell, or walls on both sides
        if world.may_step(self.obstacle, step, self.yields):
            world.move(self.obstacle, step)
            self.at += self.ahead
            self.waited = 0
            return
        self.waited += 1
        if self.turn_after is not None and self.waited >= self.turn_after:
            self.ahead, self.waited = -self.ahead, 0

    def _next(self, world: Occupancy) -> Step | None:
        """The step ahead as far as walls go; None at the end of the route, or where a wall has come."""
        if not 0 <= self.at + self.ahead < len(self.route):
            return None
        to = self.route[self.at + self.ahead]
        steps = world.shapes[self.obstacle].steps(self.route[self.at])
        return next((step for step in steps if step[0] == to), None)


@dataclass
class Walkers:
    """The random walkers of one specification.

    What each draws depends on its number and on the tick alone (:mod:`lampyris.sim.traffic.obstacle_draws`).
    """

    spec: RandomWalk
    shape: Shape
    key: int
    own: list[int] = field(default_factory=list)
    draws: list[float] = field(default_factory=list)
    _block: list[list[float]] = field(default_factory=list)
    _first: int = 0

    def _drawn(self, tick: int) -> list[float]:
        """The draws of a tick; those of a block of ticks are made at once."""
        if not self._first <= tick < self._first + len(self._block):
            ticks = max(1, min(64, 65_536 // (self.spec.count + 2)))
            self._block, self._first = steps(self.key, self.spec.count, tick, ticks).tolist(), tick
        return self._block[tick - self._first]

    def advance(self, world: Occupancy, tick: int) -> None:
        """Each steps to a uniformly chosen legal neighbour or stays."""
        self.draws = self._drawn(tick)
        for obstacle, u in zip(self.own, self.draws, strict=False):
            options = world.options(obstacle)
            pick = int(u * (len(options) + 1))
            if pick:
                world.move(obstacle, options[pick - 1])

    def appear(self, traffic: Traffic, tick: int) -> list[int]:
        """With the specification's rate, one more on a uniformly chosen legal free cell, if there is one."""
        rate = self.spec.rate
        if rate is None or len(self.own) >= self.spec.count or self.draws[-2] >= rate:
            return []
        cells = traffic.world.space.numbers(traffic.world.room(self.shape))
        if not len(cells):
            return []
        number = first_of(cells, self.draws[-1])
        self.own.append(traffic.add(self.shape, number, "random-walk", self.spec, tick))
        return self.own[-1:]


# ---- from specifications to obstacles --------------------


def open_traffic(scene: Scene, world: Occupancy, seed: int) -> Traffic:
    """The obstacles of a scene at tick 0, placed in the world.

    Tracks, walkers with given cells and patrols stand where they must; crossing obstacles are drawn next,
    random walkers last.

    Raises
    ------
    SceneError : ``OBSTACLE_TRACK`` a track or waypoint in a wall, on start or goal, in a recorded lane or
        out of reach; ``OBSTACLE_START`` on the robot; ``OBSTACLE_OVERLAP`` two that meet; ``OBSTACLE_ROOM``
        more than the map has room for.
    LimitError : more obstacles than a simulation may have.
    """
    specs = scene.traffic
    total = sum(s.count if isinstance(s, RandomWalk | Crossing) else 1 for s in specs)  # bits: whole numbers
    if total > MAX_OBSTACLES:
        what, most = f"{total:,} obstacles in all", f"at most {MAX_OBSTACLES:,}"
        raise LimitError("LIMIT", what, allowed=most, setting="traffic.count")
    plans = Placing(scene, world, seed)
    places: list[list[list[int]]] = [[] for _ in specs]
    for k, cells in plans.given().items():
        places[k] = [cells] if isinstance(specs[k], Patrol) else [[n] for n in cells]
    for k, spec in enumerate(specs):
        if isinstance(spec, Crossing):
            places[k] = plans.crossing(k, spec)
    for k, spec in enumerate(specs):
        if isinstance(spec, RandomWalk) and spec.rate is None:
            places[k] += [[n] for n in plans.walkers(k, spec)]
    return _assemble(scene, world, plans, places)


def _assemble(scene: Scene, world: Occupancy, plans: Placing, places: list[list[list[int]]]) -> Traffic:
    traffic = Traffic(world)
    crossing: list[Driver] = []
    patrols: list[Driver] = []
    tracks: list[tuple[int, Recorded]] = []
    for k, spec in enumerate(scene.traffic):
        shape = plans.shape(spec.radius)
        if isinstance(spec, Recorded):
            tracks.append((traffic.add(shape, places[k][0][0], "recorded", spec), spec))
        elif isinstance(spec, Patrol):
            obstacle = traffic.add(shape, places[k][0][0], "patrol", spec)
            patrols.append(Shuttle(obstacle, places[k][0], True, None))
        elif isinstance(spec, Crossing):
            for route in places[k]:
                obstacle = traffic.add(shape, route[0], "crossing", spec)
                crossing.append(Shuttle(obstacle, route, False, TURN_AFTER))
        else:
            own = traffic.add_walkers(shape, [at[0] for at in places[k]], spec)
            traffic.walkers.append(Walkers(spec, shape, plans.key(k), own))
    traffic.recording = Recording(tracks) if tracks else None
    traffic.drivers = [*crossing, *patrols, *traffic.walkers]
    return traffic

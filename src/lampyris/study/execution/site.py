"""Site: where a job takes place, made from its plain data. Worker and judge make the same from the same.

What many jobs share is kept: the place (map, ends, moves, robot) with its exact field, and the world (a place
with a traffic case and a seed) with its traffic. Nothing kept changes a result.
"""

from __future__ import annotations

import math
from collections import OrderedDict
from collections.abc import Callable, Hashable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Generic, TypeVar

from lampyris.errors import InputError, LampyrisError
from lampyris.model.field import Field
from lampyris.model.grid import Grid
from lampyris.model.robot import Robot, inscribed_disc
from lampyris.model.scene import Scene
from lampyris.model.settings.drive import DriveSettings
from lampyris.model.settings.sensor import Sensor
from lampyris.model.traffic import Obstacle, ObstacleSpec
from lampyris.planning import registry
from lampyris.planning.field.layers import clearance, free_space, moves_for
from lampyris.planning.field.solve import solve
from lampyris.sim.traffic.mobility import drawn_traffic
from lampyris.sim.traffic.traffic import open_traffic
from lampyris.sim.world.cell_index import CellIndex, robot_shape
from lampyris.sim.world.world import Occupancy
from lampyris.study.design.study import canonical
from lampyris.study.execution.obstacle_tracks import Replay
from lampyris.typing import Cell, FloatGrid

CELLS_KEPT = 4_000_000
"""Cells of the maps of all places that are kept, together; one is kept in any case."""

WORLD = 100_000
"""Cells that a world counts as at least: its tracks take memory, however small its map is."""

MAX_TICKS = 20_000
"""Of the tracks of a drive."""

_T = TypeVar("_T")


class RecentCache(Generic[_T]):
    """The last few of something that is costly to make, by key.

    Parameters
    ----------
    room : how much is kept, in the unit of the weights; the newest in any case.
    """

    def __init__(self, room: int) -> None:
        self._room, self._filled = room, 0
        self._all: OrderedDict[Hashable, tuple[int, _T]] = OrderedDict()

    def get(self, key: Hashable, make: Callable[[], _T], weight: int = 1) -> _T:
        """The one of that key, made if it is not there."""
        found = self._all.get(key)
        if found is not None:
            self._all.move_to_end(key)
            return found[1]
        made = make()
        self._all[key] = (weight, made)
        self._filled += weight
        while self._filled > self._room and len(self._all) > 1:
            self._filled -= self._all.popitem(last=False)[1][0]
        return made

    def clear(self) -> None:
        """Keep nothing."""
        self._all.clear()
        self._filled = 0


@dataclass(frozen=True, eq=False)
class Place:
    """A map, two ends, moves and a robot; what is known of them is worked out when it is asked for.

    Parameters
    ----------
    scene : of them.
    poses : whether a planner of poses plans here: the robot may then be wherever the disc within its footprint fits, and the
        cost to the goal is that of this disc.
    """

    scene: Scene
    poses: bool = False

    @cached_property
    def for_cells(self) -> Scene:
        """The scene by whose free cells the cost to the goal is counted."""
        scene = self.scene
        return replace(scene, robot=inscribed_disc(scene.robot)) if self.poses else scene

    @cached_property
    def field(self) -> Field:
        """The exact cost to the goal of every cell, as the map is given."""
        scene = self.for_cells
        return solve(free_space(scene), moves_for(scene), scene.goal, terrain=scene.grid.terrain)

    @cached_property
    def to_go(self) -> FloatGrid:
        """The same in cells, infinity where there is no path."""
        return self.field.cost

    @cached_property
    def clearance(self) -> FloatGrid:
        """Metres from each cell's centre to the nearest wall."""
        return clearance(self.scene.grid)

    @property
    def optimal_exact(self) -> int | None:
        """Exact cost of the best path; None: there is none."""
        x, y = self.scene.start
        exact = int(self.field.exact[y, x])
        return exact if exact >= 0 and free_space(self.for_cells)[y, x] else None

    @property
    def optimal(self) -> float | None:
        """The same in cells."""
        exact = self.optimal_exact
        return None if exact is None else moves_for(self.scene).value(exact)

    @cached_property
    def last_tick(self) -> int:
        """The last tick of a simulation that has no limit of its own: the same for every planner.

        Ten times (height + width), and four times the cost of the best path on top, in cells. The loop's own
        takes the planner's first path instead, and would give one who starts badly more time.
        """
        grid = self.scene.grid
        return 10 * (grid.height + grid.width) + 4 * self.far

    @property
    def far(self) -> int:
        """The cost of the best path in whole cells, 0 if there is none."""
        return math.ceil(self.optimal or 0.0)


@dataclass(frozen=True)
class Opened:
    """Obstacles at tick 0: what they are, the cells they stand on, and those that may come later."""

    obstacles: tuple[Obstacle, ...]
    places: tuple[Cell, ...]
    to_come: tuple[Obstacle, ...]


@dataclass(frozen=True, eq=False)
class StudyWorld:
    """A place with what moves there.

    Parameters
    ----------
    place : where.
    scene : the same with the traffic as it is specified; without it where an end is blocked: then that is the
        answer, and whether the obstacles would have fitted is no question.
    seed : of all that is drawn.
    replayed : whether obstacles follow tracks drawn beforehand.
    """

    place: Place
    scene: Scene
    seed: int
    replayed: bool
    _among: dict[str, Any] = field(default_factory=dict)

    @cached_property
    def replay(self) -> Replay:
        """The tracks, for a world whose tracks are replayed."""
        return Replay(self.scene, self.seed)

    @cached_property
    def opened(self) -> Opened:
        """The obstacles as they begin, for a world in which they are live.

        Raises
        ------
        SceneError, LimitError : they do not fit: see :func:`lampyris.sim.traffic.traffic.open_traffic`.
        """
        scene = self.scene
        space = CellIndex(scene.grid)
        world = Occupancy(space, robot_shape(scene, space), space.number(scene.start))
        traffic = open_traffic(scene, world, self.seed)
        rest = [
            Obstacle("random-walk", walkers.spec.radius, True, walkers.shape.offsets, walkers.spec.footprint)
            for walkers in traffic.walkers
            for _ in range(walkers.spec.count - len(walkers.own))
        ]
        return Opened(tuple(traffic.obstacles), tuple(map(space.cell, world.where)), tuple(rest))

    def last_tick(self, asked: int | None) -> int:
        """The last tick of a simulation."""
        return self.place.last_tick if asked is None else asked

    def drive_ticks(self, settings: DriveSettings) -> int:
        """Ticks of tracks for a drive: as many as pass until its time limit.

        Without one: until twenty times the time that the best path takes at the obstacles' speed, and two
        minutes. A drive that is not over then meets obstacles that stand where they were last.
        """
        one, robot, cell = settings, self.scene.robot, self.scene.grid.resolution
        speed = robot.v_max if one.obstacle_speed is None else one.obstacle_speed
        seconds = one.time_limit
        if seconds is None:
            seconds = 120.0 + 20.0 * self.place.far * cell / min(speed, robot.v_max)
        return min(math.ceil(seconds * speed / cell) + 1, MAX_TICKS)

    def among(self, ticks: int) -> Scene:
        """The scene with the tracks up to a tick; that of the last tick asked for is kept."""
        if self._among.get("ticks") != ticks:
            self._among.update(ticks=ticks, scene=replace(self.scene, traffic=self.replay.recorded(ticks)))
        scene: Scene = self._among["scene"]
        return scene


_places: RecentCache[Place] = RecentCache(CELLS_KEPT)
_worlds: RecentCache[StudyWorld] = RecentCache(CELLS_KEPT)


def place_of(plain: Mapping[str, Any], grid: Grid) -> Place:
    """The place of a job.

    Raises
    ------
    InputError : ``JOB``: it does not say what a job must say.
    LampyrisError : ends, moves or a robot that cannot be.
    """
    said = _said(plain, "map", "resolution", "start", "goal", "moves", "robot")
    return _places.get(said, lambda: _place(plain, grid), grid.blocked.size)


def sensor_of(plain: Mapping[str, Any]) -> Sensor | None:
    """The sensor of a job's robot; None: it knows the map.

    Raises
    ------
    InputError : ``JOB``: it is none.
    """
    given = plain.get("sensor")
    try:
        return None if given is None else Sensor(**given)
    except (KeyError, TypeError, ValueError) as wrong:
        raise not_a_job(wrong) from None


def goal_track_of(plain: Mapping[str, Any]) -> list[Cell] | None:
    """The cells of a job's goal, if it moves.

    Raises
    ------
    InputError : ``JOB``: they are none.
    """
    given = plain.get("goal_track")
    try:
        return None if given is None else [(int(x), int(y)) for x, y in given]
    except (TypeError, ValueError) as wrong:
        raise not_a_job(wrong) from None


def plans_poses(plain: Mapping[str, Any]) -> bool:
    """Whether the planner of a job is registered as one of poses.

    Raises
    ------
    InputError : ``JOB``: it names no planner.
    """
    try:
        return registry.plans_poses(plain["planner"]["name"])
    except (KeyError, TypeError) as wrong:
        raise not_a_job(wrong) from None


def world_of(plain: Mapping[str, Any], grid: Grid) -> StudyWorld:
    """The world of a job.

    Raises
    ------
    InputError : ``JOB``.
    LampyrisError : as :func:`place_of`; traffic that cannot be placed.
    """
    said = _said(plain, "map", "resolution", "start", "goal", "moves", "robot", "traffic", "seed")
    return _worlds.get(said, lambda: _world(plain, grid), max(grid.blocked.size, WORLD))


def forget() -> None:
    """Keep nothing: for measuring memory."""
    _places.clear()
    _worlds.clear()


def _said(plain: Mapping[str, Any], *names: str) -> bytes:
    try:
        poses = [*map(plain.get, ("start_pose", "goal_pose", "origin")), plans_poses(plain)]
        return canonical([poses, *(plain[name] for name in names)])
    except (KeyError, TypeError, ValueError) as wrong:
        raise not_a_job(wrong) from None


def not_a_job(wrong: Exception) -> InputError:
    """What is said of a job that is none."""
    return InputError("JOB", f"{type(wrong).__name__}: {wrong}", where="job", allowed="a job of a study")


def _place(plain: Mapping[str, Any], grid: Grid) -> Place:
    try:
        robot = Robot(**plain["robot"])
        poses = {name: plain[name] for name in ("start_pose", "goal_pose") if name in plain}
        scene = Scene(grid, plain["start"], plain["goal"], moves=plain["moves"], robot=robot, **poses)
    except LampyrisError:
        raise
    except (KeyError, TypeError, ValueError) as wrong:
        raise not_a_job(wrong) from None
    return Place(scene, plans_poses(plain))


def _world(plain: Mapping[str, Any], grid: Grid) -> StudyWorld:
    place = place_of(plain, grid)
    scene, who, seed = place.scene, plain["traffic"], plain["seed"]
    free = free_space(place.for_cells)
    made: tuple[ObstacleSpec, ...] = ()
    try:
        if all(free[y, x] for x, y in (scene.start, scene.goal)):
            shape = {"radius": who["radius"], "footprint": who.get("footprint")}
            how = {"rate": who["rate"], **shape, "fit": scene}
            made = drawn_traffic(who["kind"], who["count"], grid, seed, **how)
        return StudyWorld(
            place, replace(scene, traffic=made), seed, bool(made) and who["tracks"] == "replayed"
        )
    except LampyrisError:
        raise
    except (KeyError, TypeError, ValueError) as wrong:
        raise not_a_job(wrong) from None

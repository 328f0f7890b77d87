"""Drawn cases among moving obstacles: larger maps, sizes, terrain, obstacles that end; and their drives."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from lampyris import api
from lampyris.errors import LimitError, SettingError
from lampyris.model.change import Change, ObstacleTrack
from lampyris.model.grid import Grid
from lampyris.model.moves import MOVES
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.model.traffic import Recorded
from lampyris.planning.base import Planner
from lampyris.referee import check_plan
from lampyris_selfcheck.check import Tally
from lampyris_selfcheck.checks.traffic.moving_cases import place
from lampyris_selfcheck.checks.traffic.moving_drive import least_gap
from lampyris_selfcheck.checks.traffic.moving_judge import Judged, fault
from lampyris_selfcheck.reference.motion.sim_monitor import disc
from lampyris_selfcheck.reference.paths.changing_map import ChangingMap
from lampyris_selfcheck.reference.paths.timed import EIGHT, FOUR, Body, Cell, arrivals

RNG = np.random.default_rng(0)
"""Never drawn from: these planners are deterministic."""

LONGEST_ROUND = 60
"""Ticks in which all obstacles are where they were, at most: the judge looks at each of them."""

CONTACT = 1e-6
"""Metres by which two discs may seem to overlap that touch: the planner forgives 1e-9, and places are
rounded."""


@dataclass(frozen=True, slots=True)
class Drawn:
    """A drawn question; ``recorded``: all obstacles begin at tick 0 and stay where they end."""

    scene: Scene
    tick: int
    bodies: tuple[ObstacleTrack, ...]
    recorded: bool

    @property
    def data(self) -> dict[str, object]:
        grid = self.scene.grid
        return {
            "rows": ["".join(".#"[int(b)] for b in row) for row in grid.blocked],
            "terrain": None if grid.terrain is None else grid.terrain.tolist(),
            "moves": self.scene.moves.name,
            "radius": self.scene.robot.radius,
            "ends": [self.scene.start, self.scene.goal],
            "tick": self.tick,
            "bodies": [[b.track, b.since, b.period, b.footprint] for b in self.bodies],
        }


def draw(rng: np.random.Generator, *, recorded: bool) -> Drawn:
    """A question: mostly small and crowded, sometimes up to 24 x 24; blocked ends among them."""
    most = int(rng.choice([6, 9, 14, 25], p=[0.4, 0.3, 0.2, 0.1]))
    height, width = (int(n) for n in rng.integers(2, most, 2))
    blocked = rng.random((height, width)) < rng.choice([0.0, 0.15, 0.35])
    weights = rng.integers(0, 253, (height, width)) * (rng.random() < 0.25)
    terrain = (weights * (rng.random((height, width)) < 0.5)).astype(np.uint8)
    start, goal = ((int(rng.integers(width)), int(rng.integers(height))) for _ in range(2))
    if rng.random() < 0.95:
        blocked[start[1], start[0]] = blocked[goal[1], goal[0]] = False
    terrain[blocked] = 0
    robot = Robot(radius=float(rng.choice([0.0, 0.0, 0.0, 0.3, 0.7])))
    moves = MOVES[
        str(rng.choice(["octile", "octile", "dissertation", "four-connected", "sixteen-connected"]))
    ]
    tick = 0 if recorded else int(rng.choice([0, 0, 3, 11]))
    sizes = [0.0, 0.0, 0.0, 0.9] if robot.radius < 0.5 else [0.0]
    count = int(rng.integers(0, 5 if most < 10 else 13))
    bodies, radii, common = [], [], 1
    for k in range(count):
        track = _walk(rng, width, height)
        period = 1 if recorded or rng.random() < 0.5 else _period(rng, track)
        if math.lcm(common, period) > LONGEST_ROUND:
            period = 1
        common = math.lcm(common, period)
        radius = float(rng.choice(sizes))
        # Known from an earlier tick on, or only now: a planner is told the whole of it.
        since = 0 if recorded else int(rng.integers(0, tick + 1))
        bodies.append(ObstacleTrack(k, track, since, period, _cells(radius)))
        radii.append(radius)
    traffic = tuple(Recorded(b.track, radius=r) for b, r in zip(bodies, radii, strict=True))
    scene = Scene(Grid(blocked, terrain=terrain), start, goal, moves, robot, traffic if recorded else ())
    return Drawn(scene, tick, tuple(bodies), recorded)


def _walk(rng: np.random.Generator, width: int, height: int) -> tuple[Cell, ...]:
    """Anywhere, walls or not: what is known of an obstacle is believed."""
    x, y = int(rng.integers(width)), int(rng.integers(height))
    track = [(x, y)]
    for dx, dy in rng.integers(-1, 2, (int(rng.integers(0, 13)), 2)).tolist():
        x, y = min(max(x + dx, 0), width - 1), min(max(y + dy, 0), height - 1)
        track.append((x, y))
    return tuple(track)


def _period(rng: np.random.Generator, track: tuple[Cell, ...]) -> int:
    """How many of its last cells it goes round; 1 if it could not begin again."""
    period = int(rng.integers(1, len(track) + 1))
    (ax, ay), (bx, by) = track[-1], track[-period]
    return period if max(abs(ax - bx), abs(ay - by)) <= 1 else 1


def _cells(radius: float) -> tuple[Cell, ...]:
    """The cells of a disc, by the reference."""
    return tuple(sorted(disc(radius, 1.0)))


def _body(seen: ObstacleTrack) -> Body:
    there = place(seen.track, seen.period or 1)
    return (lambda t: there(t - seen.since)), seen.footprint


_Asked = tuple[list[list[bool]], list[Cell], bool, list[Body], tuple[Cell, ...]]


def _truth(asked: Drawn) -> tuple[_Asked, int | None]:
    """The map, steps and bodies as the reference takes them, and the earliest arrival."""
    scene = asked.scene
    grid, radius = scene.grid, scene.robot.radius
    terrain = None if grid.terrain is None else grid.terrain.tolist()
    free = ChangingMap(grid.blocked.tolist(), terrain, radius).free()
    # A robot with a size cuts no corners.
    cutting = MOVES[scene.moves.name].corner_cutting and radius == 0
    steps = FOUR if scene.moves.name == "four-connected" else EIGHT
    bodies = [_body(b) for b in asked.bodies]
    own = _cells(radius)
    want = None
    (sx, sy), goal = scene.start, scene.goal
    if free[sy][sx] and free[goal[1]][goal[0]]:
        settled = max((b.since + len(b.track) for b in asked.bodies), default=0)
        common = math.lcm(*(b.period or 1 for b in asked.bodies)) if asked.bodies else 1
        first = arrivals(
            free, steps, cutting, scene.start, bodies,
            own=own, tick=asked.tick, period=common, settled=settled, goal=goal,
        )  # fmt: skip
        want = first.get(goal)
    return (free, steps, cutting, bodies, own), want


def judge_plans(tally: Tally, number: int, rng: np.random.Generator, planners: Mapping[str, Planner]) -> None:
    """Both planners on one drawn question."""
    judge_asked(tally, number, draw(rng, recorded=bool(rng.random() < 0.5)), planners)


def judge_asked(tally: Tally, number: int, asked: Drawn, planners: Mapping[str, Planner]) -> None:
    """Both planners on one question."""
    scene = asked.scene
    (free, steps, cutting, bodies, own), want = _truth(asked)
    ends = {"start-occupied": scene.start, "goal-occupied": scene.goal}
    closed = next((word for word, (x, y) in ends.items() if not free[y][x]), "")
    for name, planner in planners.items():
        try:
            plan = planner.open(scene, RNG).plan(
                Change(robot=scene.start, obstacle_tracks=asked.bodies, tick=asked.tick)
            )
            if closed:
                wrong = "" if plan.status == closed else f"{plan.status}, should be {closed}"
            else:
                judged = Judged(plan, free, steps, cutting, scene.start, scene.goal, bodies, own, asked.tick)
                wrong, _ = fault(judged, want)
            broken = check_plan(plan, scene)
            if not wrong and broken is not None:
                wrong = f"the referee says: {broken}"
            if not wrong and asked.recorded:
                wrong = _front_door(scene, planner, want, closed)
        except Exception as error:
            wrong = f"{type(error).__name__}: {error}"
        if wrong:
            tally.fail(number, f"{name}: {wrong}", **asked.data)
    far = max(abs(scene.start[0] - scene.goal[0]), abs(scene.start[1] - scene.goal[1]))
    word = closed or ("never" if want is None else "late" if want - asked.tick > far else "at once")
    tally.case(word, "tracks that end" if asked.recorded else "tracks that go round")


def _front_door(scene: Scene, planner: Planner, want: int | None, closed: str) -> str:
    """The same asked of :func:`lampyris.api.plan`, which knows the recorded obstacles by itself."""
    plan = api.plan(scene, planner)
    if closed:
        return "" if plan.status == closed else f"at the front door {plan.status}, should be {closed}"
    arrival = None if plan.schedule is None else int(plan.schedule[-1])
    return "" if arrival == want else f"at the front door arrives at {arrival}, should at {want}"


def _apart(scene: Scene, one: object) -> bool:
    """Whether an obstacle's disc is off the robot's to begin with: a point fills its cell."""
    assert isinstance(one, Recorded)
    (x, y), (u, v) = scene.start, one.track[0]
    resolution = scene.grid.resolution
    return math.hypot(x - u, y - v) * resolution >= scene.robot.radius + (one.radius or 0.5 * resolution)


def judge_drive(tally: Tally, number: int, rng: np.random.Generator, planners: Mapping[str, Planner]) -> None:
    """A plan among recorded obstacles as the robot drives it: no two discs overlap at any instant."""
    name = ("sipp", "space-time-astar")[int(rng.integers(2))]
    for _ in range(50):
        asked = draw(rng, recorded=True)
        plan = api.plan(asked.scene, planners[name])
        apart = all(_apart(asked.scene, one) for one in asked.scene.traffic)
        if plan.path is not None and len(plan.path.cells) > 1 and asked.bodies and apart:
            break
    else:
        raise AssertionError("fifty draws without a way among obstacles")
    tick_seconds = float(rng.choice([0.5, 1.0, 2.0, 4.0]))
    try:
        made = api.speed_profile(asked.scene, plan, tick_seconds=tick_seconds)
    except (SettingError, LimitError) as error:
        # The robot cannot be as quick as its schedule, or as slow as its course asks: it says so.
        tally.case(f"refused: {error.code}")
        if error.code not in ("PROFILE_BLOCKED", "PATH_TIME"):
            tally.fail(number, f"{name}: {error}", tick_seconds=tick_seconds, **asked.data)
        return
    except Exception as error:
        tally.case("raised")
        tally.fail(number, f"{name}: {type(error).__name__}: {error}", **asked.data)
        return
    gap, whom, when = least_gap(made, plan, asked.scene, tick_seconds)
    tally.case("driven", "waits" if (np.diff(made.s) == 0).any() else "does not wait")
    if math.isfinite(gap):
        tally.measure("least gap, m", gap)
    if gap < -CONTACT:
        what = f"{name}: {-gap:.9g} m into obstacle {whom} at {when:.9g} s"
        tally.fail(number, what, tick_seconds=tick_seconds, **asked.data)

"""The three speed laws of the related work on a bundled map, measured: three Markdown tables.

    python tools/related_speed_table.py [blind | three | cloud]

`office-120` with cells of 0.5 m, its query from (7, 78) to (110, 30), a path that keeps away from walls, the
default robot with a radius of 0.2 m. Blind areas: the profile of the path, without the clearance cap. Three
speeds and danger: closed-loop runs among obstacles that cross the way, walls or not, and change their minds
once a second.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace
from typing import TypeAlias

import numpy as np

from lampyris import api
from lampyris.io.maps.load import load_map
from lampyris.model.obstacles import ObstacleStates
from lampyris.model.path import Path
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.motion.cap_values import Around, Cap
from lampyris.motion.geometry.sampled_path import SampledPath, sample_path
from lampyris.motion.laws.physical import PhysicalLaw
from lampyris.motion.laws.registry import profile
from lampyris.motion.safety.blind_areas import BlindArea, hiding_distance, stop_within
from lampyris.motion.safety.danger_cloud import CloudModel, cloud_cap
from lampyris.motion.safety.three_speed import ThreeSpeed, ThreeSpeedControl
from lampyris.typing import Floats

Decide: TypeAlias = Callable[[SampledPath, float, ObstacleStates, float], list[Cap]]
"""The caps for the rest of a course, from the distance driven, what is seen, and the time since the last."""

CELL = 0.5
OBSTACLES, RUNS, TICK, DISC = 6, 40, 0.05, 0.3
KEEPS, STOPS = 0.8, 0.15
"""Chance in a second that an obstacle goes on, or stands; else it makes for the robot's way."""


def office() -> tuple[Scene, Path]:
    """The scene and its path."""
    document = load_map("office-120")
    query = document.queries[1]
    scene = Scene(replace(document.grid, resolution=CELL), query.start, query.goal, robot=Robot(radius=0.2))
    path = api.plan(scene, min_clearance=2, obstacle_density_weight=4.0, choice="exact").path
    assert path is not None
    return scene, path


def blind() -> None:
    """Travel time, and how much of the way an obstacle that turns up could meet the robot before it stands."""
    scene, path = office()
    course = sample_path(path, scene.grid.resolution)
    robot, length = scene.robot, float(course.s[-1])
    print("| settings | time | slowed | open to an obstacle of 1 m/s | of it faster than creep |")
    print("|---|---|---|---|---|")
    judge = BlindArea()
    room = hiding_distance(course, scene, judge) - robot.radius
    allowed = stop_within(room, d_max=robot.d_max, reaction=0.2, hidden_speed=1.0, a_max=robot.a_max)
    edge = np.append(np.diff(course.s), 0.0)
    cases: tuple[tuple[str, BlindArea | None], ...] = (
        ("without the law", None),
        ("`hidden_speed=0`", BlindArea(hidden_speed=0.0)),
        ("`hidden_speed=0.5`", BlindArea(hidden_speed=0.5)),
        ("defaults", judge),
        ("`hidden_speed=1.5`", BlindArea(hidden_speed=1.5)),
        ("`hidden_radius=0.4`", BlindArea(hidden_radius=0.4)),
        ("`reach=1`", BlindArea(reach=1.0)),
    )
    for name, settings in cases:
        made = profile(course, scene, law=PhysicalLaw(clearance=False, blind=settings))
        open_ = made.v > allowed + 1e-9
        fast = open_ & (made.v > 0.1 + 1e-9)
        slowed = np.isin(np.array(made.cause), ("blind area", "braking")) & (made.v < robot.v_max - 1e-9)
        told = [float(edge[which].sum()) for which in (slowed, open_, fast)]
        print(
            f"| {name} | {made.duration:.1f} s | "
            + " | ".join(f"{100 * x / length:.0f} %" for x in told)
            + " |"
        )


def rest(course: SampledPath, s: float) -> SampledPath:
    """What is left of a course from the last node before s."""
    k = min(max(int(np.searchsorted(course.s, s, side="right")) - 1, 0), len(course) - 2)
    part = slice(k, None)
    return SampledPath(
        course.s[part] - course.s[k], course.xy[part], course.heading[part], course.curvature[part],
        course.stop[part], course.resolution,
    )  # fmt: skip


class Crowd:
    """Obstacles that cross the way about when the robot comes by, and change their minds."""

    def __init__(self, course: SampledPath, rng: np.random.Generator) -> None:
        metres = course.xy * course.resolution
        node = rng.integers(len(course) // 6, len(course), OBSTACLES)
        angle = rng.uniform(0, 2 * np.pi, OBSTACLES)
        self.rng, self.way = rng, metres
        heading = np.stack((np.cos(angle), np.sin(angle)), axis=1)
        self.velocity = rng.uniform(0.3, 1.0, (OBSTACLES, 1)) * heading
        when = course.s[node] + rng.uniform(-2, 4, OBSTACLES)
        self.place = metres[node] - self.velocity * when[:, None]
        self.intent = np.zeros(OBSTACLES, dtype=np.int64)

    def now(self, resolution: float) -> tuple[ObstacleStates, np.ndarray]:
        """As sensed; and the velocities they really have."""
        real = self.velocity.copy()
        real[self.intent == 1] = 0.0
        for m in np.flatnonzero(self.intent == 2):
            gap = self.way - self.place[m]
            aim = gap[(gap * gap).sum(axis=1).argmin()]
            size = float(np.sqrt((aim * aim).sum()))
            real[m] = aim / size if size > 0.05 else 0.0
        top = np.ones(OBSTACLES)
        return ObstacleStates(self.place / resolution, np.full(OBSTACLES, DISC), top, self.velocity), real

    def think(self) -> None:
        """Once a second: what each is about to do."""
        draw = self.rng.random(OBSTACLES)
        self.intent = (draw > KEEPS).astype(np.int64) + (draw > KEEPS + STOPS)


def drive(
    course: SampledPath, scene: Scene, decide: Decide, period: float, seed: int
) -> tuple[float, int, float, int]:
    """Time, contacts, the sum of the robot's speeds at them, and how many were above half speed."""
    robot, crowd = scene.robot, Crowd(course, np.random.default_rng(seed))
    caps: Floats = np.full(len(course), robot.v_max)
    s = v = time = shocks = 0.0
    touched: set[int] = set()
    count, hard, step, end = 0, 0, 0, float(course.s[-1])
    while s < end - 1e-6 and time < 600.0:
        if step % round(1.0 / TICK) == 0:
            crowd.think()
        seen, real = crowd.now(course.resolution)
        if step % round(period / TICK) == 0:
            left = rest(course, s)
            found = decide(left, s, seen, period)
            caps = np.full(len(left), robot.v_max)
            for cap in found:
                caps = np.minimum(caps, cap.v)
            base = float(course.s[len(course) - len(left)])
            nodes = left.s + base
        ahead = np.maximum(nodes - s, 0.0)
        caps[-1] = 0.0
        target = float(np.sqrt(caps * caps + 2 * robot.d_max * ahead).min())
        k = max(int(np.searchsorted(nodes, s, side="right")) - 1, 0)
        target = max(min(target, float(caps[k]) if k < len(caps) - 1 else target), 0.02)
        v = min(max(target, v - robot.d_max * TICK), v + robot.a_max * TICK)
        s, time, step = s + v * TICK, time + TICK, step + 1
        crowd.place = crowd.place + real * TICK
        at = np.array([np.interp(s, course.s, course.xy[:, c]) for c in (0, 1)]) * course.resolution
        gap = np.sqrt(((crowd.place - at) ** 2).sum(axis=1)) - robot.radius - DISC
        for m in np.flatnonzero(gap < 0.0).tolist():
            if m not in touched and v > 0.02:
                count, shocks, hard = count + 1, shocks + v, hard + (v > 0.5 * robot.v_max)
            touched.add(m)
        touched -= set(np.flatnonzero(gap > 0.2).tolist())
    return time, count, shocks, hard


def table(cases: list[tuple[str, Callable[[Scene], tuple[Decide, float]]]]) -> None:
    """Runs of each case over the same seeds."""
    scene, path = office()
    course = sample_path(path, scene.grid.resolution)
    print("| law | mean time | contacts a run | above half speed | mean speed at contact |")
    print("|---|---|---|---|---|")
    for name, make in cases:
        runs = []
        for seed in range(RUNS):
            decide, period = make(scene)
            runs.append(drive(course, scene, decide, period, seed))
        time, count, shocks, hard = (sum(run[k] for run in runs) for k in range(4))
        told = f"{time / RUNS:.1f} s | {count / RUNS:.2f} | {hard / RUNS:.2f}"
        print(f"| {name} | {told} | {shocks / max(count, 1):.2f} m/s |")


def constant(share: float) -> Callable[[Scene], tuple[Decide, float]]:
    """Never more than a share of top speed."""

    def make(scene: Scene) -> tuple[Decide, float]:
        return lambda course, *_: [Cap("limit", np.full(len(course), share * scene.robot.v_max))], 1.0

    return make


def speeds(settings: ThreeSpeed, learns: bool = True) -> Callable[[Scene], tuple[Decide, float]]:
    """Three speeds with a control that learns what obstacles do, or with the prior always."""

    def make(scene: Scene) -> tuple[Decide, float]:
        control = ThreeSpeedControl(settings)

        def decide(course: SampledPath, s: float, seen: ObstacleStates, period: float) -> list[Cap]:
            if learns or len(control.belief) == 0:
                control.update(seen, period, course)
            return control.cap(course, scene, Around(obstacle_states=seen))

        return decide, settings.step

    return make


def cloud(settings: CloudModel) -> Callable[[Scene], tuple[Decide, float]]:
    """Danger by clouds, five times a second."""

    def make(scene: Scene) -> tuple[Decide, float]:
        return lambda course, s, seen, period: cloud_cap(
            course, scene, settings, Around(obstacle_states=seen)
        ), 0.2

    return make


def three_tables() -> None:
    """Three speeds."""
    table(
        [
            ("always fast", constant(1.0)),
            ("always normal", constant(0.5)),
            ("always slow", constant(0.25)),
            ("three speeds", speeds(ThreeSpeed())),
            ("prior only, nothing learnt", speeds(ThreeSpeed(), learns=False)),
            ("`depth=1`", speeds(ThreeSpeed(depth=1))),
            ("`depth=5`", speeds(ThreeSpeed(depth=5))),
            ("`step=0.5 depth=6`", speeds(ThreeSpeed(step=0.5, depth=6))),
            ("`cost=3`", speeds(ThreeSpeed(cost=3.0))),
            ("`cost=30`", speeds(ThreeSpeed(cost=30.0))),
            ("`near=1`", speeds(ThreeSpeed(near=1))),
        ]
    )


def cloud_tables() -> None:
    """Danger."""
    table(
        [
            ("always fast", constant(1.0)),
            ("always at half speed", constant(0.5)),
            ("danger", cloud(CloudModel())),
            ("`horizon=3`", cloud(CloudModel(horizon=3.0))),
            ("`horizon=10`", cloud(CloudModel(horizon=10.0))),
            ("`near=0.5`", cloud(CloudModel(near=0.5))),
            ("`near=3`", cloud(CloudModel(near=3.0))),
            ("`hyper=0`", cloud(CloudModel(hyper=0.0))),
            ("`hyper=0.33`", cloud(CloudModel(hyper=0.33))),
        ]
    )


if __name__ == "__main__":
    parts = {"blind": blind, "three": three_tables, "cloud": cloud_tables}
    for word in sys.argv[1:] or list(parts):
        parts[word]()
        print()

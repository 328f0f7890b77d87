"""Passive safety: the push of a period, beside dense samples, and drives among pursuers who want contact."""

from __future__ import annotations

import math

import numpy as np
import pytest
from pushes import push

from lampyris.model.obstacles import ObstacleStates
from lampyris.model.robot import Robot
from lampyris.motion.geometry.sampled_path import SampledPath
from lampyris.motion.profile import feasible_profile
from lampyris.motion.safety.passive_acceleration import Push, Rails, rails_of
from reference.kernel_forms import use
from sizes import sized

ROBOT = Robot(radius=0.2, v_max=1.0, a_max=0.5, d_max=1.0)
PERIOD = 0.1


def wavy(n: int, length: float, wave: float = 1.0) -> SampledPath:
    x = np.linspace(0.0, length, 20 * n)
    xy = np.stack((x, wave * np.sin(x)), axis=-1)
    d = np.sqrt((np.diff(xy, axis=0) ** 2).sum(axis=1))
    xy = xy[:: len(xy) // n]
    d = np.sqrt((np.diff(xy, axis=0) ** 2).sum(axis=1))
    s = np.concatenate(([0.0], np.cumsum(d)))
    n = len(s)
    return SampledPath(s, xy, np.tile((1.0, 0.0), (n, 1)), np.zeros(n), np.zeros(n, dtype=bool), 1.0)


def ceiling_of(course: SampledPath) -> np.ndarray:  # type: ignore[type-arg]
    made = feasible_profile(course.s, [("limit", np.full(len(course), 1.0))], a_max=1e9, d_max=ROBOT.d_max)
    x = made.v**2
    x[0] = x[1]
    return x


def motion(a: float, v: float, period: float, d_max: float) -> tuple[np.ndarray, np.ndarray]:  # type: ignore[type-arg]
    """Times and ways of a push and the braking after it, densely."""
    first = period if v + a * period >= 0 else -v / a
    v1 = max(v + a * period, 0.0)
    t = np.linspace(0.0, first + v1 / d_max, 3000)
    late = np.maximum(t - first, 0.0)
    early = np.minimum(t, first)
    return t, early * (v + 0.5 * a * early) + late * (v1 - 0.5 * d_max * late)


def dense_gap(rails: Rails, s: float, v: float, a: float, movers: ObstacleStates) -> float:
    """Least gap at worst until the robot stands."""
    t, way = motion(a, v, PERIOD, ROBOT.d_max)
    if way[-1] <= 0.0:
        return math.inf
    x, y = np.interp(s + way, rails.s, rails.x), np.interp(s + way, rails.s, rails.y)
    worst = math.inf
    for m in range(len(movers)):
        d = np.hypot(x - movers.xy[m, 0], y - movers.xy[m, 1])
        gap = d - ROBOT.radius - movers.radius[m] - movers.top_speed[m] * (movers.age + t)
        worst = min(worst, float(gap.min()))
    return worst


def test_every_push_is_safe_and_none_is_timid() -> None:
    rng = np.random.default_rng(6)
    course = wavy(150, 12.0)
    rails, ceiling = rails_of(course), ceiling_of(course)
    seen: dict[str, int] = {}
    timid = 0
    for _ in range(400):
        s = float(rng.uniform(0, 0.9 * course.s[-1]))
        v = (
            0.0
            if rng.random() < 0.3
            else float(rng.uniform(0, 1)) * math.sqrt(np.interp(s, course.s, ceiling))
        )
        at = np.interp(s, course.s, course.xy[:, 0]), np.interp(s, course.s, course.xy[:, 1])
        m = int(rng.integers(1, 4))
        movers = ObstacleStates(
            at + rng.normal(0, 1.2, (m, 2)), rng.uniform(0, 0.3, m), rng.uniform(0, 1, m), None, 0.05
        )
        made = push(rails, ceiling, s, v, movers, ROBOT, PERIOD)
        seen[made.cause] = seen.get(made.cause, 0) + 1
        rest = 0.0 if v == 0.0 else -ROBOT.d_max
        assert rest <= made.a <= ROBOT.a_max
        if made.a > rest:
            assert dense_gap(rails, s, v, made.a, movers) >= -1e-6
        if made.cause == "moving obstacle":
            assert 0 <= made.cause_index < m
            # What the kernel did not find must be unsafe, or nearly, but for the parts it takes at once.
            for a in np.linspace(made.a, ROBOT.a_max, 12)[1:]:
                way = motion(a, v, PERIOD, ROBOT.d_max)[1][-1]
                top = np.interp(s + way, course.s, ceiling)
                timid += a > made.a + 0.15 and dense_gap(rails, s, v, a, movers) > 0.05 and top > 0.1
        else:
            assert made.cause_index == -1
    assert min(seen.values()) > 5
    assert seen["moving obstacle"] > 50
    assert timid <= 8


def drive(seed: int, dodge: float, course: SampledPath) -> tuple[int, bool, float]:
    """Pursuers at their top speed against the robot: contacts while it moves, whether it arrived, seconds."""
    rng = np.random.default_rng(seed)
    rails, ceiling = rails_of(course), ceiling_of(course)
    m = 3
    radius, top = np.full(m, 0.2), rng.uniform(0.2, 1.0, m)
    xy = np.stack((rng.uniform(2, 10, m), rng.choice((-1, 1), m) * rng.uniform(1.0, 4.0, m)), axis=-1)
    s, v, contacts, t = 0.0, 0.0, 0, 0.0
    previous = True
    while t < 60.0 and s < course.s[-1] - 1e-6:
        movers = ObstacleStates(xy, radius, top)
        a = push(rails, ceiling, s, v, movers, ROBOT, PERIOD).a
        # The invariant: where nothing was promised the robot stands still.
        full = dense_gap(rails, s, v, -ROBOT.d_max, movers) if v > 0 else math.inf
        assert not previous or full >= -1e-6
        previous = True
        for _ in range(10):
            h = PERIOD / 10
            go = h if v + a * h >= 0 else -v / a
            s += go * (v + 0.5 * a * go)
            v = max(v + a * go, 0.0) if go == h else 0.0
            here = np.array([np.interp(s, rails.s, rails.x), np.interp(s, rails.s, rails.y)])
            aim = here - xy
            far = np.maximum(np.sqrt((aim * aim).sum(axis=1)), 1e-9)
            # Straight at the robot until it has been had, then away for a while.
            towards = np.where(rng.random(m) < dodge, -1.0, 1.0)
            step = np.minimum(top * h, np.maximum(far - 0.4, 0.0))[:, None]
            xy = xy + towards[:, None] * step * aim / far[:, None]
            gap = np.sqrt(((here - xy) ** 2).sum(axis=1)) - 0.4
            contacts += int(v > 1e-9 and gap.min() < -1e-6)
        t += PERIOD
    return contacts, s >= course.s[-1] - 1e-3, t


@pytest.mark.nightly
@sized("cases", 10, 25)
def test_pursuers_never_touch_a_robot_that_moves(cases: int) -> None:
    course = wavy(120, 12.0, 0.3)
    arrived = 0
    for seed in range(cases):
        contacts, there, _ = drive(seed, 0.0 if seed % 2 else 0.6, course)
        assert contacts == 0
        arrived += there
    assert arrived > cases / 8


def test_alone_it_is_as_fast_as_may_be() -> None:
    """Without anybody it follows the ceiling to the goal and stands there."""
    course = wavy(120, 12.0)
    rails, ceiling = rails_of(course), ceiling_of(course)
    s = v = t = 0.0
    while s < course.s[-1] - 1e-9 and t < 60.0:
        a = push(rails, ceiling, s, v, None, ROBOT, PERIOD).a
        go = PERIOD if v + a * PERIOD >= 0 else -v / a
        s, v, t = s + go * (v + 0.5 * a * go), max(v + a * go, 0.0), t + PERIOD
        assert s <= course.s[-1] * (1 + 1e-12)
        assert v * v <= np.interp(s, course.s, ceiling) * (1 + 1e-9) + 1e-12
    fastest = feasible_profile(
        course.s, [("limit", np.full(len(course), 1.0))], a_max=ROBOT.a_max, d_max=ROBOT.d_max
    ).t[-1]
    assert s == pytest.approx(course.s[-1], abs=1e-9)
    assert t <= fastest + 5 * PERIOD


def one(x: float, y: float, u: float, age: float = 0.0) -> ObstacleStates:
    return ObstacleStates(np.array([(x, y)]), np.array([0.2]), np.array([u]), None, age)


def test_plain_cases() -> None:
    course = wavy(100, 10.0, 0.0)
    rails, ceiling = rails_of(course), ceiling_of(course)
    assert push(rails, ceiling, 2.0, 0.0, None, ROBOT, PERIOD) == Push(0.5, "acceleration")
    assert push(rails, ceiling, 2.0, 1.0, None, ROBOT, PERIOD).cause == "limit"
    assert push(rails, ceiling, 2.0, 1.0, None, ROBOT, PERIOD).a == pytest.approx(0.0, abs=1e-9)
    # Behind a slow obstacle that keeps pace with nobody: away is safe.
    assert push(rails, ceiling, 4.0, 0.5, one(3.0, 0.0, 0.1), ROBOT, PERIOD).cause == "acceleration"
    stuck = push(rails, ceiling, 4.0, 0.0, one(4.4, 0.0, 0.0), ROBOT, PERIOD)
    assert stuck.a == pytest.approx(0.0, abs=1e-3)
    assert stuck == Push(stuck.a, "moving obstacle", 0)
    # Standing still, but not for ever: half a metre of room lets it creep.
    creep = push(rails, ceiling, 4.0, 0.0, one(4.9, 0.0, 1.0), ROBOT, PERIOD)
    assert creep.a > 0.1
    # Too near to stop in time: nothing is better than full braking.
    assert push(rails, ceiling, 4.0, 1.0, one(4.6, 0.0, 1.0), ROBOT, PERIOD) == Push(
        -1.0, "moving obstacle", 0
    )
    wide = push(rails, ceiling, 4.0, 0.0, one(4.9, 0.0, 1.0), ROBOT, PERIOD, margin=0.45)
    assert wide.a < 0.01
    single = SampledPath(
        np.zeros(1), np.zeros((1, 2)), np.zeros((1, 2)), np.zeros(1), np.zeros(1, dtype=bool), 1.0
    )
    assert push(rails_of(single), np.zeros(2), 0.0, 0.0, None, ROBOT, PERIOD).a <= 1e-6


def test_both_forms_say_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    course = wavy(60, 8.0)
    rails, ceiling = rails_of(course), ceiling_of(course)
    rng = np.random.default_rng(1)
    asked = []
    for _ in range(60):
        s = float(rng.uniform(0, 7))
        v = float(rng.uniform(0, 1)) * math.sqrt(np.interp(s, course.s, ceiling))
        m = int(rng.integers(0, 5))
        here = np.array([np.interp(s, rails.s, rails.x), np.interp(s, rails.s, rails.y)])
        movers = ObstacleStates(here + rng.normal(0, 1.0, (m, 2)), np.full(m, 0.2), rng.uniform(0, 1, m))
        asked.append((rails, ceiling, s, v, movers, ROBOT, PERIOD))
    answers = {}
    for form in ("plain", "compiled"):
        with monkeypatch.context() as patch:
            use(patch, form)
            answers[form] = [push(*one) for one in asked]
    assert answers["plain"] == answers["compiled"]
    assert len({a.cause for a in answers["plain"]}) > 1

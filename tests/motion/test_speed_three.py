"""Three speeds: the solver beside every policy there is, beliefs by hand, and the cap on scenes."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from lampyris.errors import SettingError
from lampyris.model.grid import Grid
from lampyris.model.obstacles import ObstacleStates
from lampyris.model.path import path_of
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.motion.cap_values import Around
from lampyris.motion.geometry.sampled_path import SampledPath, sample_path
from lampyris.motion.safety.three_speed import (
    ThreeSpeed,
    ThreeSpeedControl,
    choose,
    contacts,
    intended,
    observed,
    three_speed_cap,
    updated,
)

SCENE = Scene(Grid(np.zeros((41, 101), dtype=bool), resolution=0.2), (0, 20), (100, 20), robot=Robot(0.2))


def way() -> SampledPath:
    cells = np.array([(x, 20) for x in range(101)])
    return sample_path(path_of(cells, SCENE.moves), 0.2)


def speeds(movers: ObstacleStates | None, settings: ThreeSpeed | None = None) -> np.ndarray:
    found = three_speed_cap(way(), SCENE, settings or ThreeSpeed(), Around(obstacle_states=movers))
    return np.minimum(found[0].v, 1.0) if found else np.ones(101)


def one(xy: tuple[float, float], velocity: tuple[float, float]) -> ObstacleStates:
    return ObstacleStates(np.array([xy]), np.array([0.3]), np.array([1.0]), np.array([velocity]))


# the solver ----------


def random_problem(rng: np.random.Generator, m: int, settings: ThreeSpeed) -> tuple[np.ndarray, np.ndarray]:
    belief = rng.dirichlet(np.ones(3), m)
    shape = (settings.depth, settings.depth * settings.paces[2] + 1, 3, m, 3)
    return belief, (rng.random(shape) < 0.4).astype(np.float64)


def reward(n: int, place: int, a: int, intents: tuple[int, ...], contact: np.ndarray, w: ThreeSpeed) -> float:
    share = w.paces[a] / w.paces[2]
    return share - w.cost * share * sum(contact[n, place, a, k, i] for k, i in enumerate(intents))


def worth(
    policy: dict[tuple[int, ...], int], belief: np.ndarray, contact: np.ndarray, w: ThreeSpeed
) -> float:
    """Value of one policy (observations so far -> speed), one obstacle: every intent, every observation."""
    total = 0.0
    for intent in range(3):
        for seen in product(range(3), repeat=w.depth - 1):
            chance, place = float(belief[0, intent]), 0
            for o in seen:
                chance *= float(w.likelihood[intent, o])
            for n in range(w.depth):
                a = policy[seen[:n]]
                total += chance * reward(n, place, a, (intent,), contact, w)
                place += w.paces[a]
    return total


@pytest.mark.parametrize("seed", range(4))
def test_no_policy_is_better_and_the_best_is_found(seed: int) -> None:
    rng = np.random.default_rng(seed)
    settings = ThreeSpeed(depth=2, cost=float(rng.uniform(0.5, 3.0)), accuracy=0.7)
    belief, contact = random_problem(rng, 1, settings)
    histories = [(), (0,), (1,), (2,)]
    best = [-np.inf] * 3
    for actions in product(range(3), repeat=4):
        policy = dict(zip(histories, actions, strict=True))
        best[actions[0]] = max(best[actions[0]], worth(policy, belief, contact, settings))
    index, values = choose(belief, contact, settings)
    assert values == pytest.approx(best)
    assert values[index] == pytest.approx(max(best))


def tree(n: int, place: int, belief: np.ndarray, contact: np.ndarray, w: ThreeSpeed) -> list[float]:
    """Values of the three speeds by plain recursion over beliefs, normalised by Bayes at each observation."""
    m = len(belief)
    out = []
    for a in range(3):
        value = 0.0
        for intents in product(range(3), repeat=m):
            chance = float(np.prod([belief[k, i] for k, i in enumerate(intents)]))
            value += chance * reward(n, place, a, intents, contact, w)
        if n + 1 < w.depth:
            for seen in product(range(3), repeat=m):
                likely = np.array([w.likelihood[:, o] for o in seen])
                chance = float((belief * likely).sum(axis=1).prod())
                after = belief * likely / (belief * likely).sum(axis=1, keepdims=True)
                value += chance * max(tree(n + 1, place + w.paces[a], after, contact, w))
        out.append(value)
    return out


@pytest.mark.parametrize(("m", "depth"), [(1, 1), (1, 3), (1, 4), (2, 2), (2, 3), (3, 2)])
def test_it_equals_the_whole_tree(m: int, depth: int) -> None:
    rng = np.random.default_rng(10 * m + depth)
    settings = ThreeSpeed(depth=depth, near=3, cost=1.3, accuracy=0.75, paces=(1, 3, 4))
    belief, contact = random_problem(rng, m, settings)
    _, values = choose(belief, contact, settings)
    assert values == pytest.approx(tree(0, 0, belief, contact, settings))


def test_knowing_more_is_worth_something_and_nothing_to_fear_is_driven_fast() -> None:
    rng = np.random.default_rng(6)
    gains = []
    for _ in range(20):
        blind = ThreeSpeed(accuracy=1 / 3, cost=2.0)
        belief, contact = random_problem(rng, 1, blind)
        low = choose(belief, contact, blind)[1].max()
        high = choose(belief, contact, ThreeSpeed(accuracy=1.0, cost=2.0))[1].max()
        assert high >= low - 1e-12
        gains.append(high - low)
    assert max(gains) > 0.05
    index, values = choose(np.zeros((0, 3)), np.zeros((3, 13, 3, 0, 3)), ThreeSpeed())
    assert index == 2
    assert values.tolist() == [2.25, 2.5, 3.0]
    free = choose(np.array([[1.0, 0.0, 0.0]]), np.zeros((3, 13, 3, 1, 3)), ThreeSpeed(cost=0.0))
    assert free[0] == 2


def test_of_equal_speeds_the_fastest_is_chosen() -> None:
    settings = ThreeSpeed(depth=1, cost=1.0)
    index, values = choose(np.array([[1.0, 0.0, 0.0]]), np.ones((1, 5, 3, 1, 3)), settings)
    assert values.tolist() == [0.0, 0.0, 0.0]
    assert index == 2


# beliefs ----------


def test_a_belief_by_hand() -> None:
    settings = ThreeSpeed(accuracy=0.8, forget=0.1)
    expected = np.array([[[1.0, 0.0], [0.0, 0.0], [0.0, 1.0]]])
    likely = observed(np.array([[0.1, 0.1]]), expected, settings.likelihood)
    assert likely == pytest.approx(np.array([[0.1, 0.8, 0.1]]))
    belief = updated(np.array([[0.8, 0.15, 0.05]]), likely, settings)
    total = 0.08 + 0.12 + 0.005
    want = [0.9 * 0.08 / total + 0.08, 0.9 * 0.12 / total + 0.015, 0.9 * 0.005 / total + 0.005]
    assert belief == pytest.approx(np.array([want]))
    assert belief.sum() == pytest.approx(1.0)


def test_what_cannot_be_told_apart_is_not() -> None:
    settings = ThreeSpeed(accuracy=0.8)
    expected = np.array([[[0.0, 0.0], [0.0, 0.0], [0.0, 1.0]]])
    likely = observed(np.array([[0.0, 0.0]]), expected, settings.likelihood)
    assert likely[0, 0] == likely[0, 1] == pytest.approx(0.45)
    assert likely[0, 2] == pytest.approx(0.1)


def test_an_impossible_sight_falls_back_on_the_prior() -> None:
    settings = ThreeSpeed(accuracy=1.0, forget=0.0)
    belief = updated(np.array([[1.0, 0.0, 0.0]]), np.array([[0.0, 1.0, 0.0]]), settings)
    assert belief.tolist() == [list(settings.prior)]


def test_control_learns_what_an_obstacle_does() -> None:
    course, control = way(), ThreeSpeedControl(ThreeSpeed())
    control.update(one((20, 5), (0, 0.75)), 0.0, course)
    assert control.belief.tolist() == [[0.8, 0.15, 0.05]]
    for k in range(1, 4):
        control.update(one((20, 5 + 3.75 * k), (0, 0.75)), 1.0, course, 0.2 * k)
    assert control.belief[0, 0] > 0.9
    for _ in range(3):
        control.update(one((20, 16.25), (0, 0.75)), 1.0, course, 0.8)
    assert control.belief[0, 1] > 0.8
    both = ObstacleStates([[20, 16], [0, 0]], [0.3, 0.3], [1.0, 1.0], np.zeros((2, 2)))
    control.update(both, 1.0, course, 0.8)
    assert control.belief.tolist() == [[0.8, 0.15, 0.05]] * 2
    control.update(None, 1.0, course)
    assert control.belief.shape == (0, 3)


def test_control_is_slower_once_an_obstacle_has_stopped_in_the_way() -> None:
    course, control = way(), ThreeSpeedControl(ThreeSpeed(prior=(0.98, 0.01, 0.01)))
    movers = one((7, 20), (0, 1.0))
    control.update(movers, 0.0, course)
    before = control.cap(course, SCENE, Around(obstacle_states=movers))[0].v[0]
    for _ in range(4):
        control.update(movers, 1.0, course)
    after = control.cap(course, SCENE, Around(obstacle_states=movers))[0].v[0]
    assert before == 1.0
    assert after < 1.0


# the table of contacts ----------


def test_intents_by_hand() -> None:
    start, velocity = np.array([[0.0, 4.0]]), np.array([[1.0, 0.0]])
    road = np.array([[x, 0.0] for x in (-2.0, 0.0, 2.0)])
    at = intended(start, velocity, np.array([2.0]), road, np.array([0.0, 1.0, 5.0]))
    assert at.shape == (1, 3, 3, 2)
    assert at[0, 0].tolist() == [[0.0, 4.0], [1.0, 4.0], [5.0, 4.0]]
    assert at[0, 1].tolist() == [[0.0, 4.0]] * 3
    assert at[0, 2].tolist() == [[0.0, 4.0], [0.0, 2.0], [0.0, 0.0]]


def test_contacts_agree_with_small_steps_of_time() -> None:
    rng = np.random.default_rng(7)
    settings, course = ThreeSpeed(paces=(1, 2, 3), depth=2), way()
    found = 0
    for _ in range(6):
        movers = one((float(rng.uniform(3, 12)), float(rng.uniform(12, 28))), tuple(rng.uniform(-1, 1, 2)))
        table = contacts(course, 4, 0.8, SCENE, settings, movers, np.array([0]))
        for n, place, a in product(range(2), range(7), range(3)):
            t = np.linspace(n, n + 1, 201)
            x = 0.8 + (place + settings.paces[a] * (t - n)) / 3
            theirs = intended(
                movers.xy * 0.2, movers.velocity, movers.top_speed, course.xy[4:] * 0.2, 0.8 + t
            )
            gap = np.sqrt(((theirs[0] - np.stack((x, np.full_like(x, 4.0)), axis=1)) ** 2).sum(axis=2))
            near = gap.min(axis=1)
            for intent in range(3):
                if abs(near[intent] - 0.6) > 0.01:
                    assert table[n, place, a, 0, intent] == (near[intent] < 0.6)
                    found += int(near[intent] < 0.6)
    assert found > 30


# the cap ----------


def test_without_obstacles_it_is_fast_everywhere() -> None:
    assert three_speed_cap(way(), SCENE, ThreeSpeed(), Around()) == []
    assert (speeds(one((90, 0), (0, 0))) == 1.0).all()


def test_a_crossing_obstacle_makes_it_slow_and_a_receding_one_does_not() -> None:
    # In 3 s both are at (3 m, 4 m).
    crossing = speeds(one((15, 8), (0, 0.8)))
    assert crossing.min() < 1.0
    assert set(np.unique(crossing)) <= {0.25, 0.5, 1.0}
    assert (speeds(one((15, 8), (0, -0.8))) == 1.0).all()


def test_it_passes_what_will_be_gone() -> None:
    sure = ThreeSpeed(prior=(1.0, 0.0, 0.0))
    assert (speeds(one((15, 19), (0, 0.9)), sure) == 1.0).all()
    assert (speeds(one((15, 19), (0, 0.0)), sure) < 1.0).any()


def test_it_speaks_only_as_far_ahead_as_it_is_told_to() -> None:
    found = three_speed_cap(
        way(), SCENE, ThreeSpeed(ahead=3.0), Around(obstacle_states=one((15, 8), (0, 0.8)))
    )
    (cap,) = found
    assert cap.cause == "three speeds"
    assert np.isinf(cap.v[-1])
    assert np.isfinite(cap.v[0])


def test_only_the_nearest_are_weighed_and_far_ones_change_nothing() -> None:
    near = one((15, 8), (0, 0.8))
    far = ObstacleStates([[15, 8], [99, 0]], [0.3, 0.3], [1.0, 1.0], [[0, 0.8], [0, 0]])
    assert (speeds(near) == speeds(far)).all()


def test_a_course_of_one_node() -> None:
    course = way()
    point = SampledPath(
        course.s[:1], course.xy[:1], course.heading[:1], course.curvature[:1], course.stop[:1], 0.2
    )
    (cap,) = three_speed_cap(point, SCENE, ThreeSpeed(), Around(obstacle_states=one((2, 20), (0, 0))))
    assert cap.v.shape == (1,)


def test_the_same_bytes_every_time() -> None:
    movers = ObstacleStates([[15, 8], [25, 30]], [0.3, 0.3], [1.0, 1.0], [[0, 0.8], [0, -0.5]])
    assert speeds(movers).tobytes() == speeds(movers).tobytes()


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("paces", (1, 1, 4)),
        ("paces", (0.5, 1, 2)),
        ("paces", 3),
        ("step", 0.0),
        ("depth", 7),
        ("depth", 2.0),
        ("cost", -1.0),
        ("prior", (0.5, 0.5, 0.5)),
        ("prior", (1.5, -0.5, 0.0)),
        ("accuracy", 0.2),
        ("forget", 1.1),
        ("near", 0),
    ],
)
def test_settings_are_checked(name: str, value: object) -> None:
    with pytest.raises(SettingError, match=rf"LAW_SETTING.*physical\.three_speed\.{name}"):
        ThreeSpeed(**{name: value})  # type: ignore[arg-type]

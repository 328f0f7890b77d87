"""GSO: the five equations against a plain reference, the roulette against equation 2.9, the published peaks."""

from __future__ import annotations

import math

import numpy as np
import pytest

from lampyris.errors import SettingError
from lampyris.planning.swarm.optimisers.box import Box
from lampyris.planning.swarm.optimisers.functions import FUNCTIONS
from lampyris.planning.swarm.optimisers.glowworm import GSO, GlowwormSwarm, adaptive_gso, igso, roulette
from lampyris.planning.swarm.optimisers.loop import StoppingRule, maximise
from lampyris.planning.swarm.optimisers.steps import CoolingStep, DecayingStep, FixedStep
from lampyris_selfcheck.reference.paths import glowworm

J1, J9 = FUNCTIONS["J1"], FUNCTIONS["J9"]


def _bowl(points: np.ndarray) -> np.ndarray:
    total = np.zeros(len(points))
    for k in range(points.shape[1]):
        total = total - points[:, k] * points[:, k]
    return total


@pytest.mark.parametrize("choice", ["roulette", "greedy"])
@pytest.mark.parametrize("dimensions", [1, 2, 3])
def test_equal_to_the_last_bit_with_a_plain_twin(choice: str, dimensions: int) -> None:
    for seed in range(6):
        box = Box(np.full(dimensions, -2.0), np.full(dimensions, 2.0))
        settings = GSO(n=14, sensor=1.1, nt=3, beta=0.2, step=FixedStep(0.3), choice=choice)
        swarm = settings.start(box, np.random.default_rng(seed))
        begin = swarm.positions.tolist()
        lots = np.random.default_rng(seed)
        lots.random((14, dimensions))  # what the scatter drew
        for _ in range(25):
            swarm.tell(_bowl(swarm.ask()))
        x, light, reach = glowworm.run(
            begin,
            lambda p: float(_bowl(np.array([p]))[0]),
            (lambda lots=lots: lots.random(14).tolist()) if choice == "roulette" else None,
            low=-2.0,
            high=2.0,
            iterations=25,
            sensor=1.1,
            nt=3,
            beta=0.2,
            step=0.3,
        )
        assert swarm.positions.tolist() == x
        assert swarm.luciferin.tolist() == light
        assert swarm.ranges.tolist() == reach


def test_roulette_draws_each_neighbour_as_often_as_equation_2_9_says() -> None:
    light = np.array([1.0, 2.0, 4.0, 1.5, 9.0, 0.5, 3.25])
    weights = np.maximum(light - light[0], 0.0)
    draws = np.random.default_rng(3).random(50_000)
    column = roulette(np.tile(weights, (50_000, 1)), draws)
    share = np.bincount(column, minlength=7) / 50_000
    np.testing.assert_allclose(share, weights / weights.sum(), rtol=0, atol=0.01)
    assert share[0] == share[5] == 0


@pytest.mark.nightly
def test_the_swarm_itself_draws_that_often() -> None:
    # One dim glowworm in the middle, five brighter ones around it at the same distance: where it goes says
    # whom it followed.
    around = np.array([[math.cos(a), math.sin(a)] for a in (0.0, 1.3, 2.5, 3.8, 5.1)])
    light = np.array([0.0, 1.0, 2.0, 3.0, 5.0, 9.0])
    settings = GSO(n=6, sensor=10.0, luciferin=0.0, gamma=1.0, step=FixedStep(0.5))
    box = Box(np.full(2, -2.0), np.full(2, 2.0))
    rng = np.random.default_rng(5)
    seen = np.zeros(5)
    first = np.vstack((np.zeros((1, 2)), around))
    for _ in range(6_000):
        swarm = settings.start(box, rng, first)
        swarm.tell(light)
        seen[np.argmin(np.hypot(*(swarm.positions[0] - 0.5 * around).T))] += 1
    np.testing.assert_allclose(seen / 6_000, light[1:] / light.sum(), rtol=0, atol=0.02)


def test_roulette_at_the_edges() -> None:
    least = np.nextafter(1.0, 0.0)
    assert roulette(np.array([[0.0, 3.0, 1.0, 0.0]]), np.array([0.0])).tolist() == [1]
    assert roulette(np.array([[0.0, 3.0, 1.0, 0.0]]), np.array([least])).tolist() == [2]
    tiny = np.array([[0.0, 5e-324, 0.0]])
    assert roulette(tiny, np.array([least])).tolist() == [1]
    assert roulette(np.zeros((1, 3)), np.array([0.5])).tolist() == [0]


def _caught(function: str, seeds: range, n: int, sensor: float) -> list[int]:
    f = FUNCTIONS[function]
    found = []
    for seed in seeds:
        swarm = GSO(n=n, sensor=sensor).start(f.box, np.random.default_rng(seed))
        maximise(swarm, f, StoppingRule(250))
        found.append(f.caught(swarm.positions))
    return found


@pytest.mark.nightly
def test_j1_all_three_peaks() -> None:
    found = _caught("J1", range(12), 100, 3.0)
    assert sum(k == 3 for k in found) >= 11, found


@pytest.mark.nightly
def test_j1_all_three_peaks_in_98_of_100_seeds() -> None:
    found = _caught("J1", range(100), 100, 3.0)
    print(f"J1, n = 100: all three peaks in {sum(k == 3 for k in found)} of 100 seeds")
    assert sum(k == 3 for k in found) >= 98, found


@pytest.mark.nightly
def test_j9_all_twelve_peaks() -> None:
    found = _caught("J9", range(10), 500, 2.0)
    print(f"J9, n = 500: peaks caught in 10 seeds: {found}")
    assert found == [12] * 10


@pytest.mark.nightly
def test_j9_twelve_peaks_once() -> None:
    assert _caught("J9", range(1), 500, 2.0) == [12]


def test_the_greedy_choice_is_sooner_at_the_highest_peak() -> None:
    arrived = {}
    for choice in ("roulette", "greedy"):
        arrived[choice] = 0
        for seed in range(8):
            swarm = GSO(n=60, sensor=3.0, choice=choice).start(J1.box, np.random.default_rng(seed))
            maximise(swarm, J1, StoppingRule(40))
            arrived[choice] += int((np.hypot(*(swarm.positions - np.array([J1.peaks[0]])).T) < 0.1).sum())
    assert arrived["greedy"] > 1.5 * arrived["roulette"], arrived


def test_a_move_that_leaves_the_box_is_not_taken() -> None:
    box = Box(np.array([0.0]), np.array([1.0]))
    settings = GSO(n=2, sensor=5.0, step=FixedStep(0.4))
    swarm = settings.start(box, np.random.default_rng(0), [[0.7], [0.8]])
    swarm.tell(np.array([0.0, 1.0]))
    assert swarm.positions.tolist() == [[0.7], [0.8]]
    assert swarm.ranges.tolist() == [5.0, 5.0]


def test_who_stands_on_its_leader_stays() -> None:
    box = Box(np.array([0.0]), np.array([1.0]))
    swarm = GSO(n=3, sensor=5.0).start(box, np.random.default_rng(0), [[0.5], [0.5], [0.5]])
    swarm.tell(np.array([0.0, 1.0, 2.0]))
    assert swarm.positions.tolist() == [[0.5]] * 3
    assert swarm.iteration == 1


def test_ranges_shrink_with_many_neighbours_and_never_pass_the_sensor() -> None:
    swarm = GSO(n=40, sensor=1.0, nt=2).start(J1.box, np.random.default_rng(0))
    for _ in range(50):
        swarm.tell(J1(swarm.ask()))
        assert (swarm.ranges <= 1.0).all()
        assert (swarm.ranges >= 0.0).all()
    assert (swarm.ranges < 1.0).any()


def test_wanderers_go_back_unless_it_is_better_there() -> None:
    box = Box(np.full(2, -1.0), np.full(2, 1.0))
    swarm = GSO(n=1, wander=0.5, gamma=1.0, rho=1.0).start(box, np.random.default_rng(2))
    heights = []
    kept = []
    for _ in range(80):
        at = swarm.positions.copy()
        swarm.tell(_bowl(at))
        heights.append(float(swarm.luciferin[0]))
        kept.append(float(_bowl(at)[0]))
    assert heights == list(np.maximum.accumulate(heights))
    assert min(kept[5:]) < heights[5], "no trial was ever worse: nothing was tested"
    assert heights[-1] > heights[0]


def test_igso_and_the_adaptive_step_find_the_highest_peak() -> None:
    for settings in (igso(n=40, horizon=120, most=0.5), adaptive_gso(n=60)):
        swarm = settings.start(J1.box, np.random.default_rng(4))
        found = maximise(swarm, J1, StoppingRule(120))
        assert found.value > 8.0


def test_step_rules() -> None:
    assert FixedStep(0.2).at(17) == 0.2
    rule = DecayingStep(mu=0.5, psi=0.1, xi=0.03)
    assert rule.at(0) == 0.53
    assert rule.at(10) == pytest.approx(0.5 * math.exp(-1.0) + 0.03, rel=1e-14)
    cool = CoolingStep(most=1.0, least=0.1, fall=2.0, horizon=10.0)
    assert cool.at(0) == 1.0
    assert cool.at(10) == pytest.approx(0.1 + 0.9 * math.exp(-2.0), rel=1e-14)
    for wrong in (
        lambda: FixedStep(0.0),
        lambda: DecayingStep(mu=1.0),
        lambda: CoolingStep(most=0.01, least=1),
    ):
        with pytest.raises(SettingError):
            wrong()


@pytest.mark.parametrize(
    "wrong",
    [{"n": 0}, {"n": 2.0}, {"rho": 1.5}, {"gamma": 0}, {"choice": "best"}, {"sensor": -1.0}, {"wander": 2}],
)
def test_settings_out_of_range(wrong: dict[str, object]) -> None:
    with pytest.raises(SettingError):
        GSO(**wrong)  # type: ignore[arg-type]


def test_values_that_are_no_numbers_are_refused() -> None:
    swarm: GlowwormSwarm = GSO(n=3).start(J9.box, np.random.default_rng(0))
    for values in (np.zeros(2), np.array([0.0, math.nan, 1.0]), np.array([0.0, math.inf, 1.0])):
        with pytest.raises(SettingError, match="VALUES"):
            swarm.tell(values)

"""The loop, its stop rules, particle swarms and test functions."""

from __future__ import annotations

import math

import numpy as np
import pytest

from lampyris.errors import SettingError
from lampyris.planning.swarm.optimisers.box import Box
from lampyris.planning.swarm.optimisers.functions import FUNCTIONS
from lampyris.planning.swarm.optimisers.glowworm import GSO
from lampyris.planning.swarm.optimisers.loop import Optimiser, StoppingRule, maximise, minimise
from lampyris.planning.swarm.optimisers.particle import PSO, FixedInertia, SuccessInertia, apso

BOX = Box(np.full(3, -5.0), np.full(3, 5.0))
ALL: list[Optimiser] = [PSO(n=20), PSO(n=20, ring=1), apso(20), GSO(n=20, sensor=6.0)]


def bowl(points: np.ndarray) -> np.ndarray:
    return (points[:, 0] - 1) ** 2 + points[:, 1] ** 2 + (points[:, 2] + 2) ** 2


@pytest.mark.parametrize("settings", [PSO(n=20), PSO(n=20, ring=1), apso(20)])
def test_particles_find_the_bottom_of_a_bowl(settings: PSO) -> None:
    found = minimise(settings.start(BOX, np.random.default_rng(0)), bowl, StoppingRule(150))
    assert found.value < 1e-3
    np.testing.assert_allclose(found.best, [1, 0, -2], atol=0.05)
    assert bowl(found.best[np.newaxis])[0] == found.value
    assert found.evaluations == 150 * 20


@pytest.mark.parametrize("settings", ALL)
def test_best_so_far_never_worsens_and_the_same_seed_gives_the_same_bytes(settings: Optimiser) -> None:
    runs = []
    for _ in range(2):
        swarm = settings.start(BOX, np.random.default_rng(7))
        seen: list[float] = []

        def watched(points: np.ndarray, seen: list[float] = seen) -> np.ndarray:
            assert BOX.contains(points).all()
            seen.append(float(bowl(points).min()))
            return bowl(points)

        found = minimise(swarm, watched, StoppingRule(40))
        assert list(found.best_by_iteration) == list(np.minimum.accumulate(seen))
        runs.append((found.best.tobytes(), swarm.ask().tobytes(), found.best_by_iteration))
    assert runs[0] == runs[1]


def test_maximise_is_minimise_of_the_negative() -> None:
    a = minimise(PSO(n=9).start(BOX, np.random.default_rng(1)), bowl, StoppingRule(20))
    b = maximise(PSO(n=9).start(BOX, np.random.default_rng(1)), lambda p: -bowl(p), StoppingRule(20))
    assert a.best.tobytes() == b.best.tobytes()
    assert a.value == -b.value
    assert a.best_by_iteration == tuple(-v for v in b.best_by_iteration)


def test_every_stop_rule_stops() -> None:
    def run(stop: StoppingRule, watch: object = None) -> tuple[str, int, int]:
        swarm = PSO(n=10).start(BOX, np.random.default_rng(0))
        found = minimise(swarm, bowl, stop, watch)  # type: ignore[arg-type]
        return found.why, found.iterations, found.evaluations

    assert run(StoppingRule(7)) == ("iterations", 7, 70)
    assert run(StoppingRule(7, evaluations=39)) == ("evaluations", 3, 30)
    why, rounds, _ = run(StoppingRule(10_000, target=0.5))
    assert why == "target"
    assert rounds < 200
    calls = iter([False, False, True])
    assert run(StoppingRule(7), lambda: next(calls)) == ("watch", 2, 20)
    flat = minimise(
        PSO(n=4).start(BOX, np.random.default_rng(0)),
        lambda p: np.zeros(len(p)),
        StoppingRule(50, patience=6),
    )
    assert (flat.why, flat.iterations) == ("patience", 7)
    nothing = minimise(PSO(n=4).start(BOX, np.random.default_rng(0)), bowl, StoppingRule(3, evaluations=2))
    assert nothing.best is None
    assert nothing.value == math.inf


@pytest.mark.parametrize("wrong", [{"iterations": 0}, {"patience": 1.5}, {"target": math.nan}])
def test_stop_rules_out_of_range(wrong: dict[str, object]) -> None:
    with pytest.raises(SettingError):
        StoppingRule(**wrong)  # type: ignore[arg-type]


def test_one_particle_moves_by_the_published_equation() -> None:
    settings = PSO(n=2, inertia=FixedInertia(0.5), own=2.0, others=1.0)
    swarm = settings.start(BOX, np.random.default_rng(3), [[1.0, 1.0, 1.0], [0.0, 2.0, -1.0]])
    swarm.tell(np.array([0.0, 1.0]))
    again = np.random.default_rng(3)
    again.random((2, 3))
    own, others = again.random((2, 3)), again.random((2, 3))
    x = np.array([[1.0, 1.0, 1.0], [0.0, 2.0, -1.0]])
    v = 2.0 * own * 0.0 + 1.0 * others * (x[[1, 1]] - x)
    np.testing.assert_array_equal(swarm.positions, x + v)
    swarm.tell(np.array([2.0, -1.0]))
    own, others = again.random((2, 3)), again.random((2, 3))
    y = np.array([(x + v)[0], x[1]])
    w = 0.5 * v + 2.0 * own * (y - (x + v)) + 1.0 * others * (y[[0, 0]] - (x + v))
    np.testing.assert_allclose(swarm.positions, x + v + w, rtol=1e-14)


def test_a_ring_sees_its_neighbours_only() -> None:
    swarm = PSO(n=7, ring=1).start(BOX, np.random.default_rng(0))
    swarm.values = np.array([0.0, 5.0, 1.0, 1.0, 2.0, 9.0, 3.0])
    assert swarm.guides().tolist() == [1, 1, 1, 4, 5, 5, 5]
    swarm.settings = PSO(n=7, ring=None)
    assert swarm.guides().tolist() == [5] * 7
    swarm.settings = PSO(n=7, ring=99)
    assert swarm.guides().tolist() == [5] * 7


def test_particles_stay_in_the_box_and_lose_their_speed_on_its_wall() -> None:
    swarm = PSO(n=5, push=lambda x: np.full_like(x, 3.0)).start(BOX, np.random.default_rng(0))
    for _ in range(10):
        swarm.tell(-bowl(swarm.ask()))
        assert BOX.contains(swarm.ask()).all()
    on_wall = swarm.positions == 5.0
    assert on_wall.any()
    assert (swarm.speeds[on_wall] == 0.0).all()


def test_inertia_follows_success() -> None:
    rule = SuccessInertia(0.4, 0.9)
    assert (rule.after(0.0), rule.after(0.5), rule.after(1.0)) == (0.4, 0.65, 0.9)
    with pytest.raises(SettingError):
        SuccessInertia(0.4, 1.9)
    with pytest.raises(SettingError):
        PSO(ring=0)


@pytest.mark.parametrize("name", FUNCTIONS)
def test_peaks_are_peaks(name: str) -> None:
    f = FUNCTIONS[name]
    for peak, height in zip(f.peaks, f.heights, strict=True):
        at = np.array([peak])
        assert f(at)[0] == pytest.approx(height, abs=1e-4)
        turns = np.linspace(0, 2 * np.pi, 12)
        around = at + 0.02 * np.stack((np.cos(turns), np.sin(turns)), axis=1)
        assert (f(around) < f(at)[0]).all()
    grid = np.stack(np.meshgrid(*[np.linspace(f.low, f.high, 161)] * 2), axis=-1).reshape(-1, 2)
    if f.heights:
        assert f(grid).max() <= max(f.heights) + 1e-4


def test_functions_are_as_written() -> None:
    rng = np.random.default_rng(8)
    for name, formula in {
        "J3": lambda x, y: (x * x + y * y) ** 0.25 * (math.sin(50 * (x * x + y * y) ** 0.1) ** 2 + 0.1),
        "J4": lambda x, y: 25 - math.floor(x) - math.floor(y),
        "J5": lambda x, y: math.copysign(1, math.cos(x) + math.cos(y)),
        "J9": lambda x, y: math.cos(x) ** 2 + math.sin(y) ** 2,
        "J1": lambda x, y: (
            3 * (1 - x) ** 2 * math.exp(-(x * x + (y + 1) ** 2))
            - 10 * (x / 5 - x**3 - y**5) * math.exp(-(x * x + y * y))
            - math.exp(-((x + 1) ** 2 + y * y)) / 3
        ),
        "Rastrigin": lambda x, y: sum(10 + v * v - 10 * math.cos(2 * math.pi * v) for v in (x, y)),
    }.items():
        f = FUNCTIONS[name]
        points = f.box.scatter(rng, 200)
        np.testing.assert_allclose(f(points), [formula(x, y) for x, y in points.tolist()], atol=1e-10)
    assert FUNCTIONS["J3"](np.zeros((1, 2)))[0] == 0.0
    assert FUNCTIONS["Rastrigin"](np.zeros((1, 2)))[0] == 0.0
    assert FUNCTIONS["J4"](np.array([[-2.5, -2.1]]))[0] == 31


def test_boxes_out_of_order_and_first_points_outside() -> None:
    for low, high in (([1.0], [0.0]), ([0.0], [math.inf]), ([0.0], [1.0, 2.0])):
        with pytest.raises(SettingError, match="BOX"):
            Box(np.array(low), np.array(high))
    assert Box(np.zeros(2), np.array([3.0, 4.0])).diagonal == 5.0
    with pytest.raises(SettingError, match="FIRST"):
        PSO(n=1).start(BOX, np.random.default_rng(0), [[9.0, 0.0, 0.0]])
    with pytest.raises(SettingError, match="FIRST"):
        PSO(n=1).start(BOX, np.random.default_rng(0), np.zeros((2, 3)))

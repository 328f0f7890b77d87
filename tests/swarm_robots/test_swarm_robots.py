"""swarm_robots: sources are held, runs repeat bit for bit, and what is wrong is refused by name."""

from __future__ import annotations

import copy
import json
import pickle
from typing import Any

import numpy as np
import pytest
from swarm_maps import filled, halls, walled

import lampyris
from lampyris import swarms
from lampyris.errors import LimitError, SettingError, UnknownSettingError, UsageError
from lampyris.model.plan import Status
from lampyris.model.settings.swarm import SwarmSettings
from lampyris.model.swarm.swarm_trace import SwarmTrace
from sizes import some


@pytest.fixture(scope="module")
def trace() -> SwarmTrace:
    return lampyris.swarm_robots(walled(), robots=25, seed=3, iterations=25, noise=0.02)


@pytest.mark.commit(1)
@pytest.mark.parametrize("seed", some(range(100), 2))
def test_the_three_peaks_are_held_on_a_walled_map(seed: int) -> None:
    """The referee has judged every moment of it: no disc touches another, or a wall."""
    made = lampyris.swarm_robots(lampyris.load_grid("env-6"), robots=100, seed=seed, iterations=150)
    assert made.status is Status.FOUND
    assert (made.held[-1] >= 3).all()
    assert all(0 < since < 150 for since in made.held_from if since is not None)
    assert sum(made.held[-1]) > 60


@pytest.mark.nightly
def test_gso_holds_more_robots_than_the_gradient_when_sensors_are_noisy() -> None:
    grid = lampyris.load_grid("env-6")
    by = {
        method: lampyris.swarm_robots(grid, robots=60, seed=1, iterations=120, noise=0.2, method=method)
        .held[-1]
        .sum()
        for method in ("gso", "gradient")
    }
    assert by["gso"] > 2 * by["gradient"]


def test_without_noise_the_gradient_climbs() -> None:
    grid = lampyris.Grid(np.zeros((30, 30), dtype=bool))
    source = lampyris.InverseSquare((20.0, 10.0), core=8.0)
    made = lampyris.swarm_robots(
        grid, source, starts=[(5.0, 5.0), (25.0, 25.0), (15.0, 3.0)], method="gradient", iterations=150
    )
    assert made
    assert made.held[-1].tolist() == [3]


@pytest.mark.nightly
def test_a_moving_source_is_followed() -> None:
    grid = lampyris.Grid(np.zeros((30, 30), dtype=bool))
    source = lampyris.InverseSquare((8.0, 8.0), core=6.0, route=[(22.0, 22.0)], speed=0.02)
    made = lampyris.swarm_robots(grid, [source], robots=40, iterations=250, seed=1)
    assert np.abs(made.source_xy[-1] - made.source_xy[0]).max() > 4.0
    assert made
    assert made.held[-1, 0] >= 10


def test_the_swarm_splits_into_groups(trace: SwarmTrace) -> None:
    assert len(trace.groups_over_time) == trace.iterations
    for t in (0, 10, 24):
        sizes = trace.group_sizes(t)
        assert sum(sizes) == trace.robots
        assert list(sizes) == sorted(sizes, reverse=True)
        assert trace.groups_over_time[t] == sum(size >= 3 for size in sizes)
    apart = lampyris.swarm_robots(
        lampyris.load_grid("env-6"), robots=60, iterations=150, seed=2, sensor_range=12.0
    )
    assert apart.groups_over_time.max() >= 3, "one group for each peak at least"


def test_who_holds_whom(trace: SwarmTrace) -> None:
    holder = trace.holder
    radius = trace.settings.capture_radius
    assert radius is not None
    for i, (x, y) in enumerate(trace.xy[-1].tolist()):
        gaps = np.sqrt(((trace.source_xy[-1] - (x, y)) ** 2).sum(axis=1))
        assert holder[i] == (int(gaps.argmin()) if gaps.min() < radius else -1)
    assert [int((holder == k).sum()) for k in range(3)] == trace.held[-1].tolist()


@pytest.mark.nightly
def test_the_same_seed_gives_the_same_bytes(trace: SwarmTrace) -> None:
    again = lampyris.swarm_robots(walled(), robots=25, seed=3, iterations=25, noise=0.02)
    assert again == trace
    assert again.xy.tobytes() == trace.xy.tobytes()
    assert again != lampyris.swarm_robots(walled(), robots=25, seed=4, iterations=25, noise=0.02)


def test_both_methods_begin_at_the_same_places(trace: SwarmTrace) -> None:
    other = lampyris.swarm_robots(walled(), robots=25, seed=3, iterations=1, method="gradient")
    assert np.array_equal(other.xy[0], trace.xy[0])


def test_one_call_or_two_halves_of_the_budget() -> None:
    """What a budget of iterations leaves is the beginning of the whole."""
    whole = lampyris.swarm_robots(walled(), robots=15, iterations=12)
    part = lampyris.swarm_robots(walled(), robots=15, iterations=12, budget=lampyris.Budget(expansions=5))
    assert part.status is Status.LIMIT
    assert part.iterations == 5
    assert np.array_equal(part.xy, whole.xy[:6])
    assert np.array_equal(part.leaders, whole.leaders[:5])


def test_a_stop_ends_it() -> None:
    stop = lampyris.CancelToken()
    done = []

    def progress(k: int, most: int) -> None:
        done.append((k, most))
        if k == 3:
            stop.set()

    made = lampyris.swarm_robots(
        walled(), robots=10, iterations=50, budget=lampyris.Budget(stop=stop), progress=progress
    )
    assert made.status is Status.CANCELLED
    assert made.iterations == 3
    assert done == [(1, 50), (2, 50), (3, 50)]


def test_copies_dictionaries_and_repr(trace: SwarmTrace) -> None:
    assert len(repr(trace)) <= 120
    assert "25 robots" in repr(trace)
    assert not trace
    read = SwarmTrace.from_dict(json.loads(json.dumps(trace.to_dict())))
    for made in (copy.deepcopy(trace), pickle.loads(pickle.dumps(trace)), read):
        assert made == trace
        assert not made.xy.flags.writeable
    for source in (
        lampyris.ThreePeaks((1.0, 2.0), 3.0, 4.0),
        lampyris.InverseSquare((1, 2), route=[(3, 4)]),
        lampyris.Plume((1, 2), towards=1.0),
    ):
        assert type(source).from_dict(source.to_dict()) == source
        assert len(repr(source)) <= 120
    assert trace._repr_html_()


def test_an_empty_trace_can_be_written_and_read() -> None:
    made = lampyris.swarm_robots(walled(), robots=4, iterations=9, budget=lampyris.Budget(seconds=1e-9))
    assert made.status is Status.LIMIT
    assert SwarmTrace.from_dict(made.to_dict()) == made


def test_a_robot_of_any_size_fits_where_it_is_put() -> None:
    for radius in (0.05, 0.4, 1.3):
        made = lampyris.swarm_robots(lampyris.load_grid("env-6"), robots=12, iterations=6, radius=radius)
        assert made.settings.radius == radius
    with pytest.raises(SettingError, match=r"ROBOTS.*radius"):
        lampyris.swarm_robots(walled(), robots=2, radius=30.0)
    with pytest.raises(SettingError, match=r"ROBOTS.*allowed: at most [\d,]+ here"):
        lampyris.swarm_robots(halls(), robots=400, radius=0.4)


def test_a_turning_rate_and_a_speed_are_kept_by_slow_robots_too() -> None:
    """The referee judges turns and speeds; here both bind."""
    made = lampyris.swarm_robots(walled(), robots=20, iterations=15, yaw_rate_max=0.2, v_max=0.1)
    assert made.settings.period > 15.0
    made = lampyris.swarm_robots(walled(), robots=20, iterations=15, yaw_rate_max=1e4)
    assert made.iterations == 15


@pytest.mark.parametrize(
    ("given", "code"),
    [
        ({"robots": 0}, "ROBOTS"), ({"robots": 20_001}, "ROBOTS"), ({"robots": 2.5}, "ROBOTS"),
        ({"seed": -1}, "SEED"), ({"sources": "peaks"}, "SOURCES"), ({"sources": []}, "SOURCES"),
        ({"sources": [1]}, "SOURCES"), ({"starts": [(1.0,)]}, "STARTS"), ({"starts": [(-1.0, 2.0)]}, "STARTS"),
        ({"starts": [(4.4, 4.4), (4.45, 4.4)]}, "STARTS"), ({"starts": [(4.4, 4.4)], "robots": 2}, "ROBOTS"),
        ({"iterations": 0}, "SWARM_SETTING"), ({"noise": -0.1}, "SWARM_SETTING"), ({"method": "pso"}, "SWARM_SETTING"),
        ({"rho": 1.5}, "SWARM_SETTING"), ({"swarm_settings": {"nt": 0.5}}, "SWARM_SETTING"),
    ],
)  # fmt: skip
def test_what_is_refused(given: dict[str, Any], code: str) -> None:
    grid = lampyris.Grid(np.zeros((9, 9), dtype=bool))
    with pytest.raises(SettingError, match=rf"\[{code}\].*allowed: "):
        lampyris.swarm_robots(grid, **given)


def test_an_unknown_setting_is_named_with_the_nearest() -> None:
    with pytest.raises(UnknownSettingError, match="did you mean noise"):
        lampyris.swarm_robots(walled(), nois=0.1)


def test_a_trace_beyond_memory_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("LAMPYRIS_MAX_MEMORY", "1")
    assert lampyris.swarm_robots(walled(), robots=10, iterations=10).iterations == 10
    with pytest.raises(LimitError, match="MEMORY"):
        lampyris.swarm_robots(walled(), robots=10, iterations=2500)


def test_a_setting_is_given_once() -> None:
    for given in ({"noise": 0.1}, SwarmSettings(noise=0.1)):
        with pytest.raises(UsageError, match=r"SETTING_CLASH.*noise is set twice"):
            lampyris.swarm_robots(walled(), robots=5, swarm_settings=given, noise=0.2)


def test_more_sources_than_cells_are_refused() -> None:
    grid = lampyris.Grid(np.zeros((3, 3), dtype=bool))
    assert len({one.at for one in lampyris.drawn_sources(grid, 9)}) == 9
    with pytest.raises(SettingError, match=r"SOURCES.*10.*at most 9"):
        lampyris.drawn_sources(grid, 10)


def test_too_few_robots_for_all_sources_are_noted() -> None:
    few = lampyris.swarm_robots(walled(), robots=8, iterations=1)
    assert any("need 9 robots; there are 8" in note for note in few.notes)
    enough = lampyris.swarm_robots(walled(), robots=9, iterations=1)
    assert not any("need" in note for note in enough.notes)


def test_a_thousand_sources_and_no_more() -> None:
    one = lampyris.InverseSquare((2.0, 2.0))
    grid = lampyris.Grid(np.zeros((9, 9), dtype=bool))
    assert lampyris.swarm_robots(grid, [one] * 1000, robots=1, iterations=1).held.shape == (2, 1000)
    with pytest.raises(SettingError, match="SOURCES"):
        lampyris.swarm_robots(grid, [one] * 1001, robots=1, iterations=1)


def test_twenty_thousand_robots_are_the_most() -> None:
    """Taken; there is no room for them on this map."""
    with pytest.raises(SettingError, match=r"allowed: at most [\d,]+ here"):
        lampyris.swarm_robots(lampyris.Grid(np.zeros((9, 9), dtype=bool)), robots=swarms.MAX_ROBOTS)


@pytest.mark.nightly
def test_ten_thousand_small_steps_are_the_most() -> None:
    """Driving 0.9999 m takes them; turning at 1,000 rad/s takes less than one."""
    grid = lampyris.Grid(np.zeros((9, 9), dtype=bool))
    given = {"robots": 1, "iterations": 1, "v_max": 1e-6, "yaw_rate_max": 1000.0, "step": 0.9999}
    for small, steps in ((1.0002e-4, 9999), (1.0001e-4, 10_000)):
        assert lampyris.swarm_robots(grid, small_step=small, **given).settings.steps == steps
    with pytest.raises(SettingError, match="small_step"):
        lampyris.swarm_robots(grid, small_step=1e-4, **given)


def test_lengths_follow_from_the_map() -> None:
    grid = lampyris.Grid(np.zeros((60, 80), dtype=bool), resolution=0.5)
    s = SwarmSettings().on(grid)
    assert (s.radius, s.step, s.sensor_range) == (0.125, 0.15, 15.0)
    assert s.beta == pytest.approx(0.4)
    assert s.capture_radius == pytest.approx(0.9)
    assert s.on(grid) == s
    assert filled(grid, radius=0.2, step=0.1).step == 0.1


def test_a_source_in_a_wall_is_noted() -> None:
    grid = halls()
    made = lampyris.swarm_robots(grid, [lampyris.InverseSquare((10.5, 3.0))], robots=3, iterations=2)
    assert "source 0" in made.notes[0]

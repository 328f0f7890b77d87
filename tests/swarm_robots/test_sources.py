"""Sources: the signal they send, where they are over time, and what is refused."""

from __future__ import annotations

import math

import numpy as np
import pytest
from swarm_maps import walled

import lampyris
from lampyris.errors import SettingError
from lampyris.model.swarm.sources import J1_HEIGHTS
from lampyris.referee.fleets.swarm_signals import signal_at
from lampyris.sim.swarm.signals import normal, signal, signal_on

PEAKS = lampyris.ThreePeaks((0.0, 0.0), 6.0, 6.0)


@pytest.mark.parametrize(
    "source",
    [
        lampyris.ThreePeaks((3.0, -2.0), 12.0, 40.0),
        lampyris.InverseSquare((1.0, 2.0), strength=3.0, core=0.5, route=[(4.0, 2.0), (4.0, 9.0)], speed=0.7),
        lampyris.Plume(
            (1.0, 2.0), strength=3.0, towards=2.0, width=0.8, spread=0.3, route=[(5.0, 5.0)], speed=0.1
        ),
    ],
)
def test_the_signal_is_that_of_its_definition(source: lampyris.Plume) -> None:
    xy = np.random.default_rng(1).normal(0.0, 5.0, (400, 2))
    for t in (0.0, 1.25, 40.0):
        made = signal((source, PEAKS), xy, t)
        assert made == pytest.approx(signal_at((source, PEAKS), xy[:, 0], xy[:, 1], t), rel=1e-12, abs=1e-14)


def test_peaks_are_where_the_function_is_highest_nearby() -> None:
    for k, (x, y) in enumerate(PEAKS.places(0.0)):
        around = np.array([[x, y], [x + 0.02, y], [x - 0.02, y], [x, y + 0.02], [x, y - 0.02]])
        value = signal((PEAKS,), around, 0.0)
        assert value.argmax() == 0
        assert value[0] == pytest.approx(J1_HEIGHTS[k], abs=1e-4)
    assert PEAKS.highest == J1_HEIGHTS[0]


def test_half_at_the_core_and_a_quarter_far_away() -> None:
    one = lampyris.InverseSquare((0.0, 0.0), strength=2.0, core=3.0)
    near, far, farther = signal((one,), np.array([[3.0, 0.0], [300.0, 0.0], [600.0, 0.0]]), 0.0)
    assert near == 1.0
    assert far / farther == pytest.approx(4.0, rel=1e-3)


def test_a_plume_carries_the_same_amount_through_every_cross_section() -> None:
    one = lampyris.Plume((0.0, 0.0), towards=math.pi / 2, width=0.5, spread=0.4)
    beside = np.linspace(-60.0, 60.0, 24_001)
    sums = [
        signal((one,), np.stack((beside, np.full_like(beside, d)), axis=-1), 0.0).sum()
        for d in (0.0, 1.0, 30.0)
    ]
    assert sums == pytest.approx([sums[0]] * 3, rel=1e-9)
    assert signal((one,), np.array([[0.0, -2.0]]), 0.0)[0] < 1e-3, "there is nothing upwind"


def test_a_source_goes_round_its_route() -> None:
    one = lampyris.InverseSquare((0.0, 0.0), route=[(3.0, 0.0), (3.0, 4.0)], speed=0.5)
    for t, place in (
        (0, (0, 0)),
        (4, (2, 0)),
        (6, (3, 0)),
        (10, (3, 2)),
        (14, (3, 4)),
        (19, (1.5, 2)),
        (24, (0, 0)),
        (28, (2, 0)),
    ):
        assert one.places(float(t))[0] == pytest.approx(place)
    still = lampyris.InverseSquare((1.0, 1.0), route=[(3.0, 0.0)])
    assert still.places(100.0) == ((1.0, 1.0),)


@pytest.mark.parametrize(
    ("kind", "given"),
    [
        (lampyris.InverseSquare, {"at": (0.0,)}),
        (lampyris.InverseSquare, {"at": (0.0, math.nan)}),
        (lampyris.InverseSquare, {"at": (0.0, 0.0), "core": 0.0}),
        (lampyris.InverseSquare, {"at": (0.0, 0.0), "route": [(1.0, 2.0, 3.0)]}),
        (lampyris.InverseSquare, {"at": (0.0, 0.0), "route": [(1.0, 2.0)] * 1001}),
        (lampyris.Plume, {"at": (0.0, 0.0), "width": -1.0}),
        (lampyris.ThreePeaks, {"centre": (0.0, 0.0), "width": "x"}),
    ],
)
def test_what_is_refused(kind: type, given: dict[str, object]) -> None:
    with pytest.raises(SettingError, match=r"SOURCE.*allowed: "):
        kind(**given)


def test_a_route_of_a_thousand_points_is_taken() -> None:
    assert len(lampyris.InverseSquare((0.0, 0.0), route=[(1.0, 2.0)] * 1000).route) == 1000


def test_noise_is_normal_and_the_same_for_a_seed() -> None:
    made = normal(np.random.Generator(np.random.PCG64(3)), 100_001)
    again = normal(np.random.Generator(np.random.PCG64(3)), 100_001)
    assert np.array_equal(made, again)
    assert abs(made.mean()) < 0.02
    assert abs(made.std() - 1.0) < 0.02
    assert abs(np.mean(np.abs(made) < 1.0) - 0.6827) < 0.01


def test_the_layer_of_a_map_begins_at_0_and_spares_walls() -> None:
    grid = walled()
    made = signal_on(grid, (lampyris.InverseSquare((3.0, 3.0)),), 0.0)
    assert np.isinf(made[grid.blocked]).all()
    assert made[~grid.blocked].min() == 0.0


def test_drawn_sources_are_apart_and_free() -> None:
    grid = walled(2)
    made = lampyris.drawn_sources(grid, 4, seed=5)
    assert made == lampyris.drawn_sources(grid, 4, seed=5)
    assert made != lampyris.drawn_sources(grid, 4, seed=6)
    places = np.array([one.at for one in made])
    for x, y in places.tolist():
        column, row = grid.to_cell(x, y)
        assert not grid.blocked[row, column]
    gaps = [math.dist(a, b) for k, a in enumerate(places.tolist()) for b in places.tolist()[:k]]
    assert min(gaps) >= 24 * 0.5 / 4 - 1e-9
    large = walled(2, side=40)
    assert len({one.at for one in lampyris.drawn_sources(large, 1000)}) == 1000
    with pytest.raises(SettingError, match="SOURCES"):
        lampyris.drawn_sources(large, 1001)

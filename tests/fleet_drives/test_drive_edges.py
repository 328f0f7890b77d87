"""Drives of fleets at their edges: times outside a trace, wide obstacles, marks in films."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import lampyris
from lampyris.errors import SettingError
from lampyris.report.film.fleet_drive_film import fleet_drive_film
from lampyris.sim.fleet.walkers import walkers


def test_the_place_at_a_time_that_is_none_is_a_typed_error() -> None:
    grid = lampyris.Grid(np.zeros((3, 6), dtype=bool))
    trace = lampyris.simulate_fleet(lampyris.Fleet(grid, [lampyris.Agent((0, 0), (5, 0))]))
    assert np.allclose(trace.at(1e6), grid.to_metres([(5, 0)]))
    for time in (math.nan, math.inf, -1.0, "3", None, [1.0, 2.0]):
        with pytest.raises(SettingError) as caught:
            trace.at(time)  # type: ignore[arg-type]
        assert (caught.value.setting, bool(caught.value.allowed)) == ("time", True)


def test_wide_obstacles_keep_their_radius_from_walls() -> None:
    blocked = np.zeros((12, 12), dtype=bool)
    blocked[5, :9] = True
    grid = lampyris.Grid(blocked, resolution=0.5)
    rng = np.random.Generator(np.random.PCG64(2))
    walls = np.argwhere(blocked)[:, ::-1]
    for radius in (0.2, 0.6, 1.0):
        for track in walkers(grid, 4, radius, 0.5, 30.0, rng):
            times = np.linspace(0.0, 30.0, 400)
            places = np.stack([np.interp(times, track.t, track.xy[:, c]) for c in range(2)], axis=1)
            away = np.maximum(np.abs(places[:, None] - walls[None]) - 0.5, 0.0)
            assert np.hypot(away[..., 0], away[..., 1]).min() * 0.5 >= radius - 1e-9
    with pytest.raises(SettingError, match="obstacle_radius"):
        walkers(grid, 1, 40.0, 0.5, 5.0, rng)


def test_films_mark_robots_that_stopped_for_good(tmp_path: Path) -> None:
    grid = lampyris.Grid(np.zeros((4, 8), dtype=bool))
    fleet = lampyris.Fleet(grid, [lampyris.Agent((0, 0), (7, 0)), lampyris.Agent((0, 3), (7, 3))])
    last = []
    for faults in ((), ((0, 2.0),)):
        trace = lampyris.simulate_fleet(fleet, faults=faults)
        fleet_drive_film(trace, tmp_path / "f.webp")
        with Image.open(tmp_path / "f.webp") as film:
            film.seek(film.n_frames - 1)
            last.append(np.asarray(film.convert("RGB"))[-22:])
    words = [(row < 128).any(axis=(0, 2)).nonzero()[0].max() for row in last]
    assert words[1] > words[0] + 50  # the key has one more entry

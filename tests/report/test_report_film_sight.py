"""Films of robots with a sensor: the line around what it sees is a circle, or a sector turned to where it looks."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import lampyris
from lampyris.report.film.drive_film import DriveRenderer
from lampyris.report.film.film_frames import TraceRenderer
from lampyris.report.film.sheet import Sheet
from lampyris.report.film.sight import SensorRange

OPEN = lampyris.Grid(np.zeros((20, 20), dtype=bool))


def drawn(degrees: float, heading: float | None) -> list[int]:
    """Directions, degrees clockwise on the picture, in which the line at the range is drawn."""
    sheet = Sheet(OPEN, (19, 19), [], 10)
    canvas = np.full((200, 200, 3), 255, dtype=np.uint8)
    SensorRange(lampyris.Sensor(6.0, math.radians(degrees)), 1.0, sheet).draw(canvas, 100.0, 100.0, heading)
    at = [
        (
            math.floor(100.0 + 60.0 * math.cos(math.radians(a))),
            math.floor(100.0 + 60.0 * math.sin(math.radians(a))),
        )
        for a in range(0, 360, 10)
    ]
    near = [canvas[y - 1 : y + 2, x - 1 : x + 2].reshape(-1, 3).min(axis=0) for x, y in at]
    return [10 * k for k, colour in enumerate(near) if colour[0] < 160]


@pytest.mark.parametrize(
    ("degrees", "heading", "seen"),
    [
        (360.0, 1.0, range(0, 360, 10)),
        (90.0, None, range(0, 360, 10)),  # it has not moved yet
        (90.0, 90.0, range(50, 140, 10)),
        (90.0, -180.0, range(140, 230, 10)),
        (300.0, 180.0, range(30, 340, 10)),
    ],
)
def test_the_line_is_where_the_sensor_sees(degrees: float, heading: float | None, seen: range) -> None:
    looks = None if heading is None else math.radians(heading)
    assert drawn(degrees, looks) == list(seen)


@pytest.fixture
def looks(monkeypatch: pytest.MonkeyPatch) -> list[float | None]:
    """The headings that the line is drawn for, in degrees."""
    told: list[float | None] = []

    def draw(self: SensorRange, canvas: Any, x: float, y: float, heading: float | None) -> None:
        told.append(None if heading is None else round(math.degrees(heading), 6) % 360.0)

    monkeypatch.setattr(SensorRange, "draw", draw)
    return told


def test_it_is_turned_to_the_last_move_or_along_the_path(looks: list[float | None]) -> None:
    scene = lampyris.Scene(OPEN, (1, 10), (1, 3))  # up the picture: 270 degrees
    trace = lampyris.simulate(scene, "dstar-lite", sensor=lampyris.Sensor(4.0, 1.0))
    stage = TraceRenderer(trace, 10)
    for moment in (0.0, 0.5, 1.0, 3.5):
        stage.frame(moment)
    drive = lampyris.drive(scene, "dstar-lite", sensor_range=4.0, field_of_view=60.0)
    film = DriveRenderer(drive, 10, 1, 16.0)
    for moment in (0.0, 0.5 * drive.period, drive.period, 3.0):
        film.frame(moment)
    assert looks == [None, None, 270.0, 270.0, None, None, 270.0, 270.0]

"""How far a robot with a sensor sees, as a line: a circle, or the sector of a field of view below a full turn."""

from __future__ import annotations

import math

import numpy as np

from lampyris.model.settings.sensor import FULL_TURN, Sensor
from lampyris.report.film import sprites
from lampyris.report.film.sheet import Sheet
from lampyris.report.style import Rgb


class SensorRange:
    """Draws the range of a robot's sensor into frames.

    Parameters
    ----------
    sensor : of the robot; None: nothing is drawn.
    resolution : metres a cell.
    sheet : that the frames are drawn on; a range of twice its width is not drawn.
    """

    def __init__(self, sensor: Sensor | None, resolution: float, sheet: Sheet) -> None:
        self._radius, self._half = 0, math.pi
        if sensor is not None:
            pixels = round(sensor.range_m / resolution * sheet.scale)
            self._radius = pixels if pixels < 2 * sheet.width else 0
            self._half = sensor.field_of_view / 2.0 if sensor.field_of_view < FULL_TURN else math.pi

    @property
    def turns(self) -> bool:
        """Whether what is drawn depends on where the robot looks."""
        return self._radius > 0 and self._half < math.pi

    def draw(self, canvas: Rgb, x: float, y: float, heading: float | None) -> None:
        """Draw the range around the robot at pixel (x, y).

        Parameters
        ----------
        heading : direction in which it looks, radians from the x axis to the y axis of the picture, which points down; None: in
            all directions.
        """
        if self._radius == 0:
            return
        if heading is None or not self.turns:
            sprites.blend(canvas, sprites.ring(self._radius, 1, sprites.ROBOT, 0.0), x, y)
            return
        far = self._radius + 2
        x0, y0 = max(math.floor(x - far), 0), max(math.floor(y - far), 0)
        x1, y1 = min(math.ceil(x + far) + 1, canvas.shape[1]), min(math.ceil(y + far) + 1, canvas.shape[0])
        if x0 >= x1 or y0 >= y1:
            return
        right = np.arange(x0, x1) + (0.5 - x)  # from the robot to each pixel
        below = (np.arange(y0, y1) + (0.5 - y))[:, None]
        away = np.hypot(right, below)
        cos, sin = math.cos(heading), math.sin(heading)
        within = right * cos + below * sin >= away * math.cos(self._half)
        least = np.where(within, np.abs(away - self._radius), np.inf)
        for side in (-self._half, self._half):
            cos, sin = math.cos(heading + side), math.sin(heading + side)
            along = np.clip(right * cos + below * sin, 0.0, self._radius)
            least = np.minimum(least, np.hypot(right - along * cos, below - along * sin))
        alpha = np.clip(1.0 - least, 0.0, 1.0)[..., None]
        under = canvas[y0:y1, x0:x1]
        colour = np.array(sprites.ROBOT, dtype=np.float64)
        canvas[y0:y1, x0:x1] = np.round(under + (colour - under) * alpha)

"""Movers and tracks: obstacles in continuous time, as sensed now and as known or recorded over time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lampyris import elementary
from lampyris.errors import SettingError
from lampyris.model.grid import frozen
from lampyris.typing import Floats, Points


@dataclass(frozen=True, slots=True, eq=False)
class Movers:
    """What is known now of the moving obstacles: discs that may go anywhere at up to their top speed.

    Parameters
    ----------
    xy : float64 (m, 2), cells: centres.
    radius : float64 (m,), metres.
    top_speed : float64 (m,), m/s: no obstacle is ever faster.
    velocity : float64 (m, 2), m/s, x to the right and y down; None: not known.
    age : seconds since they were seen.

    Raises
    ------
    SettingError : ``MOVERS``: numbers that are not finite or negative, or arrays that do not fit.
    """

    xy: Points
    radius: Floats
    top_speed: Floats
    velocity: Points | None = None
    age: float = 0.0

    def __post_init__(self) -> None:
        m = len(self.xy)
        for name, shape in (("xy", (m, 2)), ("radius", (m,)), ("top_speed", (m,)), ("velocity", (m, 2))):
            value = getattr(self, name)
            if value is None and name == "velocity":
                continue
            array = np.array(value, dtype=np.float64)
            if array.shape == (0,) and shape[0] == 0:
                array = array.reshape(shape)
            if array.shape != shape or not np.isfinite(array).all():
                raise SettingError(
                    "MOVERS", f"shape {array.shape}", where=name, allowed=f"finite numbers of shape {shape}"
                )
            if name in ("radius", "top_speed") and (array < 0).any():
                raise SettingError("MOVERS", f"{array.min()!r}", where=name, allowed="0 or more")
            object.__setattr__(self, name, frozen(array))

    def __len__(self) -> int:
        return len(self.xy)


@dataclass(frozen=True, slots=True, eq=False)
class Track:
    """Where one moving obstacle is over time: straight and uniform between the points told.

    Before the first time it is not there; after the last it stays where it is.

    Parameters
    ----------
    t : float64 (k,), seconds, strictly rising; k >= 1.
    xy : float64 (k, 2), cells.
    radius : metres.
    top_speed : m/s, at least that of every stretch.
    """

    t: Floats
    xy: Points
    radius: float
    top_speed: float

    def __post_init__(self) -> None:
        t, xy = np.array(self.t, dtype=np.float64), np.array(self.xy, dtype=np.float64)
        ok = t.ndim == 1 and len(t) >= 1 and xy.shape == (len(t), 2)
        if not (ok and np.isfinite(t).all() and np.isfinite(xy).all() and (np.diff(t) > 0).all()):
            raise SettingError(
                "TRACK",
                f"times of shape {t.shape}, points of shape {xy.shape}",
                allowed="finite times, strictly rising, with a point each",
            )
        object.__setattr__(self, "t", frozen(t))
        object.__setattr__(self, "xy", frozen(xy))

    def at(self, t: Floats) -> Points:
        """Its centre at some times, cells, (m, 2); where it appeared for times before the first."""
        t = np.atleast_1d(np.asarray(t, dtype=np.float64))
        return np.stack([elementary.interp(t, self.t, self.xy[:, k]) for k in (0, 1)], axis=-1)

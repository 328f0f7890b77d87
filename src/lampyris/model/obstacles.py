"""Obstacle states and tracks: obstacles in continuous time, as sensed now and as known or recorded over time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from lampyris._core import elementary
from lampyris._core.predicates import array_of, numbers
from lampyris._core.values import Value
from lampyris.errors import SettingError, shown
from lampyris.model.grid import frozen
from lampyris.model.robot import Polygon, footprint_of
from lampyris.typing import Floats, Points


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class ObstacleStates(Value):
    """Present states of the moving obstacles: discs that may move in any direction at up to their top speed.

    Parameters
    ----------
    xy : float64 (m, 2), cells: centres.
    radius : float64 (m,), metres.
    top_speed : float64 (m,), m/s: no obstacle is ever faster.
    velocity : float64 (m, 2), m/s, x to the right and y down; None: not known.
    age : seconds since they were seen.

    Raises
    ------
    SettingError : ``OBSTACLE_STATES``: numbers that are not finite or negative, or arrays that do not fit.

    Examples
    --------
    >>> import lampyris
    >>> import numpy as np
    >>> states = lampyris.ObstacleStates(xy=np.array([[2.0, 3.0]]), radius=[0.3], top_speed=[1.0])
    >>> states.xy.shape
    (1, 2)
    """

    xy: Points
    radius: Floats
    top_speed: Floats
    velocity: Points | None = None
    age: float = 0.0

    if TYPE_CHECKING:  # what is accepted; what is stored is declared above

        def __init__(
            self,
            xy: ArrayLike,
            radius: ArrayLike,
            top_speed: ArrayLike,
            velocity: ArrayLike | None = ...,
            age: float = ...,
        ) -> None: ...

    def __post_init__(self) -> None:
        given = array_of(self.xy)
        m = len(given) if given is not None and given.ndim else 0
        for name, shape in (("xy", (m, 2)), ("radius", (m,)), ("top_speed", (m,)), ("velocity", (m, 2))):
            value = getattr(self, name)
            if value is None and name == "velocity":
                continue
            array = numbers(value, shape)
            if array is None or not np.isfinite(array).all():
                allowed = f"finite numbers of shape {shape}"
                raise SettingError("OBSTACLE_STATES", shown(value), where=name, allowed=allowed)
            if name in ("radius", "top_speed") and (array < 0).any():
                raise SettingError(
                    "OBSTACLE_STATES", f"{shown(array.min())}", where=name, allowed="0 or more"
                )
            object.__setattr__(self, name, frozen(array))

    def __len__(self) -> int:
        return len(self.xy)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Track(Value):
    """Position of one moving obstacle over time: straight and uniform between the given points, and so is its heading.

    Before the first time it is not there; after the last it stays where it is.

    Parameters
    ----------
    t : float64 (k,), seconds, strictly rising; k >= 1.
    xy : float64 (k, 2), cells.
    radius : metres; of a polygon, of a disc around it.
    top_speed : m/s, at least that of every segment.
    outline : vertices (x ahead, y to the left) of a polygon, metres; None: a disc.
    yaw : float64 (k,), of a polygon: its heading at these times, radians counterclockwise in the frame of the cells
        (0: along the rows). Between two of them it turns by their difference, so that they need not lie within a turn.

    Raises
    ------
    SettingError : ``TRACK``: times that do not rise, or arrays that do not fit; an outline without headings.

    Examples
    --------
    >>> import lampyris
    >>> track = lampyris.Track(t=[0.0, 2.0], xy=[(0.0, 0.0), (2.0, 0.0)], radius=0.3, top_speed=1.0)
    >>> track.t.tolist()
    [0.0, 2.0]
    """

    t: Floats
    xy: Points
    radius: float
    top_speed: float
    outline: Polygon | None = None
    yaw: Floats | None = None

    if TYPE_CHECKING:  # what is accepted; what is stored is declared above

        def __init__(
            self,
            t: ArrayLike,
            xy: ArrayLike,
            radius: float,
            top_speed: float,
            outline: Sequence[Sequence[float]] | None = ...,
            yaw: ArrayLike | None = ...,
        ) -> None: ...

    def __post_init__(self) -> None:
        t = numbers(self.t, (None,))
        xy = None if t is None else numbers(self.xy, (len(t), 2))
        rises = t is not None and len(t) and bool(np.isfinite(t).all() and (t[1:] > t[:-1]).all())
        if t is None or xy is None or not (rises and np.isfinite(xy).all()):
            raise SettingError(
                "TRACK",
                f"times {shown(self.t)}, points {shown(self.xy)}",
                allowed="finite times, strictly rising, with a point each",
            )
        object.__setattr__(self, "t", frozen(t))
        object.__setattr__(self, "xy", frozen(xy))
        if self.outline is None and self.yaw is None:
            return
        yaw = numbers(self.yaw, (len(t),))
        if self.outline is None or yaw is None or not np.isfinite(yaw).all():
            allowed = "an outline with a finite heading for each time, or neither"
            raise SettingError("TRACK", f"headings {shown(self.yaw)}", allowed=allowed)
        object.__setattr__(self, "yaw", frozen(yaw))
        outline = footprint_of(self.outline, "track.outline", "TRACK")
        object.__setattr__(self, "outline", outline)

    def at(self, t: Floats) -> Points:
        """Its centre at some times, cells, (m, 2); where it appeared for times before the first."""
        t = np.atleast_1d(np.asarray(t, dtype=np.float64))
        return np.stack([elementary.interp(t, self.t, self.xy[:, k]) for k in (0, 1)], axis=-1)

    def heading(self, t: Floats) -> Floats:
        """Heading of a polygon at some times, radians counterclockwise in the frame of the cells, (m,); 0 of a disc."""
        t = np.atleast_1d(np.asarray(t, dtype=np.float64))
        return np.zeros(len(t)) if self.yaw is None else elementary.interp(t, self.t, self.yaw)

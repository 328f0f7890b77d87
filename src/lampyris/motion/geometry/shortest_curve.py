"""The shortest curves of bounded curvature between two poses: Dubins, and Reeds and Shepp."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lampyris._core.arrays import numbers_of
from lampyris._core.scalars import is_real
from lampyris.errors import SettingError, shown
from lampyris.kernels.curves.many import shortest
from lampyris.kernels.curves.sampling import sample
from lampyris.model.path import Pose
from lampyris.typing import Floats

_FARTHEST = 1e6
"""Largest coordinate, and angle, of a pose; largest turning radius."""
_MOST_POSES = 10_000_000


@dataclass(frozen=True, slots=True)
class ShortestCurve:
    """A curve of straight segments and arcs of one radius.

    Parameters
    ----------
    start, goal : poses: x, y (any unit of length) and yaw (radians, counterclockwise).
    turn_radius : radius of its arcs.
    segments : (length, turn) of each segment in the order in which they are driven: length is negative in reverse, turn is
        the change of the yaw, 0 on a straight line.
    """

    start: Pose
    goal: Pose
    turn_radius: float
    segments: tuple[tuple[float, float], ...]

    @property
    def length(self) -> float:
        """Distance driven, ahead and in reverse."""
        return math.fsum(abs(length) for length, _ in self.segments)

    @property
    def reversals(self) -> int:
        """How often it changes between driving ahead and in reverse."""
        gears = [length > 0 for length, _ in self.segments]
        return sum(a is not b for a, b in pairwise(gears))

    @property
    def word(self) -> str:
        """The segments as letters: L to the left, R to the right, S straight, each with + ahead or - in reverse."""
        found = ""
        for length, turn in self.segments:
            side = "S" if turn == 0 else "L" if (turn > 0) == (length > 0) else "R"
            found += side + ("+" if length > 0 else "-")
        return found

    def poses(self, spacing: float) -> Floats:
        """Poses along the curve, the first and the last exactly those asked for; float64 (n, 3).

        Parameters
        ----------
        spacing : maximum distance along the curve between two of them; on each segment they are evenly spaced.

        Raises
        ------
        SettingError : ``CURVE``: a spacing that is not positive, or more than 10 million poses.
        """
        least = self.length / _MOST_POSES
        if not (is_real(spacing) and spacing > 0 and spacing >= least):
            allowed = f"a number > 0 and at least {least:.3g}"
            raise SettingError.of("CURVE", "spacing", shown(spacing), where="poses", allowed=allowed)
        lengths = np.array([length for length, _ in self.segments])
        turns = np.array([turn for _, turn in self.segments])
        counts = np.maximum(np.ceil(np.abs(lengths) / spacing - 1e-9), 1).astype(np.int64)
        flat = np.zeros(3 * int(counts.sum()))
        if len(lengths):
            sample(*self.start, lengths, turns, np.zeros_like(lengths), counts, flat)
        poses = np.concatenate((np.array([self.start]), flat.reshape(-1, 3)))
        if len(poses) > 1:
            poses[-1] = self.goal
        poses[:, 2] = math.pi - np.remainder(math.pi - poses[:, 2], 2 * math.pi)
        return poses


def dubins(start: ArrayLike, goal: ArrayLike, turn_radius: float) -> ShortestCurve:
    """The shortest curve that a car which only drives ahead can follow from one pose to another.

    Parameters
    ----------
    start, goal : x, y (any unit of length) and yaw (radians, counterclockwise).
    turn_radius : least radius of a bend, > 0.

    Returns
    -------
    Three segments at most: an arc, a straight line or an arc of more than half a turn, an arc.

    Raises
    ------
    SettingError : ``ARRAY``, ``CURVE``: what is no pose, a radius that is not positive, numbers beyond 1e6.

    Source: Dubins 1957; Shkel and Lumelsky 2001.

    Examples
    --------
    >>> from lampyris import curves
    >>> curve = curves.dubins((0, 0, 0), (4, 0, 3.141592653589793), turn_radius=1.0)
    >>> curve.word, round(curve.length, 6)
    ('R+S+L+', 7.613012)
    """
    return _curve("dubins", start, goal, turn_radius, False)


def reeds_shepp(start: ArrayLike, goal: ArrayLike, turn_radius: float) -> ShortestCurve:
    """The shortest curve that a car which drives ahead and in reverse can follow from one pose to another.

    Parameters
    ----------
    start, goal : x, y (any unit of length) and yaw (radians, counterclockwise).
    turn_radius : least radius of a bend, > 0.

    Returns
    -------
    The shortest of the 48 words of Reeds and Shepp: five segments at most.

    Raises
    ------
    SettingError : ``ARRAY``, ``CURVE``: what is no pose, a radius that is not positive, numbers beyond 1e6.

    Source: Reeds and Shepp 1990.

    Examples
    --------
    >>> from lampyris import curves
    >>> curve = curves.reeds_shepp((0, 0, 0), (0, 1, 0), turn_radius=1.0)
    >>> curve.word, curve.reversals
    ('R-L+R-', 2)
    """
    return _curve("reeds_shepp", start, goal, turn_radius, True)


def dubins_lengths(starts: ArrayLike, goals: ArrayLike, turn_radius: float) -> Floats:
    """Lengths of the shortest Dubins curves between many pairs of poses; float64 (n,).

    Parameters
    ----------
    starts, goals : (n, 3): x, y, yaw of each.
    turn_radius : least radius of a bend, > 0.

    Raises
    ------
    SettingError : as of :func:`dubins`; or the shapes differ.
    """
    return _lengths("dubins_lengths", starts, goals, turn_radius, False)


def reeds_shepp_lengths(starts: ArrayLike, goals: ArrayLike, turn_radius: float) -> Floats:
    """Lengths of the shortest Reeds-Shepp curves between many pairs of poses; float64 (n,).

    Parameters
    ----------
    starts, goals : (n, 3): x, y, yaw of each.
    turn_radius : least radius of a bend, > 0.

    Raises
    ------
    SettingError : as of :func:`reeds_shepp`; or the shapes differ.
    """
    return _lengths("reeds_shepp_lengths", starts, goals, turn_radius, True)


def _radius(function: str, value: float) -> float:
    if not (is_real(value) and 0 < value <= _FARTHEST):
        allowed = "a number > 0, at most 1e6"
        raise SettingError.of("CURVE", "turn_radius", shown(value), where=function, allowed=allowed)
    return float(value)


def _poses(function: str, name: str, value: object, shape: tuple[int | None, ...]) -> Floats:
    poses = numbers_of(function, name, value, shape)
    if (np.abs(poses) > _FARTHEST).any():
        raise SettingError("CURVE", shown(value), where=f"{function}.{name}", allowed="numbers within 1e6")
    return poses


def _curve(function: str, start: ArrayLike, goal: ArrayLike, radius: float, reverse: bool) -> ShortestCurve:
    radius = _radius(function, radius)
    a, b = (_poses(function, name, one, (3,)) for name, one in (("start", start), ("goal", goal)))
    lengths, kinds = np.zeros(5), np.zeros(5, dtype=np.int64)
    shortest(a, b, radius, reverse, np.zeros(1), lengths, kinds)
    segments = tuple(
        (length * radius, length * kind)
        for length, kind in zip(lengths.tolist(), kinds.tolist(), strict=True)
        if length != 0.0
    )
    ends = [(float(x), float(y), float(yaw)) for x, y, yaw in (a, b)]
    return ShortestCurve(ends[0], ends[1], radius, segments)


def _lengths(
    function: str, starts: ArrayLike, goals: ArrayLike, radius: float, reverse: bool
) -> NDArray[np.float64]:
    radius = _radius(function, radius)
    a = _poses(function, "starts", starts, (None, 3))
    b = _poses(function, "goals", goals, (len(a), 3))
    found = np.zeros(len(a))
    shortest(a.ravel(), b.ravel(), radius, reverse, found, np.zeros(5), np.zeros(5, dtype=np.int64))
    return found * radius

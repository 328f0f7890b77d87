"""The minimum of the caps, taken once, then made feasible by two passes; each node with its cause.

Both laws are one scheme in a different quantity x: the dissertation's is linear in the speed itself (x = v,
so much more or less a transfer), all others in its square (x = v^2, because a constant acceleration changes
v^2 by 2 a ds). In either, ``x[i+1] <= x[i] + up[i]`` and ``x[i] <= x[i+1] + down[i]``: two passes
(:func:`lampyris.kernels.speed.sweep`) reach the greatest x that satisfies both and the caps. Equations,
errors and measurements: docs/speed/profile.md.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from lampyris.errors import SettingError
from lampyris.kernels.speed import ACCELERATION, BRAKING, brake_floor, clock, sweep
from lampyris.motion.cap import Cap
from lampyris.typing import Floats

OnInfeasible: TypeAlias = Literal["raise", "brake"]

CapLike: TypeAlias = Cap | tuple[str, Floats]
"""A cap, or its cause and speeds alone."""

_ROUNDING = 1e-12
"""Share of v0^2 that rounding may eat before a start speed counts as too fast."""

_SMALL, _LARGE = 1e-100, 1e100
"""Speeds, accelerations and edges outside these (and not 0) are refused: their squares would overflow."""

_KEEPS = ("start", "limit")
"""Causes that keep their node when the forward pass reaches the very same value."""

_NAMES = ("acceleration", "braking", "start", "goal", "turn")
"""Words of the first cause numbers; those of the caps follow."""

_START, _GOAL, _TURN = 2, 3, 4
assert (_NAMES[ACCELERATION], _NAMES[BRAKING]) == _NAMES[:2]


class Feasible(NamedTuple):
    """Speeds, accelerations, times and causes, one a node; units are those of what was given.

    ``about`` is what each cause speaks of, int64 (n,): for braking the node braked for, for a cap what the
    cap says, -1: nothing.
    """

    v: Floats
    a: Floats
    t: Floats
    cause: tuple[str, ...]
    about: NDArray[np.int64]


class Lowest(NamedTuple):
    """The least cap at each node.

    Parameters
    ----------
    v : float64 (n,).
    cause : int64 (n,), places in ``names``.
    about : int64 (n,); -1: nothing.
    names : words of the causes, ``acceleration`` and ``braking`` first.
    """

    v: Floats
    cause: NDArray[np.int64]
    about: NDArray[np.int64]
    names: tuple[str, ...]

    @property
    def words(self) -> tuple[str, ...]:
        """The cause of each node as a word."""
        return tuple(np.array(self.names, dtype=object)[self.cause].tolist())

    @property
    def keeps(self) -> NDArray[np.bool_]:
        """Where the cause keeps a tie with acceleration: ``start`` and ``limit``; bool (n,)."""
        out = np.zeros(len(self.cause), dtype=np.bool_)
        for code, name in enumerate(self.names):
            if name in _KEEPS:
                out |= self.cause == code
        return out


def start_speed(v0: float) -> float:
    """A start speed, checked.

    Raises
    ------
    SettingError : ``START_SPEED``: negative, not finite, or not a number.
    """
    real = isinstance(v0, int | float | np.floating | np.integer) and not isinstance(v0, bool)
    if not (real and (v0 == 0 or _SMALL <= v0 <= _LARGE)):
        raise SettingError("START_SPEED", f"{v0!r}", where="v0", allowed=f"0, or {_SMALL:g} to {_LARGE:g}")
    return float(v0)


def only(count: int, node: int, value: float) -> Floats:
    """A cap that binds one node alone: infinity elsewhere; shape (count,)."""
    out = np.full(count, np.inf)
    out[node] = value
    return out


def lowest(caps: Sequence[CapLike]) -> Lowest:
    """The least cap at each node and its cause; the first named wins a tie.

    Parameters
    ----------
    caps : in the order in which ties are decided, at least one; infinity where a cap says nothing.
    """
    table = np.array([cap[1] for cap in caps], dtype=np.float64)
    row = table.argmin(axis=0)
    nodes = np.arange(table.shape[1])
    about = np.full(len(row), -1, dtype=np.int64)
    for k, cap in enumerate(caps):
        if len(cap) > 2 and cap[2] is not None:
            about = np.where(row == k, cap[2], about)
    names = (*_NAMES, *(cap[0] for cap in caps))
    return Lowest(table[row, nodes], row + len(_NAMES), about, names)


def feasible_profile(
    s: Floats,
    caps: Sequence[CapLike],
    *,
    a_max: float,
    d_max: float,
    v0: float = 0.0,
    on_infeasible: OnInfeasible = "raise",
    stop: NDArray[np.bool_] | None = None,
    jerk_max: float | None = None,
) -> Feasible:
    """The fastest speeds under the caps, with bounded acceleration and braking, standing still at the end.

    Parameters
    ----------
    s : metres along the path, strictly rising; shape (n,), n >= 1.
    caps : :class:`lampyris.motion.cap.Cap` or (cause, m/s) pairs, at least one; without ``start``, ``goal``
        and ``turn``, which are added here. In the order of ties. 0 is allowed at the two ends only, where
        the robot may stand, and at stops.
    a_max, d_max : m/s2, > 0.
    v0 : m/s at the first node, >= 0.
    on_infeasible : what to do with a v0 too fast for the caps or the way that is left. ``raise`` refuses.
        ``brake`` is for a robot that already drives when an obstacle turns up: it brakes with d_max from
        the first node on and exceeds a cap for as long as that takes (cause ``braking``); if even so it
        cannot stand at the last node, the speed left there is told, not hidden. A feasible v0 gives the
        same profile either way.
    stop : bool (n,): where the robot stands still to turn on the spot, cause ``turn``; None: nowhere.
    jerk_max : m/s3, the greatest change of acceleration, see :mod:`lampyris.motion.jerk`; None: no limit.
        Of no effect where ``brake`` has to break a cap.

    Returns
    -------
    v with v[0] = v0 and v[n-1] = 0; a[i] = (v[i+1]^2 - v[i]^2) / (2 ds), the constant acceleration on the
    way to node i + 1, and 0 at the last; t with t[0] = 0 and t[i+1] = t[i] + 2 ds / (v[i] + v[i+1]), exact
    for it. Speed is monotone between nodes, so a limit that holds at two neighbours holds between them.

    Rounding: ``v[i+1]^2 <= v[i]^2 + 2 a_max ds``, its twin for braking, and the caps hold to 1e-12 of the
    greater v^2. A v0 beyond the limit by no more than that (5e-13 of it) is taken as the limit; what
    ``allowed`` of the refusal prints is itself accepted. t strictly rises, see
    :func:`lampyris.kernels.speed.clock`.

    One kind of edge cannot be driven so: still at both ends, which are a path of two nodes with v0 = 0, and
    neighbouring stops. It is driven as :func:`stop_to_stop` under the lesser cap of its two nodes; there a
    is 0, the mean over the edge.

    Raises
    ------
    SettingError : ``PROFILE_INFEASIBLE`` with the distance that v0 needs and the distance there is, and the
        greatest start speed; ``PROFILE_BLOCKED``: a cap of 0 on the way; ``START_SPEED``,
        ``PROFILE_SPACING``, ``PROFILE_LIMIT``.
    """
    v0 = start_speed(v0)
    s = np.asarray(s, dtype=np.float64)
    n = len(s)
    ds = _edges(s)
    halt = np.zeros(n, dtype=np.bool_) if stop is None else np.asarray(stop, dtype=np.bool_)
    low = _checked(s, caps, halt, a_max, d_max)
    x = low.v * low.v
    cause, about = low.cause.copy(), low.about.copy()
    for where, code in ((halt, _TURN), (-1, _GOAL), (0, _START)):
        cause[where], about[where] = code, -1
    x[halt] = x[-1] = 0.0
    x[0] = min(x[0], v0 * v0)
    up, down = 2.0 * a_max * ds, 2.0 * d_max * ds
    bound = low._replace(cause=cause)
    if on_infeasible == "brake":
        brake_floor(x, down, v0 * v0, cause)
    sweep(x, up, down, bound.keeps, cause, about)
    if on_infeasible == "raise" and x[0] < v0 * v0 * (1.0 - _ROUNDING):
        raise _infeasible(s, low, halt, down, d_max, v0)
    x[0], cause[0], about[0] = v0 * v0, _START, -1
    v = np.sqrt(x)
    v[0] = v0
    a, t = np.zeros(n), np.zeros(n)
    # Where an edge is short for its speed, the difference of squares is mostly rounding.
    np.clip((x[1:] - x[:-1]) / (2.0 * ds), -d_max, a_max, out=a[:-1])
    clock(_durations(ds, v, low.v, a_max, d_max), t)
    return Feasible(v, a, t, bound.words, about)


def stop_to_stop(ds: float, a_max: float, d_max: float, cap: float) -> tuple[float, float]:
    """Peak speed (m/s) and time (s) from rest to rest over ``ds`` metres: full throttle, cruise, full brake.

    The peak is ``min(cap, sqrt(2 a d ds / (a + d)))``; where the cap does not bind there is no cruise, and
    v^2 over s is a triangle.
    """
    slope = 1.0 / a_max + 1.0 / d_max
    peak = min(cap, math.sqrt(2.0 * ds / slope))
    cruise = max(0.0, ds - 0.5 * peak * peak * slope)
    return peak, peak * slope + cruise / peak


def _edges(s: Floats) -> Floats:
    """Length of each edge, checked."""
    ds = s[1:] - s[:-1]
    if s.ndim != 1 or len(s) == 0 or not ((ds >= _SMALL) & (ds <= _LARGE)).all():
        raise SettingError(
            "PROFILE_SPACING",
            "nodes at equal or falling distance",
            where="path",
            allowed=f"at least one node, distances strictly rising, by {_SMALL:g} to {_LARGE:g}",
        )
    return ds


def _checked(
    s: Floats, caps: Sequence[CapLike], halt: NDArray[np.bool_], a_max: float, d_max: float
) -> Lowest:
    """The least cap at each node; nothing that cannot be driven."""
    for name, values in (*((cap[0], cap[1]) for cap in caps), ("stop", halt)):
        if np.shape(values) != s.shape:
            raise SettingError(
                "PROFILE_LIMIT", f"{np.shape(values)} values", where=name, allowed=f"one a node: {len(s)}"
            )
    low = lowest(caps)
    for name, value in (("a_max", a_max), ("d_max", d_max)):
        if not _SMALL <= value <= _LARGE:
            raise SettingError("PROFILE_LIMIT", f"{value!r}", where=name, allowed=f"{_SMALL:g} to {_LARGE:g}")
    bad = ~((low.v >= _SMALL) | (low.v == 0.0))
    if bad.any():
        k = int(bad.argmax())
        raise SettingError(
            "PROFILE_LIMIT",
            f"{float(low.v[k])!r} m/s at node {k}",
            where=low.names[low.cause[k]],
            allowed=f"0, or at least {_SMALL:g}",
        )
    shut = (low.v == 0.0) & ~halt
    shut[[0, -1]] = False
    if len(s) == 2 and not low.v.any():
        shut[1] = True
    if shut.any():
        k = int(shut.argmax())
        raise SettingError(
            "PROFILE_BLOCKED",
            f"the robot may not drive at node {k}, {float(s[k] - s[0]):.6g} m from the start: "
            f"0 m/s for the cause {_told(low, k)}",
            where="path",
            allowed="a speed above 0 everywhere but at the ends and where the robot stops to turn",
            todo="plan another way, or wait",
        )
    return low


def _told(low: Lowest, k: int) -> str:
    """Cause and about of node k in words."""
    word, of = low.names[low.cause[k]], int(low.about[k])
    return word if of < 0 else f"{word} {of}"


def _durations(ds: Floats, v: Floats, cap: Floats, a_max: float, d_max: float) -> Floats:
    """Seconds on each edge: exact for its constant acceleration, or from rest to rest."""
    pace = v[:-1] + v[1:]
    rest = pace == 0.0
    if not rest.any():
        out: Floats = 2.0 * ds / pace
        return out
    dt = 2.0 * ds / np.where(rest, 1.0, pace)
    for k in np.flatnonzero(rest).tolist():
        length, low, high = float(ds[k]), *sorted((float(cap[k]), float(cap[k + 1])))
        a, d = a_max, d_max
        if low == 0.0:
            # The caps' squares are taken as straight lines between nodes: from 0, they bound a ramp.
            ramp = high * high / (2.0 * length)
            low = high
            if cap[k] == 0.0:
                a = min(a, ramp)
            else:
                d = min(d, ramp)
        dt[k] = stop_to_stop(length, a, d, low)[1]
    return dt


def _infeasible(
    s: Floats, low: Lowest, halt: NDArray[np.bool_], down: Floats, d_max: float, v0: float
) -> SettingError:
    """The refusal, told by the node that asks for the slowest start."""
    cap = np.where(halt, 0.0, low.v)
    cap[-1] = 0.0
    x = (cap * cap).tolist()
    # The very sums of the backward pass, so that the speed named is one that it lets through.
    k = len(x) - 1
    start = x[k]
    for i, fall in zip(range(len(x) - 2, -1, -1), reversed(down.tolist()), strict=True):
        start += fall
        if x[i] <= start:
            k, start = i, x[i]
    why = "goal" if k == len(x) - 1 else "turn" if halt[k] else _told(low, k)
    needed = (v0 * v0 - x[k]) / (2.0 * d_max)
    greatest = math.sqrt(start) if start >= _SMALL * _SMALL else 0.0
    return SettingError(
        "PROFILE_INFEASIBLE",
        f"{v0:g} m/s at the start is too fast for {float(cap[k]):g} m/s at node {k} ({why}): "
        f"braking needs {needed:.6g} m and {float(s[k] - s[0]):.6g} m are there",
        where="v0",
        allowed=f"at most {greatest!r} m/s",
        todo="start slower, or brake harder",
    )

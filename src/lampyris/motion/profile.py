"""The minimum of the caps, taken once, then made feasible by two passes; each node with its cause.

Both laws are one scheme in a different quantity x: the dissertation's is linear in the speed itself (x = v,
so much more or less a transfer), all others in its square (x = v^2, because a constant acceleration changes
v^2 by 2 a ds). In either, ``x[i+1] <= x[i] + up[i]`` and ``x[i] <= x[i+1] + down[i]``: two passes
(:func:`lampyris.kernels.motion.speed_passes.sweep`) reach the greatest x that satisfies both and the caps. Equations,
errors and measurements: docs/speed/profile.md.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal, NamedTuple, TypeAlias, get_args

import numpy as np
from numpy.typing import NDArray

from lampyris._core.scalars import in_range, is_real
from lampyris.errors import SettingError, UsageError, shown
from lampyris.kernels.motion.speed_passes import ACCELERATION, BRAKING, brake_floor, clock, sweep
from lampyris.motion.jerk import limited, rest_to_rest
from lampyris.motion.lowest import GOAL, JERK, START, TURN, CapLike, Lowest
from lampyris.motion.lowest import lowest as lowest
from lampyris.typing import Floats

OnInfeasible: TypeAlias = Literal["raise", "brake"]

_ROUNDING = 1e-12
"""Share of v0^2 that rounding may eat before a start speed counts as too fast."""

_BINDS = 1e-4
"""Share of a limit within which it binds a profile with a limit on jerk, whose method stays inside it."""

_SMALL, _LARGE = 1e-100, 1e100
"""Speeds, accelerations and edges outside these (and not 0) are refused: their squares would overflow."""


class Feasible(NamedTuple):
    """Speeds, accelerations, times and causes, one a node; units are those of what was given.

    ``cause_index`` is what each cause speaks of, int64 (n,): for braking the node braked for, for a cap what the
    cap says, -1: nothing.
    """

    v: Floats
    a: Floats
    t: Floats
    cause: tuple[str, ...]
    cause_index: NDArray[np.int64]


def start_speed(v0: float) -> float:
    """A start speed, checked.

    Raises
    ------
    SettingError : ``START_SPEED``: negative, not finite, or not a number.
    """
    if not (is_real(v0) and (v0 == 0 or in_range(v0, _SMALL, _LARGE))):
        raise SettingError(
            "START_SPEED", f"{shown(v0)}", where="v0", allowed=f"0, or {_SMALL:g} to {_LARGE:g}"
        )
    return float(v0)


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
    caps : :class:`lampyris.motion.cap_values.Cap` or (cause, m/s) pairs; without ``start``, ``goal`` and ``turn``,
        which are added here. In the order of ties; none: a_max and d_max alone. 0 is allowed at the two ends
        only, where the robot may stand, and at stops, and not at both nodes of an edge.
    a_max, d_max : m/s2, > 0.
    v0 : m/s at the first node, >= 0.
    on_infeasible : what to do with a v0 too fast for the caps or the rest of the path. ``raise`` refuses.
        ``brake`` is for a robot that already drives when an obstacle turns up: it brakes with d_max from
        the first node on and exceeds a cap for as long as that takes (cause ``braking``); if even so it
        cannot stand at the last node, the speed left there is reported, not hidden. A feasible v0 gives the
        same profile either way.
    stop : bool (n,): where the robot stands still to turn in place, cause ``turn``; None: nowhere.
    jerk_max : m/s3, the greatest change of acceleration, see :mod:`lampyris.motion.jerk`; None: no limit.
        Of no effect where ``brake`` has to break a cap.

    Returns
    -------
    v with v[0] = v0 and v[n-1] = 0; a[i] = (v[i+1]^2 - v[i]^2) / (2 ds), the constant acceleration on the
    path to node i + 1, and 0 at the last; t with t[0] = 0 and t[i+1] = t[i] + 2 ds / (v[i] + v[i+1]), exact
    for it. Speed is monotone between nodes, so a limit that holds at two neighbours holds between them.

    Rounding: ``v[i+1]^2 <= v[i]^2 + 2 a_max ds``, its mirror image for braking, and the caps hold to 1e-12 of the
    greater v^2. A v0 beyond the limit by no more than that (5e-13 of it) is taken as the limit; what
    ``allowed`` of the refusal prints is itself accepted. t strictly rises, see
    :func:`lampyris.kernels.motion.speed_passes.clock`.

    One kind of edge cannot be driven so: still at both ends, which are a path of two nodes with v0 = 0, and
    neighbouring stops. It is driven as :func:`stop_to_stop` under the lesser cap of its two nodes; there a
    is 0, the mean over the edge.

    Raises
    ------
    SettingError : ``PROFILE_INFEASIBLE`` with the distance that v0 needs and the distance there is, and the
        greatest start speed; ``PROFILE_BLOCKED``: a cap of 0 on the way, or at both nodes of an edge;
        ``START_SPEED``, ``PROFILE_SPACING``, ``PROFILE_LIMIT``.
    UsageError : ``ON_INFEASIBLE``: neither of the two words.
    """
    if on_infeasible not in get_args(OnInfeasible):
        raise UsageError(
            "ON_INFEASIBLE", shown(on_infeasible), where="on_infeasible", allowed="raise or brake"
        )
    v0 = start_speed(v0)
    s = np.asarray(s, dtype=np.float64)
    ds = _edges(s)
    halt = np.zeros(len(s), dtype=np.bool_) if stop is None else np.asarray(stop, dtype=np.bool_)
    path = _CappedPath(s, ds, halt, _checked(s, caps, halt, a_max, d_max), a_max, d_max)
    swept = _swept(path, v0)
    feasible = bool(swept.v[0] >= v0 * v0 * (1.0 - _ROUNDING))
    if not feasible:
        if on_infeasible == "raise":
            raise _infeasible(path, v0)
        swept = _swept(path, v0, hard=True)
    x, cause, cause_index = swept.v, swept.cause, swept.cause_index
    x[0], cause[0], cause_index[0] = v0 * v0, START, -1
    if jerk_max is not None and feasible:
        smooth = limited(ds, x, a_max=a_max, d_max=d_max, jerk_max=_limit("jerk_max", jerk_max))
        if smooth is not None:
            _name_again(path, x, smooth, cause, cause_index)
            x = smooth
        elif on_infeasible == "raise":
            raise _too_jerky(path, v0, jerk_max)
    v = np.sqrt(x)
    v[0] = v0
    a, t = np.zeros(len(s)), np.zeros(len(s))
    # Where an edge is short for its speed, the difference of squares is mostly rounding.
    np.clip((x[1:] - x[:-1]) / (2.0 * ds), -d_max, a_max, out=a[:-1])
    clock(_durations(path, v, jerk_max), t)
    return Feasible(v, a, t, swept.words, cause_index)


class _CappedPath(NamedTuple):
    """Where and how fast the robot may drive."""

    s: Floats
    ds: Floats
    halt: NDArray[np.bool_]
    low: Lowest
    a_max: float
    d_max: float


def _swept(path: _CappedPath, v0: float, *, hard: bool = False) -> Lowest:
    """Greatest squares of speed, their causes and what those speak of; x[0] below v0^2 if v0 is too fast.

    ``hard`` raises them to what full braking from v0 cannot avoid.
    """
    x = path.low.v * path.low.v
    cause, cause_index = path.low.cause.copy(), path.low.cause_index.copy()
    for where, code in ((path.halt, TURN), (-1, GOAL), (0, START)):
        cause[where], cause_index[where] = code, -1
    x[path.halt] = x[-1] = 0.0
    x[0] = min(x[0], v0 * v0)
    out = Lowest(x, cause, cause_index, path.low.names)
    keeps, down = out.keeps, 2.0 * path.d_max * path.ds
    if hard:
        brake_floor(x, down, v0 * v0, cause)
    sweep(x, 2.0 * path.a_max * path.ds, down, keeps, cause, cause_index)
    return out


def _name_again(
    path: _CappedPath, fastest: Floats, x: Floats, cause: NDArray[np.int64], cause_index: NDArray[np.int64]
) -> None:
    """Causes of a profile with a limit on jerk: what bound the one without, where it is as fast, or jerk."""
    a = (x[1:] - x[:-1]) / (2.0 * path.ds)
    free = x < fastest * (1.0 - _BINDS)
    cause[free], cause_index[free] = JERK, -1
    cause[1:][free[1:] & (a >= path.a_max * (1.0 - _BINDS))] = ACCELERATION
    cause[:-1][free[:-1] & (a <= -path.d_max * (1.0 - _BINDS))] = BRAKING
    k = len(x) - 1
    for i in range(len(x) - 2, -1, -1):
        if cause[i] == BRAKING:
            cause_index[i] = k
        else:
            k = i


def stop_to_stop(ds: float, a_max: float, d_max: float, cap: float) -> tuple[float, float]:
    """Peak speed (m/s) and time (s) from rest to rest over ``ds`` metres: full throttle, cruise, full brake.

    The peak is ``min(cap, sqrt(2 a d ds / (a + d)))``; where the cap does not bind there is no cruise, and
    v^2 over s is a triangle.
    """
    slope = 1.0 / a_max + 1.0 / d_max
    peak = min(cap, math.sqrt(2.0 * ds / slope))
    cruise = max(0.0, ds - 0.5 * peak * peak * slope)
    return peak, peak * slope + cruise / peak


def _limit(name: str, value: float) -> float:
    """A limit, checked."""
    if not in_range(value, _SMALL, _LARGE):
        raise SettingError("PROFILE_LIMIT", shown(value), where=name, allowed=f"{_SMALL:g} to {_LARGE:g}")
    return value


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
    low = lowest(caps or [("limit", np.full(len(s), np.inf))])
    _limit("a_max", a_max)
    _limit("d_max", d_max)
    bad = ~((low.v >= _SMALL) | (low.v == 0.0))
    if bad.any():
        k = int(bad.argmax())
        raise SettingError(
            "PROFILE_LIMIT",
            f"{shown(float(low.v[k]))} m/s at node {k}",
            where=low.names[low.cause[k]],
            allowed=f"0, or at least {_SMALL:g}",
        )
    shut = (low.v == 0.0) & ~halt
    shut[[0, -1]] = False
    # Nothing can be driven between two nodes where nothing may move, though it may stand at either.
    shut[1:] |= (low.v[1:] == 0.0) & (low.v[:-1] == 0.0)
    if shut.any():
        k = int(shut.argmax())
        raise SettingError(
            "PROFILE_BLOCKED",
            f"the robot may not drive at node {k}, {float(s[k] - s[0]):.6g} m from the start: "
            f"0 m/s for the cause {_cause_name(low, k)}",
            where="path",
            allowed="a speed above 0 everywhere but at the ends and where the robot stops to turn, "
            "and at one node of each edge",
            todo="plan another path, or wait",
        )
    return low


def _cause_name(low: Lowest, k: int) -> str:
    """Cause and cause_index of node k in words."""
    word, of = low.names[low.cause[k]], int(low.cause_index[k])
    return word if of < 0 else f"{word} {of}"


def _durations(path: _CappedPath, v: Floats, jerk_max: float | None) -> Floats:
    """Seconds on each edge: exact for its constant acceleration, or from rest to rest."""
    ds, cap = path.ds, path.low.v
    pace = v[:-1] + v[1:]
    rest = pace == 0.0
    if not rest.any():
        out: Floats = 2.0 * ds / pace
        return out
    dt = 2.0 * ds / np.where(rest, 1.0, pace)
    for k in np.flatnonzero(rest).tolist():
        length, low, high = float(ds[k]), *sorted((float(cap[k]), float(cap[k + 1])))
        a, d = path.a_max, path.d_max
        if low == 0.0:
            # The caps' squares are taken as straight lines between nodes: from 0, they bound a ramp.
            ramp = high * high / (2.0 * length)
            low = high
            if cap[k] == 0.0:
                a = min(a, ramp)
            else:
                d = min(d, ramp)
        dt[k] = stop_to_stop(length, a, d, low)[1]
        if jerk_max is not None:
            dt[k] = max(dt[k], rest_to_rest(length, min(a, d), jerk_max, low))
    return dt


def _infeasible(path: _CappedPath, v0: float) -> SettingError:
    """The error, with the node that requires the slowest start."""
    s, low, d_max = path.s, path.low, path.d_max
    cap = np.where(path.halt, 0.0, low.v)
    cap[-1] = 0.0
    x = (cap * cap).tolist()
    # The very sums of the backward pass, so that the speed named is one that it lets through.
    k = len(x) - 1
    start = x[k]
    for i, fall in zip(range(len(x) - 2, -1, -1), reversed((2.0 * d_max * path.ds).tolist()), strict=True):
        start += fall
        if x[i] <= start:
            k, start = i, x[i]
    why = "goal" if k == len(x) - 1 else "turn" if path.halt[k] else _cause_name(low, k)
    needed = (v0 * v0 - x[k]) / (2.0 * d_max)
    greatest = math.sqrt(start) if start >= _SMALL * _SMALL else 0.0
    return SettingError(
        "PROFILE_INFEASIBLE",
        f"{v0:g} m/s at the start is too fast for {float(cap[k]):g} m/s at node {k} ({why}): "
        f"braking needs {needed:.6g} m and {float(s[k] - s[0]):.6g} m are there",
        where="v0",
        allowed=f"at most {shown(greatest)} m/s",
        todo="start slower, or brake harder",
    )


def _too_jerky(path: _CappedPath, v0: float, jerk_max: float) -> SettingError:
    """The refusal of a start speed from which no profile was found that keeps the limit on jerk."""
    known = 0.0
    for k in range(1, 13):
        more = known + math.ldexp(v0, -k)
        x = _swept(path, more).v
        x[0] = more * more
        limits = {"a_max": path.a_max, "d_max": path.d_max, "jerk_max": jerk_max}
        if limited(path.ds, x, **limits, any_will_do=True) is not None:
            known = more
    return SettingError(
        "PROFILE_INFEASIBLE",
        f"no profile was found from {v0:g} m/s at the start that changes its acceleration by at most "
        f"{jerk_max:g} m/s3",
        where="v0",
        allowed=f"at most {shown(known)} m/s",
        todo="start slower, or allow more jerk",
    )

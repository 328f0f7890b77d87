"""The minimum of the caps, taken once, then made feasible by two passes; each node with its cause.

Both laws are one scheme in a different quantity x: the dissertation's is linear in the speed itself (x = v,
so much more or less a transfer), the physical one in its square (x = v^2, because a constant acceleration
changes v^2 by 2 a ds). In either, ``x[i+1] <= x[i] + up[i]`` and ``x[i] <= x[i+1] + down[i]``: two passes
reach the greatest x that satisfies both and the caps.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal, NamedTuple, TypeAlias

import numpy as np

from lampyris.errors import SettingError
from lampyris.typing import Floats

OnInfeasible: TypeAlias = Literal["raise", "brake"]

_ROUNDING = 1e-12
"""Share of v0^2 that rounding may eat before a start speed counts as too fast."""

_SMALL, _LARGE = 1e-100, 1e100
"""Speeds and accelerations outside these (and not 0) are refused: their squares would overflow."""

_BEFORE_ACCELERATION = frozenset(("start", "limit"))
"""Causes that keep their node when the forward pass reaches the very same value."""


class Feasible(NamedTuple):
    """Speeds, accelerations, times and causes, one a node; units are those of what was given."""

    v: Floats
    a: Floats
    t: Floats
    cause: tuple[str, ...]


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


def lowest(caps: Sequence[tuple[str, Floats]]) -> tuple[list[float], list[str]]:
    """The least cap at each node and its name; the first named wins a tie.

    Parameters
    ----------
    caps : (cause, speeds of shape (n,)) in the order in which ties are decided; infinity where a cap says
        nothing.
    """
    names = [name for name, _ in caps]
    table = np.array([values for _, values in caps], dtype=np.float64)
    row = table.argmin(axis=0)
    return table[row, np.arange(table.shape[1])].tolist(), [names[k] for k in row.tolist()]


def sweep(x: list[float], up: Sequence[float], down: Sequence[float], cause: list[str]) -> None:
    """Lower ``x`` in place until it neither rises nor falls faster than it may, and note why.

    Parameters
    ----------
    x : a monotone function of speed at each node, (n,): v or v^2.
    up, down : the most x may rise, or fall, on the way from node i to i + 1; shape (n - 1,), > 0.
    cause : names, (n,); becomes ``acceleration`` or ``braking`` where a pass binds. ``start`` and ``limit``
        keep a tie with acceleration, everything keeps a tie with braking.
    """
    at = x[0]
    for i, rise in enumerate(up, 1):
        reach = at + rise
        at = x[i]
        if reach < at or (reach == at and cause[i] not in _BEFORE_ACCELERATION):
            x[i] = at = reach
            cause[i] = "acceleration"
    at = x[-1]
    for i in range(len(x) - 2, -1, -1):
        reach = at + down[i]
        at = x[i]
        if reach < at:
            x[i] = at = reach
            cause[i] = "braking"


def feasible_profile(
    s: Floats,
    caps: Sequence[tuple[str, Floats]],
    *,
    a_max: float,
    d_max: float,
    v0: float = 0.0,
    on_infeasible: OnInfeasible = "raise",
) -> Feasible:
    """The fastest speeds under the caps, with bounded acceleration and braking, standing still at the end.

    Parameters
    ----------
    s : metres along the path, strictly rising; shape (n,), n >= 1.
    caps : (cause, m/s) pairs, > 0; without ``start`` and ``goal``, which are added here. In the order of
        ties.
    a_max, d_max : m/s2, > 0.
    v0 : m/s at the first node, >= 0.
    on_infeasible : what to do with a v0 too fast for the caps or the way that is left. ``raise`` refuses.
        ``brake`` is for a robot that already drives when an obstacle turns up: it brakes with d_max from
        the first node on and exceeds a cap for as long as that takes (cause ``braking``); if even so it
        cannot stand at the last node, the speed left there is told, not hidden. A feasible v0 gives the
        same profile either way.

    Returns
    -------
    v with v[0] = v0 and v[n-1] = 0; a[i] = (v[i+1]^2 - v[i]^2) / (2 ds), the constant acceleration on the
    way to node i + 1, and 0 at the last; t with t[0] = 0 and t[i+1] = t[i] + 2 ds / (v[i] + v[i+1]), exact
    for it. Speed is monotone between nodes, so a limit that holds at two neighbours holds between them.

    One edge cannot be driven so: a path of two nodes with v0 = 0, still at both ends. It is driven as
    :func:`stop_to_stop`, never faster than the lesser cap of its two nodes; there a[0] is 0, the mean over
    the edge. No other edge is still at both ends, because caps, a_max and d_max are positive.

    Raises
    ------
    SettingError : ``PROFILE_INFEASIBLE`` with the distance that v0 needs and the distance there is;
        ``START_SPEED``.
    """
    v0 = start_speed(v0)
    n = len(s)
    ds = s[1:] - s[:-1]
    if n == 0 or not (ds > 0).all():
        raise SettingError(
            "PROFILE_SPACING",
            "nodes at equal or falling distance",
            where="path",
            allowed="at least one node, distances strictly rising",
        )
    least = min(a_max, d_max, *(float(c.min()) for _, c in caps))
    if not (least >= _SMALL and max(a_max, d_max) <= _LARGE):
        raise SettingError("PROFILE_LIMIT", f"{least!r}", where="limits", allowed=f"{_SMALL:g} to {_LARGE:g}")
    cap, cause = lowest([("start", only(n, 0, v0)), *caps, ("goal", only(n, -1, 0.0))])
    x = [c * c for c in cap]
    down = (2.0 * d_max * ds).tolist()
    if on_infeasible == "brake":
        _brake_floor(x, down, v0, cause)
    sweep(x, (2.0 * a_max * ds).tolist(), down, cause)
    if on_infeasible == "raise" and x[0] < v0 * v0 * (1.0 - _ROUNDING):
        raise _infeasible(s, caps, d_max, v0)
    x[0], cause[0] = v0 * v0, "start"
    squares = np.array(x)
    v = np.sqrt(squares)
    v[0] = v0
    pace = v[:-1] + v[1:]
    if n == 2 and pace[0] == 0.0:
        dt = np.array([stop_to_stop(float(ds[0]), a_max, d_max, min(c.min() for _, c in caps))[1]])
    else:
        dt = 2.0 * ds / pace
    a, t = np.zeros(n), np.zeros(n)
    np.divide(squares[1:] - squares[:-1], 2.0 * ds, out=a[:-1])
    np.cumsum(dt, out=t[1:])
    return Feasible(v, a, t, tuple(cause))


def stop_to_stop(ds: float, a_max: float, d_max: float, cap: float) -> tuple[float, float]:
    """Peak speed (m/s) and time (s) from rest to rest over ``ds`` metres: full throttle, cruise, full brake.

    The peak is ``min(cap, sqrt(2 a d ds / (a + d)))``; where the cap does not bind there is no cruise, and
    v^2 over s is a triangle.
    """
    slope = 1.0 / a_max + 1.0 / d_max
    peak = min(cap, math.sqrt(2.0 * ds / slope))
    cruise = max(0.0, ds - 0.5 * peak * peak * slope)
    return peak, peak * slope + cruise / peak


def _brake_floor(x: list[float], down: Sequence[float], v0: float, cause: list[str]) -> None:
    """Raise x to what full braking from v0 cannot avoid."""
    x[0] = floor = v0 * v0
    for i in range(1, len(x)):
        floor -= down[i - 1]
        if floor <= 0.0:
            break
        if floor > x[i]:
            x[i], cause[i] = floor, "braking"


def _infeasible(s: Floats, caps: Sequence[tuple[str, Floats]], d_max: float, v0: float) -> SettingError:
    """The refusal, told by the node that asks for the slowest start."""
    cap, cause = lowest([*caps, ("goal", only(len(s), -1, 0.0))])
    start = [c * c + 2.0 * d_max * float(d) for c, d in zip(cap, s - s[0], strict=True)]
    k = start.index(min(start))
    needed = (v0 * v0 - cap[k] * cap[k]) / (2.0 * d_max)
    return SettingError(
        "PROFILE_INFEASIBLE",
        f"{v0:g} m/s at the start is too fast for {cap[k]:g} m/s at node {k} ({cause[k]}): "
        f"braking needs {needed:.6g} m and {float(s[k] - s[0]):.6g} m are there",
        where="v0",
        allowed=f"at most {math.sqrt(start[k]):.6g} m/s",
        todo="start slower, or brake harder",
    )

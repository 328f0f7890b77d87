"""Speeds along a path: two passes under slopes, hard braking, and a clock that never stalls.

A cause is a small number here; the caller knows the words. The first numbers are the same for all callers.
"""

from __future__ import annotations

from lampyris.kernels._jit import kernel

ACCELERATION, BRAKING = 0, 1
"""Causes that the passes themselves write."""

_EPSILON = 1.0 / 2**52


@kernel(out=("x", "cause", "cause_index"))
def sweep(x, up, down, keeps, cause, cause_index):
    """Lower ``x`` until it neither rises nor falls faster than it may, and note why.

    Parameters
    ----------
    x : out, float64 (n,): a monotone function of speed at each node, v or v^2. Given: its bounds.
    up, down : float64 (n - 1,), > 0: the most x may rise, or fall, on the way from node i to i + 1.
    keeps : bool (n,): whether the node's cause keeps a tie with acceleration. Every cause keeps a tie with
        braking.
    cause, cause_index : out, int64 (n,): ``ACCELERATION`` or ``BRAKING`` where a pass binds. ``cause_index`` of a braking
        node: the first node ahead that is not braking, whose bound it is that reaches back; -1 if every node
        ahead brakes, which only hard braking (:func:`brake_floor`) can leave behind. Of an accelerating
        node: -1.

    Every result is the least of the bounds seen along the slopes, and rounding is monotone: so the result is
    the same whichever pass comes first, and a bound that is raised never lowers it, to the last bit.
    """
    n = len(x)
    at = x[0]
    for i in range(1, n):
        reach = at + up[i - 1]
        at = x[i]
        if reach < at or (reach == at and not keeps[i]):
            x[i] = at = reach
            cause[i] = ACCELERATION
            cause_index[i] = -1
    at = x[n - 1]
    last = n - 1
    if cause[last] == BRAKING:
        last = -1
    for i in range(n - 2, -1, -1):
        reach = at + down[i]
        at = x[i]
        if reach < at:
            x[i] = at = reach
            cause[i] = BRAKING
        if cause[i] == BRAKING:
            cause_index[i] = last
        else:
            last = i


@kernel(out=("x", "cause"))
def brake_floor(x, down, floor, cause):
    """Raise ``x`` to what full braking from ``floor`` at the first node cannot avoid.

    Parameters
    ----------
    x : out, float64 (n,), v^2. Given: bounds.
    down : float64 (n - 1,): the most x may fall on each edge.
    floor : v^2 at the first node.
    cause : out, int64 (n,): ``BRAKING`` where x was raised, but for the first node.
    """
    x[0] = floor
    for i in range(1, len(x)):
        floor -= down[i - 1]
        if floor <= 0.0:
            break
        if floor > x[i]:
            x[i] = floor
            cause[i] = BRAKING


@kernel(out=("t",))
def clock(dt, t):
    """Times of arrival: the sum of the durations, and strictly rising whatever their sizes.

    Parameters
    ----------
    dt : float64 (n - 1,), > 0.
    t : out, float64 (n,), t[0] = 0.

    The sum is compensated (Neumaier, ZAMM 54, 1974): each t is the true sum to about a unit in its last
    place. An edge so short that no double lies between its two times is given the next one or the one after
    it; the clock then runs ahead of the sum by at most two units for each such edge in a row, and waits for
    the sum to catch up.
    """
    t[0] = 0.0
    total = 0.0
    lost = 0.0
    last = 0.0
    for i in range(len(dt)):
        step = dt[i]
        more = total + step
        if total >= step:
            lost += (total - more) + step
        else:
            lost += (step - more) + total
        total = more
        at = total + lost
        if at <= last:
            at = last + last * _EPSILON
        last = at
        t[i + 1] = at

"""Path and time: which parts of a path are taken when, and every motion on a lattice that avoids them.

The lattice: in one step of dt seconds the speed goes from j to k units, and the distance covered is j + k units of
length, so that states (step, place m, speed j) lie exactly on it. A step from (m, j) to (m + j + k, k) keeps
m + j even or odd, so a state is determined by ``n = (m + j - start) / 2``, start the first speed; a step adds k to
it. All n that can be reached with one speed at one step are one row of bits; a transition is a mask, a shift
by k and an or. Equations, and how the units are chosen: docs/speed/moving_obstacles.md.

A *pair* (j, k) has the number ``j * width + k - j + fall``, width = rise + fall + 1. A *span* is an open
interval of the distance, in units of length, that is taken during one part of a step; each step has ``parts``.
"""

from __future__ import annotations

from math import ceil, floor

from lampyris.kernels._jit import kernel, u64

_ROUNDING = 1e-12
"""Share of v^2 by which rounding may lie above the ceiling."""


@kernel(out=("ok",))
def allow_pairs(z, kink, kink_z, levels, rise, fall, start, words, ok):
    """Mark from which places each pair of speeds can be driven under the ceiling.

    Parameters
    ----------
    z : float64 (m + 1,): the ceiling's v^2 at each place, in units of speed squared.
    kink, kink_z : float64 (n,): places between which the ceiling is concave, rising, and the ceiling there.
        v^2 is linear in the distance: what is under the ceiling at both ends and at the kinks is under it between.
    levels : number of speeds, 0 included.
    rise, fall : most units of speed gained or lost in a step.
    start : units of speed at the beginning; odd or even as the last place is.
    words : in a row of bits.
    ok : out, uint8 (levels * (rise + fall + 1) * words * 64,): 1 where the pair can be driven; given as
        zeros. Bytes, not bits: the length of the longest array is how a kernel knows its work.
    """
    last = len(z) - 1
    width = rise + fall + 1
    for j in range(levels):
        jj = float(j * j)
        for k in range(max(j - fall, 0), min(j + rise + 1, levels)):
            kk = float(k * k)
            base = (j * width + k - j + fall) * words * 64
            span = j + k
            at = 0
            for n in range(((last - span + j - start) >> 1) + 1):
                m = 2 * n - j + start
                if m < 0:
                    continue
                if span > 0:
                    while at < len(kink) and kink[at] <= m:
                        at += 1
                    if jj > z[m] * (1.0 + _ROUNDING) or kk > z[m + span] * (1.0 + _ROUNDING):
                        continue
                    i = at
                    while i < len(kink) and kink[i] < m + span:
                        if jj + (kk - jj) * (kink[i] - m) / span > kink_z[i] * (1.0 + _ROUNDING):
                            break
                        i += 1
                    if i < len(kink) and kink[i] < m + span:
                        continue
                ok[base + n] = 1


@kernel(out=("best",))
def fewest_steps(ok, goal, levels, rise, fall, words, start, best):
    """Fewest steps from n = 0 at speed ``start`` to n = ``goal`` at speed 0, nobody in the way; -1: none.

    Parameters
    ----------
    ok : uint64 (levels * (rise + fall + 1) * words,): the answer of :func:`allow_pairs` as bits.
    best : out, int64 ((goal + 1) * levels,): work, given as 2**40 everywhere.
    """
    width = rise + fall + 1
    far = 1 << 40
    best[start] = 0
    for n in range(goal + 1):
        # A step to speed 0 keeps n: the higher speeds first.
        for j in range(levels - 1, -1, -1):
            now = best[n * levels + j]
            if now == far:
                continue
            for k in range(max(j - fall, 0), min(j + rise + 1, levels)):
                if j + k == 0 or n + k > goal:
                    continue
                word = ok[(j * width + k - j + fall) * words + (n >> 6)]
                if (word >> u64(n & 63)) & u64(1) != u64(0):
                    to = (n + k) * levels + k
                    if now + 1 < best[to]:
                        best[to] = now + 1
    return best[goal * levels] if best[goal * levels] < far else -1


@kernel(out=("words",))
def clear_range(words, first, last):
    """Clear the bits from ``first`` to ``last``, both included."""
    a = first >> 6
    b = last >> 6
    below = (u64(1) << u64(first & 63)) - u64(1)
    above = (u64(0xFFFF_FFFF_FFFF_FFFF) << u64(last & 63)) & u64(0xFFFF_FFFF_FFFF_FFFF)
    above = (above << u64(1)) & u64(0xFFFF_FFFF_FFFF_FFFF)
    if a == b:
        words[a] &= below | above
    else:
        words[a] &= below
        for w in range(a + 1, b):
            words[w] = u64(0)
        words[b] &= above


@kernel(out=("reach", "low", "high", "work"))
def spread(
    reach,
    low,
    high,
    work,
    begin,
    end,
    ok,
    goal,
    levels,
    rise,
    fall,
    start,
    words,
    parts,
    index,
    span_lo,
    span_hi,
):
    """Every state that can be reached, step by step, until the goal can.

    Parameters
    ----------
    reach : out, uint64 ((steps + 1) * levels * words,): bits of n by step and speed. Given: those of
        step ``begin``, zeros after it.
    low, high : out, int64 ((steps + 1) * levels,): first and last word of each row with a bit set.
    work : out, uint64 (words,).
    begin, end : first step and the one to stop at.
    ok : see :func:`fewest_steps`.
    parts, index, span_lo, span_hi : the spans of part i of step k are ``index[k * parts + i]`` up to the next
        index; float64, units of length.

    Returns
    -------
    The step at which the robot can stand at the goal; -1: not until ``end``; -2 - k: no state is left
    after step k.
    """
    width = rise + fall + 1
    aim = u64(1) << u64(goal & 63)
    for step in range(begin, end):
        alive = False
        busy = index[(step + 1) * parts] > index[step * parts]
        for j in range(levels):
            row = step * levels + j
            if high[row] < low[row]:
                continue
            for k in range(max(j - fall, 0), min(j + rise + 1, levels)):
                base = (j * width + k - j + fall) * words
                some = u64(0)
                for w in range(low[row], high[row] + 1):
                    work[w] = reach[row * words + w] & ok[base + w]
                    some |= work[w]
                if some == u64(0):
                    continue
                if busy:
                    before = 0.0
                    for i in range(parts):
                        part = (i + 1.0) / parts
                        after = part * (2.0 * j + (k - j) * part)
                        for c in range(index[step * parts + i], index[step * parts + i + 1]):
                            first = floor(span_lo[c] - after) + 1
                            until = ceil(span_hi[c] - before) - 1
                            first = max((first + j - start + 1) >> 1, low[row] << 6)
                            until = min((until + j - start) >> 1, (high[row] << 6) + 63)
                            if first <= until:
                                clear_range(work, first, until)
                        before = after
                to = (step + 1) * levels + k
                over = k >> 6
                shift = k & 63
                least = words
                most = -1
                for w in range(low[row], high[row] + 1):
                    bits = work[w]
                    if bits == u64(0):
                        continue
                    alive = True
                    most = w + over
                    if most < least:
                        least = most
                    at = to * words + most
                    reach[at] |= (bits << u64(shift)) & u64(0xFFFF_FFFF_FFFF_FFFF)
                    if shift > 0:
                        carry = bits >> u64(64 - shift)
                        if carry != u64(0):
                            reach[at + 1] |= carry
                            most += 1
                low[to] = min(low[to], least)
                high[to] = max(high[to], most)
        if reach[(step + 1) * levels * words + (goal >> 6)] & aim != u64(0):
            return step + 1
        if not alive:
            return -2 - step
    return -1


@kernel()
def step_is_free(step, m, j, k, parts, index, span_lo, span_hi):
    """Whether a step from place m with speeds j and k meets none of its spans."""
    before = 0.0
    for i in range(parts):
        part = (i + 1.0) / parts
        after = part * (2.0 * j + (k - j) * part)
        for c in range(index[step * parts + i], index[step * parts + i + 1]):
            # The very sums of spread, so that both say the same.
            if m > floor(span_lo[c] - after) and m < ceil(span_hi[c] - before):
                return False
        before = after
    return True


@kernel(out=("reach", "low", "high", "work", "kept"))
def prune(
    reach,
    low,
    high,
    work,
    kept,
    steps,
    ok,
    goal,
    levels,
    rise,
    fall,
    start,
    words,
    parts,
    index,
    span_lo,
    span_hi,
):
    """Leave only those states from which the goal is reached at step ``steps``; arguments as of spread.

    Parameters
    ----------
    work, kept : out, uint64 (words,).
    """
    width = rise + fall + 1
    for j in range(levels):
        row = steps * levels + j
        for w in range(low[row], high[row] + 1):
            reach[row * words + w] = u64(0)
        low[row] = words
        high[row] = -1
    row = steps * levels
    low[row] = goal >> 6
    high[row] = goal >> 6
    reach[row * words + (goal >> 6)] = u64(1) << u64(goal & 63)
    for step in range(steps - 1, -1, -1):
        busy = index[(step + 1) * parts] > index[step * parts]
        for j in range(levels):
            row = step * levels + j
            least = low[row]
            most = high[row]
            for w in range(least, most + 1):
                kept[w] = u64(0)
            for k in range(max(j - fall, 0), min(j + rise + 1, levels)):
                to = (step + 1) * levels + k
                over = k >> 6
                shift = k & 63
                begin = max(least, low[to] - over - 1)
                end = min(most, high[to] - over)
                if begin > end:
                    continue
                base = (j * width + k - j + fall) * words
                some = u64(0)
                for w in range(begin, end + 1):
                    bits = reach[to * words + w + over] >> u64(shift)
                    if shift > 0 and w + over + 1 < words:
                        carry = reach[to * words + w + over + 1] << u64(64 - shift)
                        bits |= carry & u64(0xFFFF_FFFF_FFFF_FFFF)
                    work[w] = bits & ok[base + w] & reach[row * words + w]
                    some |= work[w]
                if some == u64(0):
                    continue
                if busy:
                    before = 0.0
                    for i in range(parts):
                        part = (i + 1.0) / parts
                        after = part * (2.0 * j + (k - j) * part)
                        for c in range(index[step * parts + i], index[step * parts + i + 1]):
                            first = floor(span_lo[c] - after) + 1
                            until = ceil(span_hi[c] - before) - 1
                            first = max((first + j - start + 1) >> 1, begin << 6)
                            until = min((until + j - start) >> 1, (end << 6) + 63)
                            if first <= until:
                                clear_range(work, first, until)
                        before = after
                for w in range(begin, end + 1):
                    kept[w] |= work[w]
            low[row] = words
            high[row] = -1
            for w in range(least, most + 1):
                reach[row * words + w] = kept[w]
                if kept[w] != u64(0):
                    high[row] = w
                    if low[row] > w:
                        low[row] = w


@kernel()
def is_set(reach, step, n, j, levels, words):
    """Whether a state is among those that are left."""
    word = reach[(step * levels + j) * words + (n >> 6)]
    return (word >> u64(n & 63)) & u64(1) != u64(0)


@kernel(out=("place", "speed"))
def walk_on(
    reach,
    steps,
    ahead,
    ok,
    goal,
    levels,
    rise,
    fall,
    start,
    words,
    parts,
    index,
    span_lo,
    span_hi,
    place,
    speed,
):
    """One motion among the states that :func:`prune` has left, from the start on.

    Each step takes the speed that could be held longest, up to ``ahead`` steps; of equal ones the highest. So
    the robot does not wait for what is far, and does not race to where it has to stand.

    Parameters
    ----------
    place, speed : out, int64 (steps + 1,).

    Returns
    -------
    0, or the number of the step after which nothing was left, which cannot be.
    """
    width = rise + fall + 1
    n = 0
    j = start
    place[0] = 0
    speed[0] = start
    for step in range(steps):
        best = -1
        found = -1
        m = 2 * n - j + start
        for k in range(min(j + rise, levels - 1), max(j - fall, 0) - 1, -1):
            if n + k > goal or not is_set(reach, step + 1, n + k, k, levels, words):
                continue
            word = ok[(j * width + k - j + fall) * words + (n >> 6)]
            if (word >> u64(n & 63)) & u64(1) == u64(0):
                continue
            held = 0
            while held < ahead and step + held + 2 <= steps:
                to = n + k * (held + 2)
                if to > goal or not is_set(reach, step + held + 2, to, k, levels, words):
                    break
                held += 1
            if held > best and step_is_free(step, m, j, k, parts, index, span_lo, span_hi):
                best = held
                found = k
                if held == ahead:
                    break
        if found < 0:
            return step + 1
        n += found
        j = found
        place[step + 1] = 2 * n - j + start
        speed[step + 1] = j
    return 0

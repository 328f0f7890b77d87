"""Which gates lead nowhere: dead-end filling, restricted to gates, with a worklist."""

from __future__ import annotations

from lampyris.kernels._helpers import STRETCH
from lampyris.kernels._jit import kernel, stopped, u64


@kernel()
def _opens(state, cell, ahead, across, strict):
    """Whether a cell can be left towards one side, straight or diagonally, to a live cell."""
    front = cell + ahead
    if state[front] == 1:
        return True
    # A diagonal may not pass a wall if the moves are strict; the front cell is not live, but it may be a
    # dead gate.
    if strict and state[front] == 0:
        return False
    if state[front - across] == 1 and (not strict or state[cell - across] > 0):
        return True
    return state[front + across] == 1 and (not strict or state[cell + across] > 0)


@kernel(out=("state", "axis", "queue"), each=500, of="queue")
def dead_ends(state, axis, queue, count, width, strict, halt):
    """Mark every gate from which, on one side of its passage, no live cell can be reached; to a fixed point.

    Parameters
    ----------
    state : uint8, (n,), padded by one; 0 wall, 1 live. Dead ends become 2.
    axis : uint8, (n,); 1 for walls left and right (a passage up and down), 2 for walls above and below, 3
        for both. While a gate is queued, 4 is added; none is on return.
    queue : uint32, (count + 1,); the gates. Scratch on return: a gate is asked again only when a neighbour
        has died.
    strict : whether a diagonal needs both side cells free.

    The fixed point does not depend on the order: a death can only cause more.
    """
    w = u64(width)
    one = u64(1)
    top = u64(count)
    for i in range(top):
        axis[queue[i]] += 4
    turns = 0
    while top > u64(0):
        turns += 1
        if turns % STRETCH == 0 and stopped(halt):
            return
        top -= one
        p = queue[top] + u64(0)
        kind = axis[p] - 4
        axis[p] = kind
        up = u64(0) - w
        left = u64(0) - one
        through_y = kind != 2 and _opens(state, p, up, one, strict) and _opens(state, p, w, one, strict)
        through_x = kind != 1 and _opens(state, p, left, w, strict) and _opens(state, p, one, w, strict)
        if through_x or through_y:
            continue
        state[p] = 2
        for dy in range(3):
            for dx in range(3):
                n = p + u64(dy) * w + u64(dx) - w - one
                if state[n] == 1 and 0 < axis[n] < 4:
                    axis[n] += 4
                    queue[top] = n
                    top += one

"""What a mesh of rectangles takes besides loops, by operations on whole arrays.

:func:`list_sides` is the kernel of that name in :mod:`.rectangle_mesh`, for where it is not compiled: equal to it to the last
bit.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from lampyris.kernels.map_models.corner_flags import LINE_X, LINE_Y, PORT, TOWARDS_X, TOWARDS_Y, TURN

_Bytes = NDArray[np.uint8]
_Ints = NDArray[np.int32]
_Mask = NDArray[np.bool_]


def mark_corners(square: _Bytes, centre: _Bytes, stride: int, passing: bool) -> _Bytes:
    """The corners at which paths may turn, and the ports, uint8 (n,): see :mod:`.rectangle_mesh`.

    Parameters
    ----------
    square, stride : as for :func:`.rectangle_mesh.cover`.
    centre : uint8 (n,) or (1,): corners that may be passed along lines; one 0 where there are no such lines.
    passing : whether a path may run between two blocked squares that share a corner.
    """
    corner = np.zeros(square.size, dtype=np.uint8)
    free = square.reshape(-1, stride) != 0
    a, b, e, d = free[:-1, :-1], free[:-1, 1:], free[1:, :-1], free[1:, 1:]
    flags = corner.reshape(-1, stride)[1:, 1:]
    # An odd number of free squares, and not a single one: of both pairs one is whole, the other is not.
    turn = (a ^ b ^ e ^ d) & ((a & b) | (e & d))
    flags[:] = turn.view(np.uint8) * np.uint8(TURN)
    flags += (turn & ~(b & d)).view(np.uint8) * np.uint8(TOWARDS_X)
    flags += (turn & ~(e & d)).view(np.uint8) * np.uint8(TOWARDS_Y)
    if passing:
        flags += ((a == d) & (b == e) & (a ^ b)).view(np.uint8) * np.uint8(PORT)
    if centre.size > 1:
        _mark_lines(centre.reshape(-1, stride) != 0, free, flags)
    return corner


def _mark_lines(centre: _Mask, free: _Mask, flags: _Bytes) -> None:
    """The ports on lines between corners with blocked squares on both sides, and those lines."""
    a, b, e, d = free[:-1, :-1], free[:-1, 1:], free[1:, :-1], free[1:, 1:]
    around = np.zeros((centre.shape[0] + 1, centre.shape[1] + 1), dtype=np.bool_)
    around[:-1, :-1] = centre
    here = centre[1:, 1:]
    right = here & around[1:-1, 2:] & ~b & ~d
    down = here & around[2:, 1:-1] & ~e & ~d
    left = here & centre[1:, :-1] & ~a & ~e
    up = here & centre[:-1, 1:] & ~a & ~b
    flags |= right.view(np.uint8) * np.uint8(LINE_X)
    flags |= down.view(np.uint8) * np.uint8(LINE_Y)
    thin = (right | down | left | up).view(np.uint8)
    flags |= thin * np.uint8(PORT)
    flags &= ~(thin * np.uint8(TURN))


def count_sides(owner: _Ints, stride: int) -> int:
    """How many sides all rectangles have together."""
    whose = owner.reshape(-1, stride)
    return 2 * (_borders(whose) + _borders(whose.T))


def count_ports(corner: _Bytes, owner: _Ints, stride: int) -> int:
    """How often a port lies on the rim of a rectangle."""
    at = np.flatnonzero(corner & PORT)
    # Each rectangle once: where none of the squares before is of it.
    around: list[_Ints] = [owner[at - off] for off in (0, 1, stride, stride + 1)]
    count = 0
    for k, whose in enumerate(around):
        new = whose >= 0
        for before in around[:k]:
            new &= whose != before
        count += int(np.count_nonzero(new))
    return count


def list_sides(
    corner: _Bytes, stride: int, owner: _Ints, rects: _Ints,
    first: _Ints, sides: _Ints, port_first: _Ints, ports: _Ints, halt: Any,
) -> None:  # fmt: skip
    """See :func:`.rectangle_mesh.list_sides`."""
    count = len(first) - 1
    left, top, right, bottom = (rects[k : 4 * count : 4] >> 1 for k in range(4))
    # By rectangle: along the top, the right side, the bottom and the left side.
    length, x, y = (np.empty(4 * count, dtype=np.int32) for _ in range(3))
    length[0::4] = length[2::4] = right - left
    length[1::4] = length[3::4] = bottom - top
    x[0::4] = x[3::4] = left
    x[1::4] = x[2::4] = right
    y[0::4] = y[1::4] = top
    y[2::4] = y[3::4] = bottom
    start = y * np.int32(stride) + x
    step = np.tile(np.array([1, stride, -1, -stride], dtype=np.int32), count)
    end = np.cumsum(length)
    begin = end - length
    ends = np.append(begin[::4], end[-1:] if count else 0)
    if corner.size and (corner & PORT).any():
        along = _rim(start, step, length, begin)
        port = np.flatnonzero(corner[along] & PORT)
        port_first[:] = np.searchsorted(port, ends)
        ports[: port.size] = along[port]
    else:
        port_first[:] = 0
    # The square outside beside each piece of a rim.
    outside = np.tile(np.array([-stride, 0, -1, -stride - 1], dtype=np.int32), count)
    behind = owner[_rim(start + outside, step, length, begin)]
    free = behind >= 0
    opens = np.empty(behind.size, dtype=np.bool_)
    np.not_equal(behind[1:], behind[:-1], out=opens[1:])
    opens[begin] = True
    # A side ends before another begins, before a blocked square, and where the rectangle's own does.
    shut = np.ones(behind.size, dtype=np.bool_)
    shut[:-1] = opens[1:]
    at, last = np.flatnonzero(opens & free), np.flatnonzero(shut & free)
    first[:] = np.searchsorted(at, ends)
    side = np.repeat(np.arange(4 * count, dtype=np.int32), length)[at]
    here = start[side] - begin[side] * step[side]
    table = sides[: 5 * at.size].reshape(-1, 5)
    for k, piece in ((0, at), (2, last + 1)):
        table[:, k + 1], table[:, k] = np.divmod(
            (here + piece * step[side]).astype(np.int32), np.int32(stride)
        )
    table[:, :4] *= 2
    table[:, 4] = behind[at]


def _rim(start: _Ints, step: _Ints, length: _Ints, begin: NDArray[np.int64]) -> _Ints:
    """So many flat indices from each start on, in steps of its own."""
    more = np.repeat(step, length)
    if start.size:
        more[0] = start[0]
        more[begin[1:]] = start[1:] - start[:-1] - (length[:-1] - 1) * step[:-1]
    return np.cumsum(more, dtype=np.int32, out=more)  # new memory takes longer than the sums


def _borders(whose: NDArray[np.int32]) -> int:
    """How many straight borders two rectangles share along rows."""
    up, down = whose[:-1], whose[1:]
    both = (up != down) & (up >= 0) & (down >= 0)
    goes_on = both[:, 1:] & both[:, :-1] & (up[:, 1:] == up[:, :-1]) & (down[:, 1:] == down[:, :-1])
    return int(np.count_nonzero(both)) - int(np.count_nonzero(goes_on))

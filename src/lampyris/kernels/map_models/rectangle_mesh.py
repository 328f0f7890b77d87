"""A mesh of rectangles of free squares, for :mod:`.polyanya`.

Corners, at even points, have one byte each in ``corner``:

* ``TURN``: exactly one of the four squares is blocked; a path may turn around it. ``TOWARDS_X`` and ``TOWARDS_Y`` say
  on which side it lies (set: that of greater coordinates).
* ``PORT``: paths pass here from one rectangle to another that shares only this point with it, or into a line between
  two corners with blocked squares on both sides. ``LINE_X``, ``LINE_Y``: such a line runs to the next corner in x (y).
"""

from __future__ import annotations

from lampyris.kernels._jit import kernel, stopped, u64

TURN, PORT, LINE_X, LINE_Y, TOWARDS_X, TOWARDS_Y = 1, 2, 4, 8, 16, 32


@kernel(out=("owner", "rects"))
def _cover(square, stride, height, owner, rects, halt):
    """Cover the free squares; how many rectangles it takes."""
    count = 0
    for r in range(1, height - 1):
        if stopped(halt):
            return count
        for c in range(1, stride - 1):
            at = r * stride + c
            if square[u64(at)] != 0 and owner[u64(at)] < 0:
                # As wide as possible, then as high.
                wide = 1
                while square[u64(at + wide)] != 0 and owner[u64(at + wide)] < 0:
                    wide += 1
                high = 1
                while True:
                    whole = 1
                    for k in range(wide):
                        if (
                            square[u64(at + high * stride + k)] == 0
                            or owner[u64(at + high * stride + k)] >= 0
                        ):
                            whole = 0
                            break
                    if whole == 0:
                        break
                    high += 1
                tall = 1
                while square[u64(at + tall * stride)] != 0 and owner[u64(at + tall * stride)] < 0:
                    tall += 1
                slim = 1
                while slim < wide:
                    whole = 1
                    for k in range(tall):
                        if (
                            square[u64(at + k * stride + slim)] == 0
                            or owner[u64(at + k * stride + slim)] >= 0
                        ):
                            whole = 0
                            break
                    if whole == 0:
                        break
                    slim += 1
                if slim * tall > wide * high:
                    wide = slim
                    high = tall
                for i in range(high):
                    for k in range(wide):
                        owner[u64(at + i * stride + k)] = count
                rects[u64(4 * count)] = 2 * c
                rects[u64(4 * count + 1)] = 2 * r
                rects[u64(4 * count + 2)] = 2 * (c + wide)
                rects[u64(4 * count + 3)] = 2 * (r + high)
                count += 1
    return count


@kernel(out=("corner",))
def _mark_corners(square, centre, stride, height, passing, corner):
    """Find the corners at which paths may turn, and the ports."""
    n = len(square)
    lines = len(centre) > 1
    for r in range(1, height):
        for c in range(1, stride):
            at = r * stride + c
            a = square[u64(at - stride - 1)]
            b = square[u64(at - stride)]
            e = square[u64(at - 1)]
            d = square[u64(at)]
            flags = 0
            free = a + b + e + d
            if free == 3:
                flags = TURN
                if b == 0 or d == 0:
                    flags |= TOWARDS_X
                if e == 0 or d == 0:
                    flags |= TOWARDS_Y
            elif free == 2 and a == d and passing != 0:
                flags = PORT
            if lines and centre[u64(at)] != 0:
                thin = 0
                if centre[u64(at + 1)] != 0 and b == 0 and d == 0:
                    flags |= LINE_X
                    thin = 1
                if at + stride < n and centre[u64(at + stride)] != 0 and e == 0 and d == 0:
                    flags |= LINE_Y
                    thin = 1
                if centre[u64(at - 1)] != 0 and a == 0 and e == 0:
                    thin = 1
                if centre[u64(at - stride)] != 0 and a == 0 and b == 0:
                    thin = 1
                if thin != 0:
                    flags |= PORT
            if flags & PORT:
                flags &= ~TURN
            corner[u64(at)] = flags


@kernel(
    out=("owner", "corner", "rects", "first", "sides", "port_first", "ports", "out", "doors_of", "result"),
    each=800,
)
def rectangles(
    square,
    centre,
    stride,
    passing,
    fill,
    owner,
    corner,
    rects,
    first,
    sides,
    port_first,
    ports,
    out,
    doors_of,
    result,
    halt,
):
    """Cover the free squares with rectangles, and list the sides that two of them share.

    From the first square that is not covered, in rows, the larger of two rectangles is taken: as wide as possible
    and then as high, or as high as possible and then as wide.

    Parameters
    ----------
    square : uint8 (n,), 1 where a square is free; blocked around.
    centre : uint8 (n,) or (1,): corners that may be passed along lines; one 0 where there are no such lines.
    stride : squares in a row.
    passing : 1 where a path may run between two blocked squares that share a corner.
    fill : 0 to make ``owner``, ``corner`` and ``rects`` and count the others, 1 to make the others.
    owner : int32 (n,), -1 before; the rectangle of each square.
    corner : uint8 (n,), see above.
    rects : int32 (4 k,); left, top, right, bottom of each rectangle, lattice.
    first, sides : int32 (k + 1,) and (5 m,): from where on the sides of a rectangle are; right and left end as
        seen from within (x and y of each), and the rectangle behind it.
    port_first, ports : int32 (k + 1,) and (p,): likewise, the flat indices of ports on a rectangle.
    out : int32 (k,): of a rectangle in a dead end the next rectangle on the only path that leaves it; else -1.
    doors_of : int32 (k,); scratch.
    result : int64 (3,): rectangles, sides, ports.
    """
    n = len(square)
    height = n // stride
    if fill == 0:
        result[0] = _cover(square, stride, height, owner, rects, halt)
        _mark_corners(square, centre, stride, height, passing, corner)
    many = 0
    doors = 0
    for p in range(result[0]):
        if p % 64 == 0 and stopped(halt):
            return
        if fill != 0:
            first[u64(p)] = many
            port_first[u64(p)] = doors
        left = rects[u64(4 * p)] >> 1
        top = rects[u64(4 * p + 1)] >> 1
        right = rects[u64(4 * p + 2)] >> 1
        bottom = rects[u64(4 * p + 3)] >> 1
        for side in range(4):
            # Along the top and the right side forwards, along the bottom and the left side backwards.
            upright = side & 1
            length = bottom - top if upright else right - left
            x = right if side == 1 or side == 2 else left
            y = bottom if side == 2 or side == 3 else top
            step = 1 if side < 2 else -1
            ux = 0 if upright else step
            uy = step if upright else 0
            # The square outside, beside the first piece of the side.
            ox = x if side == 0 or side == 1 else x - 1
            oy = y - 1 if side == 0 or side == 3 else y
            before = -1
            for k in range(length):
                if corner[u64((y + k * uy) * stride + x + k * ux)] & PORT:
                    if fill != 0:
                        ports[u64(doors)] = (y + k * uy) * stride + x + k * ux
                    doors += 1
                q = owner[u64((oy + k * uy) * stride + ox + k * ux)] + 0
                if q >= 0:
                    if q != before:
                        many += 1
                        if fill != 0:
                            sides[u64(5 * many - 5)] = 2 * (x + k * ux)
                            sides[u64(5 * many - 4)] = 2 * (y + k * uy)
                            sides[u64(5 * many - 1)] = q
                    if fill != 0:
                        sides[u64(5 * many - 3)] = 2 * (x + (k + 1) * ux)
                        sides[u64(5 * many - 2)] = 2 * (y + (k + 1) * uy)
                before = q
    if fill != 0:
        first[u64(result[0])] = many
        port_first[u64(result[0])] = doors
        # Rectangles without ports that are left by a single side are dead ends, and so are those that then are.
        for p in range(result[0]):
            out[u64(p)] = -1
            doors_of[u64(p)] = first[u64(p + 1)] - first[u64(p)]
        for start in range(result[0]):
            p = start
            while (
                p >= 0
                and out[u64(p)] < 0
                and doors_of[u64(p)] == 1
                and port_first[u64(p + 1)] == port_first[u64(p)]
            ):
                q = -1
                for k in range(first[u64(p)], first[u64(p + 1)]):
                    behind = int(sides[u64(5 * k + 4)])
                    if out[u64(behind)] < 0:
                        q = behind
                if q >= 0:
                    out[u64(p)] = q
                    doors_of[u64(q)] = doors_of[u64(q)] - 1
                p = q
    result[1] = many
    result[2] = doors

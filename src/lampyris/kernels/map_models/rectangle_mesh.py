"""A mesh of rectangles of free squares, for :mod:`.polyanya`: :func:`cover`, :func:`.rectangle_mesh_arrays.mark_corners`,
:func:`list_sides`, :func:`exits_of`, in this order.

Corners, at even points, have one byte each in ``corner`` (:mod:`.corner_flags`):

* ``TURN``: exactly one of the four squares is blocked; a path may turn around it. ``TOWARDS_X`` and ``TOWARDS_Y`` say
  on which side it lies (set: that of greater coordinates).
* ``PORT``: paths pass here from one rectangle to another that shares only this point with it, or into a line between
  two corners with blocked squares on both sides. ``LINE_X``, ``LINE_Y``: such a line runs to the next corner in x (y).
"""

from __future__ import annotations

from lampyris.kernels._jit import kernel, stopped, u64
from lampyris.kernels.map_models import rectangle_mesh_arrays as arrays
from lampyris.kernels.map_models.corner_flags import PORT


@kernel(out=("owner", "rects"))
def cover(square, stride, owner, rects, halt):
    """Cover the free squares with rectangles; how many it takes.

    From the first square that is not covered, in rows, the larger of two rectangles is taken: as wide as possible
    and then as high, or as high as possible and then as wide.

    Parameters
    ----------
    square : uint8 (n,), 1 where a square is free; blocked around.
    stride : squares in a row.
    owner : int32 (n,), -1 before; the rectangle of each square.
    rects : int32 (4 k,); left, top, right, bottom of each rectangle, lattice.
    """
    height = len(square) // stride
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


@kernel(out=("first", "sides", "port_first", "ports"), of="owner", each=60, arrays=arrays.list_sides)
def list_sides(corner, stride, owner, rects, first, sides, port_first, ports, halt):
    """List the sides that two rectangles share, and the ports on each; how many of both is counted before.

    Parameters
    ----------
    corner, stride, owner, rects : see :func:`.rectangle_mesh_arrays.mark_corners` and :func:`cover`.
    first, sides : int32 (k + 1,) and (5 m,): from where on the sides of a rectangle are; right and left end as
        seen from within (x and y of each), and the rectangle behind it.
    port_first, ports : int32 (k + 1,) and (p,): likewise, the flat indices of ports on a rectangle.
    """
    count = len(first) - 1
    many = 0
    doors = 0
    for p in range(count):
        if p % 64 == 0 and stopped(halt):
            return
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
                    ports[u64(doors)] = (y + k * uy) * stride + x + k * ux
                    doors += 1
                q = owner[u64((oy + k * uy) * stride + ox + k * ux)] + 0
                if q >= 0:
                    if q != before:
                        many += 1
                        sides[u64(5 * many - 5)] = 2 * (x + k * ux)
                        sides[u64(5 * many - 4)] = 2 * (y + k * uy)
                        sides[u64(5 * many - 1)] = q
                    sides[u64(5 * many - 3)] = 2 * (x + (k + 1) * ux)
                    sides[u64(5 * many - 2)] = 2 * (y + (k + 1) * uy)
                before = q
    first[u64(count)] = many
    port_first[u64(count)] = doors


@kernel(out=("out", "doors_of"), of="out")
def exits_of(single, first, sides, port_first, out, doors_of, halt):
    """Rectangles without ports that are left by a single side are dead ends, and so are those that then are.

    Parameters
    ----------
    single : int32 (s,): the rectangles with a single side and no ports, rising.
    first, sides, port_first : see :func:`list_sides`.
    out : int32 (k,), -1 before: of a rectangle in a dead end the next rectangle on the only path that leaves it.
    doors_of : int32 (k,): how many sides each rectangle has; scratch.
    """
    for i in range(len(single)):
        if i % 64 == 0 and stopped(halt):
            return
        p = int(single[u64(i)])
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

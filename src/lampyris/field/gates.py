"""Gates: openings too narrow for the robot (the dissertation's raise states; method.md section 3)."""

from __future__ import annotations

import numpy as np

from lampyris.field.layers import free_cells
from lampyris.model.field import Gate
from lampyris.model.grid import Grid, frozen
from lampyris.model.robot import Robot
from lampyris.typing import BoolGrid

_POINT = Robot()


def gate_mask(grid: Grid, robot: Robot = _POINT) -> BoolGrid:
    """Which cells are gates; bool, (height, width), read-only."""
    wx, wy = _widths(grid, robot)
    return frozen((wx > 0) | (wy > 0))


def find_gates(grid: Grid, robot: Robot = _POINT) -> tuple[Gate, ...]:
    """Every gate of a map, sorted by row, then column."""
    wx, wy = _widths(grid, robot)
    mask = (wx > 0) | (wy > 0)
    dead = _dead_ends(~grid.blocked, mask, wx > 0, wy > 0)
    out = []
    for y, x in np.argwhere(mask).tolist():
        a, b = int(wx[y, x]), int(wy[y, x])
        axis = ("x" if a else "") + ("y" if b else "")
        width = min(v for v in (a, b) if v)
        out.append(Gate((x, y), axis, width * grid.resolution, bool(dead[y, x])))
    return tuple(out)


def _widths(grid: Grid, robot: Robot):  # type: ignore[no-untyped-def]
    """Width in cells of the narrow run through each gate along x and along y, else 0."""
    b = grid.blocked
    limit = 2 * robot.radius / grid.resolution if robot.radius > 0 else None

    def along_x(b):  # type: ignore[no-untyped-def]
        h, w = b.shape
        out = np.zeros((h, w), np.int64)
        for y in range(h):
            xs = np.nonzero(b[y])[0]
            for l, r in zip(xs[:-1], xs[1:], strict=True):
                n = r - l - 1
                if n and (n == 1 if limit is None else n < limit - 1e-9):
                    out[y, l + 1 : r] = n
        return out

    return along_x(b), along_x(b.T).T


def _dead_ends(free, mask, gx, gy):  # type: ignore[no-untyped-def]
    live = free.copy()
    h, w = free.shape

    def side(x, y, cells):  # type: ignore[no-untyped-def]
        return any(0 <= x + dx < w and 0 <= y + dy < h and live[y + dy, x + dx] for dx, dy in cells)

    changed = True
    gates = np.argwhere(mask).tolist()
    while changed:
        changed = False
        for y, x in gates:
            if not live[y, x]:
                continue
            dead = (gx[y, x] and not (side(x, y, ((-1, -1), (0, -1), (1, -1))) and side(x, y, ((-1, 1), (0, 1), (1, 1))))) or (
                gy[y, x] and not (side(x, y, ((-1, -1), (-1, 0), (-1, 1))) and side(x, y, ((1, -1), (1, 0), (1, 1))))
            )
            if dead:
                live[y, x] = False
                changed = True
    return mask & ~live

"""Footprint: the cells that a disc covers, by one rule for robots and obstacles."""

from __future__ import annotations

import math

from lampyris.typing import Cell

FORGIVEN = 1e-9
"""Share of the squared radius that decimal rounding may eat; the same as in :mod:`.layers`."""


def footprint(radius: float, resolution: float) -> tuple[Cell, ...]:
    """The cells a disc covers, as offsets from its own cell, row by row.

    A cell is covered if some point of its square lies nearer to the centre of the disc's own cell than
    ``radius`` (metres; strictly nearer). The own cell is always covered. Distances are compared as whole
    half cells, as the field does, so that a disc which touches a cell's border does not cover that cell on
    any machine.
    """
    reach = 2.0 * radius / resolution
    if reach <= 1.0 + FORGIVEN:
        return ((0, 0),)
    need = math.ceil(reach * reach * (1.0 - FORGIVEN))
    far = math.ceil(reach / 2.0) + 1
    span = range(-far, far + 1)
    half = {d: max(2 * abs(d) - 1, 0) for d in span}
    gap = {d: half[d] * half[d] for d in span}
    return tuple((dx, dy) for dy in span for dx in span if gap[dx] + gap[dy] < need)


def reach_of(own: tuple[Cell, ...], other: tuple[Cell, ...]) -> tuple[Cell, ...]:
    """Where an obstacle of footprint ``own`` meets one of footprint ``other``: offsets between their own cells.

    The Minkowski difference. An obstacle whose own cell is at p + r, for an r of these, and another at p share a
    cell; so a robot with a size among obstacles is a point among larger ones.
    """
    found = {(oy - y, ox - x) for ox, oy in other for x, y in own}
    return tuple((x, y) for y, x in sorted(found))

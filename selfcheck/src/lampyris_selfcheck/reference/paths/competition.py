"""A second judge of paths: the rules that the Grid-Based Path Planning Competition publishes, and their gaps.

The rules are those of its problem definition (gppc-dev/startkit-dynamic, Problem_Definition.md): a path is a
sequence of nodes; each two that follow each other lie strictly in one of the eight directions, any number of
moves apart; no move leaves the map, enters an obstacle or cuts a corner; a cardinal move costs 1, an ordinal
one sqrt 2. Its judge looks at segments alone: it never sees between which cells was asked, so a path without
any segment has nothing wrong with it, and a single node has no segment to be right.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

Cell = tuple[int, int]


def first_wrong(blocked: Sequence[Sequence[bool]], nodes: Sequence[Cell]) -> int:
    """Number of the first segment that is wrong; -1 where none is.

    Parameters
    ----------
    blocked : ``blocked[y][x]``.
    nodes : x and y of each; segments may be several moves long.
    """
    if len(nodes) == 1:
        return 0
    for number in range(len(nodes) - 1):
        if not _is_segment(blocked, nodes[number], nodes[number + 1]):
            return number
    return -1


def moves_of(nodes: Sequence[Cell]) -> tuple[int, int]:
    """How many cardinal and ordinal moves its segments are; an ordinal one is sqrt 2 long."""
    cardinal = ordinal = 0
    for (x, y), (u, v) in pairwise(nodes):
        if x != u and y != v:
            ordinal += abs(u - x)
        else:
            cardinal += abs(u - x) + abs(v - y)
    return cardinal, ordinal


def turns_of(nodes: Sequence[Cell]) -> list[Cell]:
    """The same path by its ends and the cells in which it turns."""
    kept = list(nodes[:1])
    for k in range(1, len(nodes)):
        if k + 1 < len(nodes):
            (ax, ay), (bx, by), (cx, cy) = nodes[k - 1], nodes[k], nodes[k + 1]
            if (bx - ax, by - ay) == (cx - bx, cy - by):
                continue
        kept.append(nodes[k])
    return kept


def _is_segment(blocked: Sequence[Sequence[bool]], one: Cell, other: Cell) -> bool:
    across, down = other[0] - one[0], other[1] - one[1]
    length = max(abs(across), abs(down))
    if length == 0 or not (across == 0 or down == 0 or abs(across) == abs(down)):
        return False
    dx, dy = across // length, down // length
    for k in range(length):
        here = (one[0] + k * dx, one[1] + k * dy)
        touched = [here, (here[0] + dx, here[1]), (here[0], here[1] + dy), (here[0] + dx, here[1] + dy)]
        if not all(_is_free(blocked, cell) for cell in touched):
            return False
    return True


def _is_free(blocked: Sequence[Sequence[bool]], cell: Cell) -> bool:
    x, y = cell
    return 0 <= y < len(blocked) and 0 <= x < len(blocked[0]) and not blocked[y][x]

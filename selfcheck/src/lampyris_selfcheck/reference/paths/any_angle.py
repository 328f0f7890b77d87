"""Straight lines on a small grid in fractions, and the shortest way of such lines by trying all pairs."""

from __future__ import annotations

import heapq
import math
from fractions import Fraction
from itertools import combinations

Cell = tuple[int, int]

HALF = Fraction(1, 2)


def inside_of(begin: Cell, end: Cell, square: Cell, half: Fraction) -> tuple[Fraction, Fraction] | None:
    """The part of a line, as fractions of it, within a closed square; None if it does not touch it."""
    first, last = Fraction(0), Fraction(1)
    for axis in (0, 1):
        d = end[axis] - begin[axis]
        low, high = square[axis] - half - begin[axis], square[axis] + half - begin[axis]
        if d == 0:
            if not low <= 0 <= high:
                return None
            continue
        a, b = sorted((Fraction(low) / d, Fraction(high) / d))
        first, last = max(first, a), min(last, b)
    return (first, last) if first <= last else None


def sees(blocked: set[Cell], begin: Cell, end: Cell, cutting: bool) -> bool:
    """Whether a point may go straight from cell to cell: it must not run through a blocked square, nor touch
    one unless corners may be cut. (No line between centres runs along a side.)
    """
    for square in blocked:
        part = inside_of(begin, end, square, HALF)
        if part is not None and (not cutting or part[0] < part[1]):
            return False
    return True


def clearance(blocked: set[Cell], begin: Cell, end: Cell) -> float:
    """Least distance between a line and the blocked squares, by trying 400 points of it."""
    least = math.inf
    for t in range(401):
        x = begin[0] + (end[0] - begin[0]) * t / 400
        y = begin[1] + (end[1] - begin[1]) * t / 400
        for bx, by in blocked:
            least = min(least, math.hypot(max(0.0, abs(x - bx) - 0.5), max(0.0, abs(y - by) - 0.5)))
    return least


def shortest(free: set[Cell], lines: set[tuple[Cell, Cell]], start: Cell) -> dict[Cell, float]:
    """Length of the shortest way of these lines from a cell to every other."""
    best = {start: 0.0}
    heap = [(0.0, start)]
    while heap:
        paid, here = heapq.heappop(heap)
        if paid > best[here]:
            continue
        for there in free:
            if (here, there) in lines:
                length = paid + math.dist(here, there)
                if length < best.get(there, math.inf):
                    best[there] = length
                    heapq.heappush(heap, (length, there))
    return best


def all_lines(free: set[Cell], blocked: set[Cell], cutting: bool) -> set[tuple[Cell, Cell]]:
    """Every pair of free cells that see each other, in both orders."""
    pairs = [(a, b) for a, b in combinations(sorted(free), 2) if sees(blocked, a, b, cutting)]
    return {*pairs, *((b, a) for a, b in pairs)}

"""Shortest paths in the plane by trying all pairs of corners, in fractions: the judge of the visibility graph."""

from __future__ import annotations

import heapq
import math
from collections.abc import Callable
from fractions import Fraction
from itertools import pairwise

Point = tuple[Fraction, Fraction]
Free = Callable[[int, int], bool]
HALF = Fraction(1, 2)


def _stops(a: Point, b: Point) -> list[Fraction]:
    """Where a line meets the lines of the grid, as fractions of it, with both ends."""
    found = {Fraction(0), Fraction(1)}
    for axis in (0, 1):
        d = b[axis] - a[axis]
        if d:
            low, high = sorted((a[axis], b[axis]))
            found |= {(Fraction(k) - a[axis]) / d for k in range(math.ceil(low), math.floor(high) + 1)}
    return sorted(found)


def _at(a: Point, b: Point, t: Fraction) -> Point:
    return a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])


def sees(
    a: Point, b: Point, free: Free, side: Callable[[Point], bool], shut: Callable[[int, int], bool]
) -> bool:
    """Whether the line runs through free squares and along free sides alone, and through no shut corner.

    ``free(c, r)``: the square from (c, r) to (c + 1, r + 1); ``side(p)``: the side that the point p lies on.
    """
    stops = _stops(a, b)
    for s, t in pairwise(stops):
        x, y = _at(a, b, (s + t) / 2)
        if x.denominator == 1 or y.denominator == 1:
            if not side((x, y)):
                return False
        elif not free(math.floor(x), math.floor(y)):
            return False
    return not any(
        p[0].denominator == p[1].denominator == 1 and shut(int(p[0]), int(p[1]))
        for p in (_at(a, b, t) for t in stops[1:-1])
    )


def _search(points: list[Point], start: Point, goal: Point, seen: Callable[[Point, Point], bool]) -> float:
    best, heap, done = {start: 0.0}, [(0.0, start)], set()
    while heap:
        paid, here = heapq.heappop(heap)
        if here == goal:
            return paid
        if here in done:
            continue
        done.add(here)
        for there in points:
            if there in done:
                continue
            length = paid + math.dist(here, there)
            if length < best.get(there, math.inf) and seen(here, there):
                best[there] = length
                heapq.heappush(heap, (length, there))
    return math.inf


def point_optimum(
    rows: list[list[bool]], start: tuple[int, int], goal: tuple[int, int], cutting: bool
) -> float:
    """Least length in the plane for a point between two cell centres, over all corners of all cells.

    ``rows``: whether each cell is free. Sides need one free square beside them. Where corners are not cut no path
    passes between two blocked squares that meet at a corner.
    """
    height, width = len(rows), len(rows[0])

    def free(c: int, r: int) -> bool:
        return 0 <= c < width and 0 <= r < height and rows[r][c]

    def side(p: Point) -> bool:
        c, r = math.floor(p[0]), math.floor(p[1])
        return free(c, r) or (free(c - 1, r) if p[0].denominator == 1 else free(c, r - 1))

    def shut(i: int, j: int) -> bool:
        a, b, c, d = free(i - 1, j - 1), free(i, j - 1), free(i - 1, j), free(i, j)
        return not cutting and ((a and d and not b and not c) or (b and c and not a and not d))

    ends = [(x + HALF, y + HALF) for x, y in (start, goal)]
    corners = [
        (Fraction(i), Fraction(j)) for i in range(width + 1) for j in range(height + 1) if not shut(i, j)
    ]
    return _search([*corners, *ends], ends[0], ends[1], lambda a, b: sees(a, b, free, side, shut))


def disc_optimum(rows: list[list[bool]], start: tuple[int, int], goal: tuple[int, int]) -> float:
    """The same for a disc, over all free cells: squares between four free centres, and rows and columns of them."""
    height, width = len(rows), len(rows[0])

    def centre(c: int, r: int) -> bool:
        return 0 <= c < width and 0 <= r < height and rows[r][c]

    def free(c: int, r: int) -> bool:
        return all(centre(c + i, r + j) for i in (0, 1) for j in (0, 1))

    def side(p: Point) -> bool:
        ends = {math.floor(p[0]), math.ceil(p[0])}, {math.floor(p[1]), math.ceil(p[1])}
        return all(centre(x, y) for x in ends[0] for y in ends[1])

    points = [(Fraction(x), Fraction(y)) for y in range(height) for x in range(width) if rows[y][x]]
    ends = [(Fraction(x), Fraction(y)) for x, y in (start, goal)]
    return _search(points, ends[0], ends[1], lambda a, b: sees(a, b, free, side, lambda i, j: False))

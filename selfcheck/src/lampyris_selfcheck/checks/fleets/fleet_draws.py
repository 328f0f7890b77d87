"""Drawn fleets: tiny ones that can be solved by brute force, a few robots, many, corridors, and full maps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lampyris.model.fleet.fleet import Agent, Fleet
from lampyris.model.grid import Grid
from lampyris.typing import BoolGrid
from lampyris_selfcheck.checks.paths import drawn_maps
from lampyris_selfcheck.reference.fleets.biconnected import is_biconnected
from lampyris_selfcheck.reference.fleets.fleet_rules import Cell, distances

STYLES = ("tiny", "few", "puzzle", "walls", "open", "tiny", "puzzle", "corridors", "full", "bay")
"""What fleets look like, by the last digit of their number."""
TREE_STYLES = ("tiny", "few", "dense", "few", "bay")
"""The same of searches of a constraint tree, by the number modulo five."""
TINY_CELLS = 7
"""Free cells of a tiny fleet at most: 210 configurations of three robots."""
MOST_ROBOTS = 40
FEW, DENSE = 4, 10
"""Robots of fleets of these styles at most; the least cost of few is looked for."""


@dataclass(frozen=True, eq=False)
class DrawnFleet:
    """A fleet and how it was drawn.

    Parameters
    ----------
    fleet : the fleet.
    style : of :data:`STYLES`.
    octile : whether the robots have octile moves.
    """

    fleet: Fleet
    style: str
    octile: bool = False

    @property
    def rows(self) -> list[list[bool]]:
        """The map's blocked cells as lists."""
        rows: list[list[bool]] = self.fleet.grid.blocked.tolist()
        return rows

    @property
    def moves(self) -> str:
        """The step set's name."""
        return "octile" if self.octile else "four-connected"

    @property
    def is_tiny(self) -> bool:
        """Whether brute force is possible."""
        return self.style in ("tiny", "puzzle")


def draw(rng: np.random.Generator, style: str) -> DrawnFleet:
    """A fleet of a style."""
    if style == "tiny":
        return DrawnFleet(_tiny(rng), style)
    if style == "puzzle":
        return DrawnFleet(_puzzle(rng), style)
    if style == "bay":
        return DrawnFleet(_bay(rng), style)
    low, high = {
        "few": (3, 7),
        "dense": (5, 9),
        "walls": (5, 17),
        "open": (3, 13),
        "corridors": (5, 13),
        "full": (2, 5),
    }[style]
    width, height = (int(n) for n in rng.integers(low, high, size=2))
    if style == "corridors":
        blocked = _tree(rng, width, height)
    elif style in ("few", "dense"):
        blocked = rng.random((height, width)) < 0.2 * rng.random()
    elif style == "open" or (style == "full" and rng.random() < 0.7):
        blocked = np.zeros((height, width), dtype=np.bool_)
    else:
        blocked = drawn_maps.walls(rng, width, height)
    region = _largest(blocked)
    if len(region) < 2:
        blocked = np.zeros((height, width), dtype=np.bool_)
        region = _largest(blocked)
    cells = len(region)
    shares = {"few": 3, "dense": 3, "walls": 4, "open": 2, "corridors": 5, "full": 1}
    most = min({"few": FEW, "dense": DENSE}.get(style, MOST_ROBOTS), cells // shares[style])
    least = {"full": cells - 3, "few": 2, "dense": FEW + 1}.get(style, 1)
    least = max(1, min(least, most))
    robots = int(rng.integers(least, max(least, most) + 1))
    return DrawnFleet(_placed(rng, blocked, region, robots), style)


def biconnected(rng: np.random.Generator, side: int, robots: int, *, dense: bool) -> Fleet:
    """A fleet on a map where neighbouring free cells lie on a common cycle; a robot fewer than cells at most.

    Dense ones have four fifths of that and more.
    """
    width, height = (int(n) for n in rng.integers(3, side + 1, size=2))
    blocked = np.zeros((height, width), dtype=np.bool_)
    for flat in rng.permutation(width * height)[: width * height // 5].tolist():
        y, x = divmod(flat, width)
        blocked[y, x] = True
        if not is_biconnected(blocked.tolist()):
            blocked[y, x] = False
    region = _largest(blocked)
    most = min(robots, len(region) - 1)
    return _placed(rng, blocked, region, int(rng.integers(max(1, 4 * most // 5) if dense else 1, most + 1)))


def _tiny(rng: np.random.Generator) -> Fleet:
    """One to three robots on a few cells, connected or not."""
    while True:
        width, height = (int(n) for n in rng.integers(1, 5, size=2))
        blocked = rng.random((height, width)) < 0.25 * rng.random()
        flat = np.flatnonzero(~blocked)
        if len(flat) > TINY_CELLS:
            blocked.flat[rng.permutation(flat)[TINY_CELLS:]] = True
        free = [(x, y) for y, x in np.argwhere(~blocked).tolist()]
        if len(free) >= 2:
            return _placed(rng, blocked, free, int(rng.integers(1, min(3, len(free)) + 1)))


def _puzzle(rng: np.random.Generator) -> Fleet:
    """Four robots, or a cell fewer, on five or six cells: mostly no robot can go to its goal at once."""
    while True:
        blocked = np.zeros((2, int(rng.integers(3, 5))), dtype=np.bool_)
        blocked.flat[rng.permutation(blocked.size)[: blocked.size - int(rng.integers(5, 7))]] = True
        region = _largest(blocked)
        if len(region) >= 5:
            break
    if rng.random() < 0.5:
        blocked, region = np.ascontiguousarray(blocked.T), [(y, x) for x, y in region]
    return _placed(rng, blocked, region, int(rng.integers(3, 5)))


def _bay(rng: np.random.Generator) -> Fleet:
    """Two robots that have to change places in a corridor with one bay."""
    length = int(rng.integers(4, 12))
    blocked = np.ones((2, length), dtype=np.bool_)
    blocked[0] = False
    blocked[1, int(rng.integers(1, length - 1))] = False
    ends = ((0, 0), (length - 1, 0))
    if rng.random() < 0.5:
        blocked, ends = np.ascontiguousarray(blocked.T), ((0, 0), (0, length - 1))
    return Fleet(Grid(blocked), [Agent(ends[0], ends[1]), Agent(ends[1], ends[0])])


def _tree(rng: np.random.Generator, width: int, height: int) -> BoolGrid:
    """Corridors one cell wide that branch, without cycles: cells are opened next to one open cell alone."""
    blocked = np.ones((height, width), dtype=np.bool_)
    blocked[height // 2, width // 2] = False
    for _ in range(4 * width * height):
        y, x = int(rng.integers(height)), int(rng.integers(width))
        around = ((x + 1, y), (x - 1, y), (x, y + 1), (x, y - 1))
        if blocked[y, x] and sum(
            not blocked[v, u] for u, v in around if 0 <= u < width and 0 <= v < height
        ) == 1:  # fmt: skip
            blocked[y, x] = False
    return blocked


def _largest(blocked: BoolGrid) -> list[Cell]:
    """The cells of the largest connected region."""
    rows, seen = blocked.tolist(), set()
    best: list[Cell] = []
    for y, x in np.argwhere(~blocked).tolist():
        if (x, y) not in seen:
            region = list(distances(rows, (x, y)))
            seen.update(region)
            best = max(best, region, key=len)
    return sorted(best)


def _placed(rng: np.random.Generator, blocked: BoolGrid, region: list[Cell], robots: int) -> Fleet:
    """Starts and goals at random."""
    starts, goals = (rng.permutation(len(region))[:robots].tolist() for _ in range(2))
    pairs = zip(starts, goals, strict=True)
    return Fleet(Grid(blocked), [Agent(region[a], region[b]) for a, b in pairs])

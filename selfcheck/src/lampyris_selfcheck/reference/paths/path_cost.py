"""Whether a walk is one, and what it costs, cell by cell from the definition: a judge of single answers.

Takes the steps and what each needs from :mod:`.search`; shares nothing with planners or referee.
"""

from __future__ import annotations

from functools import cache
from itertools import pairwise

from lampyris_selfcheck.reference.paths.search import Cell, Counts, needs, steps

PLAIN = 63
"""What plain ground weighs on a map with terrain."""

Rule = tuple[int, list[Cell]]


@cache
def rules(name: str, wide: bool) -> dict[Cell, Rule]:
    """Each step with its kind (0 straight, 1 diagonal, 2 knight's) and the cells it needs, from its start.

    ``wide``: a robot of some radius. It makes no knight's steps and cuts no corners.
    """
    found = {}
    for dx, dy in steps(name):
        kind = abs(dx * dy)
        if wide and kind == 2:
            continue
        through = needs(dx, dy, "octile" if wide and kind == 1 else name)
        found[dx, dy] = (kind, sorted(through))
    return found


def walked(free, cells: list[Cell], name: str, *, wide: bool = False, terrain=None) -> tuple[str, Counts]:
    """What is wrong with a walk (nothing: an empty word), and its counts; over terrain in 63rds.

    ``free[y][x]``: where the robot's centre may be. A way pays for each cell it enters.
    """
    height, width = len(free), len(free[0])
    counts = [0, 0, 0]
    for x, y in cells:
        if not (0 <= x < width and 0 <= y < height):
            return f"({x}, {y}) is outside", (0, 0, 0)
        if not free[y][x]:
            return f"({x}, {y}) is not free", (0, 0, 0)
    table = rules(name, wide)
    for (x, y), (u, v) in pairwise(cells):
        rule = table.get((u - x, v - y))
        if rule is None:
            return f"({x}, {y}) to ({u}, {v}) is no step", (0, 0, 0)
        kind, through = rule
        for a, b in through:
            if not free[y + b][x + a]:
                return f"({x}, {y}) to ({u}, {v}) needs ({x + a}, {y + b})", (0, 0, 0)
        counts[kind] += 1 if terrain is None else PLAIN + int(terrain[v][u])
    return "", (counts[0], counts[1], counts[2])

"""Whether the speeds of a trace can be driven: none while it waits, and no quicker gain than the law has.

From docs/speed/README.md alone: in SI units ``v^2`` rises by no more than ``2 a ds``, by the dissertation's
law v rises by no more than 20 units a straight step, 28 a diagonal one, 44 a knight's.
"""

from __future__ import annotations

import math

RISES = {1: 20.0, 2: 28.0, 5: 44.0}
"""By the square of a step's length, cells."""

ROUNDING = 1e-9


def gains(
    cells: list[tuple[int, int]], speed: list[float], law: str, a_max: float, resolution: float
) -> list[str]:
    """What is wrong with the speeds, one for each tick: of each tick the speed when its step is done."""
    wrong = []
    if speed[0] != 0.0:
        wrong.append(f"{speed[0]!r} at tick 0")
    for tick in range(1, len(cells)):
        (ax, ay), (bx, by) = cells[tick - 1], cells[tick]
        square = (bx - ax) ** 2 + (by - ay) ** 2
        before, now = speed[tick - 1], speed[tick]
        if square == 0:
            most = 0.0
        elif law == "dissertation":
            most = before + RISES[square]
        else:
            most = math.sqrt(before * before + 2 * a_max * math.sqrt(square) * resolution)
        if not 0.0 <= now <= most * (1 + ROUNDING):
            wrong.append(f"speed {now!r} at tick {tick}, after {before!r} no more than {most!r}")
    return wrong

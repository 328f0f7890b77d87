"""Nav2's inflation layer, cell by cell: obstacles spread to the four neighbours, the nearest first.

Written from the description of ``nav2_costmap_2d/plugins/inflation_layer.cpp``: bins of equal distance, in rising order;
a cell belongs to the obstacle that reaches it first, and its cost is that of its distance from that obstacle.
"""

from __future__ import annotations

import math
from collections import defaultdict, deque
from collections.abc import Sequence

FREE, INSCRIBED, LETHAL, UNKNOWN = 0, 253, 254, 255


def inflated_costs(
    costs: Sequence[Sequence[int]],
    resolution: float,
    inscribed_radius: float,
    inflation_radius: float,
    cost_scaling_factor: float,
) -> list[list[int]]:
    """The costmap after the layer, with its defaults for unknown cells."""
    height, width = len(costs), len(costs[0])
    reach = max(0, math.ceil(inflation_radius / resolution))
    made = [list(row) for row in costs]
    if reach == 0:
        return made
    bins: dict[int, deque[tuple[int, int, int, int]]] = defaultdict(deque)
    for y in range(height):
        for x in range(width):
            if costs[y][x] == LETHAL:
                bins[0].append((x, y, x, y))
    seen = set()
    while bins:
        level = min(bins)
        if not bins[level]:
            del bins[level]
            continue
        x, y, from_x, from_y = bins[level].popleft()
        if (x, y) in seen:
            continue
        seen.add((x, y))
        cost = _cost(math.hypot(x - from_x, y - from_y), resolution, inscribed_radius, cost_scaling_factor)
        if made[y][x] == UNKNOWN and cost >= INSCRIBED:
            made[y][x] = cost
        else:
            made[y][x] = max(made[y][x], cost)
        for to_x, to_y in ((x - 1, y), (x, y - 1), (x + 1, y), (x, y + 1)):
            if not (0 <= to_x < width and 0 <= to_y < height) or (to_x, to_y) in seen:
                continue
            if math.hypot(to_x - from_x, to_y - from_y) <= reach:
                squared = (to_x - from_x) ** 2 + (to_y - from_y) ** 2
                bins[squared].append((to_x, to_y, from_x, from_y))
    return made


def _cost(cells: float, resolution: float, inscribed_radius: float, factor: float) -> int:
    if cells == 0:
        return LETHAL
    metres = cells * resolution
    if metres <= inscribed_radius:
        return INSCRIBED
    return int((INSCRIBED - 1) * math.exp(-1.0 * factor * (metres - inscribed_radius)))

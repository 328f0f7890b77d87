"""Leaders of a robot swarm: neighbours within the decision range, roulette choice, decision ranges, groups."""

from __future__ import annotations

import math

from lampyris.kernels._helpers import stopped
from lampyris.kernels._jit import kernel
from lampyris.kernels.swarm.bins import fill_bins

_INF = math.inf


@kernel(inline=True, each=5_000)
def in_sight(ax, ay, bx, by, blocked, width, height, cell):
    """Whether the straight line between two points of the map passes no blocked cell.

    It goes from cell to cell; where the line passes a corner exactly it goes on diagonally.
    """
    x = min(max(int(ax / cell), 0), width - 1)
    y = min(max(int(ay / cell), 0), height - 1)
    last_x = min(max(int(bx / cell), 0), width - 1)
    last_y = min(max(int(by / cell), 0), height - 1)
    dx = bx - ax
    dy = by - ay
    step_x = 1 if dx > 0.0 else -1
    step_y = 1 if dy > 0.0 else -1
    # Shares of the line at which it enters the next column and the next row, and between two of them.
    next_x = ((x + (1 if dx > 0.0 else 0)) * cell - ax) / dx if dx != 0.0 else _INF
    next_y = ((y + (1 if dy > 0.0 else 0)) * cell - ay) / dy if dy != 0.0 else _INF
    each_x = cell / abs(dx) if dx != 0.0 else _INF
    each_y = cell / abs(dy) if dy != 0.0 else _INF
    left = abs(last_x - x) + abs(last_y - y)
    while left > 0:
        if next_x == next_y:
            x += step_x
            y += step_y
            next_x += each_x
            next_y += each_y
            left -= 2
        elif next_x < next_y:
            x += step_x
            next_x += each_x
            left -= 1
        else:
            y += step_y
            next_y += each_y
            left -= 1
        if x < 0 or y < 0 or x >= width or y >= height:
            return 1
        if blocked[y * width + x] != 0:
            return 0
    return 1


@kernel(each=300)
def root_of(parent, i):
    """The robot that stands for the group of robot i."""
    while parent[i] != i:
        i = parent[i]
    return i


@kernel(out=("ranges", "leader", "count", "group", "first", "member", "near", "weight"), each=60_000, of="x")
def choose_leaders(
    x, y, luciferin, draw, blocked, width, height, cell, sight, most, beta, wanted,
    side, columns, rows, ranges, leader, count, group, first, member, near, weight, halt,
):  # fmt: skip
    """Neighbours, leader, next decision range and group of every robot; returns the pairs that were looked at.

    Parameters
    ----------
    x, y : float64 (n,): metres from the upper left corner of the map, y down.
    luciferin, draw : float64 (n,): luciferin, and draws of the roulette, 0 <= u < 1.
    blocked, width, height, cell : the map, row by row, and metres a cell.
    sight : 1: robots behind a wall are not heard.
    most, beta, wanted : greatest range r_s, and how fast ranges adapt to how many neighbours.
    side, columns, rows : of the bins.
    ranges : in and out, float64 (n,): decision range r_d.
    leader : out, int64 (n,): -1: none.
    count : out, int64 (n,): neighbours: robots within the range that are brighter and heard.
    group : out, int64 (n,): the least number of the robots that are linked as neighbours, one to the next.
    first, member, near, weight : scratch.
    """
    n = len(x)
    fill_bins(x, y, side, columns, rows, first, member)
    for i in range(n):
        group[i] = i
    looked = 0
    for i in range(n):
        if i % 64 == 0 and stopped(halt):
            return looked
        radius = ranges[i]
        square = radius * radius
        low_x = min(max(int((x[i] - radius) / side), 0), columns - 1)
        high_x = min(max(int((x[i] + radius) / side), 0), columns - 1)
        low_y = min(max(int((y[i] - radius) / side), 0), rows - 1)
        high_y = min(max(int((y[i] + radius) / side), 0), rows - 1)
        found = 0
        total = 0.0
        own = luciferin[i]
        for row in range(low_y, high_y + 1):
            # The bins of a row lie one after the other.
            for k in range(first[row * columns + low_x], first[row * columns + high_x + 1]):
                looked += 1
                j = member[k]
                brighter = luciferin[j] - own
                if brighter <= 0.0:
                    continue
                dx = x[j] - x[i]
                dy = y[j] - y[i]
                if dx * dx + dy * dy >= square:
                    continue
                if sight != 0 and in_sight(x[i], y[i], x[j], y[j], blocked, width, height, cell) == 0:
                    continue
                total += brighter
                near[found] = j
                weight[found] = total
                found += 1
        leader[i] = -1
        count[i] = found
        if found > 0:
            threshold = draw[i] * total
            chosen = 0
            while chosen < found - 1 and weight[chosen] <= threshold:
                chosen += 1
            leader[i] = near[chosen]
            mine = root_of(group, i)
            for k in range(found):
                other = root_of(group, near[k])
                if other < mine:
                    group[mine] = other
                    mine = other
                elif mine < other:
                    group[other] = mine
            group[i] = mine
        ranges[i] = min(most, max(0.0, radius + beta * (wanted - found)))
    for i in range(n):
        group[i] = group[group[i]] if group[i] < i else i
    return looked

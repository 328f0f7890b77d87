"""What the tests of fleet drives share: places from the phases by their definition, and random fleets."""

from __future__ import annotations

import numpy as np

import lampyris
from lampyris.typing import Floats


def places(trace: lampyris.FleetTrace, times: Floats) -> Floats:
    """Where the robots are, (times, n, 2), phase by phase and nothing of the trace's or the referee's code."""
    made = np.repeat(trace.grid.to_metres(trace.starts)[None], len(times), axis=0)
    for k in range(len(trace.robot)):
        after = times >= trace.t[k]
        past = np.minimum(times[after] - trace.t[k], trace.duration[k])
        way = trace.v[k] * past + trace.a[k] * past**2 / 2
        made[after, trace.robot[k], 0] = trace.x[k] + way * trace.dx[k]
        made[after, trace.robot[k], 1] = trace.y[k] + way * trace.dy[k]
    return made


def least_gap(trace: lampyris.FleetTrace, step: float = 0.02) -> float:
    """The least distance between the centres of two robots at many moments, as a share of the sum of their radii."""
    xy = places(trace, np.arange(0.0, trace.duration_s + step, step))
    radius = np.array([one.radius for one in trace.robots])
    least = np.inf
    for i in range(len(radius)):
        for j in range(i):
            gap = np.sqrt(((xy[:, i] - xy[:, j]) ** 2).sum(axis=1)).min()
            least = min(least, float(gap / (radius[i] + radius[j])))
    return least


def ring(side: int = 2) -> tuple[lampyris.Fleet, lampyris.FleetPlan]:
    """Four robots on a square of cells that all move on by one at once: nobody can begin alone."""
    grid = lampyris.Grid(np.zeros((side, side), dtype=bool))
    cells = [(0, 0), (1, 0), (1, 1), (0, 1)]
    ends = cells[1:] + cells[:1]
    fleet = lampyris.Fleet(grid, [lampyris.Agent(a, b) for a, b in zip(cells, ends, strict=True)])
    paths = tuple(np.array([a, b]) for a, b in zip(cells, ends, strict=True))
    return fleet, lampyris.FleetPlan(lampyris.Status.FOUND, "pibt", paths)


def crossing() -> tuple[lampyris.Fleet, lampyris.FleetPlan]:
    """Two robots that pass one cell, the first from the left, the second from above a tick later."""
    grid = lampyris.Grid(np.zeros((5, 5), dtype=bool))
    fleet = lampyris.Fleet(grid, [lampyris.Agent((0, 2), (4, 2)), lampyris.Agent((2, 0), (2, 4))])
    first = np.array([(x, 2) for x in range(5)])
    second = np.array([(2, 0), (2, 0), *((2, y) for y in range(1, 5))])
    return fleet, lampyris.FleetPlan(lampyris.Status.FOUND, "cbs", (first, second))

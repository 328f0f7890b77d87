"""Swarms of robots: the same bytes again, no contact, and a referee that sees what is spoiled."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import combinations, pairwise
from typing import Any

import numpy as np

from lampyris.errors import InternalFault, SettingError
from lampyris.model.grid import Grid
from lampyris.model.settings.swarm import SwarmSettings
from lampyris.model.swarm.sources import AnySource, InverseSquare, Plume
from lampyris.model.swarm.swarm_trace import SwarmTrace
from lampyris.referee import check_swarm
from lampyris.referee.fleets.swarm import SwarmMotion
from lampyris.sim.swarm.simulation import RobotSwarm
from lampyris.swarms import drawn_sources, swarm_robots, three_peaks
from lampyris.typing import Floats
from lampyris_selfcheck.reference.fleets.discs import closest, wall_gap

CELL = 0.5
"""Metres."""
NEAR = 1e-7
"""Share of a radius by which a judgement may differ from the definition."""


def drawn_swarm(rng: np.random.Generator) -> tuple[Grid, tuple[AnySource, ...], int, dict[str, Any]] | None:
    """A map, sources, how many robots and settings; None where a draw has no room for sources."""
    width, height = (int(n) for n in rng.integers(8, 17, size=2))
    grid = Grid(rng.random((height, width)) < 0.2 * rng.random(), resolution=CELL)
    kind = int(rng.integers(3))
    try:
        sources: tuple[AnySource, ...] = (three_peaks(grid),)
        if kind:
            sources = drawn_sources(grid, int(rng.integers(1, 4)), seed=int(rng.integers(1000)))
    except SettingError:
        return None
    if kind == 2:
        sources = tuple(
            Plume(one.at, width=1.0, spread=0.1)
            if rng.random() < 0.5
            else InverseSquare(one.at, core=2.0, route=[(1.0, 1.0)], speed=0.05)
            for one in sources
            if isinstance(one, InverseSquare)
        )
    settings = {
        "method": "gradient" if rng.random() < 0.25 else "gso",
        "iterations": int(rng.integers(3, 9)),
        "noise": float(rng.choice([0.0, 0.0, 0.05])),
        "line_of_sight": bool(rng.random() < 0.8),
        "sensor_range": float(rng.choice([2.0, 4.0, 8.0])),
        "step": float(rng.choice([0.125, 0.4])),
    }
    return grid, sources, int(rng.integers(2, 13)), settings


def swarm_wrong(rng: np.random.Generator, seed: int) -> tuple[str, str]:
    """What is wrong of a simulation, and how it ended."""
    drawn = drawn_swarm(rng)
    if drawn is None:
        return "", "no room"
    grid, sources, robots, settings = drawn
    try:
        traces = [swarm_robots(grid, sources, robots, seed=seed, **settings) for _ in range(2)]
    except SettingError:
        return "", "no room"
    except InternalFault as error:
        return f"the referee: {error}", "refused"
    one, other = traces
    for name in ("xy", "readings", "luciferin", "ranges", "leaders", "neighbours", "groups", "held"):
        if getattr(one, name).tobytes() != getattr(other, name).tobytes():
            return f"{name} is not the same the second time", "different"
    found = check_swarm(one, every=True)
    if found is not None:
        return f"the referee: {found}", "refused"
    return _moved_wrong(one), one.status.value


def _moved_wrong(trace: SwarmTrace) -> str:
    """Contacts in all small steps, by the definition; the swarm is advanced again from the beginning of the trace."""
    grid, s = trace.grid, trace.settings
    radius = s.radius or 0.0
    size = grid.resolution
    starts = (grid.to_points(trace.xy[0, :, 0], trace.xy[0, :, 1]) + 0.5) * size
    swarm = RobotSwarm(grid, trace.sources, s, starts, trace.seed)
    rows = grid.blocked.tolist()
    for t in range(trace.iterations):
        path = [list(zip(swarm.x.tolist(), swarm.y.tolist(), strict=True))]
        made = swarm.advance()
        path += [
            list(zip(x, y, strict=True))
            for x, y in zip(made.path_x.tolist(), made.path_y.tolist(), strict=True)
        ]
        for before, after in pairwise(path):
            for i, j in combinations(range(trace.robots), 2):
                if closest(before[i], after[i], before[j], after[j]) < 2 * radius * (1 - NEAR):
                    return f"iteration {t}: robots {i} and {j} touch"
        for i in range(trace.robots):
            if wall_gap(path[0][i], path[-1][i], rows, size) < radius * (1 - NEAR) and _is_straight(path, i):
                return f"iteration {t}: robot {i} touches a wall"
    return ""


def _is_straight(path: list[list[tuple[float, float]]], i: int) -> bool:
    """Whether a robot drives in one line, so that where it begins and ends says where it was."""
    (x0, y0), (x1, y1) = path[0][i], path[-1][i]
    return all(abs((x1 - x0) * (p[i][1] - y0) - (y1 - y0) * (p[i][0] - x0)) < 1e-9 for p in path)


def _least_gap(begin: Floats, end: Floats, rows: list[list[bool]], radius: float) -> float:
    """The least distance between rims, and between a rim and a wall, of discs that drive straight."""
    a, b = ([(x, y) for x, y in one.tolist()] for one in (begin, end))
    gaps = [closest(a[i], b[i], a[j], b[j]) - 2 * radius for i, j in combinations(range(len(a)), 2)]
    return min([*gaps, *(wall_gap(p, q, rows, CELL) - radius for p, q in zip(a, b, strict=True))])


def _past_a_corner(rng: np.random.Generator, walls: Any) -> tuple[Floats, Floats, Floats]:
    """One disc that drives past a corner of a wall, nearest to it in the middle of its motion."""
    y, x = walls[int(rng.integers(len(walls)))].tolist()
    right, low = (int(v) for v in rng.integers(2, size=2))
    out = np.array([rng.random() * (2 * right - 1), rng.random() * (2 * low - 1)])
    out /= max(1e-9, float(np.sqrt((out * out).sum())))
    nearest = (np.array([x + right, y + low]) * CELL) + out * rng.uniform(0.06, 0.15)
    along = np.array([-out[1], out[0]])
    return (nearest - 0.095 * along)[np.newaxis], np.arctan2(along[1:], along[:1]), np.array([0.19])


def motion_wrong(rng: np.random.Generator) -> tuple[str, str]:
    """The judge of motions beside the definition, on discs that drive anywhere for one small step."""
    width, height = (int(n) for n in rng.integers(4, 8, size=2))
    grid = Grid(rng.random((height, width)) < 0.15, resolution=CELL)
    settings = SwarmSettings.of({"radius": 0.12, "step": 0.2, "small_step": 0.2}).on(grid)
    radius, rows = 0.12, grid.blocked.tolist()
    n = int(rng.integers(1, 5))
    for _ in range(50):  # what is apart at first, mostly
        begin = rng.random((n, 2)) * [width * CELL, height * CELL]
        if n > 1:
            begin[1] = begin[0] + rng.uniform(-0.35, 0.35, 2)
        if _least_gap(begin, begin, rows, radius) > 0:
            break
    angle, length = rng.uniform(0, 2 * np.pi, n), 0.2 * np.sqrt(rng.random(n))
    walls = np.argwhere(grid.blocked)
    if len(walls) and rng.random() < 0.4:
        begin, angle, length = _past_a_corner(rng, walls)
    end = begin + np.stack((np.cos(angle), np.sin(angle)), axis=1) * length[:, np.newaxis]
    least = _least_gap(begin, end, rows, radius)
    if abs(least) < 2e-3:  # too near for distances that are taken at some places
        return "", "on the edge"
    cells = np.stack((begin, end)) / CELL - 0.5
    verdict = SwarmMotion(grid, settings).see(grid.to_metres(cells))
    if (verdict is None) != (least > 0):
        return (
            f"the judge says {verdict}; the nearest are {least:.6f} m apart: {begin}, {end}, {rows}",
            "judged",
        )
    return "", "apart" if least > 0 else "in contact"


def _put(array: Any, index: Any, change: Callable[[Any], Any]) -> Any:
    made = array.copy()
    made[index] = change(made[index])
    return made


def _overlapping(t: SwarmTrace) -> dict[str, Any]:
    return {"xy": _put(t.xy, (slice(1, None), 0), lambda _: t.xy[1:, 1] + 0.01)}


def _walled(t: SwarmTrace) -> dict[str, Any]:
    return {"xy": _put(t.xy, (-1, 0), lambda _: t.grid.to_metres((-0.6, 0.0)))}


def _jumping(t: SwarmTrace) -> dict[str, Any]:
    return {"xy": _put(t.xy, -1, lambda old: np.roll(old, 1, axis=0))}


def _darker(t: SwarmTrace) -> dict[str, Any]:
    leaders = t.leaders.copy()
    k, i = np.argwhere(leaders >= 0)[0]
    leaders[k, i] = int(t.luciferin[k + 1].argmin())
    return {"leaders": leaders}


def _neighbour_more(t: SwarmTrace) -> dict[str, Any]:
    i = int(np.flatnonzero(t.neighbours[-1] > 0)[0])
    neighbours, ranges = t.neighbours.copy(), t.ranges.copy()
    neighbours[-1, i] += 1
    s = t.settings
    wide = t.ranges[-2, i] + (s.beta or 0.0) * (s.nt - neighbours[-1, i])
    ranges[-1, i] = min(max(wide, 0.0), s.sensor_range or 0.0)
    return {"neighbours": neighbours, "ranges": ranges}


SPOILED: dict[str, Callable[[SwarmTrace], dict[str, Any]]] = {
    "overlap": _overlapping,
    "beyond the edge": _walled,
    "robots that change places": _jumping,
    "a measurement": lambda t: {"readings": _put(t.readings, (1, 0), lambda old: old + 40.0)},
    "luciferin": lambda t: {"luciferin": _put(t.luciferin, (2, 0), lambda old: old + 1e-3)},
    "luciferin at first": lambda t: {"luciferin": _put(t.luciferin, (0, 0), lambda old: old + 1e-3)},
    "a range": lambda t: {"ranges": _put(t.ranges, (2, 0), lambda old: old + 1e-3)},
    "a leader that is darker": _darker,
    "no leaders": lambda t: {"leaders": np.full_like(t.leaders, -1)},
    "a neighbour more": _neighbour_more,
    "groups of one": lambda t: {"groups": np.broadcast_to(np.arange(t.robots), t.groups.shape).copy()},
    "a count of one more": lambda t: {"held": _put(t.held, (-1, 0), lambda old: old + 1)},
    "encounters": lambda t: {"encounters": t.robots * t.iterations + 1},
}
"""Traces that the referee must refuse; of traces in which robots follow each other."""


def trace_wrong(rng: np.random.Generator, seed: int) -> tuple[str, str]:
    """Whether the referee refuses a trace that was spoiled in the way of this number."""
    name = list(SPOILED)[seed // 2 % len(SPOILED)]
    grid = Grid(rng.random((12, 12)) < 0.1, resolution=CELL)
    trace = swarm_robots(grid, robots=8, seed=seed, iterations=4, noise=0.02)
    if not (trace.leaders[0] >= 0).any() or not (trace.neighbours[-1] > 0).any():
        return "", "nobody follows"
    if check_swarm(trace, every=True) is not None:
        return f"the referee refuses a trace: {check_swarm(trace, every=True)}", name
    if check_swarm(replace(trace, **SPOILED[name](trace)), every=True) is None:
        return f"the referee passes a trace with {name}", name
    return "", "spoiled"

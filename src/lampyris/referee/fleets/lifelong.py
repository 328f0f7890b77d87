"""Judges lifelong fleets: every step and every pair of robots, and that tasks were done in order."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from lampyris.model.fleet.lifelong import LifelongTrace
from lampyris.referee.verdict import Violation


def check_lifelong(trace: LifelongTrace) -> Violation | None:
    """The first rule that a trace breaks, or None.

    Rules: ``wall``, ``step`` (to one of four neighbours, or none), ``vertex``, ``swap``, ``fault`` (a robot that failed stays),
    ``task`` (assigned after its release to one robot that has no other, its stops visited one after the other, done with
    the last of them), ``throughput`` and ``utilisation`` (as counted again).
    """
    return _check_motion(trace) or _check_tasks(trace) or _check_figures(trace)


def _check_motion(trace: LifelongTrace) -> Violation | None:
    grid, xy = trace.grid, trace.xy.astype(np.int64)
    x, y = xy[..., 0], xy[..., 1]
    outside = (x < 0) | (y < 0) | (x >= grid.width) | (y >= grid.height)
    walls = outside | grid.blocked[np.clip(y, 0, grid.height - 1), np.clip(x, 0, grid.width - 1)]
    if walls.any():
        t, k = np.argwhere(walls)[0].tolist()
        return Violation(
            "wall", f"robot {k}, tick {t}", f"({x[t, k]}, {y[t, k]}) is blocked or outside the map"
        )
    length = np.abs(np.diff(x, axis=0)) + np.abs(np.diff(y, axis=0))
    if (length > 1).any():
        t, k = np.argwhere(length > 1)[0].tolist()
        return Violation("step", f"robot {k}, tick {t + 1}", f"goes {length[t, k]} cells in a tick")
    for k, when in trace.faults:
        if (xy[when:, k] != xy[min(when, trace.ticks), k]).any():
            return Violation("fault", f"robot {k}", f"moves after it failed at tick {when}")
    flat = y * grid.width + x
    for t in range(len(flat)):
        cells = flat[t].tolist()
        on = dict(zip(cells, range(len(cells)), strict=True))
        if len(on) < len(cells):
            k = next(k for k, cell in enumerate(cells) if on[cell] != k)
            return Violation(
                "vertex", f"robots {k} and {on[cells[k]]}, tick {t}", f"both in {tuple(xy[t, k].tolist())}"
            )
        if t == 0:
            continue
        before = flat[t - 1].tolist()
        was = dict(zip(before, range(len(before)), strict=True))
        for k, cell in enumerate(cells):
            other = was.get(cell, k)
            if other != k and cells[other] == before[k]:
                return Violation("swap", f"robots {k} and {other}, tick {t}", "change places")
    return None


def _check_tasks(trace: LifelongTrace) -> Violation | None:
    busy: dict[int, list[tuple[int, int, int]]] = {}
    for k, task in enumerate(trace.tasks):
        robot, assigned, done, stops = (
            int(trace.robot[k]),
            int(trace.assigned[k]),
            int(trace.done[k]),
            trace.stop_ticks[k],
        )
        where = f"task {k}"
        if (robot < 0) != (assigned < 0) or robot >= trace.robots or (robot < 0 and (done >= 0 or stops)):
            return Violation("task", where, "is done or assigned, but not by a robot")
        if robot < 0:
            continue
        if task.robot is not None and task.robot != robot:
            return Violation("task", where, f"is robot {task.robot}'s, but robot {robot} had it")
        if assigned < task.release or any(b < a for a, b in zip((assigned, *stops), stops, strict=False)):
            return Violation("task", where, "is assigned before its release, or stops are out of order")
        if len(stops) > len(task.stops) or (len(stops) == len(task.stops)) != (done >= 0):
            return Violation(
                "task", where, f"{len(stops)} of {len(task.stops)} stops visited, done at {done}"
            )
        if done >= 0 and done != stops[-1]:
            return Violation("task", where, f"done at {done}, but the last stop was visited at {stops[-1]}")
        for stop, tick in zip(task.stops, stops, strict=False):
            if tuple(trace.xy[tick, robot].tolist()) != stop:
                return Violation("task", where, f"robot {robot} is not on {stop} at tick {tick}")
        busy.setdefault(robot, []).append((assigned, done if done >= 0 else trace.ticks + 1, k))
    for robot, spans in busy.items():
        spans.sort()
        for (_, end, first), (begin, _, second) in pairwise(spans):
            if begin < end:
                return Violation("task", f"robot {robot}", f"has tasks {first} and {second} at once")
    return None


def _check_figures(trace: LifelongTrace) -> Violation | None:
    done = sum(1 for one in trace.done.tolist() if one >= 0)
    if trace.completed != done or abs(trace.throughput * max(1, trace.ticks) - done) > 1e-6:
        return Violation("throughput", "trace", f"{trace.completed} tasks done; counted: {done}")
    held = 0
    for assigned, ended in zip(trace.assigned.tolist(), trace.done.tolist(), strict=True):
        if assigned >= 0:
            held += (ended if ended >= 0 else trace.ticks) - assigned
    total = max(1, trace.ticks * trace.robots)
    if abs(trace.utilisation * total - held) > 1e-6 * total:
        return Violation("utilisation", "trace", f"{trace.utilisation:.6f}; counted: {held / total:.6f}")
    return None

"""Faults that a simulator could have, put into sound traces: each a function of a trace and draws.

None: this trace gives no occasion for it. What is put in is a fault by the rules alone; whether a judge sees
it is asked elsewhere.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Any, TypeAlias

import numpy as np

from lampyris.model.trace import Outcome, Trace
from lampyris.selfcheck.twins.quick_monitor import footprint
from lampyris.typing import Cell

Fault: TypeAlias = Callable[[Trace, np.random.Generator], Trace | None]


def _moving_ticks(trace: Trace) -> list[int]:
    """Ticks at which the robot has just made a step."""
    return (np.flatnonzero((trace.robot[1:] != trace.robot[:-1]).any(axis=1)) + 1).tolist()


def _pick(rng: np.random.Generator, some: list[Any]) -> Any:
    return some[int(rng.integers(len(some)))] if some else None


def _there(trace: Trace, before: int) -> list[int]:
    """Bodies that are on the map at a tick."""
    return [k for k, t0 in enumerate(trace.appears) if t0 <= before]


def _put(trace: Trace, k: int, **at: Cell) -> Trace:
    """Body k at other cells at some ticks; keys are ``t7``."""
    tracks = [track.copy() for track in trace.tracks]
    for word, cell in at.items():
        tracks[k][int(word[1:]) - trace.appears[k]] = cell
    return replace(trace, tracks=tuple(tracks))


def _cell(row: Any) -> Cell:
    return int(row[0]), int(row[1])


def _robot(trace: Trace, t: int, cell: Cell) -> Trace:
    robot = trace.robot.copy()
    robot[t] = cell
    return replace(trace, robot=robot)


def teleport(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """The robot leaves out two steps."""
    ticks = [
        t for t in _moving_ticks(trace)[:-3] if np.abs(trace.robot[t + 2] - trace.robot[t - 1]).max() > 2
    ]
    t = _pick(rng, ticks)
    if t is None:
        return None
    keep = np.r_[0:t, t + 2 : trace.ticks + 1]
    tracks = tuple(
        np.delete(track, [t - t0, t + 1 - t0], axis=0) if t0 < t else track[2:]
        for track, t0 in zip(trace.tracks, trace.appears, strict=True)
    )
    if any(t0 >= t for t0 in trace.appears):
        return None
    cause = tuple(trace.cause[k] for k in keep)
    return replace(
        trace,
        robot=trace.robot[keep],
        speed=trace.speed[keep],
        cause=cause,
        tracks=tracks,
        waits=cause.count("waiting"),
        events=tuple(e for e in trace.events if e.tick < len(keep)),
    )


def off_by_one(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """The robot is a cell beside where its path has it, at one tick."""
    t = _pick(rng, _moving_ticks(trace)[:-1])
    if t is None:
        return None
    x, y = _cell(trace.robot[t])
    dx, dy = _pick(rng, [(1, 0), (0, 1), (-1, 0), (0, -1)])
    return _robot(trace, t, (x + dx, y + dy))


def begins_elsewhere(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """Its first place is not the start."""
    x, y = trace.scene.start
    return _robot(trace, 0, (x + 1, y)) if trace.ticks > 1 else None


def into_a_body(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """A body and the robot in one cell."""
    t = _pick(rng, _moving_ticks(trace)[1:-1])
    k = None if t is None else _pick(rng, _there(trace, t))
    return None if k is None else _put(trace, k, **{f"t{t}": _cell(trace.robot[t])})


def two_in_one_cell(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """Two bodies in one cell."""
    t = int(rng.integers(trace.ticks + 1))
    there = _there(trace, t)
    if len(there) < 2:
        return None
    a, b = rng.permutation(there)[:2].tolist()
    return _put(trace, a, **{f"t{t}": _cell(trace.tracks[b][t - trace.appears[b]])})


def swap(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """A body and the robot change places."""
    t = _pick(rng, _moving_ticks(trace)[:-1])
    k = None if t is None else _pick(rng, _there(trace, t - 1))
    if k is None:
        return None
    old, new = _cell(trace.robot[t - 1]), _cell(trace.robot[t])
    return _put(trace, k, **{f"t{t - 1}": new, f"t{t}": old})


def two_swap(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """Two bodies change places."""
    t = int(rng.integers(1, trace.ticks + 1))
    steps = [k for k in _there(trace, t - 1) if (_at(trace, k, t) != _at(trace, k, t - 1))]
    if not steps or len(_there(trace, t - 1)) < 2:
        return None
    b = _pick(rng, steps)
    a = _pick(rng, [k for k in _there(trace, t - 1) if k != b])
    return _put(trace, a, **{f"t{t - 1}": _at(trace, b, t), f"t{t}": _at(trace, b, t - 1)})


def _at(trace: Trace, k: int, t: int) -> Cell:
    return _cell(trace.tracks[k][t - trace.appears[k]])


def cross(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """A body drives the other diagonal of the block whose one the robot drives."""
    askew = [t for t in _moving_ticks(trace) if np.abs(trace.robot[t] - trace.robot[t - 1]).min() > 0]
    t = _pick(rng, [t for t in askew if np.abs(trace.robot[t] - trace.robot[t - 1]).max() == 1])
    k = None if t is None else _pick(rng, _there(trace, t - 1))
    if k is None:
        return None
    (x0, y0), (x1, y1) = trace.robot[t - 1].tolist(), trace.robot[t].tolist()
    return _put(trace, k, **{f"t{t - 1}": (x0, y1), f"t{t}": (x1, y0)})


def two_cross(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """Two bodies drive the two diagonals of one block."""
    t = int(rng.integers(1, trace.ticks + 1))
    there = _there(trace, t - 1)
    askew = [
        b for b in there if all(p != q for p, q in zip(_at(trace, b, t), _at(trace, b, t - 1), strict=True))
    ]
    b = _pick(rng, askew)
    a = None if b is None else _pick(rng, [k for k in there if k != b])
    if a is None:
        return None
    (x0, y0), (x1, y1) = _at(trace, b, t - 1), _at(trace, b, t)
    return _put(trace, a, **{f"t{t - 1}": (x0, y1), f"t{t}": (x1, y0)})


def robot_in_a_wall(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """A wall where the robot drives."""
    inner = [
        t for t in _moving_ticks(trace) if _cell(trace.robot[t]) not in (trace.scene.start, trace.scene.goal)
    ]
    t = _pick(rng, inner)
    return None if t is None else _walled(trace, _cell(trace.robot[t]))


def body_in_a_wall(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """A wall where a body walks, and the robot never."""
    k = _pick(rng, _there(trace, trace.ticks))
    if k is None:
        return None
    driven = set(map(tuple, trace.robot.tolist()))
    cells = [c for c in map(_cell, trace.tracks[k]) if c not in driven and c != trace.scene.goal]
    cell = _pick(rng, cells)
    return None if cell is None else _walled(trace, cell)


def corner_cut(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """A wall beside a diagonal step of the robot, where nobody ever is."""
    if trace.scene.moves.corner_cutting:
        return None
    askew = [t for t in _moving_ticks(trace) if (np.abs(trace.robot[t] - trace.robot[t - 1]) == 1).all()]
    t = _pick(rng, askew)
    if t is None:
        return None
    side = int(trace.robot[t][0]), int(trace.robot[t - 1][1])
    taken = set(map(tuple, trace.robot.tolist())).union(*(map(tuple, k.tolist()) for k in trace.tracks))
    return None if side in taken or side == trace.scene.goal else _walled(trace, side)


def _walled(trace: Trace, cell: Cell) -> Trace:
    blocked = trace.scene.grid.blocked.copy()
    blocked[cell[1], cell[0]] = True
    scene = replace(trace.scene, grid=replace(trace.scene.grid, blocked=blocked))
    return replace(trace, scene=scene)


def body_jumps(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """A body goes several cells in a tick, to a free one that is nobody's."""
    t = int(rng.integers(1, trace.ticks + 1))
    k = _pick(rng, _there(trace, t - 1))
    if k is None:
        return None
    x, y = _at(trace, k, t - 1)
    taken = {_at(trace, b, t) for b in _there(trace, t)} | {_cell(trace.robot[t])}
    ys, xs = np.nonzero(~trace.scene.grid.blocked)
    far = [c for c in zip(xs.tolist(), ys.tolist(), strict=True) if max(abs(c[0] - x), abs(c[1] - y)) > 1]
    to = _pick(rng, [c for c in far if c not in taken])
    return None if to is None else _put(trace, k, **{f"t{t}": to})


def off_the_map(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """A body beyond the border."""
    t = int(rng.integers(trace.ticks + 1))
    k = _pick(rng, _there(trace, t))
    return None if k is None else _put(trace, k, **{f"t{t}": (-1, int(rng.integers(3)))})


def robot_radius_forgotten(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """The robot is larger than the simulator thought: it covers a body's cell at some tick."""
    return _larger(trace, -1)


def body_radius_forgotten(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """A body is larger than the simulator thought."""
    k = _pick(rng, _there(trace, trace.ticks))
    return None if k is None else _larger(trace, k)


def _larger(trace: Trace, k: int) -> Trace | None:
    """The robot (-1) or a body with the least radius that makes it cover another's cell while apart."""
    radius = 1.6 * trace.scene.grid.resolution
    offsets = set(map(_cell, footprint(radius, trace.scene.grid.resolution)))
    mine = trace.robot if k < 0 else trace.tracks[k]
    since = 0 if k < 0 else trace.appears[k]
    for t in range(since, trace.ticks):
        x, y = _cell(mine[t - since])
        others = [_at(trace, b, t) for b in _there(trace, t) if b != k]
        others += [] if k < 0 else [_cell(trace.robot[t])]
        if any((ox - x, oy - y) in offsets for ox, oy in others):
            break
    else:
        return None
    if k < 0:
        robot = replace(trace.scene.robot, radius=radius)
        return replace(trace, scene=replace(trace.scene, robot=robot))
    bodies = list(trace.bodies)
    bodies[k] = replace(bodies[k], radius=radius, footprint=tuple(sorted(offsets)))
    return replace(trace, bodies=tuple(bodies))


def wrong_arrival(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """It is told to have arrived, and the last step is missing."""
    if not trace.arrived or trace.ticks < 3 or (trace.robot[-1] == trace.robot[-2]).all():
        return None
    n = trace.ticks
    if any(t0 >= n for t0 in trace.appears) or trace.path is None:
        return None
    return replace(
        trace,
        robot=trace.robot[:n],
        speed=trace.speed[:n],
        cause=trace.cause[:n],
        tracks=tuple(track[:-1] for track in trace.tracks),
        events=tuple(e for e in trace.events if e.tick < n),
    )


def untold_arrival(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """It stands on the goal, and is told not to have arrived."""
    return replace(trace, outcome=Outcome.TIMEOUT) if trace.arrived and trace.ticks else None


def waits_miscounted(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """One wait more is told."""
    return replace(trace, waits=trace.waits + 1)


def impossible_speed(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """A speed below 0."""
    if trace.ticks < 2:
        return None
    speed = trace.speed.copy()
    speed[int(rng.integers(1, trace.ticks))] = -0.25
    return replace(trace, speed=speed)


def another_way_told(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """The way told is not the one driven: its last cell is left out."""
    if trace.path is None or len(trace.path.cells) < 3:
        return None
    return replace(trace, path=replace(trace.path, cells=trace.path.cells[:-1]))


def body_forgotten(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """A body's track ends a tick early."""
    k = _pick(rng, _there(trace, trace.ticks - 1))
    if k is None:
        return None
    tracks = list(trace.tracks)
    tracks[k] = tracks[k][:-1]
    return replace(trace, tracks=tuple(tracks))


FAULTS: Mapping[str, Fault] = MappingProxyType(
    {
        f.__name__.replace("_", " "): f
        for f in (
            *(teleport, off_by_one, begins_elsewhere, into_a_body, two_in_one_cell, swap, two_swap, cross),
            *(two_cross, robot_in_a_wall, body_in_a_wall, corner_cut, body_jumps, off_the_map),
            *(robot_radius_forgotten, body_radius_forgotten, wrong_arrival, untold_arrival),
            *(waits_miscounted, impossible_speed, another_way_told, body_forgotten),
        )
    }
)
"""Every fault by name."""

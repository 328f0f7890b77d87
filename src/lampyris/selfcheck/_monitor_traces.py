"""Faults of motion that a simulator could have, put into sound traces: each a function of a trace and draws.

None: this trace gives no occasion for it. A fault breaks one rule first: a body that is to meet another
appears where it can, and jumps nowhere; so a judge that has lost the rule has nothing else to see.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np

from lampyris.model.trace import Trace
from lampyris.model.traffic import Recorded
from lampyris.selfcheck.twins.quick_monitor import footprint
from lampyris.typing import Cell


def pick(rng: np.random.Generator, some: list[Any]) -> Any:
    """One of some, None of none."""
    return some[int(rng.integers(len(some)))] if some else None


def _moving_ticks(trace: Trace) -> list[int]:
    """Ticks at which the robot has just made a step."""
    return (np.flatnonzero((trace.robot[1:] != trace.robot[:-1]).any(axis=1)) + 1).tolist()


def _there(trace: Trace, before: int) -> list[int]:
    """Bodies that are on the map at a tick."""
    return [k for k, t0 in enumerate(trace.appears) if t0 <= before]


def _put(trace: Trace, k: int, t: int, cell: Cell) -> Trace:
    """Body k at another cell at one tick."""
    tracks = [track.copy() for track in trace.tracks]
    tracks[k][t - trace.appears[k]] = cell
    return replace(trace, tracks=tuple(tracks))


def _appearing(trace: Trace, k: int | None, since: int, *cells: Cell) -> Trace | None:
    """Body k appears only at a tick, walks these cells from there on, and stands on the last of them.

    None where a judge could see something before: a body or a wall on one of the cells, or edits, whose
    cells turn or not as bodies stand on them.
    """
    last = since + len(cells) - 1
    if k is None or trace.bodies[k].kind == "recorded" or trace.scene.edits or last >= trace.ticks:
        return None
    others = [b for b in range(len(trace.tracks)) if b != k]
    if any(trace.appears[b] > since for b in others):
        return None
    grid = trace.scene.grid
    for t, cell in enumerate(cells, since):
        x, y = cell
        over = [(x + dx, y + dy) for dx, dy in trace.bodies[k].footprint]
        free = grid.contains(cell) and not any(grid.contains(c) and grid.blocked[c[1], c[0]] for c in over)
        if not free or (t < last and cell in _taken(trace, t, k)):
            return None
    order = [*others, k]
    walked = np.array([*cells, *[cells[-1]] * (trace.ticks - last)])
    return replace(
        trace,
        bodies=tuple(trace.bodies[b] for b in order),
        appears=(*(trace.appears[b] for b in others), since),
        tracks=(*(trace.tracks[b] for b in others), walked),
    )


def _taken(trace: Trace, t: int, but: int) -> set[Cell]:
    """Cells on which the robot and the other bodies stand at a tick."""
    return {_at(trace, b, t) for b in _there(trace, t) if b != but} | {_cell(trace.robot[t])}


def _drawn(trace: Trace, rng: np.random.Generator, but: int = -1) -> int | None:
    """Some body that is not recorded."""
    some = [k for k, body in enumerate(trace.bodies) if body.kind != "recorded" and k != but]
    k: int | None = pick(rng, some)
    return k


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
    t = pick(rng, ticks)
    if t is None or trace.scene.edits:
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
    """The robot is a cell beside where its path has it, at one tick, by steps that it could make."""
    if trace.scene.edits:
        return None
    offsets, blocked = set(trace.scene.moves.offsets), trace.scene.grid.blocked
    far = _reach(trace) + 2
    ticks = set(_moving_ticks(trace))
    some = []
    for t in sorted(ticks & {t - 1 for t in ticks}):
        (x0, y0), (x, y), (x1, y1) = trace.robot[t - 1 : t + 2].tolist()
        near = [_at(trace, b, s) for s in (t - 1, t, t + 1) for b in _there(trace, s)]
        if blocked[max(y - far, 0) : y + far + 1, max(x - far, 0) : x + far + 1].any():
            continue
        if any(max(abs(bx - x), abs(by - y)) <= far + _body_reach(trace) for bx, by in near):
            continue
        for dx, dy in ((1, 0), (0, 1), (-1, 0), (0, -1)):
            u, v = x + dx, y + dy
            if {(u - x0, v - y0), (x1 - u, y1 - v)} <= offsets and trace.scene.grid.contains((u, v)):
                some.append((t, (u, v)))
    found = pick(rng, some)
    return None if found is None else _robot(trace, *found)


def _reach(trace: Trace) -> int:
    """Cells that the robot covers beyond its own, at most."""
    return int(np.abs(footprint(trace.scene.robot.radius, trace.scene.grid.resolution)).max())


def _body_reach(trace: Trace) -> int:
    """Cells that a body covers beyond its own, at most."""
    return max((max(map(abs, c)) for b in trace.bodies for c in b.footprint), default=0)


def is_small(trace: Trace) -> bool:
    """Whether the robot and all bodies cover a cell each."""
    return _reach(trace) == 0 and _body_reach(trace) == 0


def begins_elsewhere(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """Its first place is not the start."""
    x, y = trace.scene.start
    return _robot(trace, 0, (x + 1, y)) if trace.ticks > 1 else None


def into_a_body(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """A body and the robot in one cell."""
    t = pick(rng, _moving_ticks(trace)[1:-1])
    return None if t is None else _appearing(trace, _drawn(trace, rng), t, _cell(trace.robot[t]))


def two_in_one_cell(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """Two bodies in one cell."""
    t = int(rng.integers(trace.ticks + 1))
    b = pick(rng, _there(trace, t))
    return None if b is None else _appearing(trace, _drawn(trace, rng, b), t, _at(trace, b, t))


def swap(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """A body and the robot change places."""
    t = pick(rng, _short_steps(trace))
    if t is None:
        return None
    old, new = _cell(trace.robot[t - 1]), _cell(trace.robot[t])
    return _face_to_face(trace, _drawn(trace, rng), t, new, old)


def _short_steps(trace: Trace) -> list[int]:
    """Ticks at which the robot has just made a step to a neighbour, but for the last; nor was the one before
    it longer, for that would be over somebody who stands ahead.
    """
    long = np.append(0, np.abs(np.diff(trace.robot, axis=0)).max(axis=1, initial=0))
    return [t for t in _moving_ticks(trace)[:-1] if long[t] == 1 and long[t - 1] <= 1]


def _face_to_face(trace: Trace, k: int | None, t: int, old: Cell, new: Cell) -> Trace | None:
    """Body k goes from a cell to another in tick t, and both are free of all but whom it is to meet."""
    if k is None or new in _taken(trace, t, k):
        return None
    return _appearing(trace, k, t - 1, old, new)


def two_swap(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """Two bodies change places."""
    t, b = _walker(trace, rng)
    if b is None or _at(trace, b, t) == _at(trace, b, t - 1):
        return None
    return _face_to_face(trace, _drawn(trace, rng, b), t, _at(trace, b, t), _at(trace, b, t - 1))


def _walker(trace: Trace, rng: np.random.Generator) -> tuple[int, int | None]:
    """A tick, and a body that has just made a step; a diagonal one if there is one."""
    if trace.ticks < 1:
        return 1, None
    t = int(rng.integers(1, trace.ticks + 1))
    there = _there(trace, t - 1)
    steps = {k: np.abs(np.subtract(_at(trace, k, t), _at(trace, k, t - 1))).sum() for k in there}
    most = max(steps.values(), default=0)
    return t, pick(rng, [k for k, long in steps.items() if long == most > 0])


def _at(trace: Trace, k: int, t: int) -> Cell:
    return _cell(trace.tracks[k][t - trace.appears[k]])


def cross(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """A body drives the other diagonal of the block whose one the robot drives."""
    t = pick(rng, [t for t in _short_steps(trace) if np.abs(trace.robot[t] - trace.robot[t - 1]).min() > 0])
    if t is None:
        return None
    (x0, y0), (x1, y1) = trace.robot[t - 1].tolist(), trace.robot[t].tolist()
    return _face_to_face(trace, _drawn(trace, rng), t, (x0, y1), (x1, y0))


def two_cross(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """Two bodies drive the two diagonals of one block."""
    t, b = _walker(trace, rng)
    if b is None:
        return None
    (x0, y0), (x1, y1) = _at(trace, b, t - 1), _at(trace, b, t)
    if x0 == x1 or y0 == y1:
        return None
    return _face_to_face(trace, _drawn(trace, rng, b), t, (x0, y1), (x1, y0))


def robot_in_a_wall(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """A wall where the robot drives, and no body ever walks."""
    ends = (trace.scene.start, trace.scene.goal)
    inner = [c for c in (_cell(trace.robot[t]) for t in _moving_ticks(trace)) if c not in ends]
    return _walled(trace, pick(rng, [c for c in inner if c not in _walked(trace)]))


def _walked(trace: Trace) -> set[Cell]:
    """Cells on which some body ever stands."""
    return set().union(*(set(map(_cell, track)) for track in trace.tracks))


def body_in_a_wall(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """A wall where a body walks, and the robot never comes near."""
    k = pick(rng, _there(trace, trace.ticks))
    return None if k is None else _walled(trace, pick(rng, _apart(trace, map(_cell, trace.tracks[k]))))


def _apart(trace: Trace, cells: Iterable[Cell]) -> list[Cell]:
    """Those that the robot never covers nor drives by."""
    far = _reach(trace) + 1
    return [c for c in cells if np.abs(trace.robot - c).max(axis=1).min() > far and c != trace.scene.goal]


def corner_cut(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """A wall beside a diagonal step of the robot, where nobody ever is."""
    if trace.scene.moves.corner_cutting:
        return None
    t = pick(rng, [t for t in _short_steps(trace) if np.abs(trace.robot[t] - trace.robot[t - 1]).min() > 0])
    if t is None:
        return None
    (x0, y0), (x1, y1) = trace.robot[t - 1].tolist(), trace.robot[t].tolist()
    offsets = footprint(trace.scene.robot.radius, trace.scene.grid.resolution)
    covered = {_cell(c) for c in (trace.robot[:, None] + offsets).reshape(-1, 2)}
    beside = [(x + dx, y + dy) for x, y in ((x1, y0), (x0, y1)) for dx, dy in offsets.tolist()]
    taken = covered | _walked(trace) | {trace.scene.goal}
    return _walled(trace, pick(rng, [c for c in beside if c not in taken and trace.scene.grid.contains(c)]))


def body_corner_cut(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """A wall beside a diagonal step of a body, where nobody ever is."""
    t, k = _walker(trace, rng)
    if k is None or trace.scene.moves.corner_cutting or trace.bodies[k].kind == "recorded":
        return None
    (x0, y0), (x1, y1) = _at(trace, k, t - 1), _at(trace, k, t)
    if x0 == x1 or y0 == y1:
        return None
    return _walled(
        trace, pick(rng, [c for c in _apart(trace, ((x1, y0), (x0, y1))) if c not in _walked(trace)])
    )


def _walled(trace: Trace, cell: Cell | None) -> Trace | None:
    """The same with a wall there from the beginning; None at a cell that an edit turns."""
    if cell is None or any(cell in (*e.blocked, *e.freed) for e in trace.scene.edits):
        return None
    blocked = trace.scene.grid.blocked.copy()
    blocked[cell[1], cell[0]] = True
    scene = replace(trace.scene, grid=replace(trace.scene.grid, blocked=blocked))
    return replace(trace, scene=scene)


def body_jumps(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """A body goes several cells in a tick, to a free one that is nobody's."""
    t = int(rng.integers(1, trace.ticks + 1))
    k = pick(rng, _there(trace, t - 1))
    if k is None:
        return None
    x, y = _at(trace, k, t - 1)
    taken = {_at(trace, b, t) for b in _there(trace, t)} | {_cell(trace.robot[t])}
    ys, xs = np.nonzero(~trace.scene.grid.blocked)
    far = [c for c in zip(xs.tolist(), ys.tolist(), strict=True) if max(abs(c[0] - x), abs(c[1] - y)) > 1]
    to = pick(rng, [c for c in far if c not in taken])
    # Edits turn cells or not as bodies stand on them.
    return None if to is None or trace.scene.edits else _put(trace, k, t, to)


def off_the_map(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """A body beyond the border."""
    t = int(rng.integers(trace.ticks + 1))
    k = pick(rng, _there(trace, t))
    return None if k is None or trace.scene.edits else _put(trace, k, t, (-1, int(rng.integers(3))))


def robot_radius_forgotten(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """The robot is larger than the simulator thought: it covers a body's cell at some tick."""
    return _larger(trace, -1)


def body_radius_forgotten(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """A body is larger than the simulator thought."""
    k = pick(rng, _there(trace, trace.ticks))
    return None if k is None else _larger(trace, k)


def _larger(trace: Trace, k: int) -> Trace | None:
    """The robot (-1) or a body with the least radius that makes it cover another's cell while apart.

    On maps without walls alone: a larger disc would be in one.
    """
    if trace.scene.edits or trace.scene.grid.blocked.any():
        return None
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


# ---- what obstacles promise ----


def track_left(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """A recorded body is a cell beside its track."""
    k = pick(rng, [k for k, body in enumerate(trace.bodies) if body.kind == "recorded"])
    if k is None:
        return None
    t = int(rng.integers(trace.appears[k], trace.ticks + 1))
    x, y = _at(trace, k, t)
    return _put(trace, k, t, (x + 1, y))


def onto_the_robot(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """A body that yields comes to where the robot still stood."""
    t = pick(rng, _short_steps(trace))
    k = _drawn(trace, rng)
    if t is None or k is None or not trace.bodies[k].yields:
        return None
    return _appearing(trace, k, t, _cell(trace.robot[t - 1]))


def on_the_goal(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """A body stands on the goal, long before the robot comes."""
    t = int(rng.integers(trace.ticks // 2 + 1))
    return _appearing(trace, _drawn(trace, rng), t, trace.scene.goal)


def in_a_lane(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """A body stands in a recorded one's way."""
    lanes = [c for one in trace.scene.traffic if isinstance(one, Recorded) for c in one.track]
    k, late = _drawn(trace, rng), max(trace.appears, default=0)
    some = [c for c in lanes if late < trace.ticks and c not in _taken(trace, late, -1)]
    return _appearing(trace, k, late, pick(rng, some)) if some else None

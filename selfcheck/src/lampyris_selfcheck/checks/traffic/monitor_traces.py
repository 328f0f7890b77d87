"""Faults of motion that a simulator could have, put into sound traces: each a function of a trace and draws.

None: this trace gives no occasion for it. A fault breaks one rule first: a body that is to meet another
appears where it can, and jumps nowhere; so a judge that has lost the rule has nothing else to see.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from lampyris.model.trace import Trace
from lampyris.model.traffic import Recorded
from lampyris.typing import Cell
from lampyris_selfcheck.checks.traffic.monitor_places import (
    appearing,
    bodies_at,
    body_put,
    body_reach,
    cell_of,
    drawn,
    face_to_face,
    moving_ticks,
    pick,
    place,
    reach,
    robot_put,
    short_steps,
    taken,
    walker,
)
from lampyris_selfcheck.reference.motion.quick_monitor import footprint


def teleport(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """The robot leaves out two steps."""
    ticks = [t for t in moving_ticks(trace)[:-3] if np.abs(trace.robot[t + 2] - trace.robot[t - 1]).max() > 2]
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
    far = reach(trace) + 2
    ticks = set(moving_ticks(trace))
    some = []
    for t in sorted(ticks & {t - 1 for t in ticks}):
        (x0, y0), (x, y), (x1, y1) = trace.robot[t - 1 : t + 2].tolist()
        near = [place(trace, b, s) for s in (t - 1, t, t + 1) for b in bodies_at(trace, s)]
        if blocked[max(y - far, 0) : y + far + 1, max(x - far, 0) : x + far + 1].any():
            continue
        if any(max(abs(bx - x), abs(by - y)) <= far + body_reach(trace) for bx, by in near):
            continue
        for dx, dy in ((1, 0), (0, 1), (-1, 0), (0, -1)):
            u, v = x + dx, y + dy
            if {(u - x0, v - y0), (x1 - u, y1 - v)} <= offsets and trace.scene.grid.contains((u, v)):
                some.append((t, (u, v)))
    found = pick(rng, some)
    return None if found is None else robot_put(trace, *found)


def begins_elsewhere(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """Its first place is not the start."""
    x, y = trace.scene.start
    # Edits turn cells or not as the robot stands on them.
    return robot_put(trace, 0, (x + 1, y)) if trace.ticks > 1 and not trace.scene.edits else None


def into_a_body(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """A body and the robot in one cell."""
    t = pick(rng, moving_ticks(trace)[1:-1])
    return None if t is None else appearing(trace, drawn(trace, rng), t, cell_of(trace.robot[t]))


def two_in_one_cell(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """Two bodies in one cell."""
    t = int(rng.integers(trace.ticks + 1))
    b = pick(rng, bodies_at(trace, t))
    return None if b is None else appearing(trace, drawn(trace, rng, b), t, place(trace, b, t))


def swap(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """A body and the robot change places."""
    t = pick(rng, short_steps(trace))
    if t is None:
        return None
    old, new = cell_of(trace.robot[t - 1]), cell_of(trace.robot[t])
    return face_to_face(trace, drawn(trace, rng), t, new, old)


def two_swap(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """Two bodies change places."""
    t, b = walker(trace, rng)
    if b is None or place(trace, b, t) == place(trace, b, t - 1):
        return None
    return face_to_face(trace, drawn(trace, rng, b), t, place(trace, b, t), place(trace, b, t - 1))


def cross(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """A body drives the other diagonal of the block whose one the robot drives."""
    t = pick(rng, [t for t in short_steps(trace) if np.abs(trace.robot[t] - trace.robot[t - 1]).min() > 0])
    if t is None:
        return None
    (x0, y0), (x1, y1) = trace.robot[t - 1].tolist(), trace.robot[t].tolist()
    return face_to_face(trace, drawn(trace, rng), t, (x0, y1), (x1, y0))


def two_cross(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """Two bodies drive the two diagonals of one block."""
    t, b = walker(trace, rng)
    if b is None:
        return None
    (x0, y0), (x1, y1) = place(trace, b, t - 1), place(trace, b, t)
    if x0 == x1 or y0 == y1:
        return None
    return face_to_face(trace, drawn(trace, rng, b), t, (x0, y1), (x1, y0))


def robot_in_a_wall(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """A wall where the robot drives, and no body ever walks."""
    ends = (trace.scene.start, trace.scene.goal)
    inner = [c for c in (cell_of(trace.robot[t]) for t in moving_ticks(trace)) if c not in ends]
    return _walled(trace, pick(rng, [c for c in inner if c not in _walked(trace)]))


def _needed(trace: Trace) -> set[Cell]:
    """Cells that some body ever covers, or would cover beside a diagonal step."""
    needed: set[Cell] = set()
    for track, body in zip(trace.tracks, trace.obstacle_specs, strict=True):
        beside = (np.stack((track[1:, 0], track[:-1, 1]), 1), np.stack((track[:-1, 0], track[1:, 1]), 1))
        offsets = np.array(body.footprint)
        needed |= {cell_of(c) for c in (np.concatenate((track, *beside))[:, None] + offsets).reshape(-1, 2)}
    return needed


def _walked(trace: Trace) -> set[Cell]:
    """Cells on which some body ever stands."""
    return set().union(*(set(map(cell_of, track)) for track in trace.tracks))


def body_in_a_wall(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """A wall where a body walks, and the robot never comes near."""
    k = pick(rng, bodies_at(trace, trace.ticks))
    return None if k is None else _walled(trace, pick(rng, _apart(trace, map(cell_of, trace.tracks[k]))))


def _apart(trace: Trace, cells: Iterable[Cell]) -> list[Cell]:
    """Those that the robot never covers nor drives by."""
    far = reach(trace) + 1
    return [c for c in cells if np.abs(trace.robot - c).max(axis=1).min() > far and c != trace.scene.goal]


def corner_cut(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """A wall beside a diagonal step of the robot, where nobody ever is nor goes by on a diagonal."""
    if trace.scene.moves.corner_cutting:
        return None
    t = pick(rng, [t for t in short_steps(trace) if np.abs(trace.robot[t] - trace.robot[t - 1]).min() > 0])
    if t is None:
        return None
    (x0, y0), (x1, y1) = trace.robot[t - 1].tolist(), trace.robot[t].tolist()
    offsets = footprint(trace.scene.robot.radius, trace.scene.grid.resolution)
    covered = {cell_of(c) for c in (trace.robot[:, None] + offsets).reshape(-1, 2)}
    beside = [(x + dx, y + dy) for x, y in ((x1, y0), (x0, y1)) for dx, dy in offsets.tolist()]
    needed = covered | _needed(trace) | {trace.scene.goal}
    return _walled(trace, pick(rng, [c for c in beside if c not in needed and trace.scene.grid.contains(c)]))


def body_corner_cut(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """A wall beside a diagonal step of a body, where nobody ever is."""
    t, k = walker(trace, rng)
    if k is None or trace.scene.moves.corner_cutting or trace.obstacle_specs[k].kind == "recorded":
        return None
    (x0, y0), (x1, y1) = place(trace, k, t - 1), place(trace, k, t)
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
    if trace.ticks < 1:
        return None
    t = int(rng.integers(1, trace.ticks + 1))
    k = pick(rng, bodies_at(trace, t - 1))
    if k is None:
        return None
    x, y = place(trace, k, t - 1)
    others = taken(trace, t, -1)
    ys, xs = np.nonzero(~trace.scene.grid.blocked)
    far = [c for c in zip(xs.tolist(), ys.tolist(), strict=True) if max(abs(c[0] - x), abs(c[1] - y)) > 1]
    to = pick(rng, [c for c in far if c not in others])
    # Edits turn cells or not as bodies stand on them.
    return None if to is None or trace.scene.edits else body_put(trace, k, t, to)


def off_the_map(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """A body beyond the border."""
    t = int(rng.integers(trace.ticks + 1))
    k = pick(rng, bodies_at(trace, t))
    return None if k is None or trace.scene.edits else body_put(trace, k, t, (-1, int(rng.integers(3))))


def robot_radius_forgotten(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """The robot is larger than the simulator thought: it covers a body's cell at some tick."""
    return _larger(trace, -1)


def body_radius_forgotten(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """A body is larger than the simulator thought."""
    k = pick(rng, bodies_at(trace, trace.ticks))
    return None if k is None else _larger(trace, k)


def _larger(trace: Trace, k: int) -> Trace | None:
    """The robot (-1) or a body with the least radius that makes it cover another's cell while apart.

    On maps without walls alone: a larger disc would be in one.
    """
    if trace.scene.edits or trace.scene.grid.blocked.any():
        return None
    radius = 1.6 * trace.scene.grid.resolution
    offsets = set(map(cell_of, footprint(radius, trace.scene.grid.resolution)))
    mine = trace.robot if k < 0 else trace.tracks[k]
    since = 0 if k < 0 else trace.appears[k]
    for t in range(since, trace.ticks):
        x, y = cell_of(mine[t - since])
        others = [place(trace, b, t) for b in bodies_at(trace, t) if b != k]
        others += [] if k < 0 else [cell_of(trace.robot[t])]
        if any((ox - x, oy - y) in offsets for ox, oy in others):
            break
    else:
        return None
    if k < 0:
        robot = replace(trace.scene.robot, radius=radius)
        return replace(trace, scene=replace(trace.scene, robot=robot))
    bodies = list(trace.obstacle_specs)
    bodies[k] = replace(bodies[k], radius=radius, footprint=tuple(sorted(offsets)))
    return replace(trace, obstacle_specs=tuple(bodies))


# ---- what obstacles promise ----


def track_left(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """A recorded body is a cell beside its track."""
    k = pick(rng, [k for k, body in enumerate(trace.obstacle_specs) if body.kind == "recorded"])
    if k is None:
        return None
    t = int(rng.integers(trace.appears[k], trace.ticks + 1))
    x, y = place(trace, k, t)
    return body_put(trace, k, t, (x + 1, y))


def onto_the_robot(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """A body that yields comes to where the robot still stood."""
    t = pick(rng, short_steps(trace))
    k = drawn(trace, rng)
    if t is None or k is None or not trace.obstacle_specs[k].yields:
        return None
    return appearing(trace, k, t, cell_of(trace.robot[t - 1]))


def on_the_goal(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """A body stands on the goal, long before the robot comes."""
    t = int(rng.integers(trace.ticks // 2 + 1))
    return appearing(trace, drawn(trace, rng), t, trace.scene.goal)


def in_a_lane(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """A body stands in a recorded one's way."""
    lanes = [c for one in trace.scene.traffic if isinstance(one, Recorded) for c in one.track]
    k, late = drawn(trace, rng), max(trace.appears, default=0)
    some = [c for c in lanes if late < trace.ticks and c not in taken(trace, late, -1)]
    return appearing(trace, k, late, pick(rng, some)) if some else None

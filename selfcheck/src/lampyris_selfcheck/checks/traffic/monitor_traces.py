"""Faults that a simulator in ticks could have, put into sound traces: each a function of a trace and draws.

None: this trace gives no occasion for it. A fault may break other rules too: the monitor lists every breach and
must name this one; the referee, which stops at its first, must refuse. Each of the referee's rules by itself is
tested in ``tests/referee``.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, TypeAlias

import numpy as np

from lampyris.model.trace import Outcome, Trace
from lampyris.model.traffic import Recorded
from lampyris.typing import Cell
from lampyris_selfcheck.reference.motion.sim_monitor import disc

Put: TypeAlias = Callable[[Trace, np.random.Generator], Trace | None]


@dataclass(frozen=True)
class Fault:
    """A fault and who must see it.

    Parameters
    ----------
    put : puts it into a sound trace.
    words : a regular expression that a sentence of the monitor must match.
    referee : whether the referee has a rule against it.
    """

    put: Put
    words: str
    referee: bool = True


FAULTS: dict[str, Fault] = {}
"""Every fault by name."""


def fault(words: str, *, referee: bool = True) -> Callable[[Put], Put]:
    """Lists a function as a fault."""

    def listed(put: Put) -> Put:
        FAULTS[put.__name__.replace("_", " ")] = Fault(put, words, referee)
        return put

    return listed


# ---- reading and changing a trace --------------------


def _pick(rng: np.random.Generator, some: list[Any]) -> Any:
    return some[int(rng.integers(len(some)))] if some else None


def _tick(trace: Trace, rng: np.random.Generator) -> int:
    return int(rng.integers(1, trace.ticks + 1)) if trace.ticks else 0


def _cell(row: Any) -> Cell:
    return int(row[0]), int(row[1])


def _place(trace: Trace, k: int, t: int) -> Cell:
    return _cell(trace.tracks[k][t - trace.appears[k]])


def _body(trace: Trace, rng: np.random.Generator, t: int) -> int | None:
    """An obstacle that is on the map at a tick and the one before it, and is not recorded."""
    there = [k for k, t0 in enumerate(trace.appears) if t0 < t]
    k: int | None = _pick(rng, [k for k in there if trace.obstacle_specs[k].kind != "recorded"])
    return k


def _moved(trace: Trace, slanted: bool = False) -> list[int]:
    """Ticks at which the robot has just made a step to a neighbour, of those not to its side if so asked."""
    steps = np.abs(np.diff(trace.robot, axis=0))
    some = (steps.max(axis=1, initial=0) == 1) & ((steps.min(axis=1, initial=1) == 1) | (not slanted))
    return (np.flatnonzero(some) + 1).tolist()


def _robot_put(trace: Trace, t: int, cell: Cell) -> Trace:
    robot = trace.robot.copy()
    robot[t] = cell
    return replace(trace, robot=robot)


def _body_put(trace: Trace, k: int | None, t: int, *cells: Cell) -> Trace | None:
    """An obstacle at other cells from a tick on."""
    if k is None or not trace.appears[k] <= t <= trace.ticks + 1 - len(cells):
        return None
    tracks = [track.copy() for track in trace.tracks]
    tracks[k][t - trace.appears[k] : t - trace.appears[k] + len(cells)] = cells
    return replace(trace, tracks=tuple(tracks))


def _walled(trace: Trace, cell: Cell | None) -> Trace | None:
    """The same with a wall there from the beginning; None at a cell that an edit turns."""
    if cell is None or any(cell in (*e.blocked, *e.freed) for e in trace.scene.edits):
        return None
    blocked = trace.scene.grid.blocked.copy()
    blocked[cell[1], cell[0]] = True
    return replace(trace, scene=replace(trace.scene, grid=replace(trace.scene.grid, blocked=blocked)))


# ---- motion --------------------


@fault("the robot makes a step it does not have")
def teleport(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """The robot is for one tick three cells off."""
    t = _tick(trace, rng)
    x, y = trace.robot[t].tolist()
    return _robot_put(trace, t, (x + 3, y)) if t and x + 3 < trace.scene.grid.width else None


@fault("the path is not what was driven")
def off_by_one(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """The robot is a cell beside where its path has it, at one tick."""
    t = _pick(rng, _moved(trace))
    if t is None:
        return None
    x, y = trace.robot[t].tolist()
    return _robot_put(trace, t, (x, y - 1 if y else y + 1))


@fault("begin at the start")
def begins_elsewhere(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """Its first place is not the start."""
    x, y = trace.scene.start
    return _robot_put(trace, 0, (x + 1, y))


@fault(r": -1 and \d+ are in one cell")
def into_a_body(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """An obstacle and the robot in one cell, not at the end."""
    t = int(rng.integers(1, max(trace.ticks, 2)))
    return _body_put(trace, _body(trace, rng, t), t, _cell(trace.robot[min(t, trace.ticks)]))


@fault(r": \d+ and \d+ are in one cell")
def two_in_one_cell(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """Two obstacles in one cell."""
    t = _tick(trace, rng)
    k = _body(trace, rng, t)
    other = _pick(rng, [j for j, t0 in enumerate(trace.appears) if t0 < t and j != k])
    return None if other is None else _body_put(trace, k, t, _place(trace, other, t))


@fault(r": -1 and \d+ swap")
def swap(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """An obstacle and the robot change places."""
    t = _pick(rng, _moved(trace))
    if t is None:
        return None
    return _body_put(trace, _body(trace, rng, t), t - 1, _cell(trace.robot[t]), _cell(trace.robot[t - 1]))


@fault(r": -1 and \d+ cross")
def cross(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """An obstacle drives the other diagonal of the block whose one the robot drives."""
    t = _pick(rng, _moved(trace, slanted=True))
    if t is None:
        return None
    (x0, y0), (x1, y1) = trace.robot[t - 1].tolist(), trace.robot[t].tolist()
    return _body_put(trace, _body(trace, rng, t), t - 1, (x0, y1), (x1, y0))


@fault(r": \d+ and \d+ (swap|cross)")
def two_swap_or_cross(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """Two obstacles change places, or drive the two diagonals of one block."""
    t = _tick(trace, rng)
    k, other = _body(trace, rng, t), _body(trace, rng, t)
    if k is None or other is None or k == other:
        return None
    (x0, y0), (x1, y1) = _place(trace, other, t - 1), _place(trace, other, t)
    if (x0, y0) == (x1, y1):
        return None
    if x0 != x1 and y0 != y1:
        return _body_put(trace, k, t - 1, (x0, y1), (x1, y0))
    return _body_put(trace, k, t - 1, (x1, y1), (x0, y0))


@fault("-1 is in a wall")
def robot_in_a_wall(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """A wall where the robot drives."""
    ends = (trace.scene.start, trace.scene.goal)
    return _walled(trace, _pick(rng, [c for t in _moved(trace) if (c := _cell(trace.robot[t])) not in ends]))


@fault(r": \d+ is in a wall")
def body_in_a_wall(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """A wall where an obstacle stands, and the robot does not."""
    t = _tick(trace, rng)
    k = _body(trace, rng, t)
    driven = {*map(_cell, trace.robot), trace.scene.goal}
    return None if k is None or _place(trace, k, t) in driven else _walled(trace, _place(trace, k, t))


@fault("-1 cuts a corner")
def corner_cut(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """A wall beside a diagonal step of the robot."""
    t = None if trace.scene.moves.corner_cutting else _pick(rng, _moved(trace, slanted=True))
    if t is None:
        return None
    cell = int(trace.robot[t, 0]), int(trace.robot[t - 1, 1])
    return None if cell in {*map(_cell, trace.robot), trace.scene.goal} else _walled(trace, cell)


@fault(r": \d+ jumps")
def body_jumps(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """An obstacle goes several cells in a tick, to a free one."""
    t = _tick(trace, rng)
    k = _body(trace, rng, t)
    if k is None:
        return None
    x, y = _place(trace, k, t - 1)
    ys, xs = np.nonzero(~trace.scene.grid.blocked)
    far = [c for c in zip(xs.tolist(), ys.tolist(), strict=True) if max(abs(c[0] - x), abs(c[1] - y)) > 1]
    return _body_put(trace, k, t, _pick(rng, far)) if far else None


@fault(r": \d+ is off the map")
def off_the_map(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """An obstacle beyond the border."""
    t = _tick(trace, rng)
    return _body_put(trace, _body(trace, rng, t), t, (-1, int(rng.integers(3))))


@fault(" are in one cell")
def radius_forgotten(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """The robot is larger than the simulator thought: it covers an obstacle's cell at some tick."""
    radius = 1.6 * trace.scene.grid.resolution
    offsets = disc(radius, trace.scene.grid.resolution)
    for t in range(trace.ticks):
        x, y = _cell(trace.robot[t])
        there = [_place(trace, k, t) for k, t0 in enumerate(trace.appears) if t0 <= t]
        if any((ox - x, oy - y) in offsets for ox, oy in there):
            scene = replace(trace.scene, robot=replace(trace.scene.robot, radius=radius))
            return replace(trace, scene=scene)
    return None


# ---- what obstacles promise --------------------


@fault("leaves its track", referee=False)
def track_left(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """A recorded obstacle is a cell beside its track."""
    k = _pick(rng, [k for k, body in enumerate(trace.obstacle_specs) if body.kind == "recorded"])
    if k is None:
        return None
    t = int(rng.integers(trace.appears[k], trace.ticks + 1))
    x, y = _place(trace, k, t)
    return _body_put(trace, k, t, (x + 1, y))


@fault("moves onto the robot", referee=False)
def onto_the_robot(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """An obstacle that yields comes to where the robot still stood."""
    t = _pick(rng, _moved(trace))
    k = None if t is None else _body(trace, rng, t)
    if k is None or not trace.obstacle_specs[k].yields:
        return None
    return _body_put(trace, k, t, _cell(trace.robot[t - 1]))


@fault("stands on start or goal", referee=False)
def on_the_goal(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """An obstacle stands on the goal."""
    t = _tick(trace, rng)
    return _body_put(trace, _body(trace, rng, t), t, trace.scene.goal)


@fault("stands in a recorded lane", referee=False)
def in_a_lane(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """An obstacle stands where a recorded one comes by."""
    lanes = [c for one in trace.scene.traffic if isinstance(one, Recorded) for c in one.track]
    t = _tick(trace, rng)
    return _body_put(trace, _body(trace, rng, t), t, _pick(rng, lanes)) if lanes else None


# ---- what is reported --------------------


@fault("arrived and standing on the goal are not the same")
def arrival_not_reported(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """It stands on the goal, and is said not to have arrived."""
    return replace(trace, outcome=Outcome.TIMEOUT) if trace.arrived and trace.ticks else None


@fault("arrived and standing on the goal are not the same")
def arrival_invented(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """It is said to have arrived, and has not."""
    return None if trace.arrived else replace(trace, outcome=Outcome.ARRIVED)


@fault("waits reported")
def waits_miscounted(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """One wait more is reported."""
    return replace(trace, waits=trace.waits + 1)


@fault("waiting and not moving are not the same", referee=False)
def waiting_misreported(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """A tick at which the robot drives is reported as a wait; the count of waits is right."""
    t = _pick(rng, _moved(trace))
    return None if t is None else replace(trace, cause=(*trace.cause[:t], "waiting", *trace.cause[t + 1 :]))


@fault("a speed that cannot be")
def impossible_speed(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """A speed below 0."""
    speed = trace.speed.copy()
    speed[_tick(trace, rng)] = -0.25
    return replace(trace, speed=speed) if trace.ticks > 1 else None


@fault("not at rest at start and goal", referee=False)
def drives_on_at_the_goal(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """It arrives with a speed."""
    if not trace.arrived or not trace.ticks:
        return None
    return replace(trace, speed=np.append(trace.speed[:-1], 0.25))


@fault("the path is not what was driven")
def another_path_reported(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """The last cell of the path is left out."""
    if trace.path is None or len(trace.path.cells) < 3:
        return None
    return replace(trace, path=replace(trace.path, cells=trace.path.cells[:-1]))


@fault(r"track \d+ has \d+ cells")
def body_forgotten(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """An obstacle's track ends a tick early."""
    k = _pick(rng, [k for k, t0 in enumerate(trace.appears) if t0 < trace.ticks])
    if k is None:
        return None
    return replace(trace, tracks=(*trace.tracks[:k], trace.tracks[k][:-1], *trace.tracks[k + 1 :]))


@fault("are not one a tick")
def a_cause_too_many(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """More causes than ticks."""
    return replace(trace, cause=(*trace.cause, "law"))


@fault("a collision of the robot's own making")
def own_collision(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """It is said to have driven into an obstacle."""
    return None if trace.outcome is Outcome.HIT else replace(trace, outcome=Outcome.COLLISION)


@fault("not in order of appearance")
def out_of_order(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """The obstacle that appeared last stands first."""
    if len(trace.appears) < 2 or trace.appears[-1] == trace.appears[0]:
        return None
    order = [len(trace.appears) - 1, *range(len(trace.appears) - 1)]
    return replace(
        trace,
        obstacle_specs=tuple(trace.obstacle_specs[k] for k in order),
        appears=tuple(trace.appears[k] for k in order),
        tracks=tuple(trace.tracks[k] for k in order),
    )


@fault("at most 0 were asked for", referee=False)
def not_asked_for(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """Obstacles that the scene does not ask for."""
    if not trace.obstacle_specs or any(isinstance(one, Recorded) for one in trace.scene.traffic):
        return None
    return replace(trace, scene=replace(trace.scene, traffic=()))


@fault("turned .* reported")
def edit_not_reported(trace: Trace, rng: np.random.Generator) -> Trace | None:
    """Walls turned, and nothing reports it."""
    if not trace.edits:
        return None
    k = int(rng.integers(len(trace.edits)))
    return replace(trace, edits=trace.edits[:k] + trace.edits[k + 1 :])

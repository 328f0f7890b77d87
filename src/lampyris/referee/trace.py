"""Traces: the robot's drive, every obstacle's track, every pair at every tick, and the events reported of them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lampyris._core.arrays import any_true
from lampyris.model.trace import Outcome, Trace
from lampyris.referee.clashes import AgentTracks, ClashDetector
from lampyris.referee.geometry.shapes import Ints, disc_cells, first_overlap, slack, stands_free
from lampyris.referee.path import cost_violation, moves_violation, walk_violation
from lampyris.referee.simulations.edits import Era, edits_violation, eras_of, with_maps
from lampyris.referee.simulations.moving_goal import goal_violation
from lampyris.referee.simulations.plain_traffic import plainly_legal
from lampyris.referee.simulations.sensing import sensing_violation
from lampyris.referee.simulations.visits import trace_visits_violation
from lampyris.referee.verdict import Violation
from lampyris.typing import BoolGrid, Cell

TOP_SPEED = 80.0
"""The dissertation's maximum speed, velocity units (Table 3.1)."""

_NEVER_DROVE = (Outcome.NO_PATH, Outcome.START_OCCUPIED, Outcome.GOAL_OCCUPIED)


def check_trace(trace: Trace) -> Violation | None:
    """Whether a simulation broke a rule: walls, steps, any two obstacles at any tick, or what the trace reports.

    Rules, in this order: ``lengths``; ``edits`` (cells that turned otherwise than by the rule of
    :mod:`lampyris.referee.simulations.edits`); of the robot ``start``, ``outside``, ``wall``, ``step``, ``corner``,
    ``knight``, ``sweep``; of a robot with a sensor ``seen``, ``unseen`` (it stood beside a cell that it did not know) and
    ``sight`` (:mod:`lampyris.referee.simulations.sensing`); of a goal that moves ``goal``; of via points
    ``via``; of each obstacle ``appear``, ``footprint``, ``obstacle outside``, ``obstacle step``, ``obstacle wall``; of every
    two obstacles ``together``, ``swap``, ``cross``, ``through`` (a long step over an obstacle); then ``outcome``, ``path``,
    ``moves``, ``steps``, ``cost``, ``waits``, ``replans``, ``numbers``, ``events``, ``speed``.

    Walls are those of the tick: a step is judged by the map of the tick at which it ends.

    Two obstacles are together when their footprints share a cell: the own cell and every cell whose square is
    strictly nearer to the centre than the radius. The one thing allowed is the outcome ``hit``: at the last
    tick, an obstacle that does not yield has moved onto a robot that stood still.
    """
    broken = _lengths(trace)
    if broken is not None:
        return broken
    eras, codes = eras_of(trace), list[Ints]()
    plain = plainly_legal(trace) if len(eras) == 1 and trace.scene.moves.reach == 1 else None
    traffic = None if plain is not None and trace.outcome is not Outcome.HIT else _traffic(trace)
    driven = _driven(trace.robot) if plain is None else trace.robot[plain.driven]
    known = None if plain is None else plain.codes(trace)
    return (
        edits_violation(trace, eras)
        or _robot(trace, eras, driven, codes, known)
        or sensing_violation(trace)
        or goal_violation(trace)
        or trace_visits_violation(trace)
        or (
            None
            if plain is not None or traffic is None
            else _obstacles(trace, eras, traffic) or _pairs(trace, traffic)
        )
        or _outcome(trace, traffic)
        or _path_violation(trace, driven, codes)
        or _events(trace)
        or _speeds(trace)
    )


def _lengths(trace: Trace) -> Violation | None:
    n = len(trace.robot)
    if n == 0:
        return Violation("lengths", "trace", "the robot has no place at tick 0")
    for what, have in (("speeds", len(trace.speed)), ("causes", len(trace.cause))):
        if have != n:
            return Violation("lengths", "trace", f"{have} {what} for {n} ticks")
    if not len(trace.tracks) == len(trace.appears) == len(trace.obstacle_specs):
        counts = f"{len(trace.tracks)} tracks, {len(trace.appears)} appearances, {len(trace.obstacle_specs)} obstacles"
        return Violation("lengths", "trace", counts)
    if not any(trace.appears) and all(len(track) == n for track in trace.tracks):
        return None
    before = 0
    for k, (track, t0) in enumerate(zip(trace.tracks, trace.appears, strict=True)):
        if not before <= t0 <= trace.ticks:
            return Violation(
                "appear", f"obstacle {k}", f"appears at tick {t0}, after one at {before}, of {trace.ticks}"
            )
        if len(track) != n - t0:
            return Violation(
                "lengths", f"obstacle {k}", f"{len(track)} places from tick {t0} on, {n - t0} ticks are left"
            )
        before = t0
    return None


def _driven(cells: NDArray[np.int32]) -> NDArray[np.int32]:
    """The robot's cells without repeats."""
    new = np.ones(len(cells), dtype=np.bool_)
    new[1:] = (cells[1:, 0] != cells[:-1, 0]) | (cells[1:, 1] != cells[:-1, 1])
    return cells[new]


def _leaves(cells: NDArray[np.int32]) -> list[int]:
    """The tick, from the first, at which the robot left each of its cells without repeats."""
    moved = (cells[1:, 0] != cells[:-1, 0]) | (cells[1:, 1] != cells[:-1, 1])
    return [*np.flatnonzero(moved).tolist(), len(cells) - 1]


def _robot(
    trace: Trace, eras: list[Era], driven: NDArray[np.int32], codes: list[Ints], known: Ints | None
) -> Violation | None:
    """The robot alone, whose cells without repeats are ``driven``; ``codes`` is filled with those of its steps, era by era,
    if it drove; ``known``: these, where all steps are known to be legal."""
    scene = trace.scene
    first = (int(trace.robot[0, 0]), int(trace.robot[0, 1]))
    if first != scene.start:
        return Violation("start", "tick 0", f"the robot is at {first}; the start is {scene.start}")
    if trace.outcome is Outcome.START_OCCUPIED:
        return None if len(driven) == 1 else Violation("outcome", "trace", "drove from an occupied start")
    if known is not None:
        codes.append(known)
        return None
    for era, grid in with_maps(eras, scene.grid):
        # The step into an era is made on its map, from a cell that cannot have turned into a wall.
        there = trace.robot[era.since : era.last + 1]
        cells = driven if len(eras) == 1 else _driven(there)
        fault, code = walk_violation(cells, grid, scene.robot, scene.moves)
        codes.append(code)
        if fault is not None:
            tick = era.since + _leaves(there)[fault.index]
            return Violation(fault.rule, f"robot after tick {tick}", fault.sentence)
    return None


def _obstacles(trace: Trace, eras: list[Era], traffic: AgentTracks) -> Violation | None:
    """Each obstacle alone: its size, its steps, the walls."""
    grid = trace.scene.grid
    good: set[tuple[float, tuple[Cell, ...]]] = set()
    for k, obstacle in enumerate(trace.obstacle_specs):
        if (obstacle.radius, obstacle.footprint) in good:
            continue
        inner = set(map(tuple, disc_cells(obstacle.radius, grid.resolution).tolist()))
        stated = set(obstacle.footprint)
        if stated != inner:
            outer = set(
                map(tuple, disc_cells(obstacle.radius + 2 * slack(obstacle.radius), grid.resolution).tolist())
            )
            if not inner <= stated <= outer:
                what = f"covers {len(stated)} cells, a disc of {obstacle.radius:g} m covers {len(inner)}"
                return Violation("footprint", f"obstacle {k}", what)
        good.add((obstacle.radius, obstacle.footprint))
    at, there = traffic.at[:, 1:], traffic.there[:, 1:]
    x, y = at[..., 0], at[..., 1]
    outside = there & ((x < 0) | (x >= grid.width) | (y < 0) | (y >= grid.height))
    if outside.any():
        return _body("obstacle outside", outside, at, f"outside the map, {grid.width} x {grid.height}")
    far = (np.abs(at[1:] - at[:-1]).max(axis=2, initial=0) > 1) & there[:-1]
    if far.any():
        return _body("obstacle step", far, at, "more than one cell from where it is a tick later")
    found = (_walled(traffic, era, ground.blocked) for era, ground in with_maps(eras, grid))
    return next((broken for broken in found if broken is not None), None)


def _walled(traffic: AgentTracks, era: Era, blocked: BoolGrid) -> Violation | None:
    """The first obstacle in a wall during an era."""
    ticks = slice(era.first, era.last + 1)
    at, there = traffic.at[ticks, 1:], traffic.there[ticks, 1:]
    x, y = at[..., 0], at[..., 1]
    wall = there & blocked[np.where(there, y, 0), np.where(there, x, 0)]
    if wall.any():
        return _body("obstacle wall", wall, at, "in a wall", era.first)
    for k, offsets in enumerate(traffic.covers[1:]):
        if len(offsets) > 1:
            t = np.flatnonzero(there[:, k])
            hit = first_overlap(blocked, x[t, k], y[t, k], offsets)
            if hit is not None:
                wall[t[hit[0]], k] = True
                return _body("obstacle wall", wall, at, f"over the wall at ({hit[1]}, {hit[2]})", era.first)
    return None


def _body(rule: str, bad: NDArray[np.bool_], at: Ints, what: str, since: int = 0) -> Violation:
    t, k = (int(v) for v in np.unravel_index(int(bad.argmax()), bad.shape))
    return Violation(rule, f"obstacle {k} at tick {since + t}", f"({at[t, k, 0]}, {at[t, k, 1]}) is {what}")


def _traffic(trace: Trace) -> AgentTracks:
    """The robot and all obstacles in one array; the robot is number 0."""
    n, count = len(trace.robot), len(trace.tracks)
    at = np.zeros((n, count + 1, 2), dtype=np.int64)
    there = np.zeros((n, count + 1), dtype=np.bool_)
    at[:, 0], there[:, 0] = trace.robot, True
    if count and not any(trace.appears):
        at[:, 1:], there[:, 1:] = np.array(trace.tracks).transpose(1, 0, 2), True
    else:
        for k, (track, t0) in enumerate(zip(trace.tracks, trace.appears, strict=True)):
            at[t0:, k + 1], there[t0:, k + 1] = track, True
            at[:t0, k + 1] = track[0]
    res = trace.scene.grid.resolution
    radii = (trace.scene.robot.radius, *(b.radius for b in trace.obstacle_specs))
    # A disc that reaches into no other cell covers one, whatever its radius: let all of those be one group.
    sizes = {r: disc_cells(r if r > res / 2 else 0.0, res) for r in radii}
    covers = [sizes[r] for r in radii]
    return AgentTracks(at, there, covers)


def _pairs(trace: Trace, traffic: AgentTracks) -> Violation | None:
    grid = trace.scene.grid
    judge = ClashDetector(traffic, grid.width, grid.height, _hits(trace))
    clash = judge.first()
    over = _through(trace, judge) if trace.scene.moves.reach > 1 else None
    if clash is None or (over is not None and over[0] < clash.tick):
        return None if over is None else over[1]
    what = {
        "together": "cover one cell,",
        "swap": "change places at",
        "cross": "cross each other's diagonal beside",
    }[clash.rule]
    one = _name(clash.one)
    sentence = f"{one} and {_name(clash.other)} {what} ({clash.cell[0]}, {clash.cell[1]})"
    return Violation(clash.rule, f"tick {clash.tick}", sentence)


def _name(obstacle: int) -> str:
    return "the robot" if obstacle == 0 else f"obstacle {obstacle - 1}"


def _hits(trace: Trace) -> frozenset[int]:
    """Obstacles (1 is the first) that may lie on a robot that stood still: unyielding, and they moved."""
    if trace.outcome is not Outcome.HIT or trace.ticks == 0:
        return frozenset()
    if (trace.robot[-1] != trace.robot[-2]).any():
        return frozenset()
    return frozenset(
        k + 1
        for k, (track, obstacle) in enumerate(zip(trace.tracks, trace.obstacle_specs, strict=True))
        if not obstacle.yields and len(track) > 1 and (track[-1] != track[-2]).any()
    )


def _through(trace: Trace, judge: ClashDetector) -> tuple[int, Violation] | None:
    """The first long step over a cell that some obstacle covers before or after it: tick and violation."""
    d = np.diff(trace.robot.astype(np.int64), axis=0)
    for t in np.flatnonzero(np.abs(d).max(axis=1, initial=0) > 1).tolist():
        dx, dy = (int(v) for v in d[t])
        sx, sy = (dx > 0) - (dx < 0), (dy > 0) - (dy < 0)
        passed = ((sx, 0) if abs(dx) == 2 else (0, sy), (sx, sy))
        x, y = (int(v) for v in trace.robot[t])
        for tick in (t, t + 1):
            taken = judge.covered(tick)
            for px, py in passed:
                for ox, oy in judge.traffic.covers[0].tolist():
                    obstacle = taken.get((x + px + ox, y + py + oy))
                    if obstacle is not None:
                        what = f"the robot drives over {_name(obstacle)} at ({x + px + ox}, {y + py + oy})"
                        return t + 1, Violation("through", f"tick {t + 1}", what)
    return None


def _outcome(trace: Trace, traffic: AgentTracks | None) -> Violation | None:
    scene = trace.scene
    last = (int(trace.robot[-1, 0]), int(trace.robot[-1, 1]))
    word = trace.outcome.value
    if trace.outcome is Outcome.COLLISION:
        return Violation("outcome", "trace", "the robot made a collision; it never may")
    if trace.outcome in (Outcome.START_OCCUPIED, Outcome.GOAL_OCCUPIED):
        end = scene.start if trace.outcome is Outcome.START_OCCUPIED else scene.goal
        if stands_free(scene.grid, end, scene.robot.radius):
            return Violation("outcome", "trace", f"{word}, but the robot can stand on {end}")
        return None
    goal = trace.goal_at(trace.ticks)
    visited = len(trace.via_ticks) == len(trace.via)
    if trace.arrived != (last == goal and visited):
        return Violation("outcome", "trace", f"{word}, and the robot ends on {last}; the goal is {goal}")
    if trace.outcome is Outcome.HIT:
        hits = _hits(trace)
        assert traffic is not None
        covers = traffic.covers
        mine = {(last[0] + dx, last[1] + dy) for dx, dy in covers[0].tolist()}
        for k in hits:
            x, y = (int(v) for v in trace.tracks[k - 1][-1])
            if any((x + dx, y + dy) in mine for dx, dy in covers[k].tolist()):
                return None
        return Violation(
            "outcome", "trace", "hit, but no obstacle that does not yield ran into the standing robot"
        )
    return None


def _path_violation(trace: Trace, cells: NDArray[np.int32], codes: list[Ints]) -> Violation | None:
    """The path really driven, its cost, and how often the robot waited.

    It costs by the ground of the map as given: a wall that comes and goes leaves it as it was.
    """
    waited = len(trace.robot) - len(cells)
    if trace.path is None:
        if trace.outcome not in _NEVER_DROVE or len(cells) > 1:
            return Violation("path", "trace", f"{trace.outcome.value} without the path driven")
    else:
        if trace.path.cells.shape != cells.shape or any_true(trace.path.cells != cells):
            return Violation("path", "trace", "the stated path is not the robot's cells without repeats")
        moves, grid = trace.scene.moves, trace.scene.grid
        broken = moves_violation(trace.path.moves, moves, grid)
        if broken is None and trace.outcome is not Outcome.START_OCCUPIED:
            code = codes[0] if len(codes) == 1 else np.concatenate(codes)
            broken = cost_violation(trace.path, moves, code, grid)
        if broken is not None:
            return broken
    if trace.waits != waited:
        return Violation(
            "waits", "trace", f"claims {trace.waits} waits; the robot stood still {waited} times"
        )
    reported = sum(event.word in ("replan", "gate") for event in trace.events)
    if trace.replans != reported:
        return Violation("replans", "trace", f"claims {trace.replans} replans; {reported} are reported")
    if min(trace.iterations, trace.expansions) < 0:
        return Violation("numbers", "trace", f"{trace.iterations} iterations, {trace.expansions} expansions")
    return None


def _events(trace: Trace) -> Violation | None:
    before = 0
    for k, event in enumerate(trace.events):
        if not before <= event.tick <= trace.ticks:
            what = f"{event.word!r} at tick {event.tick}, after one at {before}, of {trace.ticks}"
            return Violation("events", f"event {k}", what)
        if not trace.scene.grid.contains(event.cell):
            return Violation("events", f"event {k}", f"{event.word!r} at {event.cell}, outside the map")
        before = event.tick
    return None


def _speeds(trace: Trace) -> Violation | None:
    v = trace.speed
    limit = TOP_SPEED if trace.law == "dissertation" else trace.scene.robot.v_max
    bad = ~((v >= 0) & (v <= limit * (1 + 1e-9)))
    if any_true(bad):
        t = int(bad.argmax())
        return Violation("speed", f"tick {t}", f"{float(v[t])!r} {trace.units}; allowed 0 to {limit:g}")
    return None

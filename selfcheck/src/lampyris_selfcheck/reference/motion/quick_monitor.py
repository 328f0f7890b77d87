"""A quick monitor of simulations: the rules of :mod:`.sim_monitor` over whole traces, as arrays.

It shares no code with the simulator, the referee or the slow monitor. Two bodies meet where the difference
of their places is one of a table made from their exact footprints; bodies of one cell are told apart by
numbers of cells, of steps and of the middles of diagonal steps. The slow monitor looks at a share of the
same traces.
"""

from __future__ import annotations

from collections.abc import Iterator
from decimal import Decimal
from functools import lru_cache
from itertools import combinations_with_replacement
from math import isqrt
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from lampyris.model.trace import Outcome, Trace
from lampyris.model.traffic import Recorded

Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

_PAIR_TICKS = 400_000
"""Pairs times ticks looked at at once."""


@lru_cache(maxsize=256)
def footprint(radius: float, resolution: float) -> Ints:
    """Cells that a disc covers, as offsets, (n, 2); in order.

    In whole numbers, row by row: a square comes within r = p / q cells of the centre where its nearest
    point, in half cells (gx, gy), keeps q^2 (gx^2 + gy^2) < 4 p^2.
    """
    (a, b), (c, d) = (Decimal(str(v)).as_integer_ratio() for v in (radius, resolution))
    p, q = a * d, b * c
    cells = {(0, 0)}
    for dy in range(p // q + 2):
        left = 4 * p * p - (max(2 * dy - 1, 0) * q) ** 2
        if left > 0:
            wide = (isqrt((left - 1) // (q * q)) + 1) // 2
            cells |= {(dx, side) for dx in range(-wide, wide + 1) for side in (dy, -dy)}
    return np.array(sorted(cells), dtype=np.int64)


@lru_cache(maxsize=256)
def _table(one: float, other: float, resolution: float) -> Bools:
    """Which differences of places let two footprints share a cell; (2 r + 1, 2 r + 1), by dy and dx."""
    a, b = footprint(one, resolution), footprint(other, resolution)
    apart = (a[:, None] - b[None]).reshape(-1, 2)
    r = int(np.abs(apart).max()) + 2
    table = np.zeros((2 * r + 1, 2 * r + 1), dtype=np.bool_)
    table[apart[:, 1] + r, apart[:, 0] + r] = True
    return table


class _Crowd(NamedTuple):
    """The robot (number 0) and all bodies: places (ticks, bodies), who is there, and radii."""

    x: Ints
    y: Ints
    there: Bools
    radii: list[float]
    forgiven: set[int]
    """Bodies that may lie on the robot at the last tick: it stood, and they ran into it."""


def breaches(trace: Trace, most: int = 5) -> list[str]:
    """What a trace breaks, in words; the first of each rule, at most so many. Empty when it is clean."""
    found: list[str] = list(_story(trace))
    crowd = _crowd(trace)
    for t0, t1, blocked in _maps(trace):
        found += _walls(trace, crowd, t0, t1, blocked)
    found += _steps(trace, crowd)
    small = all(r <= trace.scene.grid.resolution / 2 for r in crowd.radii)
    found += _small_pairs(trace, crowd) if small else _sized_pairs(trace, crowd)
    found += _promises(trace, crowd)
    return found[:most]


def _story(trace: Trace) -> Iterator[str]:
    n, robot = trace.ticks + 1, trace.robot
    if not (len(robot) == len(trace.speed) == len(trace.cause) == n):
        yield "places, speeds and causes are not one a tick"
        return
    if tuple(robot[0].tolist()) != trace.scene.start:
        yield "the robot does not begin at the start"
    there = tuple(robot[-1].tolist()) == trace.scene.goal and trace.path is not None
    if trace.arrived != there:
        yield "arrived and standing on the goal are not the same"
    still = np.append(False, (robot[1:] == robot[:-1]).all(axis=1))
    waiting = np.array([word == "waiting" for word in trace.cause])
    if (still != waiting).any() or int(still.sum()) != trace.waits:
        yield "waiting and not moving are not the same"
    if not (trace.speed >= 0).all() or trace.speed[still].any() or trace.speed[0] != 0:
        yield "a speed that cannot be"
    if trace.arrived and trace.speed[-1] != 0:
        yield "it arrives and does not stand"
    if trace.path is not None and not np.array_equal(trace.path.cells, robot[~still]):
        yield "the path is not what was driven"
    if any(len(track) != n - t0 for track, t0 in zip(trace.tracks, trace.appears, strict=True)):
        yield "a track that does not last until the end"


def _crowd(trace: Trace) -> _Crowd:
    n, count = trace.ticks + 1, len(trace.tracks)
    places = np.zeros((n, count + 1, 2), dtype=np.int64)
    there = np.zeros((n, count + 1), dtype=np.bool_)
    places[:, 0], there[:, 0] = trace.robot, True
    forgiven: set[int] = set()
    hit = trace.outcome is Outcome.HIT and n > 1 and (trace.robot[-1] == trace.robot[-2]).all()
    for k, (track, t0) in enumerate(zip(trace.tracks, trace.appears, strict=True)):
        last = min(len(track), n - t0)
        places[t0 : t0 + last, k + 1], there[t0 : t0 + last, k + 1] = track[:last], True
        places[:t0, k + 1] = track[0]
        if hit and not trace.obstacle_specs[k].yields:
            forgiven.add(k + 1)
    radii = [trace.scene.robot.radius, *(b.radius for b in trace.obstacle_specs)]
    return _Crowd(places[..., 0], places[..., 1], there, radii, forgiven)


def _name(k: int) -> str:
    return "the robot" if k == 0 else f"body {k - 1}"


# ---- each alone ----


def _maps(trace: Trace) -> Iterator[tuple[int, int, Bools]]:
    """Ticks with one map, both among them, and the map; walls turn as the trace says that they did."""
    blocked = trace.scene.grid.blocked.copy()
    since = 0
    for edit in trace.edits:
        if edit.tick > since:
            yield since, edit.tick - 1, blocked.copy()
        since = edit.tick
        for cells, wall in ((edit.blocked, True), (edit.freed, False)):
            for x, y in cells:
                blocked[y, x] = wall
    yield since, trace.ticks, blocked


def _grown(blocked: Bools, offsets: Ints) -> Bools:
    """Where a body of that footprint would cover a wall, among cells of the map."""
    if len(offsets) == 1:
        return blocked
    r = int(np.abs(offsets).max())
    high, wide = blocked.shape
    padded = np.pad(blocked, r)
    out = np.zeros_like(blocked)
    for dx, dy in offsets.tolist():
        out |= padded[r + dy : r + dy + high, r + dx : r + dx + wide]
    return out


def _walls(trace: Trace, crowd: _Crowd, t0: int, t1: int, blocked: Bools) -> Iterator[str]:
    """Nobody off the map or over a wall at the ticks of a map; nobody round a corner on the way there."""
    scene, high, wide = trace.scene, *blocked.shape
    since = max(t0 - 1, 0)
    for radius in sorted(set(crowd.radii)):
        offsets = footprint(radius, scene.grid.resolution)
        mine = np.array([k for k, r in enumerate(crowd.radii) if r == radius])
        shut = _grown(blocked, offsets)
        x, y, there = (a[since : t1 + 1][:, mine] for a in (crowd.x, crowd.y, crowd.there))
        off = there & ((x < 0) | (y < 0) | (x >= wide) | (y >= high))
        if off.any():
            t, k = np.argwhere(off)[0].tolist()
            yield f"tick {since + t}: {_name(mine[k])} is off the map"
            return
        over = there & shut[y, x]
        if trace.outcome is Outcome.START_OCCUPIED:
            over[:, mine == 0] = False
        over[: t0 - since] = False
        if over.any():
            t, k = np.argwhere(over)[0].tolist()
            yield f"tick {since + t}: {_name(mine[k])} is in a wall"
        free = scene.moves.corner_cutting and len(offsets) == 1
        dx, dy = x[1:] - x[:-1], y[1:] - y[:-1]
        turned = there[:-1] & (np.abs(dx * dy) == 1) & (not free)
        turned[:, [k > 0 and trace.obstacle_specs[k - 1].kind == "recorded" for k in mine.tolist()]] = False
        cut = turned & (shut[y[:-1], x[1:]] | shut[y[1:], x[:-1]])
        if cut.any():
            t, k = np.argwhere(cut)[0].tolist()
            yield f"tick {since + t + 1}: {_name(mine[k])} cuts a corner"


def _steps(trace: Trace, crowd: _Crowd) -> Iterator[str]:
    """One cell a tick; the robot only by its own steps."""
    dx, dy = np.diff(crowd.x, axis=0), np.diff(crowd.y, axis=0)
    far = np.maximum(np.abs(dx), np.abs(dy)) > 1
    far[:, 0] = False
    if (far & crowd.there[:-1]).any():
        t, k = np.argwhere(far & crowd.there[:-1])[0].tolist()
        yield f"tick {t + 1}: {_name(k)} jumps"
    known = {(0, 0), *trace.scene.moves.offsets}
    if not known.issuperset(zip(dx[:, 0].tolist(), dy[:, 0].tolist(), strict=True)):
        yield "the robot makes a step it does not have"


# ---- every two ----


def _small_pairs(trace: Trace, crowd: _Crowd) -> Iterator[str]:
    """Bodies of one cell each: no number of a cell twice, no step there and back, no middle twice."""
    n, count = crowd.x.shape
    wide = 2 * trace.scene.grid.width + 8
    cell = (2 * crowd.y + 4) * wide + 2 * crowd.x + 4
    room = wide * (2 * trace.scene.grid.height + 8)
    # Who is not there has a number of its own.
    here = np.where(crowd.there, cell, room + np.arange(count))
    ranked = np.sort(here, axis=1)
    for t in np.flatnonzero((ranked[:, 1:] == ranked[:, :-1]).any(axis=1)).tolist():
        row = here[t].tolist()
        twice = [(a, b) for b in range(count) for a in range(b) if row[a] == row[b]]
        twice = [(a, b) for a, b in twice if not (t == n - 1 and a == 0 and b in crowd.forgiven)]
        if twice:
            yield f"tick {t}: {_name(twice[0][0])} and {_name(twice[0][1])} are in one cell"
            break
    old, new = cell[:-1], cell[1:]
    moves = crowd.there[:-1] & (old != new)
    ticks = np.broadcast_to(np.arange(n - 1)[:, None], moves.shape)[moves]
    came, went = old[moves], new[moves]
    back = np.isin((ticks * room + came) * room + went, (ticks * room + went) * room + came)
    if back.any():
        yield f"tick {int(ticks[back][0]) + 1}: a swap at {_cell(int(came[back][0]), wide)}"
    askew = np.abs(np.diff(crowd.x, axis=0) * np.diff(crowd.y, axis=0)) == 1
    askew &= crowd.there[:-1]
    ticks = np.broadcast_to(np.arange(n - 1)[:, None], askew.shape)[askew]
    middle = np.sort(ticks * room + (old[askew] + new[askew]) // 2)
    twice_there = np.flatnonzero(middle[1:] == middle[:-1])
    if len(twice_there):
        t, at = divmod(int(middle[twice_there[0]]), room)
        yield f"tick {t + 1}: two cross at {_cell(at, wide)}"


def _cell(number: int, wide: int) -> tuple[float, float]:
    y, x = divmod(number, wide)
    return (x - 4) / 2, (y - 4) / 2


def _sized_pairs(trace: Trace, crowd: _Crowd) -> Iterator[str]:
    """Bodies of any size: the differences of places, looked up in a table for every two radii."""
    n, resolution = len(crowd.x), trace.scene.grid.resolution
    radii = sorted(set(crowd.radii))
    told: set[tuple[str, float, float]] = set()
    for one, other in combinations_with_replacement(radii, 2):
        a, b = np.triu_indices(len(crowd.radii), 1)
        r = np.array(crowd.radii)
        mine = ((r[a] == one) & (r[b] == other)) | ((r[a] == other) & (r[b] == one))
        # Footprints are symmetric, so the order of the two does not matter.
        table, a, b = _table(one, other, resolution), a[mine], b[mine]
        if not len(a):
            continue
        size = max(2, _PAIR_TICKS // len(a))
        for since in range(0, max(n - 1, 1), size):
            last = min(since + size, n - 1)
            for rule, sentence in _met(crowd, table, a, b, since, last):
                if (rule, one, other) not in told:
                    told.add((rule, one, other))
                    yield sentence


def _met(crowd: _Crowd, table: Bools, a: Ints, b: Ints, since: int, last: int) -> Iterator[tuple[str, str]]:
    """Pairs a, b that meet, swap or cross at ticks since .. last."""
    ticks = slice(since, last + 1)
    ax, ay, at = crowd.x[ticks][:, a], crowd.y[ticks][:, a], crowd.there[ticks][:, a]
    bx, by, bt = crowd.x[ticks][:, b], crowd.y[ticks][:, b], crowd.there[ticks][:, b]
    both = at & bt
    met = both & _looked_up(table, bx - ax, by - ay)
    if last == len(crowd.x) - 1:
        met[-1, (a == 0) & np.isin(b, sorted(crowd.forgiven))] = False

    def tell(rule: str, bad: Bools, later: int) -> Iterator[tuple[str, str]]:
        if bad.any():
            t, k = np.argwhere(bad)[0].tolist()
            yield rule, f"tick {since + t + later}: {_name(a[k])} and {_name(b[k])} {rule}"

    yield from tell("are in one cell", met, 0)
    dax, day = ax[1:] - ax[:-1], ay[1:] - ay[:-1]
    dbx, dby = bx[1:] - bx[:-1], by[1:] - by[:-1]
    went = both[:-1] & ((dax != 0) | (day != 0)) & ((dbx != 0) | (dby != 0))
    swap = went & _looked_up(table, bx[:-1] - ax[1:], by[:-1] - ay[1:])
    swap &= _looked_up(table, bx[1:] - ax[:-1], by[1:] - ay[:-1])
    yield from tell("swap", swap, 1)
    askew = (np.abs(dax * day) == 1) & (np.abs(dbx * dby) == 1) & (dax * dbx + day * dby == 0)
    mx, my = (bx - ax)[:-1] + (dbx - dax) // 2, (by - ay)[:-1] + (dby - day) // 2
    yield from tell("cross", both[:-1] & askew & _looked_up(table, mx, my), 1)


def _looked_up(table: Bools, dx: Ints, dy: Ints) -> Any:
    # The rim of the table holds nothing: whatever is farther off is told so by it.
    r = len(table) // 2
    return table[np.clip(dy, -r, r) + r, np.clip(dx, -r, r) + r]


def _promises(trace: Trace, crowd: _Crowd) -> Iterator[str]:
    """Who yields does not come onto the robot; tracks are replayed; start and goal are kept clear."""
    scene, resolution = trace.scene, trace.scene.grid.resolution
    rx = np.append(crowd.x[:1, 0], crowd.x[:-1, 0])
    ry = np.append(crowd.y[:1, 0], crowd.y[:-1, 0])
    tracks = iter(s for s in scene.traffic if isinstance(s, Recorded))
    for k, body in enumerate(trace.obstacle_specs, 1):
        if body.kind == "recorded":
            track = np.array(next(tracks).track)
            want = track[np.minimum(np.arange(len(rx)), len(track) - 1)]
            if (want[:, 0] != crowd.x[:, k]).any() or (want[:, 1] != crowd.y[:, k]).any():
                yield f"{_name(k)} leaves its track"
    for radius in sorted(set(crowd.radii[1:])):
        own = [
            k for k, b in enumerate(trace.obstacle_specs, 1) if b.radius == radius and b.kind != "recorded"
        ]
        there, x, y = crowd.there[:, own], crowd.x[:, own], crowd.y[:, own]
        table = _table(scene.robot.radius, radius, resolution)
        yields = np.array([trace.obstacle_specs[k - 1].yields for k in own], dtype=np.bool_)
        on = there & yields & _looked_up(table, x - rx[:, None], y - ry[:, None])
        if on.any():
            yield f"{_name(own[int(on.any(axis=0).argmax())])}, which yields, comes onto the robot"
        for ex, ey in (scene.start, scene.goal):
            on = there & _looked_up(table, x - ex, y - ey)
            if on.any():
                yield f"{_name(own[int(on.any(axis=0).argmax())])} stands on the start or the goal"

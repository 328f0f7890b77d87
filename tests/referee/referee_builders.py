"""Lawful maps, paths, profiles and traces, made the plainest way; no code of the package's own verbs."""

from __future__ import annotations

import heapq
import math
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np

from lampyris.model.grid import Grid
from lampyris.model.moves import MOVES, Moves
from lampyris.model.path import Path, path_of
from lampyris.model.profile import Profile
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.model.trace import Event, Outcome, Trace
from lampyris.model.traffic import Obstacle

Cell = tuple[int, int]


def random_grid(
    rng: np.random.Generator, low: int = 5, high: int = 16, share: float = 0.25, **more: Any
) -> Grid:
    """A random map with at least some free cells."""
    shape = (int(rng.integers(low, high)), int(rng.integers(low, high)))
    return Grid(rng.random(shape) < rng.random() * share, **more)


def square_distance(px: float, py: float, cx: int, cy: int) -> float:
    """Distance from a point to the unit square around a cell's centre, cells."""
    dx = max(abs(px - cx) - 0.5, 0.0)
    dy = max(abs(py - cy) - 0.5, 0.0)
    return math.sqrt(dx * dx + dy * dy)


def nearest_wall(grid: Grid, px: float, py: float) -> float:
    """Distance from a point to the nearest wall's square, cells; infinity without walls."""
    walls = np.argwhere(grid.blocked).tolist()
    return min((square_distance(px, py, x, y) for y, x in walls), default=math.inf)


def disc_free(grid: Grid, radius: float) -> np.ndarray:
    """Where a disc may stand: bool (height, width)."""
    free = ~grid.blocked
    if radius <= 0:
        return free
    need = radius / grid.resolution - 1e-12
    return np.array(
        [
            [bool(free[y, x]) and nearest_wall(grid, x, y) >= need for x in range(grid.width)]
            for y in range(grid.height)
        ]
    )


def may_step(free: np.ndarray, moves: Moves, radius: float, x: int, y: int, dx: int, dy: int) -> bool:
    """Whether one step is allowed, cell by cell."""
    h, w = free.shape

    def ok(u: int, v: int) -> bool:
        return 0 <= u < w and 0 <= v < h and bool(free[v, u])

    if not ok(x + dx, y + dy):
        return False
    if abs(dx) + abs(dy) == 3:
        if radius > 0:
            return False
        sx, sy = (1 if dx > 0 else -1), (1 if dy > 0 else -1)
        side = (x + sx, y) if abs(dx) == 2 else (x, y + sy)
        return ok(*side) and ok(x + sx, y + sy)
    if dx and dy and (radius > 0 or not moves.corner_cutting):
        return ok(x + dx, y) and ok(x, y + dy)
    return True


def find_path(grid: Grid, moves: Moves, start: Cell, goal: Cell, radius: float = 0.0) -> Path | None:
    """A shortest path by a plain Dijkstra."""
    free = disc_free(grid, radius)
    if not (free[start[1], start[0]] and free[goal[1], goal[0]]):
        return None
    best = {start: 0}
    came: dict[Cell, Cell] = {}
    queue = [(0, start)]
    while queue:
        d, here = heapq.heappop(queue)
        if here == goal:
            break
        if d > best[here]:
            continue
        for (dx, dy), c in zip(moves.offsets, moves.costs, strict=True):
            there = (here[0] + dx, here[1] + dy)
            if may_step(free, moves, radius, *here, dx, dy) and d + c < best.get(there, 1 << 60):
                best[there] = d + c
                came[there] = here
                heapq.heappush(queue, (d + c, there))
    if goal not in best:
        return None
    cells = [goal]
    while cells[-1] != start:
        cells.append(came[cells[-1]])
    return path_of(np.array(cells[::-1]), moves)


def random_query(
    rng: np.random.Generator, moves: str, radius: float = 0.0, least: int = 4, **more: Any
) -> tuple[Scene, Path]:
    """A scene and a lawful path of at least so many cells through it."""
    while True:
        grid = random_grid(rng, **more)
        ends = [(int(rng.integers(grid.width)), int(rng.integers(grid.height))) for _ in range(2)]
        path = find_path(grid, MOVES[moves], ends[0], ends[1], radius)
        if path is not None and len(path.cells) >= least:
            return Scene(grid, ends[0], ends[1], MOVES[moves], Robot(radius=radius)), path


def physical(path: Path, scene: Scene) -> Profile:
    """The fastest lawful physical profile, node by node."""
    robot, res = scene.robot, scene.grid.resolution
    cells = path.cells.tolist()
    ds = [math.dist(a, b) * res for a, b in pairwise(cells)]
    cap = []
    for x, y in cells:
        room = max(nearest_wall(scene.grid, x, y) * res - robot.radius, 0.0)
        cap.append(min(robot.v_max, max(0.1 * robot.v_max, math.sqrt(2 * robot.d_max * room))))
    v = cap[:]
    v[0] = v[-1] = 0.0
    for i in range(1, len(v)):
        v[i] = min(v[i], math.sqrt(v[i - 1] ** 2 + 2 * robot.a_max * ds[i - 1]))
    for i in range(len(v) - 2, -1, -1):
        v[i] = min(v[i], math.sqrt(v[i + 1] ** 2 + 2 * robot.d_max * ds[i]))
    t = [0.0]
    for i, step in enumerate(ds):
        pace = v[i] + v[i + 1]
        if pace > 0:
            t.append(t[-1] + 2 * step / pace)
        else:
            top = min(cap[i], cap[i + 1])
            peak = min(top, math.sqrt(2 * step * robot.a_max * robot.d_max / (robot.a_max + robot.d_max)))
            ramps = peak**2 / (2 * robot.a_max) + peak**2 / (2 * robot.d_max)
            t.append(t[-1] + peak / robot.a_max + peak / robot.d_max + max(0.0, step - ramps) / peak)
    a = [(v[i + 1] ** 2 - v[i] ** 2) / (2 * step) for i, step in enumerate(ds)] + [0.0]
    s = [0.0]
    for step in ds:
        s.append(s[-1] + step)
    array = [np.array(k) for k in (s, v, a, t)]
    return Profile("physical", *array, ("limit",) * len(v), "m/s")


def dissertation(path: Path, scene: Scene) -> Profile:
    """The dissertation's law with walls alone, by degrees."""
    cells = path.cells.tolist()
    grid = scene.grid

    def wall(x: int, y: int, outside: bool) -> bool:
        return bool(grid.blocked[y, x]) if grid.contains((x, y)) else outside

    n = len(cells)
    v = [0.0] * n
    for i in range(1, n - 1):
        (x0, y0), (x, y), (x1, y1) = cells[i - 1], cells[i], cells[i + 1]
        into, out = math.atan2(y - y0, x - x0), math.atan2(y1 - y, x1 - x)
        turn = abs(math.degrees(math.remainder(out - into, 2 * math.pi)))
        angle = 80 if turn < 22.5 else 60 if turn < 67.5 else 20
        n1 = n2 = 0
        for oy in range(-2, 3):
            for ox in range(-2, 3):
                if max(abs(ox), abs(oy)) == 1:
                    n1 += wall(x + ox, y + oy, True)
                elif max(abs(ox), abs(oy)) == 2:
                    off = abs(math.degrees(math.remainder(math.atan2(oy, ox) - into, 2 * math.pi)))
                    n2 += off <= 45 + 1e-9 and wall(x + ox, y + oy, False)
        rise = {1: 20, 2: 28, 5: 44}[(x - x0) ** 2 + (y - y0) ** 2]
        v[i] = min(80.0, v[i - 1] + rise, max(20, 80 - 6 * n1 - 3 * n2), angle)
    for i in range(n - 2, -1, -1):
        v[i] = min(v[i], v[i + 1] + 40)
    s = [0.0]
    for p, q in pairwise(cells):
        s.append(s[-1] + math.dist(p, q))
    a = [*np.diff(v), 0.0]
    made = [np.array(k, dtype=float) for k in (s, v, a, range(n))]
    return Profile("dissertation", *made, ("limit",) * n, "velocity units")


def footprint(radius: float, resolution: float = 1.0) -> tuple[Cell, ...]:
    """Own cell plus every cell whose square is strictly nearer than the radius."""
    far = math.ceil(radius / resolution) + 1
    span = range(-far, far + 1)
    near = [(x, y) for y in span for x in span if square_distance(0, 0, x, y) * resolution < radius - 1e-9]
    return tuple(sorted({(0, 0), *near}))


def cover(cell: Cell, shape: tuple[Cell, ...]) -> set[Cell]:
    """The cells a body covers."""
    return {(cell[0] + dx, cell[1] + dy) for dx, dy in shape}


def crosses(a0: Cell, a1: Cell, sa: tuple[Cell, ...], b0: Cell, b1: Cell, sb: tuple[Cell, ...]) -> bool:
    """Whether a cell of one footprint and a cell of the other drive the two diagonals of one 2x2 block."""
    da, db = (a1[0] - a0[0], a1[1] - a0[1]), (b1[0] - b0[0], b1[1] - b0[1])
    if abs(da[0] * da[1]) != 1 or abs(db[0] * db[1]) != 1 or da[0] * da[1] == db[0] * db[1]:
        return False
    blocks = [
        {frozenset(((x, y), (x + d[0], y), (x, y + d[1]), (x + d[0], y + d[1]))) for x, y in cover(c, s)}
        for c, d, s in ((a0, da, sa), (b0, db, sb))
    ]
    return bool(blocks[0] & blocks[1])


def clash(a0: Cell, a1: Cell, sa: tuple[Cell, ...], b0: Cell, b1: Cell, sb: tuple[Cell, ...]) -> str:
    """The rule that two bodies break on their way into a tick: together, swap, cross, or none."""
    if cover(a1, sa) & cover(b1, sb):
        return "together"
    if cover(a1, sa) & cover(b0, sb) and cover(b1, sb) & cover(a0, sa):
        return "swap"
    return "cross" if crosses(a0, a1, sa, b0, b1, sb) else ""


def _walk(rng: np.random.Generator, free: np.ndarray, at: Cell) -> Cell:
    h, w = free.shape
    near = [(at[0] + dx, at[1] + dy) for dx in (-1, 0, 1) for dy in (-1, 0, 1)]
    options = [(x, y) for x, y in near if 0 <= x < w and 0 <= y < h and free[y, x]]
    return options[int(rng.integers(len(options)))]


def random_trace(
    rng: np.random.Generator, moves: str = "octile", radius: float = 0.0, count: int = 6
) -> Trace:
    """A lawful trace: a robot that follows a shortest path and waits, among walkers that yield to all."""
    scene, path = random_query(rng, moves, radius, least=5, low=8, high=18, share=0.3)
    shapes = [footprint(radius)]
    frees = [disc_free(scene.grid, radius)]
    bodies: list[Obstacle] = []
    for _ in range(count):
        r = float(rng.choice([0.0, 0.0, 0.4, 0.8, 1.2]))
        bodies.append(Obstacle("random-walk", r, True, footprint(r)))
        shapes.append(bodies[-1].footprint)
        frees.append(disc_free(scene.grid, r))
    robot, at = [scene.start], [scene.start]
    tracks: list[list[Cell]] = []
    appears: list[int] = []
    events = []
    k = waits = 0
    cells = [tuple(c) for c in path.cells.tolist()]
    for tick in range(80):
        if robot[-1] == scene.goal:
            break
        want = cells[k + 1]
        before = at[:]
        moved = 0
        for b in [*range(1, len(at)), 0]:
            to = want if b == 0 else _walk(rng, frees[b], at[b])
            others = [o for o in range(len(at)) if o != b]
            # Nobody enters what another covers or covered, nor crosses: stricter than the rules ask for.
            long = max(abs(to[0] - at[b][0]), abs(to[1] - at[b][1])) > 1
            reach = cover(to, shapes[b])
            if long:
                reach |= {
                    (x, y) for x, y in np.ndindex(*scene.grid.blocked.T.shape) if math.dist((x, y), to) < 2.5
                }
            taken = any(reach & (cover(at[o], shapes[o]) | cover(before[o], shapes[o])) for o in others)
            if not taken and not any(
                crosses(before[b], to, shapes[b], before[o], at[o], shapes[o]) for o in others
            ):
                at[b] = to
                moved += b == 0
        k, waits = k + moved, waits + (not moved)
        if not moved:
            events.append(Event(tick + 1, "wait", at[0]))
        if len(tracks) < count and rng.random() < 0.7:
            b = len(tracks) + 1
            spots = np.argwhere(frees[b])
            y, x = spots[int(rng.integers(len(spots)))].tolist() if len(spots) else (0, 0)
            clear = not any(cover((x, y), shapes[b]) & cover(at[o], shapes[o]) for o in range(len(at)))
            if len(spots) and clear:
                at.append((x, y))
                tracks.append([])
                appears.append(tick + 1)
        for track, place in zip(tracks, at[1:], strict=True):
            track.append(place)
        robot.append(at[0])
    arrived = robot[-1] == scene.goal
    driven = [robot[0]] + [q for p, q in pairwise(robot) if p != q]
    n = len(robot)
    return Trace(
        scene, "walker", 0, Outcome.ARRIVED if arrived else Outcome.TIMEOUT, np.array(robot),
        tuple(np.array(t) for t in tracks), tuple(appears), tuple(bodies[: len(tracks)]),
        rng.random(n) * scene.robot.v_max, ("limit",) * n, "physical", "m/s", tuple(events),
        0, waits, 1, 0, path_of(np.array(driven), scene.moves),
    )  # fmt: skip


def cut(trace: Trace, tick: int) -> Trace:
    """The same trace, stopped after a tick as if its time were up."""
    n = tick + 1
    robot = trace.robot[:n]
    moved = (robot[1:] != robot[:-1]).any(axis=1)
    keep = [k for k, t0 in enumerate(trace.appears) if t0 < n]
    return replace(
        trace,
        outcome=Outcome.TIMEOUT if tuple(robot[-1].tolist()) != trace.scene.goal else Outcome.ARRIVED,
        robot=robot,
        tracks=tuple(trace.tracks[k][: n - trace.appears[k]] for k in keep),
        appears=tuple(trace.appears[k] for k in keep),
        obstacle_specs=tuple(trace.obstacle_specs[k] for k in keep),
        speed=trace.speed[:n],
        cause=trace.cause[:n],
        events=tuple(e for e in trace.events if e.tick < n),
        waits=int((~moved).sum()),
        path=path_of(np.concatenate((robot[:1], robot[1:][moved])), trace.scene.moves),
    )


def with_body(trace: Trace, t0: int, track: list[Cell], radius: float = 0.0, yields: bool = True) -> Trace:
    """The same trace with one more body, which appears last."""
    kind = "random-walk" if yields else "recorded"
    return replace(
        trace,
        tracks=(*trace.tracks, np.array(track)),
        appears=(*trace.appears, t0),
        obstacle_specs=(*trace.obstacle_specs, Obstacle(kind, radius, yields, footprint(radius))),
    )


def alone(trace: Trace) -> Trace:
    """The same trace without obstacles."""
    return replace(trace, tracks=(), appears=(), obstacle_specs=())

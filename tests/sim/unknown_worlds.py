"""Random worlds that a robot learns as it drives, planners that are watched while they replan, and goals that move."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

import lampyris
from lampyris import referee
from lampyris.planning import registry
from lampyris.planning.field.layers import free_cells, moves_for
from lampyris.sim.grid import loop

MOVES = ("octile", "four-connected", "dissertation", "sixteen-connected")
VIEWS = (2 * math.pi, math.pi, math.pi / 2, 0.5)


def drawn_world(seed, most=20):
    """A scene and a sensor: blocks and single walls, any step set, sometimes a robot with a radius."""
    rng = np.random.default_rng((77, seed))
    height, width = rng.integers(3, most + 1, 2)
    walls = rng.random((height, width)) < rng.choice([0.1, 0.25, 0.4])
    for _ in range(int(rng.integers(0, 4))):
        y, x = rng.integers(0, height), rng.integers(0, width)
        walls[y : y + int(rng.integers(1, 8)), x : x + int(rng.integers(1, 8))] = True
    radius = float(rng.choice([0.0, 0.0, 0.0, 0.8]))
    free = np.argwhere(free_cells(lampyris.Grid(walls), radius))
    if len(free) < 2:
        return drawn_world(seed + 10**7, most)
    (y, x), (v, u) = free[rng.choice(len(free), 2, replace=False)].tolist()
    grid, robot = lampyris.Grid(walls), lampyris.Robot(radius=radius)
    scene = lampyris.Scene(grid, (x, y), (u, v), moves=MOVES[int(rng.integers(4))], robot=robot)
    return scene, lampyris.Sensor(float(rng.choice([1.0, 2.0, 3.5, 6.0])), VIEWS[int(rng.integers(4))])


class Watched:
    """A planner whose every answer is compared with Dijkstra's on the map as it has been told of it.

    Parameters
    ----------
    inner : the planner.
    plain : whether Dijkstra is the plain one of the reference; else that of this package.
    """

    def __init__(self, inner, plain=True):
        self.inner, self.name, self.traits, self.plain = inner, inner.name, inner.traits, plain
        self.calls, self.wrong = 0, []

    def open(self, scene, rng, *, record=False):
        self.scene, self.walls = scene, scene.grid.blocked.copy()
        ground = scene.grid.terrain
        self.terrain = (
            np.zeros(self.walls.shape, dtype=np.int64) if ground is None else ground.astype(np.int64)
        )
        self.session = self.inner.open(scene, rng, record=record)
        return self

    def plan(self, change=None, budget=None):
        for x, y in change.blocked:
            self.walls[y, x] = True
            self.terrain[y, x] = 0
        for (x, y), value in change.terrain:
            self.terrain[y, x] = value
        assert not change.freed
        plan = self.session.plan(change, budget)
        self.calls += 1
        goal = self.scene.goal
        expected = self.expected(change.robot, goal)
        got = plan.optimal_exact if plan.path is not None else None
        if got != expected:
            self.wrong.append((self.calls, change.robot, got, expected))
        return plan

    def expected(self, robot, goal):
        """The exact cost from the robot to the goal on what is known; None: there is no path."""
        free, moves = free_cells(lampyris.Grid(self.walls), self.scene.robot.radius), moves_for(self.scene)
        if not (free[robot[1], robot[0]] and free[goal[1], goal[0]]):
            return None
        terrain = self.terrain if self.terrain.any() else None
        moves = moves.plain() if terrain is None else moves.weighed()
        if not self.plain:
            from lampyris.planning.field.solve import solve

            ground = None if terrain is None else terrain.astype(np.uint8)
            found = int(solve(free, moves, goal, terrain=ground).exact[robot[1], robot[0]])
            return found if found >= 0 else None
        return exact_costs(free, moves, goal, terrain).get(tuple(robot))


def exact_costs(free, moves, goal, terrain=None):
    """Costs to the goal in the exact whole numbers of a step set, by a plain Dijkstra over a dictionary.

    With ``terrain``, and costs in 63rds, a step costs by the cell that it enters.
    """
    import heapq

    height, width = free.shape
    inside = {(x, y) for y in range(height) for x in range(width) if free[y, x]}
    best, queue = {}, [(0, goal)]
    while queue:
        cost, (x, y) = heapq.heappop(queue)
        if (x, y) in best:
            continue
        best[x, y] = cost
        weight = 1 if terrain is None else 63 + int(terrain[y, x])
        for (dx, dy), price in zip(moves.offsets, moves.costs, strict=True):
            u, v = x - dx, y - dy
            if (u, v) in best or (u, v) not in inside:
                continue
            if abs(dx * dy) == 2:
                beside = [(x - s, y - t) for s, t in _passed(dx, dy)]
            elif dx and dy and not moves.corner_cutting:
                beside = [(u, y), (x, v)]
            else:
                beside = []
            if inside.issuperset(beside):
                step = price if terrain is None else price // 63 * weight
                heapq.heappush(queue, (cost + step, (u, v)))
    return best


def _passed(dx, dy):
    return ((dx // 2, 0), (dx // 2, dy)) if abs(dx) == 2 else ((0, dy // 2), (dx, dy // 2))


def judged(scene, planner, **more):
    """A simulation that the referee has accepted."""
    trace = loop.run(scene, planner, law="dissertation", **more)
    fault = referee.check_trace(trace)
    assert fault is None, fault
    return trace


def watched_run(seed, name, settings, plain=True, most=20, unseen=False):
    """One world, one planner: the trace, how often it was asked, and answers that were wrong.

    With ``unseen`` cells cost more until they are seen, on a map that has terrain in every third world.
    """
    scene, sensor = drawn_world(seed, most)
    if unseen:
        rng = np.random.default_rng((79, seed))
        sensor = replace(sensor, unseen_cost=float(rng.choice([1.1, 1.5, 2.0, 5.0])))
        ground = rng.integers(0, 253, scene.grid.blocked.shape).astype(np.uint8)
        grid = lampyris.Grid(scene.grid.blocked, terrain=ground if seed % 3 == 0 else None)
        scene = replace(scene, grid=grid)
    planner = Watched(registry.make(name, settings), plain)
    trace = judged(scene, planner, sensor=sensor)
    reachable = tuple(scene.start) in exact_costs(
        free_cells(scene.grid, scene.robot.radius), moves_for(scene), scene.goal
    )
    # Every wall that was seen is one, and unseen cells count as free: it arrives exactly if it can.
    assert trace.arrived == reachable, (seed, name, trace.outcome, trace.sentence)
    return trace, planner.calls, planner.wrong


def drawn_chase(seed, most=9, slow=2):
    """A scene whose goal walks at random, one legal step of the robot's in every ``slow`` ticks, and its track."""
    rng = np.random.default_rng((78, seed))
    while True:
        height, width = rng.integers(2, most + 1, 2)
        walls = rng.random((height, width)) < rng.choice([0.1, 0.3])
        free = np.argwhere(~walls)
        if len(free) >= 2:
            break
    (y, x), (v, u) = free[rng.choice(len(free), 2, replace=False)].tolist()
    moves = MOVES[int(rng.integers(3))]
    scene = lampyris.Scene(lampyris.Grid(walls), (x, y), (u, v), moves=moves)
    track, at = [], (u, v)
    for _ in range(int(rng.integers(1, 30))):
        track += [at] * slow
        options = [at, *steps_from(~walls, scene.moves, at)]
        at = options[int(rng.integers(len(options)))]
    return scene, track


def steps_from(free, moves, cell):
    """The cells to which a step set leads in one step."""
    x, y = cell
    height, width = free.shape
    found = []
    for dx, dy in moves.offsets:
        u, v = x + dx, y + dy
        inside = 0 <= u < width and 0 <= v < height and free[v, u]
        if inside and (moves.corner_cutting or not (dx and dy) or (free[y, u] and free[v, x])):
            found.append((u, v))
    return found


def earliest(scene, track, most=2000):
    """The first tick at which a robot can be where the goal is, by a plain search of cells and ticks; None: never."""
    free, now = ~scene.grid.blocked, {scene.start}
    if track[0] == scene.start:
        return 0
    for tick in range(1, most):
        then = now.union(*(steps_from(free, scene.moves, cell) for cell in now))
        if track[min(tick, len(track) - 1)] in then:
            return tick
        if then == now and tick >= len(track):
            return None
        now = then
    raise AssertionError("it goes on")


def without_waits(track):
    """The same goal, one step a tick."""
    return [cell for k, cell in enumerate(track) if k == 0 or cell != track[k - 1]]

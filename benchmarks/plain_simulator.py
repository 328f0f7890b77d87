"""The dissertation's simulation in plain Python, as one would write it without us.

It shares no code with lampyris. From it, it takes a map as rows of True for walls, and how draws are made, so
that both see the same obstacles: the benchmark checks that robot, obstacles and speeds are the same before
it times anything.

It does what a sensible programmer would: tuples in sets and dicts, a heap for the field, which is solved once
for all runs of a query, and the plan no farther ahead than the robot needs to brake from its top speed. It is
AD-GSO with the dissertation's settings, random walkers from the start, and the dissertation's speeds.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

Cell = tuple[int, int]

PARENTS = ((-1, -1), (1, -1), (-1, 1), (1, 1), (-1, 0), (1, 0), (0, -1), (0, 1))
EIGHT = ((-1, -1), (0, -1), (1, -1), (-1, 0), (1, 0), (-1, 1), (0, 1), (1, 1))
RHO, GAMMA, NT, RINGS, PATIENCE = 0.4, 0.6, 10, 3, 50
GOLDEN = 0x9E3779B97F4A7C15
"""The increment of SplitMix64."""
PLACE, STEPS = 0, 1
"""Which of its four sequences of draws a walker has for its place, and which for its steps."""
TRIES, TOGETHER = 64, 32
"""Cells that a walker draws for its place; ticks whose draws are made at once."""
Words = np.ndarray
V_MAX, V_MIN, DROP1, DROP2, BRAKING = 80.0, 20.0, 6.0, 3.0, 40.0
AHEAD = 4
"""Cells ahead of the robot's that its speed can depend on."""


class NeedsRepair(Exception):
    """Hemmed in twice at one cell: the planner would repair its field, which is not written here."""


@dataclass
class Story:
    """What came of a run."""

    robot: list[Cell]
    tracks: list[list[Cell]]
    speeds: list[float] = field(default_factory=lambda: [0.0])
    replans: int = 0
    waits: int = 0
    arrived: bool = False


class Simulator:
    """Runs of one query, each with a seed of its own.

    Parameters
    ----------
    walls : rows of True where there is a wall.
    start, goal : free cells x, y.
    count : how many random walkers.
    """

    def __init__(self, walls: Sequence[Sequence[bool]], start: Cell, goal: Cell, count: int) -> None:
        self.height, self.width = len(walls), len(walls[0])
        self.start, self.goal, self.count = start, goal, count
        self.free = {(x, y) for y, row in enumerate(walls) for x, wall in enumerate(row) if not wall}
        self.cost = self._costs()
        self.parent: dict[Cell, Cell] = {}
        self.luciferin: dict[Cell, float] = {}
        self._descend()
        self.room = self.free - {start, goal}

    # ---- the field --------------------

    def _costs(self) -> dict[Cell, int]:
        """Cost to the goal, 10 a straight step and 14 a diagonal one."""
        cost = {self.goal: 0}
        heap = [(0, self.goal)]
        while heap:
            c, (x, y) = heapq.heappop(heap)
            if c > cost[x, y]:
                continue
            for dx, dy in EIGHT:
                n = x + dx, y + dy
                d = c + (14 if dx and dy else 10)
                if n in self.free and d < cost.get(n, 1 << 60):
                    cost[n] = d
                    heapq.heappush(heap, (d, n))
        return cost

    def _descend(self) -> None:
        """Parents, and luciferin from parent to child."""
        for cell in sorted(self.cost, key=self.cost.__getitem__):
            x, y = cell
            if cell == self.goal:
                self.luciferin[cell] = 0.0
                continue
            for dx, dy in PARENTS:
                p = x + dx, y + dy
                if p in self.cost and self.cost[p] + (14 if dx and dy else 10) == self.cost[cell]:
                    self.parent[cell] = p
                    break
            before = self.luciferin[self.parent[cell]]
            self.luciferin[cell] = (1.0 - RHO) * before + GAMMA * (self.cost[cell] / 10.0)

    # ---- the planner --------------------

    def accepted(self, at: Cell, bodies: set[Cell]) -> set[Cell]:
        """Cells of lower luciferin joined to the window's centre, ring by ring until there are enough."""
        x, y = at
        here = self.luciferin[at]
        lower: set[Cell] = set()
        joined: set[Cell] = set()
        for ring in range(1, RINGS + 1):
            for dy in range(-ring, ring + 1):
                for dx in range(-ring, ring + 1) if abs(dy) == ring else (-ring, ring):
                    c = x + dx, y + dy
                    if c not in bodies and self.luciferin.get(c, here) < here:
                        lower.add(c)
            joined = set()
            stack = [at]
            while stack:
                cx, cy = stack.pop()
                for dx, dy in EIGHT:
                    n = cx + dx, cy + dy
                    if n in lower and n not in joined:
                        joined.add(n)
                        stack.append(n)
            if len(joined) >= NT:
                break
        return joined

    def subpath(self, at: Cell, to: Cell, accepted: set[Cell], bodies: set[Cell]) -> list[Cell]:
        """Along the parents if they pass ``to`` and nobody is there, else the cheapest way inside."""
        way = []
        c = at
        while self.cost[c] > self.cost[to]:
            c = self.parent[c]
            if c in bodies:
                break
            way.append(c)
        if c == to and c not in bodies:
            return way
        cost = {at: 0}
        heap = [(0, at)]
        while heap:
            d, (x, y) = heapq.heappop(heap)
            if d > cost[x, y]:
                continue
            for dx, dy in EIGHT:
                n = x + dx, y + dy
                e = d + (14 if dx and dy else 10)
                if n in accepted and e < cost.get(n, 1 << 60):
                    cost[n] = e
                    heapq.heappush(heap, (e, n))
        way = [to]
        while way[-1] != at:
            x, y = way[-1]
            for dx, dy in PARENTS:
                p = x + dx, y + dy
                if p in cost and cost[p] + (14 if dx and dy else 10) == cost[x, y]:
                    way.append(p)
                    break
        return way[-2::-1]

    def plan(self, at: Cell, bodies: set[Cell]) -> tuple[list[Cell], int]:
        """The way from a cell as far as it matters, and the steps of the first sub-path; empty: hemmed in."""
        way = [at]
        first = 0
        while way[-1] != self.goal and (first == 0 or len(way) <= first + AHEAD):
            here = way[-1]
            mind = bodies
            accepted = self.accepted(here, mind)
            if not accepted and first:
                mind = set()
                accepted = self.accepted(here, mind)
            if not accepted:
                return [], 0
            to = min(accepted, key=lambda c: (self.luciferin[c], self.cost[c], c[1], c[0]))
            way += self.subpath(here, to, accepted, mind)
            first = first or len(way) - 1
        return way, first

    # ---- a run --------------------

    def run(self, seed: int, ticks: int) -> Story:
        """One simulation."""
        own = _streams(seed, self.count)
        return _Run(self, self._places(own)).story(own, ticks)

    def _places(self, own: Words) -> list[Cell]:
        """A cell for each walker: the first that it draws which is free and not taken."""
        free, out = set(self.room), []  # too full a map ends in StopIteration
        area = self.width * self.height
        for row in (_draws(own, PLACE, range(TRIES)).T * area).astype(int).tolist():
            cell = next(c for c in ((k % self.width, k // self.width) for k in row) if c in free)
            free.remove(cell)
            out.append(cell)
        return out


def _streams(seed: int, count: int) -> Words:
    """A number for each walker, from which its draws are made; uint64 (count)."""
    key = np.random.SeedSequence((seed, 0x51AB1E, 1, 1)).generate_state(1, np.uint64)
    return key + np.uint64(GOLDEN) * (np.uint64(4) * np.arange(count, dtype=np.uint64))


def _split_mix(z: Words) -> Words:
    """The output function of SplitMix64 (Steele, Lea, Flood 2014)."""
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return z ^ (z >> np.uint64(31))


def _draws(own: Words, what: int, numbers: range) -> np.ndarray:
    """Numbers in [0, 1) of each walker, by number and walker."""
    begin = _split_mix(own + np.uint64(what) * np.uint64(GOLDEN))
    number = np.arange(numbers.start + 1, numbers.stop + 1, dtype=np.uint64)[:, None]
    return (_split_mix(begin + number * np.uint64(GOLDEN)) >> np.uint64(11)) / float(1 << 53)


class _Run:
    """One simulation under way."""

    def __init__(self, simulator: Simulator, bodies: list[Cell]) -> None:
        self.s = simulator
        self.robot = simulator.start
        self.where = bodies
        self.taken = {c: k for k, c in enumerate(bodies)}
        self.left: dict[Cell, Cell] = {}
        self.speed = 0.0
        self.hemmed: Cell | None = None

    def story(self, own: Words, ticks: int) -> Story:
        """Tick on until it arrives or gives up, or the ticks are over."""
        told = Story([self.robot], [[c] for c in self.where])
        way, until = self._ask()
        at = patient = 0
        for tick in range(ticks):
            if tick % TOGETHER == 0:
                draws = _draws(own, STEPS, range(tick + 1, tick + 1 + TOGETHER)).tolist()
            self._stroll(draws[tick % TOGETHER])
            for track, c in zip(told.tracks, self.where, strict=True):
                track.append(c)
            planned = at < until
            if not (planned and self._may_enter(way[at + 1])):
                told.replans += planned or patient > 0
                way, until = self._ask()
                at = 0
            came = self.robot
            if way and self._may_enter(way[at + 1]):
                at += 1
                self.robot = way[at]
                patient = 0
                told.arrived = self.robot == self.s.goal
                self.speed = 0.0 if told.arrived else self._pace([came, *way[at : at + AHEAD + 1]])
            else:
                patient += 1
                told.waits += 1
                self.speed = 0.0
            told.robot.append(self.robot)
            told.speeds.append(self.speed)
            if told.arrived or patient > PATIENCE:
                break
        return told

    def _ask(self) -> tuple[list[Cell], int]:
        """The plan from where the robot is; what it may not enter in this tick is closed to it."""
        x, y = self.robot
        around = ((x + dx, y + dy) for dx, dy in EIGHT)
        bodies = {*self.taken, *(c for c in around if c in self.s.free and not self._may_enter(c))}
        way, until = self.s.plan(self.robot, bodies)
        if not way and self.hemmed == self.robot:
            raise NeedsRepair
        self.hemmed = None if way else self.robot
        return way, until

    def _crosses(self, c: Cell, dx: int, dy: int) -> bool:
        """Whether somebody has driven the other diagonal in this tick."""
        x, y = c
        return self.left.get((x + dx, y)) == (-dx, dy) or self.left.get((x, y + dy)) == (dx, -dy)

    def _stroll(self, draws: list[float]) -> None:
        """Every walker goes where its draw says."""
        self.left = {}
        ends = self.s.start, self.s.goal
        for k, (x, y) in enumerate(self.where):
            options = []
            for dx, dy in EIGHT:
                c = x + dx, y + dy
                may = c in self.s.free and c not in self.taken and c != self.robot and c not in ends
                if may and not (dx and dy and self._crosses((x, y), dx, dy)):
                    options.append((dx, dy))
            pick = int(draws[k] * (len(options) + 1))
            if pick:
                dx, dy = options[pick - 1]
                del self.taken[x, y]
                self.left[x, y] = dx, dy
                self.where[k] = x + dx, y + dy
                self.taken[self.where[k]] = k

    def _may_enter(self, c: Cell) -> bool:
        x, y = self.robot
        dx, dy = c[0] - x, c[1] - y
        return c in self.s.free and c not in self.taken and not (dx and dy and self._crosses((x, y), dx, dy))

    def _pace(self, way: list[Cell]) -> float:
        """Velocity at the second cell of a way."""
        steps = [(b[0] - a[0], b[1] - a[1]) for a, b in pairwise(way)]
        v = [self.speed, *(self._by_rings(c, step) for c, step in zip(way[1:], steps, strict=True))]
        for k in range(1, len(steps)):
            (ax, ay), (bx, by) = steps[k - 1], steps[k]
            cosine = (ax * bx + ay * by) / math.hypot(ax, ay) / math.hypot(bx, by)
            turn = math.degrees(math.acos(min(1.0, cosine)))
            v[k] = min(v[k], 80.0 if turn < 22.5 else 60.0 if turn < 67.5 else 20.0)
        v[-1] = 0.0
        for k, (dx, dy) in enumerate(steps):
            v[k + 1] = min(v[k + 1], v[k] + (28.0 if dx and dy else 20.0))
        for k in range(len(v) - 2, -1, -1):
            v[k] = min(v[k], v[k + 1] + BRAKING)
        return v[1]

    def _by_rings(self, c: Cell, step: Cell) -> float:
        """Velocity that obstacles around a cell allow: all in ring 1, in ring 2 those ahead."""
        x, y = c
        near = sum((x + dx, y + dy) not in self.s.free or (x + dx, y + dy) in self.taken for dx, dy in EIGHT)
        far = sum(self._in_the_way((x + dx, y + dy)) for dx, dy in AHEAD_OF[step])
        return max(V_MIN, V_MAX - DROP1 * near - DROP2 * far)

    def _in_the_way(self, c: Cell) -> bool:
        inside = 0 <= c[0] < self.s.width and 0 <= c[1] < self.s.height
        return inside and (c not in self.s.free or c in self.taken)


def _within(step: Cell, offset: Cell) -> bool:
    """Whether an offset lies within 45 degrees of a step."""
    dot = step[0] * offset[0] + step[1] * offset[1]
    squares = (step[0] ** 2 + step[1] ** 2) * (offset[0] ** 2 + offset[1] ** 2)
    return dot > 0 and 2 * dot * dot >= squares


RING_2 = [(x, y) for y in range(-2, 3) for x in range(-2, 3) if max(abs(x), abs(y)) == 2]
AHEAD_OF = {step: tuple(o for o in RING_2 if _within(step, o)) for step in EIGHT}
"""Cells of ring 2 within 45 degrees of a step."""

"""Cutting in: an adversary that waits, and at a random moment runs at the robot's path."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from lampyris._core.scalars import in_range, is_whole
from lampyris.errors import SettingError, shown
from lampyris.model.traffic import Obstacle
from lampyris.planning.field.layers import free_cells
from lampyris.sim.traffic.motion_sources import NO_LEGS, Opening
from lampyris.sim.world.trajectory import Trajectory
from lampyris.typing import BoolGrid, Floats

_TRIES = 20
"""Points of the robot's path tried at one moment before it goes on waiting."""


@dataclass(frozen=True)
class Adversary:
    """Obstacles that stand in random free places and run straight across the robot's path, ignoring the robot.

    At a random moment each runs, at exactly its top speed, at a random point of the stretch of path that the
    robot covers while the adversary runs there, so that the two meet if neither reacts. Half of them stop
    there, the others run on to the next wall. Then they wait for the next moment. They begin a run only
    where the line is free of walls; the robot they see only as a target.

    Parameters
    ----------
    top_speed : m/s.
    count : how many.
    radius : metres; None: half a cell.
    wait : seconds between two runs are drawn uniformly from 0 to twice this.
    near : metres from the robot's first path within which they wait; None: anywhere.
    runs : how often each runs; None: forever.

    Raises
    ------
    SettingError : ``CUTTER``.
    """

    top_speed: float
    count: int = 1
    radius: float | None = None
    wait: float = 10.0
    near: float | None = None
    runs: int | None = None

    def __post_init__(self) -> None:
        for name in ("top_speed", "radius", "wait", "near"):
            value = getattr(self, name)
            if value is None and name in ("radius", "near"):
                continue
            if not in_range(value, 1e-6, 1e6):
                raise SettingError("CUTTER", shown(value), where=f"cutter.{name}", allowed="1e-6 to 1e6")
        for name in ("count", "runs"):
            value = getattr(self, name)
            if value is None and name == "runs":
                continue
            if not is_whole(value, 0, 10_000):
                raise SettingError("CUTTER", shown(value), where=f"cutter.{name}", allowed="0 to 10000")

    def open(self, opening: Opening) -> RunningAdversaries:
        """Put them in their places: clear of walls, of the robot, and of the path that it has planned."""
        return RunningAdversaries(self, opening)


@dataclass
class _One:
    """One adversary: its number, when it runs, where it stands, and the run it is on."""

    number: int
    at: tuple[float, float]
    next: float
    runs: int = 0
    # The run: from when to when, whence, and with which velocity (cells/s).
    began: float = 0.0
    ends: float = -1.0
    origin: tuple[float, float] = (0.0, 0.0)
    velocity: tuple[float, float] = (0.0, 0.0)


class RunningAdversaries:
    """Adversaries at work."""

    def __init__(self, adversary: Adversary, opening: Opening) -> None:
        self.adversary, self.rng = adversary, opening.rng
        self.roster, self.scene = opening.roster, opening.scene
        grid = self.scene.grid
        self.resolution = grid.resolution
        self.radius = 0.5 * grid.resolution if adversary.radius is None else float(adversary.radius)
        # Half a cell fits every free cell in the tick model; nothing is nearer to a wall than its own size.
        self._free = free_cells(grid, self.radius)
        self._blocked = np.ascontiguousarray(grid.blocked)
        self._one: list[_One] = []
        for cell in self._places(opening):
            at = (float(cell[0]), float(cell[1]))
            obstacle = Obstacle("cutter", self.radius, False)
            number = self.roster.add(obstacle, self.radius, adversary.top_speed * (1.0 + 1e-12), 0.0, *at)
            self._one.append(_One(number, at, self._pause(0.0)))

    def _pause(self, t: float) -> float:
        return t + 2.0 * self.adversary.wait * float(self.rng.random())

    def _places(self, opening: Opening) -> list[tuple[int, int]]:
        ys, xs = np.nonzero(self._free)
        if opening.route is not None and len(xs):
            route = opening.route
            samples = np.array(
                [route.at(s) for s in np.linspace(0.0, route.length, 2 + int(route.length / self.resolution))]
            )
            distance = np.full(len(xs), np.inf)
            for x, y in samples.tolist():
                dx, dy = xs - x, ys - y
                np.minimum(distance, dx * dx + dy * dy, out=distance)
            distance = np.sqrt(distance) * self.resolution
            kept = distance > self.scene.robot.radius + self.radius + self.resolution
            if self.adversary.near is not None:
                kept &= distance <= self.adversary.near
            ys, xs = ys[kept], xs[kept]
        order = self.rng.permutation(len(xs))[: self.adversary.count].tolist()
        return [(int(xs[k]), int(ys[k])) for k in order]

    def advance(self, t0: float, t1: float, trajectory: Trajectory) -> Floats:
        """The legs from ``t0`` to ``t1``."""
        legs: list[tuple[float, ...]] = []
        for one in self._one:
            now = t0
            while now < t1:
                if now < one.ends:
                    end = min(one.ends, t1)
                    legs.append(self._leg(one, now, end))
                    if one.ends <= t1:
                        one.at = self._end_of(one)
                    now = end
                elif one.next >= t1:
                    legs.append((one.number, now, t1, *one.at, 0.0, 0.0))
                    now = t1
                elif one.next > now:
                    legs.append((one.number, now, one.next, *one.at, 0.0, 0.0))
                    now = one.next
                else:
                    self._begin(one, now, trajectory)
        return np.array(legs) if legs else NO_LEGS

    def _leg(self, one: _One, now: float, end: float) -> tuple[float, ...]:
        (x, y), (vx, vy), d = one.origin, one.velocity, now - one.began
        return (one.number, now, end, x + vx * d, y + vy * d, vx, vy)

    def _end_of(self, one: _One) -> tuple[float, float]:
        (x, y), (vx, vy), d = one.origin, one.velocity, one.ends - one.began
        return x + vx * d, y + vy * d

    def _begin(self, one: _One, now: float, trajectory: Trajectory) -> None:
        """Begin a run, or wait for another moment where no line is free."""
        on = bool(self.rng.random() < 0.5)
        one.next = self._pause(now)
        if self.adversary.runs is not None and one.runs >= self.adversary.runs:
            one.next = math.inf
            return
        target = self._target(one, now, trajectory)
        if target is None:
            one.next = max(one.next, now + 1e-3)
            return
        dx, dy = target[0] - one.at[0], target[1] - one.at[1]
        far = math.sqrt(dx * dx + dy * dy)
        share = self._clear_share(one.at, (dx, dy)) if on else 1.0
        speed = self.adversary.top_speed / self.resolution
        one.began, one.origin = now, one.at
        one.velocity = (dx / far * speed, dy / far * speed)
        one.ends = now + share * far / speed
        one.runs += 1
        one.next = max(one.next, one.ends)
        self.roster.go(one.number, now, *one.at)
        self.roster.go(one.number, one.ends, *self._end_of(one))

    def _target(self, one: _One, now: float, trajectory: Trajectory) -> tuple[float, float] | None:
        """A point of the robot's path that it reaches about when the adversary does, with a free line to it."""
        s, v = trajectory.at(now)
        speed = self.adversary.top_speed
        for u in self.rng.random(_TRIES).tolist():
            there = s
            for _ in range(3):  # a few rounds are enough for a moving target
                x, y = trajectory.route.at(there)
                dx, dy = x - one.at[0], y - one.at[1]
                far = math.sqrt(dx * dx + dy * dy)
                there = s + 2.0 * u * max(v, 0.1 * self.scene.robot.v_max) * far * self.resolution / speed
            x, y = trajectory.route.at(there)
            dx, dy = x - one.at[0], y - one.at[1]
            if dx * dx + dy * dy > 1e-6 and self._clear(one.at, (dx, dy), 1.0):
                return x, y
        return None

    def _clear_share(self, at: tuple[float, float], d: tuple[float, float]) -> float:
        """How many times the vector ``d`` can be run before a wall or the edge of the map; >= 1."""
        share = 1.0
        while share < 16.0 and self._clear(at, d, share + 0.25):
            share += 0.25
        return share

    def _clear(self, at: tuple[float, float], d: tuple[float, float], share: float) -> bool:
        """Whether the disc can run from ``at`` along ``share`` times ``d`` without touching a wall."""
        return line_is_clear(
            self._blocked, at, (at[0] + share * d[0], at[1] + share * d[1]), self.radius / self.resolution
        )


def line_is_clear(blocked: BoolGrid, a: tuple[float, float], b: tuple[float, float], radius: float) -> bool:
    """Whether a disc of ``radius`` cells can move straight from a to b, its centre on the map, off all walls.

    Touching a wall is allowed, by a billionth of a cell.
    """
    height, width = blocked.shape
    if not (-0.5 <= b[0] <= width - 0.5 and -0.5 <= b[1] <= height - 0.5):
        return False
    far = radius + 1.0
    x0, x1 = max(math.floor(min(a[0], b[0]) - far), 0), math.ceil(max(a[0], b[0]) + far)
    y0, y1 = max(math.floor(min(a[1], b[1]) - far), 0), math.ceil(max(a[1], b[1]) + far)
    ys, xs = np.nonzero(blocked[y0 : y1 + 1, x0 : x1 + 1])
    if not len(xs):
        return True
    squared = square_distances(a, b, (xs + x0).astype(np.float64), (ys + y0).astype(np.float64))
    reach = max(radius - 1e-9, 0.0)
    return not bool((squared < reach * reach).any()) if reach > 0.0 else not bool((squared <= 0.0).any())


def square_distances(a: tuple[float, float], b: tuple[float, float], xs: Floats, ys: Floats) -> Floats:
    """Squared distance from the line a to b to the unit squares around (xs, ys), cells; (n,).

    A line and a square are nearest at a corner of the square or at an end of the line, or they cross.
    """
    (ax, ay), (bx, by) = a, b
    dx, dy = bx - ax, by - ay
    length = dx * dx + dy * dy
    best = np.full(len(xs), np.inf)
    for px, py in (a, b):
        gx, gy = np.maximum(np.abs(xs - px) - 0.5, 0.0), np.maximum(np.abs(ys - py) - 0.5, 0.0)
        np.minimum(best, gx * gx + gy * gy, out=best)
    if length == 0.0:
        return best
    sides = []
    for cx, cy in ((-0.5, -0.5), (0.5, -0.5), (-0.5, 0.5), (0.5, 0.5)):
        qx, qy = xs + cx - ax, ys + cy - ay
        along = np.clip((qx * dx + qy * dy) / length, 0.0, 1.0)
        ex, ey = qx - along * dx, qy - along * dy
        np.minimum(best, ex * ex + ey * ey, out=best)
        sides.append(qx * dy - qy * dx)
    side = np.stack(sides)
    # The line's carrier separates no two corners: no crossing. Otherwise the boxes must meet, too.
    across = (side.min(axis=0) < -1e-12) & (side.max(axis=0) > 1e-12)
    box = (
        (xs + 0.5 > min(ax, bx))
        & (xs - 0.5 < max(ax, bx))
        & (ys + 0.5 > min(ay, by))
        & (ys - 0.5 < max(ay, by))
    )
    best[across & box] = 0.0
    return best

"""Crowd motion: the traffic of the tick model (:mod:`lampyris.sim.traffic`) in continuous time.

A tick lasts ``resolution / obstacle_speed`` seconds, and during it every body moves straight from cell to
cell. A diagonal is the square root of two longer in the same time, so the top speed of a body is so much
above ``obstacle_speed``; only a robot that reckons with that is safe. What the tick model calls radius 0 is
a disc that fills its cell, half a cell in radius.

Those that yield do so for the robot's disc where it is and wherever it can come to along its way within the
tick and the braking after it, whatever it does. They do not begin a step that would take them nearer to one
of these places than the two radii allow; a step away is allowed. So none of them runs into a robot that
stands. Those that do not yield step as if there were no robot.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from lampyris.errors import SettingError
from lampyris.model.movers import Track
from lampyris.model.scene import Scene
from lampyris.model.traffic import Recorded
from lampyris.sim.going import Going
from lampyris.sim.sources import NO_LEGS, Roster
from lampyris.sim.space import Shape, Space, Step, robot_shape
from lampyris.sim.traffic import Crowd, open_traffic
from lampyris.sim.world import World
from lampyris.typing import BoolGrid, Floats

DIAGONAL = math.sqrt(2.0) * (1.0 + 1e-12)
"""How much faster than a straight step a diagonal one is; and a rounding, so that no leg is above it."""


class RoadWorld(World):
    """A world in which the robot is anywhere on its road, not on a cell.

    Attributes
    ----------
    points : where the robot may come to before the tick is over and it has braked (cells).
    """

    def __init__(self, space: Space, robot_shape: Shape, robot: int, radius: float) -> None:
        super().__init__(space, robot_shape, robot)
        self._radius = radius  # of the robot, cells
        self._apart = 0.0
        self.points: list[tuple[float, float]] = []
        self.radii: list[float] = []  # of the bodies, cells

    def put_on_road(self, points: list[tuple[float, float]], apart: float) -> None:
        """The robot may come to any of these points (cells), each no farther than ``apart`` from the next."""
        self.points, self._apart = points, apart

    def may_step(self, body: int, step: Step, yields: bool) -> bool:
        """As in the tick model; and off the robot's road, for one that yields."""
        return super().may_step(body, step, yields) and not (yields and self._meets(body, step))

    def options(self, body: int) -> list[Step]:
        """Every step a yielding obstacle may make now, staying left out."""
        found = super().options(body)
        if not self.points or not self.shapes[body].small:
            return found  # a large one has been asked by may_step
        return [s for s in found if not self._meets(body, s)]

    def room(self, shape: Shape) -> BoolGrid:
        """Where a body of that shape could be put now without meeting anybody, the robot on its road too."""
        self.robot_cover = self._cover()
        mask = super().room(shape)
        self.robot_cover = frozenset()
        return mask

    def _meets(self, body: int, step: Step) -> bool:
        """Whether it would come nearer to a point of the road than the two radii allow.

        Going away is always allowed: the distance to a robot that stands does not shrink then.
        """
        if not self.points:
            return False
        x, y = self.space.cell(self.where[body])
        dx, dy = step[1], step[2]
        length = dx * dx + dy * dy
        far = self._radius + self.radii[body] + 0.5 * self._apart
        squared = far * far
        for qx, qy in self.points:
            ax, ay = qx - x, qy - y
            along = ax * dx + ay * dy
            if along <= 0.0:
                continue
            share = min(along / length, 1.0)
            ex, ey = ax - share * dx, ay - share * dy
            if ex * ex + ey * ey < squared:
                return True
        return False

    def _cover(self) -> frozenset[int]:
        """Numbers of the cells that the robot's disc touches anywhere on its road."""
        far = self._radius + 0.5 * self._apart
        number, width, height = self.space.number, self.space.width, self.space.height
        cells = set()
        for px, py in self.points:
            for y in range(
                max(math.ceil(py - far - 0.5), 0), min(math.floor(py + far + 0.5), height - 1) + 1
            ):
                gy = max(abs(y - py) - 0.5, 0.0)
                for x in range(
                    max(math.ceil(px - far - 0.5), 0), min(math.floor(px + far + 0.5), width - 1) + 1
                ):
                    gx = max(abs(x - px) - 0.5, 0.0)
                    if gx * gx + gy * gy <= far * far:
                        cells.add(number((x, y)))
        return frozenset(cells)


@dataclass(frozen=True)
class CrowdMotion:
    """The scene's own traffic.

    Parameters
    ----------
    obstacle_speed : m/s of a straight step; None: the robot's top speed, so that, as in the tick model, a
        step of anybody's takes one tick.
    seed : root of the draws; specification k has the same stream as in the tick model.
    """

    obstacle_speed: float | None
    seed: int

    def open(self, scene: Scene, roster: Roster) -> RunningCrowd:
        """Place everybody.

        Raises
        ------
        SceneError : see :func:`lampyris.sim.traffic.open_traffic`.
        SettingError : ``OBSTACLE_SPEED``.
        """
        speed = scene.robot.v_max if self.obstacle_speed is None else self.obstacle_speed
        real = isinstance(speed, int | float | np.integer | np.floating) and not isinstance(speed, bool)
        if not (real and 1e-6 <= speed <= 1e6):
            raise SettingError(
                "OBSTACLE_SPEED", f"{speed!r}", where="obstacle_speed", allowed="1e-6 to 1e6 m/s"
            )
        space = Space(scene.grid)
        radius = scene.robot.radius / scene.grid.resolution
        world = RoadWorld(space, robot_shape(scene, space), space.number(scene.start), radius)
        crowd = open_traffic(scene, world, self.seed)
        world.robot_cover = frozenset()  # from here on it is on its road
        return RunningCrowd(scene, roster, crowd, world, float(speed))


class RunningCrowd:
    """The crowd at work.

    Attributes
    ----------
    crowd : the tick model's bodies and drivers.
    tick : seconds a tick lasts.
    """

    def __init__(self, scene: Scene, roster: Roster, crowd: Crowd, world: RoadWorld, speed: float) -> None:
        self.scene, self.roster, self.crowd, self.world = scene, roster, crowd, world
        self.resolution = scene.grid.resolution
        self.tick = self.resolution / speed
        self.top_speed = DIAGONAL * speed
        self._now = 0
        self._numbers: list[int] = []
        self._legs: list[Floats] = []
        for body in range(len(crowd.bodies)):
            self._number(body, 0.0)
        for body, spec in [] if crowd.recording is None else crowd.recording.tracks:
            self.roster.whole[self._numbers[body]] = self._whole(spec)

    def _number(self, body: int, t: float) -> None:
        one = self.crowd.bodies[body]
        radius = max(one.radius, 0.5 * self.resolution)
        x, y = self.world.space.cell(self.world.where[body])
        self.world.radii.append(radius / self.resolution)
        self._numbers.append(self.roster.add(one, radius, self.top_speed, t, float(x), float(y)))

    def _whole(self, spec: Recorded) -> Track:
        n = len(spec.track)
        radius = max(spec.radius, 0.5 * self.resolution)
        return Track(
            np.arange(n, dtype=np.float64) * self.tick,
            np.array(spec.track, dtype=np.float64),
            radius,
            self.top_speed,
        )

    def advance(self, t0: float, t1: float, going: Going) -> Floats:
        """The legs from ``t0`` to ``t1``; a tick that begins before ``t1`` is decided now."""
        if not self.crowd.bodies and not self.crowd.walkers:
            return NO_LEGS
        self._legs = [legs for legs in self._legs if legs[0, 2] > t0]
        while self._now * self.tick < t1:
            made = self._one_tick(going)
            if len(made):
                self._legs.append(made)
        if len(self._legs) == 1:
            return self._legs[0]
        return np.concatenate(self._legs) if self._legs else NO_LEGS

    def tick_ends(self, t: float) -> float:
        """When the tick that has been decided last is over; ``t`` itself if nobody yields."""
        if not any(b.yields for b in self.crowd.bodies) and not self.crowd.walkers:
            return t
        return max(self._now * self.tick, t)

    def _one_tick(self, going: Going) -> Floats:
        began, ends = self._now * self.tick, (self._now + 1) * self.tick
        self._now += 1
        self._see(began, going)
        space, where = self.world.space, self.world.where
        before = [space.cell(n) for n in where]
        fresh = self.crowd.advance(self._now)
        for body in fresh:
            # It is there from the beginning of the tick on: that is when its place was found to be free.
            self._number(body, began)
            before.append(space.cell(where[body]))
        if not before:
            return NO_LEGS
        legs = np.empty((len(before), 7))
        numbers = np.array(self._numbers)
        now = np.array([space.cell(n) for n in where], dtype=np.float64)
        old = np.array(before, dtype=np.float64)
        legs[:, 0], legs[:, 1], legs[:, 2] = numbers, began, ends
        legs[:, 3:5] = old
        legs[:, 5:7] = (now - old) / (ends - began)
        go = self.roster.go
        for number, (x, y) in zip(self._numbers, now.tolist(), strict=True):
            go(number, ends, x, y)
        return legs

    def _see(self, t: float, going: Going) -> None:
        """Tell the world where the robot is and how far it can come; nothing if nobody near would yield."""
        s, v = going.at(t)
        robot, route = self.scene.robot, going.route
        quick = min(v + robot.a_max * self.tick, robot.v_max)
        ahead = min(quick * self.tick + 0.5 * quick * quick / robot.d_max, route.length - s)
        x, y = route.at(s)
        far = (ahead + robot.radius) / self.resolution + 3.0
        cell = self.world.space.cell
        appears = any(w.spec.rate is not None for w in self.crowd.walkers)
        near = appears or any(
            b.yields and abs(c[0] - x) < far + reach and abs(c[1] - y) < far + reach
            for b, c, reach in (
                (b, cell(n), b.radius / self.resolution)
                for b, n in zip(self.crowd.bodies, self.world.where, strict=True)
            )
        )
        if not near:
            self.world.put_on_road([], 0.0)
            return
        steps = max(math.ceil(ahead / (0.25 * self.resolution)), 1)
        points = [(x, y)] + [route.at(s + ahead * k / steps) for k in range(1, steps + 1)]
        self.world.put_on_road(points, ahead / steps / self.resolution)

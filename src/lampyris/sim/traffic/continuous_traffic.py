"""Traffic motion: the traffic of the tick model (:mod:`lampyris.sim.traffic.traffic`) in continuous time.

A tick lasts ``resolution / obstacle_speed`` seconds, and during it every obstacle moves straight from cell to
cell. A diagonal is the square root of two longer in the same time, so the top speed of an obstacle is so much
above ``obstacle_speed``; only a robot that reckons with that is safe. What the tick model calls radius 0 is
a disc that fills its cell, half a cell in radius.

Those that yield look where the robot's disc is and where its present speed takes it within the tick, and do
not begin a step that would take them nearer to it than the two radii allow; a step away is allowed. One that
is already on a step halts as soon as the robot is so near that they might touch within the period; in the
next tick it goes on if the robot has gone, or else back. So none of them runs into a robot that stands, and
nobody stands in its way only because it stands there too. Those that do not yield step as if there were no
robot.

No two obstacles meet between ticks either (:mod:`lampyris.sim.traffic.separation`): a step is made only if the whole of
it is clear of what the others do in the same tick, and an obstacle that would meet one that has halted halts, too.
Recorded obstacles wait for nobody; all others keep off everything that their discs ever pass over. Only two
recorded ones may come nearer to each other than their radii: their tracks are given, cell by cell.

A polygon keeps these distances for the disc around it. During a step it turns at an even rate to the direction in which
it moves, recorded ones to the yaw of their track where one is given; one that halts stops turning, too.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lampyris._core import elementary
from lampyris._core.scalars import in_range
from lampyris.errors import SettingError, shown
from lampyris.model.obstacles import Track
from lampyris.model.scene import Scene
from lampyris.model.traffic import Recorded
from lampyris.sim.traffic.headings import first_headings, in_cells
from lampyris.sim.traffic.motion_sources import NO_LEGS, ROUNDING, SPIN, YAW, Roster
from lampyris.sim.traffic.separation import Motions, beside_lanes
from lampyris.sim.traffic.traffic import Shuttle, Traffic, open_traffic
from lampyris.sim.world.cell_index import CellIndex, Shape, Step, robot_shape
from lampyris.sim.world.pose_lookup import PoseLookup
from lampyris.sim.world.trajectory import Trajectory
from lampyris.sim.world.world import Occupancy
from lampyris.typing import BoolGrid, Floats, Points

DIAGONAL = math.sqrt(2.0) * (1.0 + 1e-12)
"""How much faster than a straight step a diagonal one is; and a rounding, so that no leg is above it."""


class RoadOccupancy(Occupancy):
    """A world in which the robot is anywhere on its road, not on a cell.

    Attributes
    ----------
    road : where the robot may come to before the tick is over and it has braked, whatever it does (cells).
    soon : as many of these points as its present speed takes it to within the tick.
    late : obstacles that have not finished their last step.
    motions : where every obstacle is and where it goes in this tick.

    Parameters
    ----------
    radius : of the robot, cells.
    resolution : metres a cell.
    """

    def __init__(
        self, space: CellIndex, robot_shape: Shape, robot: int, radius: float, resolution: float
    ) -> None:
        self.motions = Motions()
        super().__init__(space, robot_shape, robot)
        self._radius = radius  # of the robot, cells
        self._resolution = resolution
        self._apart = 0.0
        self.road: list[tuple[float, float]] = []
        self.soon: list[tuple[float, float]] = []
        self.late: set[int] = set()

    def put_on_road(self, road: list[tuple[float, float]], soon: int, apart: float) -> None:
        """The robot may come to any of these points, each no farther than ``apart`` cells from the next."""
        self.road, self.soon, self._apart = road, road[:soon], apart

    def disc(self, radius: float) -> float:
        """The radius of an obstacle's disc, cells. A small obstacle of the tick model fills its cell."""
        return max(radius / self._resolution, 0.5)

    def add(self, shape: Shape, number: int) -> int:
        """A new obstacle on a cell; its index."""
        x, y = self.space.cell(number)
        self.motions.add(float(x), float(y), self.disc(shape.radius))
        return super().add(shape, number)

    def add_small(self, shape: Shape, numbers: Sequence[int]) -> Sequence[int]:
        """New obstacles of one cell, each on a cell of its own; their indices."""
        return [self.add(shape, number) for number in numbers]

    def move(self, obstacle: int, step: Step) -> None:
        """Make a legal step."""
        super().move(obstacle, step)
        self.motions.to[obstacle] = self._centre(step[0])

    def _centre(self, number: int) -> tuple[float, float]:
        x, y = self.space.cell(number)
        return float(x), float(y)

    def lane_bars(self, tracks: Sequence[Recorded], radius: float) -> BoolGrid | None:
        """Where obstacles of that radius (metres) would meet a recorded one; None: there is none."""
        if not tracks:
            return None
        return beside_lanes(self.space, tracks, self.disc(radius), self._resolution)

    def may_step(self, obstacle: int, step: Step, yields: bool) -> bool:
        """As in the tick model; clear of all other obstacles on the whole of it; off the road, if it yields."""
        if obstacle in self.late or (yields and self.meets(obstacle, step)):
            return False
        return super().may_step(obstacle, step, yields) and self.motions.clear(
            obstacle, self._centre(step[0])
        )

    def options(self, obstacle: int) -> list[Step]:
        """Every step a yielding obstacle may make now, staying left out."""
        if obstacle in self.late:
            return []
        found = super().options(obstacle)
        if self.motions.near(obstacle):
            clear, centre = self.motions.clear, self._centre
            found = [s for s in found if clear(obstacle, centre(s[0]))]
        if self.soon:
            found = [s for s in found if not self.meets(obstacle, s)]
        return found

    def room(self, shape: Shape) -> BoolGrid:
        """Where an obstacle of that shape could be put now without meeting another, the robot on its road too."""
        self.robot_cover = self._cover()
        mask = super().room(shape)
        self.robot_cover = frozenset()
        self.motions.room(mask, self.disc(shape.radius))  # it is there from the beginning of the tick on
        return mask

    def meets(self, obstacle: int, step: Step) -> bool:
        """Whether it would come nearer to where the robot soon is than the two radii allow.

        Going away is always allowed: the distance to a robot that stands does not shrink then.
        """
        if not self.soon:
            return False
        x, y = self.space.cell(self.where[obstacle])
        dx, dy = step[1], step[2]
        length = dx * dx + dy * dy
        far = self._radius + self.motions.radii[obstacle] + 0.5 * self._apart
        squared = far * far
        for qx, qy in self.soon:
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
        for px, py in self.road:
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
class TrafficMotion:
    """The scene's own traffic.

    Parameters
    ----------
    obstacle_speed : m/s of a straight step; None: the robot's top speed, so that, as in the tick model, a
        step takes one tick.
    seed : root of the draws; specification k has the same stream as in the tick model.
    """

    obstacle_speed: float | None
    seed: int

    def open(self, scene: Scene, roster: Roster) -> RunningTraffic:
        """Place every obstacle.

        Raises
        ------
        SceneError : see :func:`lampyris.sim.traffic.traffic.open_traffic`.
        SettingError : ``OBSTACLE_SPEED``.
        """
        speed = scene.robot.v_max if self.obstacle_speed is None else self.obstacle_speed
        if not in_range(speed, 1e-6, 1e6):
            raise SettingError(
                "OBSTACLE_SPEED", shown(speed), where="obstacle_speed", allowed="1e-6 to 1e6 m/s"
            )
        space = CellIndex(scene.grid)
        radius = scene.robot.radius / scene.grid.resolution
        world = RoadOccupancy(
            space, robot_shape(scene, space), space.number(scene.start), radius, scene.grid.resolution
        )
        traffic = open_traffic(scene, world, self.seed)
        world.robot_cover = frozenset()  # from here on it is on its road
        return RunningTraffic(scene, roster, traffic, world, float(speed))


class RunningTraffic:
    """The tick model's traffic, moving in continuous time.

    Attributes
    ----------
    traffic : the tick model's obstacles and drivers.
    tick : seconds a tick lasts.
    """

    def __init__(
        self, scene: Scene, roster: Roster, traffic: Traffic, world: RoadOccupancy, speed: float
    ) -> None:
        self.scene, self.roster, self.traffic, self.world = scene, roster, traffic, world
        self.resolution = scene.grid.resolution
        self.tick = self.resolution / speed
        self.top_speed = DIAGONAL * speed
        self.ticks = 0
        self.numbers = np.zeros(0, dtype=np.int64)
        self.at, self.going = np.zeros((0, 2)), np.zeros((0, 2))  # cells, and cells a second
        self.came: list[int] = []  # the cell before the last step
        self.reach = np.zeros(0)  # of both discs, cells
        self.yields = np.zeros(0, dtype=np.bool_)
        # Of polygons, radians counterclockwise: heading, yaw rate, and heading at the end of the tick.
        self._yaw, self._spin, self._to_yaw = np.zeros(0), np.zeros(0), np.zeros(0)
        self.turning = np.zeros(0, dtype=np.bool_)
        self.stopped: set[int] = set()
        self.to = self.at  # where each is when the tick is over, if nothing halts it
        self.robot = (0.0, 0.0)  # where the robot is at the beginning of the period
        self.nearest = self.halts = self.sees = 0.0  # see _begin_period and _to_robot
        self._minds: list[tuple[float, bool]] = []  # both radii, and whether it yields
        self.appears = any(w.spec.rate is not None for w in traffic.walkers)
        self._admit(0.0)
        for obstacle, spec in [] if traffic.recording is None else traffic.recording.tracks:
            self.roster.whole[int(self.numbers[obstacle])] = self._whole(spec)

    def _admit(self, t: float) -> None:
        """Take in the obstacles that are new in the traffic."""
        known = len(self.numbers)
        if known == len(self.traffic.obstacles):
            return
        self.nearest = -math.inf
        headed = known == 0 and any(one.outline is not None for one in self.traffic.obstacles)
        yaws = first_headings(self.traffic, self.scene.grid) if headed else {}  # only walkers appear later
        for one, number in zip(self.traffic.obstacles[known:], self.world.where[known:], strict=True):
            radius = max(one.radius, 0.5 * self.resolution)
            x, y = self.world.space.cell(number)
            yaw = yaws.get(len(self.came), 0.0) if one.outline is not None else 0.0
            added = self.roster.add(one, radius, self.top_speed, t, float(x), float(y), yaw)
            self._yaw, self._to_yaw = np.append(self._yaw, yaw), np.append(self._to_yaw, yaw)
            self._spin = np.append(self._spin, 0.0)
            self.turning = np.append(self.turning, one.outline is not None)
            self.numbers = np.append(self.numbers, added)
            self.at = np.concatenate((self.at, np.array([[x, y]], dtype=np.float64)))
            self.going = np.concatenate((self.going, np.zeros((1, 2))))
            self.came.append(number)
            reach = (radius + self.scene.robot.radius) / self.resolution
            self.reach = np.append(self.reach, reach)
            self.yields = np.append(self.yields, one.yields)
            self._minds.append((reach, one.yields))
            if one.kind == "recorded":
                self.world.motions.fixed.add(len(self.came) - 1)

    def _turn(self) -> None:
        """A tick begins: where polygons turn to, the shorter way."""
        self._to_yaw = self._yaw.copy()
        moving = np.flatnonzero(self.turning & (self.going != 0.0).any(axis=1))
        ahead = elementary.atan2(0.0 - self.going[moving, 1], self.going[moving, 0])
        for obstacle, yaw in zip(moving.tolist(), ahead.tolist(), strict=True):
            self._turn_to(obstacle, yaw)
        for obstacle, spec in () if self.traffic.recording is None else self.traffic.recording.tracks:
            if spec.yaw:
                self._turn_to(
                    obstacle, in_cells(spec.yaw[min(self.ticks, len(spec.yaw) - 1)], self.scene.grid)
                )
        self._spin = (self._to_yaw - self._yaw) / self.tick

    def _turn_to(self, obstacle: int, yaw: float) -> None:
        now = float(self._yaw[obstacle])
        self._to_yaw[obstacle] = now + math.remainder(yaw - now, 2.0 * math.pi)

    def _whole(self, spec: Recorded) -> Track:
        t = np.arange(len(spec.track), dtype=np.float64) * self.tick
        radius = max(spec.radius, 0.5 * self.resolution)
        return Track(t, np.array(spec.track, dtype=np.float64), radius, self.top_speed)

    def advance(self, t0: float, t1: float, trajectory: Trajectory) -> Floats:
        """The legs from ``t0`` to ``t1``, tick by tick; a tick that begins before ``t1`` is decided now."""
        if not self.traffic.obstacles and not self.traffic.walkers:
            return NO_LEGS
        tables = []
        t = t0
        self._begin_period(t1 - t0, trajectory)
        while t < t1:
            if self.nearest < self.sees:
                self.nearest = self._to_robot()
            if self.ticks * self.tick <= t:
                self.begin_tick(self.ticks * self.tick, trajectory)
            end = min(self.ticks * self.tick, t1)
            if end > t and len(self.numbers):
                tables.append(self._walk(t, end, trajectory))
            t = end
            self.nearest -= 1.0 + 1e-9  # along an axis an obstacle goes a cell a tick at most
        return tables[0] if len(tables) == 1 else np.concatenate(tables) if tables else NO_LEGS

    def _walk(self, t: float, end: float, trajectory: Trajectory) -> Floats:
        """Every obstacle moves on from ``t`` to ``end``, which is no later than the tick's end."""
        speed, spin = self.going, self._spin
        stopping = self._stopping(t, end, trajectory)
        if stopping or self.world.late:
            stopping = self._settle(stopping, end - t)
            speed = speed.copy()
            speed[stopping] = 0.0
            spin = spin.copy()
            spin[stopping] = 0.0
        if stopping or self.stopped:
            for obstacle in sorted(self.stopped.symmetric_difference(stopping)):
                at, yaw = self.at[obstacle].tolist(), float(self._yaw[obstacle])
                self.roster.go(int(self.numbers[obstacle]), t, at[0], at[1], yaw)
            self.stopped = set(stopping)
            self.world.late |= self.stopped
        headed = bool(self.turning.any())
        legs = np.empty((len(self.numbers), 9 if headed else 7))
        legs[:, 0], legs[:, 1], legs[:, 2] = self.numbers, t, end
        legs[:, 3:5], legs[:, 5:7] = self.at, speed
        self.at = self.at + speed * (end - t)
        if headed:
            legs[:, YAW], legs[:, SPIN] = self._yaw, spin
            self._yaw = self._yaw + spin * (end - t)
        if end >= self.ticks * self.tick:
            self._arrive(end)
        return legs

    def _settle(self, stopping: list[int], seconds: float) -> list[int]:
        """Those that halt for the robot, and those that halt because they would meet one who is late."""
        motions = self.world.motions
        motions.begin(_pairs(self.at))
        motions.to = _pairs(self.at + self.going * seconds)
        for obstacle in stopping:
            motions.to[obstacle] = motions.at[obstacle]
        return sorted(motions.settle(self.world.late.union(stopping)).union(stopping))

    def _arrive(self, t: float) -> None:
        """The tick is over: who was not halted is in the middle of its cell."""
        at, yaw = self.to, self._to_yaw
        if self.world.late:
            late = sorted(self.world.late)
            at, yaw = at.copy(), yaw.copy()
            at[late], yaw[late] = self.at[late], self._yaw[late]
        self.at, self._yaw = at, yaw
        rows = zip(self.numbers.tolist(), self.at.tolist(), self._yaw.tolist(), strict=True)
        for number, (x, y), heading in rows:
            self.roster.go(number, t, x, y, heading)

    def _stopping(self, t: float, end: float, trajectory: Trajectory) -> list[int]:
        """Obstacles that yield and might come to touch the robot before ``end``, if they go on towards it."""
        if self.nearest >= self.halts:
            return []
        (s0, v0), (s1, v1) = trajectory.at(t), trajectory.at(end)
        q0 = np.array(trajectory.route.at(s0))
        away = q0 - self.at
        # Nobody is nearer in the end than this allows.
        both = self.top_speed + max(v0, v1) + self.scene.robot.a_max * (end - t)
        near = self.reach + both * (end - t) / self.resolution
        close = self.yields & ((away * away).sum(axis=1) < near * near)
        if not close.any():
            return []
        if isinstance(trajectory.route, PoseLookup):
            route, ahead = trajectory.route, self.at[close] + self.going[close] * (end - t)
            nearer = comes_nearer(route, s0, self.at[close], ahead)
            nearer |= comes_nearer(route, s1, self.at[close], ahead)
            near_ones: list[int] = np.flatnonzero(close)[nearer].tolist()
            return near_ones
        towards = (away * self.going).sum(axis=1) > 0.0
        towards |= ((np.array(trajectory.route.at(s1)) - self.at) * self.going).sum(axis=1) > 0.0
        found: list[int] = np.flatnonzero(close & towards).tolist()
        return found

    def begin_tick(self, t: float, trajectory: Trajectory) -> None:
        """A tick begins: who is late goes on or back, all others choose a step."""
        self.ticks += 1
        self._see(t, trajectory)
        self.world.motions.begin(_pairs(self.at))
        still = self._bring_back(t, trajectory)
        where = self.world.where
        before = list(where)
        self.traffic.advance(self.ticks)
        self.world.late = still
        for obstacle, number in enumerate(before):
            if where[obstacle] != number:
                self.came[obstacle] = number
        # One that appears is there from the beginning of the tick on: that is when its place was free.
        self._admit(t)
        self.to = np.array(self.world.motions.to).reshape(-1, 2)
        for obstacle in self.world.motions.fixed:  # bits: each sets its own row
            self.to[obstacle] = self.world.space.cell(where[obstacle])
        self.going = (self.to - self.at) / self.tick
        if self.turning.any():
            self._turn()

    def _bring_back(self, t: float, trajectory: Trajectory) -> set[int]:
        """Those that are late finish their step, or go back if that is towards a robot that is near.

        Those that can do neither without a collision stay where they are: these are returned.
        """
        world, cell = self.world, self.world.space.cell
        if not world.late:
            return set()
        route, s = trajectory.route, trajectory.at(t)[0]
        qx, qy = route.at(s)
        still: set[int] = set()
        for obstacle in sorted(world.late):
            number, came = world.where[obstacle], self.came[obstacle]
            (x1, y1), (x0, y0) = cell(number), cell(came)
            ax, ay = self.at[obstacle].tolist()
            near = self.reach[obstacle] + 1.5
            if isinstance(route, PoseLookup):
                places = np.array([(ax, ay), (x1, y1)], dtype=np.float64)
                towards = bool(comes_nearer(route, s, places[:1], places[1:])[0])
            else:
                towards = (qx - ax) * (x1 - ax) + (qy - ay) * (y1 - ay) > 0.0
            met = towards and (qx - ax) * (qx - ax) + (qy - ay) * (qy - ay) <= near * near
            met = met and bool(self.yields[obstacle])
            ahead, home = (float(x1), float(y1)), (float(x0), float(y0))
            on = world.motions.clear(obstacle, ahead)
            back: Step = (came, x0 - x1, y0 - y1)
            may = (met or not on) and came != number and Occupancy.may_step(world, obstacle, back, False)
            if not (may and world.motions.clear(obstacle, home)):
                if on:
                    world.motions.to[obstacle] = ahead
                else:
                    still.add(obstacle)
                continue
            world.move(obstacle, back)
            self.came[obstacle] = number
            for driver in self.traffic.drivers:
                if isinstance(driver, Shuttle) and driver.obstacle == obstacle:
                    # It may have turned round at the end of its route meanwhile: asked is where it came from.
                    before = driver.at - 1
                    driver.at = before if before >= 0 and driver.route[before] == came else driver.at + 1
        return still

    def _begin_period(self, seconds: float, trajectory: Trajectory) -> None:
        """From which distances on (cells, beyond both radii) no obstacle reacts to the robot within a period.

        What :meth:`_see` and :meth:`_stopping` look at is nearer than that to where the robot is at the
        beginning of the period; :data:`ROUNDING` makes up for all rounding.
        """
        first, last, robot = trajectory.segments[0], trajectory.segments[-1], self.scene.robot
        v = max(max(one.v, one.after(one.end)[1]) for one in trajectory.segments)
        quick = min(v + robot.a_max * self.tick, robot.v_max)
        seen = (quick * self.tick + 0.5 * quick * quick / robot.d_max) / self.resolution + 3.0
        step = min(seconds, self.tick)
        halts = (self.top_speed + v + robot.a_max * step) * step / self.resolution
        driven = (last.after(last.end)[0] - first.s) / self.resolution + ROUNDING
        self.halts, self.sees = driven + halts, driven + max(seen, halts)
        self.robot = trajectory.route.at(first.s)
        self.nearest = -math.inf

    def _to_robot(self) -> float:
        """Distance along an axis from the nearest obstacle that yields to the robot, beyond both radii."""
        (qx, qy), nearest = self.robot, math.inf
        for obstacle, (x, y) in enumerate(self.at.tolist()):
            reach, yields = self._minds[obstacle]
            if yields:
                nearest = min(nearest, max(abs(x - qx), abs(y - qy)) - reach)
                if nearest < self.halts:
                    break
        return nearest

    def _see(self, t: float, trajectory: Trajectory) -> None:
        """Tell the world where the robot is and how far it can come; nothing if nobody near would yield."""
        if self.nearest >= self.sees and not self.appears:
            self.world.put_on_road([], 0, 0.0)
            return
        s, v = trajectory.at(t)
        robot, route = self.scene.robot, trajectory.route
        quick = min(v + robot.a_max * self.tick, robot.v_max)
        ahead = min(quick * self.tick + 0.5 * quick * quick / robot.d_max, route.length - s)
        x, y = route.at(s)
        far = ahead / self.resolution + 3.0
        d = np.abs(self.at - (x, y)).max(axis=1) - far
        if not (self.appears or (self.yields & (d < self.reach)).any()):
            self.world.put_on_road([], 0, 0.0)
            return
        steps = max(math.ceil(ahead / (0.25 * self.resolution)), 1)
        points = [(x, y)] + [route.at(s + ahead * k / steps) for k in range(1, steps + 1)]
        soon = 1 if ahead <= 0.0 else 1 + min(math.ceil(steps * v * self.tick / ahead), steps)
        self.world.put_on_road(points, soon, ahead / steps / self.resolution)


def comes_nearer(route: PoseLookup, s: float, at: Points, to: Points) -> NDArray[np.bool_]:
    """Of discs that move straight those that come nearer to the outline of a robot with a heading; bool (n,).

    A disc beside a long robot may come nearer to its front while it goes away from its base.
    """
    before = route.gaps(s, at)
    nearer: NDArray[np.bool_] = np.zeros(len(at), dtype=np.bool_)
    for share in (0.25, 0.5, 0.75, 1.0):
        nearer |= route.gaps(s, at + share * (to - at)) < before
    return nearer


def _pairs(places: Points) -> list[tuple[float, float]]:
    """Rows of an array (n, 2) as pairs."""
    return [(x, y) for x, y in places.tolist()]

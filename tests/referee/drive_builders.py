"""Drives made by hand: lines and quarter circles on whole cells, stretches of random accelerations."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from lampyris.model.curve import Curve
from lampyris.model.drive import Drive, Moment
from lampyris.model.grid import Grid
from lampyris.model.obstacles import Track
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.model.trace import Outcome
from lampyris.model.traffic import Obstacle

PERIOD = 0.1


@dataclass
class Turtle:
    """Draws a curve in whole cells: forward, round a quarter circle, or a turn on the spot."""

    x: float
    y: float
    hx: float
    hy: float
    resolution: float

    def __post_init__(self) -> None:
        self.xy: list[tuple[float, float]] = []
        self.heading: list[tuple[float, float]] = []
        self.lengths: list[float] = []
        self.curvature: list[float] = []
        self.stops: list[int] = []

    def forward(self, cells: float) -> None:
        self._piece(cells * self.resolution, 0.0)
        self.x, self.y = self.x + cells * self.hx, self.y + cells * self.hy

    def round(self, radius: float, side: int) -> None:
        """A quarter circle, to the right on the screen for side 1."""
        self._piece(0.5 * math.pi * radius * self.resolution, side / (radius * self.resolution))
        nx, ny = -self.hy * side, self.hx * side
        self.x, self.y = self.x + radius * (self.hx + nx), self.y + radius * (self.hy + ny)
        self.hx, self.hy = nx, ny

    def spin(self, side: int) -> None:
        self.stops.append(len(self.lengths))
        self.hx, self.hy = -self.hy * side, self.hx * side

    def _piece(self, length: float, curvature: float) -> None:
        self.xy.append((self.x, self.y))
        self.heading.append((self.hx, self.hy))
        self.lengths.append(length)
        self.curvature.append(curvature)

    def curve(self) -> Curve:
        n = len(self.lengths)
        xy, heading = np.array(self.xy).reshape(n, 2), np.array(self.heading).reshape(n, 2)
        lengths, curvature = np.array(self.lengths), np.array(self.curvature)
        return Curve(
            xy, heading, lengths, curvature, (self.x, self.y), self.resolution, np.array(self.stops, int)
        )


def random_curve(
    rng: np.random.Generator, start: tuple[int, int], size: int, resolution: float, pieces: int
) -> Curve:
    """A curve whose pieces stay three cells inside a map of ``size``."""
    while True:
        hx, hy = ((1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0))[int(rng.integers(4))]
        pen = Turtle(float(start[0]), float(start[1]), hx, hy, resolution)
        for _ in range(pieces):
            kind = int(rng.integers(5))
            if kind == 0 and pen.lengths and (not pen.stops or pen.stops[-1] != len(pen.lengths)):
                pen.spin(int(rng.choice((-1, 1))))
            if kind <= 2:
                pen.forward(int(rng.integers(1, 9)))
            else:
                pen.round(int(rng.integers(1, 5)), int(rng.choice((-1, 1))))
            if not (3 <= pen.x <= size - 4 and 3 <= pen.y <= size - 4):
                break
        else:
            curve = pen.curve()
            xy = curve.at(np.linspace(0, curve.length, 200))[0]
            if xy.min() >= 3 and xy.max() <= size - 4:
                return curve


def _bounds(curve: Curve, robot: Robot) -> tuple[list[float], list[float]]:
    """Where each piece begins (and the end), and the speed allowed there and on it."""
    tops = [
        min(robot.v_max, math.sqrt(robot.a_lat_max / abs(k))) if k else robot.v_max for k in curve.curvature
    ]
    begins = [0.0, *np.cumsum(curve.lengths).tolist()]
    return begins, [*tops, 0.0]


def stretches(
    curve: Curve, robot: Robot, rng: np.random.Generator, eager: float = 1.0
) -> list[tuple[float, float, float, float]]:
    """(dt, s, v, a) from rest to rest, with a stop at each stop of the curve, at random accelerations."""
    begins, tops = _bounds(curve, robot)
    halts = [*(begins[k] for k in curve.stops.tolist() if k), begins[-1]]
    rows: list[tuple[float, float, float, float]] = []
    s = v = 0.0
    for halt in halts:
        while halt - s > 0:
            left = halt - s
            if v > 0 and v * v / (2 * left) > 0.6 * robot.d_max:
                rows.append((2 * left / v, s, v, -v * v / (2 * left)))
                s, v = halt, 0.0
                break
            low, high = -robot.d_max, robot.a_max * (eager + (1 - eager) * rng.random())
            for _ in range(40):
                a = 0.5 * (low + high)
                if _allowed(s, v, a, begins, tops, halt, robot):
                    low = a
                else:
                    high = a
            a = low
            dt = PERIOD
            if v + a * dt < 0:
                dt = v / -a
            rows.append((dt, s, v, a))
            s, v = s + v * dt + a * dt * dt / 2, max(v + a * dt, 0.0)
    return rows


def _allowed(
    s: float, v: float, a: float, begins: list[float], tops: list[float], halt: float, robot: Robot
) -> bool:
    dt = min(PERIOD, v / -a) if a < 0 else PERIOD
    after = max(v + a * dt, 0.0)
    to = s + v * dt + a * dt * dt / 2
    if to > halt:
        return False
    hardest = 0.69 * robot.d_max
    for k in range(len(tops)):
        over = begins[k] < to and (k + 1 == len(begins) or begins[k + 1] > s)
        if over and max(v, after) > tops[k]:
            return False
        if begins[k] >= to and after * after > tops[k] ** 2 + 2 * hardest * (begins[k] - to):
            return False
    return after * after <= 2 * hardest * (halt - to)


def good_drive(
    rng: np.random.Generator,
    *,
    size: int = 40,
    legs: int = 1,
    pieces: int = 6,
    robot: Robot | None = None,
    resolution: float = 1.0,
    obstacles: int = 0,
    top_speed: float = 0.5,
    radius: float = 0.4,
) -> Drive:
    """A lawful drive over a free map through obstacles that it does not touch."""
    robot = robot or Robot(radius=0.4 * resolution)
    start = (int(rng.integers(10, size - 10)), int(rng.integers(10, size - 10)))
    curves, rows, leg, clock = [], [], [], 0.0
    at = start
    for k in range(legs):
        curve = random_curve(rng, at, size, resolution, pieces)
        for dt, s, v, a in stretches(curve, robot, rng, float(rng.choice((1.0, 0.3)))):
            rows.append((clock, s, v, a))
            leg.append(k)
            clock += dt
        curves.append(curve)
        at = (round(curve.end[0]), round(curve.end[1]))
        if k + 1 < legs:
            rows.append((clock, curve.length, 0.0, 0.0))  # stands a while
            leg.append(k)
            clock += PERIOD
    rows.append((clock, curves[-1].length, 0.0, 0.0))
    leg.append(legs - 1)
    t, s, v, a = np.array(rows).T
    scene = Scene(Grid(np.zeros((size, size), bool), resolution=resolution), start, at, robot=robot)
    drive = drive_of(scene, tuple(curves), t, s, v, a, np.array(leg))
    tracks: list[Track] = []
    while len(tracks) < obstacles:
        track = random_track(rng, clock, size, resolution, radius, top_speed)
        if clear(drive, track) > 0.02:
            tracks.append(track)
    return with_tracks(drive, tracks)


def drive_of(scene: Scene, curves: tuple[Curve, ...], t, s, v, a, leg) -> Drive:  # type: ignore[no-untyped-def]
    return Drive(
        scene=scene,
        planner="hand",
        law="physical",
        seed=0,
        outcome=Outcome.ARRIVED,
        curves=curves,
        t=t,
        s=s,
        v=v,
        a=a,
        leg=leg,
        cause=("limit",) * len(t),
        cause_index=np.full(len(t), -1),
        tracks=(),
        obstacle_specs=(),
        moments=(Moment(float(t[-1]), "arrive", scene.goal),),
        period=PERIOD,
    )


def random_track(
    rng: np.random.Generator, last: float, size: int, resolution: float, radius: float, top_speed: float
) -> Track:
    """A random walk of straight legs, some of them waits, that may begin late and end early."""
    n = int(rng.integers(1, 12))
    t = np.cumsum(rng.random(n) * last / 4 + 0.05)
    t -= t[0] if rng.random() < 0.5 else 0.0
    xy = [rng.random(2) * (size - 1)]
    for dt in np.diff(t):
        step = rng.normal(size=2)
        step *= rng.choice((0.0, 0.3, 0.999)) * top_speed * dt / resolution / np.hypot(*step)
        xy.append(xy[-1] + step)
    return Track(t, np.array(xy), radius, top_speed)


def with_tracks(drive: Drive, tracks: list[Track], yields: bool = False) -> Drive:
    bodies = tuple(Obstacle("recorded", track.radius, yields) for track in tracks)
    return replace(drive, tracks=tuple(tracks), obstacle_specs=bodies)


def clear(drive: Drive, track: Track, step: float = 0.01) -> float:
    """The least gap between the rims, sampled; metres."""
    t = np.arange(min(max(track.t[0], 0.0), drive.duration), drive.duration + step, step)
    d = np.hypot(*(drive.at(t)[0] - track.at(t)).T) * drive.scene.grid.resolution
    return float(d.min()) - track.radius - drive.scene.robot.radius

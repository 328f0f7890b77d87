"""DWA and MPPI: commands chosen by simulating many of them."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from lampyris._core import elementary
from lampyris.kernels.steering.rollouts import rollouts, weighted
from lampyris.model.settings.steering import Dwa, Mppi
from lampyris.planning.lattice.shortcut import covering_discs
from lampyris.sim.steering.arc import Arc, RobotShape, angle_of, cos_sin, wrapped
from lampyris.sim.steering.control import Steer, View
from lampyris.sim.steering.pure_pursuit import arriving, free_pursuit, within_limits
from lampyris.sim.steering.reference import Section
from lampyris.typing import Floats

_SPARE = 128
"""Steps of noise beside those of one horizon; the window moves through them."""

_CLOSE = 0.1
"""Metres before the end of a section from which the robot is led to it by pure pursuit: costs are too flat there."""

_Y_UP = np.array(((1.0,), (-1.0,)))
"""From y down to y up."""

_STILL = 0.01
"""Share of the top speed below which a command is to stand."""


@dataclass
class SimulatedMotions:
    """Room for simulated motions of one robot, and what is compared with them.

    Parameters
    ----------
    shape : the robot.
    count, steps : how many motions, and of how many steps.
    step : seconds.
    """

    shape: RobotShape
    count: int
    steps: int
    step: float
    arrays: dict[str, Floats] = field(init=False)
    _section: tuple[Section, list[Floats], int] | None = field(default=None, init=False)

    def __post_init__(self) -> None:
        whole = self.count * self.steps
        sizes = {"push": whole, "side": whole if self.shape.sideways else 1, "spin": whole}
        sizes |= dict.fromkeys(
            ("x", "y", "cosine", "sine", "before", "beside", "at", "room", "cost"), self.count
        )
        self.arrays = {name: np.zeros(size) for name, size in sizes.items()}
        self.arrays["found"] = np.zeros(1)
        self.arrays["bounds"] = np.zeros(4)
        self._out = tuple(self.arrays.values())
        self._start = np.zeros(6)
        self._lay_out(0)
        self._to_metres = self.shape.grid.resolution * _Y_UP
        robot = self.shape.robot
        self._limits = (
            int(self.shape.sideways), robot.v_max, robot.a_max, robot.d_max, self.shape.yaw_rate,
            1e6 if robot.turn_radius == 0.0 else 1.0 / robot.turn_radius, robot.a_lat_max,
        )  # fmt: skip
        footprint = self.shape.robot.footprint
        if footprint is None:
            discs = np.array([(0.0, 0.0, self.shape.robot.radius)])
        else:
            discs = covering_discs(footprint) * np.array((1.0, -1.0, 1.0))
        self._discs = [np.ascontiguousarray(c) for c in discs.T]
        low, high = self.shape.outline.min(axis=0), self.shape.outline.max(axis=0)
        room = self.shape.margin
        self._box = np.array((low[0] - room, high[0] + room, low[1] - room, high[1] + room))

    def simulate(
        self, view: View, one: Dwa | Mppi, noise: tuple[Floats, Floats, Floats], hold: int, shift: int,
        nominal: tuple[Floats, Floats, Floats], spread: tuple[float, float], rate_weight: float,
    ) -> int:  # fmt: skip
        """Simulate all motions, whose costs are then in ``arrays["cost"]``; the cheapest of them, of equal ones the first."""
        start = self._start
        start[0], start[1], yaw = view.pose
        start[2], start[3] = cos_sin(yaw)
        start[4], start[5] = self.velocity(view)
        gear = -1.0 if view.progress.section.gear < 0 else 1.0
        height, width = view.walls.clear.shape
        best = rollouts(
            *noise, len(noise[0]) // self.count, hold, shift, *nominal, *spread, self.steps, self.step, start, gear,
            *self._limits, rate_weight,
            *self._path(view), one.path_weight, one.yaw_weight, one.progress_weight,
            view.walls.flat, width, height, self.shape.grid.resolution, *self._discs, max(one.margin, 1e-6), self._box,
            *self._obstacles_of(view), one.obstacle_weight, one.collision_cost, *self._out,
        )  # fmt: skip
        return int(best)

    def _lay_out(self, count: int) -> None:
        """Room for so many obstacles."""
        self._table = np.zeros((5, count))
        self._rows = list(self._table)
        self._places, self._speeds = self._table[:2], self._table[2:4]

    def _obstacles_of(self, view: View) -> list[Floats]:
        """Places, velocities (y up) and radii of the obstacles: five rows of one table."""
        message = view.message
        if self._table.shape[1] != len(message.xy):
            self._lay_out(len(message.xy))
        np.multiply(message.xy.T, self._to_metres, out=self._places)
        if view.velocity is None:
            self._speeds[:] = 0.0
        else:
            np.multiply(view.velocity.T, _Y_UP, out=self._speeds)
        np.add(message.radius, view.noise, out=self._rows[4])
        return self._rows

    def velocity(self, view: View) -> tuple[float, float]:
        """The robot's speed, and of an omnidirectional one its speeds ahead and to the left."""
        if view.arc is None or view.arc.in_place:
            return 0.0, 0.0
        if not self.shape.sideways:
            return view.v, 0.0
        c, s = cos_sin(view.arc.direction - view.pose.yaw)
        return view.v * c, view.v * s

    def _path(self, view: View) -> tuple[Any, ...]:
        """The samples of the section: points, direction of the yaw, metres left; and those within reach of the motions: the
        first, how far they are apart, how many, and the last.
        """
        progress, one = view.progress, view.progress.section
        far = self.shape.robot.v_max * self.steps * self.step + 2.0
        if self._section is None or self._section[0] is not one:
            # No closer than a motion drives between two looks: all of them walk along these points.
            apart = self.shape.robot.v_max * self.step
            stride = max(int(apart / max(float(one.s[-1] - one.s[0]) / (len(one.s) - 1), 1e-9)), 1)
            left = float(one.s[-1]) - one.s
            columns = (one.x, one.y, elementary.cos(one.yaw), elementary.sin(one.yaw), left)
            self._section = (one, list(np.stack(columns)), stride)
        _, table, stride = self._section
        k = max(progress.at, 0)
        last = min(int(one.s.searchsorted(progress.s + far, side="right")), len(one.s) - 1)
        return (*table, k, stride, max(-((k - last) // stride), 0), last)


def close(view: View) -> Steer:
    """The arc of pure pursuit to the end of a section, slowly enough to stop there."""
    arc, _ = free_pursuit(view, max(3.0 * _CLOSE, 2.0 * abs(view.progress.beside)))
    return arriving(view, Steer(arc, 0.3 * view.shape.robot.v_max, "limit"))


def command(view: View, v: float, w: float, u: float) -> Steer:
    """The arc and the speed of a command: speed, yaw rate and sideways speed at the end of the period."""
    shape, pose = view.shape, view.pose
    gear = -1.0 if view.progress.section.gear < 0 else 1.0
    if shape.sideways:
        return _sideways(view, v, w, u)
    if view.arc is not None and view.arc.in_place:
        return Steer(view.arc, 0.0, "turn")
    mean = max(0.5 * (view.v + v), 1e-3)
    turn = w / mean
    direction = pose.yaw if gear > 0 else pose.yaw + math.pi
    return arriving(view, Steer(within_limits(view, Arc(direction, turn, turn)), v, "limit"))


def _sideways(view: View, v: float, w: float, u: float) -> Steer:
    """The same of an omnidirectional robot, whose direction of travel turns within its lateral acceleration."""
    shape, pose = view.shape, view.pose
    size = math.sqrt(v * v + u * u)
    if size < _STILL * shape.robot.v_max:
        return Steer(view.arc or Arc(pose.yaw, 0.0, 0.0), 0.0, "turn")
    if view.arc is not None and view.arc.in_place:
        return Steer(view.arc, 0.0, "turn")
    wanted = pose.yaw + angle_of(u, v)
    direction = wanted if view.arc is None else view.arc.direction
    off = wrapped(wanted - direction)
    if abs(off) > 0.5 * math.pi:
        size = 0.0
    mean = max(0.5 * (view.v + size), 1e-2)
    far = mean * view.period
    return arriving(view, Steer(within_limits(view, Arc(direction, off / far, w / mean)), size, "limit"))


def _speed_now(view: View) -> float:
    """The robot's speed; of a turn in place, 0."""
    return 0.0 if view.arc is not None and view.arc.in_place else view.v


class _Window:
    """What of the grid of commands is the same in every period, and room for the rest."""

    def __init__(self, one: Dwa, shape: RobotShape) -> None:
        self.rates = shape.yaw_rate * (2.0 * np.arange(one.yaw_rates) / (one.yaw_rates - 1) - 1.0)
        speed = np.arange(one.speeds, dtype=np.float64)
        if shape.sideways:
            self.speed, n = speed, one.speeds * one.directions * one.yaw_rates
            self.spin = np.zeros(2 * n)
        else:
            # Every speed with every yaw rate, twice: until the speed is reached, and after.
            self.speed, n = speed, one.speeds * one.yaw_rates
            self.spin = np.concatenate([self.rates] * (2 * one.speeds))
        self.count = n
        self.push = np.zeros(2 * n)
        self.push_by_speed = self.push[:n].reshape(one.speeds, -1)
        self.side = np.zeros(2 * n if shape.sideways else 1)
        self.none = np.zeros(one.steps)


@dataclass
class DynamicWindow:
    """The dynamic window approach (Fox, Burgard, Thrun 1997): the best constant command of a grid.

    Parameters
    ----------
    settings : its settings.
    """

    settings: Dwa
    _motions: SimulatedMotions | None = None
    _window: _Window | None = None

    def begin(self, view: View) -> None:
        """Nothing is remembered but room."""

    def steer(self, view: View) -> Steer:
        """Simulate each command of the grid, and take the cheapest; of equal ones the first."""
        one, shape = self.settings, view.shape
        if view.progress.left < _CLOSE:
            return close(view)
        if self._window is None:
            self._window = _Window(one, shape)
        window = self._window
        n = window.count
        if self._motions is None or self._motions.count != n:
            self._motions = SimulatedMotions(shape, n, one.steps, one.step)
        # The speed changes evenly to what is asked for; from then on it stays.
        hold = max(round(one.window / one.step), 1)
        along, across = self._motions.velocity(view)
        seconds = hold * one.step
        speeds = self._speeds(view, window)
        if shape.sideways:
            v, w, u = self._grid(view, window, speeds)
            np.divide(v - along, seconds, out=window.push[:n])
            np.divide(u - across, seconds, out=window.side[:n])
            window.spin[:n] = window.spin[n:] = w
        else:
            window.push_by_speed[:] = ((speeds - along) / seconds)[:, None]
        noise, none = (window.push, window.spin, window.side), window.none
        k = self._motions.simulate(view, one, noise, hold, 0, (none, none, none), (1.0, 1.0), 0.0)
        share = view.period / max(seconds, view.period)
        if shape.sideways:
            ahead = along + share * (float(v[k]) - along)
            return command(view, ahead, float(w[k]), across + share * (float(u[k]) - across))
        chosen = float(speeds[k // one.yaw_rates])
        return command(view, along + share * (chosen - along), float(window.spin[k]), 0.0)

    def _speeds(self, view: View, all_: _Window) -> Floats:
        """Speeds that can be reached within the window."""
        one, robot = self.settings, view.shape.robot
        now = _speed_now(view)
        window = max(one.window, view.period)
        low = max(now - robot.d_max * window, 0.0)
        high = min(now + robot.a_max * window, robot.v_max)
        speeds: Floats = all_.speed * (high - low)
        speeds /= one.speeds - 1
        speeds += low
        return speeds

    def _grid(self, view: View, all_: _Window, speeds: Floats) -> tuple[Floats, Floats, Floats]:
        """Of an omnidirectional robot: the speeds in all directions it can take, with all yaw rates."""
        one, robot = self.settings, view.shape.robot
        now = _speed_now(view)
        window = max(one.window, view.period)
        # Around where it drives as far as the direction can turn, or all around if it stands.
        spread = math.pi if now == 0.0 else min(robot.a_lat_max * window / now, math.pi)
        travel = 0.0 if view.arc is None or now == 0.0 else view.arc.direction - view.pose.yaw
        part = np.arange(one.directions) / max(one.directions - 1, 1)
        angles = travel + spread * (2.0 * part - 1.0)
        if one.directions == 1:
            angles = np.array([travel])
        v, a, w = (x.ravel() for x in np.meshgrid(speeds, angles, all_.rates, indexing="ij"))
        return v * elementary.cos(a), w.copy(), v * elementary.sin(a)


@dataclass
class PathIntegral:
    """Model predictive path integral control (Williams et al. 2017).

    The noise is drawn once. With every period its window moves on by as many steps as the period has, as the commands do. At
    its end it begins again with other pairs: accelerations have the opposite sign, and yaw rates are those of another motion.

    Parameters
    ----------
    settings : its settings.
    rng : of the noise.
    """

    settings: Mppi
    rng: np.random.Generator
    _motions: SimulatedMotions | None = None
    _noise: list[Floats] = field(default_factory=list)
    _nominal: list[Floats] = field(default_factory=list)
    _shift: int = 0

    def begin(self, view: View) -> None:
        """Nothing is commanded yet; on the first path the noise is drawn."""
        one = self.settings
        if self._motions is None:
            self._motions = SimulatedMotions(view.shape, one.samples, one.steps, one.step)
            rows = (one.steps + _SPARE) // one.hold + 1
            count = 3 if view.shape.sideways else 2
            self._noise = [_normal(self.rng, rows * one.samples) for _ in range(count)]
            if count == 2:
                self._noise.append(np.zeros(1))
        self._nominal = [np.zeros(one.steps) for _ in range(3)]

    def steer(self, view: View) -> Steer:
        """Simulate all sequences, weigh them, and take the first command of the mean."""
        one, shape, motions = self.settings, view.shape, self._motions
        assert motions is not None
        if view.progress.left < _CLOSE:
            return close(view)
        spread = (one.speed_noise * shape.robot.a_max, one.yaw_noise * shape.yaw_rate)
        v, w, u = self._nominal
        noise = (self._noise[0], self._noise[1], self._noise[2])
        best = motions.simulate(view, one, noise, one.hold, self._shift, (v, w, u), spread, one.rate_weight)
        cost = motions.arrays["cost"]
        self._move_window(max(round(view.period / one.step), 1))
        weight = elementary.exp((cost[best] - cost) / one.temperature)
        weight /= weight.sum()
        arrays = motions.arrays
        weighted(
            weight, arrays["push"], arrays["spin"], arrays["side"], int(shape.sideways), one.steps, v, w, u
        )
        if one.smooth:
            v, w, u = (_smoothed(a) for a in (v, w, u))
        at = np.array([view.period])
        times = one.step * (np.arange(one.steps) + 1.0)
        first = [float(elementary.interp(at, times, a)[0]) for a in (v, w, u)]
        later = np.minimum(times + view.period, times[-1])
        self._nominal = [np.ascontiguousarray(elementary.interp(later, times, a)) for a in (v, w, u)]
        along, across = motions.velocity(view)
        ahead = along + first[0] * view.period
        return command(
            view, ahead if shape.sideways else max(ahead, 0.0), first[1], across + first[2] * view.period
        )

    def _move_window(self, steps: int) -> None:
        """Go on by so many steps; at the end of the noise make others of it, which are as independent."""
        self._shift += steps
        if self._shift >= _SPARE:
            self._shift %= _SPARE
            np.negative(self._noise[0], out=self._noise[0])
            self._noise[1] = np.roll(self._noise[1], 1)
            self._noise[2] = np.roll(self._noise[2], -1)


def _normal(rng: np.random.Generator, count: int) -> Floats:
    """Normal random numbers with the same bits everywhere (Box, Muller 1958)."""
    size, angle = 1.0 - rng.random(count), rng.random(count)
    normal: Floats = np.sqrt(-2.0 * elementary.log(size)) * elementary.cos(2.0 * math.pi * angle)
    return normal


def _smoothed(values: Floats) -> Floats:
    """A least-squares parabola through five neighbours (Savitzky, Golay 1964); the ends stay."""
    if len(values) < 5:
        return values
    out = values.copy()
    near, far = values[1:-3] + values[3:-1], values[:-4] + values[4:]
    out[2:-2] = (17.0 * values[2:-2] + 12.0 * near - 3.0 * far) / 35.0
    return out

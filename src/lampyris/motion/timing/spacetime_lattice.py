"""The lattice of times, places and speeds on which paths through moving obstacles are searched.

The units fit the robot and the path: braking from speed to speed is its d_max exactly, the path's length is a
whole number of units, and so is every stretch between two stops. Equations: docs/speed/moving_obstacles.md.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from lampyris._core import elementary
from lampyris._core.scalars import in_range
from lampyris.errors import LimitError, SettingError, shown
from lampyris.kernels.motion.path_time import allow_pairs, fewest_steps
from lampyris.model.robot import Robot
from lampyris.typing import Floats

MAX_WORDS = 2**25
"""Words of 64 bits that the states may take (256 MB)."""

_FINE_WORDS = 2**21
"""Words that they should take where more than the least number of speeds is chosen."""

LEVELS = (16, 24, 32, 48, 64)
"""Numbers of speeds that are tried in turn, until the lattice is good enough."""

_COARSE = (12, 8, 6)
"""Numbers of speeds for paths so long that not even the first of the others fits."""

_SCALES = (1, 2, 4)
"""Times as many units gained and lost in a step: tried in turn where the ceiling is too gently inclined."""

_GOOD = 0.03
"""Share of the fastest time that the lattice may lose where nobody is in the way."""

_HAIR = 1e-12


class Rates(NamedTuple):
    """Units of speed gained and lost in a step at most; ``fall`` units are the braking of d_max."""

    rise: int
    fall: int


@dataclass(frozen=True, slots=True, eq=False)
class Lattice:
    """A lattice over what is left of a path after the motion's first part.

    Parameters
    ----------
    dt : seconds a step.
    legs, places : metres and number of the place at the borders of the legs, (l + 1,): stretches between
        stops, each with its own units.
    levels, rise, fall : number of speeds; units gained and lost in a step at most.
    words : in a row of bits.
    ok : bits: from where each pair of speeds can be driven, :func:`lampyris.kernels.motion.path_time.allow_pairs`.
    speed : units of speed at the beginning.
    fewest : steps to the goal with nobody in the way.
    """

    dt: float
    legs: Floats
    places: NDArray[np.int64]
    levels: int
    rise: int
    fall: int
    words: int
    ok: NDArray[np.uint64]
    speed: int
    fewest: int

    @property
    def goal(self) -> int:
        """What tells the goal: n = (place + speed - first speed) / 2."""
        return (int(self.places[-1]) - self.speed) // 2

    def s_of(self, place: NDArray[np.int64]) -> Floats:
        """Metres along the path of places; the borders of the legs exactly."""
        out: Floats = elementary.interp(place, self.places, self.legs)
        return out

    def leg_of(self, place: NDArray[np.int64]) -> NDArray[np.int64]:
        """Leg on which each place lies; a border belongs to the leg that begins there."""
        leg = np.searchsorted(self.places, place, side="right") - 1
        return np.clip(leg, 0, len(self.places) - 2)

    @property
    def unit(self) -> Floats:
        """m/s in a unit of speed, by leg."""
        out: Floats = 2.0 * np.diff(self.legs) / (np.diff(self.places) * self.dt)
        return out


def rates(robot: Robot) -> Rates:
    """Few units that stand in nearly the ratio of a_max and d_max, never above it."""
    ratio = robot.a_max / robot.d_max
    best, least = Rates(1, math.ceil(1.0 / ratio - _HAIR)), 1.0
    if ratio < 0.125:
        return best
    for fall in range(2, 9):
        rise = math.floor(ratio * fall * (1.0 + _HAIR))
        loss = 1.0 - rise / (ratio * fall)
        if rise >= 2 and loss < least - 0.02:
            best, least = Rates(rise, fall), loss
    return best


class Start(NamedTuple):
    """Where the lattice begins: metres, seconds, and the speed there in units of the first leg.

    ``unit`` is that unit, m/s, and ``room`` how many places the first leg has.
    """

    s: float
    t: float
    speed: int
    unit: float
    room: int


def start_of(v0: float, length: float, unit: float, d_max: float, fall: int) -> Start | None:
    """The first leg's units, at most ``unit`` m/s, so that all fits; None: there is no freedom to be had.

    The robot brakes with d_max to the next whole number j of units, which no ceiling forbids. From there the
    path left, ``L - (v0^2 - j^2 u^2) / (2 d)``, is to be M units of ``fall u^2 / (2 d)``: hence
    ``u^2 = (2 d L - v0^2) / (M fall - j^2)``. M is odd or even as j is. From rest the units of speed need
    not fit the braking.
    """
    if v0 == 0.0:
        return Start(0.0, 0.0, 0, unit, 2 * max(1, math.ceil(d_max * length / (unit * unit * fall))))
    spare = 2.0 * d_max * length - v0 * v0
    if spare <= 0.25 * unit * unit:
        return None
    j = math.floor(v0 / unit)
    count = max(2, math.ceil((j * j + spare / (unit * unit)) / fall))
    count += (count - j) & 1
    unit = min(unit, math.sqrt(spare / (count * fall - j * j)))
    v = j * unit
    return Start((v0 * v0 - v * v) / (2.0 * d_max), (v0 - v) / d_max, j, unit, count)


def lattice_of(
    s: Floats, x: Floats, stops: Floats, d_max: float, rate: Rates, start: Start, levels: int, most: int
) -> Lattice | None:
    """The lattice of a path from ``start`` on; None where the goal cannot be reached on it or it is too large.

    Parameters
    ----------
    s, x : float64 (n,): nodes of the path and the static ceiling's v^2 there, linear between them.
    stops : metres: the stops ahead of ``start`` and the goal.
    rate : see :class:`Rates`.
    levels : how many speeds there may be.
    most : words that one row of bits of each speed may have together.
    """
    dt = rate.fall * start.unit / d_max
    legs = np.concatenate(([start.s], stops))
    count = 2 * np.maximum(1, np.ceil(np.diff(legs) / (start.unit * dt) - 1e-6)).astype(np.int64)
    count[0] = start.room
    places = np.concatenate((np.zeros(1, dtype=np.int64), np.cumsum(count)))
    last = int(places[-1])
    goal = (last - start.speed) // 2
    words = (goal >> 6) + 2
    if words * levels > most:
        return None
    unit = 2.0 * np.diff(legs) / (count * dt)
    m = np.arange(last + 1)
    leg = np.clip(np.searchsorted(places, m, side="right") - 1, 0, len(unit) - 1)
    z = elementary.interp(elementary.interp(m, places, legs), s, x) / np.square(unit[leg])
    z[places[1:]] = 0.0
    levels = min(levels, math.floor(math.sqrt(float(z.max())) * (1.0 + _HAIR)) + 1)
    rise, fall = min(rate.rise, levels - 1), min(rate.fall, levels - 1)
    can = np.zeros(levels * (rise + fall + 1) * words * 64, dtype=np.uint8)
    kink, kink_z = _kinks(s, x, legs, places, unit)
    allow_pairs(z, kink, kink_z, levels, rise, fall, start.speed, words, can)
    if start.speed >= levels:
        return None
    ok = np.packbits(can, bitorder="little").view("<u8").astype(np.uint64)
    work = np.full((goal + 1) * levels, 2**40, dtype=np.int64)
    steps = int(fewest_steps(ok, goal, levels, rise, fall, words, start.speed, work))
    if steps < 0:
        return None
    return Lattice(dt, legs, places, levels, rise, fall, words, ok, start.speed, steps)


def _kinks(
    s: Floats, x: Floats, legs: Floats, places: NDArray[np.int64], unit: Floats
) -> tuple[Floats, Floats]:
    """Nodes where the ceiling's slope rises, in units: nowhere else can a straight line first break it."""
    slope = np.diff(x) / np.diff(s)
    inner = np.flatnonzero(slope[1:] > slope[:-1]) + 1
    inner = inner[(s[inner] > legs[0]) & (s[inner] < legs[-1])]
    leg = np.clip(np.searchsorted(legs, s[inner], side="right") - 1, 0, len(unit) - 1)
    return elementary.interp(s[inner], legs, places.astype(np.float64)), x[inner] / np.square(unit[leg])


class RootedLattice(NamedTuple):
    """A lattice and where it begins."""

    lattice: Lattice
    start: Start

    @property
    def seconds(self) -> float:
        """To the goal with nobody in the way."""
        return self.start.t + self.lattice.fewest * self.lattice.dt


def best_lattice(
    s: Floats,
    x: Floats,
    stops: Floats,
    robot: Robot,
    v0: float,
    fastest: float,
    step: float | None,
    begin: float,
) -> RootedLattice | None:
    """The coarsest lattice that loses little where nobody is in the way; None: v0 leaves no freedom.

    Parameters
    ----------
    s, x, stops : see :func:`lattice_of`; from ``begin`` on.
    v0 : speed at ``begin``.
    fastest : seconds from there without obstacles.
    step : seconds a step is to take; None: as said.

    Raises
    ------
    LimitError : ``PATH_TIME``: no lattice within the limits reaches the goal.
    SettingError : ``STEP``.
    """
    top = math.sqrt(float(x[s >= begin].max()))
    rate = rates(robot)
    if step is not None and not in_range(step, 1e-9, 1e9):
        raise SettingError("STEP", shown(step), where="step", allowed="seconds, > 0")
    best: RootedLattice | None = None
    for count in (*LEVELS, *_COARSE) if step is None else (0,):
        if best is not None and count in _COARSE:
            break
        room = MAX_WORDS if count <= LEVELS[0] or best is None else _FINE_WORDS
        for scale in _SCALES:
            fine = Rates(rate.rise * scale, rate.fall * scale)
            unit = top / count if step is None else step * robot.d_max / fine.fall
            start = start_of(v0, float(stops[0]) - begin, unit, robot.d_max, fine.fall)
            if start is None:
                return None
            start = start._replace(s=begin + start.s)
            levels = math.ceil(top / start.unit) + 1
            seconds = fine.fall * start.unit / robot.d_max
            most = math.floor(room / (1.5 * fastest / seconds + 16.0))
            lattice = lattice_of(s, x, stops, robot.d_max, fine, start, levels, most)
            if lattice is not None:
                break
        if lattice is None or start is None:
            continue
        found = RootedLattice(lattice, start)
        if best is None or found.seconds < best.seconds:
            best = found
        if found.seconds <= (1.0 + _GOOD) * fastest:
            break
    if best is None:
        raise _undrivable(s, x, top)
    return best


def _undrivable(s: Floats, x: Floats, top: float) -> LimitError:
    least = math.sqrt(float(x[1:-1].min(initial=math.inf)))
    return LimitError(
        "PATH_TIME",
        f"no lattice of at most {LEVELS[-1]} speeds and {MAX_WORDS} words drives this path of "
        f"{float(s[-1]):g} m at speeds from {least:g} to {top:g} m/s",
        where="tracks",
        allowed="paths that a lattice of speeds can drive",
        todo="drive a shorter part of the path, or give a step",
    )

"""Energy that a profile or a drive takes, per kilogram: speeding up, and rolling."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from lampyris._core.settings import check_settings, number, under_code
from lampyris.model.drive import Drive
from lampyris.model.profile import Profile
from lampyris.model.robot import Robot
from lampyris.typing import Floats

GRAVITY = 9.80665
"""Metres per second squared."""


@dataclass(frozen=True, slots=True)
class EnergyModel:
    """What driving costs, in joules for each kilogram of the robot.

    ``E / m = sum of increases of v^2 / 2, less the recovered share of its decreases, + rolling g length``. A robot of
    m kilograms needs m times as much at its wheels. Not included: the efficiency of motors, electronics that run while
    the robot stands, slopes, and what turning in place takes.

    Parameters
    ----------
    rolling : coefficient of rolling resistance, rolling force over weight; 0.015 is a rubber wheel on a smooth hard floor.
    recovered : share of the kinetic energy that braking gives back.

    Raises
    ------
    SettingError : ``ENERGY``.
    """

    rolling: float = number(0.015, 0.0, 1.0)
    recovered: float = number(0.0, 0.0, 1.0)

    def __post_init__(self) -> None:
        check_settings(self, under_code("ENERGY", "energy."))


def energy_of(profile: Profile, robot: Robot, model: EnergyModel) -> float:
    """Joules per kilogram that a profile in metres and seconds takes."""
    hidden = float(np.square(_peaks(profile, robot)).sum())
    return _energy(profile.v, float(profile.s[-1] - profile.s[0]), model, hidden)


def energy_of_drive(drive: Drive, model: EnergyModel) -> float:
    """Joules per kilogram that a drive takes, from the speeds of its stretches."""
    return _energy(drive.v, length_of_drive(drive), model)


def length_of_drive(drive: Drive) -> float:
    """Metres that a drive went, along all of its curves."""
    seconds = np.diff(drive.t)
    return math.fsum((seconds * (drive.v[:-1] + 0.5 * drive.a[:-1] * seconds)).tolist())


def _energy(v: Floats, length: float, model: EnergyModel, hidden: float = 0.0) -> float:
    """The same from speeds and metres; ``hidden``: squares of top speeds that are not among the speeds."""
    change = np.diff(np.square(v))
    up, down = float(change[change > 0.0].sum()), float(-change[change < 0.0].sum())
    kinetic = 0.5 * (up + hidden) - 0.5 * model.recovered * (down + hidden)
    return kinetic + model.rolling * GRAVITY * length


def _peaks(profile: Profile, robot: Robot) -> Floats:
    """Top speeds on edges from rest to rest: full acceleration, a cruise, full braking, in the edge's time.

    With ``k = 1 / a_max + 1 / d_max`` the time is ``T = ds / v + k v / 2``, so v is the lesser root of
    ``k v^2 / 2 - T v + ds = 0``.
    """
    rest = (profile.v[:-1] == 0.0) & (profile.v[1:] == 0.0) & (np.diff(profile.s) > 0.0)
    ds, seconds = np.diff(profile.s)[rest], np.diff(profile.t)[rest]
    k = 1.0 / robot.a_max + 1.0 / robot.d_max
    root = np.sqrt(np.maximum(seconds * seconds - 2.0 * k * ds, 0.0))
    peaks: Floats = 2.0 * ds / (seconds + root)
    return peaks

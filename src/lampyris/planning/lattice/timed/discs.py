"""The discs that cover a robot along each motion of its lattice, and the spans of time that each stands for."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from lampyris._core import elementary
from lampyris.model.robot import circumscribed_radius
from lampyris.planning.lattice.lattice import UNIT, StateLattice
from lampyris.planning.lattice.sampled import LatticeMotion
from lampyris.planning.lattice.shortcut import covering_discs
from lampyris.typing import Floats

STEP = 0.25
"""Cells that a point of the robot moves at most from one place to the next."""
SLACK = 1e-6
"""Ticks before a departure and after an arrival that discs stand for, so that rounding misses nothing."""


@dataclass(frozen=True, slots=True, eq=False)
class MotionDiscs:
    """See :mod:`lampyris.kernels.lattice.timed_search`.

    Parameters
    ----------
    duration : float64 (primitives,): ticks.
    disc_first, disc, disc_reach : of the motions.
    stand_first, stand, stand_reach : of the robot that stands.
    """

    duration: Floats
    disc_first: NDArray[np.int64]
    disc: Floats
    disc_reach: Floats
    stand_first: NDArray[np.int64]
    stand: Floats
    stand_reach: float


@lru_cache(16)
def motion_discs(lattice: StateLattice, speed: float) -> MotionDiscs:
    """The discs of a lattice's motions.

    Parameters
    ----------
    speed : share of the top speed at which the robot drives.
    """
    arm = circumscribed_radius(lattice.shape.footprint)
    cover = covering_discs(lattice.shape.footprint)
    cover[:, 2] += STEP / 2 + SLACK
    duration = lattice.cost / UNIT / speed
    moving = [
        _along(one.poses(STEP, arm), cover, lasts, one)
        for one, lasts in zip(lattice.primitives, duration.tolist(), strict=True)
    ]
    standing = [
        _placed(np.array([(0.0, 0.0, angle)]), cover, np.zeros(1), np.zeros(1)) for angle in lattice.angles
    ]
    return MotionDiscs(
        duration,
        _firsts(moving),
        np.concatenate(moving).ravel(),
        np.array([_reach(discs) for discs in moving]),
        _firsts(standing),
        np.concatenate(standing).ravel(),
        max(_reach(discs) for discs in standing),
    )


def _along(poses: Floats, cover: Floats, lasts: float, motion: LatticeMotion) -> Floats:
    """The discs of a motion: each place stands for the time to half way to the places beside it."""
    at = times_along(poses, lasts, in_place=motion.length == 0)
    middle = (at[1:] + at[:-1]) / 2
    begin = np.concatenate(([-SLACK], middle))
    end = np.concatenate((middle, [lasts + SLACK]))
    return _placed(poses, cover, begin, end)


def times_along(poses: Floats, lasts: float, *, in_place: bool) -> Floats:
    """When a motion of constant speed is at each of its poses; float64 (n,), 0 to ``lasts``."""
    d = np.diff(poses, axis=0)
    turn = np.abs(d[:, 2])
    if in_place:
        steps = turn
    else:
        half = turn / 2
        bent = half > 1e-9
        chord = np.sqrt(d[:, 0] * d[:, 0] + d[:, 1] * d[:, 1])
        steps = np.where(
            bent, chord * np.where(bent, half, 1.0) / np.where(bent, elementary.sin(half), 1.0), chord
        )
    run = np.concatenate(([0.0], np.cumsum(steps)))
    times: Floats = run * (lasts / run[-1])
    return times


def _placed(poses: Floats, cover: Floats, begin: Floats, end: Floats) -> Floats:
    """Discs at poses (y up) with their spans; float64 (poses * discs, 5), y down."""
    cos, sin = elementary.cos(poses[:, 2]), -elementary.sin(poses[:, 2])
    x = poses[:, :1] + cos[:, None] * cover[:, 0] - sin[:, None] * cover[:, 1]
    y = -poses[:, 1:2] + sin[:, None] * cover[:, 0] + cos[:, None] * cover[:, 1]
    radius = np.broadcast_to(cover[:, 2], x.shape)
    spans = (np.broadcast_to(span[:, None], x.shape) for span in (begin, end))
    return np.stack((x, y, radius, *spans), axis=2).reshape(-1, 5)


def _firsts(parts: list[Floats]) -> NDArray[np.int64]:
    return np.concatenate(([0], np.cumsum([len(part) for part in parts]))).astype(np.int64)


def _reach(discs: Floats) -> float:
    middle = np.sqrt(discs[:, 0] * discs[:, 0] + discs[:, 1] * discs[:, 1])
    return math.nextafter(float((middle + discs[:, 2]).max()), math.inf)

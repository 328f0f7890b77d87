"""Motion primitives of files, pose by pose, beside those that are made here of lines and arcs."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from lampyris._core import elementary
from lampyris._core.arrays import index_array
from lampyris.errors import FileError
from lampyris.model.lattice.motion_primitives import Motion, MotionPrimitives
from lampyris.typing import Cell, Floats

DRIFT = 0.15
"""Radians between heading and direction of travel that count as driving straight ahead: headings of 22.5 degrees
have straight motions along (2, 1), which is 4.1 degrees off."""
LOOSE = 0.02
"""Share by which an arc may be tighter than the robot's turning radius, and lengths of files are rounded."""
DIGIT = 1e-4
"""Metres and radians that the last digit of a ``.mprim`` is worth."""


class LatticeMotion(Protocol):
    """What a lattice needs to know of a motion primitive; lengths in cells."""

    def __hash__(self) -> int: ...

    @property
    def start(self) -> int:
        """Heading at the beginning, as a number."""

    @property
    def end(self) -> int:
        """Heading at the end."""

    @property
    def cell(self) -> Cell:
        """(x, y) where it ends, y up."""

    @property
    def length(self) -> float:
        """Distance driven."""

    @property
    def reach(self) -> float:
        """How far from the first cell it goes along an axis."""

    @property
    def turn(self) -> float:
        """Angle turned, radians, whichever direction."""

    @property
    def reverse(self) -> bool:
        """Whether it is driven in reverse."""

    @property
    def price(self) -> float:
        """Factor of its cost."""

    def poses(self, step: float, arm: float) -> Floats:
        """Poses along it, both ends included: x, y (y up) and yaw; float64 (n, 3); see :class:`Primitive`."""


@dataclass(frozen=True, slots=True, eq=False)
class SampledPrimitive:
    """A motion through given poses, along an arc from each to the next.

    Parameters
    ----------
    start, end : headings, as numbers.
    cell : (x, y) where it ends, y up.
    track : float64 (n, 3): x, y (cells, y up) and yaw, without jumps by whole turns.
    reverse : whether it is driven in reverse.
    price : factor of its cost.
    """

    start: int
    end: int
    cell: Cell
    track: Floats
    reverse: bool = False
    price: float = 1.0

    @property
    def length(self) -> float:
        """Distance driven, cells."""
        return math.fsum(step_lengths(self.track).tolist())

    @property
    def reach(self) -> float:
        """How far from the first cell it goes along an axis, cells."""
        return float(np.abs(self.track[:, :2]).max())

    @property
    def turn(self) -> float:
        """Angle turned, radians, whichever direction."""
        return math.fsum(np.abs(np.diff(self.track[:, 2])).tolist())

    def poses(self, step: float, arm: float) -> Floats:
        """See :meth:`lampyris.planning.lattice.primitives.Primitive.poses`."""
        d = np.diff(self.track, axis=0)
        moved = step_lengths(self.track) + np.abs(d[:, 2]) * arm
        parts = np.maximum(np.ceil(moved / step), 1.0).astype(np.int64)
        first = np.repeat(np.arange(len(d)), index_array(parts))
        at = np.arange(len(first)) - np.repeat(np.cumsum(parts) - parts, index_array(parts)) + 1
        share, turn = at / parts[first], d[first, 2]
        # The chord to a point of an arc is to the whole chord as the sines of half the angles are.
        bent = np.abs(turn) > 1e-9
        whole = np.where(bent, turn / 2, 1.0)
        ratio = np.where(bent, elementary.sin(whole * share) / elementary.sin(whole), share)
        bend = np.where(bent, turn * (share - 1) / 2, 0.0)
        cos, sin = elementary.cos(bend), elementary.sin(bend)
        dx, dy = d[first, 0] * ratio, d[first, 1] * ratio
        x = self.track[first, 0] + cos * dx - sin * dy
        y = self.track[first, 1] + sin * dx + cos * dy
        made = np.column_stack((x, y, self.track[first, 2] + share * turn))
        made[at == parts[first]] = self.track[1:]
        return np.concatenate((self.track[:1], made))


def step_lengths(track: Floats) -> Floats:
    """Length of the arc from each pose to the next; float64 (n - 1,)."""
    d = np.diff(track, axis=0)
    chord = np.sqrt(d[:, 0] * d[:, 0] + d[:, 1] * d[:, 1])
    half = np.abs(d[:, 2]) / 2
    bent = half > 1e-9
    return np.where(
        bent, chord * np.where(bent, half, 1.0) / np.where(bent, elementary.sin(half), 1.0), chord
    )


def sampled(
    given: MotionPrimitives, drive: str, turn_radius: float, reverse: bool
) -> Iterator[SampledPrimitive]:
    """The primitives of a file for a robot.

    Parameters
    ----------
    turn_radius : of the robot, cells.
    reverse : whether it may drive in reverse; motions in reverse are left out otherwise.

    Raises
    ------
    FileError : ``PRIMITIVE_DRIVE``, ``PRIMITIVE_TURN_RADIUS``: a motion that the robot cannot drive; the place names it.
    """
    opposite = _opposites(given.headings) if given.opposite and drive != "omnidirectional" else {}
    for motion in given.motions:
        track = motion.poses / (given.resolution, given.resolution, 1.0)
        backward = _is_reverse(motion, track, drive, turn_radius, given)
        made = SampledPrimitive(motion.start, motion.end, motion.cell, track, backward, motion.price)
        if reverse or not backward:
            yield made
        if reverse and not backward and made.length > 0 and motion.start in opposite:
            start, end = opposite[motion.start], opposite.get(motion.end)
            if end is not None:
                turned = track + np.array((0.0, 0.0, given.headings[start] - track[0, 2]))
                yield SampledPrimitive(start, end, motion.cell, turned, True, motion.price)


def _opposites(headings: tuple[float, ...]) -> dict[int, int]:
    """The heading opposite to each, where there is one."""
    found = {}
    for k, one in enumerate(headings):
        for j, other in enumerate(headings):
            if abs(abs(math.remainder(other - one, 2 * math.pi)) - math.pi) < 1e-3:
                found[k] = j
    return found


def _is_reverse(
    motion: Motion, track: Floats, drive: str, turn_radius: float, given: MotionPrimitives
) -> bool:
    """Whether a motion is driven in reverse; one that the robot cannot drive is refused."""
    where = f"{given.name}:{motion.line}" if motion.line else given.name or "primitives"
    where += f": primitive {motion.number} of heading {motion.start}"
    lengths, d = step_lengths(track), np.diff(track, axis=0)
    turn = np.abs(d[:, 2])
    still = lengths <= 1e-6
    if still.any() and not still.all():
        raise FileError(
            "PRIMITIVE_DRIVE", "turns in place on the way", where=where, allowed="a motion or a turn"
        )
    if still.all():
        if drive == "ackermann":
            allowed = "motions without a turn in place, for the drive ackermann"
            raise FileError("PRIMITIVE_DRIVE", "turns in place", where=where, allowed=allowed)
        return False
    slack = DIGIT / given.resolution
    tight = turn * turn_radius > lengths * (1 + LOOSE) + slack + DIGIT * turn_radius
    if tight.any():
        k = int((turn / lengths).argmax())
        raise FileError(
            "PRIMITIVE_TURN_RADIUS",
            f"an arc of radius {lengths[k] / turn[k] * given.resolution:.4g} m",
            where=where,
            allowed=f"at least {turn_radius * given.resolution:.4g} m, the robot's turn_radius",
        )
    if drive == "omnidirectional":
        return False
    travel = elementary.atan2(d[:, 1], d[:, 0])
    off = np.remainder(travel - track[:-1, 2] - d[:, 2] / 2 + math.pi, 2 * math.pi) - math.pi
    backward = np.abs(off) > math.pi / 2
    off = np.where(backward, math.pi - np.abs(off), np.abs(off))
    sideways = off > DRIFT + slack / lengths
    if sideways.any() or (backward.any() and not backward.all()):
        k = int(off.argmax())
        what = f"drives {math.degrees(off[k]):.3g} degrees off its heading"
        if not sideways.any():
            what = "changes between ahead and reverse"
        allowed = f"{math.degrees(DRIFT):.2g} degrees, one gear a motion, for the drive {drive}"
        raise FileError("PRIMITIVE_DRIVE", what, where=where, allowed=allowed)
    return bool(backward.all())

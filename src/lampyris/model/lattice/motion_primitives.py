"""Motion primitives given pose by pose, as files of other planners hold them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from lampyris._core.arrays import numbers_of
from lampyris._core.predicates import cell_of, numbers
from lampyris._core.scalars import in_range, is_whole
from lampyris._core.values import Value
from lampyris.errors import SettingError, shown
from lampyris.typing import Cell, Floats

MAX_HEADINGS = 128
MAX_MOTIONS = 2_000
MAX_POSES = 500_000
"""Poses of all motions together."""
MAX_STEP = 5.0
"""Cells between two poses of a motion: what lies between them is taken for an arc."""
MAX_TURN = 0.8
"""Radians between two poses."""
NEAR = 0.1
"""Cells by which the first and the last pose of a motion may miss the centre of a cell."""
YAW_NEAR = 0.01
"""Radians by which the first pose may miss the heading that the motion begins at."""
_FAR = 10_000
_SAME = 1e-10
"""Cells and radians by which poses that are already on the lattice may differ from it: a copy is not moved again."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Motion(Value):
    """One motion from a lattice state to another, pose by pose.

    Parameters
    ----------
    number : what its file calls it.
    start, end : headings at its ends, as numbers.
    cell : (x, y) where it ends, y up, in cells from where it begins.
    poses : float64 (n, 3): x, y (metres, y up) and yaw (radians); from (0, 0).
    price : its cost is so many times what a motion of its length costs.
    line : where it stands in its file; 0: in none.

    Raises
    ------
    SettingError : ``PRIMITIVE``: a value of another kind or out of its range.

    Examples
    --------
    >>> import lampyris
    >>> motions = lampyris.motion_primitives(lampyris.Robot(drive="ackermann", turn_radius=0.5), 0.1).motions
    >>> motions[0].start, motions[0].cell
    (0, (1, 0))
    """

    number: int
    start: int
    end: int
    cell: Cell
    poses: Floats
    price: float = 1.0
    line: int = 0

    if TYPE_CHECKING:  # what is accepted; what is held is declared above

        def __init__(
            self,
            number: int,
            start: int,
            end: int,
            cell: Sequence[int],
            poses: ArrayLike,
            price: float = ...,
            line: int = ...,
        ) -> None: ...

    def __post_init__(self) -> None:
        for name in ("number", "start", "end", "line"):
            value: Any = getattr(self, name)
            if not is_whole(value, 0) or value >= 2**53:
                raise _refused(f"{name} {shown(value)}", "a whole number of at least 0")
            object.__setattr__(self, name, int(value))
        cell = cell_of(self.cell)
        if cell is None or max(map(abs, cell)) > _FAR:
            raise _refused(f"cell {shown(self.cell)}", f"two whole numbers within {_FAR:,}")
        object.__setattr__(self, "cell", cell)
        if not in_range(self.price, 1e-3, 1e6):
            raise _refused(f"price {shown(self.price)}", "0.001 to 1e6")
        object.__setattr__(self, "price", float(self.price))
        object.__setattr__(self, "poses", numbers_of("motion", "poses", self.poses, (None, 3)))
        if len(self.poses) < 2:
            raise _refused(f"{len(self.poses)} poses", "at least two")
        if not (np.abs(self.poses) <= 1e6).all():
            raise _refused("a pose that is not finite or too far away", "metres and radians within 1e6")

    def _brief(self) -> str:
        return f"<Motion {self.number} from heading {self.start} to {self.end} in {len(self.poses)} poses>"


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class MotionPrimitives(Value):
    """The motions of a state lattice.

    Parameters
    ----------
    resolution : metres a cell.
    headings : radians, rising, in [0, 2 pi).
    motions : all of them. Their ends are moved onto the lattice, by as much at each pose as the share of the motion
        that lies before it.
    opposite : whether a robot that may reverse drives each motion in reverse too, from the opposite heading, as
        Nav2 does; otherwise motions in reverse are among the others.
    turn_radius : the smallest for which they were made, metres; 0: not known.
    name : of the file, for messages.

    Raises
    ------
    SettingError : ``PRIMITIVE``, ``PRIMITIVE_START``, ``PRIMITIVE_END``, ``PRIMITIVE_STEP``: a motion that does not
        begin and end at lattice states, or jumps; the place names it.

    Examples
    --------
    >>> import lampyris
    >>> made = lampyris.motion_primitives(lampyris.Robot(drive="ackermann", turn_radius=0.5), 0.1)
    >>> made.resolution, len(made.headings)
    (0.1, 16)
    """

    resolution: float
    headings: tuple[float, ...]
    motions: tuple[Motion, ...]
    opposite: bool = False
    turn_radius: float = 0.0
    name: str = ""

    if TYPE_CHECKING:  # what is accepted; what is held is declared above

        def __init__(
            self,
            resolution: float,
            headings: Sequence[float],
            motions: Sequence[Motion],
            opposite: bool = ...,
            turn_radius: float = ...,
            name: str = ...,
        ) -> None: ...

    def __post_init__(self) -> None:
        if not in_range(self.resolution, 1e-6, 1000):
            raise _refused(f"resolution {shown(self.resolution)}", "1e-6 to 1000 metres a cell")
        if not in_range(self.turn_radius, 0.0, 1e6):
            raise _refused(f"turn_radius {shown(self.turn_radius)}", "0 to 1e6 metres")
        if not isinstance(self.opposite, bool) or not isinstance(self.name, str):
            raise _refused(shown((self.opposite, self.name)), "true or false, and text")
        object.__setattr__(self, "headings", headings_of(self.headings))
        motions: Any = self.motions
        if not isinstance(motions, list | tuple) or not all(isinstance(one, Motion) for one in motions):
            raise _refused(f"motions {shown(motions)}", "a sequence of Motion")
        if not 1 <= len(motions) <= MAX_MOTIONS or sum(len(one.poses) for one in motions) > MAX_POSES:
            raise _refused(
                f"{len(motions):,} motions", f"1 to {MAX_MOTIONS:,}, of {MAX_POSES:,} poses in all"
            )
        object.__setattr__(
            self, "motions", tuple(on_lattice(one, self.headings, self.resolution) for one in motions)
        )

    def _brief(self) -> str:
        return (
            f"<MotionPrimitives: {len(self.motions)} at {len(self.headings)} headings, {self.resolution:g} m>"
        )


def headings_of(given: object) -> tuple[float, ...]:
    """The headings of a lattice.

    Raises
    ------
    SettingError : ``PRIMITIVE``.
    """
    found = numbers(list(given) if isinstance(given, list | tuple) else given, (None,))
    if found is None or not 1 <= len(found) <= MAX_HEADINGS:
        raise _refused(f"headings {shown(given)}", f"1 to {MAX_HEADINGS} angles")
    if not (found >= 0).all() or not (found < 2 * math.pi).all() or not (np.diff(found) > 1e-6).all():
        raise _refused(f"headings {shown(found.tolist())}", "rising angles in [0, 2 pi) radians")
    return tuple(float(x) for x in found)


def on_lattice(one: Motion, headings: tuple[float, ...], resolution: float) -> Motion:
    """The same motion from exactly one lattice state to another; one whose ends are far from them is refused.

    Raises
    ------
    SettingError : ``PRIMITIVE``, ``PRIMITIVE_START``, ``PRIMITIVE_END``, ``PRIMITIVE_STEP``.
    """
    where = f"primitive {one.number}"
    for what in (one.start, one.end):
        if what >= len(headings):
            raise SettingError(
                "PRIMITIVE", f"heading {what}", where=where, allowed=f"0 to {len(headings) - 1}"
            )
    poses = one.poses.copy()
    yaw = headings[one.start] + np.cumsum(_turned(np.diff(poses[:, 2], prepend=headings[one.start])))
    if (np.abs(yaw - poses[:, 2]) > _SAME).any():
        poses[:, 2] = yaw  # no jump by whole turns
    off = np.abs(poses[0, :2]).max() / resolution
    if off > NEAR or abs(poses[0, 2] - headings[one.start]) > YAW_NEAR:
        raise SettingError(
            "PRIMITIVE_START",
            f"begins at ({poses[0, 0]:g}, {poses[0, 1]:g}) m, yaw {one.poses[0, 2]:g}",
            where=where,
            allowed=f"(0, 0), yaw {headings[one.start]:.6g} of heading {one.start}",
        )
    end = np.array(one.cell) * resolution
    nearest = min(range(len(headings)), key=lambda k: (abs(_turn(headings[k] - poses[-1, 2])), k))
    if np.abs(poses[-1, :2] - end).max() / resolution > NEAR or nearest != one.end:
        raise SettingError(
            "PRIMITIVE_END",
            f"ends at ({poses[-1, 0]:g}, {poses[-1, 1]:g}) m, yaw {one.poses[-1, 2]:g}",
            where=where,
            allowed=f"({end[0]:g}, {end[1]:g}) m, yaw near {headings[one.end]:.6g} of heading {one.end}",
        )
    target = np.array((*end, poses[-1, 2] + _turn(headings[one.end] - poses[-1, 2])))
    share = np.linspace(0.0, 1.0, len(poses))[:, None]
    start = np.array((0.0, 0.0, headings[one.start]))
    same = _SAME * np.array((resolution, resolution, 1.0))
    if (np.abs(start - poses[0]) > same).any() or (np.abs(target - poses[-1]) > same).any():
        poses += (1.0 - share) * (start - poses[0]) + share * (target - poses[-1])
        poses[0], poses[-1] = start, target
    moved = np.abs(np.diff(poses, axis=0))
    kept = np.concatenate(([True], (moved[:, :2].max(axis=1) > 1e-9 * resolution) | (moved[:, 2] > 1e-9)))
    poses = poses[kept]
    if not kept[-1]:
        poses[-1] = target
    moved = np.abs(np.diff(poses, axis=0))
    if len(poses) < 2:
        raise SettingError("PRIMITIVE", "stays where it is", where=where, allowed="a motion or a turn")
    far = np.sqrt(moved[:, 0] * moved[:, 0] + moved[:, 1] * moved[:, 1]) / resolution
    if (far > MAX_STEP).any() or (moved[:, 2] > MAX_TURN).any():
        k = int(np.maximum(far / MAX_STEP, moved[:, 2] / MAX_TURN).argmax())
        raise SettingError(
            "PRIMITIVE_STEP",
            f"{far[k]:.3g} cells and {moved[k, 2]:.3g} rad between two poses",
            where=where,
            allowed=f"at most {MAX_STEP:g} cells and {MAX_TURN:.3g} rad",
        )
    return replace(one, poses=poses)


def _turned(angle: Floats) -> Floats:
    """Angles in [-pi, pi)."""
    return np.remainder(angle + math.pi, 2 * math.pi) - math.pi


def _turn(angle: float) -> float:
    return math.remainder(angle, 2 * math.pi)


def _refused(what: str, allowed: str) -> SettingError:
    return SettingError("PRIMITIVE", what, where="primitives", allowed=allowed)

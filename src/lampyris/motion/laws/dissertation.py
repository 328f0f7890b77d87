"""The dissertation's speed law: velocity units, one value a node, one transfer between nodes."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lampyris._core.predicates import array_of
from lampyris._core.settings import check_settings, flag, number, under_code, word
from lampyris.errors import SettingError, shown
from lampyris.kernels.motion.speed_passes import sweep
from lampyris.model.path import Path
from lampyris.model.profile import Profile
from lampyris.model.scene import Scene
from lampyris.motion import caps
from lampyris.motion.laws.rings import RING1, RING2, Reading, cells_of, count, headings, step_error
from lampyris.motion.lowest import lowest, only
from lampyris.motion.profile import start_speed
from lampyris.typing import Cell, Floats

_STEP_X, _STEP_Y = np.arange(25, dtype=np.int64) % 5 - 2, np.arange(25, dtype=np.int64) // 5 - 2
"""The steps that :func:`lampyris.motion.laws.rings.headings` numbers."""

_KIND = np.where(np.gcd(_STEP_X, _STEP_Y) == 1, np.abs(_STEP_X * _STEP_Y), np.int64(-1))
"""By step: 0 straight, 1 diagonal, 2 knight's, -1 none of them."""

_SQUARES = np.maximum(_STEP_X * _STEP_X + _STEP_Y * _STEP_Y, 1)
_TURN = (np.outer(_STEP_X, _STEP_X) + np.outer(_STEP_Y, _STEP_Y)) / np.sqrt(np.outer(_SQUARES, _SQUARES))
"""Cosine of the turn, by the step into a node and the step out of it; (25, 25)."""


@dataclass(frozen=True, slots=True)
class DissertationLaw:
    """Settings of the dissertation's law (Table 3.1, Algorithms 3.10-3.12); velocity units throughout.

    Parameters
    ----------
    v_max : maximum velocity.
    v_min : what obstacles alone never go below.
    ring1_drop, ring2_drop : less for each obstacle counted in ring 1, in ring 2.
    a_straight, a_diagonal, a_knight : more with each step of that kind. Half of the acceleration 40 times
        the length of the step as the dissertation counts it: 1 and 1.4; 2.2 for a knight's step, which it
        does not have, is ours.
    braking : the most a velocity may fall in one transfer. Nowhere in its algorithms; its tables need it.
    v_180, v_135, v_90 : limits by interior angle, the nearest of the three.
    ring1, ring2 : which cells of a ring count: ``all``, or those ``ahead``, within 45 degrees of the
        incoming heading.
    outside1, outside2 : whether cells out of the map count as obstacles in that ring.

    Raises
    ------
    SettingError : ``LAW_SETTING``.
    """

    v_max: float = number(80.0, 1e-6, 1e6, title="maximum velocity")
    v_min: float = number(20.0, 1e-6, 1e6, title="minimum among obstacles")
    ring1_drop: float = number(6.0, 1e-6, 1e6, off=(0.0, "no drop"), title="drop for each obstacle in ring 1")
    ring2_drop: float = number(3.0, 1e-6, 1e6, off=(0.0, "no drop"), title="drop for each obstacle in ring 2")
    a_straight: float = number(20.0, 1e-6, 1e6, title="increase at a straight step")
    a_diagonal: float = number(28.0, 1e-6, 1e6, title="increase at a diagonal step")
    a_knight: float = number(44.0, 1e-6, 1e6, title="increase at a knight's step")
    braking: float = number(40.0, 1e-6, 1e6, title="maximum decrease")
    v_180: float = number(80.0, 1e-6, 1e6, title="limit at 180°")
    v_135: float = number(60.0, 1e-6, 1e6, title="limit at 135°")
    v_90: float = number(20.0, 1e-6, 1e6, title="limit at 90°")
    ring1: Reading = word(RING1, ("all", "ahead"), title="cells of ring 1 that count")
    ring2: Reading = word(RING2, ("all", "ahead"), title="cells of ring 2 that count")
    outside1: bool = flag(True, title="outside counts in ring 1")
    outside2: bool = flag(False, title="outside counts in ring 2")

    def __post_init__(self) -> None:
        check_settings(self, under_code("LAW_SETTING", "dissertation."))
        if self.v_min > self.v_max:
            raise SettingError(
                "LAW_SETTING",
                f"{self.v_min:g}",
                where="dissertation.v_min",
                allowed=f"at most v_max = {self.v_max:g}",
            )


DEFAULT = DissertationLaw()
"""The law as printed."""


def dissertation_speeds(cells: ArrayLike, ring1: Sequence[Any], ring2: Sequence[Any]) -> Floats:
    """Speed at each node of a path by the dissertation's law, in velocity units; shape (n,).

    Parameters
    ----------
    cells : (n, 2), x and y, start first; each a single step (straight, diagonal or knight's) from the one
        before.
    ring1, ring2 : obstacles counted around each node, whole numbers, (n,). Those of the two ends are not
        used and may be None, NaN or blank.

    Raises
    ------
    SettingError : ``PATH_CELLS``, ``PATH_STEP``, ``RING_COUNT``.

    It reproduces the tables of the dissertation: means 48.58 (Table 4.14) and 55.06 (Table 4.15) over
    nodes with v > 0.

    Examples
    --------
    >>> import lampyris
    >>> lampyris.dissertation_speeds([(0, 0), (1, 0), (2, 0)], [0, 1, 0], [0, 2, 0]).tolist()
    [0.0, 20.0, 0.0]
    """
    return dissertation_profile(cells, ring1, ring2)[0]


def dissertation_profile(
    cells: ArrayLike,
    ring1: Sequence[Any],
    ring2: Sequence[Any],
    *,
    law: DissertationLaw = DEFAULT,
    v0: float = 0.0,
    previous: Cell | None = None,
) -> tuple[Floats, tuple[str, ...]]:
    """Speed at each node and its cause: start, limit, acceleration, ring 1, ring 2, angle, braking or goal.

    ``v[i] = min(v_max, v[i-1] + a[i], obstacle[i], angle[i])`` forward, then ``v[i] <= v[i+1] + braking``
    backward from the goal, where v = 0. Ties go to the cause named first in the list above; of the two
    rings, ring 1 if it takes away as much as ring 2.

    Parameters
    ----------
    cells, ring1, ring2 : as for :func:`dissertation_speeds`. With ``v0`` the first node's counts are used
        if there.
    law : settings.
    v0 : velocity at the first node, for a robot already driving. It is a cap among the others there, not a
        promise: where an obstacle has just come near, the first node's velocity is what the caps and the
        backward pass now say, at once, however steep that is. The law knows no other way; the physical one
        does.
    previous : the cell the robot came from, for the angle at the first node; None: no angle there.

    Raises
    ------
    SettingError : ``PATH_CELLS``, ``PATH_STEP``, ``RING_COUNT``, ``START_SPEED``.
    """
    found = cells_of(cells)
    n = len(found)
    n1, n2 = _counts(ring1, n, 1), _counts(ring2, n, 2)
    return _speeds(headings(found, previous), n1, n2, law, start_speed(v0), previous is not None)[:2]


def path_profile(
    path: Path,
    scene: Scene,
    law: DissertationLaw,
    *,
    obstacles: Iterable[Cell] | NDArray[Any] = (),
    v0: float = 0.0,
    previous: Cell | None = None,
) -> Profile:
    """A Profile by the dissertation's law, the rings counted on the scene's map and the moving obstacles.

    s in cells (path.arc), v in velocity units, t the number of transfers (the node's index), a the
    difference of v to the next node, 0 at the last.

    Raises
    ------
    SettingError : ``START_SPEED``, ``PATH_STEP``.
    """
    cells = path.cells.astype(np.int64)
    v, cause, cause_index = cell_speeds(cells, scene, law, obstacles, start_speed(v0), previous)
    a = np.zeros(len(v))
    np.subtract(v[1:], v[:-1], out=a[:-1])
    t = np.arange(len(v), dtype=np.float64)
    return Profile("dissertation", path.arc, v, a, t, cause, "velocity units", cause_index)


def cell_speeds(
    cells: NDArray[np.int64],
    scene: Scene,
    law: DissertationLaw,
    obstacles: Iterable[Cell] | NDArray[Any],
    v0: float,
    previous: Cell | None = None,
) -> tuple[Floats, tuple[str, ...], NDArray[np.int64]]:
    """Velocity of each cell of a path, its cause, and for braking the cell braked for; the rings are counted.

    ``cells`` : int64 (n, 2), by single steps.

    Raises
    ------
    SettingError : ``PATH_STEP``.
    """
    heading = headings(cells, previous)
    blocked = scene.grid.blocked
    n1, n2 = count(cells, heading, blocked, obstacles, law.ring1, law.ring2, law.outside1, law.outside2)
    return _speeds(heading, n1, n2, law, v0, previous is not None)


def _speeds(
    heading: NDArray[np.int64],
    n1: NDArray[np.int64],
    n2: NDArray[np.int64],
    law: DissertationLaw,
    v0: float,
    came: bool,
) -> tuple[Floats, tuple[str, ...], NDArray[np.int64]]:
    """The law itself, from headings and counts; ``came``: whether the first heading was really driven.

    Speeds, causes, and the node that each braking one brakes for.
    """
    n = len(heading)
    up = _rises(heading, law)
    low = lowest(
        [("start", only(n, 0, v0)), *_caps(heading, n1, n2, law, came), ("goal", only(n, -1, 0.0))],
    )
    sweep(low.v, up, np.full(n - 1, law.braking), low.keeps, low.cause, low.cause_index)
    return low.v, low.words, low.cause_index


def ring_caps(
    cells: ArrayLike,
    ring1: Sequence[Any],
    ring2: Sequence[Any],
    *,
    law: DissertationLaw = DEFAULT,
    previous: Cell | None = None,
) -> tuple[tuple[str, Floats], ...]:
    """What each rule alone allows at each node, by its cause, infinity where it says nothing: what a chart
    draws beside the speeds. Arguments as for :func:`dissertation_profile`.

    Raises
    ------
    SettingError : ``PATH_CELLS``, ``PATH_STEP``, ``RING_COUNT``.
    """
    found = cells_of(cells)
    n1, n2 = _counts(ring1, len(found), 1), _counts(ring2, len(found), 2)
    return tuple(_caps(headings(found, previous), n1, n2, law, previous is not None))


def _caps(
    heading: NDArray[np.int64], n1: NDArray[np.int64], n2: NDArray[np.int64], law: DissertationLaw, came: bool
) -> list[tuple[str, Floats]]:
    """The law's rules, in the order in which ties are decided."""
    by_rings, by_angle = node_caps(heading, n1, n2, law, came)
    ring1_leads = law.ring1_drop * n1 >= law.ring2_drop * n2
    return [
        ("limit", caps.limit(len(heading), law.v_max)),
        ("ring 1", np.where(ring1_leads, by_rings, np.inf)),
        ("ring 2", np.where(ring1_leads, np.inf, by_rings)),
        ("angle", by_angle),
    ]


def node_caps(
    heading: NDArray[np.int64], n1: NDArray[np.int64], n2: NDArray[np.int64], law: DissertationLaw, came: bool
) -> tuple[Floats, Floats]:
    """Greatest velocities by the obstacles around each node and by its angle, float64 (n,); infinity without an angle.

    Parameters
    ----------
    heading, n1, n2 : of :func:`lampyris.motion.laws.rings.headings` and :func:`lampyris.motion.laws.rings.count`.
    came : whether there is an angle at the first node.
    """
    by_rings = caps.rings(
        n1, n2, v_max=law.v_max, v_min=law.v_min, drop1=law.ring1_drop, drop2=law.ring2_drop
    )
    by_angle = np.full(len(heading), np.inf)
    bend = slice(0 if came else 1, len(heading) - 1)
    turn = _TURN[heading[:-1], heading[1:]][bend]
    by_angle[bend] = caps.angle(turn, v_180=law.v_180, v_135=law.v_135, v_90=law.v_90)
    return by_rings, by_angle


def _rises(heading: NDArray[np.int64], law: DissertationLaw) -> Floats:
    """How much the velocity may rise on the way into each node but the first."""
    kinds = _KIND[heading[1:]].tolist()
    if -1 in kinds:
        k = kinds.index(-1) + 1
        dy, dx = divmod(int(heading[k]), 5)
        raise step_error(k, dx - 2, dy - 2, "straight, diagonal and knight's steps")
    rises: Floats = np.array((law.a_straight, law.a_diagonal, law.a_knight))[kinds]
    return rises


def _counts(given: Sequence[Any], n: int, ring: int) -> NDArray[np.int64]:
    """Whole numbers from what a table may hold; the two ends may be empty."""
    most = 8 * ring
    counts = array_of(given)
    if counts is None or counts.ndim != 1:
        raise SettingError("RING_COUNT", shown(given), where=f"ring{ring}", allowed=f"one a node: {n}")
    values = list(given)
    if len(values) != n:
        raise SettingError(
            "RING_COUNT", f"{len(values)} counts", where=f"ring{ring}", allowed=f"one a node: {n}"
        )
    out = np.zeros(n, dtype=np.int64)
    for i, value in enumerate(values):
        blank = value is None or (isinstance(value, str) and not value.strip())
        blank = blank or (isinstance(value, float | np.floating) and math.isnan(value))
        if blank and i in (0, n - 1):
            continue
        try:
            number = float(value)
        except (TypeError, ValueError, OverflowError):
            number = math.nan
        if not (0 <= number <= most and number == int(number)):
            raise SettingError(
                "RING_COUNT",
                f"{shown(value)} at node {i}",
                where=f"ring{ring}",
                allowed=f"a whole number, 0 to {most}; blank only at the two ends",
            )
        out[i] = int(number)
    return out

"""Profile: how fast, and why."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from lampyris._core.arrays import items_of, numbers_of, whole_of
from lampyris._core.noun import Tabular
from lampyris._core.predicates import numbers
from lampyris._core.values import Value
from lampyris.errors import SettingError, shown
from lampyris.model.grid import Grid, MapFrame, frozen
from lampyris.typing import Floats, Points

if TYPE_CHECKING:
    import pandas


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Profile(Value, Tabular):
    """A speed for every node of a path, with the cause that limits it.

    A wait is two nodes at one distance, both with v = 0 and a = 0, the second later than the first.

    Parameters
    ----------
    law : the law's name. The dissertation's own is in velocity units, one transfer a node; all others are in
        SI units.
    s : distance along the path at each node, never falling; metres, or cells for ``dissertation``; shape (n,).
    v : speed at each node; m/s, or velocity units.
    a : acceleration on the way to the next node (0 at the last); m/s2, or velocity units a transfer.
    t : time of arrival at each node; seconds, or transfers.
    cause : what limits each speed, in one or two words.
    units : the unit of v.
    cause_index : int64 (n,): what the cause refers to: for ``braking`` the node braked for, for
        ``moving obstacle`` and ``obstacle`` its number; -1: nothing. None: -1 everywhere.
    caps : (cause, speeds (n,)) before they were made feasible, infinity where a cap sets no limit; charts draw them
        as faint lines.
    xy : float64 (n, 2): where the nodes are, cells; None: at the cells of the path.
    frame : where the map's cells lie in metres; None: unknown.

    Examples
    --------
    >>> import lampyris
    >>> scene = lampyris.Scene(lampyris.load_grid("guide"), start=(1, 8), goal=(8, 2))
    >>> profile = lampyris.speed_profile(scene, lampyris.plan(scene, "astar"))
    >>> profile.units, len(profile.v) == len(profile.cause)
    ('m/s', True)
    """

    law: str
    s: Floats
    v: Floats
    a: Floats
    t: Floats
    cause: tuple[str, ...]
    units: str
    cause_index: NDArray[np.int64] = field(default=None)  # type: ignore[arg-type]
    caps: tuple[tuple[str, Floats], ...] = ()
    xy: Points | None = None
    frame: MapFrame | None = None

    def __post_init__(self) -> None:
        n = len(items_of("profile", "cause", self.cause))
        for name in "svat":
            object.__setattr__(self, name, numbers_of("profile", name, getattr(self, name), (n,)))
        cause_index = np.full(n, -1) if self.cause_index is None else self.cause_index
        object.__setattr__(self, "cause_index", whole_of("profile", "cause_index", cause_index, (n,)))
        caps = tuple(_cap(pair, n) for pair in items_of("profile", "caps", self.caps))
        object.__setattr__(self, "caps", caps)
        if self.xy is not None:
            object.__setattr__(self, "xy", numbers_of("profile", "xy", self.xy, (n, 2)))

    def _brief(self) -> str:
        far, long = ("m", "s") if self.metric else ("cells", "transfers")
        ends = f"{self.s[-1]:.6g} {far} in {self.duration:.6g} {long}" if len(self.s) else "empty"
        return f"<Profile {self.law}: {len(self.s)} nodes, {ends}>"

    def to_pandas(self, grid: Grid | None = None) -> pandas.DataFrame:
        """The profile as a table, a row a node: metres, seconds, m/s.

        Columns ``t_s``, ``s``, ``v``, ``a``, ``cause``, ``why``; before them ``x_m``, ``y_m`` (map frame, y up) where
        the profile knows its places, as that of a sampled path does. Of a law in velocity units ``v`` and ``a`` are
        in these, ``s`` is in cells, and ``t_transfers`` stands in place of ``t_s``.

        Parameters
        ----------
        grid : the map; None: that of :attr:`frame`, which profiles of :func:`lampyris.speed_profile` have.

        Raises
        ------
        UsageError : ``PANDAS``: pandas is not installed.
        """
        return self._table(frame=self.frame if grid is None else grid.frame)

    @property
    def metric(self) -> bool:
        """Whether it is in metres and seconds."""
        return self.units == "m/s"

    @property
    def mean(self) -> float:
        """Mean over the nodes with v > 0, as the dissertation counts (0 if there is none)."""
        moving = self.v[self.v > 0]
        return float(moving.sum() / len(moving)) if len(moving) else 0.0

    @property
    def duration(self) -> float:
        """Time from start to goal, in the unit of t."""
        return float(self.t[-1])

    def why(self, k: int) -> str:
        """The binding cause of node ``k`` in words: ``braking for node 41 (curvature)``."""
        return reason(self.cause, self.cause_index, k)


def reason(cause: tuple[str, ...], cause_index: NDArray[np.int64], k: int) -> str:
    """What binds node ``k``, in words."""
    word, of = cause[k], int(cause_index[k])
    if of < 0:
        return word
    if word == "braking":
        return f"braking for node {of} ({cause[of]})"
    return f"wait for obstacle {of}" if word == "wait" else f"{word} {of}"


def _cap(pair: object, n: int) -> tuple[str, Floats]:
    """A cause and its speeds; infinity where it says nothing."""
    cause, values = pair if isinstance(pair, tuple | list) and len(pair) == 2 else ("", None)
    speeds = numbers(values, (n,))
    if speeds is None:
        allowed = f"pairs of a cause and {n} numbers"
        raise SettingError("ARRAY", shown(pair), where="profile.caps", allowed=allowed)
    return cause, frozen(speeds)


NODE_COLUMNS = ("ring1", "ring2", "obstacle_velocity", "angle_deg", "angle_velocity")


class NodeTable(NamedTuple):
    """Columns of Tables 4.12 to 4.17 of the dissertation for a path; velocities in its units.

    Parameters
    ----------
    ring1, ring2 : int64 (n,): obstacles counted in ring 1 and, ahead, in ring 2; walls, cells off the map (ring 1) and
        moving obstacles.
    obstacle_velocity : float64 (n,): maximum velocity beside them.
    angle_deg : float64 (n,): interior angle of the path, degrees: 180 straight on, 135, 90, 45, 0 back; NaN at both
        ends.
    angle_velocity : float64 (n,): maximum velocity at that angle; NaN at both ends.
    """

    ring1: NDArray[np.int64]
    ring2: NDArray[np.int64]
    obstacle_velocity: Floats
    angle_deg: Floats
    angle_velocity: Floats

    def columns(self) -> dict[str, list[float | None]]:
        """Lists by name, None where there is no value."""
        return {
            name: [None if value != value else value for value in getattr(self, name).tolist()]
            for name in NODE_COLUMNS
        }

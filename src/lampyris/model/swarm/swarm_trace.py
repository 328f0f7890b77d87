"""SwarmTrace: what the robots of a swarm measured, heard and did, iteration by iteration."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lampyris._core.predicates import fits, numbers
from lampyris._core.values import Value
from lampyris.errors import SettingError, shown
from lampyris.model.grid import Grid, frozen
from lampyris.model.plan import Status
from lampyris.model.settings.swarm import SwarmSettings
from lampyris.model.swarm.sources import AnySource, Source
from lampyris.typing import Floats

Counts = NDArray[np.int32]
"""int32, any shape."""

_SENTENCES = {
    Status.FOUND: "Every source is held.",
    Status.ITERATION_LIMIT: "Not every source is held after the last iteration.",
    Status.LIMIT: "Stopped at the budget.",
    Status.CANCELLED: "Stopped on request.",
}
_ALLOWED = {
    "xy": ("T1", "n", 2),
    "source_xy": ("T1", "k", 2),
    "luciferin": ("T1", "n"),
    "ranges": ("T1", "n"),
    "readings": ("T", "n"),
    "leaders": ("T", "n"),
    "neighbours": ("T", "n"),
    "groups": ("T", "n"),
    "held": ("T1", "k"),
}
_WHOLE = ("leaders", "neighbours", "groups", "held")


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class SwarmTrace(Value):
    """A swarm of n robots over T iterations among k sources.

    Parameters
    ----------
    status : ``found``: at the end every source is held: at least ``settings.capture_robots`` robots are within the capture
        radius; ``iteration_limit``: not every one; ``limit`` or ``cancelled``: the budget ended it.
    grid : the map.
    sources : what sends the signal.
    settings : with every default resolved.
    seed : of all random draws.
    xy : float64 (T + 1, n, 2): where each robot is before the first iteration and after each; metres of the map frame.
    source_xy : float64 (T + 1, k, 2): where the peaks of the sources are, in the same way.
    readings : float64 (T, n): what each robot measured, noise included.
    luciferin, ranges : float64 (T + 1, n): luciferin and decision range, m, at first and after each iteration's update.
    leaders : int32 (T, n): the robot that each went after; -1: none.
    neighbours : int32 (T, n): brighter robots within the decision range that each heard.
    groups : int32 (T, n): the least number of the robots that are linked as neighbours, one to the next.
    held : int32 (T + 1, k): robots within the capture radius of each source, each counted at its nearest source.
    encounters : robots and iterations in which another robot was in the way.
    wall_encounters : the same, of walls.
    timing : seconds by stage; the only part that differs from run to run.
    notes : notes for the user.

    Raises
    ------
    SettingError : ``SWARM_TRACE``: an array of another kind or shape.

    Examples
    --------
    >>> import lampyris
    >>> swarm = lampyris.swarm_robots(lampyris.load_grid("env-1"), robots=10, seed=1)
    >>> swarm.xy.shape == swarm.luciferin.shape + (2,)
    True
    """

    status: Status
    grid: Grid
    sources: tuple[AnySource, ...]
    settings: SwarmSettings
    seed: int
    xy: Floats
    source_xy: Floats
    readings: Floats
    luciferin: Floats
    ranges: Floats
    leaders: Counts
    neighbours: Counts
    groups: Counts
    held: Counts
    encounters: int = 0
    wall_encounters: int = 0
    timing: Mapping[str, float] = field(default_factory=dict, compare=False)
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for name, kind in (("status", Status), ("grid", Grid), ("settings", SwarmSettings)):
            if not isinstance(getattr(self, name), kind):
                raise SettingError(
                    "SWARM_TRACE", shown(getattr(self, name)), where=name, allowed=kind.__name__
                )
        given: Any = self.sources
        if not isinstance(given, tuple | list) or not all(isinstance(one, Source) for one in given):
            raise SettingError("SWARM_TRACE", shown(given), where="sources", allowed="a list of sources")
        object.__setattr__(self, "sources", tuple(given))
        sizes: dict[Any, int] = {2: 2}
        for name, form in _ALLOWED.items():
            value = getattr(self, name)
            array = numbers(value, (None,) * len(form))
            if array is not None and array.size == 0 and name != "xy" and "T" in form and sizes["T"] == 0:
                # An empty list has lost its other sides.
                array = np.zeros(tuple(sizes[one] for one in form))
            words = ", ".join("T + 1" if one == "T1" else str(one) for one in form)
            if array is None:
                raise SettingError("SWARM_TRACE", shown(value), where=name, allowed=f"numbers ({words})")
            if name == "xy":
                sizes |= {"T1": array.shape[0], "T": array.shape[0] - 1, "n": array.shape[1]}
            if name == "source_xy":
                sizes["k"] = array.shape[1]
            if not fits(array, tuple(sizes[one] for one in form)):
                raise SettingError("SWARM_TRACE", shown(value), where=name, allowed=f"numbers ({words})")
            if name in _WHOLE:
                if not ((array % 1 == 0) & (np.abs(array) < 2**31)).all():
                    raise SettingError("SWARM_TRACE", shown(value), where=name, allowed="whole numbers")
                array = array.astype(np.int32)
            object.__setattr__(self, name, frozen(array))

    def _brief(self) -> str:
        held = f"{int(self.sources_held.sum())} of {self.held.shape[1]} sources held"
        return f"<SwarmTrace {self.status} by {self.settings.method}: {self.robots} robots, {self.iterations} iterations, {held}>"

    def __bool__(self) -> bool:
        return bool(self.status)

    @property
    def robots(self) -> int:
        """How many."""
        return len(self.xy[0])

    @property
    def iterations(self) -> int:
        """How many were done."""
        return len(self.xy) - 1

    @property
    def sentence(self) -> str:
        """What a person should read."""
        return _SENTENCES.get(self.status, self.status.sentence)

    @property
    def duration(self) -> float:
        """Simulated seconds."""
        return self.iterations * self.settings.period

    @property
    def sources_held(self) -> NDArray[np.bool_]:
        """Which sources are held at the end, bool (k,)."""
        return frozen(self.held[-1] >= self.settings.capture_robots)

    @property
    def held_from(self) -> tuple[int | None, ...]:
        """The iteration from which on each source is held to the end; None: it is not."""
        enough = self.held >= self.settings.capture_robots
        found: list[int | None] = []
        for column in enough.T:
            lost = np.flatnonzero(~column)
            first = int(lost[-1]) + 1 if len(lost) else 0
            found.append(first if first < len(column) else None)
        return tuple(found)

    @property
    def holder(self) -> Counts:
        """The source that holds each robot at the end, int32 (n,); -1: none."""
        gap = self.xy[-1][:, np.newaxis, :] - self.source_xy[-1][np.newaxis, :, :]
        square = (gap * gap).sum(axis=2)
        nearest = square.argmin(axis=1)
        radius = self.settings.capture_radius
        assert radius is not None
        near = square[np.arange(len(nearest)), nearest] < radius * radius
        return frozen(np.where(near, nearest, -1).astype(np.int32))

    def group_sizes(self, iteration: int) -> tuple[int, ...]:
        """Robots of each group during an iteration, the largest first; robots that hear nobody and are not heard are
        groups of one."""
        return tuple(sorted(np.unique(self.groups[iteration], return_counts=True)[1].tolist(), reverse=True))

    @property
    def groups_over_time(self) -> Counts:
        """Groups of at least ``settings.capture_robots`` robots in each iteration, int32 (T,): how the swarm splits."""
        enough = self.settings.capture_robots
        made = [sum(size >= enough for size in self.group_sizes(t)) for t in range(self.iterations)]
        return frozen(np.array(made, dtype=np.int32))

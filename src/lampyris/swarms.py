"""Swarms of robots that look for sources: swarm_robots, load_sources, drawn_sources.

Nothing leaves through :func:`swarm_robots` that the referee has not re-checked: the motion of every iteration at every
moment, and the trace.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields, replace
from typing import Any

import numpy as np

from lampyris import referee
from lampyris._core import cancellation
from lampyris._core.arrays import index_array
from lampyris._core.cancellation import Cancelled, checkpoint
from lampyris._core.limits import MEMORY
from lampyris._core.predicates import numbers
from lampyris._core.scalars import MAX_SEED, SEED_RANGE, is_whole
from lampyris.errors import (
    SettingError,
    UsageError,
    callable_or_none,
    did_you_mean,
    file_name,
    of_kind,
    shown,
)
from lampyris.io.source_files import read_sources
from lampyris.kernels import loading
from lampyris.model.grid import Grid
from lampyris.model.plan import Status
from lampyris.model.settings.swarm import SwarmSettings
from lampyris.model.swarm.sources import AnySource, InverseSquare, ThreePeaks
from lampyris.model.swarm.swarm_trace import SwarmTrace
from lampyris.planning.base import Budget
from lampyris.referee.fleets.swarm import SwarmMotion
from lampyris.sim.swarm.placing import draw_starts, open_cells, touches_wall
from lampyris.sim.swarm.simulation import GAP, Iteration, RobotSwarm
from lampyris.typing import Floats

ROBOTS = 100
"""Robots of calls that say nothing else."""
MAX_ROBOTS = 20_000
MAX_SOURCES = 1000
SOURCES = ("three-peaks", "drawn")
"""Sources by name: J1 over the whole map, and sources at random places."""
_EACH = 52
"""Bytes of a trace for each robot and iteration; 20 more for each source and iteration."""
_SMALL = 64
"""Bytes of an iteration for each robot and small step."""


def swarm_robots(
    grid: Grid,
    sources: str | AnySource | Sequence[AnySource] = SOURCES[0],
    robots: int | None = None,
    *,
    starts: Any = None,
    seed: int = 0,
    budget: Budget | None = None,
    progress: Callable[[int, int], None] | None = None,
    swarm_settings: Mapping[str, Any] | SwarmSettings | None = None,
    **settings: Any,
) -> SwarmTrace:
    """Glowworm swarm optimisation by robots: discs that measure a signal, broadcast, follow brighter neighbours and never touch.

    ::

        grid = lampyris.load_grid("env-6")
        trace = lampyris.swarm_robots(grid, robots=60, seed=1, iterations=300)
        trace.sources_held, trace.held[-1], trace.held_from

        lampyris.swarm_robots(grid, [lampyris.InverseSquare((10, 12), core=4)], noise=0.1, method="gradient")

    Parameters
    ----------
    grid : the map; its edge is a wall.
    sources : what sends the signal; ``three-peaks``: the function J1 stretched over the map; ``drawn``: three
        sources at random places (:func:`drawn_sources`).
    robots : how many; None: 100, or as many as ``starts``.
    starts : (n, 2), metres of the map frame; None: drawn at random in the largest region with room for a robot.
    seed : of all random draws: the same seed gives the same trace, unless seconds end it.
    budget : ``seconds`` and ``stop`` end the simulation, ``expansions`` after so many iterations; what was done is returned.
    progress : called after each iteration with how many are done, of how many.
    swarm_settings : settings by name, or all of them; see :class:`lampyris.model.settings.swarm.SwarmSettings`.
    **settings : the same as keywords; none that is in ``swarm_settings``, too.

    Raises
    ------
    SettingError : ``ROBOTS``, ``STARTS``, ``SOURCES``, ``SEED``, ``SWARM_SETTING``: what is given is wrong, or there is no room.
    UsageError : ``SETTING_CLASH``: a setting in ``swarm_settings`` and as a keyword.
    LimitError : ``MEMORY``: the trace would take more memory than is allowed.
    InternalFault : the referee refused the motion or the trace; a fault of lampyris.

    Examples
    --------
    >>> import lampyris
    >>> swarm = lampyris.swarm_robots(lampyris.load_grid("env-1"), robots=10, seed=1)
    >>> swarm.status.value, swarm.xy.shape[1:]
    ('iteration-limit', (10, 2))
    """
    of_kind("grid", grid, Grid)
    of_kind("budget", budget, Budget, none=True)
    callable_or_none("progress", progress)
    if not is_whole(seed, 0, MAX_SEED):
        raise SettingError.of("SEED", "seed", shown(seed), allowed=SEED_RANGE)
    chosen = _settings(swarm_settings, settings).on(grid)
    count = _robots(robots, starts)
    began, loaded = loading.wall(), loading.seconds()
    found = _sources(sources, grid, int(seed), chosen)
    peaks = len([place for one in found for place in one.places(0.0)])
    needed = chosen.iterations * (count * _EACH + peaks * 20) + count * chosen.steps * _SMALL
    needed = -(-needed // 2**20)
    MEMORY.demand(
        needed, f"the trace of {count:,} robots and {chosen.iterations:,} iterations", instead="take fewer"
    )
    places = _starts(starts, grid, count, chosen, int(seed))
    most = chosen.iterations
    if budget is not None and budget.expansions is not None:
        most = min(most, budget.expansions)
    run = _Run(grid, found, chosen, places, int(seed))
    status = run.until(most, budget, progress)
    trace = run.trace(status, _notes(found, grid, chosen, count))
    judged = loading.wall()
    referee.demand(referee.check_swarm(trace))
    ended, loaded = loading.wall(), loading.seconds() - loaded
    timing = {
        "simulate_s": judged - began - run.judging, "referee_s": run.judging + ended - judged,
        "total_s": ended - began + loaded, "loading_s": loaded,
    }  # fmt: skip
    return replace(trace, timing=timing)


class _Run:
    """A simulation and what it has come to."""

    def __init__(
        self, grid: Grid, sources: tuple[AnySource, ...], settings: SwarmSettings, places: Floats, seed: int
    ) -> None:
        self._grid, self._sources, self._settings, self._seed = grid, sources, settings, seed
        self._swarm = RobotSwarm(grid, sources, settings, places, seed)
        self._motion = SwarmMotion(grid, settings)
        self._xy = [self._swarm.xy]
        self._luciferin, self._ranges = [self._swarm.luciferin.copy()], [self._swarm.ranges.copy()]
        self._done: list[tuple[Any, ...]] = []
        self._encounters = (0, 0)
        self.judging = 0.0

    def until(self, most: int, budget: Budget | None, progress: Callable[[int, int], None] | None) -> Status:
        """Go on for so many iterations; how it ended."""
        seconds, stop = (None, None) if budget is None else (budget.seconds, budget.stop)
        with cancellation.watching(seconds, stop) as own:
            try:
                while len(self._done) < most:
                    checkpoint()
                    self._advance()
                    if progress is not None:
                        progress(len(self._done), most)
            except Cancelled:
                if own is None or (own.outer is not None and own.outer.is_over):
                    raise
                return Status.CANCELLED if own.was_cancelled else Status.LIMIT
        if most < self._settings.iterations:
            return Status.LIMIT
        return Status.FOUND

    def _advance(self) -> None:
        before = self._xy[-1]
        made: Iteration = self._swarm.advance()
        began = loading.wall()
        cells = np.stack((made.path_x, made.path_y), axis=-1) / self._grid.resolution - 0.5
        path = np.concatenate((before[np.newaxis], self._grid.to_metres(cells)))
        referee.demand(self._motion.see(path))
        self.judging += loading.wall() - began
        # After the call that may be cut short: what is noted belongs together.
        whole = (one.astype(np.int32) for one in (made.leaders, made.neighbours, made.groups))
        self._done.append((made.readings, *whole))
        self._xy.append(path[-1])
        self._luciferin.append(self._swarm.luciferin.copy())
        self._ranges.append(self._swarm.ranges.copy())
        self._encounters = (self._swarm.encounters, self._swarm.wall_encounters)

    def trace(self, status: Status, notes: tuple[str, ...]) -> SwarmTrace:
        """What was done so far."""
        count, n = len(self._done), len(self._xy[0])
        readings, leaders, neighbours, groups = (
            np.array([row[k] for row in self._done]).reshape(count, n) for k in range(4)
        )
        period, xy = self._settings.period, np.array(self._xy)
        source_xy = np.array(
            [[p for one in self._sources for p in one.places(t * period)] for t in range(count + 1)]
        )
        held = count_held(xy, source_xy, self._settings)
        if status is Status.FOUND and (held[-1] < self._settings.capture_robots).any():
            status = Status.ITERATION_LIMIT
        return SwarmTrace(
            status, self._grid, self._sources, self._settings, self._seed, xy, source_xy, readings, np.array(self._luciferin),
            np.array(self._ranges), leaders, neighbours, groups, held, *self._encounters,
            notes=notes,
        )  # fmt: skip


def count_held(xy: Floats, source_xy: Floats, settings: SwarmSettings) -> np.ndarray[Any, np.dtype[np.int32]]:
    """Robots within the capture radius of each peak, each counted at its nearest; int32 (T + 1, k)."""
    radius = settings.capture_radius
    assert radius is not None
    held = np.zeros(source_xy.shape[:2], dtype=np.int32)
    for t, (robots, peaks) in enumerate(zip(xy, source_xy, strict=True)):
        gap = robots[:, np.newaxis, :] - peaks[np.newaxis, :, :]
        square = (gap * gap).sum(axis=2)
        nearest = square.argmin(axis=1)
        near = square.min(axis=1) < radius * radius
        held[t] = np.bincount(index_array(nearest[near]), minlength=len(peaks))
    return held


def load_sources(path: str | os.PathLike[str]) -> tuple[AnySource, ...]:
    """The sources of a YAML or JSON file; see :func:`lampyris.io.source_files.read_sources`.

    Parameters
    ----------
    path : the file; JSON if its name ends in ``.json``, YAML otherwise.

    Raises
    ------
    FileError, LimitError : see there.

    Examples
    --------
    >>> import lampyris
    >>> from pathlib import Path
    >>> _ = Path("sources.yaml").write_text("sources: [{kind: inverse-square, at: [3.0, 4.0]}]")
    >>> lampyris.load_sources("sources.yaml")[0].at
    (3.0, 4.0)
    """
    return read_sources(file_name("path", path))


def drawn_sources(
    grid: Grid, source_count: int = 3, *, seed: int = 0, radius: float | None = None
) -> tuple[InverseSquare, ...]:
    """Sources of equal strength at random free cells, a quarter of the map's shorter side apart where that is possible.

    Parameters
    ----------
    grid : the map.
    source_count : how many, 1 to 1000.
    seed : of the draws.
    radius : of the robots that should reach them; None: a quarter of a cell.

    Raises
    ------
    SettingError : ``SOURCES``: more than there are cells that a robot can reach; ``SEED``; ``ROBOTS``: no robot of this
        radius fits on the map.

    Examples
    --------
    >>> import lampyris
    >>> sources = lampyris.drawn_sources(lampyris.load_grid("env-1"), 2, seed=3)
    >>> len(sources), sources[0].strength
    (2, 1.0)
    """
    of_kind("grid", grid, Grid)
    if not is_whole(source_count, 1, MAX_SOURCES):
        raise SettingError.of(
            "SOURCES", "source_count", shown(source_count), allowed=f"a whole number, 1 to {MAX_SOURCES:,}"
        )
    if not is_whole(seed, 0, MAX_SEED):
        raise SettingError.of("SEED", "seed", shown(seed), allowed=SEED_RANGE)
    size = SwarmSettings(radius=radius).on(grid).radius
    assert size is not None
    cells = open_cells(grid, size)
    if source_count > len(cells):
        raise SettingError.of(
            "SOURCES", "source_count", f"{source_count:,}", allowed=f"at most {len(cells):,}, one a cell that robots reach",
            todo="fewer sources or a larger map",
        )  # fmt: skip
    rng = np.random.Generator(np.random.PCG64(np.random.SeedSequence(int(seed), spawn_key=(4,))))
    order = cells[rng.permutation(len(cells))]
    apart = min(grid.width, grid.height) / 4.0
    chosen, least = [order[0]], np.full(len(order), np.inf)
    while len(chosen) < source_count:
        gap = order - chosen[-1]
        least = np.minimum(least, (gap * gap).sum(axis=1))
        far = np.flatnonzero(least >= apart * apart)
        chosen.append(order[int(far[0]) if len(far) else int(least.argmax())])
    core = min(grid.width, grid.height) * grid.resolution / 10.0
    return tuple(
        InverseSquare(tuple(place), core=core) for place in grid.to_metres(np.array(chosen)).tolist()
    )


def _settings(given: Any, more: Mapping[str, Any]) -> SwarmSettings:
    if isinstance(given, SwarmSettings):
        given = {f.name: getattr(given, f.name) for f in fields(given)}
    of_kind("swarm_settings", given, Mapping, none=True)
    for name in sorted(more.keys() & (given or {}).keys()):
        raise UsageError("SETTING_CLASH", f"{name} is set twice", where=name, allowed="once")
    return SwarmSettings.of({**(given or {}), **more})


def _robots(robots: Any, starts: Any) -> int:
    if starts is not None:
        array = numbers(starts, (None, 2))
        if array is None or not 1 <= len(array) <= MAX_ROBOTS or not np.isfinite(array).all():
            allowed = f"metres x, y of 1 to {MAX_ROBOTS:,} robots"
            raise SettingError.of("STARTS", "starts", shown(starts), allowed=allowed)
        if robots is not None and robots != len(array):
            raise SettingError.of(
                "ROBOTS", "robots", shown(robots), allowed=f"{len(array)}, as starts, or None"
            )
        return len(array)
    if robots is None:
        return ROBOTS
    if not is_whole(robots, 1, MAX_ROBOTS):
        raise SettingError.of(
            "ROBOTS", "robots", shown(robots), allowed=f"a whole number, 1 to {MAX_ROBOTS:,}"
        )
    return int(robots)


def _starts(starts: Any, grid: Grid, count: int, settings: SwarmSettings, seed: int) -> Floats:
    """Metres from the upper left corner, y down."""
    radius = settings.radius
    assert radius is not None
    gap = 2 * GAP * radius
    if starts is None:
        rng = np.random.Generator(np.random.PCG64(np.random.SeedSequence(seed, spawn_key=(3,))))
        return draw_starts(grid, count, radius, gap, rng)
    array = numbers(starts, (None, 2))
    assert array is not None
    places = (grid.to_points(array[:, 0], array[:, 1]) + 0.5) * grid.resolution
    for k, (x, y) in enumerate(places.tolist()):
        inside = 0.0 <= x <= grid.width * grid.resolution and 0.0 <= y <= grid.height * grid.resolution
        if not inside or touches_wall(grid, x, y, radius * (1 + GAP)):
            allowed = f"a place {radius:g} m or more from walls and the edge of the map"
            raise SettingError("STARTS", shown(array[k].tolist()), where=f"starts[{k}]", allowed=allowed)
        off = places[:k] - places[k]
        near = np.flatnonzero((off * off).sum(axis=1) < (2 * radius * (1 + GAP)) ** 2)
        if len(near):
            allowed = f"places {2 * radius:g} m apart; robot {int(near[0])} is nearer"
            raise SettingError("STARTS", shown(array[k].tolist()), where=f"starts[{k}]", allowed=allowed)
    return places


def _sources(given: Any, grid: Grid, seed: int, settings: SwarmSettings) -> tuple[AnySource, ...]:
    if isinstance(given, str):
        if given == SOURCES[0]:
            return (three_peaks(grid),)
        if given == SOURCES[1]:
            return drawn_sources(grid, seed=seed, radius=settings.radius)
        raise SettingError.of(
            "SOURCES", "sources", shown(given), allowed=", ".join(SOURCES), todo=did_you_mean(given, SOURCES)
        )
    many = (given,) if isinstance(given, AnySource) else given
    right = isinstance(many, tuple | list) and 1 <= len(many) <= MAX_SOURCES
    if not right or not all(isinstance(one, AnySource) for one in many):
        allowed = (
            f"a list of 1 to {MAX_SOURCES:,} sources (InverseSquare, Plume, ThreePeaks), {', '.join(SOURCES)}"
        )
        raise SettingError.of("SOURCES", "sources", shown(given), allowed=allowed)
    return tuple(many)


def three_peaks(grid: Grid) -> ThreePeaks:
    """The function J1 stretched over the whole map."""
    of_kind("grid", grid, Grid)
    centre = grid.to_metres(((grid.width - 1) / 2.0, (grid.height - 1) / 2.0)).tolist()
    return ThreePeaks(centre, width=grid.width * grid.resolution, height=grid.height * grid.resolution)


def _notes(
    sources: tuple[AnySource, ...], grid: Grid, settings: SwarmSettings, robots: int
) -> tuple[str, ...]:
    notes = []
    assert settings.radius is not None
    peaks = [place for one in sources for place in one.places(0.0)]
    if settings.capture_robots * len(peaks) > robots:
        notes.append(
            f"{len(peaks)} sources of capture_robots = {settings.capture_robots} robots each need "
            f"{settings.capture_robots * len(peaks):,} robots; there are {robots:,}, so that not every source can be held"
        )
    for k, (x, y) in enumerate(peaks):
        px, py = ((grid.to_points(x, y) + 0.5) * grid.resolution).tolist()
        if touches_wall(grid, px, py, settings.radius):
            notes.append(
                f"source {k} at ({x:.2f}, {y:.2f}) m is in a wall, next to one or off the map: no robot can stand on it"
            )
    return tuple(notes)

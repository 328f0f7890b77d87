"""``.dob``: tracks of moving obstacles as the SBPL planners for dynamic surroundings keep them.

The format is that of the ROS package ``sbpl_dynamic_planner`` (M. Phillips, M. Likhachev: SIPP: Safe Interval
Path Planning for Dynamic Environments, ICRA 2011), known by its reader and its generator of experiments;
there is no other description. Words and numbers between white space::

    NumberOfDynamicObstacles: 1
    DynamicObstacleID: 0
    ObstacleRadius: 0.25
    NumberOfTrajectories: 1
    TrajectoryID: 0
    TrajectoryProbability: 1.0
    NumberOfPoints: 2
    0.05 0.05 0.0 0
    0.15 0.05 0.1 0
    ObstacleExistsAfterTrajectory: 0

A point is ``x y t std_dev`` in metres and seconds; the package's descendant with adaptive dimensionality
(A. Vemula, K. Muelling, J. Oh: Path Planning in Dynamic Environments with Adaptive Dimensionality, 2016)
writes ``x y z t std_dev``. Which of the two a trajectory has is determined by counting.

A recorded obstacle of ours is in one cell at each tick, from the first tick to the last. What that cannot
say is noted, never left out in silence: several trajectories (the likeliest is taken), standard deviations,
an obstacle that comes late (it waits at its first point) or vanishes at its end (it stays).
"""

from __future__ import annotations

import math
import re
from bisect import bisect_right
from dataclasses import dataclass
from itertools import pairwise

from lampyris.errors import FileError, LimitError, SettingError, plural
from lampyris.io.tracks.csv_tracks import MAX_TICKS
from lampyris.model.grid import Grid
from lampyris.model.traffic import MAX_OBSTACLES, Recorded

FIRST_WORD = "NumberOfDynamicObstacles:"
MAX_WORDS = 10**6
"""Words and numbers of a file; a point is 4 or 5 of them."""
_NUDGE = 1e-6
"""Share of a cell: the generator puts points on the lines between cells, which decimals miss either way."""


@dataclass(frozen=True, slots=True)
class DobObstacle:
    """One obstacle of a ``.dob`` file.

    Parameters
    ----------
    radius : metres.
    points : (x, y, t) of its likeliest trajectory, metres and seconds, t never falling.
    trajectories : how many the file gives it.
    spread : whether a point has a standard deviation above 0.
    stays : whether it stays at its end.
    """

    radius: float
    points: tuple[tuple[float, float, float], ...]
    trajectories: int
    spread: bool
    stays: bool


def looks_like(data: bytes) -> bool:
    """Whether a file is of this format, rightly or wrongly written."""
    return data.removeprefix(b"\xef\xbb\xbf").lstrip()[: len(FIRST_WORD)] == FIRST_WORD.encode()


def read_dob(data: bytes, name: str) -> tuple[DobObstacle, ...]:
    """The obstacles of a ``.dob`` file.

    Raises
    ------
    FileError : DOB, with the line; OBSTACLE_TIME: times that fall, a trajectory without points.
    LimitError : LIMIT, more than 1,000,000 words.
    """
    return _Words(data, name).obstacles()


def recorded(
    obstacle: DobObstacle, number: int, grid: Grid, tick_s: float, name: str
) -> tuple[Recorded, tuple[str, ...]]:
    """An obstacle as a recorded track: its cell at each tick, and what that does not say.

    Between two points it drives in a straight line at a constant speed.

    Parameters
    ----------
    obstacle, number : which, and its number in the file, for messages.
    grid : whose map frame the metres are of.
    tick_s : seconds from one tick to the next.
    name : the file, for messages.

    Raises
    ------
    SettingError : OBSTACLE_SPEED: it drives farther than to a neighbouring cell in one tick; OBSTACLE_TIME:
        its track has more than 100,000 ticks.
    """
    times = [t for _, _, t in obstacle.points]
    ticks = max(math.ceil(times[-1] / tick_s * (1.0 - 1e-12)), 0)
    if ticks > MAX_TICKS:
        raise SettingError(
            "OBSTACLE_TIME",
            f"obstacle {number} drives for {times[-1]:g} s, {ticks:,} ticks",
            where=name,
            allowed=f"at most {MAX_TICKS:,} ticks",
            todo="give a longer tick_s",
        )
    nudge = _NUDGE * grid.resolution
    cells = []
    for k in range(ticks + 1):
        x, y = _where(obstacle.points, times, k * tick_s)
        cells.append(grid.to_cell(x + nudge, y + nudge))
    for k, (a, b) in enumerate(pairwise(cells)):
        if max(abs(a[0] - b[0]), abs(a[1] - b[1])) > 1:
            raise SettingError(
                "OBSTACLE_SPEED",
                f"obstacle {number} drives from {a} to {b} in one tick, t = {k + 1}",
                where=name,
                allowed="one cell a tick",
                todo="give a shorter tick_s",
            )
    return Recorded(tuple(cells), obstacle.radius), _notes(obstacle, number, name)


def _where(
    points: tuple[tuple[float, float, float], ...], times: list[float], t: float
) -> tuple[float, float]:
    k = bisect_right(times, t)
    if k == 0 or k == len(points):
        x, y, _ = points[0 if k == 0 else -1]
        return x, y
    (x0, y0, t0), (x1, y1, t1) = points[k - 1], points[k]
    share = (t - t0) / (t1 - t0)
    return x0 + share * (x1 - x0), y0 + share * (y1 - y0)


def _notes(obstacle: DobObstacle, number: int, name: str) -> tuple[str, ...]:
    notes = []
    if obstacle.trajectories > 1:
        notes.append(f"the likeliest of its {obstacle.trajectories} trajectories was taken")
    if obstacle.spread:
        notes.append("its standard deviations were left out")
    if obstacle.points[0][2] > 0:
        notes.append(f"it comes at {obstacle.points[0][2]:g} s; until then it waits at its first point")
    if not obstacle.stays:
        notes.append("it vanishes at its end; here it stays there")
    return tuple(f"{name}: obstacle {number}: {note}" for note in notes)


class _Words:
    """The file's words one after the other, with their lines."""

    def __init__(self, data: bytes, name: str) -> None:
        self._words: list[tuple[str, int]] = []
        self._at = 0
        self._name = name
        line = 1
        for found in re.finditer(rb"\S+|\n", data.removeprefix(b"\xef\xbb\xbf")):
            if found[0] == b"\n":
                line += 1
                continue
            if len(self._words) == MAX_WORDS:
                raise LimitError("LIMIT", "more words", where=f"{name}:{line}", allowed=f"{MAX_WORDS:,}")
            self._words.append((found[0].decode("utf-8", "replace"), line))

    def obstacles(self) -> tuple[DobObstacle, ...]:
        """All of them, and the check that nothing follows."""
        count = self._whole(FIRST_WORD, 0, MAX_OBSTACLES)
        found = []
        for k in range(count):
            self._whole("DynamicObstacleID:", k, k)
            radius = self._number("ObstacleRadius:", 0.0, 1e6)
            trajectories = [self._trajectory(j) for j in range(self._whole("NumberOfTrajectories:", 1, 1000))]
            _, points, spread, stays = max(trajectories, key=lambda t: t[0])
            found.append(DobObstacle(radius, points, len(trajectories), spread, stays))
        if self._at < len(self._words):
            raise self._error(f"{self._words[self._at][0][:40]!r} after {plural(count, 'obstacle')}")
        return tuple(found)

    def _trajectory(self, j: int) -> tuple[float, tuple[tuple[float, float, float], ...], bool, bool]:
        self._whole("TrajectoryID:", j, j)
        probability = self._number("TrajectoryProbability:", 0.0, 1.0)
        count = self._whole("NumberOfPoints:", 0, 10**6)
        if count == 0:
            raise self._error("a trajectory without points", "OBSTACLE_TIME", "at least one point")
        end = self._at
        while end < len(self._words) and not self._words[end][0].endswith(":"):
            end += 1
        size, left = divmod(end - self._at, count)
        if left or size not in (4, 5):
            what = f"{end - self._at} numbers for {plural(count, 'point')}"
            raise self._error(what, allowed="x y t std_dev, or x y z t std_dev, for each")
        points: list[tuple[float, float, float]] = []
        spread = False
        for _ in range(count):
            x, y, *_, t, deviation = (self._next_number(-1e9, 1e9) for _ in range(size))
            if t < 0 or (points and t < points[-1][2]):
                self._at -= 1
                raise self._error(f"t = {t:g} s", "OBSTACLE_TIME", "times from 0 on that never fall")
            points.append((x, y, t))
            spread = spread or deviation > 0
        stays = self._whole("ObstacleExistsAfterTrajectory:", 0, 1)
        return probability, tuple(points), spread, bool(stays)

    def _word(self, expected: str) -> None:
        found = self._words[self._at][0] if self._at < len(self._words) else None
        if found != expected:
            what = "the file ends" if found is None else f"{found[:40]!r}"
            raise self._error(what, allowed=f"{expected} comes here")
        self._at += 1

    def _whole(self, word: str, least: int, most: int) -> int:
        value = self._number(word, least, most)
        if value != int(value):
            self._at -= 1
            raise self._error(f"{word} {value:g}", allowed="a whole number")
        return int(value)

    def _number(self, word: str, least: float, most: float) -> float:
        self._word(word)
        return self._next_number(least, most)

    def _next_number(self, least: float, most: float) -> float:
        text = self._words[self._at][0] if self._at < len(self._words) else ""
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not least <= value <= most:
            what = f"{text[:40]!r}" if text else "the file ends"
            allowed = f"{least:g}" if least == most else f"{least:g} to {most:g}"
            raise self._error(what, allowed=f"a number, {allowed}")
        self._at += 1
        return value

    def _error(self, what: str, code: str = "DOB", allowed: str = "") -> FileError:
        line = self._words[min(self._at, len(self._words) - 1)][1] if self._words else 1
        return FileError(code, what, where=f"{self._name}:{line}", allowed=allowed)

"""Change: the one small value that flows back, from what was sensed to what was planned."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from lampyris._core.noun import Noun
from lampyris._core.scalars import is_whole
from lampyris.errors import SettingError, shown
from lampyris.model.path import Pose
from lampyris.typing import Cell


@dataclass(frozen=True, slots=True, repr=False)
class ObstacleTrack(Noun):
    """A moving obstacle with all that is known of where it was and will be.

    Parameters
    ----------
    obstacle : its number; the same obstacle keeps it.
    track : its cells at the ticks ``since``, ``since + 1``, ...; at least one. From tick to tick it stays or goes to one of
        the eight neighbours; planners that see traffic refuse a track that jumps (``OBSTACLE_SPEED``).
    since : the tick of the first.
    period : what comes after the track's end: None, nothing is known; n, its last n cells again and again (1:
        it stays forever).
    footprint : offsets (dx, dy) of the cells it covers around its own.

    Raises
    ------
    SettingError : ``OBSTACLE_TIME``, no cell, or a period that is not 1 to the number of cells.

    Examples
    --------
    >>> from lampyris.model.change import ObstacleTrack
    >>> patrol = ObstacleTrack(0, ((3, 1), (3, 2), (3, 3), (3, 2)), period=4)
    >>> patrol.track[-1], patrol.period
    ((3, 2), 4)
    """

    obstacle: int
    track: tuple[Cell, ...]
    since: int = 0
    period: int | None = None
    footprint: tuple[Cell, ...] = ((0, 0),)

    def __post_init__(self) -> None:
        track: Any = self.track
        known = len(track) if isinstance(track, (tuple, list)) or getattr(track, "ndim", 0) == 2 else 0
        if not known:
            raise SettingError(
                "OBSTACLE_TIME",
                f"track {shown(track)}",
                where=f"obstacle {shown(self.obstacle)}",
                allowed="at least one cell (x, y)",
            )
        period: Any = self.period
        if period is not None and not (is_whole(period, 1) and period <= known):
            raise SettingError.of(
                "OBSTACLE_TIME", "period", shown(period), where=f"obstacle {shown(self.obstacle)}",
                allowed=f"None, or 1 to {known}, the cells of its track",
            )  # fmt: skip


@dataclass(frozen=True, slots=True, repr=False)
class Change(Noun):
    """What has changed since the last call of the planner.

    Parameters
    ----------
    robot : the cell the robot stands on now; None: where it was.
    obstacles : every cell that a moving obstacle covers now (all of them, not a difference).
    blocked, freed : cells of the map that became blocked or free permanently (a wall was found, a gate proved
        too narrow). A cell that a Change blocked and another frees has its terrain again.
    terrain : cells whose terrain value changed, with the new value, 0 to 252
        (:attr:`lampyris.model.grid.Grid.terrain`). Those that are blocked are passed over.
    tick : when the robot stands there: its next step ends at ``tick + 1``.
    obstacle_tracks : the moving obstacles, for planners that see traffic; None: unknown, then ``obstacles`` is all
        that is known. The two say the same of ``tick``, or of ``tick + 1`` where the obstacles have made
        their step and the robot has not.
    pose : the pose of a robot with a heading, (x, y, yaw): metres of the map frame, radians. Planners of poses begin at
        the pose of theirs that is nearest to it, and take its cell for ``robot``; planners on cells do not look at it.
    time_s : when the robot stands there, seconds since the recorded obstacles began to move: for planners of poses with
        times, whose times then count from there.
    goal_track : the goal's cells at the ticks ``tick``, ``tick + 1``, ..., at the last of which it stays: for planners that
        see traffic, which then plan to meet it; None: the goal stands still.

    Examples
    --------
    >>> import lampyris
    >>> change = lampyris.Change(robot=(3, 4), blocked=((5, 5),), tick=7)
    >>> change.robot, change.blocked, change.tick
    ((3, 4), ((5, 5),), 7)
    """

    robot: Cell | None = None
    obstacles: frozenset[Cell] = frozenset()
    blocked: tuple[Cell, ...] = ()
    freed: tuple[Cell, ...] = ()
    terrain: tuple[tuple[Cell, int], ...] = ()
    tick: int = 0
    obstacle_tracks: tuple[ObstacleTrack, ...] | None = None
    pose: Pose | None = None
    time_s: float = 0.0
    goal_track: tuple[Cell, ...] | None = None

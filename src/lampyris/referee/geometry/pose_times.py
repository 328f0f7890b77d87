"""Judgement of the times of a path of poses: no faster than the robot drives, and no contact with a recorded obstacle."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from lampyris.model.path import PosePath
from lampyris.model.plan import Plan
from lampyris.model.scene import Scene
from lampyris.model.traffic import Recorded
from lampyris.referee.geometry.footprint import along_arc
from lampyris.referee.geometry.moving_footprint import signed_distance
from lampyris.referee.verdict import Violation
from lampyris.typing import Floats, Points

SLACK = 1e-6
"""Share of a time, and seconds, by which rounding may miss a rule."""
TOUCH = 1e-4
"""Cells: nearer than that and not overlapping is no contact."""


def check_pose_times(path: PosePath, step_costs: Floats, plan: Plan, scene: Scene) -> Violation | None:
    """Judge ``path.times``.

    Each step takes no less than its cost (metres) at ``attributes["speed_fraction"]`` (at most 1) of the robot's top
    speed, and the path costs as many metres as are driven at that speed until it ends. Recorded obstacles are discs of at
    least half a cell that move straight from cell to cell, one in the time of a cell at the robot's top speed, and stay
    at the last.

    Parameters
    ----------
    step_costs : float64 (n - 1,), metres.
    """
    times = path.times
    assert times is not None
    share = plan.attributes.get("speed_fraction", 1.0)
    if not 0.0 < share <= 1.0:
        return Violation("speed", "pose_path.times", f"{share:.6g} of the top speed")
    speed = share * scene.robot.v_max
    if times[0, 0] != 0.0:
        return Violation("times", "pose 0", f"it begins at {times[0, 0]:.6g} s")
    lasts = times[1:, 0] - times[:-1, 1]
    quick = lasts * speed < step_costs * (1 - SLACK) - SLACK * scene.grid.resolution
    if quick.any():
        k = int(quick.argmax())
        return Violation(
            "times", f"step {k}", f"{lasts[k]:.6g} s for what takes {step_costs[k] / speed:.6g} s"
        )
    cost = float(times[-1, 0]) * speed
    if abs(cost - path.cost_m) > 1e-4 * max(cost, scene.grid.resolution):
        return Violation("cost", "pose_path", f"it says {path.cost_m:.9g} m, its times come to {cost:.9g}")
    for number, one in enumerate(scene.traffic):
        if isinstance(one, Recorded):
            met = _Meeting(path, one, scene).first()
            if met is not None:
                return Violation("contact", f"{met:.6g} s", f"the robot overlaps recorded obstacle {number}")
    return None


class _Meeting:
    """One obstacle beside the whole path."""

    def __init__(self, path: PosePath, one: Recorded, scene: Scene) -> None:
        assert path.times is not None
        grid, self._robot = scene.grid, scene.robot
        self._cell = grid.resolution
        self._radius = max(one.radius, 0.5 * self._cell)
        self._track = np.array(one.track, dtype=np.float64)
        self._tick = self._cell / self._robot.v_max
        self._points = grid.frame.to_points(path.poses[:, 0], path.poses[:, 1])
        self._yaw = path.poses[:, 2] - grid.origin[2]
        self._turn = np.remainder(np.diff(self._yaw) + math.pi, 2 * math.pi) - math.pi
        self._moved = np.append(path.step_lengths + np.abs(self._turn) * self._robot.radius, 0.0)
        self._times = path.times
        outline = self._robot.footprint
        self._outline = None if outline is None else np.array(outline)

    def first(self) -> float | None:
        """When they overlap first; None: never."""
        times = self._times
        n = len(times)
        # Spans: standing at each pose, then driving on to the next.
        begin = np.column_stack((times[:, 0], times[:, 1])).ravel()[: 2 * n - 1]
        end = np.append(
            np.column_stack((times[:, 1], np.append(times[1:, 0], 0.0))).ravel()[: 2 * n - 2], 0.0
        )
        end[-1] = times[-1, 1]
        moved = np.column_stack((np.zeros(n), self._moved)).ravel()[: 2 * n - 1]
        pose = np.repeat(np.arange(n), 2)[: 2 * n - 1]
        drives = np.arange(2 * n - 1) % 2 == 1
        zeros = np.zeros(2 * n - 1)
        gap = self._gaps(pose, zeros, (begin + end) / 2)
        near = gap <= moved + self._reach(begin, end)
        for k in np.flatnonzero(near).tolist():
            met = self._in_span(
                int(pose[k]), bool(drives[k]), float(begin[k]), float(end[k]), float(moved[k])
            )
            if met is not None:
                return met
        return None

    def _reach(self, begin: Floats, end: Floats) -> Floats:
        """Metres that the obstacle moves at most from the middle between two times to either; 0 once its track is over."""
        last = (len(self._track) - 1) * self._tick
        moves = np.minimum(end, last) - np.minimum(begin, last)
        reach: Floats = math.sqrt(2.0) * self._cell * np.minimum(moves, (end - begin) / 2) / self._tick
        return reach

    def _in_span(self, pose: int, drives: bool, begin: float, end: float, moved: float) -> float | None:
        """When they overlap within one span: its parts between the ticks of the track that are near are searched."""
        length = end - begin
        ticks = np.arange(
            math.ceil(begin / self._tick), min(math.floor(end / self._tick) + 1, len(self._track))
        )
        cuts = np.unique(np.concatenate(([begin], np.clip(ticks * self._tick, begin, end), [end])))
        low, high = (cuts[:-1], cuts[1:]) if len(cuts) > 1 else (cuts, cuts)
        shares = ((low + high) / 2 - begin) / length if drives and length > 0.0 else np.zeros(len(low))
        gap = self._gaps(np.full(len(low), pose), shares, (low + high) / 2)
        part = (high - low) / length if length > 0.0 else np.ones(len(low))
        for k in np.flatnonzero(gap <= moved * part + self._reach(low, high)).tolist():
            ends = (
                ((float(low[k]) - begin) / length, (float(high[k]) - begin) / length)
                if length
                else (0.0, 1.0)
            )
            met = self._search(pose, drives, begin, end, moved, ends)
            if met is not None:
                return met
        return None

    def _search(
        self, pose: int, drives: bool, begin: float, end: float, moved: float, part: tuple[float, float]
    ) -> float | None:
        """When they overlap within a part of a span, by halving it where they are near."""
        stack = [part]
        while stack:
            low, high = stack.pop()
            share = (low + high) / 2
            t = begin + share * (end - begin)
            gap = float(self._gaps(np.array([pose]), np.array([share if drives else 0.0]), np.array([t]))[0])
            if gap <= 0.0:
                return t
            first, last = (np.array(begin + one * (end - begin)) for one in (low, high))
            half = moved * (high - low) / 2 + float(self._reach(first, last))
            if gap > half or half < TOUCH * self._cell:
                continue
            stack += [(share, high), (low, share)]
        return None

    def _gaps(self, pose: NDArray[np.int64], share: Floats, t: Floats) -> Floats:
        """Metres between robot and obstacle: the robot a share of the way from a pose to the next, at times."""
        place: Points = self._points[pose].copy()
        yaw = self._yaw[pose].copy()
        for k in np.flatnonzero(share > 0).tolist():
            i = int(pose[k])
            place[k] = along_arc(self._points[i], self._points[i + 1], float(self._turn[i]), float(share[k]))
            yaw[k] += share[k] * self._turn[i]
        ticks = np.minimum(t / self._tick, len(self._track) - 1.0)
        low = np.minimum(ticks.astype(np.int64), max(len(self._track) - 2, 0))
        high = np.minimum(low + 1, len(self._track) - 1)
        centre = self._track[low] + (ticks - low)[:, None] * (self._track[high] - self._track[low])
        if self._outline is None:
            away = (centre - place) * self._cell
            gaps: Floats = np.hypot(away[:, 0], away[:, 1]) - self._robot.radius - self._radius
            return gaps
        return signed_distance(self._outline, place * self._cell, yaw, centre * self._cell) - self._radius

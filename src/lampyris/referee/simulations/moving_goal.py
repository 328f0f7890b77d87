"""A goal that moves: its track, and that the run ends when the robot has caught it."""

from __future__ import annotations

import numpy as np

from lampyris.model.trace import Trace
from lampyris.referee.verdict import Violation


def goal_violation(trace: Trace) -> Violation | None:
    """Whether the goal jumps, leaves the map or stands in a wall, or the robot went on after it had caught the goal."""
    track, scene = trace.goal_track, trace.scene
    if track is None:
        return None
    first = trace.goal_at(0)
    if len(track) == 0 or first != scene.goal:
        return Violation("goal", "tick 0", f"the goal is at {first}; by the scene at {scene.goal}")
    x, y = track.astype(np.int64).T
    outside = (x < 0) | (x >= scene.grid.width) | (y < 0) | (y >= scene.grid.height)
    if outside.any() or scene.grid.blocked[y, x].any():
        k = int((outside if outside.any() else scene.grid.blocked[y, x]).argmax())
        return Violation("goal", f"tick {k}", f"({x[k]}, {y[k]}) is no free cell of the map")
    far = np.abs(np.diff(track.astype(np.int64), axis=0)).max(axis=1, initial=0) > 1
    if far.any():
        return Violation("goal", f"tick {int(far.argmax()) + 1}", "more than one cell from where it was")
    goals = track[np.minimum(np.arange(trace.ticks), len(track) - 1)]
    caught = (trace.robot[:-1] == goals).all(axis=1)
    if caught.any():
        return Violation("goal", f"tick {int(caught.argmax())}", "the goal was caught, and the run went on")
    return None

"""Frames: from a frame to another one at a time, by ``/tf`` and ``/tf_static``, in the plane."""

from __future__ import annotations

import math
from bisect import bisect_right, insort
from typing import TypeAlias

from lampyris.ros.messages import Fields, pose_of, seconds

PlanePose: TypeAlias = tuple[float, float, float]
_CIRCLE = 100
"""Frames between two; more is a circle."""
KEPT = 10.0
"""Seconds of transforms that a running node keeps, as tf2 does."""


def compose(a: PlanePose, b: PlanePose) -> PlanePose:
    """The pose b, given in the frame that a is the pose of."""
    c, s = math.cos(a[2]), math.sin(a[2])
    yaw = math.remainder(a[2] + b[2], 2.0 * math.pi)
    return a[0] + c * b[0] - s * b[1], a[1] + s * b[0] + c * b[1], yaw


def inverse(a: PlanePose) -> PlanePose:
    """The pose of the parent in the frame of ``a``."""
    c, s = math.cos(a[2]), math.sin(a[2])
    return -c * a[0] - s * a[1], s * a[0] - c * a[1], -a[2]


class Transforms:
    """What ``/tf`` and ``/tf_static`` said.

    Parameters
    ----------
    keep : seconds of the past that are kept; infinity: all.
    """

    def __init__(self, keep: float = math.inf) -> None:
        self._keep = keep
        self._parent: dict[str, str] = {}
        self._fixed: dict[str, PlanePose] = {}
        self._rows: dict[str, list[tuple[float, PlanePose]]] = {}

    def add(self, message: Fields, *, static: bool = False) -> None:
        """Take in a tf2_msgs/TFMessage."""
        for one in message["transforms"]:
            child, held = str(one["child_frame_id"]).lstrip("/"), one["transform"]
            self._parent[child] = str(one["header"]["frame_id"]).lstrip("/")
            at = pose_of({"position": held["translation"], "orientation": held["rotation"]})
            if static:
                self._fixed[child] = at
                continue
            rows = self._rows.setdefault(child, [])
            insort(rows, (seconds(one["header"]["stamp"]), at), key=lambda row: row[0])
            while rows[-1][0] - rows[0][0] > self._keep:
                rows.pop(0)

    def between(self, frame: str, target: str, t: float | None = None) -> PlanePose | None:
        """The pose of ``frame`` in ``target`` at a time (None: the latest); None if nothing connects them.

        Between two times it is interpolated; before the first and after the last it is that one.
        """
        up, over = self._chain(frame.lstrip("/")), self._chain(target.lstrip("/"))
        shared = next((one for one in up if one in over), None)
        if shared is None:
            return None
        a, b = self._to(up[: up.index(shared)], t), self._to(over[: over.index(shared)], t)
        return compose(inverse(b), a)

    def latest(self, child: str) -> float | None:
        """The time of the latest transform of a frame to its parent; None: there is none, or it is fixed."""
        rows = self._rows.get(child)
        return rows[-1][0] if rows else None

    def _chain(self, frame: str) -> list[str]:
        chain = [frame]
        while chain[-1] in self._parent and len(chain) < _CIRCLE:
            chain.append(self._parent[chain[-1]])
        return chain

    def _to(self, frames: list[str], t: float | None) -> PlanePose:
        made: PlanePose = (0.0, 0.0, 0.0)
        for child in frames:
            made = compose(self._at(child, t), made)
        return made

    def _at(self, child: str, t: float | None) -> PlanePose:
        if child in self._fixed:
            return self._fixed[child]
        rows = self._rows[child]
        if t is None:
            return rows[-1][1]
        k = bisect_right(rows, t, key=lambda row: row[0])
        if k in (0, len(rows)):
            return rows[min(k, len(rows) - 1)][1]
        (t0, a), (t1, b) = rows[k - 1], rows[k]
        share = (t - t0) / (t1 - t0)
        turn = math.remainder(b[2] - a[2], 2.0 * math.pi)
        return a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1]), a[2] + share * turn

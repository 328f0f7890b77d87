"""Evidence of paths of poses, and of curves of poses; see :mod:`lampyris.study.execution.evidence`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lampyris.model.curve import Curve, PoseCurve
from lampyris.model.grid import Grid
from lampyris.model.moves import MOVES
from lampyris.model.path import Path, PosePath, path_of
from lampyris.model.plan import Plan, Status
from lampyris.model.profile import Profile
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.motion.geometry.pose_curve import outline_of
from lampyris.study.execution import evidence as e

_POSES = {"poses": ("<f8", 2), "gears": ("|i1", 1), "prices": ("<f8", 1), "times": ("<f8", 2)}
_CURVES = {
    "pieces": ("<f8", 2), "piece_counts": ("<i4", 1), "ends": ("<f8", 2), "stops": ("<i4", 1),
    "stop_counts": ("<i4", 1),
}  # fmt: skip
"""Of a piece: x, y, heading (two numbers), length, curvature, yaw, turn; of an end: x, y, yaw."""


def pose_plan_evidence(plan: Plan, profile: Profile | None) -> dict[str, Any]:
    """A plan of a planner of poses, and the speeds on it."""
    return {
        "kind": "pose-plan",
        "status": plan.status.value,
        "iterations": int(plan.iterations),
        "expansions": int(plan.expansions),
        "path": None if plan.pose_path is None else _path_evidence(plan.pose_path),
        "profile": None if profile is None else e.profile_evidence(profile),
        "notes": list(plan.notes),
    }


def pose_plan_of(
    plain: Any, scene: Scene, planner: str, attributes: Mapping[str, float]
) -> tuple[Plan, Profile | None]:
    """The plan and the speeds that are claimed.

    Parameters
    ----------
    scene, planner : of the job.
    attributes : by which its poses are judged, from the planner's settings and not from the worker.

    Raises
    ------
    FileError : ``EVIDENCE``. LimitError : ``EVIDENCE_SIZE``.
    """

    def read(plain: Mapping[str, Any]) -> tuple[Plan, Profile | None]:
        path = None if plain["path"] is None else _path_of(plain["path"])
        profile = plain["profile"]
        plan = Plan(
            Status(plain["status"]),
            planner,
            None if path is None else cells_under(path, scene.grid),
            iterations=e.whole(plain["iterations"], "iterations"),
            expansions=e.whole(plain["expansions"], "expansions"),
            notes=e.notes_of(plain),
            pose_path=path,
            attributes=attributes,
        )
        return plan, None if profile is None else e.profile_of(profile)

    return e.reading("pose-plan", plain, read)


def _path_evidence(path: PosePath) -> dict[str, Any]:
    arrays: dict[str, NDArray[Any]] = {"poses": path.poses, "gears": path.gears}
    if path.prices is not None:
        arrays["prices"] = path.prices
    if path.times is not None:
        arrays["times"] = path.times
    return {
        "cost_m": float(path.cost_m),
        "lower_bound_m": float(path.lower_bound_m),
        "arrays": e.pack_arrays(arrays, _POSES),
    }


def _path_of(plain: Mapping[str, Any]) -> PosePath:
    got = e.unpack_arrays(plain["arrays"], _POSES)
    if not all(np.isfinite(array).all() for array in got.values()):
        raise e.wrong("a pose, a price or a time that is not finite", "finite numbers")
    cost, least = e.number(plain["cost_m"], "cost_m"), e.number(plain["lower_bound_m"], "lower_bound_m")
    return PosePath(got["poses"], got["gears"], cost, least, got.get("prices"), got.get("times"))


def cells_under(path: PosePath, grid: Grid) -> Path:
    """The cells that the base passes through: those that hold its poses."""
    points = np.floor(grid.frame.to_points(path.poses[:, 0], path.poses[:, 1]) + 0.5).astype(np.int32)
    fresh = np.append(True, (points[1:] != points[:-1]).any(axis=1))
    return path_of(points[fresh], MOVES["octile"], None)


def curves_evidence(curves: Sequence[Curve]) -> dict[str, Any]:
    """Curves of poses as plain data: not the outline, which is the robot's."""
    posed = [curve for curve in curves if isinstance(curve, PoseCurve)]
    pieces = [np.column_stack((c.xy, c.heading, c.lengths, c.curvature, c.yaw, c.turn)) for c in posed]
    arrays: dict[str, NDArray[Any]] = {
        "pieces": e.rows(pieces, 8),
        "piece_counts": e.counts(pieces),
        "ends": e.rows([np.array([[*c.end, c.end_yaw]]) for c in posed], 3),
        "stops": np.concatenate([np.zeros(0, dtype=np.int64), *(c.stops for c in posed)]),
        "stop_counts": e.counts([c.stops for c in posed]),
    }
    return e.pack_arrays(arrays, _CURVES)


def curves_of(plain: Mapping[str, Any], grid: Grid, robot: Robot) -> tuple[PoseCurve, ...]:
    """The curves that are claimed, with the outline of this robot."""
    got = e.unpack_arrays(plain, _CURVES)
    outline, margin = outline_of(robot)
    parts = zip(
        e.split(got["pieces"], got["piece_counts"]),
        got["ends"].tolist(),
        e.split(got["stops"], got["stop_counts"]),
        strict=True,
    )
    return tuple(
        PoseCurve(
            p[:, 0:2], p[:, 2:4], p[:, 4], p[:, 5], (end[0], end[1]), grid.resolution, stops,
            yaw=p[:, 6], turn=p[:, 7], end_yaw=end[2], outline=outline, margin=margin,
        )
        for p, end, stops in parts
    )  # fmt: skip

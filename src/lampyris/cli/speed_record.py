"""``lampyris speed`` as plain data."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from lampyris.motion.laws.compare import LawResult
from lampyris.report.data.metrics import cause_shares
from lampyris.report.data.serialize import grid_record, profile_record, robot_record, shares_record

if TYPE_CHECKING:
    from lampyris.cli.speed_work import Answer


def record_of(answer: Answer, timing: bool) -> dict[str, Any]:
    """What ``--json`` prints; all of it but ``timing`` is decided by the files and the options."""
    scene, course, profile = answer.scene, answer.course, answer.entry.profile
    assert profile.xy is not None
    metres = scene.grid.to_metres(profile.xy)
    return {
        "map": grid_record(scene.grid),
        "robot": robot_record(scene),
        "way": {
            "from": answer.source,
            "points": len(answer.given),
            "nodes": len(course),
            "smooth": answer.smooth,
            "given_m": answer.given_m,
            "length_m": float(course.s[-1]),
            "deviation_m": answer.deviation_m,
            "arcs": answer.arcs,
            "stops": int(np.count_nonzero(course.stop)),
            "notes": list(answer.notes),
        },
        "law": answer.entry.law,
        "laws": [entry_record(e) for e in answer.entries],
        "refused": [{"law": law, "sentence": why} for law, why in answer.refused.items()],
        "held": shares_record(cause_shares(profile)),
        "speed": {
            **profile_record(profile, caps=True),
            "x_m": metres[:, 0].tolist(),
            "y_m": metres[:, 1].tolist(),
        },
        "timing": answer.timing if timing else {},
    }


def entry_record(e: LawResult) -> dict[str, Any]:
    """One law of a comparison."""
    return {
        "law": e.law,
        "duration_s": e.duration_s,
        "mean": e.mean,
        "ratio_to_optimum": e.ratio,
        "peak_acceleration": e.peak_accel,
        "peak_braking": e.peak_braking,
        "peak_lateral": e.peak_lateral,
        "broken": list(e.broken),
    }

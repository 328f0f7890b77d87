"""Evidence of plans of fleets; see :mod:`lampyris.study.execution.evidence`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from lampyris.model.fleet.fleet_plan import FleetPlan
from lampyris.model.plan import Status
from lampyris.study.execution import evidence as e

_ARRAYS = {
    "steps": ("|i1", 2),
    "starts": ("<i4", 2),
    "lengths": ("<i4", 1),
    "shortest": ("<i4", 1),
    "improved": ("<i8", 2),
}


def fleet_evidence(plan: FleetPlan) -> dict[str, Any]:
    """A plan of a fleet as plain data: starts, and the step of every robot at every tick."""
    arrays = {
        "starts": e.rows([path[:1] for path in plan.paths], 2),
        "lengths": np.array([len(path) for path in plan.paths], dtype=np.int32),
        "steps": e.rows([np.diff(path, axis=0) for path in plan.paths], 2),
        "improved": np.array(plan.improvements, dtype=np.int64).reshape(-1, 2),
    }
    if plan.shortest is not None:
        arrays["shortest"] = plan.shortest
    return {
        "kind": "fleet-plan",
        "status": plan.status.value,
        "iterations": int(plan.iterations),
        "expansions": int(plan.expansions),
        "bound": None if plan.bound is None else int(plan.bound),
        "arrays": e.pack_arrays(arrays, _ARRAYS),
        "notes": list(plan.notes),
    }


def fleet_plan_of(plain: Any, planner: str, seed: int, moves: str) -> FleetPlan:
    """The plan that is claimed.

    Parameters
    ----------
    planner, seed, moves : of the job.

    Raises
    ------
    FileError : ``EVIDENCE``. LimitError : ``EVIDENCE_SIZE``.
    """

    def read(plain: Mapping[str, Any]) -> FleetPlan:
        got = e.unpack_arrays(plain["arrays"], _ARRAYS)
        starts, lengths = got["starts"], got["lengths"]
        if len(starts) != len(lengths) or starts.shape[1:] != (2,) or (lengths < 1).any():
            raise e.wrong(f"{len(starts)} starts and {len(lengths)} lengths", "a path for each robot")
        steps = e.split(got["steps"].astype(np.int32), lengths - 1)
        paths = tuple(
            np.concatenate((start[None], start + np.cumsum(some, axis=0, dtype=np.int32)))
            for start, some in zip(starts, steps, strict=True)
        )
        improved = got["improved"].reshape(-1, 2).tolist()
        return FleetPlan(
            Status(plain["status"]),
            planner,
            paths,
            got.get("shortest"),
            e.whole(plain["iterations"], "iterations"),
            e.whole(plain["expansions"], "expansions"),
            tuple((iteration, cost) for iteration, cost in improved),
            seed,
            notes=e.notes_of(plain),
            bound=None if plain["bound"] is None else e.whole(plain["bound"], "bound"),
            moves=moves,
        )

    return e.reading("fleet-plan", plain, read)

"""How to lie to a judge: evidence with something changed, and what must come of it."""

from __future__ import annotations

import copy
from collections.abc import Callable
from typing import Any

import numpy as np
from one_samples import (
    ground_of,
    results_of,
)  # fmt: skip

from lampyris.study.design.row import Row
from lampyris.study.design.study import Study, StudyTraffic
from lampyris.study.execution import drive_evidence, evidence
from lampyris.study.execution.verify import ResultVerifier

FORMS = {
    "plan": evidence._PLAN, "profile": evidence._PROFILE, "simulate": evidence._TRACE,
    "drive": drive_evidence._FORM,
}  # fmt: skip
LIVE = StudyTraffic("random-walk", 6, tracks="live")
REPLAYED = StudyTraffic("random-walk", 6)


def judged(study: Study, result: Any) -> Row:
    (job,) = study.jobs()
    return ResultVerifier().row(job, result, ground_of(study))


def honest(study: Study) -> dict[str, Any]:
    (result,) = results_of(study)
    assert judged(study, copy.deepcopy(result)).ending == "done"
    return result


def refused(study: Study, result: Any, word: str = "") -> str:
    row = judged(study, result)
    assert row.ending == "failed", (row.ending, row.metrics)
    assert row.error.startswith("REFEREE: ")
    assert row.error.isprintable()
    assert (row.metrics, row.timing) == ({}, {})
    assert word in row.error, row.error
    return row.error


def altered(result: Any, kind: str, change: Callable[[dict[str, Any]], None], *path: str) -> Any:
    """The result with arrays of its evidence changed."""
    made = copy.deepcopy(result)
    told = made["evidence"]
    for name in path:
        told = told[name]
    form = FORMS["profile" if "profile" in path else kind]
    arrays = {k: np.array(v) for k, v in evidence.unpack_arrays(told["arrays"], form).items()}
    change(arrays)
    told["arrays"] = evidence.pack_arrays(arrays, form)
    return made

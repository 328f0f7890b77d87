"""What is made better: a metric of runs, averaged over queries, those that fail counted, too."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from lampyris.errors import UsageError, did_you_mean
from lampyris.planning import registry
from lampyris.study.analysis.measures import ALL, AT_GOAL, SHARES, TIMING, Measure
from lampyris.study.design.row import Row
from lampyris.study.design.study import Study
from lampyris.tuning.subject import Subject
from lampyris.typing import Floats

PENALTY = 10.0
"""What a query counts that the defaults solve and a trial does not, in values of the defaults there: PAR10 of algorithm
configuration (Hutter, Hoos, Leyton-Brown, Stuetzle 2009)."""
_TIMING = frozenset(one.name for one in TIMING)


_SPEEDS = ("time_s", "speed_mean", "speed_least")
"""Metrics of a plan that its speed law decides."""
USUAL = {"planner": "cost", "law": "time_s"}
"""The metric if none is named."""


def measure_of(metric: str, study: Study, subject: Subject) -> Measure:
    """The metric that is to be made better.

    Raises
    ------
    UsageError : ``METRIC``: no such metric, one of which neither way is better, or one that depends on the machine;
        ``TUNE``: no setting of the planner or law can change it.
    """
    known = {name: one for name, one in ALL.items() if one.better and name not in _TIMING}
    if metric not in known:
        raise UsageError(
            "METRIC", repr(metric), where="metric", allowed=", ".join(known), todo=did_you_mean(metric, known)
        )
    if subject.kind == "law":
        if study.kind == "plan" and metric not in _SPEEDS:
            what = f"no speed law changes {metric} of a plan"
            raise UsageError("TUNE", what, where="metric", allowed=", ".join(_SPEEDS))
        return known[metric]
    planner = subject.config
    best = registry.planner_class(planner.name).traits.optimal if study.kind == "plan" else False
    if metric in ("cost", "gap") and (best or planner.starts_exact) and study.kind == "plan":
        why = "its plans are optimal" if best else "it starts from the exact shortest path"
        todo = "" if best else "set seeded: false for it in the study"
        raise UsageError(
            "TUNE", f"{planner.name}: {why}", where="metric", allowed="another metric", todo=todo
        )
    return known[metric]


def values_of(study: Study, rows: Mapping[str, Row], measure: Measure) -> Floats:
    """The metric of each query, averaged over its runs; float64 (queries,), NaN where a run has none.

    Runs that failed have none; shares count them as 0.
    """
    each = len(study) // len(study.worlds)
    found = np.array([_value(rows[job.key], measure.name) for job in study.jobs()])
    means: Floats = found.reshape(-1, each).mean(axis=1)
    return means


def _value(row: Row, metric: str) -> float:
    if metric in SHARES:
        return float(row.ending == "done" and bool(row.metrics.get(metric)))
    arrived = row.metrics.get("arrived") or metric not in AT_GOAL
    value = row.metrics.get(metric) if row.ending == "done" and arrived else None
    return math.nan if value is None else float(value)


def penalised(values: Floats, defaults: Floats, measure: Measure) -> Floats:
    """The same with a value for each query, so that a mean cannot gain by leaving hard queries out.

    Where less is better: ten times the value of the defaults there, or ten times their greatest where they have none;
    where more is better: 0.
    """
    known = defaults[np.isfinite(defaults)]
    greatest = float(known.max()) if len(known) else 1.0
    worst = PENALTY * np.where(np.isfinite(defaults), defaults, greatest)
    return np.where(np.isfinite(values), values, worst if measure.better == "less" else 0.0)

"""Tune: trials of a planner's settings on the queries of a study, and a report on queries that were held out."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from typing import Any

import numpy as np

from lampyris._core.scalars import MAX_SEED, SEED_RANGE, is_real, is_whole
from lampyris.errors import SettingError, UsageError, of_kind, shown
from lampyris.study.analysis.compare import Interval, difference, mean
from lampyris.study.analysis.measures import Measure
from lampyris.study.design.row import Row
from lampyris.study.design.study import Config, Study, World
from lampyris.study.execution import run as running
from lampyris.study.execution.execution import Execution
from lampyris.study.store.store import Store, open_for
from lampyris.tuning.objective import USUAL, measure_of, penalised, values_of
from lampyris.tuning.ranges import SearchRange, ranges_of
from lampyris.tuning.subject import Subject, subject_of
from lampyris.typing import Floats

MAX_TRIALS = 100_000
"""Most trials of one call."""
_PARTS = 8
"""Parts of the queries after which a trial may be pruned."""
_LEAST_QUERIES = 4
_STARTUP = 5
"""Trials before any is pruned."""


@dataclass(frozen=True, slots=True)
class Trial:
    """One trial.

    Parameters
    ----------
    number : 0: the settings of the study.
    settings : those that were varied.
    value : mean of the metric over the queries that were run; of queries without one what :func:`.objective.penalised` says.
    queries : how many were run.
    pruned : whether it was stopped before it had run all.
    """

    number: int
    settings: Mapping[str, Any]
    value: float
    queries: int
    pruned: bool


@dataclass(frozen=True, slots=True)
class Tuned:
    """What was found.

    Parameters
    ----------
    kind : ``planner`` or ``law``: which of them was tuned.
    chosen : the planner or law with the settings of the best trial, complete.
    planner : of a law that was tuned: the planner whose paths were driven.
    measure : the metric.
    ranges : what was searched.
    trials : all, in order.
    best : the best of them.
    queries : how many they were tuned on.
    default, tuned, gained : on the queries that were held out: the mean with the settings of the study, with the best ones,
        and the mean difference, each with its 95 % interval.
    collisions : mean collisions of a run on those queries with the settings of the study and with the best ones; None where
        nothing drives.
    """

    kind: str
    chosen: Config
    planner: Config | None
    measure: Measure
    ranges: tuple[SearchRange, ...]
    trials: tuple[Trial, ...]
    best: Trial
    queries: int
    default: Interval
    tuned: Interval
    gained: Interval
    collisions: tuple[float, float] | None = None


def tune(
    study: Study,
    store: str | os.PathLike[str],
    *,
    trials: int = 50,
    planner: str | None = None,
    law: str | None = None,
    metric: str | None = None,
    ranges: Sequence[str] = (),
    held_out_share: float = 0.3,
    seed: int = 0,
    workers: int = 1,
    progress: Callable[[Trial, Trial], None] | None = None,
) -> Tuned:
    """Tune settings of a planner or speed law by Optuna's tree-structured Parzen estimator, pruned by the median rule.

    Every run is kept in the store, by what decides it. The trials follow from the arguments alone; so the same call, or one
    with more trials, goes through what is there without running it again.

    Parameters
    ----------
    study : a study of one robot; all its laws (of a law that is tuned: this one), traffic cases and seeds count.
    store : of the study, for that planner, or that law behind that planner, alone.
    trials : how many, the settings of the study among them.
    planner : what the study calls it; None: its only one.
    law : what the study calls the speed law that is tuned; None: the planner is.
    metric : of a run, such as ``cost`` or ``expansions``; None: ``cost`` of a planner, ``time_s`` of a law.
    ranges : see :func:`lampyris.tuning.ranges.ranges_of`.
    held_out_share : share of the queries that no trial sees.
    seed : of the draw of the held-out queries, and of the trials.
    workers : processes.
    progress : called with each trial and the best so far.

    Raises
    ------
    UsageError : ``TUNE_MISSING``: Optuna is not installed; no such planner, law or metric; a study of fleets, with a budget in
        seconds, or of fewer than 4 queries.
    LampyrisError : of the store and of the runs.
    """
    of_kind("study", study, Study)
    if not is_whole(trials) or not 1 <= trials <= MAX_TRIALS:
        allowed = f"a whole number from 1 to {MAX_TRIALS:,}"
        raise SettingError("TRIALS", shown(trials), where="trials", allowed=allowed)
    if not is_real(held_out_share) or not 0.0 < held_out_share < 1.0:
        allowed = "a share between 0 and 1"
        raise SettingError("HELD_OUT", shown(held_out_share), where="held_out_share", allowed=allowed)
    if not is_whole(seed) or not 0 <= seed <= MAX_SEED:
        raise SettingError("SEED", shown(seed), where="seed", allowed=SEED_RANGE)
    where = Execution(workers=workers)
    subject = subject_of(study, planner, law)
    config = subject.config
    if study.kind == "fleet" or study.seconds is not None:
        why = (
            "a study of fleets" if study.kind == "fleet" else "a budget in seconds, which the machine decides"
        )
        raise UsageError(
            "TUNE", why, where="study", allowed="one of plans, simulations or drives, by expansions"
        )
    if len(study.worlds) < _LEAST_QUERIES:
        what = f"{len(study.worlds)} queries"
        raise UsageError("TUNE", what, where="study", allowed=f"at least {_LEAST_QUERIES}")
    measure = measure_of(metric or USUAL[subject.kind], study, subject)
    searched = ranges_of(subject, ranges)
    if find_spec("optuna") is None:
        raise UsageError("TUNE_MISSING", "optuna is not installed", todo="pip install 'lampyris[tune]'")
    order = np.random.Generator(np.random.PCG64(seed)).permutation(len(study.worlds)).tolist()
    kept_back = min(max(round(held_out_share * len(order)), 2), len(order) - 2)
    worlds = [study.worlds[k] for k in order]
    with open_for(store, subject.study_on(study, study.worlds, config)) as kept:
        runs = _Runs(study, subject, kept, where, measure)
        made = _search(runs, worlds[kept_back:], searched, trials, seed, progress)
        best = min(made, key=lambda one: (one.pruned, one.value if measure.better == "less" else -one.value))
        chosen = subject.changed(best.settings) if best.number else config
        default = runs.values(config, worlds[:kept_back])
        after = penalised(runs.values(chosen, worlds[:kept_back]), default, measure)
        before = penalised(default, default, measure)
        touched = runs.collisions(config, worlds[:kept_back]), runs.collisions(chosen, worlds[:kept_back])
    return Tuned(
        subject.kind, chosen, subject.planner, measure, searched, tuple(made), best, len(worlds) - kept_back,
        mean(before), mean(after), difference(after, before), None if study.kind == "plan" else touched,
    )  # fmt: skip


class _Runs:
    """The runs of trials, each once."""

    def __init__(
        self, study: Study, subject: Subject, store: Store, where: Execution, measure: Measure
    ) -> None:
        self._study, self.subject, self._store, self._where = study, subject, store, where
        self.measure = measure
        self._rows = store.rows()

    def values(self, config: Config, worlds: Sequence[World]) -> Floats:
        """The metric of each query; what is not in the store is run."""
        part = self.subject.study_on(self._study, worlds, config)

        def keep(rows: Sequence[Row]) -> None:
            self._store.add(rows)
            self._rows.update((row.key, row) for row in rows)

        if any(job.key not in self._rows for job in part.jobs()):
            running.run(part, keep, done=self._rows.keys(), where=self._where)
        return values_of(part, self._rows, self.measure)

    def collisions(self, config: Config, worlds: Sequence[World]) -> float:
        """Mean collisions of the runs that ended by themselves; they have been run."""
        part = self.subject.study_on(self._study, worlds, config)
        found = [self._rows[job.key].metrics.get("collisions") for job in part.jobs()]
        known = [float(one) for one in found if one is not None]
        return sum(known) / len(known) if known else 0.0


def _search(
    runs: _Runs,
    worlds: Sequence[World],
    searched: Sequence[SearchRange],
    trials: int,
    seed: int,
    progress: Callable[[Trial, Trial], None] | None,
) -> list[Trial]:
    """All trials, the study's own settings first."""
    import optuna

    optuna.logging.set_verbosity(optuna.logging.WARNING)
    measure, config = runs.measure, runs.subject.config
    less = measure.better == "less"
    search = optuna.create_study(
        direction="minimize" if less else "maximize",
        sampler=optuna.samplers.TPESampler(seed=seed % 2**32),
        pruner=optuna.pruners.MedianPruner(n_startup_trials=_STARTUP, n_warmup_steps=1),
    )
    defaults = runs.values(config, worlds)
    parts = [part.tolist() for part in np.array_split(np.arange(len(worlds)), min(_PARTS, len(worlds)))]
    made: list[Trial] = []
    best: Trial | None = None
    for number in range(trials):
        if number == 0:
            held = {one.name: one.clipped(config.settings.get(one.name)) for one in searched}
            search.enqueue_trial({name: value for name, value in held.items() if value is not None})
        asked = search.ask()
        proposed = {one.name: one.suggest(asked) for one in searched}
        settings = {one.name: config.settings.get(one.name) for one in searched} if number == 0 else proposed
        tried = config if number == 0 else runs.subject.changed(settings)
        values, pruned = np.zeros(0), False
        for step, part in enumerate(parts):
            now = runs.values(tried, [worlds[k] for k in part])
            values = np.concatenate((values, penalised(now, defaults[part], measure)))
            asked.report(float(values.mean()), step)
            if number and len(values) < len(worlds) and asked.should_prune():
                pruned = True
                break
        trial = Trial(number, settings, float(values.mean()), len(values), pruned)
        state = optuna.trial.TrialState.PRUNED if pruned else optuna.trial.TrialState.COMPLETE
        search.tell(asked, None if pruned else trial.value, state=state)
        made.append(trial)
        better = best is None or (
            not pruned and (trial.value < best.value if less else trial.value > best.value)
        )
        best = trial if better or best is None else best
        if progress is not None:
            progress(trial, best)
    return made

"""Result table: the rows of a study side by side, in the order of its jobs, independent of the worker and the time."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from lampyris.report.data.fleets.measures import FLEET_METRICS
from lampyris.report.data.measures import METRICS
from lampyris.study.design.row import Row
from lampyris.study.design.study import SENSOR_LABELS, Config, Study, canonical

LABELS = ("map", "query", "traffic", "seed", "planner", "law", "published")
FLEET_LABELS = ("map", "query", "robots", "seed", "planner")
"""The same of studies of fleets."""
KNOWN_RATIOS = ("path_ratio", "expansions_ratio")
"""Columns of a study with sensors, of runs with a sensor: the run's cost and expansions over those of the same planner and
law with the map known, in the same world; where both arrived."""
FLEET_SWEPT = ("radius", "delays")
"""Further ones, of studies that compare several."""
TIMING = ("cpu_s", "wall_s", "plan_s", "memory_b")
FLEET_TIMING = (*TIMING, "cost_by_s")
"""What depends on the machine: the last columns, and left out wherever bytes are compared. ``cost_by_s``, of plans of fleets:
the cost of the best plan so far as ``CPU seconds:cost`` apart by spaces."""

Column = list[Any]


@dataclass(frozen=True, slots=True, eq=False)
class ResultTable:
    """The results of a study, one row a run.

    The columns, in this order: ``index`` and ``key`` of the job; its labels (:data:`LABELS`); ``ending``;
    ``error``, empty where nothing went wrong; ``reproducible``, false where the study has a budget in
    seconds, so that the same run may end otherwise on another machine; the metrics in the order of
    :data:`lampyris.report.data.measures.METRICS` (of fleets
    :data:`lampyris.report.data.fleets.measures.FLEET_METRICS`) and after them any others by name; the timing, likewise. Every
    study has all of them; a value that is not defined is None.

    Parameters
    ----------
    columns : by name, in order, each as long as there are rows.
    metrics, timing : names of those columns.
    asked : jobs of the study; those that have no row yet are counted here and stand nowhere else.
    strange : rows that are of no job of the study, and are left out.
    """

    columns: Mapping[str, Column]
    metrics: tuple[str, ...]
    timing: tuple[str, ...]
    asked: int
    strange: int = 0

    def __len__(self) -> int:
        return len(self.columns["index"])

    def __getitem__(self, name: str) -> Column:
        return self.columns[name]

    @property
    def missing(self) -> int:
        """Jobs that have no row yet."""
        return self.asked - len(self)

    def names(self, *, timing: bool = False) -> tuple[str, ...]:
        """Names of the columns, in order, with or without those that depend on the machine."""
        return tuple(name for name in self.columns if timing or name not in self.timing)

    def lines(self, *, timing: bool = False) -> Iterator[tuple[Any, ...]]:
        """Rows as tuples, in the order of :meth:`names`."""
        return zip(*(self.columns[name] for name in self.names(timing=timing)), strict=True)

    def records(self) -> Iterator[tuple[int, str, str, dict[str, Any]]]:
        """Index of the job, ending, code of the error, metrics and timing by name, of every row."""
        names = (*self.metrics, *self.timing)
        parts = (self.columns[name] for name in ("index", "ending", "error"))
        values = zip(*(self.columns[name] for name in names), strict=True)
        for index, ending, error, numbers in zip(*parts, values, strict=True):
            yield index, ending, code_of(error), dict(zip(names, numbers, strict=True))


def table_of(study: Study, rows: Mapping[str, Row] | Iterable[Row]) -> ResultTable:
    """The table of a study's rows.

    Parameters
    ----------
    study : which.
    rows : by key, or one after the other in any order, each key once: a store's
        :meth:`lampyris.study.store.store.Store.scan` need not be held in memory.
    """
    given = rows.values() if isinstance(rows, Mapping) else rows
    place = {job.key: job.index for job in study.jobs()}
    index: list[int] = []
    held = _Held()
    strange = 0
    for row in given:
        at = place.get(row.key)
        if at is None:
            strange += 1
        else:
            index.append(at)
            held.add(row)
    del place
    order = sorted(range(len(index)), key=index.__getitem__)
    of_fleets = study.kind == "fleet"
    labels = labels_of(study)
    metrics = _ordered(FLEET_METRICS if of_fleets else METRICS, held.metrics)
    timing = _ordered(FLEET_TIMING if of_fleets else TIMING, held.timing)
    columns: dict[str, Column] = {name: [] for name in ("index", "key", *labels)}
    wanted = [index[k] for k in order]
    _label(columns, study, wanted)
    columns["ending"] = [held.ending[k] for k in order]
    columns["error"] = [held.error[k] for k in order]
    columns["reproducible"] = [study.seconds is None] * len(order)
    for names, source in ((metrics, held.metrics), (timing, held.timing)):
        for name in names:
            column = source.pop(name, None)
            columns[name] = [None] * len(order) if column is None else [column[k] for k in order]
    if study.senses:
        _add_known_ratios(columns, study)
        metrics = (*metrics, *KNOWN_RATIOS)
        columns |= {name: columns.pop(name) for name in timing}
    return ResultTable(columns, metrics, timing, len(study), strange)


def labels_of(study: Study) -> tuple[str, ...]:
    """The labels of a study's runs."""
    if study.kind != "fleet":
        return (*LABELS, *SENSOR_LABELS) if study.senses else LABELS
    swept = {
        "radius": any(c.radius for c in study.traffic_cases),
        "delays": any(c.rate is not None for c in study.traffic_cases),
    }
    return (*FLEET_LABELS, *(name for name in FLEET_SWEPT if swept[name]))


def _add_known_ratios(columns: dict[str, Column], study: Study) -> None:
    """Add :data:`KNOWN_RATIOS`; None where there is no such pair of runs."""
    laws, entrants = len(study.laws), len(study.planners) * len(study.laws)
    known = {_identity(p): k for k, p in enumerate(study.planners) if p.sensor is None}
    partner = [None if p.sensor is None else known.get(_identity(p)) for p in study.planners]
    place = {index: k for k, index in enumerate(columns["index"])}
    for name, metric in zip(KNOWN_RATIOS, ("cost", "expansions"), strict=True):
        ratios: Column = []
        for k, index in enumerate(columns["index"]):
            world, entrant = divmod(index, entrants)
            other = partner[entrant // laws]
            at = None if other is None else place.get(world * entrants + other * laws + entrant % laws)
            ratios.append(None if at is None else _ratio(columns, metric, k, at))
        columns[name] = ratios


def _identity(planner: Config) -> bytes:
    return canonical([planner.name, dict(planner.settings), planner.origin])


def _ratio(columns: dict[str, Column], metric: str, k: int, known: int) -> float | None:
    if not (columns["arrived"][k] and columns["arrived"][known]):
        return None
    value, base = columns[metric][k], columns[metric][known]
    return value / base if value is not None and base else None


def code_of(error: str) -> str:
    """The code at the head of a row's error, ``error[CODE]: ...`` or ``CODE: ...``; empty for none."""
    word = error.removeprefix("error[").partition(":")[0].removesuffix("]")
    return word if word.replace("_", "").isalnum() and word.isupper() else ""


class _Held:
    """Columns as the rows come; a name that appears late has None for all before it."""

    def __init__(self) -> None:
        self.ending: list[str] = []
        self.error: list[str] = []
        self.metrics: dict[str, Column] = {}
        self.timing: dict[str, Column] = {}
        self._words: dict[str, str] = {}

    def add(self, row: Row) -> None:
        """One more row."""
        n = len(self.ending)
        self.ending.append(self._word(row.ending))
        self.error.append(self._word(row.error))
        for columns, values in ((self.metrics, row.metrics), (self.timing, row.timing)):
            for name, value in values.items():
                column = columns.get(name)
                if column is None:
                    columns[name] = column = []
                if len(column) < n:
                    column.extend([None] * (n - len(column)))
                column.append(self._word(value) if isinstance(value, str) else value)
            for column in columns.values():
                if len(column) == n:
                    column.append(None)

    def _word(self, text: str) -> str:
        """The same text as one object: a million outcomes are three words."""
        return self._words.setdefault(text, text)


def _ordered(known: tuple[str, ...], found: Iterable[str]) -> tuple[str, ...]:
    """The known names, then the others by name."""
    return (*known, *sorted(set(found) - set(known)))


def _label(columns: dict[str, Column], study: Study, wanted: list[int]) -> None:
    """Index, key and labels of the jobs that have a row; ``wanted`` is sorted."""
    k = 0
    for job in study.jobs():
        if k == len(wanted):
            return
        if job.index != wanted[k]:
            continue
        k += 1
        columns["index"].append(job.index)
        columns["key"].append(job.key)
        for name in labels_of(study):
            columns[name].append(job.labels[name])

"""Results: what the runs say, with intervals. The unit is the query, the seeds of one query averaged."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from statistics import median

from lampyris.reproduce.runs.runs import NT, Tables
from lampyris.reproduce.tables import printed_data
from lampyris.reproduce.tables.verdict import short
from lampyris.study.analysis import compare
from lampyris.study.analysis.compare import Interval, Signed
from lampyris.study.analysis.table import ResultTable

USUAL = "nt 10"
SURE = 0.05
"""Below it a corrected p is called a difference."""

Query = tuple[str, str]
Units = Mapping[str, Mapping[Query, float]]
"""By planner: a mean over seeds for each map and query."""

PAIRS = (
    ("ad-gso", "mixed"),
    ("ad-gso", "improved"),
    ("ad-gso, gates closed", "improved"),
    ("ad-gso, gates ignored", "astar"),
)
"""What is compared with what: as the dissertation does; with the gates closed for both, like with like; and,
gates left alone, with plain A*."""


@dataclass(frozen=True, slots=True)
class Difference:
    """One method less another, over the queries that both solved.

    Parameters
    ----------
    what : the measure.
    a, b : the two.
    mean : of a - b, with a bootstrap interval.
    share : mean of a less mean of b, over mean of b, in per cent; NaN where b is 0.
    test : Wilcoxon's signed-rank test.
    holm : its p, corrected for all of its table.
    """

    what: str
    a: str
    b: str
    mean: Interval
    share: float
    test: Signed
    holm: float

    @property
    def sure(self) -> bool:
        """Whether it is called a difference."""
        return self.holm < SURE


@dataclass(frozen=True, slots=True)
class Method:
    """One method over a study.

    Parameters
    ----------
    name : its label.
    runs : how many; ``solved`` of them found a path, or arrived.
    means : by measure, over the queries in which it solved something.
    plan_ms : median of the planner's time for a run in milliseconds, of this machine.
    """

    name: str
    runs: int
    solved: Interval
    means: Mapping[str, Interval]
    plan_ms: float


@dataclass(frozen=True, slots=True)
class Results:
    """What the page tells of runs."""

    nt: tuple[Method, ...]
    nt_differences: tuple[Difference, ...]
    static: tuple[Method, ...]
    static_differences: tuple[Difference, ...]
    moving: tuple[Method, ...]
    moving_differences: tuple[Difference, ...]
    by_pair: Mapping[tuple[str, str, str, str, str], str]
    first: Mapping[str, Mapping[str, tuple[float, ...]]]


STATIC = ("cost", "cost_to_go", "iterations", "expansions", "gap")
MOVING = ("cost", "cost_to_go", "iterations", "expansions", "ticks", "waits", "collisions")


def results(tables: Tables) -> Results:
    """Work them out."""
    against = [(f"nt {n}", USUAL) for n in NT if f"nt {n}" != USUAL]
    return Results(
        nt=methods(tables.nt, ("cost", "iterations", "gap", "expansions")),
        nt_differences=differences(tables.nt, ("cost", "iterations"), against),
        static=methods(tables.static, STATIC),
        static_differences=differences(tables.static, ("cost", "iterations", "expansions"), PAIRS),
        moving=methods(tables.moving, MOVING),
        moving_differences=differences(tables.moving, ("cost", "ticks", "expansions"), PAIRS),
        by_pair=by_pair(tables.static),
        first=first_map(tables.static),
    )


def units(table: ResultTable, measure: str) -> Units:
    """Means over seeds, of runs that solved their query and have the measure."""
    found: dict[str, dict[Query, list[float]]] = {}
    columns = (table[c] for c in ("planner", "map", "query", "arrived", measure))
    for planner, name, query, arrived, value in zip(*columns, strict=True):
        some = found.setdefault(planner, {}).setdefault((name, query), [])
        if arrived and value is not None:
            some.append(float(value))
    return {p: {q: math.fsum(v) / len(v) for q, v in by.items() if v} for p, by in found.items()}


def methods(table: ResultTable, measures: Sequence[str]) -> tuple[Method, ...]:
    """Every planner of a table with its means, in the order of the study."""
    known = {m: units(table, m) for m in measures}
    out = []
    for name in dict.fromkeys(table["planner"]):
        at = [k for k, p in enumerate(table["planner"]) if p == name]
        queries = {(table["map"][k], table["query"][k]) for k in at}
        runs = dict.fromkeys(queries, 0)
        solved = dict(runs)
        for k in at:
            query = (table["map"][k], table["query"][k])
            runs[query] += 1
            solved[query] += bool(table["arrived"][k])
        times = [t for k in at if (t := _time(table, k)) is not None]
        out.append(
            Method(
                name,
                len(at),
                compare.success([solved[q] for q in sorted(queries)], [runs[q] for q in sorted(queries)]),
                {m: compare.mean([v for _, v in sorted(known[m].get(name, {}).items())]) for m in measures},
                1000 * median(times) if times else math.nan,
            )
        )
    return tuple(out)


def _time(table: ResultTable, k: int) -> float | None:
    value = table["plan_s"][k] if "plan_s" in table.columns else None
    return None if value is None else float(value)


def differences(
    table: ResultTable, measures: Sequence[str], pairs: Iterable[tuple[str, str]]
) -> tuple[Difference, ...]:
    """Paired differences, their p corrected for all of them together."""
    known = set(table["planner"])
    made = []
    for measure in measures:
        by = units(table, measure)
        for a, b in pairs:
            if a in known and b in known:
                both = sorted(set(by[a]) & set(by[b]))
                x, y = [by[a][q] for q in both], [by[b][q] for q in both]
                made.append((measure, a, b, x, y, compare.signed_rank(x, y)))
    corrected = compare.holm([test.p for *_, test in made])
    return tuple(
        Difference(measure, a, b, compare.difference(x, y), _share(x, y), test, p)
        for (measure, a, b, x, y, test), p in zip(made, corrected, strict=True)
    )


def _share(x: Sequence[float], y: Sequence[float]) -> float:
    low = math.fsum(y)
    return 100 * (math.fsum(x) - low) / low if low else math.nan


def spelled(query: str) -> tuple[str, str]:
    """``(37, 8) to (5, 38)``, as studies write it, as the files of this room do."""
    start, goal = query.replace(" ", "").split("to")
    return start, goal


def by_pair(table: ResultTable) -> dict[tuple[str, str, str, str, str], str]:
    """Ours beside each row of Table 4.11: the same pair on our map of that number."""
    columns = {"iterations": units(table, "iterations")}
    costs, sums = units(table, "cost"), units(table, "cost_to_go")
    out = {}
    for method in ("mixed", "improved", "ad-gso"):
        for at, value in columns["iterations"][method].items():
            key = (at[0].removeprefix("env-"), *spelled(at[1]), method)
            out[*key, "iterations"] = short(value, 1)
            out[*key, "path_cost"] = f"length {short(costs[method][at], 1)}, sum {short(sums[method][at], 1)}"
    return out


def first_map(table: ResultTable) -> dict[str, dict[str, tuple[float, ...]]]:
    """For figures in the form of 4.5 to 4.7: of the pairs on ``env-1``, a value for each method and measure.

    ``printed`` is what the dissertation prints as path cost: the sum of cost-to-go, for its own method the
    length; ``plan_ms`` the median time.
    """
    queries = [f"({a[0]}, {a[1]}) to ({b[0]}, {b[1]})" for a, b in pairs_of("1")]
    out: dict[str, dict[str, tuple[float, ...]]] = {}
    for method in ("mixed", "improved", "ad-gso"):
        out[method] = {}
        for name in ("iterations", "cost", "cost_to_go"):
            by = units(table, name)[method]
            out[method][name] = tuple(by.get(("env-1", q), math.nan) for q in queries)
        out[method]["printed"] = out[method]["cost" if method == "ad-gso" else "cost_to_go"]
        out[method]["plan_ms"] = tuple(_median_time(table, method, q) for q in queries)
    return out


def pairs_of(environment: str) -> list[tuple[tuple[int, int], tuple[int, int]]]:
    """Start and goal of the five pairs of an environment of Table 4.11."""
    rows = [
        r for r in printed_data.rows("4.11") if (r["environment"], r["method"]) == (environment, "ad-gso")
    ]
    return [(printed_data.cell(r["start"]), printed_data.cell(r["goal"])) for r in rows]


def _median_time(table: ResultTable, method: str, query: str) -> float:
    names = zip(table["planner"], table["map"], table["query"], strict=True)
    at = [k for k, who in enumerate(names) if who == (method, "env-1", query)]
    times = [t for k in at if (t := _time(table, k)) is not None]
    return 1000 * median(times) if times else math.nan

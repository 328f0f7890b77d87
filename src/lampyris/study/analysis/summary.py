"""Summary: what a study found: numbers with intervals, and how many queries and runs are behind each.

The unit of all statistics is the query: its seeds are averaged first, for runs of one query are not
independent of each other and would make intervals too narrow. Where a study has one query only, the unit is
the seed. Differences are taken run by run in the same world, then averaged over the seeds of a query.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from lampyris.errors import UsageError, did_you_mean
from lampyris.study.analysis import compare
from lampyris.study.analysis.compare import Interval
from lampyris.study.analysis.findings import (
    EntrantFindings,
    Estimate,
    Order,
    PairedDifference,
    Summary,
    Within,
)
from lampyris.study.analysis.measures import ALL, PAIRED, PROFILED, RANKED, SHARES, TIMING, WHOLE, compared
from lampyris.study.analysis.runs import Cube, Runs
from lampyris.study.otherwise import remark
from lampyris.typing import Floats

__all__ = ["EntrantFindings", "Estimate", "Order", "PairedDifference", "Summary", "Within", "summarise"]


def summarise(runs: Runs, *, reference: str | None = None, timing: bool = False) -> Summary:
    """Summarise a study.

    Parameters
    ----------
    reference : the entrant that others are compared with; None: the first.
    timing : whether seconds and memory are reported; they depend on the machine.

    Raises
    ------
    UsageError : no such entrant.
    """
    study = runs.study
    base = _entrant(runs.entrants, reference)
    traffic_cases = tuple(c.label for c in study.traffic_cases)
    unit = "query" if len(study.worlds) > 1 else "seed"
    common, left_out = _common(runs)
    names = _reported(runs, timing)
    everywhere = np.arange(len(study.worlds))
    places = tuple(dict.fromkeys(w.ground.name for w in study.worlds))
    by_map = []
    for place in places if len(places) > 1 else ():
        here = np.array([k for k, w in enumerate(study.worlds) if w.ground.name == place])
        by_map += _entries(runs, here, place, names, common)
    return Summary(
        name=study.name,
        kind=study.kind,
        unit=unit,
        asked=runs.asked,
        known=runs.known,
        queries=len(study.worlds),
        maps=len(places),
        seeds=len(study.seeds),
        entrants=runs.entrants,
        traffic_cases=traffic_cases,
        reference=runs.entrants[base],
        common=tuple(int(common[:, c].sum()) for c in range(len(traffic_cases))),
        left_out=left_out,
        entries=tuple(_entries(runs, everywhere, "", names, common)),
        by_map=tuple(by_map),
        pairs=_pairs(runs, base, traffic_cases),
        orders=_orders(runs, traffic_cases),
        within=_within(runs, traffic_cases),
        start_exact=_start_exact(runs),
        notes=_notes(runs),
    )


def _start_exact(runs: Runs) -> tuple[str, ...]:
    """The entrants whose swarm starts from the exact shortest path."""
    planners = (p for p in runs.study.planners for _ in runs.study.laws)
    return tuple(name for name, p in zip(runs.entrants, planners, strict=True) if p.starts_exact)


def _notes(runs: Runs) -> tuple[str, ...]:
    """What was done otherwise than asked, a sentence for each entrant in whose runs something was."""
    known = runs.ending != ""
    each = (runs.notes[..., e][known[..., e]].tolist() for e in range(len(runs.entrants)))
    return tuple(filter(None, map(remark, runs.entrants, each)))


def _entrant(entrants: tuple[str, ...], name: str | None) -> int:
    if name is None:
        return 0
    if name not in entrants:
        raise UsageError(
            "REFERENCE", f"no planner is called {name!r}", allowed="; ".join(entrants),
            todo=did_you_mean(name, entrants), setting="reference",
        )  # fmt: skip
    return entrants.index(name)


def _reported(runs: Runs, timing: bool) -> tuple[str, ...]:
    """Names of the measures there are."""
    apart = {m.name for m in TIMING}
    return tuple(n for n in ALL if runs.has(n) and (timing or n not in apart))


def _common(runs: Runs) -> tuple[NDArray[np.bool_], tuple[tuple[str, ...], ...]]:
    """(worlds, traffic cases, seeds) where all solved it, those that never did in a case left aside and named."""
    solved = runs.solved
    out = np.zeros(solved.shape[:3], dtype=np.bool_)
    left = []
    for c in range(solved.shape[1]):
        able = [e for e in range(solved.shape[3]) if solved[:, c, :, e].any()]
        left.append(tuple(name for e, name in enumerate(runs.entrants) if e not in able))
        out[:, c] = solved[:, c][..., able].all(axis=-1) if able else False
    return out, tuple(left)


def per_unit(values: Floats) -> Floats:
    """Means over the seeds of each query, (queries,); of one query its seeds as they are.

    Parameters
    ----------
    values : (queries, seeds), NaN where there is none.
    """
    if values.shape[0] == 1:
        alone: Floats = values[0]
        return alone
    there = ~np.isnan(values)
    counts = there.sum(axis=1)
    sums = np.where(there, values, 0.0).sum(axis=1)
    out: Floats = np.divide(sums, counts, out=np.full(len(sums), np.nan), where=counts > 0)
    return out


def _mean(values: Floats) -> Estimate:
    """An estimate of (queries, seeds) values."""
    return _estimate(compare.mean(per_unit(values)), int(np.count_nonzero(~np.isnan(values))))


def _estimate(interval: Interval, runs: int) -> Estimate:
    return Estimate(interval.value, interval.low, interval.high, interval.n, runs)


def _share(values: Floats) -> Estimate:
    """A share of (queries, seeds) zeros and ones."""
    there = ~np.isnan(values)
    if values.shape[0] == 1:
        values, there = values.T, there.T
    found = np.where(there, values, 0.0).sum(axis=1)
    runs = there.sum(axis=1)
    units = int(np.count_nonzero(runs))
    share = compare.success(found, runs)
    return Estimate(share.value, share.low, share.high, units, share.n)


def _entries(
    runs: Runs, here: NDArray[np.int64], place: str, names: Sequence[str], common: NDArray[np.bool_]
) -> list[EntrantFindings]:
    """An entry for each traffic case and entrant, on the worlds ``here``."""
    out = []
    for c, traffic in enumerate(runs.study.traffic_cases):
        for e, entrant in enumerate(runs.entrants):
            ending = runs.ending[here, c, :, e]
            known = ending != ""
            both = common[here, c]
            own, shared = {}, {}
            for name in names:
                values = runs.values[name][here, c, :, e]
                own[name] = _share(values) if name in SHARES else _mean(values)
                if name not in SHARES:
                    shared[name] = _mean(np.where(both, values, np.nan))
            out.append(
                EntrantFindings(
                    place, traffic.label, entrant, int(known.sum()), int(known.any(axis=1).sum()),
                    _counted(ending[known]), _counted(runs.outcome[here, c, :, e][known]), own, shared,
                )
            )  # fmt: skip
    return out


def _counted(words: NDArray[np.object_]) -> dict[str, int]:
    """How often each word occurs, the most frequent first."""
    counts: dict[str, int] = {}
    for word in words.tolist():
        counts[word] = counts.get(word, 0) + 1
    return dict(sorted(counts.items(), key=lambda item: (-item[1], item[0])))


def _pairs(runs: Runs, base: int, traffic_cases: tuple[str, ...]) -> tuple[PairedDifference, ...]:
    """Every entrant against the reference."""
    out: list[PairedDifference] = []
    for name in compared(PAIRED, runs.cost):
        if not runs.has(name):
            continue
        family = []
        for c, traffic in enumerate(traffic_cases):
            values = runs.values[name][:, c] if name in WHOLE else runs.of_solved(name)[:, c]
            for e, entrant in enumerate(runs.entrants):
                if e != base:
                    family.append(_pair(values, e, base, (name, traffic, entrant, runs.entrants[base])))
        corrected = compare.holm([pair.test.p for pair in family])
        out += [replace(pair, holm=p) for pair, p in zip(family, corrected, strict=True)]
    return tuple(out)


def _pair(values: Cube, e: int, base: int, names: tuple[str, str, str, str]) -> PairedDifference:
    gaps = compare.gaps(values[..., e], values[..., base])
    each = per_unit(gaps)
    there = each[~np.isnan(each)]
    estimate = _estimate(compare.mean(there), int(np.count_nonzero(~np.isnan(gaps))))
    test = compare.signed_rank(there, np.zeros(len(there)))
    return PairedDifference(*names, estimate, test, math.nan, tuple(there.tolist()))


def scores(values: Cube, more_is_better: bool) -> Floats:
    """What units are ranked by, (units, entrants), less is better; NaN where every run failed.

    Who failed in fewer runs of a query comes first; among those that failed in as many, the mean decides.
    A mean of the runs that succeeded alone would reward who fails where the path is long.

    Parameters
    ----------
    values : (queries, seeds, entrants), NaN where a run failed.
    """
    if values.shape[0] == 1:
        alone: Floats = -values[0] if more_is_better else values[0]
        return alone
    failed = np.isnan(values).mean(axis=1)
    means = np.stack([per_unit(values[..., e]) for e in range(values.shape[2])], axis=1)
    means = -means if more_is_better else means
    out = np.full(means.shape, np.nan)
    for row, (share, value) in enumerate(zip(failed, means, strict=True)):
        order = sorted(np.flatnonzero(~np.isnan(value)).tolist(), key=lambda k: (share[k], value[k]))
        level = 0.0
        for last, k in zip([None, *order], order, strict=False):
            if last is not None and not (share[k] == share[last] and compare.same(value[k], value[last])):
                level += 1.0
            out[row, k] = level
    return out


def _orders(runs: Runs, traffic_cases: tuple[str, ...]) -> tuple[Order, ...]:
    """Average ranks by each measure, in each traffic case, over the units of which every entrant has all results."""
    out = []
    for name in compared(RANKED, runs.cost):
        for c, traffic in enumerate(traffic_cases if runs.has(name) and len(runs.entrants) > 1 else ()):
            values = scores(runs.of_solved(name)[:, c], ALL[name].better == "more")
            done = runs.ending[:, c] != ""
            whole = done.all(axis=(1, 2)) if len(done) > 1 else done[0].all(axis=1)
            ranking = compare.friedman(values[whole])
            sets = compare.groups(ranking.ranks, ranking.critical)
            out.append(Order(name, traffic, ranking, sets))
    return tuple(out)


def _within(runs: Runs, traffic_cases: tuple[str, ...]) -> tuple[Within, ...]:
    """Performance profiles by each measure, in each traffic case, over the worlds that every entrant met."""
    out = []
    for name in compared(PROFILED, runs.cost):
        for c, traffic in enumerate(traffic_cases if runs.has(name) and len(runs.entrants) > 1 else ()):
            met = (runs.ending[:, c] != "").all(axis=-1)
            out.append(Within(name, traffic, compare.profiles(runs.of_solved(name)[:, c][met])))
    return tuple(out)

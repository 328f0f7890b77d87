"""Summary tabs: a summary as tables for people. Beside every mean stand its interval and its sample size."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from lampyris.report.html.table import DASH, Tab, Value
from lampyris.study.analysis import compare
from lampyris.study.analysis.findings import EntrantFindings, Estimate, Order, PairedDifference, Summary
from lampyris.study.analysis.measures import (
    ALL,
    ON_PATH,
    PAIRED,
    SAFETY,
    SHARES,
    TIME,
    TIMING,
    WORK,
    Measure,
    compared,
)
from lampyris.study.design.traffic_labels import place_words, traffic_words

ANY_ANGLE = (
    "Cost and gap of a planner with an any-angle length are of its walk from cell to cell; "
    "length and turns are of its lines."
)
"""What stands beneath a table of costs in which such a planner is."""
START = "from the exact shortest path (setting `seeded`): its cost does not tell what a swarm finds alone"
"""Where a swarm starts by default."""


def tabs(summary: Summary) -> tuple[Tab, ...]:
    """Every table of a summary, one traffic case after another, then differences, ranks and maps."""
    out: list[Tab] = []
    for k, traffic in enumerate(summary.traffic_cases):
        out += traffic_tabs(summary, k, traffic)
    return (*out, *pair_tabs(summary), *order_tabs(summary), *map_tabs(summary))


def traffic_tabs(summary: Summary, k: int, traffic: str) -> tuple[Tab, ...]:
    """Outcomes of the runs in one traffic case, their paths, time and work, and the same over common worlds."""
    some = [e for e in summary.entries if e.traffic == traffic]
    others = "" if traffic == "none" else f", {traffic_words(traffic)}"
    place = place_words(traffic)
    out = [_ending_tab(summary, f"endings-{k + 1}", f"Outcomes of the runs {place}", some)]
    sets = (
        ("paths", "Paths", ON_PATH),
        ("time", "Time, speed and shape", TIME),
        ("work", "Work of the planner", WORK),
    )
    for word, title, measures in (*sets, ("timing", "Seconds and memory, of this machine", TIMING)):
        tab = _measure_tab(summary, f"{word}-{k + 1}", f"{title}{others}", some, measures, False)
        out += [] if tab is None else [tab]
    if summary.common[k] and _differs(some):
        names = ("cost", "gap", "length_any_angle", "cost_to_go", "time_s", "iterations", "expansions")
        names = (summary.cost, *names[1:])
        few = tuple(ALL[n] for n in names)
        title = f"The same over the worlds that all solved{others}"
        tab = _measure_tab(summary, f"common-{k + 1}", title, some, few, True, summary.left_out[k])
        out += [] if tab is None else [tab]
    return _with_starts(summary, out)


def starts(summary: Summary) -> str:
    """Who starts from the exact shortest path, which stands beneath every table; empty: nobody."""
    some = summary.start_exact
    who = f"{', '.join(some[:-1])} and {some[-1]} start" if some[1:] else f"{some[0]} starts" if some else ""
    return f"{who} {START}." if who else ""


def _with_starts(summary: Summary, some: Sequence[Tab]) -> tuple[Tab, ...]:
    remark = starts(summary)
    return tuple(replace(tab, note=f"{tab.note} {remark}".strip()) if remark else tab for tab in some)


def _any_angle(some: Sequence[EntrantFindings]) -> bool:
    """Whether any plans are lines."""
    return any(e.own["length_any_angle"].units for e in some if "length_any_angle" in e.own)


def _differs(some: Sequence[EntrantFindings]) -> bool:
    """Whether any planner's own runs differ from the common ones."""
    return any(
        e.own[n].runs != e.common[n].runs
        for e in some
        for n in ("cost", "time_s", "cost_m", "sum_of_costs")
        if n in e.common
    )


def sample(summary: Summary) -> str:
    """What stands beneath every table of means."""
    one = "fleet" if summary.kind == "fleet" else "query"
    unit = f"{summary.seeds} seeds of one {one}"
    if summary.unit == "query":
        each = "one seed each" if summary.seeds == 1 else f"the {summary.seeds} seeds of each averaged"
        unit = f"{summary.queries} {summary.unit_many}, {each}"
    how = f"BCa bootstrap, {compare.RESAMPLES} resamples, seed {summary.seed}"
    if summary.queries > compare.MAX_DRAWN:
        how += f"; of more than {compare.MAX_DRAWN} values by the normal curve"
    return f"In brackets {100 * compare.LEVEL:g} % intervals over {unit}: {how}."


def _ending_tab(summary: Summary, name: str, title: str, some: Sequence[EntrantFindings]) -> Tab:
    shares = [s for s in SHARES if s in some[0].own and (s == "found" or summary.kind != "plan")]
    counts = [m for m in SAFETY if any(e.own[m.name].units for e in some if m.name in e.own)]
    failed = [w for w in ("refused", "timeout", "failed") if any(e.endings.get(w) for e in some)]
    header = ("", "runs", *(ALL[s].title for s in shares), *(m.title for m in counts), *failed)
    columns: list[Sequence[Value]] = [[e.entrant for e in some], [e.runs for e in some]]
    columns += [[estimate_text(e.own[s], 100.0, None, 1) for e in some] for s in shares]
    columns += [column_texts([e.own[m.name] for e in some], m.scale, [e.runs for e in some]) for m in counts]
    columns += [[e.endings.get(w, 0) for e in some] for w in failed]
    rows = tuple(zip(*columns, strict=True))
    note = (
        f"Shares are of all {some[0].runs} runs, those that failed among them; their intervals are Wilson's "
        "for as many runs as would say as much if the runs of one query were independent. "
    )
    means = f"The others are means a run. {sample(summary)} " if counts else ""
    remark = "".join(f" {one}." for one in summary.notes)
    return Tab(name, title, header, rows, (note + means + _n_note(counts)).rstrip() + remark, _align(header))


def _measure_tab(
    summary: Summary,
    name: str,
    title: str,
    some: Sequence[EntrantFindings],
    measures: Sequence[Measure],
    common: bool,
    left_out: tuple[str, ...] = (),
) -> Tab | None:
    """A table of means; None where nobody has any."""
    sides = {e.entrant: (e.common if common else e.own) for e in some if e.entrant not in left_out}
    there = [m for m in measures if any(own[m.name].units for own in sides.values() if m.name in own)]
    if not there:
        return None
    leads = [own[there[0].name] for own in sides.values()]
    columns: list[Sequence[Value]] = [list(sides), [e.units for e in leads], [e.runs for e in leads]]
    for m in there:
        estimates = [own[m.name] for own in sides.values()]
        columns.append(column_texts(estimates, m.scale, [e.runs for e in leads]))
    rows = tuple(zip(*columns, strict=True))
    header = ("", "queries" if summary.unit == "query" else "seeds", "runs", *(m.title for m in there))
    which = {
        False: "Means over the runs that have a value: who fails where the path is long looks better here.",
        True: "Worlds in which every planner came to the goal"
        + (f" ({', '.join(left_out)} never did and are left out)." if left_out else "."),
    }[common]
    if not common and all(e.own[there[0].name].runs == e.runs for e in some):
        which = "Means over all runs."
    walked = any(m.name in ("cost", "gap") for m in there) and _any_angle(some)
    lines = f"{ANY_ANGLE} " if walked else ""
    note = f"{which} {lines}{sample(summary)} {_n_note(there[1:])}".rstrip()
    return Tab(name, title, header, rows, note, _align(header))


def _n_note(measures: Sequence[Measure]) -> str:
    return "n: the runs behind a mean, where they are not those in the column runs." if measures else ""


def _align(header: Sequence[str]) -> str:
    return "l" + "r" * (len(header) - 1)


def estimate_text(e: Estimate, scale: float = 1.0, runs: int | None = None, places: int | None = None) -> str:
    """``12.3 [11.9, 12.8]``; with ``n 40`` after it where the runs behind it are others than ``runs``.

    Parameters
    ----------
    places : digits after the point; None: as :func:`places_of` says of this value alone.
    """
    if math.isnan(e.value):
        return DASH
    value, low, high = (v * scale for v in (e.value, e.low, e.high))
    places = places_of(value) if places is None else places
    text = fixed(value, places)
    if low < high:
        text += f" [{fixed(low, places)}, {fixed(high, places)}]"
    return text if runs is None or e.runs == runs else f"{text} n {e.runs}"


def places_of(*values: float) -> int:
    """Digits after the point so that the greatest of some numbers has four that count; at most four."""
    most = max((abs(v) for v in values if math.isfinite(v)), default=0.0)
    return 4 if most == 0.0 else min(4, max(0, 3 - math.floor(math.log10(most))))


def column_texts(some: Sequence[Estimate], scale: float, runs: Sequence[int]) -> list[str]:
    """A column of estimates, all with as many digits after the point as the greatest needs."""
    places = places_of(*(e.value * scale for e in some))
    return [estimate_text(e, scale, n, places) for e, n in zip(some, runs, strict=True)]


def fixed(value: float, places: int) -> str:
    """A number with so many digits after the point; 0 has none, and nothing that rounds to 0 a minus."""
    text = f"{value:.{places}f}"
    return "0" if value == 0 else text.lstrip("-") if not float(text) else text


def p_text(p: float) -> str:
    """A p to three digits that count, not below 0.0001."""
    if math.isnan(p):
        return DASH
    return "< 0.0001" if p < 1e-4 else f"{p:.3g}" if p >= 0.1 else f"{p:.2g}"


def pair_tabs(summary: Summary) -> tuple[Tab, ...]:
    """Differences against the reference, a table for each measure."""
    out = []
    for name in compared(PAIRED, summary.cost):
        some = [p for p in summary.pairs if p.measure == name]
        # What never differs anywhere needs no table of noughts.
        if not any(p.test.less or p.test.more for p in some) or (
            summary.kind == "plan" and name == "arrived"
        ):
            continue
        places = places_of(*(p.difference.value * ALL[name].scale for p in some))
        header = ("", "difference", summary.unit_many, "runs", "less", "equal", "more", "p", "p (Holm)")
        rows = tuple(_pair_row(p, ALL[name], len(summary.traffic_cases) > 1, places) for p in some)
        note = (
            f"Each less {summary.reference}, in the same worlds; only runs that both have"
            f"{'' if name in ('arrived', 'collisions') else ' brought to the goal'} count. {sample(summary)} "
            f"Less, equal, more: {summary.unit_many} in which it has less than {summary.reference}. "
            "p: Wilcoxon's signed-rank test over the same, exact up to "
            f"{compare.MAX_EXACT}; Holm: corrected for the {sum(p.test.n > 0 for p in some)} tests here."
        )
        title = f"{ALL[name].title.capitalize()}: differences from {summary.reference}"
        out.append(Tab(f"pairs-{name.replace('_', '-')}", title, header, rows, note, _align(header)))
    return _with_starts(summary, out)


def _pair_row(
    pair: PairedDifference, measure: Measure, traffic_cases: bool, places: int
) -> tuple[Value, ...]:
    d, t = pair.difference, pair.test
    text = estimate_text(d, measure.scale, None, places)
    signed = f"+{text}" if d.value > 0 else text
    name = f"{pair.entrant}, {traffic_words(pair.traffic)}" if traffic_cases else pair.entrant
    return (name, signed, d.units, d.runs, t.less, t.equal, t.more, p_text(t.p), p_text(pair.holm))


def order_tabs(summary: Summary) -> tuple[Tab, ...]:
    """Average ranks, a table for each measure."""
    out = []
    for name in dict.fromkeys(o.measure for o in summary.orders):
        some = [o for o in summary.orders if o.measure == name and o.ranking.n]
        if not some:
            continue
        header = ("", *(traffic_words(o.traffic) for o in some))
        rows: list[tuple[Value, ...]] = [
            (entrant, *(f"{o.ranking.ranks[k]:.2f}" for o in some))
            for k, entrant in enumerate(summary.entrants)
        ]
        rows.append((summary.unit_many, *(o.ranking.n for o in some)))
        rows.append(("critical difference", *(_two(o.ranking.critical) for o in some)))
        rows.append(("Friedman's p", *(p_text(o.ranking.p) for o in some)))
        note = (
            f"1 is the best. Within a {summary.unit} who failed in fewer runs comes first, then who has the "
            "lower mean; all failures share the last ranks. Ranks further apart than the critical difference "
            f"(Nemenyi, {100 * (1 - compare.LEVEL):.0f} %) differ. {_left_units(some, summary)}"
        ).rstrip()
        title = f"Average ranks by {ALL[name].title}"
        out.append(Tab(f"ranks-{name.replace('_', '-')}", title, header, tuple(rows), note, _align(header)))
    return _with_starts(summary, out)


def _left_units(some: Sequence[Order], summary: Summary) -> str:
    all_units = summary.queries if summary.unit == "query" else summary.seeds
    less = [o for o in some if o.ranking.n < all_units]
    return f"Of {all_units}, those with all results." if less else ""


def _two(value: float) -> str:
    return DASH if math.isnan(value) else f"{value:.2f}"


_BY_MAP = ("found", "arrived", "cost", "ratio", "gap", "time_s", "expansions")


def map_tabs(summary: Summary) -> tuple[Tab, ...]:
    """What each map did to each planner, a table for each traffic case."""
    out, plans = [], summary.kind == "plan"
    for k, traffic in enumerate(summary.traffic_cases):
        some = [e for e in summary.by_map if e.traffic == traffic]
        by_map = compared(_BY_MAP, summary.cost)
        names = [n for n in by_map if some and n in some[0].own and not (n == "arrived" and plans)]
        if not names:
            continue
        asked = "fleets" if summary.kind == "fleet" else "queries"
        header = ("map", "who", asked, "runs", *(ALL[n].title for n in names))
        columns: list[Sequence[Value]] = [[e.place for e in some], [e.entrant for e in some]]
        columns += [[e.queries for e in some], [e.runs for e in some]]
        for n in names:
            columns.append(column_texts([e.own[n] for e in some], ALL[n].scale, [e.runs for e in some]))
        rows = tuple(zip(*columns, strict=True))
        title = f"Map by map{'' if traffic == 'none' else f', {traffic_words(traffic)}'}"
        lines = f" {ANY_ANGLE}" if _any_angle(some) else ""
        note = f"{sample(summary)} Of each map its own queries. n: runs behind a mean, where some have none."
        out.append(Tab(f"maps-{k + 1}", title, header, rows, note + lines, "ll" + "r" * (len(header) - 2)))
    return _with_starts(summary, out)

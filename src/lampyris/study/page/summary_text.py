"""Page words: what a study found, said in a paragraph of its numbers and nothing else."""

from __future__ import annotations

import math
from collections.abc import Sequence

from lampyris.study.analysis.compare import LEVEL
from lampyris.study.analysis.findings import EntrantFindings, Summary
from lampyris.study.analysis.measures import ALL, compared, solved_name
from lampyris.study.analysis.runs import Runs
from lampyris.study.analysis.summary_tables import estimate_text
from lampyris.study.design.traffic_labels import place_words


def found(summary: Summary, runs: Runs) -> list[str]:
    """Sentences: how much was run, who arrived, at what cost, sure differences, what was weakened."""
    out = [_size(summary, runs)]
    for k, traffic in enumerate(summary.traffic_cases):
        some = [e for e in summary.entries if e.traffic == traffic and e.runs]
        if some:
            place = place_words(traffic)
            place = place[0].upper() + place[1:]
            parts = [p for p in (_arrived(summary, some), _cost(summary, k, some)) if p]
            if parts:
                out.append(f"{place}, {'; '.join(parts)}.")
    out += _safety(summary, runs)
    out += _sure(summary)
    out += [f"{note}." for note in summary.notes]
    return out


def _safety(summary: Summary, runs: Runs) -> list[str]:
    """Who collided or was run into, and in how many runs."""
    if summary.kind in ("plan", "fleet") or not runs.has("collisions"):
        return []
    out = []
    for name, words in (("collisions", "The robot collided"), ("hits", "An obstacle ran into the robot")):
        if not runs.has(name):
            continue
        counts = (runs.values[name] > 0).sum(axis=(0, 1, 2)).tolist()
        phrases = [f"{n:,} of {who}'s" for who, n in zip(summary.entrants, counts, strict=True) if n]
        out.append(f"{words} in {_join(phrases) + ' runs' if phrases else 'no run'}.")
    return out


def _size(summary: Summary, runs: Runs) -> str:
    ends: dict[str, int] = {}
    for word in runs.ending.ravel().tolist():
        ends[word] = ends.get(word, 0) + 1
    other = [f"{ends[w]:,} {w}" for w in ("refused", "timeout", "failed") if ends.get(w)]
    missing = ends.get("", 0)
    phrases = f"{summary.known:,} runs" + (
        f" of {summary.asked:,}, {missing:,} not run yet" if missing else ""
    )
    fleets = summary.kind == "fleet"
    asked = many(summary.queries, "fleet") if fleets else many(summary.queries, "query", "queries")
    cases = len(summary.traffic_cases)
    kinds = many(cases, "number") + " of robots" if fleets else many(cases, "kind") + " of traffic"
    phrases += f": {many(len(summary.entrants), 'method')} on {asked}"
    phrases += f" of {many(summary.maps, 'map')}, {kinds}, "
    return (
        phrases + f"{many(summary.seeds, 'seed')}. {_join(other)} of them."
        if other
        else phrases + many(summary.seeds, "seed") + "."
    )


def many(n: int, word: str, words: str = "") -> str:
    """``1 map``, ``2,000 maps``."""
    return f"{n:,} {word if n == 1 else words or word + 's'}"


def _join(parts: Sequence[str]) -> str:
    return parts[0] if len(parts) == 1 else ", ".join(parts[:-1]) + " and " + parts[-1]


def _arrived(summary: Summary, some: Sequence[EntrantFindings]) -> str:
    name = solved_name(summary.kind)
    if name not in some[0].own:
        return ""
    verb = "arrived" if name == "arrived" else "succeeded" if summary.kind == "fleet" else "found a path"
    shares = {e.own[name].value for e in some}
    if len(shares) == 1:
        share = some[0].own[name]
        who = "every method" if len(some) > 1 else some[0].entrant
        return f"{who} {verb} in {100 * share.value:.4g} % of {share.runs:,} runs"
    order = sorted(some, key=lambda e: -e.own[name].value)
    first, last = order[0], order[-1]
    return (
        f"{first.entrant} {verb} in {estimate_text(first.own[name], 100)} % of its runs, "
        f"{last.entrant} in {estimate_text(last.own[name], 100)} %, the others between"
        if len(order) > 2
        else f"{first.entrant} {verb} in {estimate_text(first.own[name], 100)} % of its runs, "
        f"{last.entrant} in {estimate_text(last.own[name], 100)} %"
    )


def _cost(summary: Summary, k: int, some: Sequence[EntrantFindings]) -> str:
    name = "time_s" if summary.kind == "drive" else summary.cost
    if summary.kind == "fleet":
        name = next((one for one in ("throughput", "lateness_mean_s") if one in some[0].common), "ratio")
    able = [e for e in some if e.entrant not in summary.left_out[k]]
    values = [(e.common[name].value, e) for e in able if name in e.common and e.common[name].units]
    if len(values) < 2:
        return ""
    low, high = min(values, key=lambda v: v[0])[1], max(values, key=lambda v: v[0])[1]
    worlds = f"{summary.common[k]:,} of {summary.queries * summary.seeds:,} worlds"
    return (
        f"over the {worlds} that all {'these ' if summary.left_out[k] else ''}"
        f"solved the mean {ALL[name].title} went from {estimate_text(low.common[name])} ({low.entrant}) to "
        f"{estimate_text(high.common[name])} ({high.entrant})"
    )


def _sure(summary: Summary) -> list[str]:
    """How many of the differences from the reference are left after the correction, measure by measure."""
    out = []
    for name in compared(("arrived", "cost", "time_s", "expansions"), summary.cost):
        tests = [p for p in summary.pairs if p.measure == name and p.test.n]
        if not tests or (summary.kind == "plan" and name == "arrived"):
            continue
        sure = [p for p in tests if not math.isnan(p.holm) and p.holm < 1 - LEVEL]
        less = sum(p.difference.value < 0 for p in sure)
        title = ALL[name].title
        if not any(p.test.less or p.test.more for p in tests):
            out.append(f"{title[0].upper()}{title[1:]}: equal to {summary.reference} in every world.")
            continue
        out.append(
            f"Against {summary.reference}, {len(sure)} of {many(len(tests), 'difference')} in {title} "
            f"{'is' if len(sure) == 1 else 'are'} below p = {1 - LEVEL:.2g} after Holm's correction: "
            f"{less} less, {len(sure) - less} more."
            if sure
            else f"Against {summary.reference}, none of {many(len(tests), 'difference')} in {title} is below "
            f"p = {1 - LEVEL:.2g} after Holm's correction."
        )
    return out

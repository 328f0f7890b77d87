"""What limits the claims that do not hold: sentences with numbers of the same record, and the claim restated.

A claim without an entry here has no measured limit, and the page says so.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from benchmarks.figures import Figure, figures_of

Figures = Mapping[str, Figure]
NATIVE = "C++ -O3 -march=native"
TIMES_NATIVE = 1.2
"""Times the same loops in C++ that a field may take at most."""
CELLS = 4096 * 4096
CLEARING = "clearing its room"
"""What a search by intervals does before it begins, in figures of the section ``timed``."""


@dataclass(frozen=True, slots=True)
class Limit:
    """What limits a claim.

    Parameters
    ----------
    section : of the record.
    claim : what its sentence begins with.
    tell : the sentence, from the claim's and the section's figures by key; empty where they do not show it.
    """

    section: str
    claim: str
    tell: Callable[[str, Figures], str]


def limit_of(record: Mapping[str, Any], claim: str) -> str:
    """What limits a claim that does not hold, measured in the same record; empty: nothing that was measured."""
    figures = {f.key: f for f in figures_of(dict(record))}
    for limit in LIMITS:
        if record["name"] == limit.section and claim.startswith(limit.claim):
            return limit.tell(claim, figures)
    return ""


def _ends(values: list[float], form: str = ".2f") -> str:
    low, high = f"{min(values):{form}}", f"{max(values):{form}}"
    return low if low == high else f"{low} to {high}"


def _word(holds: bool) -> str:
    return "holds" if holds else "does not hold either"


def _in_sequence(claim: str, figures: Figures) -> str:
    """Fields compared with libraries: the same loops in C++ on the maps that fall short."""
    there = [
        f
        for f in figures.values()
        if f.rival == NATIVE and f.theirs and re.search(rf"[ :,]\s?{re.escape(_map(f))}\b", f": {claim}")
    ]
    if not there:
        return ""
    ours, theirs = [f.ours.middle for f in there], [f.theirs.middle for f in there if f.theirs]
    shares = [a / b for a, b in zip(ours, theirs, strict=True)]
    return (
        f"steps in sequence, each cell after the one before: the same loops in {NATIVE} take {_ends(theirs, '.1f')} ns a "
        f"cell on these maps, lampyris {_ends(ours, '.1f')}. Restated: at most {TIMES_NATIVE:g} times C++ on these maps: "
        f"{_ends(shares)}, {_word(max(shares) <= TIMES_NATIVE)}"
    )


def _map(figure: Figure) -> str:
    """The map and the moves of a figure of stages."""
    return figure.task.removeprefix("stages, ")


def _bytes_written(claim: str, figures: Figures) -> str:
    """The whole field compared with costs alone: how many times as many bytes it writes."""
    moves = claim.split("cost alone, ")[1].split(" moves")[0]
    cost, whole = (8, 17) if moves == "octile" else (4, 13)
    shares = [
        f.ours.middle / f.theirs.middle
        for f in figures.values()
        if f.rival == "cost alone" and f.theirs and f.asked is not None and f.task.endswith(f", {moves}")
    ]
    most = whole / cost
    return (
        f"bytes written: {whole} a cell compared with {cost}. Restated: at most as many times as long as it writes bytes, "
        f"{most:.3g}: {_ends(shares)}, {_word(max(shares) <= most)}"
    )


def _cold(claim: str, figures: Figures) -> str:
    """Repairs with cold caches: the same with warm ones."""
    task = claim.split(": at least")[0]
    least = float(claim.split("at least ")[1].split(" ")[0])
    cold = next((f for f in figures.values() if f.task == task), None)
    warm = next((f for f in figures.values() if f.task == task.replace(", cold", ", warm")), None)
    if cold is None or warm is None or warm.ratio is None:
        return ""
    return (
        f"waiting for memory: {cold.ours.middle:.0f} us with caches cold, {warm.ours.middle:.0f} of them with caches warm. "
        f"Restated: with caches warm at least {least:g} times as quick as {warm.rival}: {warm.ratio:.3g}, "
        f"{_word(warm.ratio >= least)}"
    )


def _nodes(claim: str, figures: Figures) -> str:
    """Polyanya: how many nodes a query expands, and how long each takes."""
    names = {f.task.removesuffix(", each node"): f.ours.middle for f in figures.values() if f.unit == "ns"}
    over = [name for name in names if f"{name} (" in claim]
    if not over:
        return ""
    many = [figures[f"{name}, nodes of a query"].ours.middle for name in over]
    each = [names[name] for name in over]
    within = [ns for name, ns in names.items() if name not in over]
    return (
        f"steps in sequence: a query there expands {_ends(many, ',.0f')} nodes one after the other, {_ends(each, ',.0f')} ns "
        f"each (on the other maps {_ends(within, ',.0f')}, few nodes and what a call costs)"
    )


def _result(claim: str, figures: Figures) -> str:
    """Memory of the largest octile field: its result, and the rest compared with that of other moves."""
    rest = {}
    for moves in ("four-connected", "octile"):
        bytes_a_cell = figures[f"field 4096, {moves}"].ours.middle
        rest[moves] = figures[f"field 4096, {moves}, whole process"].ours.middle - bytes_a_cell * CELLS / 1e6
    result = figures["field 4096, octile"].ours.middle * CELLS / 1e6
    return (
        f"the result: exact octile costs have 64 bits, {result:.0f} MB in all. Restated: apart from its result a process holds "
        f"no more than with four-connected moves, to within 1 %: {rest['octile']:.0f} and {rest['four-connected']:.0f} MB, "
        f"{_word(rest['octile'] <= 1.01 * rest['four-connected'])}"
    )


def _compiling(claim: str, figures: Figures) -> str:
    """First runs: what is compiled in them."""
    took = []
    for who in re.findall(r"([a-z-]+) \(\d", claim):
        name = f"`lampyris plan --planner {who}`, 316 x 316"
        first, again = (figures.get(f"{name}{end} | numpy") for end in (", nothing kept", ""))
        if first and again:
            took.append((again.ours.middle, first.ours.middle))
    if not took:
        return ""
    shares = [first - again for again, first in took]
    return (
        f"compiling: {_ends(shares)} s of the first run are not there in the second, on planners that are too slow in plain "
        "Python at this size"
    )


def _importing(claim: str, figures: Figures) -> str:
    """Second runs of small maps: what numba costs before anything is planned."""
    small, large = (figures.get(f"`lampyris plan --planner astar`, {n} x {n} | numpy") for n in (316, 512))
    if small is None or large is None:
        return ""
    return (
        f"importing numba and loading machine code: `astar` takes {large.ours.middle:.2f} s on 512 x 512, where it needs "
        f"numba, and {small.ours.middle:.2f} s on 316 x 316, where it does not; the planners named need numba here"
    )


def _compiling_large(claim: str, figures: Figures) -> str:
    """The first run on the largest map: what is compiled in it."""
    first, again = (
        figures.get(f"`lampyris plan`, 4096 x 4096{end} | numpy") for end in (", nothing kept", "")
    )
    if first is None or again is None:
        return ""
    return f"compiling: {first.ours.middle - again.ours.middle:.2f} s of it are not there in the second run"


def _clearing(claim: str, figures: Figures) -> str:
    """SIPP's search beside a textbook's: what clearing its room takes."""
    names = re.findall(r"(search alone, [^()]*?) \(\d", claim)
    pairs = [(figures.get(f"{name} | textbook"), figures.get(f"{name}, {CLEARING}")) for name in names]
    there = [(f, room) for f, room in pairs if f and f.theirs and f.asked and room]
    if not there:
        return ""
    shares = [f.theirs.middle / (f.ours.middle - room.ours.middle) for f, room in there if f.theirs]
    least = max(f.asked for f, _ in there if f.asked)
    return (
        f"bytes written: a search begins with clean room for every cell of the map and every safe interval, 13 bytes each, "
        f"{_ends([room.ours.middle for _, room in there])} ms of {_ends([f.ours.middle for f, _ in there])} ms. Restated: "
        f"without that at least {least:g} times as good: {_ends(shares)}, {_word(min(shares) >= least)}"
    )


def _stages(claim: str, figures: Figures) -> str:
    """A plan on the largest map from the second run on: what its stages take, the field beside C++."""
    task = "`lampyris plan`, 4096 x 4096"
    names = ("reading the map", "gates", "new memory")
    reading, gates, memory = (figures.get(f"{task}, {what}") for what in names)
    field, start = figures.get(f"{task}, field | {NATIVE}"), figures.get("`lampyris plan`, 512 x 512 | numpy")
    if not (reading and gates and memory and field and field.theirs and start):
        return ""
    least = field.theirs.middle + memory.ours.middle
    times = field.ours.middle / least
    return (
        f"starting and all else of a plan, as on 512 x 512, {start.ours.middle:.2f} s; reading the map "
        f"{reading.ours.middle:.2f} s, gates {gates.ours.middle:.2f} s, the field of 15 million cells "
        f"{field.ours.middle:.2f} s: steps in sequence, which take {field.theirs.middle:.2f} s in {NATIVE} with arrays made "
        f"beforehand, and 17 bytes a cell of memory that is new to the process, {memory.ours.middle:.2f} s to write once. "
        f"Restated: the field takes at most {TIMES_NATIVE:g} times both together: {times:.2f}, "
        f"{_word(times <= TIMES_NATIVE)}"
    )


LIMITS = (
    *(
        Limit("field", begin, _in_sequence)
        for begin in ("compared with scikit-image", "compared with tcod", "compared with the best")
    ),
    Limit("field", "the whole field compared with cost alone", _bytes_written),
    Limit("repair", "repair, ", _cold),
    Limit("repair", "D* Lite, ", _cold),
    Limit("calls", "Polyanya, median query", _nodes),
    Limit("memory", "a field of 4096 x 4096", _result),
    Limit("start", "`lampyris plan` on 316 x 316 under 0.5 s from the very first run", _compiling),
    Limit("start", "`lampyris plan` on 316 x 316 under 0.5 s from the second run", _importing),
    Limit("start", "`lampyris plan`, 4096 x 4096, nothing kept", _compiling_large),
    Limit("start", "`lampyris plan`, 4096 x 4096: ", _stages),
    Limit("timed", "SIPP beside textbook, 512 x 512, search alone", _clearing),
)

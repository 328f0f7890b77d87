"""What limits the claims that do not hold: sentences with numbers of the same record, and the claim restated.

A claim without an entry here has no measured limit, and the page says so.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from benchmarks.figures import Figure, figures_of

Figures = Mapping[str, Figure]
RESTATED, FAILS = "Restated: ", "does not hold either"
DEFAULT = "ad-gso"
"""The planner of figures of the section ``start`` that name none."""
NATIVE = "C++ -O3 -march=native"
TIMES_NATIVE = 1.2
"""Times the same loops in C++ that a field may take at most."""
CELLS = 4096 * 4096
LARGE = "4096 "
"""Maps of that many cells a side, by their names."""
EXPANDED, NEEDED, PER_MOTION = "expansions of pad", "motions of its path", "expansions of pad a motion"
IN_PLANNING = "expansions of its planning phases"
"""Figures of the section ``pose_maps``, by map."""
PLANNING, LOADING = "of which planning", "loading compiled code"
"""What an answer says about its time, in figures of the section ``first``."""
PLAIN = "lattice, weight 1.5, tolerance, no shortcuts"
"""A planner of the section ``pose_rivals``."""
EXPANSIONS, A_CALL = "expansions", "its ends side by side"
"""Figures of the section ``sampling``, the first of ``first``, too."""
STATES = "states expanded"
"""A figure of the section ``timed``."""
NEW_MEMORY = "memory that is new to the process"
"""What of the section ``field`` C++ is spared."""


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


def unanswered(records: Iterable[Mapping[str, Any]]) -> list[str]:
    """Claims that do not hold and have no limit, or one whose claim in their place does not hold either."""
    out = []
    for record in records:
        for verdict in record["verdicts"]:
            limit = "" if verdict["holds"] else limit_of(record, verdict["text"])
            if verdict["holds"] or (RESTATED in limit and FAILS not in limit):
                continue
            why = "no limit" if not limit else FAILS if FAILS in limit else "not restated"
            out.append(f"{record['name']}: {verdict['text']}: {why}")
    return out


def _asked(claim: str, words: str) -> float:
    """The number behind these words of a claim."""
    return float(claim.split(f"{words} ")[1].split(" ")[0])


def _ends(values: list[float], form: str = ".2f") -> str:
    low, high = f"{min(values):{form}}", f"{max(values):{form}}"
    return low if low == high else f"{low} to {high}"


def _restated(
    claim: str,
    values: list[float],
    *,
    most: float | None = None,
    least: float | None = None,
    form: str = ".2f",
) -> str:
    """A claim in place of one that does not hold, with what was measured of it, and whether it holds."""
    holds = (most is None or max(values) <= most) and (least is None or min(values) >= least)
    return f"{RESTATED}{claim}: {_ends(values, form)}, {'holds' if holds else FAILS}"


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
    # Arrays of large maps are new to the process at each call of ours.
    new = [figures.get(f"{f.task}, {NEW_MEMORY}") if _map(f).startswith(LARGE) else None for f in there]
    added = [one.ours.middle if one else 0.0 for one in new]
    shares = [a / (b + c) for a, b, c in zip(ours, theirs, added, strict=True)]
    more = f", memory that is new to the process {_ends(added, '.1f')}" if any(added) else ""
    beside = "C++ and that together" if any(added) else "C++"
    restated = _restated(f"at most {TIMES_NATIVE:g} times {beside} on these maps", shares, most=TIMES_NATIVE)
    return (
        f"steps in sequence, each cell after the one before: the same loops in {NATIVE} take {_ends(theirs, '.1f')} ns a "
        f"cell on these maps{more}, lampyris {_ends(ours, '.1f')}. {restated}"
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
    restated = _restated(f"at most as many times as long as it writes bytes, {most:.3g}", shares, most=most)
    return f"bytes written: {whole} a cell compared with {cost}. {restated}"


def _cold(claim: str, figures: Figures) -> str:
    """Repairs with cold caches: the same with warm ones."""
    task = claim.split(": at least")[0]
    least = _asked(claim, "at least")
    cold = next((f for f in figures.values() if f.task == task), None)
    warm = next((f for f in figures.values() if f.task == task.replace(", cold", ", warm")), None)
    if cold is None or warm is None or warm.ratio is None:
        return ""
    what = f"with caches warm at least {least:g} times as quick as {warm.rival}"
    return (
        f"waiting for memory: {cold.ours.middle:.0f} us with caches cold, {warm.ours.middle:.0f} of them with caches warm. "
        f"{_restated(what, [warm.ratio], least=least, form='.3g')}"
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
    others = (
        f" (on the other maps {_ends(within, ',.0f')}, few nodes and what a call costs)" if within else ""
    )
    restated = _restated(f"at most {NS_A_NODE:,} ns a node on these maps", each, most=NS_A_NODE, form=",.0f")
    return (
        f"steps in sequence: a query there expands {_ends(many, ',.0f')} nodes one after the other, {_ends(each, ',.0f')} ns "
        f"each{others}. {restated}"
    )


def _result(claim: str, figures: Figures) -> str:
    """Memory of the largest octile field: its result, and the rest compared with that of other moves."""
    rest = {}
    for moves in ("four-connected", "octile"):
        bytes_a_cell = figures[f"field 4096, {moves}"].ours.middle
        rest[moves] = figures[f"field 4096, {moves}, whole process"].ours.middle - bytes_a_cell * CELLS / 1e6
    result = figures["field 4096, octile"].ours.middle * CELLS / 1e6
    others = rest["four-connected"]
    what = f"apart from its result a process holds no more than with four-connected moves, {others:.0f} MB, to within 1 %"
    return (
        f"the result: exact octile costs have 64 bits, {result:.0f} MB in all. "
        f"{_restated(what, [rest['octile']], most=1.01 * others, form='.0f')}"
    )


def _compiling(claim: str, figures: Figures) -> str:
    """First runs: what is compiled in them."""
    runs = [
        tuple(figures.get(f"{_call(who)}{end} | numpy") for end in (", nothing kept", ""))
        for who in re.findall(r"([a-z-]+(?:, terrain)?) \(\d", claim)
    ]
    took = [(first.ours.middle, again.ours.middle) for first, again in runs if first and again]
    numba = figures.get("numba | bare")
    if not took or len(took) < len(runs) or not numba:
        return ""
    shares = [again / numba.ours.middle for _, again in took]
    return (
        f"compiling: {_ends([first - again for first, again in took])} s of the first run are not there in the second, on "
        f"planners that are too slow in plain Python at this size. {_restated(_AFTER, shares, most=TIMES_NUMBA)}"
    )


def _call(who: str) -> str:
    """The figure of a planner, or of terrain, on 316 x 316 in the section ``start``."""
    if who.startswith(DEFAULT):
        return "`lampyris plan`, 316 x 316" + who.removeprefix(DEFAULT)
    return f"`lampyris plan --planner {who}`, 316 x 316"


def _importing(claim: str, figures: Figures) -> str:
    """Second runs of small maps: what numba costs before anything is planned."""
    small, large = (figures.get(f"`lampyris plan --planner astar`, {n} x {n} | numpy") for n in (316, 512))
    runs = [
        figures.get(f"{_call(who)} | numpy") for who in re.findall(r"([a-z-]+(?:, terrain)?) \(\d", claim)
    ]
    numba = figures.get("numba | bare")
    if small is None or large is None or numba is None or not runs or None in runs:
        return ""
    shares = [run.ours.middle / numba.ours.middle for run in runs if run]
    return (
        f"importing numba and loading machine code: `astar` takes {large.ours.middle:.2f} s on 512 x 512, where it needs "
        f"numba, and {small.ours.middle:.2f} s on 316 x 316, where it does not; the planners named need numba here. "
        f"{_restated(_AFTER, shares, most=TIMES_NUMBA)}"
    )


def _compiling_large(claim: str, figures: Figures) -> str:
    """The first run on the largest map: what is compiled in it."""
    first, again = (
        figures.get(f"`lampyris plan`, 4096 x 4096{end} | numpy") for end in (", nothing kept", "")
    )
    allowed = re.search(r"\(([0-9.]+) s allowed\)", claim)
    if first is None or again is None or not allowed:
        return ""
    took, most = again.ours.middle, float(allowed[1])
    return (
        f"compiling: {first.ours.middle - took:.2f} s of it are not there in the second run. "
        f"{_restated(f'apart from compiling at most {most:g} s', [took], most=most)}"
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
    restated = _restated(
        f"the field takes at most {TIMES_NATIVE:g} times both together", [times], most=TIMES_NATIVE
    )
    return (
        f"starting and all else of a plan, as on 512 x 512, {start.ours.middle:.2f} s; reading the map "
        f"{reading.ours.middle:.2f} s, gates {gates.ours.middle:.2f} s, the field of 15 million cells "
        f"{field.ours.middle:.2f} s: steps in sequence, which take {field.theirs.middle:.2f} s in {NATIVE} with arrays made "
        f"beforehand, and 17 bytes a cell of memory that is new to the process, {memory.ours.middle:.2f} s to write once. "
        f"{restated}"
    )


def _native(claim: str, figures: Figures) -> str:
    """The whole field compared with C++, which gets its arrays made: memory that is new to the process."""
    over = re.findall(r"(stages, [^()]*?) \(\d", claim)
    there = [(figures.get(f"{task} | {NATIVE}"), figures.get(f"{task}, {NEW_MEMORY}")) for task in over]
    pairs = [(f, new) for f, new in there if f and f.theirs and new]
    if not pairs or len(pairs) < len(there):
        return ""
    shares = [f.ours.middle / (f.theirs.middle + new.ours.middle) for f, new in pairs if f.theirs]
    return (
        f"memory that is new to the process: a call makes its arrays, which C++ is given, and the system clears each page of "
        f"them when it is first written, {_ends([new.ours.middle for _, new in pairs], '.1f')} ns a cell for writing them "
        f"once. {_restated(f'at most {TIMES_NATIVE:g} times C++ and that together', shares, most=TIMES_NATIVE)}"
    )


def _by_price(claim: str, figures: Figures) -> str:
    """Weighted cells: in how many lists a cell waits."""
    shares: dict[str, list[float]] = {moves: [] for moves in WAITS}
    for f in figures.values():
        if f.asked is not None and f.ratio is not None:
            shares[f.task.split(", ")[1]].append(1 / f.ratio)
    there = {moves: of for moves, of in shares.items() if of}
    if not there:
        return ""
    told = ", ".join(f"{moves} {max(of):.2f} (1 + {WAITS[moves]})" for moves, of in there.items())
    holds = all(max(of) <= 1 + WAITS[moves] for moves, of in there.items())
    return (
        "lists: without terrain a cell settles in one list and is read once; over terrain it is filed in a list of its bucket "
        "for each price of a step, read from each, and settled. "
        f"{RESTATED}at most as many times as long as it is filed and "
        f"settled: {told}, {'holds' if holds else FAILS}"
    )


def _of_the_path(claim: str, figures: Figures) -> str:
    """pad compared with lattice by map: the motions of its own path, or its proof, compared with lattice's expansions."""
    task, weight = re.findall(r"^(.*?): expansions of pad at weight ([0-9.]+)", claim)[0]
    share, needed, each, proof = (
        figures.get(f"{task}, weight {weight}, {what}")
        for what in (EXPANDED, NEEDED, PER_MOTION, IN_PLANNING)
    )
    most = _asked(claim, "at most")
    if not (share and needed and each and proof):
        return ""
    if needed.ours.middle > most:
        what = f"at most {MOST_A_MOTION:g} expansions for each motion of its path, in the median of the maps"
        restated = _restated(what, [each.ours.middle], most=MOST_A_MOTION, form=".1f")
        return (
            f"the path itself: a search that comes to a path state by state expands each motion of it, and `lattice` is not "
            f"far from that. The motions of pad's path alone are {needed.ours.middle:.2f} of what lattice expands in the "
            f"median of the maps (quartiles {needed.ours.low:.2f} to {needed.ours.high:.2f}). {restated}"
        )
    if proof.ours.middle > share.ours.middle / 2:
        what = f"at most {MOST_WITH_PROOF:g} of those of lattice, in the median of the maps"
        return (
            f"the proof: every state through which a path could cost less than pad's through the weight must be expanded "
            f"before its path counts. These planning phases alone are {proof.ours.middle:.2f} of what lattice expands in the "
            f"median of the maps (quartiles {proof.ours.low:.2f} to {proof.ours.high:.2f}). "
            f"{_restated(what, [share.ours.middle], most=MOST_WITH_PROOF)}"
        )
    return ""  # neither its path nor its proof is what takes long


def _path_alone(claim: str, figures: Figures) -> str:
    """pad compared with lattice: the motions of the path alone, by robot and weight."""
    least = _asked(claim, "at least")
    told = []
    for f in figures.values():
        alone = re.search(r"the path alone: ([0-9.]+) times fewer", f.note)
        if alone and f.ratio is not None and f"{f.task} (" in claim:
            told.append((f.task, float(alone[1]), f.ratio))
    if not told or max(alone for _, alone, _ in told) >= least:
        return ""
    each = "; ".join(f"{task}: {alone:.2f} times fewer, pad {ours:.2f}" for task, alone, ours in told)
    shares = [alone / ours for _, alone, ours in told]
    what = f"on these at most {TIMES_THE_PATH:g} times as many as its path has motions"
    return (
        f"the path itself: a search that comes to a path state by state expands each motion of it, even if nothing else. "
        f"{each}. {_restated(what, shares, most=TIMES_THE_PATH)}"
    )


def _starts(claim: str, figures: Figures) -> str:
    """First and later runs: machine code, and what their answers say of planning; the rest compared with numba's import."""
    found = re.search(r"`lampyris plan` on (\d+) x \d+, ([a-z ]+), under ([0-9.]+) s", claim)
    over = re.findall(r"([a-z0-9-]+) \((\d[0-9.]*) s\)", claim)
    if not found or not over:
        return ""
    size, most = found[1], float(found[3])
    when = "first" if "first" in found[2] else "again"
    coded, planned, started, rest = {}, {}, {}, []
    for who, took in over:
        task = f"plan, {who}, {size} x {size}, {when}"
        whole, planning, loading = (
            figures.get(key) for key in (f"{task} | numba", f"{task}, {PLANNING}", f"{task}, {LOADING}")
        )
        if not whole or not whole.theirs or not planning or not loading:
            return ""
        code, search = loading.ours.middle, planning.ours.middle
        left = whole.ours.middle - search - (code if when == "first" else 0.0)
        rest.append(left / whole.theirs.middle)
        if when == "first" and float(took) - code < most:
            coded[who] = (code, search)
            continue
        if float(took) - code - search >= most or search < (float(took) - code) / 4:
            started[who] = float(took) - code - search
            continue
        steps = figures.get(f"{task}, {EXPANSIONS}")
        if not steps or steps.ours.middle < 1:
            return ""  # that a search takes long forbids nothing as long as nobody says what it does
        planned[who] = (search, steps.ours.middle, 1e6 * search / steps.ours.middle)
    parts = []
    if coded:
        each = ", ".join(f"{who} {code:.2f}" for who, (code, _) in coded.items())
        parts.append(
            f"compiling: importing numba and making machine code takes {each} s, once for a machine (`lampyris warm` does it "
            f"beforehand); planning {_ends([search for _, search in coded.values()])} s"
        )
    if planned:
        each = ", ".join(
            f"{who} {search:.2f} s ({steps:,.0f} of {us:.1f} us)"
            for who, (search, steps, us) in planned.items()
        )
        parts.append(f"steps in sequence: planning takes {each}, expansions one after the other")
    if started:
        each = ", ".join(f"{who} {s:.2f}" for who, s in started.items())
        parts.append(f"starting: apart from planning and machine code {each} s")
    what = "planning and compiling" if when == "first" else "planning"
    numba = next(f.theirs.middle for f in figures.values() if f.rival == "numba" and f.theirs)
    if when == "again":
        parts.append(f"`import numba` alone takes {numba:.2f} s in the same run")
    restated = f"apart from {what} at most {TIMES_NUMBA:g} times as long as importing numba"
    return f"{'; '.join(parts)}. {_restated(restated, rest, most=TIMES_NUMBA)}"


def _states(claim: str, figures: Figures) -> str:
    """SIPP's search compared with the textbook's: how many states each expands, for ours looks for a cheap path, too."""
    least = _asked(claim, "at least")
    ours, theirs, many, few = [], [], [], []
    for f in figures.values():
        counted = figures.get(f"{f.task.replace('search alone', STATES)} | textbook")
        if f.rival != "textbook" or f.asked != least or not f.theirs or not counted or not counted.theirs:
            continue
        ours.append(1e6 * f.ours.middle / counted.ours.middle)
        theirs.append(1e6 * f.theirs.middle / counted.theirs.middle)
        many.append(counted.ours.middle)
        few.append(counted.theirs.middle)
    if not ours:
        return ""
    ratios = [b / a for a, b in zip(ours, theirs, strict=True)]
    restated = _restated(f"an expansion at least {least:g} times as quick", ratios, least=least, form=".1f")
    return (
        f"states in sequence: ours prefers the cheaper of states that are as early, so that its path is not needlessly long, "
        f"and expands {_ends(many, ',.0f')} one after the other, {_ends(ours, ',.0f')} ns each; the textbook's takes the first "
        f"path that it comes to, after {_ends(few, ',.0f')} of {_ends(theirs, ',.0f')} ns. {restated}"
    )


def _shortcuts(claim: str, figures: Figures) -> str:
    """Planners of poses compared with one that makes no shortcuts."""
    least = _asked(claim, "at least")
    over = re.findall(r"(?:^|, |: )([a-z0-9-]+), (lattice, weight 1.5, tolerance) \(", claim)
    pairs = [
        (
            figures.get(f"{name}, {who} | pathplanning Hybrid A*"),
            figures.get(f"{name}, {PLAIN} | pathplanning Hybrid A*"),
        )
        for name, who in over
    ]
    there = [(f, bare) for f, bare in pairs if f and bare and bare.ratio is not None]
    if not there or len(there) < claim.count(" ("):
        return ""
    ratios = [bare.ratio or 0.0 for _, bare in there]
    return (
        f"shortcuts: our answer has them, pathplanning's has none; they are "
        f"{_ends([f.ours.middle - bare.ours.middle for f, bare in there], '.1f')} ms of "
        f"{_ends([f.ours.middle for f, _ in there], '.1f')} ms. "
        f"{_restated(f'without shortcuts at least {least:g} times as good', ratios, least=least, form='.0f')}"
    )


def _samples(claim: str, figures: Figures) -> str:
    """RRT-Connect compared with OMPL's on each map: what a call costs, and samples one after the other."""
    least = _asked(claim, "at least")
    each = [f for f in figures.values() if f.asked == least and f.theirs and f.rival == "OMPL RRTConnect"]
    over = [f for f in each if f"{f.task} (" in claim]
    if not over:
        return ""
    calls, many = [], []
    for f in over:
        call, expanded = figures.get(f"{f.task}, {A_CALL}"), figures.get(f"{f.task}, {EXPANSIONS}")
        if not call or not expanded or not f.theirs:
            return ""
        (calls if call.ours.middle > f.theirs.middle / least else many).append((f, call, expanded))
    parts = []
    if calls:
        parts.append(
            f"what a call costs: with its ends side by side {_ends([c.ours.middle for _, c, _ in calls])} ms, of "
            f"{_ends([f.ours.middle for f, _, _ in calls])} ms, on {len(calls)} of these, where OMPL's trees need few samples "
            f"and {_ends([f.theirs.middle for f, _, _ in calls if f.theirs])} ms"
        )
    if many:
        ns = [1e3 * (f.ours.middle - c.ours.middle) / max(e.ours.middle, 1) for f, c, e in many]
        parts.append(
            f"steps in sequence: on {len(many)} a query takes {_ends([e.ours.middle for _, _, e in many], ',.0f')} expansions "
            f"one after the other, {_ends(ns, '.1f')} us each"
        )
    ratios = [f.ratio for f in each if f.ratio is not None]
    restated = _restated(f"on each at least {TIMES_ON_EACH:g} times as good", ratios, least=TIMES_ON_EACH)
    return f"{'; '.join(parts)}. {restated}"


def _as_long(claim: str, figures: Figures) -> str:
    """Lengths compared with AORRTC's: the same in as much time as it has; nothing where that does not suffice."""
    long = [f for f in figures.values() if "length of" in f.task and f.task.endswith("1.3 s") and f.ratio]
    short = [f for f in figures.values() if f.asked == 1.0 and f.ratio and f"{f.task} (" in claim]
    enough = {f.task.removesuffix("1.3 s") for f in long if f.ratio and f.ratio >= 1.0}
    if not short or not all(f.task.removesuffix("50 ms") in enough for f in short):
        return ""
    ratios, missed = [f.ratio or 0.0 for f in long], [100 * (1 / (f.ratio or 1.0) - 1) for f in short]
    restated = _restated(
        "in 1.3 s ours are at most as long as AORRTC's", [1 / r for r in ratios], most=1.0, form=".3f"
    )
    return f"time: ours has 50 ms, AORRTC 1.3 s, and its paths are {_ends(missed)} % shorter on these. {restated}"


NS_A_NODE = 1_000
"""Nanoseconds of a node of Polyanya where a query expands hundreds of them."""
TIMES_NUMBA = 2.0
"""Times as long as ``import numba`` that a run takes at most apart from planning, loading machine code included."""
_AFTER = f"the second run takes at most {TIMES_NUMBA:g} times as long as importing numba"
TIMES_ON_EACH = 2.0
"""Times as quick as OMPL's RRTConnect that is claimed of each map; ten times in the median is a claim of its own."""
WAITS = {"four-connected": 1, "dissertation": 2, "octile": 2, "sixteen-connected": 3}
"""Prices of a step, by moves."""
MOST_WITH_PROOF = 0.25
"""Of the states that lattice expands, what is claimed of pad where its proof takes most of its own."""
TIMES_THE_PATH = 1.5
"""Expansions of pad for each motion of its path that are claimed where the motions alone are too many, by medians of both."""
MOST_A_MOTION = 4.0
"""Expansions of pad for each motion of its path that are claimed in place of a share of lattice's."""

LIMITS = (
    *(
        Limit("field", begin, _in_sequence)
        for begin in ("compared with scikit-image", "compared with tcod", "compared with the best")
    ),
    Limit("field", "the whole field compared with cost alone", _bytes_written),
    Limit("field", "the whole field compared with C++", _native),
    Limit("weighted", "weighted cells compared with", _by_price),
    Limit("poses", "States that pad expands", _path_alone),
    *(Limit("pose_maps", robot, _of_the_path) for robot in ("1.2 x 0.5 m", "0.9 x 0.62 m", "disc of 0.3 m")),
    Limit("timed", "SIPP compared with textbook, 512 x 512, search alone", _states),
    Limit("pose_rivals", "Mean time of a query", _shortcuts),
    Limit("sampling", "The same on each", _samples),
    Limit("sampling", "Length compared with AORRTC's", _as_long),
    Limit("first", "`lampyris plan` on ", _starts),
    Limit("repair", "repair, ", _cold),
    Limit("repair", "D* Lite, ", _cold),
    Limit("calls", "Polyanya, median query", _nodes),
    Limit("memory", "a field of 4096 x 4096", _result),
    Limit("start", "`lampyris plan` on 316 x 316 under 0.5 s from the very first run", _compiling),
    Limit("start", "`lampyris plan` on 316 x 316 under 0.5 s from the second run", _importing),
    Limit("start", "`lampyris plan`, 4096 x 4096, nothing kept", _compiling_large),
    Limit("start", "`lampyris plan`, 4096 x 4096: ", _stages),
)

"""One query after another on one map: our searches compared with what people use today, on MovingAI's queries.

Whom they are held against is :mod:`benchmarks.query_rivals`; what is claimed is at the end of this file.
"""

from __future__ import annotations

import gc
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from benchmarks.about import versions
from benchmarks.figures import Figure, Section, Spread, Table, Verdict
from benchmarks.maps import maze, published_folder, published_map, random_map
from benchmarks.query_rivals import (
    ANY_ANGLE,
    OURS,
    RIVALS,
    SAME_RULES,
    WHOLE,
    WITH_FIELD,
    Contest,
)
from benchmarks.query_tables import (
    NAMES,
    NEAR,
    WAYS,
    Cell,
    Query,
    choice,
    made_queries,
    path_and_field,
    plain,
)
from benchmarks.turns import take_turns

from lampyris.io.maps.formats.movingai import read_scen
from lampyris.kernels._jit import prefer_compiled
from lampyris.model.moves import MOVES

TITLE = "Queries"
HOW = """The maps and queries are MovingAI's (N. Sturtevant, "Benchmarks for Grid-Based Pathfinding", IEEE
TCIAIG 4(2), 2012), where they are at hand; two more maps are made, on which jump point search is weak:
35 % clutter, and a maze with corridors one cell wide. A query is timed with its path, by this thread's
processor time; what is prepared once a map stands by itself. Queries are divided into blocks; the
implementations answer each block one after the other, so that each works with the caches that it has filled itself. Times are
geometric means over queries; the quartiles are of rounds. Every query is answered by {whole};
the others get a sample spread evenly over the lengths ({sample} queries a map), and are compared with jump
point search on that sample alone; the table states its size.

Ours:

{ours}

Theirs:

{theirs}

Every length by our rules, ours or theirs, is compared with the published one. Path and field:

{fields}

Each implementation is called in every round, and {whole} in equally many rounds. nano-astar is compared with three
calls of lampyris: the search alone, the public call in an open session (nano-astar's is a whole public call too; ours
keeps the packed map, which nano-astar has no way to keep), and a session opened anew for each query. How much
of nano-astar's call is laying out its lists is told by what it takes between two neighbouring cells.

python-motion-planning 1.1.1 (A* in plain Python; our rules) stands on small maps of its own, for a query of
the others takes it seconds. Timed is `plan()` alone; its planner, which makes a figure, is there.

Not run: programs in C++ that are published as source and not as packages, among them the jump point search of
its authors (warthog), the entries of the Grid-Based Path Planning Competition and Nav2's `navfn`. No copy of
them is part of this project, and this page is made by one command from packages alone; to compare
them with these numbers, build them by hand. Nothing on this page is said of them."""

QUICK = ("arena2", "random512-10-0", "maze512-32-0")
BLOCK = 100
SAMPLE = 32
ROUNDS = 2
"""Of everybody, one after another."""
SLOW = ("pathfinding",)
"""Gets a quarter of the sample."""
LEAST = {"nano-astar": 30.0, "w9-pathfinding": 20.0}
"""A public call of jump point search shall be so many times as quick, in geometric mean."""
ALL = "all published queries"


def bench(quick: bool) -> Section:
    """Every published query; then maps on which jump point search is weak; then choosing and fields."""
    prefer_compiled()
    figures: list[Figure] = []
    found = [_ask(ground, quick) for ground in _grounds(quick)]
    tables = [
        _times(found, figures),
        _calls(found, figures),
        _prepared(found, figures),
        choice(figures, quick),
        path_and_field(figures, quick),
        plain(figures, quick),
    ]
    how = HOW.format(
        sample=SAMPLE,
        whole=", ".join(WHOLE),
        ours=_list(OURS),
        theirs=_list(RIVALS),
        fields=_list(WITH_FIELD),
    )
    about = versions(["numpy", "numba", *RIVALS, "python-motion-planning"])
    return Section(
        "query", TITLE, how, tuple(tables), tuple(figures), tuple(_verdicts(found, figures)), about
    )


def _list(rules: dict[str, str]) -> str:
    return "\n".join(f"- {name}: {rule}" for name, rule in rules.items())


# ---- maps and queries --------------------


@dataclass(frozen=True, slots=True)
class Ground:
    """A map and its queries; ``known``: the lengths are published."""

    name: str
    free: np.ndarray
    queries: list[Query]
    known: bool


def _grounds(quick: bool) -> Iterator[Ground]:
    folder = published_folder()
    for name in QUICK if quick else NAMES:
        free = published_map(name)
        if free is not None and folder is not None:
            lines = read_scen(folder / f"{name}.map.scen")
            chosen = [lines[k] for k in spread_over(len(lines), 40 if quick else len(lines))]
            queries = [
                (q.start, q.goal, q.length, max(1e-5 * q.length, 0.5 * 10.0**-q.decimals)) for q in chosen
            ]
            yield Ground(name, free, queries, True)
    size, count = (256, 20) if quick else (512, 200)
    for name, free in (
        ("made: random 35 %", random_map(size, 0.35)),
        ("made: maze, corridor 1", maze(size)),
    ):
        yield Ground(f"{name}, {size}", free, made_queries(free, count, MOVES["octile"]), False)


def spread_over(many: int, count: int) -> list[int]:
    """At most ``count`` of ``many`` places, evenly spread from the first to the last."""
    return sorted({int(k) for k in np.linspace(0, many - 1, min(count, many))})


# ---- asking --------------------


@dataclass(slots=True)
class Found:
    """What came of one map: ns of every query by contestant (rounds x queries, nan: not asked)."""

    name: str
    known: bool
    cells: int
    contest: Contest
    packing_ms: float
    beside_us: float
    ns: dict[str, np.ndarray]
    wrong: list[str] = field(default_factory=list)
    checked: int = 0


def _ask(ground: Ground, quick: bool) -> Found:
    contest = Contest(ground.free)
    many = len(ground.queries)
    sample = spread_over(many, 4 if quick else SAMPLE)
    asked = {who: list(range(many)) for who in WHOLE}
    for who in (*OURS, *RIVALS):
        asked.setdefault(who, sample[::4] if who in SLOW else sample)
    ns = {who: np.full((1 if quick else ROUNDS, many), np.nan) for who in asked}
    found = Found(
        ground.name,
        ground.known,
        int(ground.free.sum()),
        contest,
        contest.packing_ms,
        _beside(contest, ground.free),
        ns,
    )
    for who in asked:
        contest.call(who, *ground.queries[sample[0]][:2])()  # compiled and imported
    gc.collect()
    gc.disable()
    try:
        for begin in range(0, many, BLOCK):
            _block(found, ground, {w: [k for k in a if begin <= k < begin + BLOCK] for w, a in asked.items()})
    finally:
        gc.enable()
    return found


def _beside(contest: Contest, free: np.ndarray) -> float:
    """Microseconds that nano-astar takes between two neighbouring cells, the middle of nine."""
    y, x = np.argwhere(free[:, 1:] & free[:, :-1])[0].tolist()
    call = contest.call("nano-astar", (x, y), (x + 1, y))
    return take_turns({"beside": call}, rounds=9, per=1e3)["beside"].middle


def _block(found: Found, ground: Ground, asked: dict[str, list[int]]) -> None:
    """Everybody's queries of one block, by turns; the first round is checked."""
    for turn in range(max(len(rows) for rows in found.ns.values())):
        for who, places in asked.items():
            if turn >= len(found.ns[who]):
                continue
            row = found.ns[who][turn]
            for k in places:
                start, goal, length, off = ground.queries[k]
                call = found.contest.call(who, start, goal)
                began = time.thread_time_ns()
                answer = call()
                row[k] = time.thread_time_ns() - began
                if turn == 0:
                    _check(found, who, answer, length, off, (start, goal))


def _check(found: Found, who: str, answer: Any, length: float, off: float, ends: tuple[Cell, Cell]) -> None:
    if who in SAME_RULES:
        mine = found.contest.length(who, answer)
        found.checked += 1
        if abs(mine - length) > off:
            found.wrong.append(f"{who}: {ends[0]} to {ends[1]} {mine!r}, not {length!r}")
    elif who in ANY_ANGLE and found.contest.length(who, answer) > length + off:
        found.wrong.append(f"{who}: {ends[0]} to {ends[1]} is longer than the walk")


def compared(found: Sequence[Found], who: str, rival: str) -> tuple[Spread, Spread, int]:
    """Microseconds of both, a geometric mean each round, over the queries that both got; and how many."""
    logs: tuple[list[np.ndarray], list[np.ndarray]] = ([], [])
    count = 0
    for one in found:
        both = ~np.isnan(one.ns[who][0]) & ~np.isnan(one.ns[rival][0])
        count += int(both.sum())
        for kept, name in zip(logs, (who, rival), strict=True):
            kept.append(np.log(one.ns[name][:, both] / 1e3))
    ours, theirs = (Spread.of(np.exp(np.concatenate(kept, axis=1).mean(axis=1)).tolist()) for kept in logs)
    return ours, theirs, count


def _times(found: list[Found], figures: list[Figure]) -> Table:
    known = [one for one in found if one.known]
    rows = []
    groups = [(one.name, [one]) for one in found]
    if known:
        groups.append((ALL, known))
    for name, several in groups:
        ours, _, count = compared(several, "jps", "jps")
        row = [name, f"{count:,}", _text(ours)]
        for who in (*OURS, *RIVALS):
            if who == "jps":
                continue
            mine, theirs, both = compared(several, "jps", who)
            figures.append(Figure(f"query, {name}", "us a query", mine, who, theirs))
            told = f"{theirs.middle:.3g} = {theirs.middle / mine.middle:.3g} x"
            row.append(told if both == count else f"{told} (of {both:,})")
        rows.append(tuple(row))
    heads = ("map", "queries", "jps, us", *(who for who in (*OURS, *RIVALS) if who != "jps"))
    title = "A query: geometric mean, and how many times as long as jump point search (the search alone)"
    return Table(heads, tuple(rows), title)


def _calls(found: list[Found], figures: list[Figure]) -> Table:
    """Those who follow our rules, compared with each way to ask jump point search."""
    known = [one for one in found if one.known]
    rows = []
    for name, several in [*((one.name, [one]) for one in found), *([(ALL, known)] if known else [])]:
        for rival, least in LEAST.items():
            row, us = [name, rival], ""
            for way, said in WAYS.items():
                mine, theirs, count = compared(several, way, rival)
                # What is claimed is of the same kind of call on both sides.
                asked = least if several is known and way == "jps call" else None
                figure = Figure(
                    f"query by {said}, {name}", "us a query", mine, rival, theirs, asked=asked,
                )  # fmt: skip
                figures.append(figure)
                row.append(f"{mine.middle:.3g}: {figure.ratio:.3g} x")
                us = f"{theirs.middle:.4g}"
            beside = f"{several[0].beside_us:.0f}" if rival == "nano-astar" and len(several) == 1 else ""
            rows.append((*row[:2], f"{count:,}", us, *row[2:], beside))
    heads = ("map", "rival", "queries", "rival, us", *(f"{said}, us" for said in WAYS.values()))
    title = "The same rules: geometric means, and how many times as long the rival takes"
    return Table((*heads, "rival between neighbours, us"), tuple(rows), title)


def _prepared(found: list[Found], figures: list[Figure]) -> Table:
    rows = []
    who = ("jps", "astar", "fastest", *RIVALS)
    for one in found:
        figures.append(Figure(f"packing, {one.name}", "ms a map", Spread.of([one.packing_ms])))
        ms = one.contest.made_ms
        rows.append(
            (one.name, f"{one.cells:,}", f"{one.packing_ms:.2f}", *(f"{ms[name]:.2f}" for name in who))
        )
    heads = ("map", "free cells", "packing bits alone", *who)
    return Table(heads, tuple(rows), "What is prepared once a map, ms")


# ---- claims --------------------


def _verdicts(found: list[Found], figures: list[Figure]) -> list[Verdict]:
    wrong = [f"{one.name}: {w}" for one in found for w in one.wrong]
    queries = sum(one.ns["jps"].shape[1] for one in found if one.known)
    told = f"{len(wrong)} wrong lengths in {sum(one.checked for one in found):,} answers"
    told += f" ({queries:,} published queries)"
    out = [Verdict(not wrong, "; ".join([told, *wrong[:5]]))]
    known = [one for one in found if one.known]
    for f in figures:
        if f.asked is None or f.ratio is None or f.rival not in LEAST:
            continue
        maps = [compared([one], "jps call", f.rival) for one in known]
        count = sum(many for _, _, many in maps)
        each = [theirs.middle / ours.middle for ours, theirs, _ in maps]
        alone, anew = (
            g.ratio for way in ("jps", "jps anew") for g in figures
            if g.task == f"query by {WAYS[way]}, {ALL}" and g.rival == f.rival and g.ratio
        )  # fmt: skip
        text = (
            f"a public call of the planner `jps`, its session open, at least {f.asked:g} times as quick as "
        )
        text += f"{f.rival}'s, in geometric mean over {count:,} of the published queries: {f.ratio:.1f} "
        text += f"({min(each):.1f} to {max(each):.1f} by map); the search alone {alone:.1f}, "
        text += f"a session opened anew for each {anew:.1f}"
        out.append(Verdict(bool(f.holds), text))
    if not any(one.known for one in found):
        out.append(Verdict(False, "MovingAI's maps are not at hand: nothing is said of published queries"))
    shares = {f.task: 1 / f.ratio for f in figures if f.task.startswith("choice, ") and f.ratio}
    over = [
        f"{task.removeprefix('choice, ')} ({share:.2f})" for task, share in shares.items() if share > NEAR
    ]
    text = f"`fastest` takes at most {NEAR:g} times the best of jump points, A* and field to the start, "
    text += f"in mean time: at most {max(shares.values()):.2f}, on {len(shares) - len(over)} of {len(shares)}"
    out.append(Verdict(not over, text + (f"; more on {', '.join(over)}" if over else "")))
    return out


def _text(s: Spread) -> str:
    return f"{s.middle:.1f} ({s.low:.1f} to {s.high:.1f})"

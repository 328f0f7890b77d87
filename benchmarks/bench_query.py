"""One query after another on one map: our searches beside what people use today, on MovingAI's queries.

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
    length_of,
    with_field,
)
from benchmarks.turns import take_turns

from lampyris.kernels._jit import prefer_compiled
from lampyris.maps.movingai import read_scen
from lampyris.model.moves import MOVES, Moves
from lampyris.planners._fastest import FieldSearch, suited
from lampyris.planners._graph import GridSearch
from lampyris.planners._jps import JumpSearch

TITLE = "Queries"
HOW = """The maps and queries are MovingAI's (N. Sturtevant, "Benchmarks for Grid-Based Pathfinding", IEEE
TCIAIG 4(2), 2012), where they are at hand; two maps besides are made, on which jump point search is weak:
35 % clutter, and a maze with corridors one cell wide. A query is timed with its path, by this thread's
processor time; what is prepared once a map stands by itself. Queries go by blocks, and through each block
everybody goes by turns, so that each works with the caches that it has filled itself. Times are geometric
means over queries; the quartiles are of rounds. Every query is asked of {whole};
the others get a sample spread evenly over the lengths, and are held against jump point search on that sample.

Ours:

{ours}

Theirs:

{theirs}

Every length by our rules, ours or theirs, is compared with the published one. Path and field:

{fields}

Not run: the C++ jump point search of its authors (warthog), the entries of the Grid-Based Path Planning
Competition and Nav2's `navfn` are programs to be built from source, not packages, and this page is made from
packages alone; python-motion-planning asks for gymnasium, faiss, pyvista and Qt before it can be imported."""

NAMES = (
    "arena2", "AR0011SR", "Berlin_0_256", "16room_000", "ht_0_hightown", "maze512-32-0", "random512-10-0",
)  # fmt: skip
QUICK = ("arena2", "random512-10-0", "maze512-32-0")
BLOCK = 100
ROUNDS = {"jps": 3, "fastest": 3, "astar": 2, "field": 2, "nano-astar": 1}
SLOW = ("pathfinding",)
"""Gets a quarter of the sample."""
LEAST = {"nano-astar": 30.0, "w9-pathfinding": 20.0}
"""Jump point search shall be so many times as quick, in geometric mean over the published queries."""
ALL = "all published queries"
NEAR = 1.3
"""And `fastest` shall take at most so many times the time of the best search for the map."""

Cell = tuple[int, int]
Query = tuple[Cell, Cell, float, float]
"""Start, goal, length, and how far off the length may be."""


def bench(quick: bool) -> Section:
    """Every published query; then maps on which jump point search is weak; then choosing and fields."""
    prefer_compiled()
    figures: list[Figure] = []
    found = [_ask(ground, quick) for ground in _grounds(quick)]
    tables = [
        _times(found, figures),
        _prepared(found, figures),
        _choice(figures, quick),
        _path_and_field(figures, quick),
    ]
    how = HOW.format(whole=", ".join(WHOLE), ours=_list(OURS), theirs=_list(RIVALS), fields=_list(WITH_FIELD))
    about = versions(["numpy", "numba", *RIVALS])
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


def made_queries(free: np.ndarray, count: int, moves: Moves) -> list[Query]:
    """``count`` queries between random cells of a map that can reach each other; lengths by our own A*."""
    rng = np.random.default_rng(free.shape[0])
    search = GridSearch(free, moves, informed=True)
    cells = np.argwhere(free)
    queries: list[Query] = []
    while len(queries) < count:
        (sy, sx), (gy, gx) = cells[rng.integers(len(cells), size=2)].tolist()
        answer = search.way((sx, sy), (gx, gy))
        if answer.cells is not None:
            queries.append(((sx, sy), (gx, gy), length_of(answer.cells), 1e-6))
    return queries


# ---- asking --------------------


@dataclass(slots=True)
class Found:
    """What came of one map: ns of every query by contestant (rounds x queries, nan: not asked)."""

    name: str
    known: bool
    cells: int
    contest: Contest
    packing_ms: float
    ns: dict[str, np.ndarray]
    wrong: list[str] = field(default_factory=list)
    checked: int = 0


def _ask(ground: Ground, quick: bool) -> Found:
    contest = Contest(ground.free)
    many = len(ground.queries)
    sample = spread_over(many, 4 if quick else 32)
    asked = {who: list(range(many)) for who in WHOLE}
    for who in (*OURS, *RIVALS):
        asked.setdefault(who, sample[::4] if who in SLOW else sample)
    rounds = {who: (1 if quick else ROUNDS.get(who, 2)) for who in asked}
    ns = {who: np.full((n, many), np.nan) for who, n in rounds.items()}
    found = Found(ground.name, ground.known, int(ground.free.sum()), contest, contest.packing_ms, ns)
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
            mine, theirs, _ = compared(several, "jps", who)
            asked = LEAST.get(who) if several is known else None
            figures.append(Figure(f"query, {name}", "us a query", mine, who, theirs, asked=asked))
            row.append(f"{theirs.middle:.3g} = {theirs.middle / mine.middle:.3g} x")
        rows.append(tuple(row))
    heads = ("map", "queries", "jps, us", *(who for who in (*OURS, *RIVALS) if who != "jps"))
    return Table(
        heads, tuple(rows), "A query: geometric mean, and how many times as long as jump point search"
    )


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


# ---- choosing --------------------


def _choice(figures: list[Figure], quick: bool) -> Table:
    """Does `fastest` choose well? Mean times, for a mean is what a day of queries takes."""
    rows = []
    size = 256 if quick else 512
    for title, free in _kinds(size, quick):
        for kind in ("octile", "dissertation"):
            moves = MOVES[kind]
            jumps = JumpSearch(free, moves)
            searches = {
                "jps": jumps,
                "astar": GridSearch(free, moves, informed=True),
                "field": FieldSearch(free, moves, jumps),
                "fastest": suited(free, None, moves),
            }
            ends = [q[:2] for q in made_queries(free, 10 if quick else 40, moves)]

            def over(search: Any, ends: Any = ends) -> Any:
                return lambda: [search.way(*pair) for pair in ends]

            times = take_turns(
                {name: over(search) for name, search in searches.items()},
                rounds=3 if quick else 5,
                per=1e3 * len(ends),
            )
            best = min(("jps", "astar", "field"), key=lambda name: times[name].middle)
            figure = Figure(
                f"choice, {title}, {kind}", "us a query", times["fastest"], "the best search for the map",
                times[best], asked=1 / NEAR,
            )  # fmt: skip
            figures.append(figure)
            assert figure.ratio is not None
            mean = (f"{times[name].middle:.0f}" for name in ("jps", "astar", "field"))
            rows.append(
                (title, kind, *mean, f"{times['fastest'].middle:.0f}", best, f"{1 / figure.ratio:.2f}")
            )
    heads = ("map", "moves", "jps", "astar", "field to the start", "fastest", "best", "fastest / best")
    return Table(heads, tuple(rows), "What `fastest` chooses: mean us a query between random cells")


def _kinds(size: int, quick: bool) -> Iterator[tuple[str, np.ndarray]]:
    for share in (10, 40) if quick else (0, 10, 20, 30, 35, 40):
        yield f"{size} random {share} %", random_map(size, share / 100)
    yield f"{size} maze, corridor 1", maze(size)
    if not quick:
        yield f"{size} maze, branching", maze(size, 1 / 3)
        for name in NAMES:
            free = published_map(name)
            if free is not None:
                yield name, free


# ---- path and field --------------------


def _path_and_field(figures: list[Figure], quick: bool) -> Table:
    """The path of one query with the costs of every cell: what is wanted where the robot may stray."""
    rows = []
    several: list[tuple[str, np.ndarray]] = [("512 random 10 %", random_map(512, 0.1))]
    if not quick:
        several += [(name, free) for name in NAMES if (free := published_map(name)) is not None]
        several.append(("512 maze, corridor 1", maze(512)))
    for title, free in several:
        free.setflags(write=False)
        ends = [q[:2] for q in made_queries(free, 2 if quick else 6, MOVES["octile"])]
        ways = with_field(free)
        calls = {
            name: (lambda way=way, pairs=ends: [way(*pair) for pair in pairs]) for name, way in ways.items()
        }
        for ours, theirs in zip(calls["lampyris"](), calls["scipy"](), strict=True):
            assert ours is not None
            assert len(ours) > 1
            assert len(theirs) > 1
        times = take_turns(calls, rounds=2 if quick else 3, per=1e6 * len(ends))
        row = [title, f"{times['lampyris'].middle:.2f}"]
        for name in list(ways)[1:]:
            figure = Figure(f"path and field, {title}", "ms a query", times["lampyris"], name, times[name])
            figures.append(figure)
            row.append(f"{times[name].middle:.1f} = {figure.ratio:.1f} x")
        rows.append(tuple(row))
    return Table(("map", "ours, ms", *list(WITH_FIELD)[1:]), tuple(rows), "Path and field, octile moves")


# ---- claims --------------------


def _verdicts(found: list[Found], figures: list[Figure]) -> list[Verdict]:
    wrong = [f"{one.name}: {w}" for one in found for w in one.wrong]
    queries = sum(one.ns["jps"].shape[1] for one in found if one.known)
    told = f"{len(wrong)} wrong lengths in {sum(one.checked for one in found):,} answers"
    told += f" ({queries:,} published queries)"
    out = [Verdict(not wrong, "; ".join([told, *wrong[:5]]))]
    for f in figures:
        if f.task == f"query, {ALL}" and f.asked is not None and f.ratio is not None:
            maps = {f"query, {one.name}" for one in found if one.known}
            each = [g.ratio for g in figures if g.rival == f.rival and g.task in maps and g.ratio]
            text = (
                f"jump point search at least {f.asked:g} times as quick as {f.rival} in geometric mean over "
            )
            text += f"the published queries: {f.ratio:.1f} ({min(each):.1f} to {max(each):.1f} by map)"
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

"""The field (cost, parents, luciferin) compared with what people use today, and compared with the same loop in C++.

Whom it is held against is :mod:`benchmarks.field_rivals`; stages, C++ and the memory floor are
:mod:`benchmarks.field_stages`; what is claimed is at the end of this file.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from functools import partial

import numpy as np
from benchmarks.about import compiler, versions
from benchmarks.field_rivals import RULES, SLOW, check, contestants
from benchmarks.field_stages import HEADS, stages, text
from benchmarks.figures import Figure, Section, Table, Verdict, judge, judge_cost
from benchmarks.maps import maze, middle, published_map, random_map, rooms
from benchmarks.turns import Call, take_turns

from lampyris._core.system import processors
from lampyris.kernels._jit import prefer_compiled
from lampyris.model.moves import MOVES
from lampyris.planning.field.many import solve_many
from lampyris.planning.field.solve import solve

TITLE = "Fields"
HOW = """Cost, parents and luciferin of every cell that can reach a goal in the middle, by the whole public
call `lampyris.planning.field.solve.solve`, allocation and all, code compiled. Nanoseconds of this thread's processor
time for each cell reached; each implementation is called once a round. The other libraries compute less than that (parents would
cost most of them more):

{rules}

All answers are compared before the timing: scipy's costs with ours; tcod's with ours by 10 and
14; scikit-image's and dijkstra3d's with ours by octile moves that cut corners; graphs' with ours.

Stages are the same call of ours with passes left out: "cost alone" allocates all three maps and fills the
first. "C++" is the same loops by the compiler of this machine (`benchmarks/wavefront.cpp`), arrays made
beforehand, equal to ours to the last bit: at -O3 for any processor of its kind, and with -march=native for
this one, as numba compiles. "Floor" writes as many bytes as the answer has, once. All are called alternately.

Small maps are many different ones: one map again and again trains the processor's predictions and flatters
code that branches. Mazes have corridors one cell wide: in the perfect one they are as long as can be and the
front is a cell or two wide; the branching one has as many junctions as published mazes; above 1024 it is the
one of 1024 again and again, joined."""

ASKED = {"scikit-image": 25.0, "tcod": 18.0}
"""Times as quick, by dissertation moves on every map of 512 x 512 cells and more."""
BEST_RANDOM, BEST_MAZE = 12.0, 8.0
"""Times as quick as the best of the other libraries."""
HUGE = {"best": 10.0, "scikit-image": 30.0}
"""The same on 4096 x 4096 at 10 %."""
FLAT = 2.0
KINDS = ("four-connected", "dissertation", "octile", "sixteen-connected")
SIZES = (50, 128, 256, 512, 1024, 2048, 4096)
MOST_EDGES = 1024
"""The largest map that a graph is made of, but for the one that is claimed of: it takes gigabytes."""
BEST = "the quickest of them"
Maps = Iterator[tuple[str, np.ndarray]]


def bench(quick: bool) -> Section:
    """Every map and step set; claims are judged on maps of 512 x 512 cells and more."""
    prefer_compiled()
    figures: list[Figure] = []
    tables = [
        _beside_rivals(figures, quick),
        _sizes(figures, quick),
        *_stages(figures, quick),
        _slow_rivals(figures, quick),
        _many(figures, quick),
    ]
    figures += _flat(figures)
    keys = [f.key for f in figures]
    assert len(set(keys)) == len(keys), f"figures of one name: {sorted(k for k in keys if keys.count(k) > 1)}"
    rules = "\n".join(f"- {name}: {rule}" for name, rule in RULES.items())
    about = versions(["numpy", "numba", *RULES]) | {"compiler": compiler() or "none"}
    told = tuple(verdicts(figures))
    return Section("field", TITLE, HOW.format(rules=rules), tuple(tables), tuple(figures), told, about)


def maps_of(size: int, quick: bool) -> Maps:
    """Names and free cells of the kinds of map at one size, read-only."""
    yield f"{size} open", _kept(random_map(size, 0.0))
    for share in (30,) if quick else (10, 20, 30):
        yield f"{size} random {share} %", _kept(random_map(size, share / 100))
    yield f"{size} maze, branching", _kept(maze(size, 1 / 3))
    if not quick:
        yield f"{size} rooms of 15", _kept(rooms(size))
        yield f"{size} maze, perfect", _kept(maze(size))


def published_maps() -> Maps:
    """Game, city and corridor maps, where they are at hand."""
    for name in ("AR0011SR", "ht_0_hightown", "Berlin_0_256", "maze512-32-0"):
        free = published_map(name)
        if free is not None:
            yield name, _kept(free)


def some_of(size: int, quick: bool) -> Iterator[tuple[str, list[np.ndarray]]]:
    """Open, random and maze maps of one size, several different ones of a small size."""
    several = max(1, 100 * 50 * 50 // (size * size))
    rng = np.random.default_rng(size)
    # An open map is the same whatever is drawn.
    yield f"{size} open", [_kept(random_map(size, 0.0))] * several
    for share in (10,) if quick else (10, 30):
        if several > 1:
            frees = [rng.random((size, size)) >= share / 100 for _ in range(several)]
        else:
            frees = [random_map(size, share / 100)]
        yield f"{size} random {share} %", [_kept(free) for free in frees]
    if not quick:
        yield f"{size} maze, branching", [_kept(joined_mazes(size, k)) for k in range(several)]


def joined_mazes(size: int, number: int = 0) -> np.ndarray:
    """A branching maze; large ones are joined of one of 1024 x 1024, without a circle.

    ``number`` tells small mazes of one size apart: 32 of them, four turned and mirrored.
    """
    if size <= 1024:
        free = np.rot90(maze(size, (1 + number // 8 % 4) / 6), number % 4)
        return np.ascontiguousarray(free[::-1] if number % 8 > 3 else free)
    free = np.tile(maze(1024, 1 / 3), (size // 1024, size // 1024))
    for seam in range(1024, size, 1024):
        free[1::1024, seam - 2 : seam + 1] = True
        free[seam - 2 : seam + 1, 1] = True
    return free


def _kept(free: np.ndarray) -> np.ndarray:
    free.setflags(write=False)
    return free


# ---- beside rivals ----


def _beside_rivals(figures: list[Figure], quick: bool) -> Table:
    names = [n for n in RULES if n not in SLOW]
    rows = []
    for title, free in maps_of(512, quick):
        some = ("dissertation", "octile") if quick else KINDS
        rows += [_row(title, [free], kind, names, figures, 3 if quick else 7) for kind in some]
    if not quick:
        for title, free in published_maps():
            rows += [_row(title, [free], kind, names, figures, 7) for kind in KINDS]
        rows += [
            _row(title, [free], "dissertation", names, figures, 5) for title, free in maps_of(1024, quick)
        ]
    return Table(("map", "moves", "ours, ns a cell", *names), tuple(rows), "Compared with other libraries")


def _sizes(figures: list[Figure], quick: bool) -> Table:
    """From 50 x 50 to 4096 x 4096."""
    names = [n for n in RULES if n not in SLOW]
    rows = []
    for size in (50,) if quick else tuple(s for s in SIZES if s not in (512, 1024)):
        rounds = 2 if size == 4096 else 3 if size == 2048 or quick else 5
        for title, frees in some_of(size, quick):
            rows.append(_row(title, frees, "dissertation", names, figures, rounds))
    heads = ("map", "moves", "ours, ns a cell", *names)
    return Table(heads, tuple(rows), "From small to large (512 and 1024 are above)")


def _row(
    title: str,
    frees: Sequence[np.ndarray],
    kind: str,
    names: Sequence[str],
    figures: list[Figure],
    rounds: int,
) -> tuple[str, ...]:
    """One row, its figures, and all answers compared."""
    moves, size = MOVES[kind], len(frees[0])
    each, cells = [], 0
    for free in frees:
        calls = contestants(free, moves, middle(free), without=left_out(title, size))
        cells += check(free, moves, middle(free), calls)
        each.append(calls)
    calls = each[0] if len(each) == 1 else {name: _over([c[name] for c in each]) for name in each[0]}
    times = take_turns(calls, rounds=rounds, per=cells, warm=size < 2048)
    task, judged = f"{title}, {kind}", kind == "dissertation" and size >= 512
    asked: dict[str, float] = dict(ASKED) if judged and size <= 1024 else {}
    if task == "4096 random 10 %, dissertation":
        asked = {"scikit-image": HUGE["scikit-image"]}
    row = [title, kind, text(times["lampyris"])]
    found = []
    for name in names:
        theirs = times.get(name)
        figure = Figure(task, "ns a cell", times["lampyris"], name, theirs, asked=asked.get(name))
        found += [figure] if theirs else []
        row.append(f"{theirs.middle:.0f} = {figure.ratio:.1f} x" if theirs else "")
    figures += found
    if judged:
        best = min(found, key=lambda f: f.ratio or 0.0)
        told = f"the quickest is {best.rival}"
        figures.append(
            Figure(task, "ns a cell", best.ours, BEST, best.theirs, asked=_least(title), note=told)
        )
    return tuple(row)


def left_out(title: str, size: int) -> set[str]:
    """Who is not asked on a map: those too slow, and graphs where they would not fit."""
    return {*SLOW, "scipy"} if size > MOST_EDGES and not title.endswith("random 10 %") else {*SLOW}


def _over(calls: Sequence[Call]) -> Callable[[], None]:
    def run() -> None:
        for call in calls:
            call()

    return run


def _least(title: str) -> float | None:
    """How many times as quick as the best of the other libraries is claimed of a map."""
    size, _, what = title.partition(" ")
    if size == "4096":
        return HUGE["best"] if what == "random 10 %" else None
    if size not in ("512", "1024"):
        return None
    return BEST_MAZE if "maze" in what else BEST_RANDOM if "random" in what or what == "open" else None


# ---- stages, C++, the floor ----


def _stages(figures: list[Figure], quick: bool) -> list[Table]:
    tables = []
    kinds = [(m, KINDS) for m in maps_of(512, quick)]
    if not quick:
        kinds += [(m, KINDS) for m in published_maps()]
        kinds += [(m, ("dissertation",)) for m in maps_of(1024, quick)]
    rows = []
    for (title, free), several in kinds:
        for kind in several:
            judged = len(free) >= 512
            row, found = stages(title, [free], MOVES[kind], [middle(free)], 3 if quick else 9, judged=judged)
            rows.append(row)
            figures += found
    tables.append(Table(HEADS, tuple(rows), "Stages, C++ and the memory floor, ns a cell"))
    rows = []
    for size in (50,) if quick else tuple(s for s in SIZES if s not in (512,)):
        rounds = 2 if size == 4096 else 3 if quick or size == 2048 else 7
        for title, frees in some_of(size, quick):
            for kind in KINDS:
                if size == 1024 and kind == "dissertation":
                    continue
                goals = [middle(free) for free in frees]
                judged = size == 1024 or title == "4096 random 10 %"
                row, found = stages(title, frees, MOVES[kind], goals, rounds, judged=judged)
                rows.append(row)
                figures += found
    tables.append(Table(HEADS, tuple(rows), "The same from small to large, what is not above"))
    return tables


# ---- slow libraries; many goals ----


def _slow_rivals(figures: list[Figure], quick: bool) -> Table:
    """Libraries of graphs in Python or with Python callbacks: on one map."""
    size = 128 if quick else 512
    free = _kept(random_map(size, 0.1))
    moves, goal = MOVES["octile"], middle(free)
    calls = contestants(free, moves, goal, without=())
    cells = check(free, moves, goal, calls)
    clean = {"pathfinding": calls["pathfinding"].clean}  # type: ignore[attr-defined]
    some = {name: calls[name] for name in ("lampyris", *SLOW)}
    times = take_turns(some, rounds=3, per=cells, before=clean, warm=False)
    rows = []
    for name in SLOW:
        task = f"graphs, {size} random 10 %, octile"
        figure = Figure(task, "ns a cell", times["lampyris"], name, times[name])
        figures.append(figure)
        rows.append((name, text(times[name]), f"{figure.ratio:.0f} x", RULES[name]))
    heads = ("library", "ns a cell", "ours is quicker by", "")
    return Table(heads, tuple(rows), f"Graph libraries, {size} x {size}")


def _many(figures: list[Figure], quick: bool) -> Table:
    """Many goals on one map, by the clock: one after the other, and several at a time."""
    rows = []
    moves, workers = MOVES["dissertation"], processors()
    for size, count in ((128, 64),) if quick else ((50, 400), (128, 128), (512, 32), (1024, 12)):
        free = _kept(random_map(size, 0.1))
        ys, xs = np.nonzero(free)
        pick = np.random.default_rng(size).choice(len(xs), count)
        goals = [(int(xs[k]), int(ys[k])) for k in pick]
        one = [partial(solve, free, moves, goal) for goal in goals]
        for call, field in zip(one, solve_many(free, moves, goals, workers=workers), strict=True):
            alone = call()
            for name in ("exact", "step", "luciferin"):
                np.testing.assert_array_equal(getattr(field, name), getattr(alone, name))
        calls = {
            "one": _over(one),
            "many": lambda f=free, g=goals: list(solve_many(f, moves, g, workers=workers)),
        }
        times = take_turns(calls, rounds=5, per=count, clock=time.perf_counter_ns)
        ours, theirs = (times[name].rate(1e9) for name in ("many", "one"))
        figure = Figure(
            f"many goals, {size}", "fields a second", ours, "one after the other", theirs, more_is_better=True
        )
        figures.append(figure)
        gain = f"{figure.ratio:.2f} x"
        rows.append((f"{size} x {size}", f"{theirs.middle:,.0f}", f"{ours.middle:,.0f}", gain))
    heads = ("size", "one after the other, fields a second", f"{workers} threads", "gain")
    return Table(heads, tuple(rows), "Many goals (`lampyris.planning.field.many.solve_many`), by the clock")


# ---- what is claimed ----


def _flat(figures: Sequence[Figure]) -> list[Figure]:
    """The slowest compared with the quickest, from open to 30 % clutter, of each size that is judged."""
    out = []
    for size in (512, 1024):
        mine = {
            f.task: f.ours
            for f in figures
            if f.rival == BEST and f.task.startswith((f"{size} open", f"{size} random"))
        }
        if mine:
            slow, quick = (pick(mine, key=lambda task: mine[task].middle) for pick in (max, min))
            note = f"slowest: {slow}; quickest: {quick}"
            asked = 1 / FLAT
            out.append(
                Figure(
                    f"flat, {size}",
                    "ns a cell",
                    mine[slow],
                    "open to 30 %",
                    mine[quick],
                    asked=asked,
                    note=note,
                )
            )
    return out


def verdicts(figures: Sequence[Figure]) -> list[Verdict]:
    """What is claimed of fields, judged: of figures that ask, by whom they are compared with and what they ask."""
    asking = [f for f in figures if f.asked]
    moves = "every map, dissertation moves"
    claims: list[tuple[str, list[Figure]]] = [
        (f"compared with {name}, {moves}", [f for f in asking if f.rival == name and f.asked == least])
        for name, least in ASKED.items()
    ]
    for what, least in (("random and open maps", BEST_RANDOM), ("mazes", BEST_MAZE)):
        of_best = [f for f in asking if f.rival == BEST and f.asked == least]
        claims.append((f"compared with the best of the other libraries, {what}, dissertation moves", of_best))
    huge = [f for f in asking if f.task.startswith("4096 ")]
    claims += [
        (f"compared with {'the best of the other libraries' if f.rival == BEST else f.rival}, {f.task}", [f])
        for f in huge
    ]
    out = [judge(what, several) for what, several in claims if several]
    for rival in ("C++ -O3", "C++ -O3 -march=native", "cost alone"):
        for kind in KINDS:
            several = [f for f in asking if f.rival == rival and f.task.endswith(f", {kind}")]
            if several:
                out.append(judge_cost(f"the whole field compared with {rival}, {kind} moves", several))
    flat = [f for f in asking if f.task.startswith("flat, ")]
    return [*out, judge_cost("flat from open to 30 % clutter, the slowest compared with the quickest", flat)]

"""The field (cost, parents, luciferin) beside what people use today, and beside the same loop in C++.

Whom it is held against is :mod:`benchmarks.field_rivals`; what is claimed is at the end of this file.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from benchmarks.about import compiler, versions
from benchmarks.field_rivals import RULES, SLOW, check, contestants
from benchmarks.figures import Figure, Section, Spread, Table, Verdict
from benchmarks.maps import maze, middle, published_map, random_map, rooms
from benchmarks.native import Native, build
from benchmarks.turns import take_turns

from lampyris.field.many import solve_many
from lampyris.field.solve import solve
from lampyris.model.moves import MOVES, Moves
from lampyris.processors import processors

TITLE = "Fields"
HOW = """Cost, parents and luciferin of every cell that can reach a goal in the middle, by the whole public
call `lampyris.field.solve.solve`, allocation and all, code compiled. Nanoseconds of this thread's processor
time for each cell reached. The rivals give costs alone (parents would cost them more):

{rules}

On every map our costs are compared with scipy's, and with tcod's where the rules are the same. "C++" is the
same loop by the compiler of this machine at -O3 (`benchmarks/wavefront.cpp`), arrays made beforehand, equal
to ours to the last bit; "floor" writes every result once and does nothing else. Mazes have corridors one cell
wide: in the perfect one they are as long as can be and the front is a cell or two wide; the branching one has
as many junctions as published mazes."""

KINDS = ("four", "dissertation", "octile", "sixteen")
Maps = Iterator[tuple[str, np.ndarray]]


def bench(quick: bool) -> Section:
    """Every map and step set; claims are judged on maps of 512 x 512 cells and more."""
    figures: list[Figure] = []
    tables = [
        _beside_rivals(figures, quick),
        _sizes(figures, quick),
        _beside_cpp(figures, quick),
        _slow_rivals(figures, quick),
        _many(figures, quick),
    ]
    rules = "\n".join(f"- {name}: {rule}" for name, rule in RULES.items())
    about = versions(["numpy", "numba", *RULES]) | {"compiler": compiler() or "none"}
    return Section(
        "field",
        TITLE,
        HOW.format(rules=rules),
        tuple(tables),
        tuple(figures),
        tuple(verdicts(figures)),
        about,
    )


def maps_of(size: int, quick: bool) -> Maps:
    """Names and free cells of the kinds of map at one size."""
    yield f"{size} open", random_map(size, 0.0)
    for share in (30,) if quick else (10, 20, 30):
        yield f"{size} random {share} %", random_map(size, share / 100)
    if not quick:
        yield f"{size} rooms of 15", rooms(size)
    yield f"{size} maze, branching", maze(size, 1 / 3)
    yield f"{size} maze, perfect", maze(size)


def published_maps() -> Maps:
    """Game, city and corridor maps, where they are at hand."""
    for name in ("AR0011SR", "ht_0_hightown", "Berlin_0_256", "maze512-32-0"):
        free = published_map(name)
        if free is not None:
            yield name, free


def _all_maps(quick: bool) -> Maps:
    for size in (512,) if quick else (512, 1024):
        yield from maps_of(size, quick)
    if not quick:
        yield from published_maps()


def _beside_rivals(figures: list[Figure], quick: bool) -> Table:
    rows = []
    names = [n for n in RULES if n not in SLOW]
    for title, free in _all_maps(quick):
        free.setflags(write=False)
        goal = middle(free)
        for kind in ("dissertation", "octile") if quick else KINDS:
            moves = MOVES[kind]
            calls = contestants(free, moves, goal)
            cells = check(free, moves, goal, calls)
            rounds = 3 if quick else 5 if free.size > 512 * 512 else 7
            times = take_turns(calls, rounds=rounds, per=cells, often={"lampyris": 3})
            row = [title, kind, _text(times["lampyris"])]
            for name in names:
                theirs = times.get(name)
                figure = Figure(f"{title}, {kind}", "ns a cell", times["lampyris"], name, theirs)
                if theirs:
                    figures.append(figure)
                row.append(f"{theirs.middle:.0f} = {figure.ratio:.1f} x" if theirs else "")
            rows.append(tuple(row))
    heads = ["map", "moves", "ours, ns a cell", *names]
    return Table(tuple(heads), tuple(rows), "Beside rivals")


def _sizes(figures: list[Figure], quick: bool) -> Table:
    """From 50 x 50 to 4096 x 4096 at 10 %. Small maps are many different ones: one map again and again trains
    the processor's predictions and flatters code that branches.
    """
    rows = []
    moves = MOVES["dissertation"]
    for size in (50, 512) if quick else (50, 128, 256, 512, 1024, 2048, 4096):
        title = f"{size} random 10 %"
        several = max(1, 200 * 50 * 50 // (size * size))
        frees = [random_map(size, 0.1 + k * 1e-9) for k in range(several)]
        if several > 1:
            rng = np.random.default_rng(size)
            frees = [rng.random((size, size)) >= 0.1 for _ in range(several)]
        for free in frees:
            free.setflags(write=False)
        calls, cells = _together([contestants(free, moves, middle(free)) for free in frees], frees, moves)
        if size == 4096:
            calls = {name: calls[name] for name in ("lampyris", "scikit-image", "tcod", "scipy")}
        times = take_turns(calls, rounds=2 if size == 4096 else 3 if quick else 5, per=cells)
        row = [f"{size} x {size}", _text(times["lampyris"])]
        for name in ("scikit-image", "tcod", "scipy", "dijkstra3d"):
            theirs = times.get(name)
            figure = Figure(f"sizes, {title}", "ns a cell", times["lampyris"], name, theirs)
            if theirs:
                figures.append(figure)
            row.append(f"{theirs.middle:.0f} = {figure.ratio:.1f} x" if theirs else "")
        rows.append(tuple(row))
    heads = ("size", "ours, ns a cell", "scikit-image", "tcod", "scipy", "dijkstra3d")
    return Table(heads, tuple(rows), "From small to large: dissertation moves, 10 % blocked")


def _together(
    all_calls: list[dict[str, Callable[[], Any]]], frees: list[np.ndarray], moves: Moves
) -> tuple[dict[str, Callable[[], Any]], int]:
    """One call a contestant that goes over all maps, and how many cells there are in all."""
    cells = sum(solve(free, moves, middle(free)).expansions for free in frees)

    def over(name: str) -> Callable[[], None]:
        mine = [calls[name] for calls in all_calls]

        def run() -> None:
            for call in mine:
                call()

        return run

    return {name: over(name) for name in all_calls[0]}, cells


def _beside_cpp(figures: list[Figure], quick: bool) -> Table:
    heads = ("map", "ours", "C++", "ours / C++", "C++, cost alone", "whole / cost alone", "floor")
    library = build()
    if library is None:
        return Table(heads, (), "Beside the same loop in C++ (no compiler here)")
    rows, moves = [], MOVES["dissertation"]
    maps = [m for size in ((512,) if quick else (512, 1024)) for m in maps_of(size, quick)]
    if not quick:
        maps.append(("4096 random 10 %", random_map(4096, 0.1)))
    for title, free in maps:
        free.setflags(write=False)
        goal = middle(free)
        field, native = solve(free, moves, goal), Native(library, free, goal)
        native.whole()
        for ours, theirs in (
            (field.exact, native.cost),
            (field.step, native.step),
            (field.luciferin, native.luciferin),
        ):
            np.testing.assert_array_equal(ours, native.frame.inside(theirs))
        rounds = 3 if free.size > 2048 * 2048 else 9
        pair = {"ours": lambda f=free, g=goal: solve(f, moves, g), "C++": native.whole}
        times = take_turns(pair, rounds=rounds, per=field.expansions)
        # By itself: what the cost alone takes must not find the caches full of the others' arrays.
        parts = take_turns({"alone": native.costs}, rounds=rounds, per=field.expansions)
        parts |= take_turns({"whole": native.whole}, rounds=rounds, per=field.expansions)
        parts |= take_turns({"floor": native.floor}, rounds=rounds, per=field.expansions)
        figure = Figure(f"C++, {title}", "ns a cell", times["ours"], "C++", times["C++"], asked=1 / 1.2)
        figures += [
            figure,
            Figure(
                f"stages, {title}", "ns a cell", parts["whole"], "cost alone", parts["alone"], asked=1 / 1.7
            ),
        ]
        assert figure.ratio is not None
        share = parts["whole"].middle / parts["alone"].middle
        rows.append(
            (
                title, _text(times["ours"]), _text(times["C++"]), f"{1 / figure.ratio:.2f}",
                _text(parts["alone"]), f"{share:.2f}", f"{parts['floor'].middle:.2f}",
            )
        )  # fmt: skip
    return Table(heads, tuple(rows), "Beside the same loop in C++, ns a cell, dissertation moves")


def _slow_rivals(figures: list[Figure], quick: bool) -> Table:
    """Libraries of graphs in Python or with Python callbacks: once, on one map."""
    size = 128 if quick else 512
    free = random_map(size, 0.1)
    free.setflags(write=False)
    moves, goal = MOVES["octile"], middle(free)
    calls = contestants(free, moves, goal, slow=True)
    cells = check(free, moves, goal, calls)
    times = take_turns({n: calls[n] for n in ("lampyris", *SLOW) if n in calls}, rounds=3, per=cells)
    rows = []
    for name in SLOW:
        if name in times:
            figure = Figure(f"{size} random 10 %, octile", "ns a cell", times["lampyris"], name, times[name])
            figures.append(figure)
            rows.append((name, _text(times[name]), f"{figure.ratio:.0f} x", RULES[name]))
    return Table(
        ("library", "ns a cell", "ours is quicker by", ""), tuple(rows), f"Graph libraries, {size} x {size}"
    )


def _many(figures: list[Figure], quick: bool) -> Table:
    """Many goals on one map, by the clock: one after the other, and several at a time."""
    rows = []
    moves, workers = MOVES["dissertation"], processors()
    for size, count in ((128, 64),) if quick else ((50, 400), (128, 128), (512, 32), (1024, 12)):
        free = random_map(size, 0.1)
        free.setflags(write=False)
        ys, xs = np.nonzero(free)
        pick = np.random.default_rng(size).choice(len(xs), count)
        goals = [(int(xs[k]), int(ys[k])) for k in pick]
        calls = {
            "one": lambda f=free, g=goals: [solve(f, moves, goal) for goal in g],
            "many": lambda f=free, g=goals: list(solve_many(f, moves, g, workers=workers)),
        }
        times = take_turns(calls, rounds=5, per=count, clock=time.perf_counter_ns)
        ours, theirs = (times[name].rate(1e9) for name in ("many", "one"))
        figure = Figure(
            f"many goals, {size}", "fields a second", ours, "one after the other", theirs, more_is_better=True
        )
        figures.append(figure)
        rows.append(
            (f"{size} x {size}", f"{theirs.middle:,.0f}", f"{ours.middle:,.0f}", f"{figure.ratio:.2f} x")
        )
    heads = ("size", "one after the other, fields a second", f"{workers} threads", "gain")
    return Table(heads, tuple(rows), "Many goals (`lampyris.field.many.solve_many`), by the clock")


def verdicts(figures: list[Figure]) -> list[Verdict]:
    """What is claimed of fields, judged."""
    mine = [f for f in figures if ", dissertation" in f.task]
    random = [f for f in mine if "random" in f.task or "open" in f.task]
    mazes = [f for f in mine if "maze" in f.task]
    big = [f for f in figures if f.task.startswith("sizes, 4096")]
    best = (("random and open maps", _best(random), 12.0), ("mazes", _best(mazes), 8.0))
    out = [
        _at_least(
            "scikit-image, every map, dissertation moves", [f for f in mine if f.rival == "scikit-image"], 25
        ),
        _at_least("tcod, every map, dissertation moves", [f for f in mine if f.rival == "tcod"], 18),
    ]
    out += [
        _at_least(f"the best of all rivals, {what}, dissertation moves", fs, least)
        for what, fs, least in best
    ]
    if big:
        out.append(_at_least("the best of all rivals, 4096 x 4096 at 10 %", _best(big), 10))
        out.append(
            _at_least("scikit-image, 4096 x 4096 at 10 %", [f for f in big if f.rival == "scikit-image"], 30)
        )
    for what, start, most in (
        ("the same loop in C++", "C++, ", 1.2),
        ("cost alone, with parents and luciferin", "stages", 1.7),
    ):
        several = [f for f in figures if f.task.startswith(start)]
        if several:
            shares = {f.task: 1 / f.ratio for f in several if f.ratio}
            out.append(_at_most(what, shares, most))
    for size in (512, 1024):
        ns = {f.task: f.ours.middle for f in random if f.task.startswith(str(size))}
        if ns:
            flat = max(ns.values()) / min(ns.values())
            out.append(
                Verdict(
                    flat <= 2, f"{size} x {size}: flat within {flat:.2f} times from open to 30 % (2 allowed)"
                )
            )
    return out


def _best(figures: list[Figure]) -> list[Figure]:
    """Of each task the figure with the quickest rival."""
    tasks: dict[str, Figure] = {}
    for f in figures:
        if f.ratio is not None and (f.task not in tasks or f.ratio < (tasks[f.task].ratio or 0)):
            tasks[f.task] = f
    return list(tasks.values())


def _at_least(who: str, figures: list[Figure], least: float) -> Verdict:
    ratios = {f"{f.task} ({f.rival} {f.ratio:.1f})": f.ratio for f in figures if f.ratio}
    short = [name for name, ratio in ratios.items() if ratio < least]
    text = f"at least {least:g} times as quick as {who}: "
    text += f"{min(ratios.values()):.1f} to {max(ratios.values()):.1f}, "
    text += f"on {len(ratios) - len(short)} of {len(ratios)} maps"
    return Verdict(not short, text + (f"; short of it on {', '.join(short)}" if short else ""))


def _at_most(what: str, shares: dict[str, float], most: float) -> Verdict:
    over = [f"{name} ({share:.2f})" for name, share in shares.items() if share > most]
    text = f"at most {most:g} times {what}: {min(shares.values()):.2f} to {max(shares.values()):.2f}"
    return Verdict(not over, text + (f"; more on {', '.join(over)}" if over else ""))


def _text(s: Spread) -> str:
    return f"{s.middle:.1f} ({s.low:.1f} to {s.high:.1f})"

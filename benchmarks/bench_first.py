"""From the start of a process to a planner's printed answer: every planner on cells, 50 x 50 and 512 x 512."""

from __future__ import annotations

import resource
import tempfile
from pathlib import Path

from benchmarks.about import versions
from benchmarks.bench_start import PLAIN, Wait, random_grid_file, seconds
from benchmarks.figures import Figure, Section, Spread, Table, Verdict

from lampyris.planning.registry import names

TITLE = "First calls, by planner"
HOW = """Seconds of processor time from the start of a process to its end, with the printed answer of
`lampyris plan MAP --planner NAME` (the clock shows less where two threads work beside each other, and more where other
processes run), every planner on cells with its own settings, each call a process of its own, planners in
turns. Maps are random, 10 % blocked, from corner to corner, read from a `.npy` file. "First" is the first run on
a machine: no machine code of kernels is kept. "Again" is every later run. Byte code of Python is kept in both."""

SIZES = (50, 512)
FIRST_MOST = 2.0
"""Seconds from the start of the process that are aimed at for the first run on a machine."""
ENDINGS = (0, 4, 5)
"""Exit codes that count: a planner that samples may end without a path, at its limit."""
AGAIN_MOST = {50: 0.25, 512: 0.6}
"""The same for later runs, by the side of the map."""


def bench(quick: bool) -> Section:
    """All planners; quick takes four of them."""
    planners = ("ad-gso", "astar", "theta-star", "sipp") if quick else names()
    rounds, first_rounds = (3, 1) if quick else (5, 2)
    times: dict[tuple[int, str, bool], list[float]] = {}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "kept").mkdir()
        maps = {size: random_grid_file(folder, size) for size in SIZES}
        for size in SIZES:
            ends = "--start", "0,0", "--goal", f"{size - 1},{size - 1}"
            words = {p: ("-c", PLAIN, "plan", str(maps[size]), *ends, "--planner", p) for p in planners}
            for planner in planners:  # byte code and machine code are kept from here on
                seconds(Wait(planner, words[planner]), folder, ENDINGS)
            for fresh, many in ((False, rounds), (True, first_rounds)):
                for _ in range(many):
                    for planner in planners:
                        wait = Wait(planner, words[planner], fresh=fresh)
                        times.setdefault((size, planner, fresh), []).append(_spent(wait, folder))
        bare = Spread.of([_spent(Wait("bare", ("-c", "pass")), folder) for _ in range(rounds)])
    spreads = {key: Spread.of(values) for key, values in times.items()}
    figures = [
        Figure(
            f"plan, {planner}, {size} x {size}, {'first' if fresh else 'again'}", "s", spread, "bare", bare
        )
        for (size, planner, fresh), spread in spreads.items()
    ]
    verdicts = [
        _verdict({p: spreads[size, p, fresh].middle for p in planners}, size, fresh)
        for size in SIZES
        for fresh in (False, True)
    ]
    about = versions(["numpy", "numba", "typer"])
    return Section("first", TITLE, HOW, (_table(planners, spreads),), tuple(figures), tuple(verdicts), about)


def _spent(wait: Wait, folder: Path) -> float:
    """Processor time of a call's process."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    seconds(wait, folder, ENDINGS)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def _most(size: int, fresh: bool) -> float:
    return FIRST_MOST if fresh else AGAIN_MOST[size]


def _verdict(told: dict[str, float], size: int, fresh: bool) -> Verdict:
    most = _most(size, fresh)
    short = [f"{who} ({s:.2f} s)" for who, s in told.items() if s >= most]
    which = "the first run on a machine" if fresh else "later runs"
    text = f"`lampyris plan` on {size} x {size}, {which}, under {most:g} s: {len(told) - len(short)} of {len(told)} planners"
    return Verdict(not short, text + (f"; short of it: {', '.join(short)}" if short else ""))


def _table(planners: tuple[str, ...], spreads: dict[tuple[int, str, bool], Spread]) -> Table:
    rows = []
    for planner in planners:
        cells = [planner]
        for size in SIZES:
            for fresh in (False, True):
                s = spreads[size, planner, fresh]
                mark = "" if s.middle < _most(size, fresh) else " **SHORT**"
                cells.append(f"{s.middle:.3f} ({s.low:.3f} to {s.high:.3f}){mark}")
        rows.append(tuple(cells))
    heads = ["planner"]
    for size in SIZES:
        heads += [f"{size} x {size}, again, s", f"{size} x {size}, first, s"]
    return Table(tuple(heads), tuple(rows), "`lampyris plan` from process start, by planner")

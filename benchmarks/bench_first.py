"""From the start of a process to a planner's printed answer: every planner on cells, 50 x 50 and 512 x 512."""

from __future__ import annotations

import re
import resource
import tempfile
from pathlib import Path

from benchmarks.about import versions
from benchmarks.bench_start import PLAIN, Wait, random_grid_file, run, seconds
from benchmarks.figures import Figure, Section, Spread, Table, Verdict
from benchmarks.limits import EXPANSIONS, LOADING, PLANNING

from lampyris.planning.registry import names

TITLE = "First calls, by planner"
HOW = """Seconds of processor time from the start of a process to its end, with the printed answer of
`lampyris plan MAP --planner NAME` (the clock shows less where two threads work at the same time, and more where other
processes run), every planner on cells with its own settings, each call a process of its own, planners
one after the other. Maps are random, 10 % blocked, from corner to corner, read from a `.npy` file. "First" is the first run on
a machine, one run: no machine code of kernels is kept. "Again" is the middle of five later runs, which find what that
first run kept. Byte code of Python is kept in both. "Imports of NumPy" is how many times as long as `python -c "import numpy"`,
which is started after each planner, as `python -c "import numba"` is. Each answer says how much of it is
planning, and how much loading and compiling machine code, both in processor time, and how many expansions it took."""

SIZES = (50, 512)
BY_PROCESSOR = f"import time; time.perf_counter = time.process_time; {PLAIN}"
"""What is run: the times that an answer states are then of the processor, too."""
FIRST_MOST = 2.0
"""Seconds from the start of the process that are aimed at for the first run on a machine."""
AGAIN = 5
"""Later runs of each case."""
BESIDE = {"numpy": "import numpy", "numba": "import numba"}
"""What is started between the planners."""
ENDINGS = (0, 4, 5)
"""Exit codes that count: a planner that samples may end without a path, at its limit."""
AGAIN_MOST = {50: 0.25, 512: 0.6}
"""The same for later runs, by the side of the map."""


def bench(quick: bool) -> Section:
    """All planners; quick takes four of them."""
    planners = ("ad-gso", "astar", "theta-star", "sipp") if quick else names()
    times: dict[tuple[int, str, bool], list[float]] = {}
    parts: dict[str, list[float]] = {}
    alone: dict[str, list[float]] = {name: [] for name in BESIDE}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        maps = {size: random_grid_file(folder, size) for size in SIZES}
        words = {
            (size, p): (
                "-c", BY_PROCESSOR, "plan", str(maps[size]), "--start", "0,0", "--goal", f"{size - 1},{size - 1}",
                "--planner", p,
            )
            for size in SIZES for p in planners
        }  # fmt: skip
        (folder / "kept").mkdir()
        for p in planners:  # byte code is kept from here on
            seconds(Wait(p, words[SIZES[0], p]), folder, ENDINGS)
        for size in SIZES:
            for p in planners:
                # What the first run keeps, the next runs find: as on a machine of its own.
                with tempfile.TemporaryDirectory(dir=folder) as own:
                    (Path(own) / "kept").mkdir()
                    (Path(own) / "bytes").symlink_to(folder / "bytes")
                    for k in range(1 + AGAIN):
                        spent, answer = _spent(Wait(p, words[size, p]), Path(own))
                        times.setdefault((size, p, k == 0), []).append(spent)
                        for part, took in _parts(answer).items():
                            parts.setdefault(f"{_task(p, size, k == 0)}, {part}", []).append(took)
                for who, code in BESIDE.items():
                    alone[who].append(_spent(Wait(who, ("-c", code)), folder)[0])
    spreads = {key: Spread.of(values) for key, values in times.items()}
    beside = {who: Spread.of(values) for who, values in alone.items()}
    figures = [
        Figure(_task(p, size, fresh), "s", spread, who, beside[who])
        for (size, p, fresh), spread in spreads.items()
        for who in BESIDE
    ]
    figures += [
        Figure(task, "in one answer" if task.endswith(EXPANSIONS) else "s", Spread.of(values))
        for task, values in parts.items()
    ]
    verdicts = [
        _verdict({p: spreads[size, p, fresh].middle for p in planners}, size, fresh)
        for size in SIZES
        for fresh in (False, True)
    ]
    about = versions(["numpy", "numba", "typer"])
    tables = (_table(planners, spreads, beside), _imports(beside))
    return Section("first", TITLE, HOW, tables, tuple(figures), tuple(verdicts), about)


def _spent(wait: Wait, folder: Path) -> tuple[float, str]:
    """Processor time of a call's process, and its answer."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    _, answer = run(wait, folder, ENDINGS)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, answer


def _parts(answer: str) -> dict[str, float]:
    """What an answer says about its time, seconds, and how many expansions it took."""
    told = {part: re.search(rf"{part} ([0-9.]+) ms", answer) for part in (PLANNING, LOADING)}
    parts = {part: float(found[1]) / 1e3 if found else 0.0 for part, found in told.items()}
    many = re.search(rf"(\d+) {EXPANSIONS}", answer)
    return parts | {EXPANSIONS: float(many[1]) if many else 0.0}


def _task(planner: str, size: int, fresh: bool) -> str:
    return f"plan, {planner}, {size} x {size}, {'first' if fresh else 'again'}"


def _most(size: int, fresh: bool) -> float:
    return FIRST_MOST if fresh else AGAIN_MOST[size]


def _verdict(told: dict[str, float], size: int, fresh: bool) -> Verdict:
    most = _most(size, fresh)
    short = [f"{who} ({s:.2f} s)" for who, s in told.items() if s >= most]
    which = "the first run on a machine" if fresh else "later runs"
    text = f"`lampyris plan` on {size} x {size}, {which}, under {most:g} s: {len(told) - len(short)} of {len(told)} planners"
    return Verdict(not short, text + (f"; short of it: {', '.join(short)}" if short else ""))


def _imports(beside: dict[str, Spread]) -> Table:
    rows = tuple(
        (f"`{BESIDE[who]}`", f"{s.middle:.3f} ({s.low:.3f} to {s.high:.3f})") for who, s in beside.items()
    )
    return Table(("what", "s"), rows, "Imports alone, in the same run")


def _table(
    planners: tuple[str, ...], spreads: dict[tuple[int, str, bool], Spread], beside: dict[str, Spread]
) -> Table:
    numpy = beside["numpy"].middle
    rows = []
    for planner in planners:
        cells = [planner]
        for size in SIZES:
            for fresh in (False, True):
                s = spreads[size, planner, fresh]
                mark = "" if s.middle < _most(size, fresh) else " **SHORT**"
                cells.append(f"{s.middle:.3f}, {s.middle / numpy:.1f}{mark}")
        rows.append(tuple(cells))
    heads = ["planner"]
    for size in SIZES:
        heads += [f"{size} x {size}, {which}: s, imports of NumPy" for which in ("again", "first")]
    return Table(tuple(heads), tuple(rows), "`lampyris plan` from process start, by planner")

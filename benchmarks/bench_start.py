"""What a person waits for before anything happens: starting, importing, compiling.

Every call is a process of its own, by the clock, in turns with a bare interpreter. Byte code of Python is
kept as an installation keeps it; machine code of kernels lies in a folder of this benchmark's own.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from benchmarks.about import versions
from benchmarks.figures import Figure, Section, Spread, Table, Verdict
from benchmarks.limits import DEFAULT, NATIVE
from benchmarks.maps import random_map
from benchmarks.native import Native, build
from benchmarks.turns import take_turns

import lampyris
from lampyris.kernels._jit import prefer_compiled
from lampyris.model.grid import Grid
from lampyris.model.moves import MOVES
from lampyris.planning.field.gates import find_gates
from lampyris.planning.field.solve import solve

TITLE = "Start-up"
HOW = """Seconds by the clock, each in a process of its own, called alternately. Python's byte code is kept (it is after
the first start of an installation); machine code of kernels is not yet there where it says "nothing kept",
and is from then on. Maps are random, 10 % blocked, from corner to corner, read from a `.npy` file; the whole
command line with its printed answer; "terrain" is a map with a price on every cell. "Bare" is
`python -c pass`, "numpy" is `python -c "import numpy"`: no planner in Python starts quicker than that."""

PLAIN = "from lampyris.cli import program; program()"
"""What the installed script `lampyris` runs."""
FIRST_CALL = """
import lampyris
scene = lampyris.Scene(lampyris.load_grid({map!r}), (0, 0), ({last}, {last}))
assert lampyris.plan(scene).path is not None
"""


@dataclass(frozen=True, slots=True)
class Wait:
    """One thing that somebody waits for.

    Parameters
    ----------
    task : what it is called.
    words : of Python's command line, after the interpreter.
    most : seconds that are allowed, or None.
    fresh : whether nothing has been kept from earlier runs.
    who : the planner, or the terrain, that stands in the table of 316 x 316.
    """

    task: str
    words: tuple[str, ...]
    most: float | None = None
    fresh: bool = False
    who: str = ""


TERRAIN = 0
"""In place of a map's size: the one of 316 x 316 with terrain."""
SMALL = ("astar", "jps", "fastest", "dstar-lite", "theta-star", "sipp", "dstar", "lpa-star")
"""Planners that are started besides the default one, on 316 x 316 cells."""
FASTEST = "-O3 -march=native"
"""Of the builds in C++."""


def bench(quick: bool) -> Section:
    """All of it; quick takes fewer rounds and leaves out what compiles for long."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "kept").mkdir()
        maps = {
            size: random_grid_file(folder, size)
            for size in ((316, 512, 1024) if quick else (316, 512, 1024, 2048, 4096))
        }
        maps[TERRAIN] = _terrain(folder, 316)
        waits = _waits(maps, quick)
        for wait in waits:  # code of both kinds is kept from here on
            if not wait.fresh:
                seconds(wait, folder)
        times: dict[str, list[float]] = {w.task: [] for w in waits}
        for _ in range(3 if quick else 11):
            for wait in waits:
                if not wait.fresh:
                    times[wait.task].append(seconds(wait, folder))
        for k in range(11):
            for wait in waits:
                # What compiles nothing is as short as the others; the rest is seconds long.
                most = 11 if wait.most == 0.5 and wait.who in ("", DEFAULT) else 3
                if wait.fresh and k < (most // 3 if quick else most):
                    times[wait.task].append(seconds(wait, folder))
        if not quick:
            warm = Wait("`lampyris warm`, nothing kept", ("-c", PLAIN, "warm"), fresh=True)
            waits.append(warm)
            times[warm.task] = [seconds(warm, folder)]
        largest = [] if quick else stages(maps[4096])
    spreads = {task: Spread.of(values) for task, values in times.items()}
    figures = [*_figures(waits, spreads), *largest]
    return Section(
        "start", TITLE, HOW, (_table(waits, spreads), _small(waits, spreads)), tuple(figures),
        tuple(_verdicts(waits, spreads)), versions(["numpy", "numba", "typer", "rich"]),
    )  # fmt: skip


def stages(path: Path) -> list[Figure]:
    """What the parts of a plan on the largest map take, code compiled: seconds of this thread's processor time."""
    prefer_compiled()
    native, moves = build().get(FASTEST), MOVES["octile"]

    def read() -> Grid:
        return lampyris.load_grid(path)

    grid = read()
    free, goal = ~grid.blocked, (grid.width - 1, grid.height - 1)
    free.setflags(write=False)
    calls = {
        "reading the map": read,
        "field": partial(solve, free, moves, goal),
        "gates": lambda: find_gates(Grid(grid.blocked)),
        # A field is luciferin, cost and step of each cell, in memory that is new to the process.
        "new memory": lambda: [np.full(free.size, 1, kind) for kind in (np.float64, np.int64, np.int8)],
    }
    if native is not None:
        calls[NATIVE] = Native(native, free, moves, goal)
    times = take_turns(calls, rounds=3, per=1e9)
    task, theirs = f"`lampyris plan`, {grid.width} x {grid.height}", times.pop(NATIVE, None)
    return [
        Figure(f"{task}, {what}", "s of CPU", took, *((NATIVE, theirs) if what == "field" and theirs else ()))
        for what, took in times.items()
    ]


def _waits(maps: Mapping[int, Path], quick: bool) -> list[Wait]:
    def plan(size: int, *more: str) -> tuple[str, ...]:
        last = (size or 316) - 1
        ends = "--start", "0,0", "--goal", f"{last},{last}"
        return ("-c", PLAIN, "plan", str(maps[size]), *ends, *more)

    def first(size: int) -> tuple[str, ...]:
        return ("-c", FIRST_CALL.format(map=str(maps[size]), last=size - 1))

    waits = [
        Wait("bare", ("-c", "pass")),
        Wait("numpy", ("-c", "import numpy")),
        Wait("numba", ("-c", "import numba")),
        Wait("`lampyris --version`", ("-c", PLAIN, "--version"), 0.25),
        Wait("`lampyris --help`", ("-c", PLAIN, "--help"), 0.25),
        Wait("`lampyris plan env-1`, nothing kept", ("-c", PLAIN, "plan", "env-1"), 0.5, True),
        Wait("`lampyris plan`, 316 x 316, nothing kept", plan(316), 0.5, True, DEFAULT),
        Wait("`lampyris plan`, 316 x 316", plan(316), 0.5, who=DEFAULT),
        Wait("`lampyris plan`, 512 x 512, nothing kept", plan(512), 5.0, True),
        Wait("`lampyris plan`, 512 x 512", plan(512), 1.0),
        Wait("`lampyris plan`, 1024 x 1024", plan(1024), 1.0),
        Wait("first `lampyris.plan` in Python, 316 x 316", first(316), 0.7),
        Wait("first `lampyris.plan` in Python, 512 x 512", first(512), 0.7),
    ]
    for who in ("theta-star",) if quick else SMALL:
        words, name = plan(316, "--planner", who), f"`lampyris plan --planner {who}`, 316 x 316"
        waits += [Wait(f"{name}, nothing kept", words, 0.5, True, who), Wait(name, words, 0.5, who=who)]
    words, name = plan(TERRAIN, "--values", "costmap"), "`lampyris plan`, 316 x 316, terrain"
    who = f"{DEFAULT}, terrain"
    waits += [Wait(f"{name}, nothing kept", words, 0.5, True, who), Wait(name, words, 0.5, who=who)]
    if not quick:
        for size in (1024, 2048, 4096):
            waits.append(Wait(f"`lampyris plan`, {size} x {size}, nothing kept", plan(size), 5.0, True))
        waits += [Wait(f"`lampyris plan`, {size} x {size}", plan(size), 1.0) for size in (2048, 4096)]
        for planner in ("astar", "jps", "fastest", "dstar-lite", "theta-star", "sipp"):
            name = f"`lampyris plan --planner {planner}`, 512 x 512"
            waits.append(Wait(f"{name}, nothing kept", plan(512, "--planner", planner), 5.0, True))
            waits.append(Wait(name, plan(512, "--planner", planner), 1.0))
    return waits


def random_grid_file(folder: Path, size: int) -> Path:
    blocked = ~random_map(size, 0.1)
    blocked[:3, :3] = blocked[-3:, -3:] = False
    np.save(folder / f"{size}.npy", blocked.astype(np.uint8))
    return folder / f"{size}.npy"


def _terrain(folder: Path, size: int) -> Path:
    """The same with a price on every free cell, as a costmap."""
    blocked = np.load(random_grid_file(folder, size)) != 0
    prices = np.random.default_rng(size).integers(0, 200, blocked.shape)
    np.save(folder / "terrain.npy", np.where(blocked, 254, prices).astype(np.uint8))
    return folder / "terrain.npy"


def seconds(wait: Wait, folder: Path, allowed: Sequence[int] = (0,)) -> float:
    """How long the process ran, which ended with one of these exit codes."""
    return run(wait, folder, allowed)[0]


def run(wait: Wait, folder: Path, allowed: Sequence[int] = (0,)) -> tuple[float, str]:
    """The same, and what the process printed."""
    drop = ("PYTHONDONTWRITEBYTECODE", "NUMBA_DISABLE_JIT")
    env = {k: v for k, v in os.environ.items() if k not in drop}
    env["PYTHONPYCACHEPREFIX"] = str(folder / "bytes")
    with tempfile.TemporaryDirectory(dir=folder) as fresh:
        env["NUMBA_CACHE_DIR"] = fresh if wait.fresh else str(folder / "kept")
        began = time.perf_counter()
        done = subprocess.run([sys.executable, *wait.words], env=env, capture_output=True, check=False)
        took = time.perf_counter() - began
    if done.returncode not in allowed:
        raise RuntimeError(f"{wait.task}: {done.stderr.decode(errors='replace')}")
    return took, done.stdout.decode(errors="replace")


def _figures(waits: Sequence[Wait], spreads: Mapping[str, Spread]) -> list[Figure]:
    return [
        Figure(wait.task, "s", spreads[wait.task], rival, spreads[rival])
        for wait in waits[1:]
        for rival in ("bare", "numpy")
        if wait.task != rival
    ]


def _table(waits: Sequence[Wait], spreads: Mapping[str, Spread]) -> Table:
    rows = []
    bare, numpy = spreads["bare"].middle, spreads["numpy"].middle
    for wait in waits:
        s = spreads[wait.task]
        rows.append(
            (
                wait.task, f"{s.middle:.3f} ({s.low:.3f} to {s.high:.3f})", f"{s.middle / bare:.1f}",
                f"{s.middle / numpy:.1f}", "" if wait.most is None else f"{wait.most:g}",
            )
        )  # fmt: skip
    heads = ("what", "seconds", "bare interpreters", "imports of NumPy", "target, seconds")
    return Table(heads, tuple(rows))


def _small(waits: Sequence[Wait], spreads: Mapping[str, Spread]) -> Table:
    """Every planner on 316 x 316: the first run and those that follow."""
    rows = []
    for first in waits:
        if first.who and first.fresh:
            again = next(w for w in waits if w.who == first.who and not w.fresh)
            both = [spreads[w.task].middle for w in (first, again)]
            said = ["holds" if s < (first.most or 0) else "**SHORT**" for s in both]
            rows.append((first.who, f"{both[0]:.3f}", said[0], f"{both[1]:.3f}", said[1]))
    heads = ("planner", "nothing kept, s", "under 0.5 s", "from then on, s", "under 0.5 s")
    return Table(heads, tuple(rows), "`lampyris plan` on 316 x 316 cells (100,000), by planner")


def _verdicts(waits: Sequence[Wait], spreads: Mapping[str, Spread]) -> list[Verdict]:
    out = []
    for wait in waits:
        if wait.most is not None and not wait.who:
            s = spreads[wait.task].middle
            out.append(Verdict(s < wait.most, f"{wait.task}: {s:.2f} s ({wait.most:g} s allowed)"))
    for fresh, which in ((True, "from the very first run"), (False, "from the second run")):
        told = {w.who: spreads[w.task].middle for w in waits if w.who and w.fresh == fresh}
        short = [f"{who} ({s:.2f} s)" for who, s in told.items() if s >= 0.5]
        text = f"`lampyris plan` on 316 x 316 under 0.5 s {which}: {len(told) - len(short)} of {len(told)}"
        text += " planners and terrain"
        out.append(Verdict(not short, text + (f"; short of it: {', '.join(short)}" if short else "")))
    return out

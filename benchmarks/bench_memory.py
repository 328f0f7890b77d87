"""Memory of each job in a process of its own: bytes a cell beyond what was there, and the whole process."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from benchmarks.about import versions
from benchmarks.figures import Figure, Section, Spread, Table, Verdict
from benchmarks.memory_jobs import FILES, PLANNERS, measure

TITLE = "Memory"
HOW = """The most that a process holds in memory (Linux's `VmHWM`), each job in a process of its own, on maps
with a tenth of the cells blocked.

- bytes a cell: what the job adds at its highest, result and all, to what was there before: its input, and
  what the same job on 96 x 96 cells leaves loaded (NumPy, numba, machine code). A map's byte a cell is there.
- whole process: a process that has done nothing else, everything counted.
- its own: that without the pages of files it runs from (above all numba's LLVM, some 90 MB), which the
  system shares between processes and may drop.

Of a field 13 bytes a cell are the result (luciferin 8, cost 4, parent 1), with octile moves 17 (cost 8). On
maps of 8 million cells and more the lists that the wavefront needs lie where the luciferin will be. Over
terrain its calendar takes 9 to 14 bytes more. Searches that only look at some cells hold 18 bytes for each of
them; those that repair what they know keep it in two numbers of 64 bits and links; `sipp` keeps times. Swarm
planners hold the ways of all their individuals and remember what steps between them cost. A plan's own
processes are past the referee, with the map's gates and the optimum.

The other libraries compute costs; scikit-image also keeps where each cell was reached from, as lampyris does, the
others give costs alone. What they need made of the map first is counted, as it is for us (nothing). tcod and
dijkstra3d, who write 32-bit costs into one array and keep no parents, need less than we do.

A drive, a simulation and a study are short ones: what is seen is the map's share, and not the evidence's.

16384 x 16384 cells (268 million): files, recipes and the app take 16,777,216 cells at most and say so from
the header, exit code 5, before anything is made. A `Grid` made in Python may be larger. Searches refuse it
(`LIMIT`), as do octile costs beyond 38,613,964 cells, where 64 bits no longer tell them apart; a field by
other moves is solved, in the memory that the table states. At 2,147,483,648 cells `LIMIT` ends that too."""

LIMIT = 400e6
"""Bytes that a field of 4096 x 4096 cells shall stay under."""
KINDS = ("four-connected", "dissertation", "octile", "sixteen-connected")
RIVALS = {"scikit-image": 4096, "tcod": 4096, "dijkstra3d": 4096, "scipy": 4096, "networkx": 512}
"""Whom, and up to which size."""
HUGE = 16384
WHOLE = ", whole process"
NEEDED = 12 << 30
"""Bytes of memory that must be free for it."""


def bench(quick: bool) -> Section:
    """Every job; what is claimed is of fields of 4096 x 4096 cells, at both lengths."""
    figures: list[Figure] = []
    if not Path("/proc/self/status").is_file():
        return Section("memory", TITLE, HOW + "\n\nNot measured: this system has no `/proc`.")
    tables = [_fields(figures, quick), _rivals(figures, quick), _jobs(figures, quick)]
    verdicts = _verdicts(figures)
    if not quick:
        tables.append(_huge(figures, verdicts))
    about = versions(["numpy", "numba", "llvmlite", *RIVALS])
    return Section("memory", TITLE, HOW, tuple(tables), tuple(figures), tuple(verdicts), about)


def _fields(figures: list[Figure], quick: bool) -> Table:
    """Fields of 4096 x 4096, by moves."""
    rows, size = [], 4096
    jobs = [(kind, "") for kind in (("dissertation", "octile") if quick else KINDS)]
    jobs += [] if quick else [(kind, "terrain") for kind in KINDS]
    for kind, over in jobs:
        job = f"field:{kind}" + (f":{over}" if over else "")
        title = f"field {size}, {kind}" + (f" over {over}" if over else "")
        told, alone = measure(job, size), measure(job, size, fresh=True)
        figures += [
            Figure(title, "bytes a cell", _once(told["more"] / size**2)),
            Figure(f"{title}, whole process", "MB", _once(alone["whole"] / 1e6)),
            Figure(f"{title}, its own", "MB", _once(alone["own"] / 1e6)),
            # The map as one byte a cell, and all that making a field of it takes.
            Figure(f"{title}, with its map", "MB", _once((told["more"] + size**2) / 1e6)),
        ]
        rows.append((title, *(f"{f.ours.middle:.1f}" for f in figures[-4:])))
    heads = ("", "bytes a cell", "whole process, MB", "its own, MB", "map and field, MB")
    return Table(heads, tuple(rows), "Fields of 4096 x 4096 cells")


def _rivals(figures: list[Figure], quick: bool) -> Table:
    """Bytes a cell compared with rivals."""
    rows = []
    names = ("scikit-image",) if quick else tuple(RIVALS)
    for size in (1024,) if quick else (512, 1024, 4096):
        for kind in ("octile",) if quick else ("dissertation", "octile"):
            ours = measure(f"field:{kind}", size)["more"] / size**2
            row = [f"{size} x {size}, {kind}", f"{ours:.1f}"]
            for name in names:
                if size > RIVALS[name] or (kind != "octile" and name != "tcod"):
                    row.append("")
                    continue
                theirs = measure(f"rival:{name}", size)["more"] / size**2
                figure = Figure(f"field {size}, {kind}", "bytes a cell", _once(ours), name, _once(theirs))
                figures.append(figure)
                row.append(f"{theirs:.1f} = {figure.ratio:.1f} x")
            rows.append(tuple(row))
    return Table(
        ("map and moves", "ours", *names), tuple(rows), "Compared with other libraries, bytes a cell"
    )


def _jobs(figures: list[Figure], quick: bool) -> Table:
    """Every other job."""
    if quick:
        size = 1024
        jobs = [
            "loading:map",
            "loading:png",
            "layer:clearance",
            "layer:gates",
            "repairer:octile",
            "plan:ad-gso",
            "drive",
            "profile",
            "study",
        ]
    else:
        size = 4096
        jobs = [f"loading:{kind}" for kind in FILES]
        jobs += [f"layer:{what}" for what in ("grid", "inflate", "clearance", "gates")]
        jobs += [
            "repairer:dissertation",
            "repairer:octile",
            "frames",
            "picture",
            "simulation",
            "drive",
            "profile",
            "study",
        ]
        jobs += [f"plan:{planner}" for planner in PLANNERS if planner not in _SLOW]
    rows = []
    for job in jobs + ([] if quick else [f"plan:{planner}" for planner in _SLOW]):
        side = 1024 if job.removeprefix("plan:") in _SLOW else size
        told = measure(job, side)
        title = f"{job.replace(':', ' ')} {side}"
        figures.append(Figure(title, "bytes a cell", _once(told["more"] / side**2)))
        row = (f"{told['more'] / side**2:.1f}", f"{told['whole'] / 1e6:.0f}", f"{told['own'] / 1e6:.0f}")
        rows.append((title, *row))
    return Table(
        ("job, cells a side", "bytes a cell", "whole process, MB", "its own, MB"), tuple(rows), "Jobs"
    )


_SLOW = ("pso", "gso", "mmas-dstar")
"""Swarms: seconds for a million cells."""


def _huge(figures: list[Figure], verdicts: list[Verdict]) -> Table:
    """16384 x 16384: what is refused, and what is done in how much."""
    rows = []
    heads = ("16384 x 16384", "", "whole process, GB")
    if _free() < NEEDED:
        return Table(heads, (), f"Not measured: less than {NEEDED >> 30} GiB of memory are free")
    told = measure("field:dissertation", HUGE, fresh=True)
    figures.append(Figure(f"field {HUGE}, dissertation", "bytes a cell", _once(told["more"] / HUGE**2)))
    rows.append(("field, dissertation", "done", f"{told['whole'] / 1e9:.2f}"))
    for job in ("field:octile", "plan:astar"):
        command = [sys.executable, "-m", "benchmarks.memory_jobs", job, str(HUGE), "fresh"]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        verdict, words = refused(job, done.returncode, done.stderr)
        verdicts.append(verdict)
        rows.append((job.replace(":", ", "), words, ""))
    return Table(heads, tuple(rows), "Far too large")


def refused(job: str, code: int, stderr: str) -> tuple[Verdict, str]:
    """Was a job of the huge map refused as a limit, in words and with exit code 5? And the words."""
    words = (stderr.strip().splitlines() or ["nothing said"])[0]
    # Memory that has run out has the same code, but names no limit.
    limited = words.startswith("error[LIMIT]") or (
        words.startswith("error[MEMORY]") and "; allowed: " in words
    )
    holds = code == 5 and limited and "Traceback" not in stderr
    text = f"{HUGE} x {HUGE}, {job.replace(':', ' ')}, is refused as a limit, exit code 5: exit code {code}"
    return Verdict(holds, text if holds else f"{text}, {words}"), words


def _free() -> int:
    for line in Path("/proc/meminfo").read_text().splitlines():
        if line.startswith("MemAvailable"):
            return int(line.split()[1]) << 10
    return 0


def _once(value: float) -> Spread:
    return Spread.of([value])


def _verdicts(figures: list[Figure]) -> list[Verdict]:
    by = {f.task: f.ours.middle for f in figures if f.rival is None}
    plain = {t.removesuffix(WHOLE): v for t, v in by.items() if t.endswith(WHOLE) and "terrain" not in t}
    told = {t.split(", ")[1]: v for t, v in plain.items()}
    short = [kind for kind, v in told.items() if v >= LIMIT / 1e6]
    text = f"a field of 4096 x 4096 under {LIMIT / 1e6:.0f} MB in all, Python, NumPy, numba and LLVM too: "
    text += ", ".join(f"{kind} {v:.1f}" for kind, v in told.items())
    out = [Verdict(not short, text + (f"; short of it: {', '.join(short)}" if short else ""))]
    graphs = [f for f in figures if f.rival in ("scikit-image", "scipy", "networkx")]
    ratios = [f.ratio for f in graphs if f.ratio]
    text = f"a third of what scikit-image, scipy and networkx need, or less: {min(ratios):.1f} to "
    out.append(Verdict(min(ratios) >= 3, f"{text}{max(ratios):.1f} times as little"))
    return out

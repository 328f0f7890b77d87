"""Runs: the studies behind the page, on our own maps, each with a store so that it can be stopped.

The dissertation's six maps are lost. ``env-1`` to ``env-6`` are ours, made for its thirty pairs of start and
goal. Nothing here was chosen by its result: the settings are the defaults but for what a study varies.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path

import numpy as np

from lampyris.errors import FileError
from lampyris.io.maps import library
from lampyris.io.maps.map_hash import map_hash
from lampyris.model.grid import Grid
from lampyris.model.moves import moves_named
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.planning.field.solve import solve_field
from lampyris.study.analysis.table import ResultTable, table_of
from lampyris.study.design.config import law_config, planner_config
from lampyris.study.design.row import Row
from lampyris.study.design.study import Config, Kind, Study, StudyMap, StudyTraffic, World
from lampyris.study.execution.execution import Execution, Progress
from lampyris.study.execution.run import run
from lampyris.study.store.store import Store, open_for
from lampyris.typing import Cell

MAPS = tuple(f"env-{k}" for k in range(1, 7))
NT = (1, 4, 6, 8, 9, 10, 11, 12, 16, 24, 48)
"""Values of nt: those of Table 4.8, and as far as they can go; three rings have 48 cells."""
WALKERS = 20
FAR = 25.0
"""Cells that the drawn queries of the sweep are apart at least, on an empty map."""
ROOT = 2022
WEIGHTS = {"nt": 1.0, "static": 2.0, "moving": 40.0}
"""About how long a run takes beside the others: for the time left, nothing else."""


@dataclass(frozen=True, slots=True)
class RunProgress:
    """How far the runs are.

    Parameters
    ----------
    name : of the study at work.
    done, total : runs of all studies together.
    seconds_left : at the pace so far; None until there is one.
    """

    name: str
    done: int
    total: int
    seconds_left: float | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Tables:
    """The results: of the sweep of nt, and of the comparison without and with moving obstacles."""

    nt: ResultTable
    static: ResultTable
    moving: ResultTable


def studies(quick: bool = False) -> dict[str, Study]:
    """The three studies. ``quick``: fewer queries and seeds."""
    greedy = [planner_config("ad-gso", {"nt": n}, f"nt {n}") for n in NT]
    methods = [
        planner_config("dstar-lpso", {}, "mixed"),
        planner_config("dstar16-lpso", {}, "improved"),
        planner_config("ad-gso", {"gates": "replan"}, "ad-gso"),
        planner_config("ad-gso", {"gates": "close"}, "ad-gso, gates closed"),
        planner_config("ad-gso", {}, "ad-gso, gates ignored"),
        planner_config("astar", {}, ""),
    ]
    grounds = _grounds()
    drawn = tuple(w for k, g in enumerate(grounds) for w in _drawn(g, k, 5 if quick else 40))
    stored = tuple(w for g in grounds for w in _stored(g)[: 2 if quick else 5])
    walkers = (StudyTraffic("random-walk", WALKERS, tracks="live"),)
    return {
        "nt": _study("nt", "plan", drawn, greedy, 1, "Is nt = 10 best?"),
        "static": _study("static", "plan", stored, methods, 2 if quick else 10, "Table 4.11 on our maps"),
        "moving": _study(
            "moving", "simulate", stored, methods[:4], 1 if quick else 5,
            f"Table 4.11 on our maps among {WALKERS} random walkers", walkers,
        ),
    }  # fmt: skip


def _study(
    name: str, kind: Kind, worlds: tuple[World, ...], planners: list[Config], seeds: int, about: str,
    traffic_cases: tuple[StudyTraffic, ...] = (StudyTraffic(),),
) -> Study:  # fmt: skip
    return Study(
        name=f"reproduce-{name}",
        kind=kind,
        worlds=worlds,
        planners=tuple(planners),
        laws=(law_config("dissertation", {}, ""),),
        traffic_cases=traffic_cases,
        seeds=tuple(range(seeds)),
        moves="dissertation",
        robot=asdict(Robot()),
        root=ROOT,
        about=about,
    )


def _grounds() -> list[StudyMap]:
    grids = [(name, library.load(name).grid) for name in MAPS]
    return [StudyMap(name, grid, map_hash(grid)) for name, grid in grids]


def _stored(ground: StudyMap) -> list[World]:
    """The queries that a bundled map holds: the pairs of Table 4.11."""
    return [World(ground, q.start, q.goal) for q in library.load(ground.name).queries]


def _drawn(ground: StudyMap, number: int, many: int) -> list[World]:
    """Queries drawn at random, :data:`FAR` apart and joined by a path."""
    rng = np.random.default_rng([ROOT, number])
    grid = ground.grid
    free = np.argwhere(~grid.blocked)
    out: list[World] = []
    while len(out) < many:
        (y, x), (j, i) = free[rng.integers(0, len(free), 2)].tolist()
        if _apart((x, y), (i, j)) >= FAR and _joined(grid, (x, y), (i, j)):
            out.append(World(ground, (x, y), (i, j)))
    return out


def _apart(a: Cell, b: Cell) -> float:
    dx, dy = abs(a[0] - b[0]), abs(a[1] - b[1])
    return 1.4 * min(dx, dy) + abs(dx - dy)


def _joined(grid: Grid, start: Cell, goal: Cell) -> bool:
    field = solve_field(Scene(grid, start, goal, moves_named("dissertation")))
    return bool(field.exact[start[1], start[0]] >= 0)


def run_all(
    folder: Path,
    *,
    workers: int = 2,
    quick: bool = False,
    progress: Callable[[RunProgress], None] | None = None,
) -> Tables:
    """Run what the stores in a folder lack, and read them.

    Parameters
    ----------
    folder : of the stores; made if it is not there.

    Raises
    ------
    FileError : the folder cannot be made; what a store raises.
    KeyboardInterrupt : Ctrl-C; what was done is in the stores.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FileError("FILE_WRITE", error.strerror or str(error), where=str(folder)) from None
    asked = studies(quick)
    pace = _Pace(asked, progress)
    out = {}
    for name, study in asked.items():
        with open_for(folder / f"{name}{'-quick' if quick else ''}.sqlite", study) as store:
            done = store.keys()
            pace.start(name, len(done))
            run(study, partial(_keep, store), done=done, where=Execution(workers=workers), progress=pace.tell)
            pace.end()
            out[name] = table_of(study, store.rows())
    return Tables(out["nt"], out["static"], out["moving"])


def _keep(store: Store, rows: Sequence[Row]) -> None:
    store.add(rows)


class _Pace:
    """Progress over all three studies, their runs weighed by what they take."""

    def __init__(self, asked: dict[str, Study], tell: Callable[[RunProgress], None] | None) -> None:
        self._asked = {name: len(study) for name, study in asked.items()}
        self._report = tell
        self._began = time.perf_counter()
        self._done = dict.fromkeys(self._asked, 0)
        self._before = dict.fromkeys(self._asked, 0)
        self._name = ""

    def start(self, name: str, before: int) -> None:
        self._name = name
        self._done[name] = self._before[name] = before
        self._say()

    def tell(self, at: Progress) -> None:
        self._done[self._name] = at.done
        self._say()

    def end(self) -> None:
        self._done[self._name] = self._asked[self._name]
        self._say()

    def _say(self) -> None:
        if self._report is None:
            return
        left = sum(WEIGHTS[n] * (self._asked[n] - self._done[n]) for n in self._asked)
        ran = sum(WEIGHTS[n] * (self._done[n] - self._before[n]) for n in self._asked)
        seconds = (time.perf_counter() - self._began) * left / ran if ran > 0 else None
        self._report(RunProgress(self._name, sum(self._done.values()), sum(self._asked.values()), seconds))

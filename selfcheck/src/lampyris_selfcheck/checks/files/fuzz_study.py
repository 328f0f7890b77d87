"""Fuzzing of study files and of the stores of studies: how a mutant is read, and what must come of it."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from itertools import islice
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from lampyris.io.maps.map_hash import map_hash
from lampyris.model.grid import Grid
from lampyris.study.design.row import ENDINGS, Row
from lampyris.study.design.serialize import study_of, study_plain
from lampyris.study.design.study import Config, Study, StudyMap, StudyTraffic, World, canonical
from lampyris.study.design.study_file import load_study
from lampyris.study.store.repair import repair
from lampyris.study.store.store import Store
from lampyris_selfcheck.checks.files.fuzz_valid import grid, must, words
from lampyris_selfcheck.reference.files.mutator import Corpus

MAX_CELLS = 4096
STORE = "s.study.db"
_SAVED = "saved.study.db"


def read_study(path: Path, _: int) -> Study:
    """The study of a file."""
    return load_study(path, max_cells=MAX_CELLS)


def study(found: Study) -> None:
    """A study: its jobs can be told, each once, and what is stored of it makes the same again."""
    must(len(found) > 0 and found.worlds and found.planners and found.laws, "nothing to run")
    for world in found.worlds[:50]:
        inside = world.ground.grid.contains
        grid(world.ground.grid)
        must(inside(world.start) and inside(world.goal), "an end outside the map")
    keys = [job.key for job in islice(found.jobs(), 6)]
    must(len(set(keys)) == len(keys), "two jobs with one key")
    if len(found.seeds) > 1000:
        return
    again = study_of(json.loads(canonical(study_plain(found))), {h: g.grid for h, g in found.grounds.items()})
    must([job.key for job in islice(again.jobs(), 6)] == keys, "other jobs after it was stored")


@cache
def stores() -> Corpus:
    """Good stores, made by the product: with every kind of run, and with none."""
    with TemporaryDirectory() as folder:
        made = []
        for k, seeds in enumerate((2, 0)):
            path = Path(folder, f"{k}.study.db")
            asked = _small()
            with Store.create(path, asked) as store:
                store.add([_row(job.key, job.index) for job in islice(asked.jobs(), 4 * seeds)])
            made.append(path.read_bytes())
    return Corpus(tuple(made), text=False)


def _small() -> Study:
    blocked = np.zeros((4, 6), dtype=np.bool_)
    blocked[2, 1] = True
    made = Grid(blocked, resolution=0.5, name="left")
    ground = StudyMap("left", made, map_hash(made))
    return Study(
        "small",
        "plan",
        (World(ground, (0, 0), (5, 3), 6.2),),
        (Config("astar", {"weight": 1.0}), Config("ad-gso", {"swarm": 8}, "glowworms, 8")),
        (Config("constant", {"speed": 1.0}),),
        (StudyTraffic("random-walk", 3), StudyTraffic()),
        seeds=(0, 1),
    )


def _row(key: str, k: int) -> Row:
    ending = ENDINGS[k % 4]
    metrics = {"found": k % 2, "cost": None if k % 3 == 0 else 10 + k / 7, "outcome": "arrived"}
    return Row(
        key, ending, metrics, {"cpu_s": 0.001 * k}, "" if ending == "done" else f"error[X]: {k}: caf\u00e9"
    )


def read_store(path: Path, number: int) -> tuple[Study | None, list[Row]]:
    """All that is in a store; that reading left it as it was is seen to here."""
    before = path.read_bytes()
    try:
        return _contents(path, number)
    finally:
        must(path.read_bytes() == before, "reading changed the store")
        clear(path, keep=True)


def _contents(path: Path, number: int) -> tuple[Study | None, list[Row]]:
    with Store.open(path, writable=False) as store:
        # In turn what is asked first is another: whatever is asked has to find what is wrong.
        found = list(store.scan()) if number % 2 else None
        asked = store.study()
        return asked, list(store.rows().values()) if found is None else found


def contents(found: tuple[Study | None, list[Row]]) -> None:
    """A study, and rows of plain data."""
    asked, rows = found
    if asked is not None:
        study(asked)
    for row in rows:
        must(type(row.key) is str and row.ending in ENDINGS and type(row.error) is str, f"{row!r:.300}")
        for table in (row.metrics, row.timing):
            must(type(table) is dict, f"{row!r:.300}")
            for name, value in table.items():
                plain = value is None or type(value) in (str, int, bool) or math.isfinite(value)
                must(type(name) is str and plain, f"{name!r:.100} is {value!r:.100}")


def read_repaired(path: Path, number: int) -> tuple[Study | None, list[Row]]:
    """What is in the store that repair makes of it; without a study in it, only rows can be told."""
    saved = path.with_name(_SAVED)
    with _cleared(path, saved):
        came = repair(path, saved)
        must(came.kept >= 0 and came.lost >= 0, f"{came}")
        for note in came.notes:
            words(note)
        return _contents(saved, number)


@contextmanager
def _cleared(path: Path, saved: Path) -> Iterator[None]:
    try:
        yield
    finally:
        clear(path, keep=True)
        clear(saved, keep=False)


def clear(path: Path, *, keep: bool) -> None:
    """Take away what may be left beside a store."""
    for file in path.parent.glob(f"{path.name}*"):
        if not (keep and file == path):
            file.unlink()

"""Small stores to be damaged: a study, rows for its jobs, and the bytes of a store and what lies beside it.

The rows are made up: what a store keeps is not judged by it. They have numbers and words of every sort, and
some are longer than a page.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from lampyris.io.maps.map_hash import map_hash
from lampyris.model.grid import Grid
from lampyris.study.design.row import Row
from lampyris.study.design.study import Config, Job, Study, StudyMap, StudyTraffic, World
from lampyris.study.store.store import Store

BESIDE = ("", "-wal", "-shm", ".lock")
"""Endings of the names of a store's files."""
Files = Mapping[str, bytes]
"""A store's files by ending."""


def study(seeds: int = 10, **more: Any) -> Study:
    """2 planners x 1 law x 2 worlds x ``seeds``; fields of the study may be given."""
    grounds = []
    for name in ("left", "right"):
        blocked = np.zeros((6, 8), dtype=np.bool_)
        blocked[2, 1 if name == "left" else 5] = True
        grid = Grid(blocked, resolution=0.5, name=name)
        grounds.append(StudyMap(name, grid, map_hash(grid)))
    return Study(**{
        "name": "small", "kind": "plan", "worlds": tuple(World(g, (0, 0), (7, 5), 9.0) for g in grounds),
        "planners": (Config("astar", {"weight": 1.0}), Config("ad-gso", {"swarm": 8}, "glowworms, 8")),
        "laws": (Config("constant", {"speed": 1.0}),), "traffic_cases": (StudyTraffic("random-walk", 3),),
        "seeds": tuple(range(seeds)),
        **more,
    })  # fmt: skip


def row(job: Job, salt: int = 0, words: int = 0) -> Row:
    """A row with numbers of every sort; ``words`` characters of error make it longer than a page."""
    k = job.index + salt
    ending = ("done", "refused", "timeout", "failed")[k % 4 if k % 7 == 3 else 0]
    metrics = {
        "found": k % 3 != 0, "cost": None if k % 3 == 0 else 10 + k / 7, "expansions": 100 * k,
        "outcome": "arrived" if k % 3 else "no-path", "near_m": -0.0 if k == 5 else 1e-300 * k,
    }  # fmt: skip
    error = "" if ending == "done" else f"error[X]: {k}: Grüße \u2028 \x00 {'x' * words}"
    return Row(job.key, ending, metrics, {"cpu_s": 0.001 * k, "wall_s": 0.1}, error)  # type: ignore[arg-type]


def rows(of: Study, salt: int = 0, words: int = 0) -> list[Row]:
    """A row for every job."""
    return [row(job, salt, words) for job in of.jobs()]


def filled(path: Path, of: Study, batch: int = 5, given: Sequence[Row] | None = None) -> list[Row]:
    """A closed store with a row for every job, or those given; returns them."""
    all_ = rows(of) if given is None else list(given)
    with Store.create(path, of) as store:
        for k in range(0, len(all_), batch):
            store.add(all_[k : k + batch])
    return all_


def bytes_of(path: Path) -> dict[str, bytes]:
    """The store's files by ending, those that there are."""
    return {e: file.read_bytes() for e in BESIDE if (file := path.with_name(path.name + e)).exists()}


def put(path: Path, files: Files) -> None:
    """Exactly these files and none besides."""
    for ending in BESIDE:
        file = path.with_name(path.name + ending)
        if ending in files:
            file.write_bytes(files[ending])
        else:
            file.unlink(missing_ok=True)


def left_open(path: Path, of: Study, batch: int = 5, closed: int = 0) -> tuple[dict[str, bytes], list[Row]]:
    """The files of a store as a killed writer leaves them: the first ``closed`` rows in the main file, the
    others in the log; and the rows."""
    all_ = rows(of)
    filled(path, of, batch, all_[:closed])
    with Store.open(path) as store:
        for k in range(closed, len(all_), batch):
            store.add(all_[k : k + batch])
        files = bytes_of(path)
    del files["-shm"]  # the next to open it makes it anew, and it holds nothing
    for ending in BESIDE:
        path.with_name(path.name + ending).unlink(missing_ok=True)
    return files, all_


def clear(at: Path) -> None:
    """Take all files, and empty folders, out of a folder."""
    for one in at.iterdir():
        if one.is_dir() and not one.is_symlink():
            one.rmdir()
        else:
            one.unlink()

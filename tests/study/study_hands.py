"""A study of small worlds, and workers that do nothing real with it; other processes import them by name."""

from __future__ import annotations

import hashlib
import json
import os
import signal
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from lampyris.io.maps.map_hash import map_hash
from lampyris.model.grid import Grid
from lampyris.study.design.row import Row
from lampyris.study.design.study import Config, Job, Study, StudyMap, StudyTraffic, World, canonical

TROUBLE = "STUDY_HANDS_TROUBLE"
"""Names a folder in which a worker that is to die counts its deaths."""


def study_of(seeds: int = 10, maps: int = 2, **more: Any) -> Study:
    """``2 x 2 x seeds x 2 x maps`` jobs."""
    worlds = []
    for number in range(maps):
        blocked = np.zeros((8, 9), dtype=np.bool_)
        blocked[number, 3] = True
        grid = Grid(blocked, name=f"m{number}")
        ground = StudyMap(f"m{number}", grid, map_hash(grid))
        worlds += [World(ground, (0, 0), (8, 7)), World(ground, (0, 7), (8, 0))]
    return Study(
        "hands", "simulate", tuple(worlds), (Config("a"), Config("b", {"n": 1})), (Config("law"),),
        seeds=tuple(range(seeds)), traffic_cases=(StudyTraffic(), StudyTraffic("random-walk", 3)), **more,
    )  # fmt: skip


def one(plain: Mapping[str, Any]) -> dict[str, Any]:
    """What a worker makes of a job: a number that all of it decides."""
    key = hashlib.sha256(canonical(plain)).hexdigest()
    return {"key": key, "ending": "done", "error": "", "evidence": {"n": int(key[:8], 16)}, "timing": {}}


def work(letter: bytes) -> bytes:
    """Works at once."""
    said = json.loads(letter)
    assert set(said["grounds"]) == {plain["map"] for plain in said["jobs"]}
    return canonical({"results": [one(plain) for plain in said["jobs"]]})


def slow(letter: bytes) -> bytes:
    """Takes 20 ms a job."""
    time.sleep(0.02 * len(json.loads(letter)["jobs"]))
    return work(letter)


def stranger(letter: bytes) -> bytes:
    """Says who did the work."""
    said = json.loads(work(letter))
    for result in said["results"]:
        result["evidence"] = {"pid": os.getpid(), "threads": os.environ.get("OMP_NUM_THREADS")}
    time.sleep(0.02 * len(said["results"]))
    return canonical(said)


def _count(name: str) -> int:
    """Times this was asked before, over all processes."""
    path = Path(os.environ[TROUBLE]) / name
    with path.open("ab") as file:
        file.write(b".")
        file.flush()
        return file.tell() - 1


def dies_of_marked(letter: bytes) -> bytes:
    """Ends its process at every job that has the mark."""
    if any(marked(plain) for plain in json.loads(letter)["jobs"]):
        os.kill(os.getpid(), signal.SIGKILL)
    return work(letter)


def dies_at_once(parent: int) -> None:
    """Ends its process before it does anything."""
    os._exit(1)


def dies_five_times(letter: bytes) -> bytes:
    """Ends its process at the first five batches of more than one job."""
    if len(json.loads(letter)["jobs"]) > 1 and _count("deaths") < 5:
        os.kill(os.getpid(), signal.SIGKILL)
    return work(letter)


def marked(plain: Mapping[str, Any]) -> bool:
    """A few jobs of many."""
    return plain["planner"]["name"] == "b" and plain["start"] == [0, 7] and plain["seed"] % 8 == 3


def garbage_at_first(letter: bytes) -> bytes:
    """Every third batch is answered with something else, once."""
    name = hashlib.sha256(letter).hexdigest()
    if int(name[:8], 16) % 3 == 0 and _count(name) == 0:
        return b'\xff{"results": [' if int(name[8:10], 16) % 2 else b"[" * 100_000
    return work(letter)


def leaves_out_at_first(letter: bytes) -> bytes:
    """Of every third batch of two or more the last result is missing, once."""
    name = hashlib.sha256(letter).hexdigest()
    said = json.loads(work(letter))
    if len(said["results"]) > 1 and int(name[:8], 16) % 3 == 0 and _count(name) == 0:
        said["results"].pop()
    return canonical(said)


def other_key(letter: bytes) -> bytes:
    """Jobs with the mark are answered with another key."""
    return _spoilt(letter, lambda result: result.update(key="0" * 64))


def other_number(letter: bytes) -> bytes:
    """Jobs with the mark are answered with the result of another job."""
    return _spoilt(letter, lambda result: result["evidence"].update(n=-1))


def _spoilt(letter: bytes, spoil: Callable[[dict[str, Any]], None]) -> bytes:
    said = json.loads(letter)
    results = [one(plain) for plain in said["jobs"]]
    for plain, result in zip(said["jobs"], results, strict=True):
        if marked(plain):
            spoil(result)
    return canonical({"results": results})


def raises(letter: bytes) -> bytes:
    """Raises, which work never should."""
    raise ValueError("a worker with a fault")


class Judge:
    """Makes a row of a number; refuses one that is not the job's."""

    def row(self, job: Job, result: Mapping[str, Any], ground: StudyMap) -> Row:
        evidence = result["evidence"]
        if "n" in evidence and evidence["n"] != int(job.key[:8], 16):
            raise ValueError("not the number of this job")
        return Row(job.key, result["ending"], dict(evidence), dict(result["timing"]), result["error"])

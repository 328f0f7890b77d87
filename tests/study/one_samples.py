"""Small studies that really run, and what comes of them."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from lampyris.io.maps.map_hash import map_hash
from lampyris.model.grid import Grid
from lampyris.motion.laws import registry as laws
from lampyris.planning import registry
from lampyris.study.design.row import Row
from lampyris.study.design.study import Config, Job, Study, StudyMap, StudyTraffic, World, canonical
from lampyris.study.design.study_map import pack
from lampyris.study.execution.verify import ResultVerifier
from lampyris.study.execution.worker import work
from lampyris.typing import Cell

ROBOT: Mapping[str, Any] = {
    "radius": 0.0, "v_max": 1.0, "a_max": 0.5, "d_max": 1.0, "a_lat_max": 1.0, "turn_radius": 0.0,
    "jerk_max": None,
}  # fmt: skip


def grid_of(seed: int = 0, size: int = 16, share: float = 0.12) -> Grid:
    """A random map whose corners are free."""
    blocked = np.random.default_rng(seed).random((size, size + 3)) < share
    blocked[:2, :2] = blocked[-2:, -2:] = False
    return Grid(blocked, name=f"random-{seed}", resolution=0.5)


def planner(name: str, **settings: Any) -> Config:
    """A planner with all its settings."""
    return Config(name, {**registry.settings_of(registry.planner_class(name)), **settings})


def law(name: str, **settings: Any) -> Config:
    """A law with all its settings."""
    return Config(name, {**laws.settings_of(name), **settings})


def study_of(
    kind: Any,
    planners: Sequence[Config | str] = ("astar",),
    crowd: StudyTraffic = StudyTraffic("random-walk", 6),  # noqa: B008
    *,
    grid: Grid | None = None,
    start: Cell = (0, 0),
    goal: Cell | None = None,
    law_of: Config | str = "physical",
    published: float | None = None,
    **more: Any,
) -> Study:
    """One world, one law."""
    grid = grid_of() if grid is None else grid
    ground = StudyMap(grid.name, grid, map_hash(grid))
    end = (grid.width - 1, grid.height - 1) if goal is None else goal
    who = tuple(planner(p) if isinstance(p, str) else p for p in planners)
    speed = law(law_of) if isinstance(law_of, str) else law_of
    more = {"robot": ROBOT, **more}
    return Study("t", kind, (World(ground, start, end, published),), who, (speed,), (crowd,), **more)


def batch_of(study: Study, jobs: Sequence[Job] | None = None) -> bytes:
    """Jobs as a worker gets them."""
    asked = list(study.jobs()) if jobs is None else jobs
    grounds = {name: pack(ground.grid) for name, ground in study.grounds.items()}
    return canonical({"grounds": grounds, "jobs": [job.plain for job in asked], "memory": study.memory})


def results_of(study: Study) -> list[dict[str, Any]]:
    """What a worker says of all its jobs."""
    told: list[dict[str, Any]] = json.loads(work(batch_of(study)))["results"]
    return told


def ground_of(study: Study) -> StudyMap:
    """The one map of a study."""
    return next(iter(study.grounds.values()))


def rows_of(study: Study) -> list[Row]:
    """All its rows, judged."""
    judge, ground = ResultVerifier(), ground_of(study)
    return [judge.row(j, r, ground) for j, r in zip(study.jobs(), results_of(study), strict=True)]

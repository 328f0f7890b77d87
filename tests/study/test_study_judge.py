"""The judge: what a worker honestly says becomes a row, whatever it ran."""

from __future__ import annotations

import json

import numpy as np
import pytest
from lies import LIVE, REPLAYED
from one_samples import (
    ROBOT,
    grid_of,
    ground_of,
    rows_of,
    study_of,
)  # fmt: skip

import lampyris
from lampyris.model.grid import Grid
from lampyris.model.plan import Plan
from lampyris.model.scene import Scene
from lampyris.planning import registry
from lampyris.report.data.measures import METRICS
from lampyris.study.design.study import StudyTraffic
from lampyris.study.execution.worker import RunResult, run_job


@pytest.mark.commit(4)
@pytest.mark.parametrize("kind", ["plan", "simulate"])
@pytest.mark.parametrize("who", sorted(registry.names()))
def test_what_every_planner_comes_to_stands(kind: str, who: str) -> None:
    if who.startswith("lampyris-guest"):
        pytest.skip("a guest")
    for crowd in (REPLAYED, LIVE):
        for row in rows_of(study_of(kind, (who,), crowd, seeds=(0, 1), expansions=20_000, patience=10)):
            assert row.ending == "done", row.error
            assert tuple(row.metrics) == METRICS


@pytest.mark.commit(2)
@pytest.mark.parametrize("law_", ["physical", "dissertation", "uncertainty", "blind", "rpp", "optimum"])
def test_what_every_law_comes_to_stands(law_: str) -> None:
    for kind in ("plan", "drive", *(("simulate",) if law_ in ("physical", "dissertation") else ())):
        (row,) = rows_of(study_of(kind, ("astar",), StudyTraffic("random-walk", 4), law_of=law_))
        assert row.ending == "done", (kind, row.error)
        assert row.metrics["speed_mean"] > 0


@pytest.mark.commit(1)
@pytest.mark.parametrize("moves", ["octile", "dissertation", "four-connected", "sixteen-connected"])
@pytest.mark.parametrize("radius", [0.0, 0.3])
def test_other_moves_wide_robots_and_terrain_stand(moves: str, radius: float) -> None:
    bare = grid_of(2, share=0.04)
    terrain = np.random.default_rng(1).integers(0, 253, bare.blocked.shape)
    for grid in (bare, Grid(bare.blocked, terrain=terrain, name="t", resolution=0.5)):
        for kind in ("plan", "simulate", "drive"):
            made = study_of(
                kind, ("astar",), StudyTraffic("mixed", 3, radius=radius), grid=grid, moves=moves,
                robot={**ROBOT, "radius": radius},
            )  # fmt: skip
            for row in rows_of(made):
                assert row.ending == "done", (kind, row.error)


def test_the_judges_noun_is_the_workers() -> None:
    """Metrics of the row are those of the run itself, through the front door."""
    study = study_of("plan", ("astar",), StudyTraffic(), law_of="physical", published=21.0)
    (job,), (row,) = study.jobs(), rows_of(study)
    scene = Scene(ground_of(study).grid, (0, 0), (18, 15))
    plan = lampyris.plan(scene, "astar")
    profile = lampyris.speed_profile(scene, plan)
    assert row.metrics["cost"] == plan.cost
    assert row.metrics["optimal"] == plan.optimal_cost
    assert row.metrics["cost_to_go"] == pytest.approx(plan.sum_cost_to_go)
    assert row.metrics["time_s"] == profile.duration
    assert row.metrics["expansions"] == plan.expansions
    assert row.metrics["reference_ok"] is False
    ran: RunResult = run_job(job.plain, ground_of(study).grid)
    assert isinstance(ran.noun, Plan)
    assert ran.profile is not None


@pytest.mark.parametrize("kind", ["plan", "simulate", "drive"])
def test_rows_are_made_of_plain_and_finite_values(kind: str) -> None:
    for row in rows_of(study_of(kind, ("astar", "ad-gso"), REPLAYED)):
        said = json.loads(json.dumps([dict(row.metrics), dict(row.timing)], allow_nan=False))
        assert said == [dict(row.metrics), dict(row.timing)]
        assert {type(v) for v in row.metrics.values()} <= {int, float, bool, str, type(None)}

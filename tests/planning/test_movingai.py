"""Published MovingAI queries, one session for many: the exact companions find the published optimal length.

``lampyris selfcheck scen --folder DIR`` asks every line of every file there.

N. Sturtevant, "Benchmarks for Grid-Based Pathfinding", IEEE TCIAIG 4(2):144-148, 2012. The maps are
not part of the project; without them these tests are skipped and say so.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lampyris.model.change import Change
from lampyris.model.grid import Grid
from lampyris.model.scene import Scene
from lampyris.planning.base import Planner
from lampyris.planning.graph.astar import AStar
from lampyris.planning.graph.bidirectional_astar import BidirectionalAStar
from lampyris.planning.graph.dijkstra import Dijkstra
from lampyris.planning.graph.fastest import Fastest
from lampyris.planning.graph.jps import JumpPointSearch
from lampyris.planning.incremental.dstar import DStar
from lampyris.planning.incremental.dstar_lite import DStarLite
from lampyris.planning.incremental.focussed_dstar import FocussedDStar
from lampyris.planning.incremental.lpa_star import LpaStar
from lampyris.referee import check_path
from lampyris_selfcheck.reference.paths.search import read_map, read_queries
from sizes import some

PLANNERS = [AStar(), Dijkstra(), JumpPointSearch(), BidirectionalAStar()]
LIVING = [DStar(), FocussedDStar(), LpaStar(), DStarLite(), Fastest()]
"""More exact ones, asked less often by day: each question to one is a whole search from the goal."""
QUERIES = {
    "16room_000": 1_860,
    "AR0011SR": 1_280,
    "Berlin_0_256": 930,
    "arena2": 929,
    "ht_0_hightown": 1_330,
    "maze512-32-0": 5_760,
    "random512-10-0": 1_670,
}
SAMPLE = 60
FEW = 6


def differences(planner: Planner, folder: Path, name: str, sample: int) -> tuple[int, list[str]]:
    """How many queries were asked, and what was wrong with which."""
    grid = Grid(~np.array(read_map((folder / f"{name}.map").read_text())))
    queries = read_queries((folder / f"{name}.map.scen").read_text())
    assert len(queries) == QUERIES[name]
    chosen = np.random.default_rng(2012).choice(len(queries), size=sample, replace=False)
    queries = [queries[k] for k in sorted(chosen)]
    sessions = {}
    wrong = []
    for start, goal, length, tolerance in queries:
        if goal not in sessions:
            # One at a time: a session keeps arrays as large as the map.
            sessions = {goal: planner.open(Scene(grid, start, goal), np.random.default_rng(0))}
        plan = sessions[goal].plan(Change(robot=start))
        case = f"{name} {start} to {goal}: {plan.status}, {plan.cost!r}, published {length}"
        if plan.path is None or abs(plan.cost - length) > tolerance:
            wrong.append(case)
        else:
            scene = Scene(grid, start, goal)
            broken = check_path(plan.path, grid, scene.robot, scene.moves, start, goal)
            if broken is not None:
                wrong.append(f"{case}; {broken}")
    return len(queries), wrong


@pytest.mark.commit(3)
@pytest.mark.parametrize("name", some(QUERIES, 4))
@pytest.mark.parametrize("planner", PLANNERS, ids=lambda p: p.name)
def test_a_sample_of_published_lengths(planner: Planner, name: str, movingai: Path) -> None:
    asked, wrong = differences(planner, movingai, name, SAMPLE)
    assert asked == SAMPLE
    assert wrong == []


@pytest.mark.commit(4)
@pytest.mark.parametrize("name", some(QUERIES, 2))
@pytest.mark.parametrize("planner", LIVING, ids=lambda p: p.name)
def test_a_few_published_lengths(planner: Planner, name: str, movingai: Path) -> None:
    assert differences(planner, movingai, name, FEW) == (FEW, [])

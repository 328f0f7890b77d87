"""Rivals of fleets on the same map, starts and goals: pymapf, cuplan, pathplanning, w9-pathfinding, RVO2 by pyrvo."""

from __future__ import annotations

import time
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np

from lampyris.model.fleet.fleet import Fleet
from lampyris.model.fleet.fleet_plan import FleetPlan
from lampyris.model.plan import Status
from lampyris.referee import check_fleet_plan
from lampyris.typing import Floats

Cells = list[list[tuple[int, int]]]


@dataclass(frozen=True, slots=True)
class Solved:
    """What one call took.

    Parameters
    ----------
    seconds : of processor time of this thread.
    costs : the sum of costs; None: no plan.
    """

    seconds: float
    costs: int | None


def judged(fleet: Fleet, seconds: float, paths: Cells | None) -> Solved:
    """A rival's paths past our referee; waits at the end are left out, as the sum of costs does not count them."""
    if paths is None:
        return Solved(seconds, None)
    arrays = []
    for path in paths:
        end = len(path)
        while end > 1 and path[end - 1] == path[end - 2]:
            end -= 1
        arrays.append(np.array(path[:end], dtype=np.int32))
    plan = FleetPlan(Status.FOUND, "rival", tuple(arrays))
    verdict = check_fleet_plan(plan, fleet)
    assert verdict is None, verdict
    return Solved(seconds, plan.sum_of_costs)


class PymapfLacam:
    """LaCAM of pymapf, the first plan; cells are (row, column)."""

    name = "pymapf LaCAM"

    def __call__(self, fleet: Fleet, limit: float) -> Solved:
        from pymapf.algorithms.lacam import LaCAM
        from pymapf.core.grid import GridMap
        from pymapf.core.solver import Agent, MAPFProblem

        agents = [Agent(str(k), r.start[::-1], r.goal[::-1]) for k, r in enumerate(fleet.robots)]
        problem = MAPFProblem(GridMap(fleet.grid.blocked.tolist()), agents)
        solver = LaCAM(time_limit=limit)
        begin = time.thread_time()
        found = solver.solve(problem)
        spent = time.thread_time() - begin
        return judged(fleet, spent, _by_name(found))


class CuplanPibt:
    """PIBT of cuplan with its NumPy backend; cells are (row, column)."""

    name = "cuplan PIBT"

    def __call__(self, fleet: Fleet, limit: float) -> Solved:
        from cuplan import PIBT, Agent, Grid, Problem

        agents = [Agent(str(k), r.start[::-1], r.goal[::-1]) for k, r in enumerate(fleet.robots)]
        problem = Problem(Grid(fleet.grid.blocked), agents)
        solver = PIBT(seed=0, backend="cpu")
        begin = time.thread_time()
        found = solver.solve(problem)
        spent = time.thread_time() - begin
        return judged(fleet, spent, _by_name(found))


def _by_name(found: Any) -> Cells | None:
    """Paths in the order of the robots, as (x, y)."""
    if found is None:
        return None
    return [[(c, r) for r, c in found.paths[str(k)]] for k in range(len(found.paths))]


class Pathplanning:
    """EECBS or LaCAM* of pathplanning, in C++. Its search alone is timed, not the making of its graph nor its check in Python."""

    def __init__(self, planner: str) -> None:
        self.planner, self.name = planner, f"pathplanning {planner}"

    def __call__(self, fleet: Fleet, limit: float) -> Solved:
        from pathplanning import MultiAgentProblem, plan_multi_agent
        from pathplanning.planners.multi_agent import _common
        from pathplanning.spaces.grid2d import Grid2DMultiAgentAdapter, Grid2DSearchSpace

        _common.time = SimpleNamespace(perf_counter=time.thread_time)  # its own figures in processor time
        blocked = fleet.grid.blocked
        walls = [(x, y) for y, x in np.argwhere(blocked).tolist()]
        space = Grid2DSearchSpace(blocked.shape[1], blocked.shape[0], obstacles=walls)
        problem = MultiAgentProblem(Grid2DMultiAgentAdapter(space), fleet.starts, fleet.goals)
        params: dict[str, Any] = {"max_runtime_ms": 1e3 * limit}
        if self.planner == "eecbs":
            params["w"] = 1.1
        found = plan_multi_agent(problem, planner=self.planner, params=params)
        paths = [[(int(x), int(y)) for x, y in path] for path in found.paths] if found.success else None
        return judged(fleet, float(found.stats["native_search_s"]), paths)


class W9Cbs:
    """CBS of w9-pathfinding, in C++, with disjoint splitting."""

    name = "w9 CBS"

    def __call__(self, fleet: Fleet, limit: float) -> Solved:
        from w9_pathfinding.envs import Grid
        from w9_pathfinding.mapf import CBS

        weights = np.where(fleet.grid.blocked, -1.0, 1.0).tolist()
        solver = CBS(Grid(weights, edge_collision=True), seed=0)
        begin = time.thread_time()
        try:
            paths = solver.mapf(
                list(fleet.starts),
                list(fleet.goals),
                max_length=1000,
                max_time=limit,
                disjoint_splitting=True,
            )
        except RuntimeError:  # its time limit
            paths = None
        spent = time.thread_time() - begin
        return judged(fleet, spent, [[(int(x), int(y)) for x, y in p] for p in paths] if paths else None)


class Rvo2:
    """ORCA of RVO2 (C++) by pyrvo, for discs on an open map: each prefers the straight line to its goal.

    pyrvo states no licence and asks for a simulator that nothing here needs, so it is installed by hand, if at all:
    ``pip install --no-deps pyrvo==0.4.3``.

    Parameters
    ----------
    starts, goals : float64 (robots, 2), metres.
    radius, top, neighbours, horizon, period : of all robots; metres, metres per second, robots, seconds, seconds.

    Raises
    ------
    ImportError : pyrvo is not installed.
    """

    name = "RVO2 (pyrvo)"

    def __init__(
        self,
        starts: Floats,
        goals: Floats,
        radius: float,
        top: float,
        neighbours: int,
        horizon: float,
        period: float,
    ) -> None:
        import pyrvo

        reach = 2.0 * (radius + horizon * top)
        self._sim = pyrvo.RVOSimulator(period, reach, neighbours, horizon, horizon, radius, top)
        self._goals, self._top, self._period = goals, top, period
        for x, y in starts.tolist():
            self._sim.add_agent([x, y])
        self.places = starts.copy()

    def step(self) -> float:
        """Do one step; its seconds of processor time, the preferred velocities not counted."""
        way = self._goals - self.places
        far = np.sqrt((way * way).sum(axis=1))
        speed = np.minimum(self._top, far / self._period)
        wanted = way * (speed / np.maximum(far, 1e-12))[:, None]
        for k, (x, y) in enumerate(wanted.tolist()):
            self._sim.set_agent_pref_velocity(k, [x, y])
        begin = time.process_time()
        self._sim.do_step()
        spent = time.process_time() - begin
        found = [self._sim.get_agent_position(k) for k in range(len(self.places))]
        self.places = np.array([(one.x, one.y) for one in found])
        return spent

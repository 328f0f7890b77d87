"""Chains of links among obstacles: plan_chain, draw_chain.

Nothing leaves through :func:`plan_chain` that the referee has not re-checked.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from lampyris._core.scalars import MAX_SEED, SEED_RANGE, is_whole
from lampyris.errors import SettingError, UsageError, did_you_mean, of_kind, shown
from lampyris.kernels import loading
from lampyris.model.chain.chain import Chain, configuration_of
from lampyris.model.chain.chain_plan import ChainPlan
from lampyris.model.grid import Grid
from lampyris.planning.base import Budget
from lampyris.planning.chain.rrt import PLANNERS, ChainSearch, RrtSettings
from lampyris.referee.chain import check_chain_plan
from lampyris.referee.verdict import demand
from lampyris.report.pictures.chain_picture import draw_chain as draw_chain
from lampyris.typing import Floats

__all__ = ["Chain", "ChainPlan", "draw_chain", "plan_chain"]


def plan_chain(
    grid: Grid,
    chain: Chain,
    start: Sequence[float] | Floats,
    goal: Sequence[float] | Floats,
    planner: str = "rrt-adaptive",
    *,
    seed: int = 0,
    budget: Budget | None = None,
    **settings: Any,
) -> ChainPlan:
    """Plan collision-free configurations of a chain from start to goal; re-checked by the referee.

    ::

        arm = lampyris.Chain(base=(5.5, 5.5), links=[2, 2, 1], widths=0.3, joint_limits=(-2.6, 2.6))
        found = lampyris.plan_chain(grid, arm, start=[0, 0, 0], goal=[1.5, 0.5, 0])
        found.configurations, found.released

    Links are rectangles from joint to joint. No link may meet a blocked cell, leave the map (nothing is known there) or
    overlap another link, its neighbours excepted; motions are checked without gaps between two checked moments
    (:mod:`lampyris.kernels.chain.collision`).

    Parameters
    ----------
    grid : the map.
    chain : the chain that moves.
    start, goal : one angle for each joint, radians.
    planner : ``rrt``: one tree, LaValle 1998. ``rrt-connect``: two trees, Kuffner and LaValle 2000. ``rrt-adaptive``:
        RRT-Connect in a space that grows. At first only the line from start to goal is sampled; when extensions
        collide, the joint of the link that has collided most often is released and drawn from its limits, the others
        stay on the line. Trees are kept. With all joints released it is RRT-Connect, so a path that RRT-Connect would
        find is found with probability 1 as samples grow.
    seed : of all draws; the same seed gives the same plan, unless seconds end the search.
    budget : ``expansions``: samples, 20,000 if None; ``seconds`` and ``stop``.
    **settings : see :class:`lampyris.planning.chain.rrt.RrtSettings`.

    Raises
    ------
    SettingError : ``CONFIGURATION``: not one angle for each joint, or beyond its limits; a setting out of its range.
    UsageError : ``PLANNER``: no such planner; ``SETTING``: no such setting.
    InternalFault : the referee refused the plan; a fault of lampyris.

    Examples
    --------
    >>> import lampyris
    >>> import numpy as np
    >>> arm = lampyris.Chain((5.0, 5.0), links=[1.0, 1.0], widths=0.2)
    >>> plan = lampyris.plan_chain(lampyris.Grid(np.zeros((10, 10), dtype=bool)), arm, [0.0, 0.0], [1.5, 0.5])
    >>> plan.status.value, plan.configurations.shape[1]
    ('found', 2)
    """
    of_kind("grid", grid, Grid)
    of_kind("chain", chain, Chain)
    of_kind("budget", budget, Budget, none=True)
    if not isinstance(planner, str) or planner not in PLANNERS:
        todo = did_you_mean(planner, PLANNERS) if isinstance(planner, str) else ""
        raise UsageError(
            "PLANNER",
            f"no planner of chains is called {shown(planner)}",
            allowed=", ".join(PLANNERS),
            todo=todo,
        )
    if not is_whole(seed, 0, MAX_SEED):
        raise SettingError.of("SEED", "seed", shown(seed), allowed=SEED_RANGE)
    known = RrtSettings.__dataclass_fields__
    for name in settings:
        if name not in known:
            raise UsageError("SETTING", f"{planner} has no setting {shown(name)}", allowed=", ".join(known))
    a, b = configuration_of(chain, start, "start"), configuration_of(chain, goal, "goal")
    began, loaded = loading.wall(), loading.seconds()
    found = ChainSearch(grid, chain, RrtSettings(**settings)).plan(grid, a, b, planner, int(seed), budget)
    planned, loaded = loading.wall(), loading.seconds() - loaded
    demand(check_chain_plan(found))
    timing = {
        "search_s": planned - began - loaded,
        "loading_s": loaded,
        "referee_s": loading.wall() - planned,
    }
    return replace(found, timing=timing)

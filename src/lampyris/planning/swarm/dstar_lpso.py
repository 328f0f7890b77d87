"""The dissertation's two baselines: D* for the costs, a particle swarm for every move."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from lampyris._core.settings import redeclared
from lampyris.planning.swarm.step_session import StepPlanner


@dataclass(frozen=True, slots=True)
class DstarLpso(StepPlanner):
    """Hybrid ("mixed") D* with lbest PSO: one cell an iteration, gates met on the way.

    After Sadiq and Hasan 2017 as the dissertation tells of it; the paper could not be found. Costs are those
    that D* holds; they are computed by the field's wavefront, which gives the same numbers.
    """

    name: ClassVar[str] = "dstar-lpso"
    summary: ClassVar[str] = (
        "D* with lbest PSO: one cell an iteration by a ring swarm (the dissertation's baseline)."
    )
    source: ClassVar[str] = (
        "Sadiq and Hasan 2017 as the dissertation tells of it; paper not found. The swarm at each cell, its "
        "fitness and the passing of unavoidable gates are ours."
    )
    reach: ClassVar[int] = 1


@dataclass(frozen=True, slots=True)
class Dstar16Lpso(StepPlanner):
    """Improved D* with lbest PSO: 16 directions, two cells an iteration, gates closed beforehand.

    The 16 directions are the 16 cells of the second ring, each reached by the cheapest legal pair of steps
    (or one knight's step, where the moves have it): an inference from the dissertation's tables, where it
    takes half as many iterations as cells. The last iteration may move one cell, and so does one where no
    cell of the second ring is nearer to the goal: by D*'s own step.
    """

    particles: int = redeclared(StepPlanner, "particles", 16)
    gates: str = redeclared(StepPlanner, "gates", "close")

    name: ClassVar[str] = "dstar16-lpso"
    summary: ClassVar[str] = (
        "Improved D* with lbest PSO: two cells in 16 directions an iteration (the improved baseline)."
    )
    source: ClassVar[str] = (
        "The improved D* with lbest PSO as the dissertation tells of it; paper not found. That 16 directions "
        "are the second ring is inferred from its tables; the rest is ours as for dstar-lpso."
    )
    reach: ClassVar[int] = 2

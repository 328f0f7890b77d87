"""The dissertation's two baselines: D* for the costs, a particle swarm for every move."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from lampyris.model.scene import Scene
from lampyris.planning.base import Traits
from lampyris.planning.swarm import settings as check
from lampyris.planning.swarm.step_session import StepSession

GATES = ("ignore", "close", "replan")


@dataclass(frozen=True, slots=True)
class StepPlanner:
    """Settings that both baselines share. Abstract.

    At every cell a particle swarm with a ring neighbourhood (lbest) lives in the square around the robot. A
    particle means the candidate cell nearest to it; its fitness is that cell's cost-to-go plus the share of
    its eight neighbours that are blocked, weighed. A candidate that is blocked or no nearer to the goal loses
    to all that are. The first particles begin on the candidates, one on each, in compass order, so with as
    many particles as candidates none is overlooked; with fewer it is a search, and where it finds nothing
    that is nearer to the goal, D*'s own step is taken. All of this is ours: of the published methods no more
    is known than that D* computes the costs, an lbest swarm moves the robot, and a gate makes it plan anew.

    Parameters
    ----------
    particles : of the swarm at each cell. 1 to 1000.
    rounds : iterations of that swarm. 1 to 1000.
    obstacles : weight of blocked neighbours, in cells, 0 to 100.
    gates : openings too narrow for the robot: ``ignore`` them, ``close`` them in the analysis, or ``replan``:
        one that is met is closed (D* raises its cost) and the costs are mended. Where every way leads through
        gates they are passed, and the plan says so.
    """

    particles: int = 8
    rounds: int = 4
    obstacles: float = 0.1
    gates: str = "replan"

    name: ClassVar[str]
    # The costs are solved anew where cells were closed, so nothing is reused after a Change.
    traits: ClassVar[Traits] = Traits(optimal=False, stochastic=True)
    summary: ClassVar[str]
    source: ClassVar[str]
    reach: ClassVar[int]
    """Cells moved in an iteration."""

    def __post_init__(self) -> None:
        check.whole(self.name, "particles", self.particles, 1, 1000)
        check.whole(self.name, "rounds", self.rounds, 1, 1000)
        check.number(self.name, "obstacles", self.obstacles, 0.0, 100.0)
        check.one_of(self.name, "gates", self.gates, GATES)

    def open(self, scene: Scene, rng: np.random.Generator, *, record: bool = False) -> StepSession:
        """Start a session. There is no per-iteration record."""
        return StepSession(self, scene, rng)


@dataclass(frozen=True, slots=True)
class DstarLpso(StepPlanner):
    """Hybrid ("mixed") D* with lbest PSO: one cell an iteration, gates met on the way.

    After Sadiq and Hasan 2017 as the dissertation tells of it; the paper could not be found. Costs are those
    that D* holds; they are computed by the field's wavefront, which gives the same numbers.
    """

    name: ClassVar[str] = "dstar-lpso"
    summary: ClassVar[str] = "D* costs, one cell an iteration by a ring swarm (the dissertation's baseline)"
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

    particles: int = 16
    gates: str = "close"

    name: ClassVar[str] = "dstar16-lpso"
    summary: ClassVar[str] = "D* costs, two cells in 16 directions an iteration (the improved baseline)"
    source: ClassVar[str] = (
        "The improved D* with lbest PSO as the dissertation tells of it; paper not found. That 16 directions "
        "are the second ring is inferred from its tables; the rest is ours as for dstar-lpso."
    )
    reach: ClassVar[int] = 2

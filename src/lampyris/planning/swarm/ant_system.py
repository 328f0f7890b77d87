"""Ant System: every ant that arrives adds pheromone to the steps of its path."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from lampyris._core.settings import default_of, number, whole, word
from lampyris.kernels.swarm.ant_walks import LINE, RISE, STEP
from lampyris.planning.swarm.mmas_dstar import Ants, Eta, MmasDstar, power
from lampyris.planning.swarm.optimisers.box import Values
from lampyris.planning.swarm.optimisers.loop import Swarm
from lampyris.planning.swarm.pheromone import Pheromone
from lampyris.planning.swarm.search_space import Ints
from lampyris.planning.swarm.session import Decode, SwarmPlanner, Task
from lampyris.planning.swarm.walks import Paths

LEAST = 1e-12
"""Pheromone that every step keeps, so that none becomes impossible (ours)."""


@dataclass(frozen=True, slots=True)
class AntSystem(SwarmPlanner):
    """Ant System over the steps of the map, by the dissertation's equations 2.4 to 2.7.

    Each ant walks from the start, never to a cell where it has been, until it reaches the goal or is stuck. From a cell
    it takes step k with probability in proportion to ``tau_k^alpha eta_k^beta`` (2.4). After each round all pheromone
    shrinks, ``tau = (1 - rho) tau`` (2.5), and every ant that arrived adds ``1/C`` to the steps of its path, C its
    fitness (2.6, 2.7). M. Dorigo, V. Maniezzo, A. Colorni, "Ant system", IEEE Trans. SMC-B 26(1):29-41, 1996.

    The equations' ``eta = 1/d``, d the length of the step, hardly differs from step to step on a grid
    (``guide = "step"``). Ours are the default ``line``, 1 / (1 + straight distance to the goal), which ignores walls,
    and ``rise`` of ``mmas-dstar``, which uses D*'s costs. At first tau is the number of ants over the number of
    columns or rows from start to goal, whichever is greater. The number of ants is ``swarm``.

    Parameters
    ----------
    alpha, beta : weight of the pheromone and of the heuristic, 0 to 20.
    rho : evaporation, > 0 to 1.
    guide : ``line``, ``step`` or ``rise``.
    """

    alpha: int = whole(1, 0, 20, title="weight of the pheromone")
    beta: int = whole(5, 0, 20, title="weight of the heuristic")
    rho: float = number(default_of(MmasDstar, "rho"), 1e-6, 1.0, title="evaporation")
    guide: str = word("line", ("line", "step", "rise"), title="heuristic")

    name: ClassVar[str] = "ant-system"
    summary: ClassVar[str] = "Ant System: every ant that arrives adds pheromone."
    source: ClassVar[str] = (
        "Dorigo, Maniezzo and Colorni 1996, the dissertation's equations 2.4 to 2.7. Ours: walks over cells, the "
        "fitness as C, the heuristic by the straight distance to the goal, the exact seed."
    )

    def begin(self, task: Task, rng: np.random.Generator) -> tuple[Swarm[Any], Decode]:
        """See :meth:`SwarmPlanner.begin`."""
        return _SystemAnts(self, task, rng), lambda paths: paths


class _SystemAnts(Ants):
    """One run of Ant System."""

    def __init__(self, settings: AntSystem, task: Task, rng: np.random.Generator) -> None:
        super().__init__(settings.swarm, task, rng)
        self._settings = settings
        goal, unit = np.array(task.ground.scene.goal), float(task.ground.moves.unit)
        line = max(int(np.abs(goal - task.start).max()) * min(task.ground.moves.costs) / unit, 1.0)
        self.tau = Pheromone(settings.swarm / line)

    def renew(self, arrived: Ints, paths: Paths, values: Values) -> None:
        """Evaporate, and let every ant that arrived add to the steps of its path."""
        rho = self._settings.rho
        if not arrived.size:
            self.tau.renew(rho, np.zeros(0, dtype=np.int64), 0.0, LEAST, math.inf)
        for k in arrived.tolist():
            self.tau.renew(rho, self.trails(paths[k]), -1.0 / float(values[k]), LEAST, math.inf)
            rho = 0.0  # once a round

    @property
    def guide(self) -> tuple[int, int, int]:
        """See :meth:`Ants.guide`."""
        s = self._settings
        return {"line": LINE, "step": STEP, "rise": RISE}[s.guide], s.alpha, s.beta

    def weights(self, tau: Values, eta: Eta) -> Values:
        """``tau^alpha eta^beta``."""
        s = self._settings
        may = np.where(tau > 0.0, 1.0, 0.0)
        guide: Values = getattr(eta, s.guide)
        return power(power(may, tau, s.alpha), guide, s.beta)

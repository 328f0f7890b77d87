"""AD-GSO, the dissertation's planner: a glowworm walks down the luciferin of a finished field."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from lampyris.model.scene import Scene
from lampyris.planning.adgso.layers import LayeredSession
from lampyris.planning.adgso.session import AdGsoSession
from lampyris.planning.adgso.settings import AdGsoSettings
from lampyris.planning.base import Traits


@dataclass(frozen=True, slots=True)
class AdGso(AdGsoSettings):
    """Adaptive-dimensionality glowworm swarm optimisation (AD-GSO).

    One iteration opens whole Chebyshev rings around the robot X until at least ``nt`` cells are accepted, or
    ring ``mvr`` is reached. Free cells of lower luciferin are accepted if they are connected to X through accepted
    cells by legal steps. The next node is chosen among them, and reached along X's parents if they pass it,
    otherwise by the cheapest path inside the accepted cells. With moves that reach two cells (``sixteen-connected``) rings 1
    and 2 are always opened, whatever ``nt`` and ``mvr`` say, so that the parent is among the candidates.

    Parameters
    ----------
    choice : ``greedy``, the lowest luciferin (ties: least cost-to-go, y, x), as in the dissertation;
        ``roulette``, drawn with probability (luc(Y) - luc(X)) / sum, as in standard GSO; ``exact``, the least
        path + cost-to-go (ties: lowest luciferin, then y, x), which is optimal in a static map.
    nt : number of accepted cells at which the window stops growing; a threshold, not a cap. 1 to 10,000.
    mvr : greatest number of rings, the dissertation's MVR (also ML). 1 to 50.
    rho, gamma : luciferin decay, 0 < rho <= 1, and enhancement, > 0.
    gates : openings too narrow for the robot: ``ignore`` them, ``close`` them in the analysis, or ``replan``:
        detect each on arrival, seal it and repair the field. Start and goal are never sealed. An iteration that a
        gate interrupts counts, even if it did not move.
    iter_max : greatest number of jumps in one plan; None: no limit. (The walk also ends without a limit: luciferin
        falls with each jump.)
    obstacle_density_weight, window : the density of walls as a cost: a cell surrounded by walls only, up to ``window``
        cells away (1 to 50), costs ``obstacle_density_weight`` times plain ground more. 0 to 4; 0: length only.
    traffic_density_weight : the same for traffic: the additional cost of a cell that was always occupied. 0 to 4.
    min_clearance : distance to keep from walls, in cells, where a path allows it, 0 to 50; less where none does.
    max_extra : greatest share by which these settings may lengthen the path; None: no limit. They are weakened until the
        best path respects it.

    Raises
    ------
    SettingError : a setting out of its range.
    """

    # A trait has to hold for every setting. optimal: ``exact`` is, greedy is not. stochastic: only roulette
    # draws, but who asks must not take one seed's answer for another's. incremental: the field outlives
    # moving obstacles.
    traits: ClassVar[Traits] = Traits(optimal=False, incremental=True, stochastic=True)
    summary: ClassVar[str] = "AD-GSO: walks down the luciferin of the cost field through a growing window."
    source: ClassVar[str] = (
        "The dissertation's AD-GSO (algorithms 3.2-3.9). Ours: the join through accepted cells, which its "
        "Table 4.4 needs; how ties fall; repairing the field when hemmed in; choice = exact; the scales of "
        "obstacle_density_weight, traffic_density_weight and min_clearance, which it suggests as future work."
    )

    def open(
        self, scene: Scene, rng: np.random.Generator, *, record: bool = False
    ) -> AdGsoSession | LayeredSession:
        """Start a session: the field is solved at its first plan and kept.

        Parameters
        ----------
        scene : what to plan in.
        rng : one number a jump is drawn from it by ``choice = "roulette"``, in blocks; the others draw none.
        record : keep each iteration's accepted cells, probabilities and sub-path in ``Plan.jumps``.
        """
        if self.obstacle_density_weight > 0 or self.traffic_density_weight > 0 or self.min_clearance > 0:
            return LayeredSession(self, scene, rng, record=record)
        return AdGsoSession(self, scene, rng, record=record)

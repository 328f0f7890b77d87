"""Planners whose particles are waypoints: what they share besides the loop."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from typing import Any

import numpy as np

from lampyris._core.settings import whole
from lampyris.planning.swarm.encoding import Encoding, anywhere, evenly, waypoints_of
from lampyris.planning.swarm.optimisers.box import Points
from lampyris.planning.swarm.optimisers.loop import Optimiser, Swarm
from lampyris.planning.swarm.search_space import Ints
from lampyris.planning.swarm.session import Decode, SwarmPlanner, Task

SCATTER = 4.0
"""Half of a seeded swarm begins near the seed: in each coordinate within half of so many cells of it."""
ASTRAY = 0.5
"""Half of any other begins near evenly spaced waypoints: within half of that share of the map's side."""


@dataclass(frozen=True, slots=True)
class WaypointPlanner(SwarmPlanner):
    """A planner that moves waypoints in the unit box of the map. Abstract.

    A particle is ``waypoints`` places on the map; each is moved to the nearest cell from which the goal can
    be reached, and straight grid lines join them. A seeded swarm may take more: as many as it needs to write
    the exact path down at its exact cost, which is the first particle; in other swarms that is the straight
    line, evenly divided. Half of the swarm begins near the first, the rest anywhere.

    Parameters
    ----------
    waypoints : places of a particle, 1 to 200.
    """

    waypoints: int = whole(5, 1, 200)

    def encoding(self, task: Task, base: Ints) -> Encoding:
        """How particles become waypoints; ``base`` are those of the seed, or evenly spaced ones, (k, 2)."""
        return anywhere(task.ground, base)

    @abstractmethod
    def optimiser(self, task: Task, encoding: Encoding) -> Optimiser:
        """What moves the particles."""

    def begin(self, task: Task, rng: np.random.Generator) -> tuple[Swarm[Any], Decode]:
        """See :meth:`SwarmPlanner.begin`."""
        ground = task.ground
        if task.seed is None:
            base = evenly(task.start, np.array(ground.scene.goal, dtype=np.int64), self.waypoints)
        else:
            base = waypoints_of(ground, task.seed, self.waypoints)
        encoding = self.encoding(task, base)
        swarm = self.optimiser(task, encoding).start(
            encoding.box, rng, self._first(task, encoding, base, rng)
        )
        return swarm, lambda particles: encoding.lines(ground, task.start, particles)

    def _first(self, task: Task, encoding: Encoding, base: Ints, rng: np.random.Generator) -> Points:
        """Half of the swarm: the base, and others near it."""
        one = encoding.of(base)
        draws = rng.random(((self.swarm - 1) // 2, one.shape[1])) - 0.5
        apart = ASTRAY if task.seed is None else SCATTER / encoding.sides
        near = np.minimum(np.maximum(one + apart * draws, 0.0), 1.0)
        return np.concatenate((one, near))

"""The work arrays that the kernels of PIBT and LaCAM* share."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from lampyris.planning.fleet.distance_tables import FleetTables


class StepWork:
    """Arrays of one call of :func:`lampyris.kernels.fleet.pibt.step`.

    Parameters
    ----------
    tables : the fleet.
    rng : the state of the kernels' generator is drawn from it.
    """

    def __init__(self, tables: FleetTables, rng: np.random.Generator) -> None:
        robots, cells = len(tables.goals), tables.graph.cells

        def numbers(n: int, value: int = 0) -> NDArray[np.int32]:
            return np.full(n, value, dtype=np.int32)

        self.now = tables.starts.copy()
        self.following, self.best = numbers(robots), numbers(robots)
        self.occupant = numbers(cells, -1)
        self.reserved = np.zeros(2 * cells, dtype=np.uint8)
        places = tables.graph.places_of_step
        self.choice, self.turn = numbers(places * robots), numbers(robots)
        self.partner, self.stack = numbers(robots), numbers(robots)
        self.key = np.zeros(places, dtype=np.int64)
        self.random = np.array([int(rng.integers(1, 2**32))], dtype=np.int64)

    @property
    def rest(self) -> tuple[NDArray[Any], ...]:
        """What comes behind ``following`` (and ``best``) in every call."""
        return (
            self.occupant, self.reserved, self.choice, self.key, self.turn, self.partner, self.stack, self.random,
        )  # fmt: skip


def generator(seed: int) -> np.random.Generator:
    """The generator of a planner's draws."""
    return np.random.Generator(np.random.PCG64(seed))

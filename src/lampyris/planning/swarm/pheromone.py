"""Pheromone of an ant system, for the steps that ants went alone."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from lampyris._core.arrays import distinct
from lampyris._core.cancellation import checkpoint
from lampyris.planning.swarm.optimisers.box import Values
from lampyris.planning.swarm.search_space import Ints
from lampyris.planning.swarm.walks import PART, Paths, parts

SORTED = 1 << 13
"""Steps of a walk up to which they are sorted: 0.1 ms."""


class Pheromone:
    """tau of every step of a map, of which few ever differ from the rest.

    Evaporation and limits are the same for all, so steps to which no ant has added share one value, and only
    the others are kept: a map of four million cells takes no more memory than the paths that were found.

    Attributes
    ----------
    rest : tau of every step not in ``trails``.
    trails, values : int64 (n,), ascending, and float64 (n,); steps as cell * steps + step, and their tau.
    """

    def __init__(self, tau: float) -> None:
        self.rest = tau
        self.trails: Ints = np.zeros(0, dtype=np.int64)
        self.values: Values = np.zeros(0)

    def at(self, trails: Ints) -> Values:
        """tau of steps, same shape."""
        if not self.trails.size:
            return np.full(trails.shape, self.rest)
        k = np.minimum(np.searchsorted(self.trails, trails), self.trails.size - 1)
        return np.where(self.trails[k] == trails, self.values[k], self.rest)

    def renew(self, rho: float, trails: Ints, more: float, least: float, most: float) -> None:
        """Evaporate, add ``more`` to some steps (ascending, each once), and keep all within the limits."""
        old = self.trails
        known = np.empty(old.size + trails.size, dtype=np.int64)
        values = np.empty(known.size)
        # Both lists are cut at the same steps, and merged stretch by stretch.
        cuts = distinct(np.concatenate((old[PART::PART], trails[PART::PART])))
        end = 0
        bounds = ([0, *np.searchsorted(some, cuts).tolist(), some.size] for some in (old, trails))
        for (a, b), (c, d) in zip(*map(pairwise, bounds), strict=True):
            checkpoint()
            some = distinct(np.concatenate((old[a:b], trails[c:d])))
            tau = np.full(some.size, self.rest)
            tau[np.searchsorted(some, old[a:b])] = self.values[a:b]
            tau *= 1.0 - rho
            tau[np.searchsorted(some, trails[c:d])] += more
            since, end = end, end + some.size
            known[since:end], values[since:end] = some, np.minimum(np.maximum(tau, least), most)
        self.trails, self.values = known[:end], values[:end]
        self.rest = min(max(self.rest * (1.0 - rho), least), most)


def trails_of(path: Paths, cells: int, steps: int) -> Ints:
    """The steps of one walk that is on no cell twice, as cell * steps + step, ascending; int64 (n,).

    Long ones by counting: sorting half a million at once took 30 ms or more.
    """
    if path.steps <= SORTED:
        few: Ints = np.sort(path.at * steps + path.step)
        return few
    taken = np.empty(cells, dtype=np.int8)
    for part in parts(cells):
        taken[part] = -1
    for part in parts(path.steps):
        taken[path.at[part]] = path.step[part]
    trails, end = np.empty(path.steps, dtype=np.int64), 0
    for part in parts(cells):
        here = np.flatnonzero(taken[part] >= 0) + part.start
        trails[end : end + here.size] = here * steps + taken[here]
        end += here.size
    return trails

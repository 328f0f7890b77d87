"""Thresholds found by a swarm, the dissertation's way (sections 1.4 and 2.4.3).

A glowworm or particle is k numbers from 0 to 255; sorted and rounded they are thresholds, and their worth is the value
that it looks for. GSO: Krishnanand and Ghose 2009 with step 2 and sensor range 125. IGSO changes radius, selection
and step, as He and Huang 2016 (Math. Probl. Eng. 3196958) do for colour thresholds; their formulas could not be found,
and those used are ours: a range as wide as the box, a step that shrinks, the brightest try places at random.
"""

from __future__ import annotations

import numpy as np

from lampyris.model.photos.segmented_photo import LEVELS
from lampyris.photos.criteria import Levels, Worth, scores
from lampyris.planning.swarm.optimisers.box import Box, Points, Values
from lampyris.planning.swarm.optimisers.glowworm import GSO, igso
from lampyris.planning.swarm.optimisers.loop import Optimiser, StoppingRule, maximise
from lampyris.planning.swarm.optimisers.particle import PSO
from lampyris.planning.swarm.optimisers.steps import FixedStep

SWARM = 50
"""Glowworms or particles."""
ROUNDS = 200
SENSOR, STEP = 125.0, 2.0
"""Sensor range and step of GSO, levels."""
FIRST_STEP, WANDER = 20.0, 0.1
"""Of IGSO: the first step, levels (the last is a thirtieth of it), and the sides of the box that the brightest try."""
EMPTY = -1e3
"""Value of thresholds with a class that has no pixels: below all others."""


def optimiser_of(method: str) -> Optimiser:
    """What moves the swarm: ``gso``, ``igso`` or ``pso``."""
    if method == "gso":
        return GSO(n=SWARM, sensor=SENSOR, step=FixedStep(STEP))
    if method == "igso":
        return igso(SWARM, float(ROUNDS), FIRST_STEP, WANDER)
    return PSO(n=SWARM)


def thresholds_of(points: Points) -> Levels:
    """The thresholds that points of the box mean, int64 (n, k), ascending."""
    return np.sort(np.rint(points).astype(np.int64), axis=1)


def swarm_thresholds(worth: Worth, k: int, method: str, rng: np.random.Generator) -> tuple[int, ...] | None:
    """The best thresholds that a swarm found in :data:`ROUNDS` rounds; None: each it tried had an empty class."""

    def value(points: Points) -> Values:
        found = scores(worth, thresholds_of(points))
        return np.where(np.isfinite(found), found, EMPTY)

    box = Box(np.zeros(k), np.full(k, LEVELS - 1.0))
    found = maximise(optimiser_of(method).start(box, rng), value, StoppingRule(ROUNDS))
    if found.value <= EMPTY:
        return None
    return tuple(thresholds_of(found.best[np.newaxis])[0].tolist())

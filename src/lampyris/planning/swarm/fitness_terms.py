"""What a path is worth: one list of fitness terms, shared by every swarm planner.

A term is a small function of whole numbers: from a batch of n paths to one whole number each. The fitness, to
be made least, is the sum of weight times term, in cells of plain ground, added in the order of the list.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from lampyris.planning.swarm.search_space import THOUSAND, Ints, SearchSpace
from lampyris.planning.swarm.walks import LineWalks, Paths, WalkBatch


def length(ground: SearchSpace, paths: Paths) -> Ints:
    """Exact cost of the steps on plain ground."""
    return paths.total(ground.plain(paths.step))


def terrain(ground: SearchSpace, paths: Paths) -> Ints:
    """Exact cost that the terrain of the cells entered adds to it."""
    return paths.total(ground.toll(paths.at, paths.step))


def blocked(ground: SearchSpace, paths: Paths) -> Ints:
    """Steps that may not be made, and those by which a path falls short of the goal."""
    return paths.total((~paths.legal).astype(np.int64)) + paths.missing


def clearance(ground: SearchSpace, paths: Paths) -> Ints:
    """How near walls are to the cells entered, thousandths a cell (:attr:`SearchSpace.nearness`)."""
    return paths.total(ground.nearness[paths.at + ground.jump[paths.step]])


def turns(ground: SearchSpace, paths: Paths) -> Ints:
    """All changes of direction on the path, in sixteenths of a turn."""
    change = np.zeros_like(paths.step)
    change[1:] = ground.turn[paths.step[:-1], paths.step[1:]]
    change[paths.first[:-1]] = 0
    return paths.total(change)


Term = Callable[[SearchSpace, Paths], Ints]

TERMS = MappingProxyType(
    {"length": length, "terrain": terrain, "blocked": blocked, "clearance": clearance, "turns": turns}
)
"""Every term by the name of its weight."""


@dataclass(frozen=True, slots=True)
class Weights:
    """What each term counts; a length counts 1, so that all are in cells.

    Parameters
    ----------
    terrain : a cell of extra cost on terrain; 1 makes length and terrain the exact cost.
    blocked : a step that may not be made.
    clearance : a cell entered right beside a wall, less in proportion up to two cells away.
    turns : an eighth of a turn.
    """

    terrain: float = 1.0
    blocked: float = 10.0
    clearance: float = 0.1
    turns: float = 0.05


@dataclass(frozen=True, slots=True, eq=False)
class Score:
    """A batch of paths, judged.

    Parameters
    ----------
    fitness : float64 (n,), in cells; the less the better.
    exact : int64 (n,); exact cost.
    legal : bool (n,); whether every step may be made and the goal is reached.
    """

    fitness: NDArray[np.float64]
    exact: Ints
    legal: NDArray[np.bool_]


def _sums(ground: SearchSpace, batch: WalkBatch, names: list[str]) -> dict[str, Ints]:
    """Each term of each walk."""
    if isinstance(batch, LineWalks):
        made = batch.sums(near="clearance" in names)
        if made is not None:
            return dict(zip(TERMS, made.T, strict=True))
    sums = {name: np.zeros(len(batch), dtype=np.int64) for name in names}
    for piece in batch.pieces():
        for name in names:
            sums[name][piece.walks] += TERMS[name](ground, piece.paths)
        if "turns" in sums and piece.before >= 0:
            sums["turns"][piece.walk] += ground.turn[piece.before, piece.paths.step[0]]
    return sums


def score(ground: SearchSpace, batch: WalkBatch, weights: Weights) -> Score:
    """Fitness, exact cost and legality of each walk. Terms of weight 0 are not worked out."""
    unit = float(ground.moves.unit)
    names = ["length", "terrain", "blocked"]
    names += [name for name in ("clearance", "turns") if getattr(weights, name) > 0]
    sums = _sums(ground, batch, names)
    plain, extra, shut = sums["length"], sums["terrain"], sums["blocked"] + batch.missing
    fitness = plain / unit + weights.terrain * (extra / unit) + weights.blocked * shut
    if weights.clearance > 0:
        fitness = fitness + weights.clearance * (sums["clearance"] / THOUSAND)
    if weights.turns > 0:
        fitness = fitness + weights.turns * (sums["turns"] / 2.0)
    return Score(fitness, plain + extra, shut == 0)

"""Mobility: a crowd by one word and a number, as specifications of traffic."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from lampyris.errors import SettingError, UsageError, did_you_mean
from lampyris.halting import uninterrupted
from lampyris.model.grid import Grid
from lampyris.model.scene import Scene
from lampyris.model.traffic import Crossing, Patrol, RandomWalk, Traffic
from lampyris.sim.placing import Placing
from lampyris.sim.space import Space, robot_shape
from lampyris.sim.world import World
from lampyris.typing import Cell

MOBILITIES = ("random-walk", "patrol", "crossing", "mixed")

APART = 12
"""Cells along either axis that the two ends of a patrol are apart, at most."""

_TRIES = 200
"""Draws for each patrol before the map is called full."""

_STREAM = 0x9A7901
"""Second number of the seed of patrols, so that their draws are nobody else's."""


def crowd(
    kind: str,
    count: int,
    grid: Grid,
    seed: int,
    *,
    rate: float | None = None,
    radius: float = 0.0,
    fit: Scene | None = None,
) -> tuple[Traffic, ...]:
    """So many moving obstacles of a kind: crossing ones first, then patrols, then random walkers.

    Parameters
    ----------
    kind : one of :data:`MOBILITIES`, or ``none``. ``mixed``: a third of each, random walkers what is left.
    count : how many.
    grid, seed : where patrols go is drawn here; the others are drawn by the simulation.
    rate : chance a tick that a random walker appears; None: all are there from the start.
    radius : metres.
    fit : patrols that this scene would refuse (over its start or goal, over one another, with no way for
        their size and its moves) are not taken. None: they are drawn on the map as it is, whatever it is for.

    Raises
    ------
    SettingError : ``MOBILITY``: no such kind. A count, rate or radius out of its range.
    LimitError : more obstacles than a simulation may have.
    UsageError : ``OPTIONS``: a rate without random walkers; patrols that do not fit the map.
    """
    if kind not in (*MOBILITIES, "none"):
        raise SettingError(
            "MOBILITY", f"{kind!r}", where="kind", allowed=", ".join((*MOBILITIES, "none")),
            todo=did_you_mean(kind, MOBILITIES),
        )  # fmt: skip
    RandomWalk(count, rate, radius)  # refuses what is out of range, whatever the kind
    if rate is not None and kind not in ("random-walk", "mixed"):
        raise UsageError("OPTIONS", f"a rate with {kind}", where="rate", allowed="random walkers")
    third = count // 3
    walk, patrol, crossing = {
        "none": (0, 0, 0),
        "random-walk": (count, 0, 0),
        "patrol": (0, count, 0),
        "crossing": (0, 0, count),
        "mixed": (count - 2 * third, third, third),
    }[kind]
    made: list[Traffic] = [Crossing(crossing, radius)] if crossing else []
    made += patrols(patrol, grid, seed, radius=radius, fit=fit)
    made += [RandomWalk(walk, rate, radius)] if walk else []
    return tuple(made)


def patrols(
    count: int, grid: Grid, seed: int, *, radius: float = 0.0, fit: Scene | None = None
) -> list[Traffic]:
    """Patrols between random cells of one region, a dozen cells or so apart; see :func:`crowd`.

    Raises
    ------
    UsageError : ``OPTIONS``: they do not fit the map.
    """
    if not count:
        return []
    with uninterrupted():
        from scipy.ndimage import label  # bits: whole numbers in, whole numbers out

    rng = np.random.Generator(np.random.PCG64(np.random.SeedSequence((seed, _STREAM))))
    region, _ = label(~grid.blocked, structure=np.ones((3, 3)))
    ys, xs = np.nonzero(region)
    if not len(xs):
        raise UsageError("OPTIONS", f"{count} patrols on a map without a free cell", allowed="0")
    made: list[Traffic] = []
    taken: set[Cell] = set()
    fits = None if fit is None else _fitting(fit, radius)
    for _ in range(count * _TRIES):
        if len(made) == count:
            return made
        i = int(rng.integers(len(xs)))
        a = (int(xs[i]), int(ys[i]))
        near = np.nonzero(
            (np.maximum(np.abs(xs - a[0]), np.abs(ys - a[1])) <= APART)
            & (region[ys, xs] == region[a[1], a[0]])
        )[0]
        j = int(near[int(rng.integers(len(near)))])
        b = (int(xs[j]), int(ys[j]))
        if a == b or {a, b} & taken or (fits is not None and not fits(a, b)):
            continue
        taken |= {a, b}
        made.append(Patrol((a, b), radius))
    raise UsageError("OPTIONS", f"{count} patrols do not fit this map", allowed=f"about {len(made)}")


def _fitting(scene: Scene, radius: float) -> Callable[[Cell, Cell], bool]:
    """Whether one more patrol between two cells fits a scene, beside those that were found to fit before."""
    space = Space(scene.grid)
    world = World(space, robot_shape(scene, space), space.number(scene.start))
    placing = Placing(replace(scene, traffic=()), world, 0)
    shape = placing.shape(radius)

    def fits(a: Cell, b: Cell) -> bool:
        if not (shape.open[a[1], a[0]] and shape.open[b[1], b[0]]):
            return False
        number = space.number(a)
        if not placing.trial.fits(shape, number) or placing.way(shape, a, b) is None:
            return False
        placing.hold(0, shape, number)
        return True

    return fits

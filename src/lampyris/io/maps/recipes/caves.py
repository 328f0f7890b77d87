"""Caves: a cellular automaton that rounds noise off."""

from __future__ import annotations

import numpy as np

from lampyris.io.maps.recipes.draw import Draw
from lampyris.io.maps.recipes.recipe import RecipeSetting
from lampyris.io.maps.recipes.regions import keep_largest
from lampyris.typing import BoolGrid

SETTINGS = (
    RecipeSetting(
        "fill", 0.47, 0.0, 1.0, "share of rock before the first round; from about 0.5 on little is left"
    ),
    RecipeSetting("rounds", 5, 0, 100, "how often every cell follows the majority around it"),
    RecipeSetting(
        "doublings", 0, 0, 8, "how often the caves are then enlarged to twice their size and worn again"
    ),
)
WORN = 0.2
"""Share of the cells that turn over before an enlarged cave is smoothed, or its edges would stay square."""


def caves(draw: Draw, width: int, height: int, *, fill: float, rounds: int, doublings: int) -> BoolGrid:
    """Noise in which every cell becomes what most of the 3 x 3 cells around it are, so many times.

    Outside the map is rock. Of the caves that come out the largest is kept. Larger halls are made small and
    enlarged: coarser noise would not do, as its squares meet at corners and fall apart into small caves.
    """
    size = 1 << doublings
    rock = _smooth(draw.units(-(-height // size), -(-width // size)) < fill, rounds)
    for _ in range(doublings):
        rock = rock.repeat(2, axis=0).repeat(2, axis=1)
        rock = _smooth(rock ^ (draw.units(*rock.shape) < WORN), 2)
    return keep_largest(rock[:height, :width])


def _smooth(rock: BoolGrid, rounds: int) -> BoolGrid:
    """Every cell becomes what most of the nine cells around it are, so many times."""
    for _ in range(rounds):
        edge = np.pad(rock, 1, constant_values=True).astype(np.uint8)
        rows = edge[:-2] + edge[1:-1] + edge[2:]
        rock = rows[:, :-2] + rows[:, 1:-1] + rows[:, 2:] > 4
    return rock

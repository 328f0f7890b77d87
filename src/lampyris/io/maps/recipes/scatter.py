"""Cells blocked one by one: the random grids of the path planning literature."""

from __future__ import annotations

from lampyris.io.maps.recipes.draw import Draw
from lampyris.io.maps.recipes.recipe import RecipeSetting
from lampyris.typing import BoolGrid

SETTINGS = (RecipeSetting("density", 0.2, 0.0, 1.0, "probability that a cell is blocked"),)


def scatter(draw: Draw, width: int, height: int, *, density: float) -> BoolGrid:
    """Each cell is blocked with the same probability, whatever its neighbours are.

    Free cells may be cut off: from a density of about 0.41 on, most are (the site percolation threshold of
    the square lattice by sides is 0.593 free).
    """
    return draw.units(height, width) < density

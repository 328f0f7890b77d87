"""Where a search has headings: spheres (discs of cells), and the tunnel around a path."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lampyris.planning.lattice.map import LatticeMap
from lampyris.typing import Cell

WELL_INSIDE = 0.75
"""A place within this share of a sphere's radius makes the sphere grow; nearer to its rim there is a new one."""


@dataclass(frozen=True, slots=True)
class Sphere:
    """A disc of cells in which the search has headings.

    Parameters
    ----------
    cell : its centre.
    radius : cells.
    """

    cell: Cell
    radius: float

    def holds(self, cell: Cell, share: float = 1.0) -> bool:
        """Whether a cell lies within a share of the radius."""
        dx, dy = cell[0] - self.cell[0], cell[1] - self.cell[1]
        most = share * self.radius
        return dx * dx + dy * dy <= most * most


class Spheres:
    """The spheres of a plan; they never shrink.

    Parameters
    ----------
    radius : of a new one, cells.
    growth : factor by which one grows.
    """

    def __init__(self, radius: float, growth: float) -> None:
        self.radius, self._growth = radius, growth
        self.all: list[Sphere] = []

    def add_or_grow(self, cell: Cell) -> None:
        """Let a sphere that holds a cell well inside it grow, or add one around the cell."""
        for k, one in enumerate(self.all):
            if one.holds(cell, WELL_INSIDE):
                self.all[k] = Sphere(one.cell, one.radius * self._growth)
                return
        self.all.append(Sphere(cell, self.radius))

    def hold(self, cell: Cell, radius: float) -> None:
        """Add a sphere around a cell unless there is one of that size."""
        if not any(one.cell == cell and one.radius >= radius for one in self.all):
            self.all.append(Sphere(cell, radius))

    def mark(self, inside: NDArray[np.uint8], lattice_map: LatticeMap) -> None:
        """Set ``inside`` (cells,) to 1 in the spheres and to 0 elsewhere."""
        inside[:] = 0
        for one in self.all:
            inside[cells_of_sphere(one, lattice_map)] = 1


def cells_of_sphere(one: Sphere, lattice_map: LatticeMap) -> NDArray[np.int64]:
    """The indices of the cells of a sphere that lie on the map, rising."""
    grid = lattice_map.grid
    (cx, cy), r = one.cell, math.floor(one.radius)
    xs = np.arange(max(cx - r, 0), min(cx + r, grid.width - 1) + 1)
    ys = np.arange(max(cy - r, 0), min(cy + r, grid.height - 1) + 1)
    dx, dy = xs - cx, ys - cy
    disc = dx[None, :] * dx[None, :] + dy[:, None] * dy[:, None] <= one.radius * one.radius
    index = (ys[:, None] + lattice_map.border) * lattice_map.stride + xs[None, :] + lattice_map.border
    found: NDArray[np.int64] = index[disc]
    return found


class Tunnel:
    """The cells within a distance of a path or in a sphere, each with the number of its nearest place on the path.

    A cell that only a sphere holds has the place that is nearest to the sphere's centre.

    Parameters
    ----------
    path : cells of the map.
    width : half its width, cells.
    lattice_map : the map.
    spheres : cells of these belong to it too.

    Attributes
    ----------
    cells : int64 (n,): indices of its cells.
    place : int32 (n,): number of the nearest cell of the path, the later of two as near.
    """

    def __init__(
        self, path: Sequence[Cell], width: float, lattice_map: LatticeMap, spheres: Iterable[Sphere] = ()
    ) -> None:
        grid, reach = lattice_map.grid, math.floor(width)
        side = np.arange(-reach, reach + 1)
        dx, dy = (part.ravel() for part in np.meshgrid(side, side))
        away = dx * dx + dy * dy
        near = away <= width * width
        dx, dy, away = dx[near], dy[near], away[near]
        at = np.array(path, dtype=np.int64)
        x, y = at[:, :1] + dx, at[:, 1:] + dy
        inside = (x >= 0) & (x < grid.width) & (y >= 0) & (y < grid.height)
        index = (y + lattice_map.border) * lattice_map.stride + x + lattice_map.border
        place = np.broadcast_to(np.arange(len(at))[:, None], index.shape)
        index, place, rank = index[inside], place[inside], np.broadcast_to(away, index.shape)[inside]
        for one in spheres:
            held = cells_of_sphere(one, lattice_map)
            d = at - np.array(one.cell)
            nearest = int((d * d).sum(axis=1)[::-1].argmin())
            index = np.concatenate((index, held))
            place = np.concatenate((place, np.full(len(held), len(at) - 1 - nearest)))
            rank = np.concatenate((rank, np.full(len(held), 2 * reach * reach + 1)))
        order = np.lexsort((-place, rank, index))
        ordered = index[order]
        first = np.ones(len(ordered), dtype=np.bool_)
        first[1:] = ordered[1:] != ordered[:-1]
        self.width = width
        self.path = tuple(path)
        self.cells: NDArray[np.int64] = ordered[first]
        self.place: NDArray[np.int32] = place[order][first].astype(np.int32)

    def __contains__(self, cell: int) -> bool:
        k = int(np.searchsorted(self.cells, cell))
        return k < len(self.cells) and int(self.cells[k]) == cell

    def meets(self, one: Sphere) -> bool:
        """Whether the path passes through a sphere."""
        return any(map(one.holds, self.path))

    def place_of(self, cells: Iterable[int]) -> NDArray[np.int32]:
        """The number of the nearest place on the path for cells of the tunnel, by their indices."""
        found: NDArray[np.int32] = self.place[np.searchsorted(self.cells, np.array(list(cells)))]
        return found

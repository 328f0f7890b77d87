"""Mobility: traffic by one word and a number of obstacles, as specifications."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from lampyris._core.cancellation import uninterrupted
from lampyris.errors import SceneError, SettingError, UsageError, did_you_mean, shown
from lampyris.kernels.simulation.draws import PLACE, TRIES
from lampyris.model.grid import Grid
from lampyris.model.robot import Polygon
from lampyris.model.scene import Scene
from lampyris.model.traffic import Crossing, ObstacleSpec, Patrol, RandomWalk, Recorded
from lampyris.planning.field.layers import free_cells
from lampyris.sim.traffic.obstacle_draws import PATROLS, first_of, key_of, ranks, uniforms
from lampyris.sim.traffic.placing import Placing
from lampyris.sim.traffic.separation import beside_lanes
from lampyris.sim.world.cell_index import CellIndex, robot_shape
from lampyris.sim.world.world import Occupancy
from lampyris.typing import BoolGrid, Cell

MOBILITIES = ("random-walk", "patrol", "crossing", "mixed")

APART = 12
"""Cells along either axis that the two ends of a patrol are apart, at most."""

_WIDE = 2 * APART + 1


def drawn_traffic(
    kind: str,
    count: int,
    grid: Grid,
    seed: int,
    *,
    rate: float | None = None,
    radius: float = 0.0,
    footprint: Polygon | None = None,
    fit: Scene | None = None,
) -> tuple[ObstacleSpec, ...]:
    """So many moving obstacles of a kind: crossing ones first, then patrols, then random walkers.

    Parameters
    ----------
    kind : one of :data:`MOBILITIES`, or ``none``. ``mixed``: a third of each, random walkers what is left.
    count : how many.
    grid, seed : where patrols go is drawn here; the others are drawn by the simulation.
    rate : chance a tick that a random walker appears; None: all are there from the start.
    radius : metres.
    footprint : outline of each, as of :class:`lampyris.model.traffic.RandomWalk`; None: discs.
    fit : patrols that this scene, with what moves there already, would refuse (over its start or goal, over
        one another, with no path for their size and its moves) are not taken. None: they are drawn on the map
        as it is, for their size, whatever it is for.

    Raises
    ------
    SettingError : ``MOBILITY``: no such kind. A count, rate or radius out of its range.
    LimitError : more obstacles than a simulation may have.
    UsageError : ``OPTIONS``: a rate without random walkers.
    SceneError : ``OBSTACLE_ROOM``: patrols that do not fit the map; it says how many do.
    """
    if kind not in (*MOBILITIES, "none"):
        raise SettingError(
            "MOBILITY", shown(kind), where="kind", allowed=", ".join((*MOBILITIES, "none")),
            todo=did_you_mean(kind, MOBILITIES), setting="mobility",
        )  # fmt: skip
    radius = RandomWalk(
        count, rate, radius, footprint=footprint
    ).radius  # refuses what is out of range, whatever the kind
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
    made: list[ObstacleSpec] = [Crossing(crossing, radius, footprint)] if crossing else []
    made += [replace(one, footprint=footprint) for one in patrols(patrol, grid, seed, radius=radius, fit=fit)]
    made += [RandomWalk(walk, rate, radius, footprint=footprint)] if walk else []
    return tuple(made)


def patrols(
    count: int, grid: Grid, seed: int, *, radius: float = 0.0, fit: Scene | None = None
) -> list[ObstacleSpec]:
    """Patrols between random cells of one region, a dozen cells or so apart; see :func:`drawn_traffic`.

    Each draws for itself: a cell of the map that is painted, or a patrol more, moves only those that it
    concerns. Where chance finds no pair of cells, all cells that are left are looked at.

    Raises
    ------
    SceneError : ``OBSTACLE_ROOM``: they do not fit the map.
    """
    if not count:
        return []
    room = _Room(grid, radius, fit)
    key = key_of(seed, PATROLS, 0)
    made: list[ObstacleSpec] = []
    for own in range(count):
        ends = room.draw(key, own)
        if ends is None:
            raise SceneError(
                "OBSTACLE_ROOM",
                f"{len(made)} of {count} patrols fit on the map",
                allowed="no more than the map has room for",
                todo="ask for fewer or smaller ones",
                setting="traffic.count",
            )
        made.append(Patrol(ends, radius))
    return made


class _Room:
    """Where patrols fit: the check of the simulation itself, asked before they are made.

    Parameters
    ----------
    fit : the scene that they are for, with all that moves there already; None: an empty map.
    """

    def __init__(self, grid: Grid, radius: float, fit: Scene | None) -> None:
        with uninterrupted():
            from scipy.ndimage import label  # bits: whole numbers in, whole numbers out

        self._placing: Placing | None = None
        if fit is None:
            self._open = free_cells(grid, radius)
            cutting = False
        else:
            space = CellIndex(fit.grid)
            world = _LaneWorld(space, robot_shape(fit, space), space.number(fit.start))
            world.resolution = grid.resolution
            self._placing = Placing(fit, world, 0)
            self._placing.given()
            self._shape = self._placing.shape(radius)
            self._open, cutting = self._shape.open, self._shape.corner_cutting
        # Who cuts no corners goes round them by straight steps.
        around = np.ones((3, 3)) if cutting else np.array([[0, 1, 0], [1, 1, 1], [0, 1, 0]])
        self._region, _ = label(self._open, structure=around)
        self._taken = np.zeros(self._open.shape, dtype=np.bool_)

    def draw(self, key: int, own: int) -> tuple[Cell, Cell] | None:
        """The ends of one more patrol, drawn; None: no two cells fit."""
        who = np.array([own], dtype=np.int64)
        height, width = self._open.shape
        u = uniforms(key, PLACE, who, np.arange(4 * TRIES + 2, dtype=np.int64)).tolist()
        for k in range(TRIES):
            a = (int(u[4 * k] * width), int(u[4 * k + 1] * height))
            if self._begins(a):
                b = (a[0] + int(u[4 * k + 2] * _WIDE) - APART, a[1] + int(u[4 * k + 3] * _WIDE) - APART)
                if self._joins(a, b):
                    return self._take(a, b)
        cells = np.flatnonzero(self._open & ~self._taken)
        for number in cells[np.argsort(ranks(cells, u[-2]), kind="stable")].tolist():
            a = (number % width, number // width)
            near = self._near(a)
            if len(near) and self._begins(a):
                y, x = divmod(first_of(near, u[-1]), width)
                return self._take(a, (x, y))
        return None

    def _near(self, a: Cell) -> NDArray[np.int64]:
        """Numbers of the cells where a patrol that begins at ``a`` may turn."""
        x, y = a
        left, top = max(x - APART, 0), max(y - APART, 0)
        part = (slice(top, y + APART + 1), slice(left, x + APART + 1))
        ys, xs = np.nonzero((self._region[part] == self._region[y, x]) & ~self._taken[part])
        numbers = (ys + top) * self._open.shape[1] + xs + left
        return np.asarray(numbers[numbers != y * self._open.shape[1] + x])

    def _begins(self, a: Cell) -> bool:
        x, y = a
        if not self._open[y, x] or self._taken[y, x]:
            return False
        placing = self._placing
        return placing is None or placing.trial.fits(self._shape, placing.space.number(a))

    def _joins(self, a: Cell, b: Cell) -> bool:
        height, width = self._open.shape
        if a == b or not (0 <= b[0] < width and 0 <= b[1] < height):
            return False
        same = self._region[b[1], b[0]] == self._region[a[1], a[0]]
        return bool(same and not self._taken[b[1], b[0]])

    def _take(self, a: Cell, b: Cell) -> tuple[Cell, Cell]:
        for x, y in (a, b):
            self._taken[y, x] = True
        if self._placing is not None:
            self._placing.hold(0, self._shape, self._placing.space.number(a))
        return a, b


class _LaneWorld(Occupancy):
    """A world in which others keep as far from recorded tracks as in a drive: what fits here fits both."""

    resolution = 1.0

    def lane_bars(self, tracks: Sequence[Recorded], radius: float) -> BoolGrid | None:
        if not tracks:
            return None
        return beside_lanes(self.space, tracks, max(radius / self.resolution, 0.5), self.resolution)

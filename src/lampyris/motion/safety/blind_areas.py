"""Blind areas: slow enough to stop within what can be seen, should something come out of what cannot.

After Tsubasa et al. (dissertation, related work, [71]), who choose the path as well, by the time that it
takes; here the path is given. Their formulas could not be found: the law is the literature's bound on speed
by the range of vision, with a reaction time and an obstacle that comes the other way; what counts as a blind area
is ours. Equations, guarantee and limits: docs/speed/blind_area.md.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from lampyris._core.defaults import CREEP
from lampyris._core.settings import check_settings, number, under_code, word
from lampyris.errors import SettingError
from lampyris.kernels.motion.visibility import UNIT, cells_in_sight, nearest_hiding
from lampyris.model.grid import Grid, frozen
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.motion.cap_values import Around, Cap
from lampyris.motion.geometry.sampled_path import SampledPath
from lampyris.motion.geometry.shape_clearance import radius_along
from lampyris.typing import BoolGrid, Cell, Floats

_HALF = UNIT // 2

UNKNOWN: Final = "dark"
"""What an unknown cell is where nothing else is said."""


@dataclass(frozen=True, slots=True)
class BlindArea:
    """Settings of the law.

    Parameters
    ----------
    hidden_speed : top speed of what may be hidden, m/s.
    hidden_radius : its radius, metres; what it cannot get out of hides nothing. No smaller obstacle is meant.
    reaction : seconds from its being seen until the robot brakes; the robot may still be accelerating then.
    reach : how far the robot sees, metres; None: as far as it matters.
    unknown : what an unknown cell is: ``dark`` (nothing is seen through it, and it may hold an obstacle) or
        ``map`` (free or a wall, as the map is read).
    creep : share of v_max that no blind area takes away, 0 < creep <= 1.

    Raises
    ------
    SettingError : ``LAW_SETTING``.
    """

    hidden_speed: float = number(1.0, 0.0, 1e3, unit="m/s")
    hidden_radius: float = number(0.2, 0.0, 1e3, unit="m")
    reaction: float = number(0.2, 0.0, 1e3, unit="s")
    reach: float | None = number(None, 1e-6, 1e6, unit="m", none="as far as it matters", title="sight")
    unknown: Literal["dark", "map"] = word(UNKNOWN, ("dark", "map"), title="unknown cells")
    creep: float = number(CREEP, 1e-6, 1.0, title="share of speed always left")

    def __post_init__(self) -> None:
        check_settings(self, under_code("LAW_SETTING", "physical.blind."))


def stop_within(
    distance: Floats, *, d_max: float, reaction: float, hidden_speed: float, a_max: float
) -> Floats:
    """Slow enough that an obstacle which turns up at some distance cannot meet the robot before it stands; m/s.

    Parameters
    ----------
    distance : metres between the two surfaces when it turns up; infinity allowed; (n,).
    d_max, a_max : the robot's braking and acceleration, m/s2.
    reaction : T, seconds until it brakes; till then it may accelerate.
    hidden_speed : u, m/s.

    ``v T + v^2 / (2 p) + u (T + v / p) <= d`` gives ``v = -(p T + u) + sqrt((p T + u)^2 + 2 p (d - u T))``
    for a robot that keeps its speed while it does not know yet (docs/speed/blind_area.md, "Sources").
    One that accelerates brakes from ``w = v + a T`` and has come ``w T - a T^2 / 2`` by then: the same with w
    for v and ``d + a T^2 / 2`` for d.
    """
    gained = a_max * reaction
    room = np.asarray(distance, dtype=np.float64) + 0.5 * gained * reaction - hidden_speed * reaction
    sum_ = d_max * reaction + hidden_speed
    w = np.sqrt(sum_ * sum_ + 2.0 * d_max * np.maximum(room, 0.0)) - sum_
    return np.maximum(w - gained, 0.0)


def need(robot: Robot, settings: BlindArea) -> float:
    """Distance at which the law no longer slows the robot, metres: the stopping distance of both."""
    t, w = settings.reaction, robot.v_max + robot.a_max * settings.reaction
    own = robot.v_max * t + 0.5 * robot.a_max * t * t + w * w / (2.0 * robot.d_max)
    return own + settings.hidden_speed * (t + w / robot.d_max)


def blind_cap(samples: SampledPath, scene: Scene, settings: BlindArea, around: Around) -> list[Cap]:
    """Slow enough, at each node and on the edges that touch it, for what may come out of a blind area."""
    robot = scene.robot
    d = hiding_distance(samples, scene, settings)
    v = stop_within(
        d - radius_along(samples, robot),
        d_max=robot.d_max,
        reaction=settings.reaction,
        hidden_speed=settings.hidden_speed,
        a_max=robot.a_max,
    )
    return [Cap("blind area", np.where(np.isinf(d), np.inf, np.maximum(v, settings.creep * robot.v_max)))]


def hiding_distance(samples: SampledPath, scene: Scene, settings: BlindArea) -> Floats:
    """Distance from the robot's centre to the nearest surface that may turn up ahead of it; metres, (n,).

    The least over the edges that touch a node. Infinity where it does not slow the robot.
    """
    robot, resolution = scene.robot, scene.grid.resolution
    enough = need(robot, settings) + radius_along(samples, robot)
    end = np.inf
    if settings.reach is not None and settings.reach - settings.hidden_radius < enough:
        end = settings.reach - settings.hidden_radius
    # Nothing on the map is farther than this, whatever the robot's speed is.
    limit = min(min(enough, end) / resolution, float(sum(scene.grid.blocked.shape) + 2))
    n = len(samples)
    land = _land(samples, scene.grid, settings, limit)
    out = np.full(n, limit)
    if land is not None:
        before, after = np.empty(n), np.empty(n)
        rho = settings.hidden_radius / resolution
        longest = math.sqrt(float(np.square(np.diff(samples.xy, axis=0)).sum(axis=1).max())) if n > 1 else 0.0
        lead = 1.5 + rho + 0.25 * longest if land.dark.any() else 0.0
        look = robot.v_max * settings.reaction + robot.v_max * robot.v_max / (2.0 * robot.d_max)
        last = np.minimum(np.searchsorted(samples.s, samples.s + look), n - 1)
        nearest_hiding(*land, last, limit, rho, lead, 2 * math.ceil(limit + rho) + 4, before, after)
        if n == 1:
            out = np.minimum(before, after)
        else:
            edges = np.minimum(after[:-1], before[1:])
            out = np.minimum(np.append(edges, np.inf), np.append(np.inf, edges))
    return np.where(out >= limit, end, out * resolution)


def caps_by_step(
    scene: Scene, free: BoolGrid, offsets: Sequence[tuple[int, int]], settings: BlindArea
) -> Floats:
    """The law's cap on the step that leaves each free cell, for a robot that looks along this step; m/s.

    What is ahead of a robot that turns later is more: on a path the law's own cap is never greater. The same
    kernel as on a path, along every straight run of free cells.

    Parameters
    ----------
    free : bool (height, width); cells to look from. Elsewhere the cap is infinity.
    offsets : the steps (dx, dy).

    Returns
    -------
    float64 (steps, height, width).
    """
    robot, grid = scene.robot, scene.grid
    enough = need(robot, settings) + robot.radius
    end = np.inf
    if settings.reach is not None and settings.reach - settings.hidden_radius < enough:
        end = settings.reach - settings.hidden_radius
    limit = min(min(enough, end) / grid.resolution, float(sum(grid.blocked.shape) + 2))
    out = np.full((len(offsets), *free.shape), np.inf)
    for k, (dx, dy) in enumerate(offsets):
        cells, steps = _runs(free, dx, dy)
        samples = _nodes(cells, grid.resolution)
        land = _land(samples, grid, settings, limit)
        if land is None or not steps.any():
            continue
        rho = settings.hidden_radius / grid.resolution
        lead = 1.5 + rho + 0.25 * math.sqrt(dx * dx + dy * dy) if land.dark.any() else 0.0
        before, after = np.empty(len(cells)), np.empty(len(cells))
        ahead = np.arange(len(cells)) + steps
        # Nodes that end a run have a far neighbour: from within a wall the kernel looks at nothing.
        wall = np.argwhere(land.opaque.reshape(land.height, land.width))[0]
        land.eyes_x[~steps], land.eyes_y[~steps] = UNIT * int(wall[1]) + 1, UNIT * int(wall[0]) + 1
        nearest_hiding(*land, ahead, limit, rho, lead, 2 * math.ceil(limit + rho) + 4, before, after)
        near = np.where(after >= limit, end, after * grid.resolution)
        v = stop_within(
            near - robot.radius,
            d_max=robot.d_max,
            reaction=settings.reaction,
            hidden_speed=settings.hidden_speed,
            a_max=robot.a_max,
        )
        v = np.where(np.isinf(near), np.inf, np.maximum(v, settings.creep * robot.v_max))
        out[k, cells[steps, 1], cells[steps, 0]] = v[steps]
    return out


def _runs(free: BoolGrid, dx: int, dy: int) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Free cells run by run along a step, and which of them are followed by the next of their run."""
    rows, columns = np.nonzero(free)
    # Steps are primitive: cells with the same cross product with one lie whole steps apart.
    line = columns * dy - rows * dx
    along = columns * dx + rows * dy
    order = np.lexsort((along, line))
    cells = np.stack((columns[order], rows[order]), axis=1).astype(np.int64)
    steps = np.zeros(len(cells), dtype=np.bool_)
    steps[:-1] = (np.diff(cells, axis=0) == (dx, dy)).all(axis=1)
    return cells, steps


def _nodes(cells: NDArray[np.int64], resolution: float) -> SampledPath:
    """Cells as nodes, for :func:`_land`: it reads their places alone."""
    n = len(cells)
    xy = cells.astype(np.float64)
    s = np.arange(n, dtype=np.float64) * resolution
    return SampledPath(s, xy, np.zeros((n, 2)), np.zeros(n), np.zeros(n, dtype=np.bool_), resolution)


class _Land(NamedTuple):
    """The piece of the map around a sampled path, as the kernel ``nearest_hiding`` takes it."""

    opaque: NDArray[np.bool_]
    dark: NDArray[np.bool_]
    spacious: NDArray[np.bool_]
    width: int
    height: int
    first: NDArray[np.int64]
    columns: NDArray[np.int64]
    xs: Floats
    ys: Floats
    eyes_x: NDArray[np.int64]
    eyes_y: NDArray[np.int64]


def _land(samples: SampledPath, grid: Grid, settings: BlindArea, limit: float) -> _Land | None:
    """That piece; None where it hides nothing."""
    rho = settings.hidden_radius / grid.resolution
    margin = math.ceil(limit + rho) + 2
    low = np.maximum(np.floor(samples.xy.min(axis=0)).astype(np.int64) - margin, 0)
    high = np.ceil(samples.xy.max(axis=0)).astype(np.int64) + margin + 1
    window = (slice(low[1], high[1]), slice(low[0], high[0]))
    opaque, dark = _opaque(grid, settings.unknown, window)
    if not opaque.any():
        return None
    height, width = opaque.shape
    rows, columns = np.nonzero(_corners(opaque, dark, rho == 0.0))
    columns = np.ascontiguousarray(columns)
    first = np.searchsorted(rows, np.arange(height + 2))
    spacious = ~_within(opaque & ~dark, math.ceil(rho / math.sqrt(2.0)) - 1)
    places = samples.xy - low + 0.5
    eyes = _eyes(places, opaque)
    return _Land(
        frozen(opaque.ravel()), frozen(dark.ravel()), spacious.ravel(), width, height, first, columns,
        places[:, 0].copy(), places[:, 1].copy(), eyes[:, 0].copy(), eyes[:, 1].copy(),
    )  # fmt: skip


def _opaque(
    grid: Grid, unknown: str, window: tuple[slice, slice] = (slice(None), slice(None))
) -> tuple[BoolGrid, BoolGrid]:
    """Cells that nothing is seen through, and those of them that may hold an obstacle."""
    walls = np.ascontiguousarray(grid.blocked[window])
    if grid.unknown is None or unknown == "map":
        return walls, np.zeros_like(walls)
    dark = np.ascontiguousarray(grid.unknown[window])
    return walls | dark, dark


def _corners(opaque: BoolGrid, dark: BoolGrid, pinhole: bool) -> BoolGrid:
    """Corners of cells that may hide something, (height + 1, width + 1).

    One opaque cell of four: a convex corner. Two across: a gap of no width, for obstacles of no width. Any dark
    cell with one that is not opaque.
    """
    height, width = opaque.shape

    def four(cells: BoolGrid) -> NDArray[np.uint8]:
        count = np.zeros((height + 1, width + 1), dtype=np.uint8)
        for rows in (slice(0, -1), slice(1, None)):
            for columns in (slice(0, -1), slice(1, None)):
                count[rows, columns] += cells
        return count

    count = four(opaque)
    found: BoolGrid = count == 1
    if pinhole:
        cross = np.zeros_like(found)
        cross[1:-1, 1:-1] = opaque[:-1, :-1] == opaque[1:, 1:]
        found |= cross & (count == 2)
    if dark.any():
        found |= (four(dark) > 0) & (count < 4)
    return found


def _within(cells: BoolGrid, rings: int) -> BoolGrid:
    """Cells with one of ``cells`` at most so many columns and so many rows away.

    A disc of radius rho holds the square of half side rho / sqrt 2, so its centre is in none of them for
    rings = ceil(rho / sqrt 2) - 1, wherever in its cell it is.
    """
    out = cells
    for turned in (False, True):
        line = out.T if turned else out
        wide = line.copy()
        for k in range(1, min(rings, line.shape[1] - 1) + 1):
            wide[:, k:] |= line[:, :-k]
            wide[:, :-k] |= line[:, k:]
        out = wide.T if turned else wide
    return np.ascontiguousarray(out)


def _eyes(places: Floats, opaque: BoolGrid) -> NDArray[np.int64]:
    """Points on the lattice, on odd numbers: within a 1000th of a cell, outside a wall that they touch."""
    best = 2 * np.floor(places * _HALF).astype(np.int64) + 1
    height, width = opaque.shape
    most = np.array((width, height)) * UNIT - 1
    best = np.clip(best, 1, most)
    stuck = np.flatnonzero(opaque[best[:, 1] // UNIT, best[:, 0] // UNIT])
    for dx, dy in ((-2, 0), (0, -2), (-2, -2)):
        other = np.clip(best[stuck] + (dx, dy), 1, most)
        free = ~opaque[other[:, 1] // UNIT, other[:, 0] // UNIT]
        best[stuck[free]] = other[free]
        stuck = stuck[~free]
    return best


def visible_cells(
    grid: Grid, cell: Cell, reach: float, unknown: Literal["dark", "map"] = UNKNOWN
) -> BoolGrid:
    """Cells whose centre is seen from the centre of a cell; bool, (height, width), read-only.

    Free cells only. Symmetric: a sees b exactly if b sees a.

    Parameters
    ----------
    cell : where the eye is.
    reach : metres; infinity: the whole map.
    unknown : whether unknown cells are ``dark`` or as the map is read.

    Raises
    ------
    SettingError : ``CELL``: not on the map.
    """
    if not grid.contains(cell):
        allowed = f"x 0 to {grid.width - 1}, y 0 to {grid.height - 1}"
        raise SettingError("CELL", f"{tuple(cell)}", where="visible_cells", allowed=allowed)
    opaque, _ = _opaque(grid, unknown)
    seen = np.zeros(opaque.size, dtype=np.bool_)
    x, y = (int(v) * UNIT + _HALF for v in cell)
    steps = min(reach / grid.resolution, float(grid.width + grid.height)) * UNIT
    cells_in_sight(frozen(opaque.ravel()), grid.width, grid.height, x, y, int(steps), seen)
    return frozen(seen.reshape(opaque.shape))

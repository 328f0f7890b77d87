"""Layers: a value for every cell, to be laid over the map."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from lampyris.app.engine.cache import keep
from lampyris.app.engine.simulation import standing
from lampyris.errors import FileError, SceneError, UsageError
from lampyris.io.scenario.scenario import Scenario
from lampyris.model.field import Field
from lampyris.model.grid import Grid
from lampyris.model.scene import Scene
from lampyris.model.traffic import MAX_OBSTACLES
from lampyris.planning import registry
from lampyris.planning.field.layers import clearance, moves_on
from lampyris.planning.field.solve import solve_field
from lampyris.planning.graph.expanded import expanded
from lampyris.typing import Cell, Cells, Floats

HORIZON: Final = 64
"""Ticks that obstacles are followed ahead; farther than that they can be nearly anywhere."""
Flat = NDArray[np.int64]


def layer_of(name: str, scenario: Scenario, tick: int, obstacles: Any) -> Floats:
    """A layer, float64 (height, width), on the map as it is at a tick; infinite where there is no value.

    ``cost``: least cost to the goal, cells. ``luciferin``: with the planner's own shares, if it has any.
    ``clearance``: metres to the nearest wall. ``expanded``: 1, 2, ...: the order in which the
    planner expands them, if it can say (:func:`own_order`), else that in which a search from the goal settles
    them until it comes to the start.
    ``reach``: ticks until an obstacle of one cell could be there that makes a step each tick. ``inflation``: 1 on free
    cells that the robot's centre may not enter. ``regions``: 1 where the start, 2 where the goal can be reached from,
    3 where both can.

    Parameters
    ----------
    obstacles : cells [x, y] of obstacles; None: where they are at the beginning.

    Raises
    ------
    UsageError : LAYER.
    SceneError, FileError : obstacles that are no cells of the map.
    """
    make = LAYERS.get(name)
    if make is None:
        raise UsageError("LAYER", f"{name!r:.60}", where="layer", allowed=", ".join(LAYERS))
    return make(scene_at(scenario.scene, tick), scenario, obstacles)


def scene_at(scene: Scene, tick: int) -> Scene:
    """The scene with its map as it is at a tick."""
    grid = keep(("ground", tick), scene, lambda: grid_at(scene, tick))
    return scene if grid is scene.grid else replace(scene, grid=grid)


def grid_at(scene: Scene, tick: int) -> Grid:
    """The map with the edits made until a tick."""
    edits = [edit for edit in getattr(scene, "edits", ()) if edit.tick <= tick]
    if not edits:
        return scene.grid
    blocked = scene.grid.blocked.copy()
    unknown = None if scene.grid.unknown is None else scene.grid.unknown.copy()
    for edit in edits:
        for cells, wall in ((edit.freed, False), (edit.blocked, True)):
            for x, y in cells:
                blocked[y, x] = wall
                if unknown is not None:
                    unknown[y, x] = False
    return replace(scene.grid, blocked=blocked, unknown=unknown)


def _field(scene: Scene, scenario: Scenario) -> Field:
    settings = scenario.settings
    shares = {key: settings[key] for key in ("rho", "gamma") if key in settings}
    gates = "close" if settings.get("gates") == "close" else "ignore"
    key = ("field", scene.goal, scene.moves.name, scene.robot.radius, gates, *sorted(shares.items()))
    return keep(key, scene.grid, lambda: solve_field(scene, gates=gates, **shares))


def _cost(scene: Scene, scenario: Scenario, obstacles: Any) -> Floats:
    return _field(scene, scenario).cost


def _luciferin(scene: Scene, scenario: Scenario, obstacles: Any) -> Floats:
    return _field(scene, scenario).luciferin


def _clearance(scene: Scene, scenario: Scenario, obstacles: Any) -> Floats:
    return np.where(scene.grid.blocked, np.inf, clearance(scene.grid))


def own_order(scene: Scene, scenario: Scenario) -> Cells | None:
    """The cells that the scenario's planner expands at the beginning, in its order; None: it cannot say."""
    settings = repr(sorted(scenario.settings.items()))
    ends = (scene.start, scene.goal, scene.start_pose, scene.goal_pose)
    key = ("expanded", scenario.planner, settings, *ends, scene.moves.name, scene.robot)
    planner = registry.make(scenario.planner, scenario.settings)
    return keep(key, scene.grid, lambda: expanded(planner, scene))


def _expanded(scene: Scene, scenario: Scenario, obstacles: Any) -> Floats:
    taken = own_order(scene, scenario)
    if taken is not None:
        own = np.full(scene.grid.blocked.shape, np.inf)
        own[taken[:, 1], taken[:, 0]] = np.arange(1, len(taken) + 1)
        return own
    exact = _field(scene, scenario).exact
    x, y = scene.start
    last = int(exact[y, x])
    there = (exact >= 0) & ((exact <= last) | (last < 0))
    order = np.full(exact.shape, np.inf)
    cells = np.flatnonzero(there)
    order.flat[cells[np.argsort(exact.flat[cells], kind="stable")]] = np.arange(1, cells.size + 1)
    return order


def _reach(scene: Scene, scenario: Scenario, obstacles: Any) -> Floats:
    if obstacles is None:
        cells = [cell for _, cell in standing(scenario)]
    else:
        cells = _cells(obstacles, scene.grid)
    cutting = moves_on(scene.grid, scene.moves).corner_cutting
    return reach(scene.grid, cells, cutting, HORIZON)


def _inflation(scene: Scene, scenario: Scenario, obstacles: Any) -> Floats:
    closed = ~_field(scene, scenario).free & ~scene.grid.blocked
    return np.where(closed, 1.0, np.inf)


def _regions(scene: Scene, scenario: Scenario, obstacles: Any) -> Floats:
    cutting = moves_on(scene.grid, scene.moves).corner_cutting
    free = _field(scene, scenario).free.copy()
    for x, y in (scene.start, scene.goal):
        free[y, x] = True
    named, _ = ndimage.label(free, np.ones((3, 3)) if cutting else None)
    out = np.zeros(free.shape)
    for sign, (x, y) in ((1.0, scene.start), (2.0, scene.goal)):
        out[named == named[y, x]] += sign
    return np.where(out > 0, out, np.inf)


def _cells(given: Any, grid: Grid) -> list[Cell]:
    if not isinstance(given, list) or len(given) > MAX_OBSTACLES:
        raise FileError(
            "TYPE",
            "obstacle_cells",
            where="obstacle_cells",
            allowed=f"null, or at most {MAX_OBSTACLES:,} cells [x, y]",
        )
    cells = []
    for k, one in enumerate(given):
        if not (isinstance(one, list) and len(one) == 2 and all(type(c) is int for c in one)):
            raise FileError(
                "TYPE", f"{one!r:.40}", where=f"obstacle_cells: /{k}", allowed="[x, y]: two whole numbers"
            )
        if not grid.contains((one[0], one[1])):
            raise SceneError(
                "BODY_OUTSIDE", f"{one}", where=f"obstacle_cells: /{k}", allowed="cells of the map"
            )
        cells.append((one[0], one[1]))
    return cells


def reach(grid: Grid, cells: list[Cell], cutting: bool, horizon: int) -> Floats:
    """Ticks until an obstacle that makes one of eight steps each tick could reach a cell; infinite beyond
    ``horizon``.

    Parameters
    ----------
    cells : where they are now: 0.
    cutting : whether a diagonal step may pass a wall's corner.
    """
    stride = grid.width + 2
    free = np.zeros((grid.height + 2, stride), dtype=np.bool_)
    free[1:-1, 1:-1] = ~grid.blocked
    open_ = free.ravel()
    ticks = np.full(open_.size, np.inf)
    front: Flat = np.array(sorted({(y + 1) * stride + x + 1 for x, y in cells}), dtype=np.int64)
    ticks[front] = 0.0
    for tick in range(1, horizon + 1):
        parts = [front + step for step in (-1, 1, -stride, stride)]
        for dx in (-1, 1):
            for dy in (-stride, stride):
                start = front if cutting else front[open_[front + dx] & open_[front + dy]]
                parts.append(start + dx + dy)
        found = np.concatenate(parts)
        found = found[open_[found] & (ticks[found] == np.inf)]
        if not found.size:
            break
        ticks[found] = tick
        front = np.unique(found)
    out: Floats = ticks.reshape(free.shape)[1:-1, 1:-1].copy()
    return out


LAYERS: Final[Mapping[str, Callable[[Scene, Scenario, Any], Floats]]] = {
    "cost": _cost,
    "luciferin": _luciferin,
    "clearance": _clearance,
    "expanded": _expanded,
    "reach": _reach,
    "inflation": _inflation,
    "regions": _regions,
}

"""A curve keeps the clearance that its path was planned for."""

from __future__ import annotations

import numpy as np
import pytest

from lampyris import Plan, Robot, Scene, api
from lampyris.io.maps.load import load_map
from lampyris.model.grid import Grid
from lampyris.motion.geometry.clearance import wall_distance
from lampyris.sim.continuous.leg import curve_from
from lampyris.typing import Points


def clearances(xy: Points, grid: Grid) -> np.ndarray:
    """Metres to the nearest wall, at most 2.5, at 4,001 even places of a polyline."""
    step = np.diff(xy, axis=0)
    s = np.concatenate(([0.0], np.cumsum(np.hypot(step[:, 0], step[:, 1]))))
    at = np.linspace(0.0, s[-1], 4001)
    places = np.stack([np.interp(at, s, xy[:, k]) for k in (0, 1)], axis=1)
    return np.minimum(wall_distance(places, grid, 2.5), 2.5)


def curves(plan: Plan, scene: Scene) -> list[Points]:
    """What `speed` and `drive` drive of a plan."""
    assert plan.path is not None
    x, y = plan.path.cells[0].tolist()
    made = [api.smooth(scene, plan, method=s).curve for s in ("straight", "arcs")]
    made.append(curve_from(plan, scene, (float(x), float(y)), None, "arcs"))
    return [c.at(np.linspace(0.0, c.length, 4001))[0] for c in made if c is not None]


@pytest.mark.parametrize("cells", [1, 2, 3])
def test_it_keeps_away_from_a_wall(cells: int) -> None:
    blocked = np.zeros((41, 41), bool)
    blocked[10:31, 20] = True
    grid = Grid(blocked, resolution=0.25)
    scene = Scene(grid, (5, 20), (35, 20), robot=Robot(radius=0.1))
    plan = api.plan(scene, choice="exact", min_clearance=cells, max_extra=None)
    assert plan.attributes["min_clearance"] == cells
    bare = api.smooth(scene, plan.path).curve
    assert bare is not None
    # Without the plan's attributes it is drawn as near as one cell.
    usual = clearances(bare.at(np.linspace(0.0, bare.length, 4001))[0], grid).min()
    assert cells == 1 or usual < 0.1 + 0.25 * cells - 0.01
    for xy in curves(plan, scene):
        assert clearances(xy, grid).min() >= 0.1 + 0.25 * cells - 1e-6


def test_a_path_that_crowding_shaped_is_not_drawn_straight() -> None:
    document = load_map("env-3")
    grid = Grid(document.grid.blocked, resolution=0.25)
    query = document.queries[0]
    scene = Scene(grid, query.start, query.goal, robot=Robot(radius=0.15))
    plan = api.plan(scene, choice="exact", min_clearance=1, obstacle_density_weight=4.0)
    assert plan.path is not None
    planned = clearances(plan.path.cells.astype(np.float64), grid)
    for xy in curves(plan, scene):
        driven = clearances(xy, grid)
        assert driven.mean() >= 0.99 * planned.mean()
        assert driven.min() >= planned.min() - 1e-6
    # Drawn straight it loses what the longer way was for.
    taut = api.smooth(scene, plan.path, method="straight").curve
    assert taut is not None
    assert clearances(taut.at(np.linspace(0.0, taut.length, 4001))[0], grid).mean() < 0.95 * planned.mean()

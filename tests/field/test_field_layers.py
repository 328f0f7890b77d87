"""Where the robot's centre may be, and how far the walls are."""

from __future__ import annotations

import numpy as np
import pytest

from lampyris.model.grid import Grid
from lampyris.model.moves import MOVES
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.planning.field.layers import clearance, free_cells, free_space, moves_for
from lampyris_selfcheck.reference.paths import field as twin


def test_clearance_by_trying_all() -> None:
    rng = np.random.default_rng(1)
    for _ in range(120):
        height, width = rng.integers(1, 16, 2)
        blocked = rng.random((height, width)) < rng.random() ** 3
        ours = clearance(Grid(blocked, resolution=0.05))
        for y, row in enumerate(twin.clearance2(blocked.tolist())):
            for x, squared in enumerate(row):
                expected = np.inf if squared is None else 0.5 * 0.05 * squared**0.5
                assert ours[y, x] == pytest.approx(expected, rel=1e-12)
        assert (ours[blocked] == 0).all()


def test_no_wall_is_infinitely_far() -> None:
    assert np.isinf(clearance(Grid(np.zeros((3, 2), dtype=np.bool_)))).all()


def test_free_cells_are_those_with_clearance() -> None:
    rng = np.random.default_rng(2)
    for _ in range(60):
        height, width = rng.integers(1, 25, 2)
        blocked = rng.random((height, width)) < 0.1
        radius = float(rng.choice([0.51, 0.7, 1.0, 1.49, 2.3, 5.0]))
        grid = Grid(blocked)
        np.testing.assert_array_equal(free_cells(grid, radius), clearance(grid) >= radius - 1e-12)


@pytest.mark.parametrize("resolution", [0.05, 0.1, 0.025, 1.0, 0.3])
@pytest.mark.parametrize("cells", [3, 5, 7, 9, 11, 13, 15])
def test_a_robot_as_wide_as_the_corridor_fits(cells: int, resolution: float) -> None:
    """The middle of a corridor n cells wide is n / 2 cells from both walls, in decimals too."""
    blocked = np.zeros((cells + 2, 5), dtype=np.bool_)
    blocked[[0, -1]] = True
    grid = Grid(blocked, resolution=resolution)
    radius = round(cells * resolution / 2, 6)
    assert np.argwhere(free_cells(grid, radius)).tolist() == [[(cells + 1) // 2, x] for x in range(5)]
    assert not free_cells(grid, radius * 1.0001).any()


@pytest.mark.parametrize("radius", [0.0, 0.2, 0.5])
def test_up_to_half_a_cell_every_free_cell_will_do(radius: float) -> None:
    blocked = np.random.default_rng(3).random((9, 9)) < 0.4
    np.testing.assert_array_equal(free_cells(Grid(blocked), radius), ~blocked)


def test_the_edge_of_the_map_is_no_wall() -> None:
    assert free_cells(Grid(np.zeros((3, 3), dtype=np.bool_)), 50.0).all()


def test_free_space_is_read_only() -> None:
    scene = Scene(Grid(np.zeros((3, 3), dtype=np.bool_)), (0, 0), (1, 1), robot=Robot(radius=0.7))
    for free in (free_space(scene), clearance(scene.grid)):
        assert not free.flags.writeable


def _scene(name: str, radius: float) -> Scene:
    return Scene(
        Grid(np.zeros((3, 3), dtype=np.bool_)), (0, 0), (1, 1), moves=name, robot=Robot(radius=radius)
    )


def test_moves_of_a_point_are_its_own() -> None:
    for name, moves in MOVES.items():
        assert moves_for(_scene(name, 0.0)) is moves


def test_moves_of_a_disc() -> None:
    assert not moves_for(_scene("dissertation", 0.1)).corner_cutting
    assert moves_for(_scene("octile", 0.1)) == MOVES["octile"]
    assert moves_for(_scene("four-connected", 0.1)) == MOVES["four-connected"]
    sixteen = moves_for(_scene("sixteen-connected", 0.1))
    assert sixteen.reach == 1
    assert (sixteen.straight, sixteen.diagonal, sixteen.knight) == (10, 14, 0)
    assert len(sixteen.offsets) == len(sixteen.costs) == 8


def test_a_disc_swept_along_a_legal_diagonal_keeps_its_distance() -> None:
    """The claim of ``moves_for``, by sampling: all steps over free cells, walls as squares."""
    rng = np.random.default_rng(4)
    checked = 0
    for _ in range(60):
        blocked = rng.random((9, 9)) < 0.12
        radius = float(rng.choice([0.3, 0.5, 0.8, 1.2]))
        free = free_cells(Grid(blocked), radius)
        walls = np.argwhere(blocked)[:, ::-1]
        if walls.size == 0:
            continue
        for x in range(8):
            for y in range(8):
                if not free[y : y + 2, x : x + 2].all():
                    continue
                for t in np.linspace(0, 1, 21):
                    for point in (np.array([x + t, y + t]), np.array([x + t, y + 1 - t])):
                        gap = np.maximum(np.abs(walls - point) - 0.5, 0.0)
                        assert np.sqrt((gap**2).sum(axis=1)).min() >= radius - 1e-9
                checked += 1
    assert checked > 500

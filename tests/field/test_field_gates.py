"""Gates by their definition, and which of them lead nowhere."""

from __future__ import annotations

import numpy as np
import pytest

from lampyris.model.grid import Grid
from lampyris.model.robot import Robot
from lampyris.planning.field.gates import find_gates, gate_mask, gates_along
from lampyris_selfcheck.reference.paths import field as twin


def _grid(text: str) -> Grid:
    return Grid(np.array([[c == "#" for c in row] for row in text.split()]))


@pytest.mark.parametrize("radius", [0.0, 0.3, 0.5, 0.51, 0.75, 1.0, 1.3, 2.0])
@pytest.mark.parametrize("resolution", [1.0, 0.05])
def test_against_the_twin(radius: float, resolution: float) -> None:
    rng = np.random.default_rng(round(radius * 100))
    robot = Robot(radius=radius * resolution)
    for _ in range(40):
        height, width = rng.integers(1, 14, 2)
        blocked = rng.random((height, width)) < rng.random()
        grid = Grid(blocked, resolution=resolution)
        expected = twin.gates(blocked.tolist(), 2 * radius if radius else None)
        gates = find_gates(grid, robot)
        assert {g.cell: (g.axis, pytest.approx(g.width_m)) for g in gates} == {
            cell: (axis, width * resolution) for cell, (axis, width) in expected.items()
        }
        assert [g.cell for g in gates] == sorted(expected, key=lambda c: (c[1], c[0]))
        mask = gate_mask(grid, robot)
        assert {(x, y) for y, x in np.argwhere(mask).tolist()} == set(expected)
        assert not mask.flags.writeable
        dead = twin.dead_ends(blocked.tolist(), expected, strict=radius > 0)
        assert {g.cell for g in gates if g.dead_end} == dead


def test_outside_the_map_is_not_blocked() -> None:
    assert find_gates(_grid(".# .#")) == find_gates(_grid("...")) == find_gates(_grid("###")) == ()


def test_a_door_is_a_gate_and_alive() -> None:
    (gate,) = find_gates(_grid("..... ##.## ....."))
    assert (gate.cell, gate.axis, gate.dead_end) == ((2, 1), "x", False)


def test_a_blind_corridor_dies_from_its_end() -> None:
    gates = find_gates(_grid("...... #####. .....# #####. ......"))
    assert {g.cell: g.dead_end for g in gates} == {(x, 2): True for x in range(5)}


def test_filling_stops_at_what_is_no_gate() -> None:
    """The bend of a corridor is no gate: it stays live, and so does the gate before it."""
    gates = find_gates(_grid("#####. #..... #.#### #.#### ######"))
    assert {g.cell: g.dead_end for g in gates} == {
        (2, 1): False,
        (3, 1): False,
        (4, 1): False,
        (1, 2): True,
        (1, 3): True,
    }


def test_a_long_blind_corridor_dies_cell_by_cell() -> None:
    """Each of ten thousand gates dies only after the one beyond it: no rounds over the whole map."""
    blocked = np.zeros((3, 10_004), dtype=np.bool_)
    blocked[[0, 2], :10_000] = True
    gates = find_gates(Grid(blocked))
    assert len(gates) == 10_000
    assert all(g.dead_end for g in gates)
    through = blocked.copy()
    through[[0, 2], :3] = False
    gates = find_gates(Grid(through))
    assert len(gates) == 10_000 - 3
    assert not any(g.dead_end for g in gates)


def test_a_robot_in_a_wide_corridor() -> None:
    """A run of two cells is a gate for a robot of more than one cell's radius, each cell of it."""
    grid = _grid("...... ##..## ......")
    assert find_gates(grid, Robot(radius=1.0)) == ()
    gates = find_gates(grid, Robot(radius=1.01))
    assert [(g.cell, g.axis, g.width_m, g.dead_end) for g in gates] == [
        ((2, 1), "x", 2.0, False),
        ((3, 1), "x", 2.0, False),
    ]


def test_what_is_kept_is_of_this_map_and_this_robot() -> None:
    """Gates of the last map are kept; another map or robot has its own."""
    door, wide = _grid("..... ##.## ....."), _grid("..... #..## .....")
    assert find_gates(door) is find_gates(door)
    assert find_gates(wide) == ()
    assert len(find_gates(wide, Robot(radius=1.1))) == 2
    assert find_gates(wide) == ()
    assert [g.cell for g in find_gates(door)] == [(2, 1)]


def test_gates_along_a_path_are_those_of_its_cells_each_once() -> None:
    rng = np.random.default_rng(3)
    for robot in (Robot(), Robot(radius=0.7)):
        for _ in range(60):
            height, width = rng.integers(1, 12, 2).tolist()
            grid = Grid(rng.random((height, width)) < 0.4)
            cells = np.stack((rng.integers(0, width, 30), rng.integers(0, height, 30)), axis=1).astype(
                np.int32
            )
            passed = set(map(tuple, cells.tolist()))
            want = tuple(gate for gate in find_gates(grid, robot) if gate.cell in passed)
            assert gates_along(grid, cells, robot) == want

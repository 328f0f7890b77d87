"""Table 4.2 of the dissertation, cell by cell: luciferin, cost and back pointer; and its one gate."""

from __future__ import annotations

import numpy as np
import pytest

from lampyris.model.field import Field
from lampyris.model.grid import Grid
from lampyris.model.scene import Scene
from lampyris.planning.field.gates import find_gates
from lampyris.planning.field.solve import solve_field
from lampyris.reproduce.tables import printed_data

START, GOAL = (0, 9), (7, 0)

# Printed with fewer digits than the rest, or cut off: our value is on the right.
ROUNDED = {(3, 1): 4.2816, (4, 1): 2.976, (0, 5): 11.487375}


@pytest.fixture(scope="module")
def rows() -> list[dict[str, str]]:
    """Each cell with its luciferin as printed, and cost and back pointer as worked out apart."""
    rule = printed_data.field_rule()
    out = []
    for r in printed_data.rows("4.2"):
        x, y = printed_data.cell(r["cell"])
        known = rule.get((x, y), {})
        back = printed_data.cell(known["back_pointer"]) if known.get("back_pointer") else ("", "")
        row = {"x": x, "y": y, "blocked": int(r["luciferin"] == "10000"), "cost": known.get("cost", "")}
        row |= {"luciferin_printed": r["luciferin"], "back_x": back[0], "back_y": back[1]}
        out.append({name: str(value) for name, value in row.items()})
    return out


@pytest.fixture(scope="module")
def grid() -> Grid:
    return printed_data.guide_grid()


@pytest.fixture(scope="module")
def field(grid: Grid) -> Field:
    return solve_field(Scene(grid, START, GOAL, moves="dissertation"))


def test_the_table_is_whole(rows: list[dict[str, str]]) -> None:
    assert len(rows) == 100
    assert sum(r["blocked"] == "0" for r in rows) == 78


def test_every_cost(rows: list[dict[str, str]], field: Field) -> None:
    for r in rows:
        x, y = int(r["x"]), int(r["y"])
        expected = -1 if r["blocked"] == "1" else round(float(r["cost"]) * 10)
        assert field.exact[y, x] == expected, (x, y)


def test_every_back_pointer(rows: list[dict[str, str]], field: Field) -> None:
    parent = field.parent
    for r in rows:
        x, y = int(r["x"]), int(r["y"])
        expected = int(r["back_y"]) * 10 + int(r["back_x"]) if r["back_x"] else -1
        assert parent[y, x] == expected, (x, y)


def test_every_luciferin(rows: list[dict[str, str]], field: Field) -> None:
    for r in rows:
        x, y = int(r["x"]), int(r["y"])
        ours, printed = field.luciferin[y, x], float(r["luciferin_printed"])
        if r["blocked"] == "1":
            assert ours == np.inf
            assert printed == 10000
        elif (x, y) in ROUNDED:
            assert ours == pytest.approx(ROUNDED[x, y], abs=1e-6)
            assert 0.0011 < ours - printed < 0.01
        else:
            # The table cuts digits off rather than rounding them.
            assert -1e-9 <= ours - printed < 0.0011, (x, y)


def test_the_one_gate_is_a_dead_end(grid: Grid) -> None:
    (gate,) = find_gates(grid)
    assert (gate.cell, gate.axis, gate.width_m, gate.dead_end) == ((7, 5), "x", 1.0, True)


def test_closing_the_gate_changes_its_cell_alone(grid: Grid, field: Field) -> None:
    closed = solve_field(Scene(grid, START, GOAL, moves="dissertation"), gates="close")
    differs = np.argwhere(closed.exact != field.exact)
    assert differs.tolist() == [[5, 7]]
    assert not closed.free[5, 7]


def test_an_end_in_a_gate_stays_open(grid: Grid) -> None:
    scene = Scene(grid, START, (7, 5), moves="dissertation")
    assert solve_field(scene, gates="close").exact[START[1], START[0]] > 0

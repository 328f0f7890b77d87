"""Limits of use: what is done with a file that was read is refused before it takes more than is allowed."""

from __future__ import annotations

import tracemalloc
from collections.abc import Callable
from pathlib import Path
from typing import Any, ClassVar, NoReturn

import numpy as np
import pytest
from typer.testing import CliRunner

import lampyris
from lampyris._core import limits
from lampyris.cli.app import app
from lampyris.errors import LimitError, SettingError
from lampyris.model.grid import Grid
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.motion.geometry.sampled_path import sample_curve
from lampyris.motion.laws.node_refinement import refined
from lampyris.planning import registry
from lampyris.planning.assess import assess
from lampyris.planning.base import Traits
from lampyris.sim.continuous.drive import DriveSimulation


def street(n: int) -> Scene:
    return Scene(Grid(np.zeros((1, n), dtype=np.bool_)), (0, 0), (n - 1, 0))


@pytest.mark.parametrize("verb", ["plan", "simulate", "drive"])
def test_a_map_of_one_row_of_all_cells_is_refused_before_memory_is_asked_for(verb: str) -> None:
    """A picture of 2 KiB, 16,777,216 x 1 cells, took 4.3 GiB and 80 s: its border has twice its cells."""
    scene = street(2**24)
    tracemalloc.start()
    try:
        with pytest.raises(LimitError, match="LAMPYRIS_MAX_MEMORY") as said:
            getattr(lampyris, verb)(scene)
        assert tracemalloc.get_traced_memory()[1] < 2**24  # a byte a cell
    finally:
        tracemalloc.stop()
    assert said.value.code == "MEMORY"
    assert said.value.exit_code == 5


def test_the_largest_square_map_is_within_the_limit() -> None:
    limits.demand_memory(4096, 4096, 2, "planning")


def test_memory_is_asked_of_the_planner(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = street(10_000)  # 3 x 10,002 cells of 100 bytes: 2.9 MiB
    monkeypatch.setenv("LAMPYRIS_MAX_MEMORY", "3")
    assert lampyris.plan(scene)
    monkeypatch.setenv("LAMPYRIS_MAX_MEMORY", "2")
    with pytest.raises(LimitError, match="planning with astar on 10,000 x 1 cells needs 3 MiB"):
        lampyris.plan(scene, "astar")


def test_a_path_of_too_many_cells_is_not_judged(monkeypatch: pytest.MonkeyPatch) -> None:
    judged: list[object] = []
    monkeypatch.setattr("lampyris.api.assess", lambda made, scene: judged.append(made) or assess(made, scene))
    monkeypatch.setenv("LAMPYRIS_MAX_PATH", "50")
    assert lampyris.plan(street(50))
    assert len(judged) == 1
    with pytest.raises(LimitError, match=r"PATH_LENGTH.*51 cells.*LAMPYRIS_MAX_PATH=51"):
        lampyris.plan(street(51))
    assert len(judged) == 1


def test_a_course_of_too_many_nodes_is_refused_before_it_is_drawn(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = street(101)
    ends = np.array([[0.0, 0.0], [100.0, 0.0]])
    monkeypatch.setenv("LAMPYRIS_MAX_NODES", "401")
    assert len(lampyris.smooth(scene, ends)) == 401
    monkeypatch.setenv("LAMPYRIS_MAX_NODES", "399")
    monkeypatch.setattr("lampyris.motion.geometry.smoothing.drawn", None)
    with pytest.raises(LimitError, match=r"400 nodes.*larger spacing.*LAMPYRIS_MAX_NODES=400"):
        lampyris.smooth(scene, ends)


def test_nodes_are_counted_on_the_curve_and_where_edges_are_halved(monkeypatch: pytest.MonkeyPatch) -> None:
    blocked = np.zeros((3, 101), dtype=np.bool_)
    blocked[0, 50] = True
    scene = Scene(Grid(blocked), (0, 1), (100, 1), robot=Robot(radius=0.3, v_max=2.0))
    coarse = lampyris.smooth(scene, np.array([[0.0, 1.0], [100.0, 1.0]]), spacing=1.0)
    assert coarse.curve is not None
    plain = sample_curve(coarse.curve, 1.0)
    assert len(coarse) > len(plain)
    monkeypatch.setenv("LAMPYRIS_MAX_NODES", str(len(plain)))
    assert len(sample_curve(coarse.curve, 1.0)) == len(plain)
    with pytest.raises(LimitError, match="NODES"):
        refined(plain, scene)
    monkeypatch.setenv("LAMPYRIS_MAX_NODES", str(len(plain) - 1))
    with pytest.raises(LimitError, match="NODES"):
        sample_curve(coarse.curve, 1.0)
    with pytest.raises(LimitError, match="NODES"):  # more than a whole number has room for
        sample_curve(coarse.curve, 1e-300)


def test_a_simulation_that_would_take_too_many_ticks_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("LAMPYRIS_MAX_TICKS", "30")
    assert lampyris.simulate(street(31)).arrived
    with pytest.raises(LimitError, match=r"TICKS.*31 ticks"):
        lampyris.simulate(street(32))
    assert lampyris.simulate(street(32), ticks=100).arrived


def test_a_drive_that_would_take_too_many_decisions_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    """A robot of a micrometre a second drove for hours in decisions of a tenth of a second."""
    slow = Scene(street(9).grid, (0, 0), (8, 0), robot=Robot(v_max=0.05))
    monkeypatch.setenv("LAMPYRIS_MAX_DECISIONS", "1000")
    with pytest.raises(LimitError, match=r"DECISIONS.*LAMPYRIS_MAX_DECISIONS=") as said:
        lampyris.drive(slow)
    assert "longer period" in said.value.todo
    assert lampyris.drive(slow, period=1.0).arrived
    long = DriveSimulation(street(9), registry.make("astar"), time_limit=1e6, period=0.02)
    assert long.time_limit == 20.0
    said = "the time limit of 1000000 s was cut to 20 s: LAMPYRIS_MAX_DECISIONS allows 1,000 decisions"
    assert long.drive().notes == (said,)
    assert DriveSimulation(street(9), registry.make("astar"), time_limit=15.0, period=0.02).time_limit == 15.0


class Unasked:
    """A planner that must not be asked."""

    name: ClassVar[str] = "unasked"
    summary: ClassVar[str] = ""
    source: ClassVar[str] = ""
    traits: ClassVar[Traits] = Traits(optimal=True)

    def open(self, *args: Any, **settings: Any) -> NoReturn:
        pytest.fail("it was searched for")


@pytest.mark.parametrize(
    ("verb", "limit", "given", "says"),
    [
        (lampyris.plan, "PATH", {}, "PATH_LENGTH.*a straight path needs at least 400 cells"),
        (lampyris.simulate, "TICKS", {}, "TICKS.*a straight path needs at least 399 ticks"),
        (lampyris.drive, "NODES", {"spacing": 0.5}, "NODES.*a straight path needs at least 798 nodes"),
        (lampyris.drive, "DECISIONS", {}, "DECISIONS.*a straight drive needs at least 3,990 decisions"),
    ],
)
def test_what_even_a_straight_path_makes_too_much_is_refused_before_the_search(
    monkeypatch: pytest.MonkeyPatch, verb: Callable[..., Any], limit: str, given: dict[str, Any], says: str
) -> None:
    monkeypatch.setenv(f"LAMPYRIS_MAX_{limit}", "398")
    with pytest.raises(LimitError, match=says):
        verb(street(400), Unasked(), **given)
    shut = np.zeros((1, 400), dtype=np.bool_)
    shut[0, 399] = True  # there is no way, and that is told
    assert verb(Scene(Grid(shut), (0, 0), (399, 0)), "astar").planner == "astar"


@pytest.mark.parametrize("verb", [lampyris.plan, lampyris.simulate, lampyris.drive])
def test_a_variable_that_is_no_number_is_refused_before_the_search(
    monkeypatch: pytest.MonkeyPatch, verb: Callable[..., Any]
) -> None:
    for name in ("PATH", "TICKS", "NODES", "DECISIONS"):
        monkeypatch.setenv(f"LAMPYRIS_MAX_{name}", "much")
    with pytest.raises(SettingError, match="LIMIT_VARIABLE"):
        verb(street(5), Unasked())


@pytest.mark.parametrize("given", ["0", "-1", "1.5", "much", "1" * 400, "٣"])
def test_a_variable_that_is_no_number_is_refused(given: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("LAMPYRIS_MAX_PATH", given)
    with pytest.raises(SettingError, match="LAMPYRIS_MAX_PATH"):
        lampyris.plan(street(5))


def test_the_command_line_ends_with_exit_code_5(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "street.txt").write_text("." * 60 + "\n")
    monkeypatch.setenv("LAMPYRIS_MAX_PATH", "10")
    done = CliRunner().invoke(app, ["plan", str(tmp_path / "street.txt"), "--start", "0,0", "--goal", "59,0"])
    assert isinstance(done.exception, LimitError)
    assert done.exception.exit_code == 5


@pytest.mark.parametrize("verb", [lampyris.plan, lampyris.simulate, lampyris.drive])
@pytest.mark.parametrize("radius", [0.0, 5.0])
def test_where_there_is_no_path_that_is_the_answer_whatever_the_limits(
    monkeypatch: pytest.MonkeyPatch, verb: Callable[..., Any], radius: float
) -> None:
    blocked = np.zeros((2, 21), dtype=np.bool_)
    blocked[:, 10] = radius == 0.0
    blocked[1, 3] = radius > 0.0
    scene = Scene(Grid(blocked), (0, 0), (20, 0), robot=Robot(radius=radius))
    for limit in ("PATH", "TICKS", "NODES", "DECISIONS"):
        monkeypatch.setenv(f"LAMPYRIS_MAX_{limit}", "10")
    found = verb(scene)
    status = found.status if isinstance(found, lampyris.Plan) else found.outcome
    assert str(status.value) in ("no-path", "start-occupied", "start-blocked"), status

"""Plots on the caller's axes: metres, y up, and the axes come back."""

from __future__ import annotations

import dataclasses
import inspect
import math
from collections.abc import Iterator
from functools import cache
from typing import Any

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

import lampyris
from lampyris import plot
from lampyris.errors import SettingError
from sizes import some

WALLS = np.zeros((4, 6), bool)
WALLS[1, 2:4] = True
GRID = lampyris.Grid(WALLS, resolution=0.5, origin=(-1.0, 2.0, 0.0))
SCENE = lampyris.Scene(GRID, (0, 3), (5, 0))
PLAN = lampyris.plan(SCENE, "astar")


@pytest.fixture
def ax() -> Axes:
    figure = Figure()
    FigureCanvasAgg(figure)
    made: Axes = figure.add_subplot()
    return made


@pytest.fixture
def pyplot() -> Iterator[Any]:
    mpl.use("Agg")
    from matplotlib import pyplot

    yield pyplot
    pyplot.close("all")


@cache
def calls() -> dict[str, tuple[Any, ...]]:
    """Right arguments for every function, but its axes."""
    walkers = lampyris.RandomWalk(2)
    return {
        "grid": (GRID,),
        "field": (lampyris.solve_field(SCENE), GRID),
        "scene": (SCENE,),
        "path": (PLAN,),
        "profile": (lampyris.speed_profile(SCENE, PLAN),),
        "trace": (lampyris.simulate(SCENE, "astar", traffic=walkers),),
        "drive": (lampyris.drive(SCENE, "astar", traffic=walkers),),
        "compare": ([PLAN, lampyris.plan(SCENE, "theta-star")], GRID),
    }


def test_every_function_is_tried() -> None:
    assert set(calls()) == set(plot.__all__)
    for name in plot.__all__:
        assert inspect.signature(getattr(plot, name)).parameters["ax"].default is None


@pytest.mark.commit(3)
@pytest.mark.parametrize("name", plot.__all__)
def test_it_draws_on_the_axes_given_and_returns_them(name: str, ax: Axes) -> None:
    assert getattr(plot, name)(*calls()[name], ax=ax) is ax
    assert ax.has_data()
    assert ax.get_xlabel()
    assert ax.get_ylabel()
    ax.figure.canvas.draw()


@pytest.mark.parametrize("name", plot.__all__)
def test_without_axes_it_draws_on_the_current_ones(name: str, pyplot: Any) -> None:
    made = getattr(plot, name)(*calls()[name])
    assert made is pyplot.gca()
    assert getattr(plot, name)(*calls()[name]) is made


def pixels_of(ax: Axes) -> np.ndarray:
    """The figure, drawn."""
    canvas: Any = ax.figure.canvas
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())


def colour_at(pixels: np.ndarray, ax: Axes, x_m: float, y_m: float) -> tuple[int, int, int]:
    """The pixel that shows a point of the map frame."""
    column, row = ax.transData.transform((x_m, y_m))
    r, g, b, _ = pixels[pixels.shape[0] - 1 - int(row), int(column)].tolist()
    return r, g, b


@pytest.mark.parametrize("yaw", some([0.5, 0.0, math.pi / 2, -2.0]))
def test_a_map_is_where_its_cells_are_in_metres(ax: Axes, yaw: float) -> None:
    grid = dataclasses.replace(GRID, origin=(-1.0, 2.0, yaw))
    plot.grid(grid, ax=ax)
    pixels = pixels_of(ax)
    for y, x in np.ndindex(WALLS.shape):
        dark = sum(colour_at(pixels, ax, *grid.to_metres((x, y)).tolist())) < 300
        assert dark == WALLS[y, x], (x, y)
    (left, right), (low, high) = ax.get_xlim(), ax.get_ylim()
    assert left < right
    assert low < high, "y is up"


def test_a_map_fills_its_axes(ax: Axes) -> None:
    plot.grid(GRID, ax=ax)
    assert (*ax.get_xlim(), *ax.get_ylim()) == pytest.approx((-1.0, 2.0, 2.0, 4.0))


def test_a_path_is_in_metres(ax: Axes) -> None:
    plot.path(PLAN, ax=ax, color="green")
    (line,) = ax.lines
    assert line.get_color() == "green"
    assert np.array_equal(np.asarray(line.get_xydata()), GRID.to_metres(PLAN.cells))  # type: ignore[arg-type]
    sampled = lampyris.smooth(SCENE, PLAN)
    for other in (PLAN.path, sampled, sampled.curve, [[0, 3], [5, 0]]):
        plot.path(other, GRID, ax=ax)  # type: ignore[arg-type]
        ends = np.asarray(ax.lines[-1].get_xydata())[[0, -1]]
        assert ends == pytest.approx(GRID.to_metres(np.array([SCENE.start, SCENE.goal])))


def test_a_run_shows_the_robot_and_every_obstacle(ax: Axes) -> None:
    (run,) = calls()["trace"]
    plot.trace(run, ax=ax)
    assert len(ax.lines) == len(run.tracks) + 1 + 2
    robot = np.asarray(ax.lines[len(run.tracks)].get_xydata())
    assert np.array_equal(robot, GRID.to_metres(run.robot))


def test_results_are_compared_by_name(ax: Axes) -> None:
    plot.compare({"one": PLAN, "two": PLAN}, ax=ax)
    legend: Any = ax.get_legend()
    assert [text.get_text() for text in legend.get_texts()] == ["one", "two"]
    speeds = [lampyris.speed_profile(SCENE, PLAN, law) for law in ("physical", "constant")]
    plot.compare(speeds, ax=ax)
    assert ax.get_ylabel() == "speed (m/s)"


@pytest.mark.parametrize(
    ("call", "says"),
    [
        (lambda: plot.path(PLAN.path), "GRID.*does not know its map"),
        (lambda: plot.path(lampyris.Plan(lampyris.Status.NO_PATH, "astar"), GRID), "holds no path"),
        (lambda: plot.path("abc", GRID), "PATH_POINTS"),
        (lambda: plot.grid(SCENE), "TYPE.*a Scene; allowed: a Grid"),
        (lambda: plot.grid(GRID, ax=3), "AXES"),
        (lambda: plot.field(calls()["field"][0], GRID, layer="heat"), "LAYER"),
        (lambda: plot.field(calls()["field"][0], lampyris.Grid([[0, 0]])), "FIELD"),
        (lambda: plot.compare([]), "COMPARE.*no results"),
        (lambda: plot.compare([PLAN, calls()["profile"][0]], GRID), "COMPARE.*different kinds"),
        (lambda: plot.compare(PLAN), "COMPARE"),
    ],
)
def test_wrong_arguments_are_refused_by_name(call: Any, says: str) -> None:
    with pytest.raises(SettingError, match=says):
        call()


def test_the_module_is_loaded_when_it_is_used() -> None:
    assert lampyris.plot is plot
    assert "plot" in dir(lampyris)

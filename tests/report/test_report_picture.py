"""Pictures: every ingredient is on them, they are the same bytes each time, odd maps do not upset them."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from PIL import Image
from report_samples import sample_field, sample_plan, sample_profile, sample_scene

from lampyris.errors import FileError, UsageError
from lampyris.model.field import Gate
from lampyris.model.grid import Grid
from lampyris.model.moves import MOVES
from lampyris.model.path import path_of
from lampyris.model.plan import Plan, Status
from lampyris.model.scene import Scene
from lampyris.report import style
from lampyris.report.pictures.plan_picture import _subtitle, draw_plan, draw_speed
from lampyris.report.pictures.raster import draw_map
from sizes import some


def drawn(tmp_path: Path, name: str = "plan.png", **change: Any) -> Path:
    scene = sample_scene()
    plan = sample_plan(scene)
    given: dict[str, Any] = {
        "grid": scene.grid,
        "plan": plan,
        "field": sample_field(scene),
        "profile": sample_profile(plan),
        "scene": scene,
    }
    given |= change
    out = tmp_path / name
    draw_plan(given.pop("grid"), given.pop("plan"), out=out, **given)
    return out


def pixels_of(path: Path) -> np.ndarray:
    with Image.open(path) as image:
        return np.asarray(image.convert("RGB"))


def area(path: Path, colour: tuple[int, ...], slack: int = 2) -> int:
    """How many pixels have a colour, or nearly."""
    return int((np.abs(pixels_of(path).astype(int) - colour).max(axis=-1) <= slack).sum())


def rgb(text: str) -> tuple[int, ...]:
    return tuple(int(text[k : k + 2], 16) for k in (1, 3, 5))


def test_a_path_of_straight_lines_states_their_length_before_the_cost_of_its_cells() -> None:
    scene = sample_scene()
    plan = sample_plan(scene)
    assert plan.path is not None
    assert _subtitle(plan).startswith(f"cost {plan.cost:.6g}")
    ends = plan.path.cells[[0, -1]]
    lines = replace(plan, waypoints=ends)
    assert _subtitle(lines).startswith(
        f"lines {lines.any_angle_length:.6g} cells  ·  cell by cell: cost {plan.cost:.6g}"
    )


@pytest.mark.nightly
@pytest.mark.commit(1)
@pytest.mark.parametrize("name", some(["plan.png", "plan.svg", "PLAN.PNG"], 2))
def test_the_same_plan_is_the_same_bytes(tmp_path: Path, name: str) -> None:
    first = drawn(tmp_path, name).read_bytes()
    assert drawn(tmp_path, name).read_bytes() == first
    assert not re.search(rb"20\d\d-\d\d-\d\dT|Matplotlib|dc:date", first)


@pytest.mark.nightly
def test_everything_that_matters_is_on_the_picture(tmp_path: Path) -> None:
    full = drawn(tmp_path)
    # A cell is over 6,000 pixels: that much of each ground, and enough of each mark.
    for colour in (style.WALL, style.UNKNOWN, style.UNKNOWN_STRIPE):
        assert area(full, colour) > 6_000, colour
    for text in (style.START, style.GOAL, style.GATE):
        assert area(full, rgb(text)) > 200, text
    bare = drawn(tmp_path, "bare.png", layer="none", profile=None)
    assert area(bare, style.FREE, 0) > 300_000
    assert area(full, style.FREE, 0) < 1_000


@pytest.mark.nightly
def test_cells_cut_off_from_the_goal_look_different(tmp_path: Path) -> None:
    scene = sample_scene()
    field = sample_field(scene)
    luciferin = field.luciferin.copy()
    luciferin[8, :3] = np.inf
    assert area(drawn(tmp_path, field=replace(field, luciferin=luciferin)), style.CUT_OFF, 0) > 12_000
    assert area(drawn(tmp_path), style.CUT_OFF, 0) < 500


def test_words_tell_cost_gap_and_iterations(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(style, "save", lambda figure, *_: seen.append(figure))
    seen: list[Any] = []
    drawn(tmp_path)
    plan = sample_plan(sample_scene())
    drawn(tmp_path, plan=Plan(Status.NO_PATH, "by-hand", detail="No path: walls are in the way."))
    words = ["\n".join(t.get_text() for t in figure.texts) for figure in seen]
    for part in (
        "by-hand on hall",
        f"cost {plan.cost:.6g}",
        "optimal",
        "gap 0.0%",
        f"{plan.iterations} iterations",
    ):
        assert part in words[0]
    assert "12 x 9 cells of 0.5 m" in words[0]
    assert "No path: walls are in the way." in words[1]
    labels = [{t.get_text() for t in figure.legends[0].get_texts()} for figure in seen]
    ground = {"start", "goal", "wall", "unknown"}
    assert labels[0] == ground | {
        "path, by speed",
        "jump of the walk",
        "gate on the path",
        "gate",
        "gate, dead end",
    }
    assert labels[1] == ground
    axes = [a.get_ylabel() for a in seen[0].axes]
    assert axes == ["y (cells)", "speed (m/s)", "luciferin (lower is better)"]
    for figure in seen:
        renderer = FigureCanvasAgg(figure).get_renderer()
        legend, map_ = (
            figure.legends[0].get_window_extent(renderer),
            figure.axes[0].get_window_extent(renderer),
        )
        assert legend.y1 < map_.y0, "the legend covers the map"
        assert legend.x1 <= figure.bbox.x1


def test_many_jumps_and_many_gates_do_not_hide_the_map(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(style, "save", lambda figure, *_: seen.append(figure))
    seen: list[Any] = []
    plan = sample_plan(sample_scene())
    crowd = tuple(Gate((k % 12, k // 12), "x", 0.5, False) for k in range(9)) * 40
    drawn(tmp_path, plan=replace(plan, gates_in_map=crowd, jumps=plan.jumps * 60))
    labels = {t.get_text() for t in seen[0].legends[0].get_texts()}
    assert "gate" not in labels
    assert "jump of the walk" not in labels
    assert "gate on the path" in labels
    assert any("360 gates" in t.get_text() for t in seen[0].texts)


@pytest.mark.commit(1)
@pytest.mark.parametrize("shape", [(1, 1), (1, 90), (90, 1), (3, 700)])
def test_odd_maps_can_be_drawn(tmp_path: Path, shape: tuple[int, int]) -> None:
    grid = Grid(np.zeros(shape, dtype=bool))
    far = (shape[1] - 1, shape[0] - 1)
    cells = [(x, y) for y in range(shape[0]) for x in range(shape[1])] if min(shape) == 1 else [(0, 0)]
    plan = Plan(Status.FOUND, "by-hand", path_of(np.array(cells), MOVES["four-connected"]))
    out = tmp_path / "odd.png"
    draw_plan(grid, plan, scene=Scene(grid, (0, 0), far), out=out)
    assert max(pixels_of(out).shape) < 2000


def test_other_suffixes_and_layers_are_refused_by_name(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"'.jpg'.*\.png or \.svg"):
        drawn(tmp_path, "plan.jpg")
    with pytest.raises(UsageError, match="luciferin, cost, none"):
        drawn(tmp_path, layer="heat")
    with pytest.raises(FileError, match="No such file"):
        drawn(tmp_path / "nowhere")


# ---- pixels of a map ----


def test_small_maps_grow_by_whole_pixels() -> None:
    blocked = np.array([[True, False, False]])
    raster = draw_map(Grid(blocked), 30)
    assert raster.scale == 10
    assert raster.rgb.shape == (10, 30, 3)
    assert (raster.rgb[:, :10] == style.WALL).all()
    assert (raster.rgb[:, 10:] == style.FREE).all()


def test_large_maps_shrink_and_keep_their_thin_walls() -> None:
    blocked = np.zeros((1001, 2000), dtype=bool)
    blocked[:, 777] = True
    raster = draw_map(Grid(blocked), 500)
    assert raster.rgb.shape == (251, 500, 3)
    dark = raster.rgb[:, :, 0].astype(int)
    assert dark[100].argmin() == 777 // 4
    assert dark[100].min() < 0.65 * style.FREE[0]


def test_a_landscape_is_bright_at_the_goal_and_even_between(tmp_path: Path) -> None:
    layer = np.arange(256.0)[None, :]
    colours_ = style.landscape_colours()
    raster = draw_map(Grid(np.zeros((1, 256), bool)), 256, layer, colours_)
    assert (raster.rgb[0] == colours_).all()
    light = raster.rgb[0].astype(float) @ [0.2126, 0.7152, 0.0722]
    assert (np.diff(light) < 1.5).all(), "lightness falls along the ramp"
    assert light[0] - light[-1] > 80


# ---- terrain ----


def sample_terrain(scene: Scene) -> np.ndarray:
    """Plain on the left, then twice, then five times as dear."""
    terrain = np.zeros(scene.grid.blocked.shape, dtype=np.uint8)
    terrain[:, 3:6] = 63
    terrain[:, 7:] = 252
    return terrain


def test_a_picture_says_where_terrain_is_not_seen(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(style, "save", lambda figure, *_: seen.append(figure))
    seen: list[Any] = []
    scene = sample_scene()
    hilly = replace(scene.grid, terrain=sample_terrain(scene))
    drawn(tmp_path, grid=hilly)
    drawn(tmp_path, grid=hilly, layer="none")
    drawn(tmp_path)
    said = [any("layer none shows it" in t.get_text() for t in figure.texts) for figure in seen]
    assert said == [True, False, False]
    foot = next(t for t in seen[0].texts if "layer none" in t.get_text())
    assert foot.get_window_extent(FigureCanvasAgg(seen[0]).get_renderer()).x1 <= seen[0].bbox.x1


@pytest.mark.nightly
def test_terrain_is_the_ground_where_there_is_no_landscape(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = sample_scene()
    grid = replace(scene.grid, terrain=sample_terrain(scene))
    assert grid.terrain is not None
    twice, dear = (tuple(c) for c in style.terrain_colours()[[63, 252]].tolist())
    bare = drawn(tmp_path, "bare.png", grid=grid, layer="none")
    for colour in (twice, dear, style.WALL, style.UNKNOWN, style.UNKNOWN_STRIPE, style.FREE):
        assert area(bare, colour, 0) > 6_000, colour
    again = drawn(tmp_path, "again.png", grid=grid, field=None)
    assert again.read_bytes() == bare.read_bytes(), "without a field there is no landscape either"
    full = drawn(tmp_path, "full.png", grid=grid)
    plain = pixels_of(drawn(tmp_path))
    foot = 50  # the last line of words, which says that there is terrain
    assert np.array_equal(pixels_of(full)[:-foot], plain[:-foot])
    monkeypatch.setattr(style, "save", lambda figure, *_: seen.append(figure))
    seen: list[Any] = []
    drawn(tmp_path, grid=grid, layer="none")
    drawn(tmp_path, grid=replace(grid, terrain=np.full_like(grid.terrain, 126)), layer="none")
    drawn(tmp_path, grid=grid)
    labels = [{t.get_text() for t in figure.legends[0].get_texts()} for figure in seen]
    assert "terrain 2-5x" in labels[0]
    assert "terrain 3x" in labels[1]
    assert not any(label.startswith("terrain") for label in labels[2])


def test_terrain_is_light_and_quiet_and_even() -> None:
    colours = style.terrain_colours().astype(float)
    assert colours.shape == (253, 3)
    assert tuple(colours[0]) == style.FREE
    light = colours @ [0.2126, 0.7152, 0.0722]
    assert (np.diff(light) <= 0).all()
    assert light[0] - light[1] > 8, "the cheapest terrain can be told from plain ground"
    wall = np.array(style.WALL) @ [0.2126, 0.7152, 0.0722]
    assert light[-1] - wall > 100, "the dearest terrain is no wall"
    # Unknown cells are grey and blue, terrain is the other way.
    assert (colours[1:, 0] > colours[1:, 2] + 5).all()
    assert style.UNKNOWN[0] < style.UNKNOWN[2]


def test_a_pixel_of_many_cells_has_the_mean_of_its_free_ones() -> None:
    blocked = np.zeros((2, 8), dtype=bool)
    blocked[0, 2] = True
    blocked[:, 4:6] = True
    terrain = np.array([[0, 100, 0, 90, 9, 9, 1, 2], [0, 100, 60, 60, 9, 9, 3, 3]])
    raster = draw_map(Grid(blocked, terrain=terrain), 4)
    colours = style.terrain_colours()
    assert raster.rgb.shape == (1, 4, 3)
    assert (raster.rgb[0, 0] == colours[50]).all()
    ground, wall = colours[70].astype(float), np.array(style.WALL)
    assert (raster.rgb[0, 1] == np.round(ground + (wall - ground) * 0.25**0.6)).all()
    assert (raster.rgb[0, 2] == style.WALL).all()
    assert (raster.rgb[0, 3] == colours[2]).all()
    large = draw_map(Grid(blocked, terrain=terrain), 80)
    assert (large.rgb[::10, ::10][~blocked] == colours[terrain[~blocked]]).all()


# ---- the speed chart ----


@pytest.mark.commit(1)
@pytest.mark.parametrize("law", ["physical", "dissertation"])
def test_the_speed_chart_shows_each_cause_in_its_colour(tmp_path: Path, law: str) -> None:
    profile = sample_profile(sample_plan(sample_scene()), law)
    out = tmp_path / "speed.png"
    draw_speed(profile, out)
    first = out.read_bytes()
    draw_speed(profile, out)
    assert out.read_bytes() == first
    shown = style.cause_colours(profile.cause)
    assert len(set(shown.values())) == len(shown)
    for colour in shown.values():
        # Areas are drawn with an opacity of 0.8 on white.
        assert area(out, tuple(round(0.8 * c + 0.2 * 255) for c in rgb(colour))) > 500, colour


def test_a_profile_of_one_node_has_a_chart(tmp_path: Path) -> None:
    one = replace(
        sample_profile(sample_plan(sample_scene())),
        s=[0.0],
        v=[0.0],
        a=[0.0],
        t=[0.0],
        cause=("start",),
        cause_index=None,
        caps=(),
    )
    draw_speed(one, tmp_path / "one.svg")
    assert (tmp_path / "one.svg").stat().st_size > 1000
    assert math.isclose(one.mean, 0.0)

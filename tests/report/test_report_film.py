"""Films: what is on the frames, that WebP loses nothing, how long they run, and that they stay bounded."""

from __future__ import annotations

import tracemalloc
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from report_samples import sample_trace

from lampyris.errors import FileError, UsageError
from lampyris.model.edit import Edit
from lampyris.model.settings.sensor import Sensor
from lampyris.model.trace import Outcome, Trace
from lampyris.report import style
from lampyris.report.film import simulation_film, sprites
from lampyris.report.film.film_frames import TraceRenderer
from lampyris.report.film.simulation_film import film


def frames_of(path: Path) -> tuple[list[np.ndarray], list[int]]:
    pictures, times = [], []
    with Image.open(path) as image:
        for k in range(image.n_frames):
            image.seek(k)
            pictures.append(np.asarray(image.convert("RGB")))
            times.append(int(image.info["duration"]))
    return pictures, times


def count(picture: np.ndarray, colour: tuple[int, int, int], slack: int = 8) -> int:
    return int((np.abs(picture.astype(int) - colour).max(axis=-1) <= slack).sum())


def test_a_film_names_the_planner_below_the_map() -> None:
    # The same letters: a longer legend makes the picture wider.
    one, other = (
        TraceRenderer(replace(sample_trace(), planner=name), None).frame(1.0) for name in ("astar", "tasar")
    )
    rows = np.flatnonzero((one != other).any(axis=(1, 2)))
    assert rows.size
    assert rows.min() > len(one) - 40, "in the legend alone"


@pytest.mark.commit(1)
@pytest.mark.parametrize("suffix", [".webp", ".gif"])
def test_a_film_tells_the_whole_run(tmp_path: Path, suffix: str) -> None:
    trace = sample_trace()
    out = tmp_path / f"run{suffix}"
    seen: list[int] = []
    film(trace, out, fps=20, progress=seen.append)
    drawn = simulation_film.GLIDE * trace.ticks + 1
    assert seen == list(range(1, drawn + 1))
    pictures, times = frames_of(out)
    # Equal neighbours may be stored once; the time they stand is kept.
    assert len(pictures) <= drawn
    assert sum(times) == 50 * (drawn - 1) + simulation_film.HOLD_MS
    assert times[-1] >= 1000
    first, last = pictures[0], pictures[-1]
    for name in ("random-walk", "patrol", "crossing"):
        assert count(first, sprites.KINDS[name][1]) > 100, name
    legend = last[-40:]
    for colour in (sprites.ROBOT, sprites.GOAL, *(k[1] for k in sprites.KINDS.values()), sprites.OTHER[1]):
        assert count(legend, colour) > 10
    assert count(last, style.WALL) > 1000
    first_bytes = out.read_bytes()
    film(trace, out, fps=20)
    assert out.read_bytes() == first_bytes


@pytest.mark.nightly
def test_webp_keeps_every_pixel(tmp_path: Path) -> None:
    trace = sample_trace()
    out = tmp_path / "run.webp"
    film(trace, out)
    pictures, _ = frames_of(out)
    stage = TraceRenderer(trace, None, 1)
    last = stage.frame(float(trace.ticks))
    # One palette of 256 colours stands between the two; flat colours are in it.
    assert np.abs(pictures[-1].astype(int) - last).mean() < 1.0
    assert len(np.unique(pictures[-1].reshape(-1, 3), axis=0)) <= 256


@pytest.mark.nightly
def test_terrain_lies_under_a_film(tmp_path: Path) -> None:
    trace = sample_trace()
    terrain = np.zeros(trace.scene.grid.blocked.shape, dtype=np.uint8)
    terrain[6:] = np.arange(12) * 20
    hilly = replace(trace, scene=replace(trace.scene, grid=replace(trace.scene.grid, terrain=terrain)))
    out = tmp_path / "run.webp"
    film(hilly, out)
    pictures, _ = frames_of(out)
    shades = style.terrain_colours()
    for value in range(20, 240, 20):
        red, green, blue = shades[value].tolist()
        assert count(pictures[0][:-70], (red, green, blue), 3) > 500, value
    # Besides the ground, only the legend has more to say.
    plain, with_terrain = (TraceRenderer(t, None, 1).frame(0.0) for t in (trace, hilly))
    assert count(with_terrain[-40:], tuple(shades[220].tolist())) > 50
    assert count(plain[-40:], tuple(shades[220].tolist())) == 0


def test_bodies_glide_and_the_trail_stays() -> None:
    stage = TraceRenderer(sample_trace(), None, 1)
    shots = [stage.frame(m) for m in (0.0, 0.5, 1.0, 6.0)]
    blue = [
        np.argwhere(np.abs(s[:-70].astype(int) - sprites.ROBOT).max(axis=-1) < 8).mean(axis=0) for s in shots
    ]
    step = blue[2] - blue[0]
    assert np.abs(step).max() > 10
    assert np.allclose(blue[1] - blue[0], step / 2, atol=1.5)
    start = np.round(blue[0] + step / 2).astype(int)
    ground = shots[0][start[0], start[1]]
    assert not (shots[3][start[0], start[1]] == ground).all(), "the trail is gone"
    stage.rewind()
    assert (stage.frame(0.0) == shots[0]).all()


def test_events_flash_around_the_robot() -> None:
    trace = sample_trace()
    quiet = replace(trace, events=())
    for tick, colour in ((0, (123, 44, 191)), (4, (110, 110, 120))):
        pair = [TraceRenderer(t, None, 1).frame(float(tick))[:-70] for t in (trace, quiet)]
        assert count(pair[0], colour) > count(pair[1], colour) + 50
    late = [TraceRenderer(t, None, 1).frame(6.0) for t in (trace, quiet)]
    assert (late[0] == late[1]).all()


def test_via_points_are_marked_in_their_order() -> None:
    trace = sample_trace()
    cell = (3, 5)
    marked = TraceRenderer(replace(trace, via=(cell, (4, 7)), via_ticks=()), None)
    stage = TraceRenderer(trace, None)
    x, y = (round(v) for v in marked._sheet.at(*cell))
    before, after = (one.frame(0.0)[y - 8 : y + 9, x - 8 : x + 9] for one in (stage, marked))
    assert count(after, (255, 255, 255), 1) > 80
    assert count(after, sprites.INK, 60) > 10, "a rim and a number"
    assert (before != after).any()
    u, v = (round(v) for v in marked._sheet.at(4, 7))
    second = marked.frame(0.0)[v - 8 : v + 9, u - 8 : u + 9]
    assert (after != second).any(), "numbers differ"
    legend = [one.frame(0.0)[-40:] for one in (stage, marked)]
    assert legend[0].shape != legend[1].shape or (legend[0] != legend[1]).any()


@pytest.mark.parametrize(("first", "angle"), [(0.3, 1.0), (-2.5, 4.4), (3.0, 0.05)])
def test_a_sector_is_as_dark_as_its_rim_is_near(first: float, angle: float) -> None:
    """Beside a rim of many points, whose distance from each pixel is measured."""
    canvas = np.zeros((40, 50, 3), dtype=np.uint8)
    tip, radius, sides = np.array((22.3, 18.7)), 15.0, (first, first + angle)
    sprites.draw_sector(canvas, (22.3, 18.7), radius, sides, (255, 255, 255))
    turns = np.linspace(*sides, 4000)
    arc = radius * np.column_stack((np.cos(turns), np.sin(turns)))
    rim = tip + np.concatenate([arc, *(np.linspace(0, 1, 1000)[:, None] * end for end in (arc[0], arc[-1]))])
    middles = np.stack(np.meshgrid(np.arange(50) + 0.5, np.arange(40) + 0.5), axis=-1).reshape(-1, 1, 2)
    away = np.array([np.hypot(*(rim - one).T).min() for one in middles]).reshape(40, 50)
    assert np.abs(canvas[..., 0] - 255 * np.clip(1 - away, 0, 1)).max() < 3
    assert (canvas > 0).sum() > 60


def test_a_narrow_sensor_of_any_range_is_drawn_on_the_map_without_a_large_picture() -> None:
    """Pictures of whole sectors, one a direction, took gigabytes."""
    sheet = TraceRenderer(sample_trace(), None)._sheet
    robot = sheet.at(4, 4)
    for metres in (sheet.grid.width * 0.9, 1e6):
        canvas = sheet.paper.copy()
        tracemalloc.start()
        for k in range(20):
            sheet.sight(canvas, Sensor(metres * sheet.grid.resolution, 1.0), robot, 0.3 * k)
        most = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        assert most < 20e6
        rows, columns = np.nonzero((canvas != sheet.paper).any(axis=2))
        assert len(rows) > 1000
        assert sheet.top <= rows.min()
        assert rows.max() < sheet.top + sheet.grid.height * sheet.scale
        assert sheet.left <= columns.min()
        assert columns.max() < sheet.left + sheet.grid.width * sheet.scale


def test_obstacles_appear_when_they_appear() -> None:
    stage = TraceRenderer(sample_trace(), None, 1)
    colour = sprites.KINDS["recorded"][1]
    # A flash of the same violet stands at tick 0; count where no robot is.
    early, late = stage.frame(1.5)[:-70, 300:], stage.frame(2.0)[:-70, 300:]
    assert count(late, colour) > count(early, colour) + 50


def test_kinds_differ_in_shape_and_letter_not_in_colour_alone() -> None:
    looks = [*sprites.KINDS.values(), sprites.OTHER]
    assert len({shape for shape, *_ in looks}) == len(looks)
    assert len({letter for _, _, letter, _ in looks}) == len(looks)
    masks = [sprites.sprite(shape, (9, 9, 9), "", 24).alpha > 0.5 for shape, *_ in looks]
    for k, one in enumerate(masks):
        assert 0.2 < one.mean() < 0.95
        for other in masks[:k]:
            assert (one ^ other).mean() > 0.04


def test_a_long_run_stays_bounded_and_says_so(tmp_path: Path) -> None:
    trace = sample_trace(ticks=1000)
    shown = simulation_film.moments(trace.ticks, 16)
    assert len(shown.moments) <= simulation_film.MAX_FRAMES + 1
    assert (shown.moments[0], shown.moments[-1], shown.stride) == (0.0, 1000.0, 5)
    plain, told = (TraceRenderer(trace, None, k).frame(0.0) for k in (1, 5))
    assert not (plain == told).all()
    for ticks, frames in ((0, 1), (1, 3), (120, 241), (121, 122), (240, 241), (241, 122)):
        assert len(simulation_film.moments(ticks, 16).moments) == frames


@pytest.mark.nightly
def test_films_of_odd_maps(tmp_path: Path) -> None:
    one = sample_trace(Outcome.TIMEOUT, ticks=0)
    for scale in (None, 1, 7, 64):
        out = tmp_path / "one.webp"
        film(one, out, scale=scale)
        height, width = frames_of(out)[0][0].shape[:2]
        assert width % 2 == height % 2 == 0
        assert width <= max(480, 12 * 64 + 20)


@pytest.mark.parametrize("size", [(3, 900), (900, 3)])
def test_films_of_large_maps_are_shrunk(size: tuple[int, int]) -> None:
    trace = sample_trace()
    blocked = np.zeros(size, dtype=bool)
    scene = replace(trace.scene, grid=type(trace.scene.grid)(blocked), start=(1, 1), goal=(2, 2))
    robot = np.array([[1, 1], [2, 1], [2, 2]])
    small = Trace(
        scene, "by-hand", 0, Outcome.ARRIVED, robot, (), (), (), np.zeros(3), ("limit",) * 3,
        "physical", "m/s",
        (), 0, 0, 1, 0, None,
    )  # fmt: skip
    picture = TraceRenderer(small, None, 1).frame(1.5)
    assert max(picture.shape[:2]) <= 660


def test_what_a_film_cannot_be_is_refused(tmp_path: Path) -> None:
    trace = sample_trace(ticks=2)
    with pytest.raises(UsageError, match=r"\.webp or \.gif"):
        film(trace, tmp_path / "run.mp4")
    for fps in (0, -1, 51, float("nan")):
        with pytest.raises(UsageError, match="frames a second"):
            film(trace, tmp_path / "run.gif", fps=fps)
    with pytest.raises(UsageError, match="pixels a cell"):
        film(trace, tmp_path / "run.gif", scale=0)
    with pytest.raises(FileError):
        film(trace, tmp_path / "nowhere" / "run.gif")


def test_walls_are_drawn_from_their_tick_on_and_the_way_stays() -> None:
    trace = sample_trace()
    x, y = (int(v) for v in trace.robot[1])
    cells = [(cx, cy) for cy, cx in np.argwhere(~trace.scene.grid.blocked).tolist()]
    taken = {c for t in range(trace.ticks + 1) for c in trace.obstacles_at(t)}
    free = [c for c in cells if c not in taken and max(abs(c[0] - x), abs(c[1] - y)) > 3][:4]
    edited = replace(trace, edits=(Edit(2, tuple(free)), Edit(4, (), tuple(free[:2]))))
    with_walls, without = TraceRenderer(edited, 12), TraceRenderer(trace, 12)
    sheet = without._sheet

    def middle(frame: np.ndarray, cell: tuple[int, int]) -> bool:
        px, py = (round(v) for v in sheet.at(*cell))
        return bool(np.abs(frame[py, px].astype(int) - style.WALL).max() < 8)

    for moment in (0.0, 1.0, 1.5):
        assert (with_walls.frame(moment) == without.frame(moment)).all()
    for moment, walls in ((2.0, free), (3.5, free), (4.0, free[2:]), (float(trace.ticks), free[2:])):
        a, b = with_walls.frame(moment), without.frame(moment)
        assert [c for c in free if middle(a, c)] == list(walls), moment
        # Elsewhere nothing is other than it was: the trail above all.
        same = (a == b).all(axis=-1)
        for c in walls:
            px, py = (int(v) for v in sheet.at(*c))
            same[py - 12 : py + 13, px - 12 : px + 13] = True
        assert same.all(), moment
    with_walls.rewind()
    assert (with_walls.frame(0.0) == TraceRenderer(trace, 12).frame(0.0)).all()
    late = TraceRenderer(edited, 12)
    late.frame(float(trace.ticks))
    assert (late.frame(float(trace.ticks)) == with_walls.frame(float(trace.ticks))).all()

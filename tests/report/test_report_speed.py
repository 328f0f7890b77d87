"""Curves coloured by speed and cause, laws compared, drives on film, in charts and in tables."""

from __future__ import annotations

import csv
import itertools
import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from drive_samples import sample_course, sample_drive, sample_room
from matplotlib.backends.backend_agg import FigureCanvasAgg
from PIL import Image
from report_samples import sample_plan, sample_profile, sample_scene

from lampyris.errors import UsageError
from lampyris.model.obstacles import ObstacleStates
from lampyris.report import style
from lampyris.report.charts.drive_chart import distance_to_obstacles, draw_drive
from lampyris.report.charts.speed_compare import draw_comparison
from lampyris.report.data.csv import DRIVE_COLUMNS, PROFILE_COLUMNS, write_drive_csv, write_profile_csv
from lampyris.report.data.metrics import cause_shares, drive_shares, worth_telling
from lampyris.report.data.serialize import drive_record, profile_record
from lampyris.report.film.drive_film import DriveRenderer, film_drive
from lampyris.report.pictures.path_picture import draw_sampled_path


@pytest.fixture
def figures(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """Figures instead of files."""
    seen: list[Any] = []
    monkeypatch.setattr(style, "save", lambda figure, *_: seen.append(figure))
    return seen


def words_of(figure: Any) -> set[str]:
    return {t.get_text() for legend in figure.legends for t in legend.get_texts()}


def boxes(figure: Any) -> dict[str, Any]:
    """Where legends and axes are."""
    renderer = FigureCanvasAgg(figure).get_renderer()
    out = {f"legend {k}": one.get_window_extent(renderer) for k, one in enumerate(figure.legends)}
    return out | {f"axes {k}": one.get_tightbbox(renderer) for k, one in enumerate(figure.axes)}


def tidy(figure: Any) -> None:
    """Nothing lies over anything else, nothing leaves the paper."""
    placed = boxes(figure)
    for name, box in placed.items():
        assert box.x0 >= -1, name
        assert box.y0 >= -1, name
        assert box.x1 <= figure.bbox.x1 + 1, name
        assert box.y1 <= figure.bbox.y1 + 1, name
    for (one, a), (other, b) in itertools.combinations(placed.items(), 2):
        if one.startswith("axes") and other.startswith("axes"):
            continue
        wide, high = min(a.x1, b.x1) - max(a.x0, b.x0), min(a.y1, b.y1) - max(a.y0, b.y0)
        assert wide <= 1 or high <= 1, (one, other)


# ---- colours ----

_SEEN_BY = {
    "everybody": np.eye(3),
    "protanopia": [[0.152, 1.053, -0.205], [0.115, 0.786, 0.099], [-0.004, -0.048, 1.052]],
    "deuteranopia": [[0.367, 0.861, -0.228], [0.280, 0.673, 0.047], [-0.012, 0.043, 0.969]],
    "tritanopia": [[1.256, -0.077, -0.179], [-0.078, 0.931, 0.148], [0.005, 0.691, 0.304]],
}
"""Linear RGB as dichromats see it (Machado, Oliveira and Fernandes 2009, severity 1)."""


def lab(colour: str, seen: Any) -> np.ndarray:
    s = np.array([int(colour[k : k + 2], 16) for k in (1, 3, 5)]) / 255
    linear = np.where(s <= 0.04045, s / 12.92, ((s + 0.055) / 1.055) ** 2.4)
    xyz = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
    f = np.cbrt(np.maximum(xyz @ np.clip(seen @ linear, 0, 1) / [0.9505, 1.0, 1.0888], 0.008856))
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


@pytest.mark.parametrize("who", _SEEN_BY)
def test_causes_that_can_meet_are_told_apart_by_everybody(who: str) -> None:
    seen = np.array(_SEEN_BY[who])
    others = ("ring 1", "ring 2", "angle")
    for group in (
        set(style.CAUSES) - set(others),
        {"start", "goal", "limit", "acceleration", "braking", "obstacle", "waiting", *others},
    ):
        for a, b in itertools.combinations(sorted(group), 2):
            away = np.linalg.norm(lab(style.CAUSES[a], seen) - lab(style.CAUSES[b], seen))
            assert away >= 12, (a, b, float(away))


def test_every_law_has_a_look_of_its_own() -> None:
    from lampyris.motion.laws import registry as laws

    looks = [style.law_look(name) for name in laws.names()]
    assert len(set(looks)) == len(looks)
    assert style.law_look("nobody's")[1] == "dotted"


# ---- shares ----


def test_shares_are_of_the_whole() -> None:
    profile = sample_course()
    found = cause_shares(profile)
    assert sum(c.distance for c in found) == pytest.approx(1)
    assert sum(c.time for c in found) == pytest.approx(1)
    assert [c.time for c in found] == sorted((c.time for c in found), reverse=True)
    by = {c.cause: c for c in found}
    assert by["zone"].distance == pytest.approx(2 / 9, abs=0.01)
    # 2 m at 0.6 m/s of so many seconds.
    assert by["zone"].time == pytest.approx(2 / 0.6 / profile.duration, abs=0.01)
    ends = [c._replace(time=0.004 if c.cause == "goal" else 0.2) for c in found]
    assert {c.cause for c in worth_telling(ends)} == set(by) - {"goal"}
    one = replace(
        profile, s=[0.0], v=[0.0], a=[0.0], t=[0.0], cause=("start",), cause_index=None, caps=(), xy=[[1, 1]]
    )
    assert cause_shares(one) == (("start", 1.0, 1.0),)
    assert worth_telling(cause_shares(one)) == cause_shares(one)


def test_shares_of_a_drive_are_of_its_stretches() -> None:
    drive = sample_drive()
    by = {c.cause: c for c in drive_shares(drive)}
    assert by["wait"].distance == 0
    assert by["wait"].time == pytest.approx(2.0 / drive.duration)
    assert by["moving obstacle"].distance == pytest.approx(0.32 / drive.curves[0].length)
    assert sum(c.distance for c in by.values()) == pytest.approx(1)


# ---- pictures ----


@pytest.mark.nightly
@pytest.mark.parametrize("by", ["speed", "cause"])
def test_a_curve_is_drawn_by_speed_or_by_cause(tmp_path: Path, by: str, figures: list[Any]) -> None:
    profile = sample_course()
    movers = ObstacleStates([[12, 12], [40, 30]], [0.3, 0.0], [1, 1], [[1, 0], [0, 0]])
    draw_sampled_path(
        sample_room(),
        profile,
        tmp_path / "a.png",
        by=by,
        obstacle_states=movers,
        given=profile.xy[::40],
        radius=0.2,
    )  # type: ignore[index]
    told = words_of(figures[0])
    assert {"start", "goal", "wall", "moving obstacle", "path given"} <= told
    if by == "speed":
        assert "path, by speed" in told
        assert [a.get_ylabel() for a in figures[0].axes][1] == "speed (m/s)"
    else:
        assert {w.rsplit(" ", 1)[0] for w in told} >= {
            "zone",
            "curvature",
            "limit",
            "acceleration",
            "braking",
        }
        assert len(figures[0].axes) == 1
    tidy(figures[0])
    assert {"0", "1"} <= {t.get_text() for t in figures[0].axes[0].texts}, "obstacles bear their numbers"


@pytest.mark.nightly
def test_the_picture_is_the_same_every_time(tmp_path: Path) -> None:
    for k in range(2):
        draw_sampled_path(sample_room(), sample_course(), tmp_path / f"{k}.png", by="cause")
    assert (tmp_path / "0.png").read_bytes() == (tmp_path / "1.png").read_bytes()
    shown = np.asarray(Image.open(tmp_path / "0.png").convert("RGB"))
    for cause in ("zone", "curvature", "limit"):
        colour = [int(style.CAUSES[cause][k : k + 2], 16) for k in (1, 3, 5)]
        assert (np.abs(shown.astype(int) - colour).max(axis=2) < 3).sum() > 300, cause


def test_what_cannot_be_drawn_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="speed or cause"):
        draw_sampled_path(sample_room(), sample_course(), tmp_path / "a.png", by="law")
    flat = replace(sample_course(), xy=None)
    with pytest.raises(UsageError, match="without places"):
        draw_sampled_path(sample_room(), flat, tmp_path / "a.png")
    with pytest.raises(UsageError, match=r"\.png or \.svg"):
        draw_comparison([("a", sample_course())], 0, tmp_path / "a.gif")
    units = sample_profile(sample_plan(sample_scene()), "dissertation")
    with pytest.raises(UsageError, match="velocity units"):
        draw_comparison([("dissertation", units)], 0, tmp_path / "a.png")
    assert not list(tmp_path.iterdir())


def test_laws_are_compared_in_one_figure(tmp_path: Path, figures: list[Any]) -> None:
    laws = ("constant", "dissertation", "rpp", "physical", "optimum")
    draw_comparison(
        [(law, sample_course(law, 0.5 + 0.1 * k)) for k, law in enumerate(laws)], 3, tmp_path / "a.png"
    )
    figure = figures[0]
    told = words_of(figure)
    for k, law in enumerate(laws):
        assert f"{law}, {sample_course(law, 0.5 + 0.1 * k).duration:.4g} s" in told
    assert {"limit", "curvature", "zone"} <= told, "the caps of the chosen law"
    assert any(w.startswith("zone ") and w.endswith("%") for w in told)
    axes, band = figure.axes
    thick = [line for line in axes.lines if line.get_linewidth() > 2]
    assert [line.get_color() for line in thick] == [style.law_look("physical")[0]]
    assert len(axes.lines) == len(laws) + 3
    assert axes.get_ylim()[1] < 1.1, "a cap that says nothing does not stretch the picture"
    assert len(band.patches) >= 6
    tidy(figure)


def test_many_causes_and_laws_still_have_room(tmp_path: Path, figures: list[Any]) -> None:
    profile = sample_course(n=380)
    names = sorted(set(style.CAUSES) - {"obstacle", "waiting", "ring 1", "ring 2", "angle"})
    many = replace(profile, cause=tuple(names[k // 20] for k in range(380)), cause_index=None)
    draw_sampled_path(sample_room(), many, tmp_path / "a.png", by="cause")
    draw_comparison([(name, many) for name in style.LAWS], 0, tmp_path / "b.png")
    for figure in figures:
        tidy(figure)


# ---- drives ----


@pytest.mark.nightly
def test_a_drive_is_a_film_in_its_own_time(tmp_path: Path) -> None:
    drive = sample_drive()
    film_drive(drive, tmp_path / "a.webp")
    with Image.open(tmp_path / "a.webp") as film:
        assert film.n_frames == int(drive.duration * 16) + 2
        film.seek(film.n_frames - 1)
        last = np.asarray(film.convert("RGB")).astype(int)
    film_drive(drive, tmp_path / "b.webp")
    assert (tmp_path / "a.webp").read_bytes() == (tmp_path / "b.webp").read_bytes()
    # Fast pieces of the way are bright, the robot stands on the goal.
    assert (np.abs(last - (0, 114, 178)).max(axis=2) < 30).sum() > 50


@pytest.mark.nightly
def test_a_film_of_a_long_drive_is_bounded(tmp_path: Path) -> None:
    drive = sample_drive()
    slow = replace(drive, t=drive.t * 20, v=drive.v / 20, a=drive.a / 400)
    seen: list[int] = []
    film_drive(slow, tmp_path / "c.gif", progress=seen.append)
    assert seen[-1] <= 242, "bounded, whatever it takes"


def test_a_frame_is_what_was_at_that_moment() -> None:
    drive = sample_drive()
    stage = DriveRenderer(drive, 8, 1, 16.0)
    early, later = stage.frame(1.0), stage.frame(3.9)
    assert early.shape == later.shape
    assert (early != later).any()
    again = DriveRenderer(drive, 8, 1, 16.0)
    again.frame(1.0)
    assert (again.frame(3.9) == later).all()
    again.rewind()
    assert (again.frame(1.0) == early).all()
    # The second body is there from 2 s on, at (10, 5).
    x, y = (round(v) for v in stage._sheet.at(10, 5))
    assert (early[y, x] != later[y, x]).any()


@pytest.mark.nightly
def test_a_drive_has_a_chart(tmp_path: Path, figures: list[Any]) -> None:
    drive = sample_drive()
    draw_drive(drive, tmp_path / "a.png")
    draw_drive(replace(drive, tracks=(), obstacle_specs=()), tmp_path / "a.png")
    far = replace(drive.tracks[1], xy=np.array([[9e5, 5.0]]))
    draw_drive(replace(drive, tracks=(far,), obstacle_specs=drive.obstacle_specs[1:]), tmp_path / "a.png")
    both, alone, _ = figures
    assert (len(both.axes), len(alone.axes)) == (2, 1)
    assert {t.get_text().strip() for t in both.axes[0].texts} == {"wait", "replan"}
    assert any(w.startswith("wait ") for w in words_of(both))
    for figure in figures:
        tidy(figure)
    v = both.axes[0].lines[1].get_ydata()
    assert max(v) == pytest.approx(0.8)


def test_the_distance_to_obstacles_is_between_rims() -> None:
    drive = sample_drive()
    t = np.array([0.0, 1.0, 2.5])
    robot = drive.at(t)[0]
    first = np.hypot(*(drive.tracks[0].at(t) - robot).T) * 0.1 - 0.15 - 0.2
    second = np.hypot(*(drive.tracks[1].at(t) - robot).T) * 0.1 - 0.15 - 0.3
    away = distance_to_obstacles(drive, t)
    assert away[:2] == pytest.approx(first[:2]), "the second is not there yet"
    assert away[2] == pytest.approx(min(first[2], second[2]))
    assert np.isinf(distance_to_obstacles(replace(drive, tracks=(), obstacle_specs=()), t)).all()


def rows(path: Path) -> list[dict[str, str]]:
    return list(csv.DictReader(path.read_text().splitlines()))


def test_csv_of_curves_and_of_drives(tmp_path: Path) -> None:
    profile, drive = sample_course(), sample_drive()
    grid = sample_room()
    n = len(profile.v)
    write_profile_csv(tmp_path / "p.csv", profile, np.tile((0.0, -1.0), (n, 1)), grid)
    table = rows(tmp_path / "p.csv")
    assert tuple(table[0]) == PROFILE_COLUMNS
    assert profile.xy is not None
    assert [(float(r["x_m"]), float(r["y_m"])) for r in table] == list(
        map(tuple, grid.to_metres(profile.xy).tolist())
    )
    # Up on the screen is y of the map, turned with it.
    assert {float(r["yaw"]) for r in table} == {math.pi / 2 + 0.5}
    assert [r["why"] for r in table] == [profile.why(k) for k in range(n)]
    assert any(r["why"].startswith("braking for node") for r in table)
    with pytest.raises(UsageError, match="1 headings"):
        write_profile_csv(tmp_path / "q.csv", profile, np.array([[1.0, 0.0]]), grid)
    write_drive_csv(tmp_path / "d.csv", drive)
    table = rows(tmp_path / "d.csv")
    assert tuple(table[0]) == DRIVE_COLUMNS
    for name in ("t", "s", "v", "a"):
        assert [float(r["t_s" if name == "t" else name]) for r in table] == getattr(drive, name).tolist()
    assert table[3]["why"] == "wait for obstacle 0"
    assert float(table[-1]["yaw"]) == pytest.approx(math.pi / 2 + 0.5)
    assert float(table[-1]["x_m"]) == pytest.approx(grid.to_metres((40, 10))[0])


def test_records_are_plain_and_finite() -> None:
    profile, drive = sample_course(), sample_drive()
    r = profile_record(profile, caps=True)
    assert json.loads(json.dumps(r, allow_nan=False)) == r
    assert r["caps"][1]["cause"] == "curvature"
    assert r["caps"][1]["v"][0] is None
    assert r["caps"][2]["v"][200] == 0.6
    assert "caps" not in profile_record(profile)
    assert "xy" not in profile_record(replace(profile, xy=None))
    r = drive_record(drive)
    assert json.loads(json.dumps(r, allow_nan=False)) == r
    assert len(r["t"]) == len(r["why"]) == len(drive.t)
    assert r["curves"][0]["curvature"] == [0, -1, 0]
    assert [b["kind"] for b in r["obstacle_specs"]] == ["crossing", "patrol"]

"""Photographs as files: JPEG, EXIF, limits, what is damaged; and the verb."""

from __future__ import annotations

import io
import json
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image, ImageOps
from typer.testing import CliRunner

import lampyris
from lampyris.cli.verbs.maps.command import app
from lampyris.errors import FileError, LampyrisError, LimitError
from lampyris.io.maps.load import load_map
from lampyris.io.photos.jpeg import MAX_SCANS, MAX_SEGMENTS
from lampyris.io.photos.read import read_photo
from lampyris.report import style
from lampyris.report.charts.histogram_chart import draw_histogram


def jpeg(samples: np.ndarray[Any, Any], **settings: Any) -> bytes:
    out = io.BytesIO()
    Image.fromarray(samples).save(out, "JPEG", quality=95, **settings)
    return out.getvalue()


def levels(width: int = 21, height: int = 13) -> np.ndarray[Any, Any]:
    y, x = np.mgrid[:height, :width]
    return (5 * x + 9 * y).astype(np.uint8)


def put(folder: Path, data: bytes, name: str = "p.jpg") -> Path:
    path = folder / name
    path.write_bytes(data)
    return path


def test_a_jpeg_has_the_levels_that_pillow_decodes(tmp_path: Path) -> None:
    grey = jpeg(levels())
    with Image.open(io.BytesIO(grey)) as picture:
        assert (read_photo(put(tmp_path, grey)).levels == np.asarray(picture)).all()
    colour = jpeg(np.dstack((levels(), levels()[::-1], levels()[:, ::-1])), progressive=True, comment="x")
    with Image.open(io.BytesIO(colour)) as picture:
        rgb = np.asarray(picture)
    for k, channel in enumerate(("red", "green", "blue")):
        assert (read_photo(put(tmp_path, colour), channel).levels == rgb[..., k]).all()
    luma = (
        rgb[..., 0].astype(int) * 306 + rgb[..., 1].astype(int) * 601 + rgb[..., 2].astype(int) * 117
    ) >> 10
    assert (read_photo(put(tmp_path, colour)).levels == luma).all()


@pytest.mark.parametrize("turn", range(1, 9))
def test_a_photograph_is_upright(turn: int, tmp_path: Path) -> None:
    exif = Image.Exif()
    exif[0x0112] = turn
    data = jpeg(levels(), exif=exif)
    with Image.open(io.BytesIO(data)) as picture:
        upright = np.asarray(ImageOps.exif_transpose(picture))
    read = read_photo(put(tmp_path, data))
    assert (read.levels == upright).all()
    assert bool(read.notes) == (turn > 1)


def changed(data: bytes, old: bytes, new: bytes) -> bytes:
    assert old in data
    return data.replace(old, new, 1)


def frame_at(data: bytes) -> int:
    return data.index(b"\xff\xc0")


def test_what_is_damaged_is_refused_by_name(tmp_path: Path) -> None:
    good = jpeg(levels(64, 48))
    at = frame_at(good)
    cases: dict[str, tuple[bytes, str]] = {
        "cut": (good[: len(good) // 2], "IMG_TRUNCATED"),
        "no end": (good[:-2], "IMG_TRUNCATED"),
        "nothing": (good[:4], "IMG_TRUNCATED"),
        "little data": (good[: good.index(b"\xff\xda") + 12] + b"\xff\xd9", "IMG_TRUNCATED"),
        "no marker": (good[:2] + b"\xff\xe0\0\2x" + good[2:], "IMG_CORRUPT"),
        "size": (good[: at + 5] + b"\0\0" + good[at + 7 :], "IMG_SIZE"),
        "twelve bits": (good[: at + 4] + b"\x0c" + good[at + 5 :], "JPEG_CODING"),
        "arithmetic": (good[: at + 1] + b"\xc9" + good[at + 2 :], "JPEG_CODING"),
        "no tables": (changed(good, b"\xff\xdb", b"\xff\xe5"), "IMG_CORRUPT"),
        "two frames": (good[:at] + good[at : at + 13] + good[at:], "IMG_CORRUPT"),
        "a text": (b"P9 is no picture\n", "IMG_FORMAT"),
        "empty": (b"", "IMG_EMPTY"),
    }
    for what, (data, code) in cases.items():
        with pytest.raises(FileError) as caught:
            read_photo(put(tmp_path, data))
        assert caught.value.code == code, f"{what}: {caught.value}"
    with pytest.raises(FileError, match="4 channels"):
        read_photo(put(tmp_path, jpeg_of_print()))


def jpeg_of_print() -> bytes:
    out = io.BytesIO()
    Image.new("CMYK", (8, 8)).save(out, "JPEG")
    return out.getvalue()


def test_limits_are_looked_at_before_anything_is_decoded(tmp_path: Path) -> None:
    path = put(tmp_path, jpeg(levels(20, 10)))
    assert read_photo(path, max_cells=200).levels.shape == (10, 20)
    with pytest.raises(LimitError, match="20 x 10 is 200 cells"):
        read_photo(path, max_cells=199)
    grey = jpeg(levels())
    many = grey[:2] + b"\xff\xe5\0\2" * (MAX_SEGMENTS - 20) + grey[2:]
    assert read_photo(put(tmp_path, many)).levels.shape == (13, 21)
    with pytest.raises(FileError, match="more than 10000 segments"):
        read_photo(put(tmp_path, grey[:2] + b"\xff\xe5\0\2" * MAX_SEGMENTS + grey[2:]))
    good = jpeg(levels(), progressive=True)
    first = good.index(b"\xff\xda")
    scan = good[first : good.index(b"\xff", first + 12)]
    with pytest.raises(FileError, match="more than 200 scans"):
        read_photo(put(tmp_path, good[:first] + scan * MAX_SCANS + good[first:]))
    below = good[:first] + scan * (MAX_SCANS - 20) + good[first:]
    assert "more than" not in refusal(put(tmp_path, below))


def refusal(path: Path) -> str:
    """The error of a file; empty if it is read."""
    try:
        read_photo(path)
    except LampyrisError as problem:
        return str(problem)
    return ""


def run(*words: str | Path) -> Any:
    done = CliRunner(env={"COLUMNS": "80"}).invoke(app, [str(w) for w in words], catch_exceptions=False)
    assert done.exit_code == 0, done.output
    return done


def test_the_verb_writes_a_map_a_yaml_and_a_chart(tmp_path: Path) -> None:
    floor = np.full((40, 60), 200, dtype=np.uint8)
    floor[10:30, 25:35] = 30
    photo, out = put(tmp_path, jpeg(floor)), tmp_path / "map.png"
    words = ("segment", photo, "-o", out, "--cell", "5", "--resolution", "0.05", "--by", "pso")
    record = json.loads(run(*words, "--chart", tmp_path / "h.svg", "--json").stdout)
    assert {"thresholds", "score", "optimum", "gap", "classes", "timing"} <= set(record)
    assert record["gap"] == 0.0
    assert record["cells"] == {"free": 88, "blocked": 8, "unknown": 0}
    assert [one["free"] for one in record["classes"]] == [False, True]
    assert sum(one["pixels"] for one in record["classes"]) == 2400
    assert record["files"] == [str(out), str(tmp_path / "map.yaml")]
    from_yaml, from_png = load_map(tmp_path / "map.yaml"), load_map(out)
    assert from_yaml.grid.resolution == 0.05
    assert (from_yaml.grid.blocked == from_png.grid.blocked).all()
    assert (tmp_path / "h.svg").read_text().startswith("<?xml")
    text = run("segment", photo, "-o", tmp_path / "m.txt", "--free", "0", "--force").stdout
    assert "class 0: levels 0 to" in text
    assert "% of the pixels, free" in text


def test_drawings_with_several_pixels_a_cell(tmp_path: Path) -> None:
    guide = load_map("guide")
    from lampyris.io.maps.save import save_map

    save_map(guide, tmp_path / "g.png")
    with Image.open(tmp_path / "g.png") as picture:
        small = np.asarray(picture.convert("RGB"))
    for side in (2, 20):
        big = small.repeat(side, axis=0).repeat(side, axis=1)
        for name in ("g.bmp", "g.png"):
            Image.fromarray(big).save(tmp_path / name)
            read = load_map(tmp_path / name)
            assert read.grid.blocked.shape == (10, 10), name
            assert (read.grid.blocked == guide.grid.blocked).all()
            assert (read.start, read.goal) == (guide.start, guide.goal)
            assert any(f"drawn by {side} x {side} pixels" in note for note in read.notes)
    odd = big.copy()
    odd[0, 0] = 255 - odd[0, 0]
    for wrong in (odd, big[:, :-1], np.roll(big, 1, axis=1)):
        Image.fromarray(wrong).save(tmp_path / "g.png")
        with pytest.raises(FileError, match="both marked as"):
            load_map(tmp_path / "g.png")
    blank = np.full((6, 8, 3), 255, dtype=np.uint8)
    blank[:2, :2] = 0
    Image.fromarray(blank).save(tmp_path / "g.png")
    assert load_map(tmp_path / "g.png").grid.blocked.shape == (6, 8), "without marks nothing tells"


@pytest.mark.parametrize("thresholds", [5, 15])
def test_words_on_the_chart_do_not_overlap(thresholds: int, monkeypatch: pytest.MonkeyPatch) -> None:
    figures: list[Any] = []
    monkeypatch.setattr(style, "save", lambda figure, *rest: figures.append(figure))
    rng = np.random.default_rng(1)
    levels = np.clip(rng.normal(180.0, 20.0, (100, 200)), 0.0, 255.0)
    levels[:10] = rng.normal(40.0, 15.0, (10, 200)).clip(0.0, 90.0)
    draw_histogram(lampyris.segment_photo(levels.astype(np.uint8), thresholds=thresholds), Path("x.png"))
    figures[0].draw_without_rendering()
    boxes = [text.get_window_extent().padded(-1.0) for text in figures[0].axes[0].texts]
    assert len(boxes) == 2 * thresholds + 1
    assert not any(one.overlaps(other) for one, other in combinations(boxes, 2))

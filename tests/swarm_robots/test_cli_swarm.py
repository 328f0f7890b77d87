"""``lampyris swarm``: text, JSON, picture, film, exit codes."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from in_process import call

QUICK = ("swarm", "env-6", "--robots", "30", "--iterations", "60", "--seed", "2", "--set", "sensor_range=20")


@pytest.mark.nightly
def test_text_says_what_each_source_holds(tmp_path: Path) -> None:
    done = call(*QUICK, cwd=tmp_path, columns=200)
    assert done.returncode in (0, 4)
    for word in ("source 0", "source 2", "held", "contacts", "30 discs", "60 iterations"):
        assert word in done.stdout, done.stdout


def test_json_and_the_same_bytes_again(tmp_path: Path) -> None:
    one, other = (call(*QUICK, "--json", "--no-timing", cwd=tmp_path) for _ in range(2))
    assert one.stdout == other.stdout
    made = json.loads(one.stdout)
    assert made["robots"] == len(made["ends_m"]) == len(made["holder"]) == 30
    assert len(made["held_over_time"]) == made["iterations"] + 1 == 61
    assert made["timing"] == {}
    for k, source in enumerate(made["sources"]):
        assert source["held"] == made["held_over_time"][-1][k] == made["holder"].count(k)
        assert len(source["nearest_m"]) == 3
    assert one.returncode == (0 if all(s["held"] >= 3 for s in made["sources"]) else 4)


@pytest.mark.nightly
def test_picture_and_film(tmp_path: Path) -> None:
    short = ("swarm", "guide", "--robots", "9", "--iterations", "12")
    done = call(*short, "--picture", "a.png", "--film", "a.webp", cwd=tmp_path)
    assert done.returncode in (0, 4), done.stderr
    with Image.open(tmp_path / "a.webp") as film:
        assert film.n_frames == 25
        film.seek(0)
        first = np.asarray(film.convert("RGB")).astype(int)
        film.seek(film.n_frames - 2)
        assert (np.asarray(film.convert("RGB")) != first).any()
    with Image.open(tmp_path / "a.png") as picture:
        assert picture.width > 600
    again = call(*short, "--picture", "b.png", "--film", "b.webp", cwd=tmp_path)
    assert again.returncode == done.returncode
    for suffix in ("png", "webp"):
        assert (tmp_path / f"a.{suffix}").read_bytes() == (tmp_path / f"b.{suffix}").read_bytes()


def test_drawn_sources_a_file_and_the_gradient(tmp_path: Path) -> None:
    few = ("swarm", "guide", "--robots", "8", "--iterations", "5", "--json")
    drawn = json.loads(call(*few, "--sources", "drawn", "--source-count", "2", cwd=tmp_path).stdout)
    assert len(drawn["sources"]) == 2
    (tmp_path / "s.yaml").write_text("sources: [{kind: inverse-square, at: [2, 2]}]\n")
    filed = json.loads(call(*few, "--sources", "s.yaml", "--method", "gradient", cwd=tmp_path).stdout)
    assert filed["method"] == "gradient"
    assert filed["sources"][0]["at_m"] == [2.0, 2.0]


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        (("--robots", "0"), 2, "--robots"),
        (("--robots", "100000"), 2, "--robots"),
        (("--sources", "missing.yaml"), 3, "missing.yaml"),
        (("--source-count", "2"), 2, "--sources drawn"),
        (("--method", "pso"), 2, "--method"),
        (("--set", "noise=-1"), 2, "noise"),
        (("--set", "nois=1"), 2, "did you mean noise"),
        (("--set", "noise"), 2, "KEY=VALUE"),
        (("--iterations", "0"), 2, "--iterations"),
        (("--iterations", "5", "--set", "iterations=9"), 2, "--iterations and --set iterations both given"),
        (("--method", "gso", "--set", "method=gso"), 2, "--method and --set method both given"),
        (("--sources", "drawn", "--source-count", "1000"), 2, "--source-count"),
        (("--film", "a.mp4"), 2, ".webp"),
    ],
)
def test_errors(tmp_path: Path, words: tuple[str, ...], code: int, said: str) -> None:
    done = call("swarm", "guide", *words, cwd=tmp_path)
    assert done.returncode == code, done.stderr
    assert said in done.stderr


def test_settings_of_set_that_have_options_of_their_own(tmp_path: Path) -> None:
    few = ("swarm", "guide", "--robots", "4", "--json", "--set", "method=gradient", "--set", "iterations=3")
    made = json.loads(call(*few, cwd=tmp_path).stdout)
    assert (made["method"], made["iterations"]) == ("gradient", 3)


def test_a_time_limit_ends_it(tmp_path: Path) -> None:
    done = call(
        "swarm",
        "guide",
        "--robots",
        "5",
        "--iterations",
        "900000",
        "--seconds",
        "0.2",
        "--json",
        cwd=tmp_path,
    )
    made = json.loads(done.stdout)
    assert done.returncode == 4
    assert made["status"] == "limit"
    assert made["iterations"] < 900_000

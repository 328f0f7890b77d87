"""The page about maps: its commands run, one after the other in one folder, and nothing is left out."""

from __future__ import annotations

import shlex
from pathlib import Path

import pytest

from bad_inputs.case import inside, run, warm
from lampyris.io.maps import library
from lampyris.io.maps.formats.ros import SUFFIXES
from lampyris.io.maps.recipes.make import RECIPES
from lampyris.io.maps.save import WRITERS

PAGE = Path(__file__).resolve().parents[2] / "docs" / "maps.md"

pytestmark = pytest.mark.source


def commands() -> list[list[str]]:
    """The page's indented lines, comments left out."""
    lines = PAGE.read_text(encoding="utf-8").splitlines()
    return [shlex.split(line, comments=True)[1:] for line in lines if line.startswith("    lampyris ")]


@pytest.mark.nightly
def test_the_commands_run(tmp_path: Path) -> None:
    warm()
    asked = commands()
    assert len(asked) >= 12
    with inside(tmp_path):
        for words in asked:
            done = run(*words)
            assert done.exit == 0, (words, done.err)
        assert {p.name for p in Path().iterdir()} >= {"path.png", "site.pgm", "hills.png", "arena.map.scen"}


def test_every_format_recipe_and_map_is_there() -> None:
    text = PAGE.read_text(encoding="utf-8")
    for ending in (*WRITERS, SUFFIXES[0]):
        assert f"`{ending}`" in text
    for recipe in RECIPES:
        assert recipe in text
    assert f"the {len(library.names())} bundled maps" in text

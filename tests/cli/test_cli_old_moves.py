"""``--moves`` takes the two old names of step sets."""

import json

import pytest
from typer.testing import CliRunner

from lampyris.cli.app import app


@pytest.mark.parametrize("name", ["four", "sixteen"])
def test_the_old_names_of_moves_are_taken(name: str) -> None:
    texts = [
        CliRunner().invoke(app, ["plan", "guide", "--moves", moves, "--json", "--no-timing"]).stdout
        for moves in (name, f"{name}-connected")
    ]
    assert json.loads(texts[0])["moves"] == f"{name}-connected"
    assert texts[0] == texts[1]

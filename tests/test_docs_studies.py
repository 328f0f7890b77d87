"""The page on studies: its file is the study that it tells of, its Python runs, it names every key."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import lampyris
from bad_inputs.case import inside
from lampyris.cli.verbs.study.tables import sizes
from lampyris.report.data.measures import METRICS
from lampyris.study.analysis.table import TIMING
from lampyris.study.design.bundled import names
from lampyris.study.design.study_file import json_schema

PAGE = Path(__file__).resolve().parents[1] / "docs" / "studies.md"
pytestmark = pytest.mark.source


def block(language: str) -> str:
    """The first block in a language."""
    found = re.search(
        rf"^```{language}\n(.*?)^```$", PAGE.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL
    )
    assert found is not None
    return found[1]


def test_the_file_is_the_study_that_the_page_tells_of(tmp_path: Path) -> None:
    (tmp_path / "first.yaml").write_text(block("yaml"))
    study = lampyris.load_study(tmp_path / "first.yaml")
    assert f"{study.name}: {sizes(study)}" in PAGE.read_text(encoding="utf-8")


@pytest.mark.nightly
def test_the_python_runs(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    small = block("yaml").replace("seeds: 5", "seeds: 1").replace("random: 6", "random: 1")
    (tmp_path / "first.yaml").write_text(small)
    with inside(tmp_path):
        exec(compile(block("python"), PAGE.name, "exec"), {})
    assert (
        capsys.readouterr().out
        == "{'ad-gso': '6 of 6', 'ad-gso choice=exact': '6 of 6', 'dstar-lite': '6 of 6'}\n"
    )


def test_every_key_column_and_ready_study_is_named() -> None:
    text = PAGE.read_text(encoding="utf-8")
    keys = set(json_schema()["properties"]) - {"version", "$schema", "name", "about"}
    columns = {*METRICS, *TIMING} - {"outcome", "length_cells", "optimal"}
    for word in sorted(keys | columns | set(names())):
        assert f"`{word}`" in text, word

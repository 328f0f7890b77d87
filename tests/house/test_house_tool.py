"""``tools/house.py`` sees what is out of order, and this tree is in order."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import pytest

TOOL = Path(__file__).resolve().parents[2] / "tools" / "house.py"
pytestmark = pytest.mark.source


def tool() -> ModuleType:
    spec = importlib.util.spec_from_file_location("house_tool", TOOL)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


SOURCES = {
    "p.a": "from p import b",
    "p.b": "def f():\n    from p.c import x\n",
    "p.c": "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    import p.a\n",
    "p.d": "from p.a import x",
}


def test_circles_of_every_kind_are_found() -> None:
    house = tool()
    names = dict.fromkeys(SOURCES, Path())
    edges = {name: set(house.imports(text, names)) for name, text in SOURCES.items()}
    assert house.circles(edges) == [["p.a", "p.b", "p.c"]]
    edges["p.c"] = set()
    assert house.circles(edges) == []


def test_what_is_out_of_order_is_named(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    house = tool()
    monkeypatch.setattr(house, "ROOT", tmp_path)
    (tmp_path / "old.py").write_text(
        '"""Whoever: the mended twins."""\nway_of, body = told = {"crowd": 1}, "taut"\n'
    )
    found = {
        "crowded": {"p": 17},
        "circles": [["p.a", "p.b"]],
        "doubled": {str(k): ["p.a", "p.b"] for k in range(6)},
        "old_words": ["old.py"],
    }
    wrong = house.faults(found, frozenset({"gone.py"}))
    assert [line.partition(":")[0] for line in wrong] == [
        "p", "import circle", "6 class names are defined in several modules; at most 5", "old.py", "gone.py",
    ]  # fmt: skip
    assert wrong[3].endswith("words of the old language: Whoever, crowd, mended, taut, told, twins, way_of")
    assert house.faults({**found, "crowded": {}, "circles": [], "doubled": {}}, frozenset({"old.py"})) == []


def test_words_of_another_meaning_are_passed_over(tmp_path: Path) -> None:
    house = tool()
    page, module = tmp_path / "page.md", tmp_path / "module.py"
    page.write_text("The body of a request is long; its body, too. See `taut`.\n\n    told\n")
    module.write_text('Seen = 1\nseen = 2\nWHERE = "in the way of it"\n"""With ``taut``."""\n')
    assert house.old_words(page) == ["body"]
    assert house.old_words(module) == ["Seen"]


def test_keys_are_judged_in_every_kind_of_file(tmp_path: Path) -> None:
    """Keys of dicts, columns and option names, of an app's form, a schema and a study file; prose is no key."""
    house = tool()
    for name, text, old in (
        (
            "a.py",
            'X = {"crowds": 1, "fine": row["near_movers"]}, ("--movers", "courses.csv"), "a way to say"',
            None,
        ),
        ("a.js", 'form.field("crowd", block); // the way of the page\nconst way = page.speed;', ["crowd"]),
        ("a.json", '{"crowd_size": {"description": "the way they go"}}', ["crowd_size"]),
        ("a.yaml", "# the way\ntraffic:\n  - {kind: patrol, crowds: 3}\nmovers: 2\n", ["crowds", "movers"]),
    ):
        (tmp_path / name).write_text(text)
        assert house.old_words(tmp_path / name) == (
            old or ["--movers", "courses.csv", "crowds", "near_movers"]
        )
    assert {path.suffix for path in house.keyed()} == {".js", ".json", ".yaml"}


@pytest.mark.nightly
def test_this_tree_is_in_order() -> None:
    house = tool()
    assert house.faults(house.measure(), frozenset(house.KEPT.read_text(encoding="utf-8").split())) == []

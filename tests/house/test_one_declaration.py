"""A setting has one declaration: its default stands nowhere else in the code."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import lampyris
from lampyris._core.settings import Setting, defaults_of, descriptions_of, meanings_of, settings_of
from lampyris.model.robot import Robot
from lampyris.model.settings.drive import DriveSettings
from lampyris.model.settings.simulation import SimulationSettings
from lampyris.motion.laws import physical
from lampyris.motion.laws import registry as laws
from lampyris.planning import registry
from source_tree import statements

SOURCE = Path(lampyris.__file__).parent
OWNERS: tuple[type, ...] = (
    Robot,
    DriveSettings,
    SimulationSettings,
    *physical.RULES.values(),
    *(type(law.settings) for law in laws.LAWS.values()),
    *(registry.planner_class(name) for name in registry.names()),
)
NEUTRAL = (None, ..., 0, 1, False, True, "")
"""Defaults that say "nothing" or "on" are no numbers that somebody chose."""
CHOSEN = {"planner", "preset", "values", "colour", "mobility"}
"""Names with a default in :mod:`lampyris._core.defaults`."""
DIFFERENT: dict[tuple[str, Any], str] = {
    ("period", 0.1): "time between decisions of a drive, and between observations of a place",
    **dict.fromkeys(
        (("min_radius", 0.9), ("min_speed", 0.25), ("scaling_distance", 0.6), ("approach_speed", 0.05)),
        "Nav2's defaults: of the law rpp on the exact path, and of the controller rpp, which steers",
    ),
    ("step", 0.1): "seconds of a simulated motion of MPPI, and the step of a glowworm",
}
"""Equal defaults of settings that have a name in common and nothing else, with the reason."""


def stated(tree: ast.AST) -> Iterator[tuple[str, Any, int]]:
    """Name, value and line of every literal default of a parameter or of a field."""
    for node in statements(tree):
        pairs: list[tuple[str, ast.expr | None]] = []
        if isinstance(node, ast.FunctionDef):
            most = [*node.args.posonlyargs, *node.args.args]
            pairs = [(a.arg, d) for a, d in zip(reversed(most), reversed(node.args.defaults), strict=False)]
            pairs += [(a.arg, d) for a, d in zip(node.args.kwonlyargs, node.args.kw_defaults, strict=True)]
        elif isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
            value = node.value
            if isinstance(value, ast.Call) and isinstance(value.func, ast.Name) and value.args:
                value = (
                    value.args[0] if value.func.id in ("Field", "number", "whole", "word", "flag") else None
                )
            pairs = [(node.target.id, value)]
        for name, value in pairs:
            if isinstance(value, ast.Constant):
                yield name, value.value, value.lineno


def test_no_default_is_stated_twice() -> None:
    names = {name for owner in OWNERS for name in defaults_of(owner)} | CHOSEN
    assert len(names) > 80
    places: dict[tuple[str, Any], list[str]] = {}
    for file in sorted(SOURCE.rglob("*.py")):
        place = file.relative_to(SOURCE).as_posix()
        for name, value, line in stated(ast.parse(file.read_text())):
            if name in names and value not in NEUTRAL and (name, value) not in DIFFERENT:
                places.setdefault((name, value), []).append(f"{place}:{line}")
    assert len(places) > 40
    assert {key: where for key, where in places.items() if len(where) > 1} == {}


def test_the_search_finds_what_is_stated() -> None:
    code = "def f(a, rho=0.4, *, lag: float = 0.1): ...\nclass C:\n    spacing: float = Field(0.125)\n    v: int = 3\n"
    assert sorted((name, value) for name, value, _ in stated(ast.parse(code))) == [
        ("lag", 0.1), ("rho", 0.4), ("spacing", 0.125), ("v", 3),
    ]  # fmt: skip


@pytest.mark.parametrize("owner", OWNERS, ids=lambda kind: kind.__name__)
def test_every_setting_is_described_and_its_default_is_allowed(owner: type) -> None:
    meanings = meanings_of(owner)
    for name, setting in settings_of(owner).items():
        assert meanings.get(name), name
        assert setting.accepts(defaults_of(owner)[name]), name
        assert descriptions_of(owner)[name].endswith("."), name


@pytest.mark.parametrize(
    ("setting", "allowed", "refused"),
    [
        (Setting("number", 0.0, 1.0), (0, 0.5, 1.0), (-0.1, 1.1, True, "1", None, float("nan"), 10**400)),
        (Setting("number", 0.0, 1.0, above=True), (1e-9, 1), (0, 0.0)),
        (Setting("number", 1.0, 2.0, off=(0.0, "off")), (0, 1, 2), (0.5, -1)),
        (Setting("number", 0.0, 1.0, none="any"), (None, 0.3), ("none", 2)),
        (Setting("whole", 1, 5), (1, 5), (0, 6, 1.0, True, None)),
        (Setting("word", words=("a", "b")), ("a",), ("c", 1, None)),
        (Setting("flag"), (True, False), (0, 1, None)),
    ],
)
def test_what_a_declaration_allows(
    setting: Setting, allowed: tuple[Any, ...], refused: tuple[Any, ...]
) -> None:
    assert all(setting.accepts(value) for value in allowed)
    assert not any(setting.accepts(value) for value in refused)

"""Planners of this package are known without the metadata of packages."""

from __future__ import annotations

import subprocess
import sys
from importlib import import_module
from importlib.metadata import EntryPoint
from pathlib import Path
from pkgutil import resolve_name

import numpy as np
import pytest

from lampyris.io.maps import library
from lampyris.planning import built_in, registry


def test_each_row_is_the_planner_of_that_name() -> None:
    for table in (built_in.CELLS, built_in.POSES, built_in.FLEETS):
        for name, place in table.items():
            assert resolve_name(place).name == name


def test_each_planner_of_the_package_has_a_row() -> None:
    """Every class with a name, traits and a source that its modules define."""
    rows = {place for table in (built_in.CELLS, built_in.POSES, built_in.FLEETS) for place in table.values()}
    for module in {place.partition(":")[0] for place in rows}:
        for kind in vars(import_module(module)).values():
            if (
                isinstance(kind, type)
                and kind.__module__ == module
                and isinstance(getattr(kind, "source", None), str)
            ):
                assert f"{module}:{kind.__name__}" in rows


@pytest.mark.parametrize("name", ["astar", "lattice", "cbs"])
def test_each_kind_is_found(name: str) -> None:
    assert registry.any_class(name).name == name
    assert registry.origin_of(name) == ""
    assert registry.plans_poses(name) == (name == "lattice")


def test_a_name_of_ours_stays_ours(monkeypatch: pytest.MonkeyPatch) -> None:
    guests = [EntryPoint(name, "nowhere:Guest", registry.GROUP) for name in ("astar", "a-guest")]
    monkeypatch.setattr("importlib.metadata.entry_points", lambda *, group: guests)
    registry._entries.cache_clear()
    try:
        assert registry.names() == tuple(sorted(("a-guest", *built_in.CELLS)))
        assert registry.planner_class("astar").name == "astar"
        with pytest.raises(ModuleNotFoundError, match="nowhere"):  # of no package: the fault as it is
            registry.planner_class("a-guest")
    finally:
        monkeypatch.undo()
        registry._entries.cache_clear()


SHORT = """
import sys
sys.argv = ["lampyris", "plan", {map!r}, "--start", "0,0", "--goal", "9,9", "--planner", "astar"]
from lampyris.cli import main
try:
    main()
except SystemExit as done:
    assert not done.code, done.code
names = ("importlib.metadata", "importlib.resources", "json", "lampyris.io.maps.formats.png")
print([name for name in names if name in sys.modules], file=sys.stderr)
"""


def test_a_short_call_does_without_what_it_does_not_need(tmp_path: Path) -> None:
    np.save(tmp_path / "map.npy", np.zeros((10, 10), dtype=np.uint8))
    code = SHORT.format(map=str(tmp_path / "map.npy"))
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=tmp_path
    )
    assert done.stderr.splitlines()[-1] == "[]"


def test_bundled_maps_have_names_that_no_file_has() -> None:
    assert all(library.is_bundled(name) for name in library.names())
    assert not any(library.is_bundled(name) for name in ("env-1.npy", "./env-1", "env-0", ""))

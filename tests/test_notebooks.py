"""The notebooks: their code runs cell by cell, and what the widget shows is what happened."""

from __future__ import annotations

import json
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import pytest

import lampyris
from lampyris.errors import SettingError, UsageError
from lampyris.notebook import scrub
from lampyris.notebook.frames import frames_of

FOLDER = Path(__file__).resolve().parents[1] / "examples" / "notebooks"
NOTEBOOKS = sorted(FOLDER.glob("*.ipynb"))
pytestmark = pytest.mark.source


def test_there_are_three() -> None:
    assert len(NOTEBOOKS) == 3


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda p: p.stem)
def test_notebook_runs(
    path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Without Jupyter: code cells in one namespace. Those of packages that are not installed are left out."""
    matplotlib.use("Agg")
    book = json.loads(path.read_text("utf-8"))
    assert book["nbformat"] == 4
    scope: dict[str, Any] = {"__name__": "__main__"}
    ran = 0
    for cell in book["cells"]:
        if cell["cell_type"] != "code":
            continue
        assert cell["outputs"] == []  # results are not kept in the repository
        needs = [tag.removeprefix("needs-") for tag in cell["metadata"].get("tags", ())]
        if any(find_spec(name) is None for name in needs):
            continue
        exec(compile("".join(cell["source"]), f"{path.name}:{cell['id']}", "exec"), scope)
        ran += 1
    assert ran >= 3
    assert capsys.readouterr().out


@pytest.fixture(scope="module")
def scene() -> lampyris.Scene:
    return lampyris.Scene(lampyris.load_grid("guide"), (0, 9), (7, 0), traffic=lampyris.RandomWalk(2))


def test_frames_of_a_drive_are_where_it_was(scene: lampyris.Scene) -> None:
    drive = lampyris.drive(scene, "astar", seed=1)
    frames = frames_of(drive)
    json.dumps(frames, allow_nan=False)
    places, speeds = drive.at(np.array(frames["t"]))
    assert np.abs(places - np.stack((frames["x"], frames["y"]), axis=1)).max() < 2e-3
    assert np.abs(speeds - frames["speed"]).max() < 2e-3
    assert (frames["x"][-1], frames["y"][-1]) == scene.goal
    assert set(frames["cause"]) <= set(drive.cause)
    for one, track in zip(frames["obstacles"], drive.tracks, strict=True):
        here = [k for k, x in enumerate(one["x"]) if x is not None]
        assert np.abs(track.at(np.array(frames["t"])[here])[:, 0] - np.array(one["x"])[here]).max() < 2e-3


def test_frames_of_a_simulation_are_its_ticks(scene: lampyris.Scene) -> None:
    trace = lampyris.simulate(scene, "astar", seed=1)
    frames = frames_of(trace)
    json.dumps(frames, allow_nan=False)
    assert frames["t"] == list(range(trace.ticks + 1))
    for tick in frames["t"]:
        assert [frames["x"][tick], frames["y"][tick]] == trace.robot[tick].tolist()
        there = [(o["x"][tick], o["y"][tick]) for o in frames["obstacles"] if o["x"][tick] is not None]
        assert there == trace.obstacles_at(tick)


def test_what_is_no_run_is_refused(scene: lampyris.Scene) -> None:
    with pytest.raises(SettingError, match="a Trace or a Drive"):
        scrub(scene)  # type: ignore[arg-type]


def test_missing_packages_are_named(scene: lampyris.Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    from lampyris.notebook.widget import _kind

    monkeypatch.setitem(__import__("sys").modules, "xarray", None)
    monkeypatch.setitem(__import__("sys").modules, "anywidget", None)
    _kind.cache_clear()
    with pytest.raises(UsageError, match=r"pip install 'lampyris\[notebook\]'"):
        scene.grid.to_xarray()
    with pytest.raises(UsageError, match=r"pip install 'lampyris\[notebook\]'"):
        scrub(lampyris.simulate(scene, "astar"))


def test_a_grid_as_a_dataset() -> None:
    pytest.importorskip("xarray")
    terrain = np.array([[0, 7, 0], [9, 0, 0]], dtype=np.uint8)
    grid = lampyris.Grid([[1, 0, 0], [0, 0, 1]], terrain=terrain, resolution=0.5, origin=(2.0, -1.0, 0.0))
    made = grid.to_xarray()
    for y in range(2):
        for x in range(3):
            at = dict(zip(("x", "y"), grid.to_metres((x, y)).tolist(), strict=True))
            assert bool(made.blocked.sel(at)) == grid.blocked[y, x]
            assert int(made.terrain.sel(at)) == terrain[y, x]
    assert "unknown" not in made
    with pytest.raises(UsageError, match="turned"):
        lampyris.Grid([[0]], origin=(0, 0, 0.3)).to_xarray()


def test_a_widget_is_made(scene: lampyris.Scene) -> None:
    pytest.importorskip("anywidget")
    run = lampyris.simulate(scene, "astar")
    widget = scrub(run)
    widget.frame = 3
    assert widget.get_state()["frame"] == 3
    assert widget.cells == scene.grid.blocked.astype(np.uint8).tobytes()

"""Walls that come and go in scenario files: what they mean, and that they are saved and run again alike."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import lampyris
from lampyris.errors import LampyrisError, SettingError
from lampyris.io.maps.map_hash import map_hash
from lampyris.io.scenario.save import json_of, yaml_of
from lampyris.io.scenario.scenario import Bundled
from lampyris.model.edit import Edit, applied
from lampyris.model.traffic import RandomWalk, Recorded
from lampyris.report.data.serialize import trace_record
from lampyris.scenarios import completed

GUIDE = {"version": 1, "map": "guide", "planner": "astar", "simulate": {}}
EDITS = [
    {"tick": 0, "blocked": [[1, 1], [0, 0]], "freed": [[4, 4]]},
    {"tick": 3, "blocked": [[5, 5]]},
    {"tick": 7, "freed": [[5, 5], [1, 1]]},
]


@pytest.fixture(autouse=True)
def _here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def load(data: dict[str, Any], name: str = "s.yaml") -> lampyris.Scenario:
    Path(name).write_text(json_of(data) if name.endswith(".json") else yaml_of(data))
    return lampyris.load_scenario(name)


def record(trace: Any) -> str:
    return json.dumps(trace_record(trace) | {"timing": {}})


@pytest.mark.parametrize("name", ["s.yaml", "s.json"])
def test_what_the_keys_mean(name: str) -> None:
    x = load(GUIDE | {"edits": EDITS}, name)
    first, *later = x.edits
    assert first == Edit(0, ((1, 1), (0, 0)), ((4, 4),))
    assert x.scene.edits == tuple(later) == (Edit(3, ((5, 5),)), Edit(7, (), ((5, 5), (1, 1))))
    before = lampyris.load_grid("guide")
    assert (x.scene.grid.blocked == applied(before, (first,)).blocked).all()
    assert (x.drawn.blocked == before.blocked).all()
    assert load(GUIDE | {"edits": []}, name) == load(GUIDE, name)
    assert x != load(GUIDE, name)


def test_the_hash_is_of_the_map_before() -> None:
    x = load(GUIDE | {"edits": EDITS})
    hashes = [map_hash(grid) for grid in (lampyris.load_grid("guide"), x.scene.grid)]
    assert hashes[0] != hashes[1]
    assert load(GUIDE | {"edits": EDITS, "map_hash": hashes[0]}) == x
    with pytest.raises(SettingError, match="MAP_HASH"):
        load(GUIDE | {"edits": EDITS, "map_hash": hashes[1]})


def some_edits(rng: np.random.Generator, width: int, height: int) -> tuple[Edit, ...]:
    made, tick = [], int(rng.integers(-2, 2))
    for _ in range(int(rng.integers(4))):
        cells = [(x, y) for x in range(width) for y in range(height) if rng.random() < 0.2]
        cut = int(rng.integers(len(cells) + 1))
        made.append(Edit(max(tick, len(made)), tuple(cells[:cut]), tuple(cells[cut:])))
        tick = made[-1].tick + int(rng.integers(1, 9))
    return tuple(made)


@pytest.mark.nightly
@pytest.mark.parametrize("ending", [".yaml", ".json"])
def test_load_of_save_is_the_same_scenario_and_the_same_run(ending: str) -> None:
    rng, runs, with_first = np.random.default_rng(3), 0, 0
    for _ in range(40):
        if rng.random() < 0.4:
            grid, source = lampyris.load_grid("guide"), Bundled("guide")
        else:
            blocked = rng.random((6, 8)) < 0.3
            unknown = blocked & (rng.random((6, 8)) < 0.5)
            grid, source = lampyris.Grid(blocked, unknown if unknown.any() else None, name="a"), None
        ends = [(int(rng.integers(grid.width)), int(rng.integers(grid.height))) for _ in range(2)]
        scene = lampyris.Scene(grid, *ends, traffic=RandomWalk(2))  # type: ignore[arg-type]
        edits = some_edits(rng, grid.width, grid.height)
        x = lampyris.Scenario(
            scene, "astar", simulated=True, map=source, edits=edits, seed=int(rng.integers(99))
        )
        with_first += bool(edits) and edits[0].tick == 0
        assert lampyris.save_scenario(x, f"s{ending}") == ()
        y = lampyris.load_scenario(f"s{ending}")
        assert y == completed(x)
        assert y.scene.edits == x.scene.edits
        assert (y.scene.grid.blocked == x.scene.grid.blocked).all()
        lampyris.save_scenario(y, f"again{ending}")
        assert Path(f"again{ending}").read_bytes() == Path(f"s{ending}").read_bytes()
        try:
            first = lampyris.run(x)
        except LampyrisError:
            continue
        assert record(lampyris.run(y)) == record(first)
        runs += 1
    assert runs > 25
    assert with_first > 5


def test_a_scenario_follows_its_edits() -> None:
    grid = lampyris.Grid(np.zeros((3, 4), bool), terrain=np.full((3, 4), 9, np.uint8))
    scene = lampyris.Scene(grid, (0, 0), (3, 2), edits=(Edit(2, ((1, 1),)),))
    x = lampyris.Scenario(scene)
    assert x.edits == scene.edits
    assert x.scene is scene
    y = replace(x, edits=(Edit(0, ((2, 2),)), Edit(5, ((1, 0),))))
    assert y.scene.edits == (Edit(5, ((1, 0),)),)
    assert np.argwhere(y.scene.grid.blocked).tolist() == [[2, 2]]
    # Once more, with others: always from the map before.
    z = replace(y, edits=(Edit(0, ((0, 1),)),))
    assert np.argwhere(z.scene.grid.blocked).tolist() == [[1, 0]]
    assert z.scene.grid.terrain is not None
    assert z.scene.grid.terrain[2, 2] == 9
    assert (z.scene.edits, z.ground) == ((), grid)
    back = replace(z, edits=())
    assert (back.scene.edits, back.ground, back.scene.grid) == ((), None, grid)
    assert back == lampyris.Scenario(replace(scene, edits=()))
    assert back != x
    assert (replace(y, name="a").scene.grid.blocked == y.scene.grid.blocked).all()
    assert replace(y, name="a", edits=y.edits).drawn is grid
    # An edit that changes no cell is still another scenario.
    assert replace(x, edits=(Edit(0, (), ((0, 0),)),)) != back
    with pytest.raises(LampyrisError, match="EDIT_OUTSIDE"):
        replace(x, edits=(Edit(0, ((9, 9),)),))


def test_a_plan_leaves_later_edits_aside_and_says_so() -> None:
    plain = {"version": 1, "map": "guide", "planner": "astar"}
    x = load(plain | {"edits": EDITS})
    assert any("edits after tick 0 are left aside" in note for note in x.notes)
    y = load(plain | {"edits": EDITS[:1]})
    assert not any("edits" in note for note in y.notes)
    a, b = lampyris.run(x), lampyris.run(y)
    assert a.plan.cells.tolist() == b.plan.cells.tolist()  # type: ignore[union-attr]


def test_a_drive_takes_edits_of_tick_0_only() -> None:
    drive = {"version": 1, "map": "guide", "planner": "astar", "drive": {}}
    assert lampyris.run(load(drive | {"edits": EDITS[:1]})).scene.edits == ()  # type: ignore[union-attr]
    with pytest.raises(SettingError, match="EDITS"):
        load(drive | {"edits": EDITS})
    x = load(GUIDE | {"edits": EDITS})
    with pytest.raises(SettingError, match="EDITS"):
        lampyris.run(replace(x, simulated=False, drive={}))


def test_a_walled_lane_is_told_of_when_it_runs() -> None:
    grid = lampyris.Grid(np.zeros((4, 6), bool))
    scene = lampyris.Scene(grid, (0, 3), (5, 3), traffic=Recorded(((1, 1), (2, 1))), edits=Edit(4, ((2, 1),)))
    with pytest.raises(LampyrisError, match=r"EDIT_TRACK.*tick 4.*obstacle 0"):
        lampyris.simulate(scene, "astar")


@pytest.mark.nightly
def test_there_are_limits() -> None:
    many = GUIDE | {"edits": [{"tick": k} for k in range(10_001)]}
    with pytest.raises(LampyrisError, match="10,001 edits") as caught:
        load(many, "s.json")
    assert (caught.value.code, caught.value.exit_code) == ("LIMIT", 5)
    most = GUIDE | {"edits": [{"tick": k, "blocked": [[k % 3, 0]]} for k in range(10_000)]}
    assert len(load(most, "s.json").edits) == 10_000

"""What is saved is what was meant: load(save(x)) == x, nothing left open, the same for every reader."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import lampyris
from lampyris.errors import LampyrisError
from lampyris.io.scenario import scenario as nouns
from lampyris.io.scenario.save import json_of, yaml_of
from lampyris.io.scenario.scenario import Bundled, Made, MapFile
from lampyris.io.text.strict_yaml import read_yaml
from lampyris.model.traffic import Crossing, ObstacleSpec, Patrol, RandomWalk, Recorded
from lampyris.motion.laws import registry as laws
from lampyris.planning import registry
from lampyris.scenarios import completed
from sizes import sized, some


@pytest.fixture(autouse=True)
def _here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def some_body(rng: np.random.Generator, width: int, height: int) -> ObstacleSpec:
    def cell() -> tuple[int, int]:
        return int(rng.integers(width)), int(rng.integers(height))

    radius = float(rng.choice([0.0, 0.1, rng.random()]))
    kind = int(rng.integers(4))
    if kind == 0:
        return RandomWalk(
            int(rng.integers(5)), float(rng.uniform(1e-9, 1)) if rng.random() < 0.5 else None, radius
        )
    if kind == 1:
        return Patrol(tuple(cell() for _ in range(int(rng.integers(1, 4)))), radius)
    if kind == 2:
        return Crossing(int(rng.integers(5)), radius)
    track = [cell()]
    for _ in range(int(rng.integers(20))):
        x, y = track[-1][0] + int(rng.integers(-1, 2)), track[-1][1] + int(rng.integers(-1, 2))
        track.append((min(max(x, 0), width - 1), min(max(y, 0), height - 1)))
    return Recorded(tuple(track), radius)


def some_scenario(rng: np.random.Generator, k: int) -> lampyris.Scenario:
    """A random scenario, on a map of a random kind."""
    source: nouns.MapSource | None = None
    resolution = float(rng.choice([1.0, 0.05, rng.uniform(1e-6, 1000)]))
    form = int(rng.integers(4))
    if form == 0:
        source = Bundled("guide")
        grid = replace(lampyris.load_grid("guide"), resolution=resolution)
    elif form == 1:
        width, height = int(rng.integers(4, 9)), int(rng.integers(4, 9))
        path = Path(str(rng.choice(["", "sub", "a b/ü"]))) / f"m{k}.npy"
        path.parent.mkdir(parents=True, exist_ok=True)
        np.save(path, rng.random((height, width)) < 0.3)
        source = MapFile(str(path))
        grid = replace(lampyris.load_grid(path), resolution=resolution)
    elif form == 2:
        from lampyris.io.maps.recipes.make import make

        settings = {"density": float(rng.random())}
        source = Made("random", (11, 7), int(rng.integers(2**62)), settings)
        cells = make("random", 11, 7, source.seed, **settings)
        grid = lampyris.Grid(cells, resolution=resolution, name="random")
    else:
        blocked = rng.random((5, 6)) < 0.4
        unknown = blocked & (rng.random((5, 6)) < 0.5)
        origin = tuple(float(v) for v in rng.normal(size=3))
        name = str(rng.choice(["room", "no", "1e3", "é: #", "- x"]))
        grid = lampyris.Grid(blocked, unknown if unknown.any() else None, resolution, origin, name)  # type: ignore[arg-type]
    robot = lampyris.Robot(0.0 if rng.random() < 0.5 else resolution, *rng.uniform(1e-6, 10, size=3).tolist())
    bodies = tuple(some_body(rng, grid.width, grid.height) for _ in range(int(rng.integers(4))))
    bodies = tuple(replace(b, radius=b.radius * resolution) for b in bodies)
    ends = [(int(rng.integers(grid.width)), int(rng.integers(grid.height))) for _ in range(2)]
    moves = str(rng.choice(["octile", "dissertation", "four-connected", "sixteen-connected"]))
    scene = lampyris.Scene(grid, *ends, moves=moves, robot=robot, traffic=bodies)  # type: ignore[arg-type]
    given: dict[str, Any] = {"planner": str(rng.choice(["astar", "dijkstra"])), "settings": {}}
    if rng.random() < 0.5:
        given = {
            "planner": "ad-gso",
            "settings": {"nt": int(rng.integers(1, 99)), "rho": float(rng.uniform(1e-9, 1))},
        }
    if rng.random() < 0.5:
        given |= {
            "law": "dissertation",
            "law_settings": {"v_max": float(rng.uniform(30, 90)), "ring1": "ahead"},
        }
    if rng.random() < 0.5:
        given |= {"simulated": True, "ticks": int(rng.integers(1, 10**9)), "patience": int(rng.integers(99))}
    name = str(rng.choice(["", "yes", "a: b # c", "'\"\\", "ü😀"]))
    return lampyris.Scenario(scene, **given, seed=int(rng.integers(2**63 - 1)), name=name, map=source)


@pytest.mark.commit(1)
@sized("cases", 30, 120)
@pytest.mark.parametrize("ending", [".yaml", ".json"])
def test_load_of_save_is_the_same_scenario(ending: str, cases: int) -> None:
    rng = np.random.default_rng(29)
    kinds: set[tuple[str, bool]] = set()
    for k in range(cases):
        x = some_scenario(rng, k)
        target = Path(f"s{k}{ending}")
        assert lampyris.save_scenario(x, target) == ()
        y = lampyris.load_scenario(target)
        assert y == completed(x)
        lampyris.save_scenario(y, f"again{ending}")
        assert Path(f"again{ending}").read_bytes() == target.read_bytes()
        kinds |= {(type(x.map).__name__, x.simulated)}
    assert len(kinds) == 8


def test_equal_means_equal_in_everything_that_decides() -> None:
    rng = np.random.default_rng(5)
    x = next(s for k in range(100) if (s := some_scenario(rng, k)).scene.traffic and s.simulated)
    assert x == replace(x, notes=("a",), where="b", map=None)
    scene = x.scene
    cells = scene.grid.blocked.copy()
    cells[0, 0] = not cells[0, 0]
    others = [
        replace(x, planner="x"), replace(x, settings={"a": 1}), replace(x, law="x"),
        replace(x, law_settings={"a": 1}), replace(x, seed=x.seed + 1),
        replace(x, simulated=False), replace(x, ticks=7), replace(x, patience=101),
        replace(x, name="other"), replace(x, scene=replace(scene, traffic=())),
        replace(x, scene=replace(scene, grid=replace(scene.grid, blocked=cells))),
        replace(x, scene=replace(scene, grid=replace(scene.grid, resolution=999.0))),
        replace(x, scene=replace(scene, grid=replace(scene.grid, origin=(9.0, 9.0, 9.0)))),
        replace(x, scene=replace(scene, robot=lampyris.Robot(0.0, 9.0))),
        replace(x, scene=replace(scene, start=(0, 0) if scene.start != (0, 0) else (1, 1))),
    ]  # fmt: skip
    for other in others:
        assert x != other
        assert other == other
    assert x != "x"


def test_everything_is_decided() -> None:
    scene = lampyris.Scene(lampyris.load_grid("guide"), (0, 9), (7, 0), traffic=RandomWalk(3))
    x = lampyris.Scenario(scene, simulated=True, map=Bundled("guide"))
    trace = lampyris.run(x)
    assert isinstance(trace, lampyris.Trace)
    lampyris.save_scenario(completed(x, trace), "s.json")
    said = json.loads(Path("s.json").read_text())
    assert list(said) == [
        "version", "map", "map_hash", "start", "goal", "robot", "moves", "planner", "law", "seed",
        "obstacles", "simulate",
    ]  # fmt: skip
    assert said["planner"]["settings"] == asdict(registry.make("ad-gso"))
    assert said["law"] == {"name": "physical", "settings": laws.settings_of("physical")}
    assert said["robot"] | {"footprint": None} == asdict(lampyris.Robot())
    assert "footprint" not in said["robot"]
    assert said["obstacles"] == [{"kind": "random-walk", "count": 3, "rate": None, "radius": 0.0}]
    assert said["simulate"] == {"ticks": trace.last_tick, "patience": 50}
    first = lampyris.plan(scene)
    assert first.path is not None
    assert trace.last_tick == 10 * (10 + 10) + 4 * (len(first.path.cells) - 1)
    made = lampyris.Scenario(scene, map=Made("maze", (9, 9)))
    assert completed(made).map == Made("maze", (9, 9), 0, {"corridor": 1, "wall": 1, "loops": 0.0})


@pytest.mark.commit(4)
@pytest.mark.parametrize("simulated", [False, True])
@pytest.mark.parametrize("planner", registry.names())
def test_every_planner_does_again_what_it_did(planner: str, simulated: bool) -> None:
    from lampyris.report.data.serialize import plan_record, trace_record

    def record(x: lampyris.Scenario) -> dict[str, Any]:
        done = lampyris.run(x)
        if isinstance(done, lampyris.Trace):
            said = trace_record(done)
            lampyris.save_scenario(completed(x, done), "again.yaml")
        else:
            said = plan_record(done.plan, x.scene, done.profile, seed=x.seed)
            lampyris.save_scenario(x, "again.yaml")
        return {**said, "timing": {}}

    bodies = (RandomWalk(2, 0.5), Crossing(1)) if simulated else ()
    scene = lampyris.Scene(lampyris.load_grid("guide"), (0, 9), (7, 0), traffic=bodies)
    x = lampyris.Scenario(scene, planner, seed=5, simulated=simulated, map=Bundled("guide"))
    first = json.dumps(record(x))
    y = lampyris.load_scenario("again.yaml")
    assert set(y.settings) == set(registry.settings_of(registry.planner_class(planner)))
    assert json.dumps(record(y)) == first


def test_paths_are_relative_to_the_file() -> None:
    Path("maps/deep").mkdir(parents=True)
    Path("runs").mkdir()
    Path("maps/deep/m.txt").write_text("S.G\n")
    grid = lampyris.load_grid("maps/deep/m.txt")
    x = lampyris.Scenario(lampyris.Scene(grid, (0, 0), (2, 0)), map=MapFile("maps/deep/m.txt"))
    assert lampyris.save_scenario(x, "s.yaml") == ()
    assert "file: maps/deep/m.txt" in Path("s.yaml").read_text()
    assert lampyris.save_scenario(x, "maps/s.yaml") == ()
    assert "file: deep/m.txt" in Path("maps/s.yaml").read_text()
    (note,) = lampyris.save_scenario(x, "runs/s.yaml")
    assert "allow_outside=True" in note
    assert "file: ../maps/deep/m.txt" in Path("runs/s.yaml").read_text().replace('"', "")
    with pytest.raises(LampyrisError, match="PATH_OUTSIDE"):
        lampyris.load_scenario("runs/s.yaml")
    assert lampyris.load_scenario("runs/s.yaml", allow_outside=True) == completed(x)


def test_zones_and_drives_are_saved_and_are_part_of_what_decides() -> None:
    grid = lampyris.load_grid("guide")
    zones = np.full((10, 10), np.inf)
    zones[2:5] = 0.5
    np.save("z.npy", zones)
    robot = lampyris.Robot(a_lat_max=0.3, turn_radius=0.2, jerk_max=2.0)
    scene = lampyris.Scene(grid, (0, 9), (7, 0), robot=robot, zones=zones)
    drive = {"period": 0.2, "obstacle_info": "velocities"}
    law = {"law": "blind", "law_settings": {"blind.reach": 4.0}}
    x = lampyris.Scenario(scene, **law, map=Bundled("guide"), zones="z.npy", drive=drive)  # type: ignore[arg-type]
    for ending in (".yaml", ".json"):
        assert lampyris.save_scenario(x, f"s{ending}") == ()
        y = lampyris.load_scenario(f"s{ending}")
        assert y == completed(x)
        assert y.scene.robot == robot
        assert y.scene.zones is not None
        assert (y.scene.zones == zones).all()
        assert (y.law_settings["blind.reach"], y.law_settings["three_speed"]) == (4.0, None)
    assert x != replace(x, drive=None)
    assert x != replace(x, drive={"period": 0.3})
    assert x != replace(x, scene=replace(scene, zones=None))
    assert x != replace(x, scene=replace(scene, zones=np.where(zones < 1, 0.4, zones)))
    Path("in").mkdir()
    why = "running the scenario needs allow_outside=True (--allow-outside)"
    told = f"the file of zones is outside the scenario's folder: {why}"
    assert lampyris.save_scenario(x, "in/s.yaml") == (told,)
    with pytest.raises(LampyrisError, match=r"ZONES.*in no file.*Scenario\.zones"):
        lampyris.save_scenario(replace(x, zones=None), "t.yaml")


@pytest.mark.nightly
@pytest.mark.parametrize("ending", some([".yaml", ".json"]))
def test_what_cannot_be_saved_is_said(ending: str) -> None:
    free = np.zeros((2, 3), bool)

    def save(grid: lampyris.Grid, **more: Any) -> None:
        traffic = more.pop("traffic", ())
        lampyris.save_scenario(
            lampyris.Scenario(lampyris.Scene(grid, (0, 0), (0, 0), traffic=traffic), **more), f"s{ending}"
        )

    with pytest.raises(LampyrisError, match=r"MAP.*terrain.*save the map"):
        save(lampyris.Grid(free, terrain=np.full((2, 3), 9)))
    with pytest.raises(LampyrisError, match=r"MAP.*unknown cells that are free"):
        save(lampyris.Grid(free, unknown=~free))
    with pytest.raises(LampyrisError, match=rf"TEXT.*s\{ending}: /name: 65 characters"):
        save(lampyris.Grid(free), name="x" * 65)
    with pytest.raises(LampyrisError, match=rf"TEXT.*s\{ending}: /map/name: 'a\\nb' is not printable"):
        save(lampyris.Grid(free, name="a\nb"))
    with pytest.raises(LampyrisError, match=r"PATH_FORM.*a\|b\.txt"):
        save(lampyris.Grid(free), map=MapFile("a|b.txt"))
    with pytest.raises(LampyrisError, match="PLANNER"):
        save(lampyris.Grid(free), planner="nobody")
    with pytest.raises(LampyrisError, match="LAW"):
        save(lampyris.Grid(free), law="nobody")
    long = Recorded(((0, 0), (0, 1)) * 100_000)
    with pytest.raises(LampyrisError, match=r"(YAML|JSON)_SIZE.*values.*put long tracks"):
        save(lampyris.Grid(free), traffic=(long,))
    assert not Path(f"s{ending}").exists()
    with pytest.raises(LampyrisError, match=r"SCENARIO_ENDING.*\.yaml, \.yml, \.json"):
        lampyris.save_scenario(
            lampyris.Scenario(lampyris.Scene(lampyris.Grid(free), (0, 0), (0, 0))), "s.txt"
        )
    with pytest.raises(LampyrisError, match="FILE_WRITE"):
        lampyris.save_scenario(
            lampyris.Scenario(lampyris.Scene(lampyris.Grid(free), (0, 0), (0, 0))), f"none/s{ending}"
        )


WORDS = [
    "", "a", "no", "Yes", "ON", "y", "null", "~", "true", "1", "1e3", ".5", "0x1", "1:30", "=", "<<",
    "- a", "a: b", "a #b", "#", "[", "{a", "'", '"', "\\", "a\nb", "\t", "é", "😀", "\u2028", "\x85", "a,b",
    "!x", "&a", "*a", "%", "@", "`", "2020-01-01", "a/b.c", "nan", ".inf", "...", "---", " a ", "env-1",
]  # fmt: skip


def test_words_and_numbers_are_read_as_they_were_written_by_us_and_by_others() -> None:
    import yaml

    rng = np.random.default_rng(1)
    numbers = [0.0, -0.0, 1e-6, 1e22, 5e-324, 1.7976931348623157e308, 0.1, 1 / 3, 10**17, -(2**63)]
    numbers += (rng.normal(size=200) * 10.0 ** rng.integers(-30, 30, size=200)).tolist()
    data: Mapping[str, Any] = {
        "words": list(WORDS), "table": {w: w for w in WORDS if w}, "n": numbers,
        "deep": [[1, [2.5, None]], {"a": {}}], "none": None, "empty": [], "no": {},
        "long": {f"key {k}": [True, False, None, "no"] for k in range(20)},
    }  # fmt: skip
    text = yaml_of(data)
    assert text.isascii()
    ours = read_yaml(text, "x").data
    assert ours == data
    assert repr(ours) == repr(data)
    # Readers of YAML 1.1 read the same.
    assert repr(yaml.safe_load(text)) == repr(data)
    assert json.loads(json_of(data)) == data

"""Study files: what every key means, what is refused and where, and the published schema."""

from __future__ import annotations

import hashlib
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from study_mistakes import ALL, HEAD, MAPS, MISTAKES, WHO

import lampyris
from lampyris.errors import LampyrisError
from lampyris.io.maps import library
from lampyris.io.maps.map_hash import map_hash
from lampyris.io.scenario.map_source import Files
from lampyris.io.scenario.save import json_of, yaml_of
from lampyris.io.text.strict_json import JsonDocument
from lampyris.io.text.strict_yaml import read_yaml
from lampyris.model.settings.drive import DriveSettings
from lampyris.motion.laws import registry as laws
from lampyris.planning import registry
from lampyris.study.design.study import Study, StudyTraffic, canonical
from lampyris.study.design.study_file import json_schema, load_study
from lampyris.study.design.worlds import spread

ROOT = Path(__file__).resolve().parents[2]
GUIDE = {"version": 1, "maps": ["guide"], "planners": ["astar"]}


@pytest.fixture(autouse=True)
def _here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Messages then hold short names."""
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")


def load(said: Any, name: str = "s.yaml", **how: Any) -> Study:
    """A study from plain data or text."""
    if isinstance(said, dict):
        said = json_of(said) if name.endswith(".json") else yaml_of(said)
    Path(name).write_text(said)
    return load_study(name, **how)


def refused(said: Any, **how: Any) -> tuple[LampyrisError, list[str]]:
    """The error, and a line for it and each of its notes."""
    with pytest.raises(LampyrisError) as caught:
        load(said, **how)
    return caught.value, [str(caught.value), *getattr(caught.value, "__notes__", ())]


def scen_folder(folder: str, **scens: str) -> None:
    """A folder with a small MovingAI map and ``.scen`` files about it."""
    Path(folder).mkdir(exist_ok=True)
    rows = ["....W", ".@..W", "....W", "....@"]
    text = "type octile\nheight 4\nwidth 5\nmap\n" + "\n".join(rows) + "\n"
    Path(folder, "m.map").write_text(text)
    for name, lines in scens.items():
        Path(folder, f"{name}.scen").write_text("version 1\n" + lines)


def line(start: tuple[int, int], goal: tuple[int, int], length: str, bucket: int = 0) -> str:
    """A line of a ``.scen``."""
    return f"{bucket}\tm.map\t5\t4\t{start[0]}\t{start[1]}\t{goal[0]}\t{goal[1]}\t{length}\n"


# ---- every key --------------------


def test_maps_and_planners_are_enough() -> None:
    s = load(GUIDE)
    stored = library.describe("guide").queries
    assert [(w.start, w.goal, w.published) for w in s.worlds] == [(q.start, q.goal, None) for q in stored]
    assert s.worlds[0].ground.hash == map_hash(lampyris.load_grid("guide"))
    assert (s.name, s.kind, s.moves, s.traffic_cases, s.seeds, s.root) == (
        "s",
        "plan",
        "octile",
        (StudyTraffic(),),
        (0,),
        0,
    )
    assert (s.expansions, s.seconds, s.ticks, s.patience, s.drive) == (5_000_000, None, None, None, {})
    assert s.robot == {
        "radius": 0.0, "v_max": 1.0, "a_max": 0.5, "d_max": 1.0, "a_lat_max": 1.0, "turn_radius": 0.0,
        "jerk_max": None,
    }  # fmt: skip
    assert [(w.name, w.called, dict(w.settings), w.origin) for w in s.planners] == [
        ("astar", "astar", {}, "")
    ]
    assert [w.name for w in s.laws] == ["physical"]
    assert dict(s.laws[0].settings) == laws.settings_of("physical")
    assert len(s) == len(list(s.jobs())) == 4


def test_every_key() -> None:
    s = load(
        """
version: 1
$schema: anything
name: all of it
about: >
  two
  lines
kind: drive
preset: dissertation
moves: four-connected
robot: {radius: 0.5, v_max: 2}
maps: [rooms-20]
planners: [astar]
laws: [physical, blind]
traffic: [none, {kind: mixed, count: 9, rate: 0.5, radius: 0.25, tracks: live}]
seeds: [5, 2]
seed: 11
budget: {seconds: 2.5}
drive: {period: 0.5}
memory: true
"""
    )
    assert (s.name, s.about, s.kind, s.moves, s.root, s.memory) == (
        "all of it",
        "two lines",
        "drive",
        "four-connected",
        11,
        True,
    )
    assert (s.robot["radius"], s.robot["v_max"], s.seeds) == (0.5, 2.0, (5, 2))
    assert s.traffic_cases == (StudyTraffic(), StudyTraffic("mixed", 9, 0.5, 0.25, "live"))
    assert (s.expansions, s.seconds) == (None, 2.5)
    assert s.drive["period"] == 0.5
    sensing = {"sensor_range", "field_of_view", "unseen_cost"}  # no study has drives with a sensor
    assert set(s.drive) == set(DriveSettings.__slots__) - sensing
    assert [w.name for w in s.laws] == ["physical", "blind"]
    assert len(s) == 4 * 2 * 2 * 1 * 2 == len({j.key for j in s.jobs()})


def test_the_preset_and_the_kind_where_nothing_is_said() -> None:
    s = load({**GUIDE, "preset": "dissertation", "traffic": [{"count": 3}], "ticks": 50, "patience": 9})
    assert (s.kind, s.moves, s.laws[0].name, s.ticks, s.patience) == (
        "simulate",
        "dissertation",
        "dissertation",
        50,
        9,
    )
    assert s.traffic_cases == (StudyTraffic("random-walk", 3),)
    assert load({**GUIDE, "traffic": [{"count": 3}], "kind": "plan"}).kind == "plan"
    assert load({**GUIDE, "kind": "simulate"}).kind == "simulate"


def test_budgets() -> None:
    for said, expansions, seconds in (
        ({"expansions": 7}, 7, None), ({"expansions": None}, None, None), (None, None, None),
        ({"expansions": 7, "seconds": 1}, 7, 1.0),
    ):  # fmt: skip
        s = load({**GUIDE, "budget": said})
        assert (s.expansions, s.seconds) == (expansions, seconds)


def test_json_says_the_same() -> None:
    data = {**GUIDE, "planners": [{"name": "ad-gso", "grid": {"nt": [8, 10]}}], "seeds": 3}
    a, b = load(data), load(data, "s.json")
    assert [j.key for j in a.jobs()] == [j.key for j in b.jobs()]


def test_settings_are_whole_and_grids_unfold_in_order() -> None:
    s = load(
        WHO
        + "[{name: ad-gso, settings: {rho: 1}, grid: {nt: [8, 10], choice: [greedy, exact]}},"
        + " {name: ad-gso, label: mine}, {name: ad-gso, label: swept, grid: {gamma: [1]}}]"
    )
    assert [w.called for w in s.planners] == [
        "ad-gso rho=1 nt=8 choice=greedy", "ad-gso rho=1 nt=8 choice=exact",
        "ad-gso rho=1 nt=10 choice=greedy", "ad-gso rho=1 nt=10 choice=exact", "mine", "swept gamma=1",
    ]  # fmt: skip
    for who in s.planners:
        assert set(who.settings) == set(registry.settings_of(registry.planner_class("ad-gso")))
        registry.make(who.name, who.settings)
    assert [(w.settings["nt"], w.settings["choice"]) for w in s.planners[:4]] == [
        (8, "greedy"), (8, "exact"), (10, "greedy"), (10, "exact"),
    ]  # fmt: skip
    assert repr(s.planners[0].settings["rho"]) == "1.0", "as a fraction, as the default is one"
    assert dict(s.planners[4].settings) == dict(registry.settings_of(registry.planner_class("ad-gso")))


def test_all_planners() -> None:
    assert [w.name for w in load(WHO + "all").planners] == list(registry.names())
    left = load(WHO + "{all: {except: [astar, jps]}}").planners
    assert [w.name for w in left] == [n for n in registry.names() if n not in ("astar", "jps")]
    mixed = load(WHO + "[{all: {except: [ad-gso]}}, {name: ad-gso, label: ours}]").planners
    assert len(mixed) == len(registry.names())
    assert mixed[-1].called == "ours"
    nobody = WHO + f"{{all: {{except: [{', '.join(registry.names())}]}}}}"
    assert (
        refused(nobody)[1][0]
        == "error[PLANNERS]: s.yaml:3:11: /planners: no planners are left; allowed: one or more"
    )


def test_a_guest_has_its_distribution() -> None:
    guests = [name for name in registry.names() if registry.origin_of(name)]
    assert all(registry.origin_of(name) == "" for name in ("astar", "ad-gso", "sipp"))
    for name in guests:
        who = load(WHO + f"[{name}]").planners[0]
        assert re.fullmatch(r"[\w.-]+ \d.*", who.origin)


def test_every_law_comes_back_from_its_settings() -> None:
    s = load({**GUIDE, "laws": list(laws.names())})
    for who in s.laws:
        again = laws.with_settings(who.name, dict(who.settings))
        for settings in (laws.settings_of(again), laws.settings_of(who.name)):
            assert canonical(settings) == canonical(who.settings)
    swept = load(ALL + "laws: [{name: physical, grid: {creep: [0.05, 0.1], blind: [true, off]}}]")
    assert len({j.key for j in swept.jobs()}) == 16


def test_traffic_grids() -> None:
    s = load(
        ALL + "traffic: [none, {kind: patrol, radius: 0.5, grid: {count: [1, 2], tracks: [live, replayed]}}]"
    )
    assert s.traffic_cases == (
        StudyTraffic(), StudyTraffic("patrol", 1, None, 0.5, "live"), StudyTraffic("patrol", 1, None, 0.5, "replayed"),
        StudyTraffic("patrol", 2, None, 0.5, "live"), StudyTraffic("patrol", 2, None, 0.5, "replayed"),
    )  # fmt: skip


# ---- queries --------------------


def test_a_limit_takes_the_first_the_last_and_evenly_between() -> None:
    assert spread(range(10), None) == spread(range(10), 10) == spread(range(10), 99) == list(range(10))
    assert spread(range(10), 1) == [0]
    assert spread(range(10), 2) == [0, 9]
    assert spread(range(101), 5) == [0, 25, 50, 75, 100]
    for n in range(1, 40):
        for limit in range(2, n + 1):
            taken = spread(range(n), limit)
            assert len(set(taken)) == limit
            assert (taken[0], taken[-1]) == (0, n - 1)
            steps = np.diff(taken)
            assert steps.size == 0 or steps.max() - steps.min() <= 1
    s = load(MAPS + "[{bundled: env-1, limit: 3}]")
    stored = library.describe("env-1").queries
    assert [w.start for w in s.worlds] == [stored[k].start for k in (0, 2, 4)]


def test_listed_queries_in_cells_and_metres() -> None:
    s = load(
        MAPS + "[{rows: ['...', '...'], resolution: 0.5, queries: "
        "[{start: [0, 0], goal: [2, 1]}, {start: {m: [0.1, 0.1]}, goal: {m: [1.4, 0.9]}}]}]"
    )
    assert [(w.start, w.goal) for w in s.worlds] == [((0, 0), (2, 1)), ((0, 1), (2, 0))]
    assert load(MAPS + "[{rows: ['S.G']}]").worlds[0].goal == (2, 0)


def test_drawn_queries_are_different_pairs_with_a_way_for_the_robot() -> None:
    for name, radius, moves in (
        ("env-2", 0.0, "octile"),
        ("maze-31", 0.0, "four-connected"),
        ("caves-64", 0.9, "octile"),
    ):
        data = {
            "version": 1, "planners": ["astar"], "moves": moves, "robot": {"radius": radius},
            "maps": [{"bundled": name, "queries": {"random": 40, "least": 10}}],
        }  # fmt: skip
        s = load(data)
        assert len({(w.start, w.goal) for w in s.worlds}) == len(s.worlds) == 40
        for w in s.worlds:
            assert np.hypot(w.start[0] - w.goal[0], w.start[1] - w.goal[1]) >= 10
            scene = lampyris.Scene(w.ground.grid, w.start, w.goal, moves, lampyris.Robot(radius))  # type: ignore[arg-type]
            assert lampyris.plan(scene, "astar")
        data["maps"] = [{"bundled": name, "queries": {"random": 15, "least": 10}}]
        fewer = load(data)
        assert [(w.start, w.goal) for w in fewer.worlds] == [(w.start, w.goal) for w in s.worlds[:15]]
        assert [(w.start, w.goal) for w in load({**data, "seed": 1}).worlds] != [
            (w.start, w.goal) for w in fewer.worlds
        ]


@pytest.mark.nightly
def test_every_pair_is_drawn_about_as_often() -> None:
    """Rooms of 6 and 2 cells: of 32 ordered pairs the small one has 2; by its cells it would have 1 in 6."""
    rows = "{rows: ['......#..'], name: r, queries: {random: 1}}"
    small = 0
    for seed in range(160):
        w = load(f"version: 1\nplanners: [astar]\nmaps: [{rows}]\nseed: {seed}").worlds[0]
        small += w.start[0] > 6
    assert 3 < small < 19  # 10 on average, deviation 3
    assert len(load(MAPS + "[" + rows.replace("1}", "32}") + "]").worlds) == 32
    assert refused(MAPS + "[" + rows.replace("1}", "33}") + "]")[0].what == "32 of 33 queries found on 'r'"


def test_more_queries_than_a_map_has_are_refused_before_one_is_drawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two million draws were made before that; 32 pairs on this map, and none 7 cells apart in one room."""
    rows = "{rows: ['......#..'], name: r, queries: {random: %s}}"
    monkeypatch.setattr("lampyris.study.design.random_queries.np.random.Generator", None)
    for asked, there in (("33", 32), ("100000", 32), ("1, least: 7", 0), ("31, least: 5", 30)):
        fault = refused(MAPS + "[" + rows % asked + "]")[0]
        assert fault.code == "QUERIES"
        assert fault.what.startswith(f"{there} of ")


def test_drawn_queries_are_those_of_the_releases_before() -> None:
    """How pairs are remembered while they are drawn must not change which they are."""
    data = {"version": 1, "planners": ["astar"], "maps": [{"bundled": "guide", "queries": {"random": 500}}]}
    said = repr([(w.start, w.goal) for w in load(data).worlds])
    assert hashlib.sha256(said.encode()).hexdigest()[:10] == "eb8e3bb0ab"


def test_one_map_may_have_several_entries() -> None:
    s = load(MAPS + "[guide, {bundled: guide, queries: [{start: [0, 9], goal: [0, 8]}]}]")
    assert len(s.worlds) == 5
    assert len({id(w.ground) for w in s.worlds}) == 1


def test_movingai_files_and_folders() -> None:
    scen_folder(
        "bench",
        b=line((0, 0), (3, 3), "4.24264069") + line((0, 0), (3, 0), "3") + line((4, 0), (4, 2), "2")
        + line((0, 0), (3, 3), "4.24264069"),
        a=line((0, 0), (0, 3), "3") + line((0, 0), (3, 0), "3"),
    )  # fmt: skip
    s = load(MAPS + "[{scen: bench}]")
    assert [(w.ground.name, w.start, w.goal, w.published) for w in s.worlds] == [
        ("m.map", (0, 0), (0, 3), 3.0),
        ("m.map", (0, 0), (3, 0), 3.0),
        ("m.map", (0, 0), (3, 3), 4.24264069),
        ("m.map (water)", (4, 0), (4, 2), 2.0),
    ]
    assert s.worlds[0].ground is s.worlds[2].ground
    assert len(load(MAPS + "[{scen: bench/b.scen}]").worlds) == 3
    assert [w.goal for w in load(MAPS + "[{scen: bench/b.scen, limit: 2}]").worlds] == [(3, 3)]
    assert all(w.published is None for w in load("moves: four-connected\n" + MAPS + "[{scen: bench}]").worlds)
    wide = "robot: {radius: 0.6}\n" + MAPS + "[{scen: bench/a.scen}]"
    assert all(w.published is None for w in load(wide).worlds)


def test_maps_of_benchmarks_may_be_elsewhere() -> None:
    scen_folder("maps")
    scen_folder("scens", **{"m.map": line((0, 0), (3, 3), "4.24264069"), "other": line((0, 0), (0, 3), "3")})
    Path("scens/m.map").unlink()
    assert refused(MAPS + "[{scen: scens}]")[0].code == "FILE_MISSING"
    assert len(load(MAPS + "[{scen: scens, map: maps}]").worlds) == 2
    assert len(load(MAPS + "[{scen: scens/other.scen, map: maps/m.map}]").worlds) == 1


def test_data_may_be_in_another_folder() -> None:
    scen_folder("../bench", a=line((0, 0), (0, 3), "3"))
    assert refused(MAPS + "[{scen: ../bench}]")[0].code == "PATH_OUTSIDE"
    assert len(load(MAPS + "[{scen: ../bench}]", allow_outside=True).worlds) == 1
    assert len(load(MAPS + "[{scen: .}]", data="../bench").worlds) == 1
    assert len(load(MAPS + "[{file: m.map, queries: {random: 2}}]", data="../bench").worlds) == 2
    assert refused(MAPS + "[{scen: ../here}]", data="../bench")[0].code == "PATH_OUTSIDE"
    Path("../bench/m.map").rename("m.map")
    Path("../bench/m.map").symlink_to(Path("m.map").absolute())
    error, _ = refused(MAPS + "[{scen: a.scen}]", data="../bench")
    assert (error.code, error.what) == ("PATH_OUTSIDE", "map 'm.map' is outside the study's folder")
    assert len(load(MAPS + "[{scen: a.scen}]", data="../bench", allow_outside=True).worlds) == 1
    Path("../bench/link.scen").symlink_to(Path("../here/out.scen").absolute())
    assert refused(MAPS + "[{scen: link.scen}]", data="../bench")[0].code == "PATH_OUTSIDE"


# ---- the mistakes --------------------


@pytest.mark.parametrize(("text", "code", "place", "says"), MISTAKES, ids=lambda v: str(v)[-40:])
def test_each_mistake_is_told_of_at_its_place(text: str, code: str, place: str, says: str) -> None:
    Path("empty").mkdir()
    Path("bad.scen").write_text("version 1\n0 m.map\n")
    error, lines = refused(text)
    assert error.code == code, lines
    assert error.where == f"s.yaml:{place}" or error.where.startswith(f"s.yaml:{place}:"), lines
    assert says in lines[0], lines
    assert error.exit_code == (5 if code in ("LIMIT", "RADIUS") else 3)
    assert len(lines[0]) < 1500


def test_the_mistakes_tell_them_all_at_once() -> None:
    text = (
        WHO
        + "[astra, {name: ad-gso, settings: {nt: 0}}]\nlaws: [fast]\ntraffic: [{kind: patrol}]\nseeds: [1, 1]"
    )
    _, lines = refused(text)
    assert [re.findall(r"s\.yaml:(\d+):", one)[0] for one in lines] == ["3", "3", "4", "5", "6"]
    _, lines = refused(MAPS + "[gide, {file: none.png}, {rows: ['.X']}]")
    assert len(lines) == 3


def test_limits_hold_before_anything_is_made(monkeypatch: pytest.MonkeyPatch) -> None:
    """Ten values of each of ten settings, ten billion planners, in a few hundred characters."""
    grid = ", ".join(f"key{k}: {list(range(1, 11))}" for k in range(10))
    with monkeypatch.context() as unfolding:
        unfolding.setattr(
            "lampyris.study.design.config.product", lambda *given: pytest.fail("unfolded") if given else [()]
        )
        error, _ = refused(WHO + f"[{{name: pso, grid: {{{grid}}}}}]")
    assert (error.code, error.what) == ("LIMIT", "10,000,000,000 planners")
    with monkeypatch.context() as reading:
        reading.delattr("lampyris.io.scenario.map_source.Files.map_of")
        many = MAPS + "[{recipe: maze, size: [4000, 4000], queries: {random: 100000}}]\nseeds: 101"
        assert refused(many)[0].exit_code == 5
    error, _ = refused(
        ALL
        + "traffic: [{grid: {count: "
        + str(list(range(999)))
        + ", radius: "
        + str(list(range(11)))
        + "}}]"
    )
    assert (error.code, error.what) == ("LIMIT", "10,989 traffic cases")
    monkeypatch.setattr("lampyris.study.design.worlds.MAX_ALL_CELLS", 2600)
    load(MAPS + "[guide, env-1]")
    error, _ = refused(MAPS + "[guide, env-1, env-2]")
    assert (error.code, error.what, error.exit_code) == ("LIMIT", "5,100 cells up to this map", 5)
    assert refused(MAPS + "[env-1]", max_cells=2499)[0].code == "MAP_TOO_LARGE"
    monkeypatch.setattr("lampyris.study.design.worlds.MAX_WORLDS", 4)
    load(MAPS + "[guide]")
    assert refused(MAPS + "[env-1]")[0].what == "too many queries"


def test_neither_a_file_nor_a_ready_study() -> None:
    with pytest.raises(LampyrisError, match=r"^error\[FILE_MISSING\].*dissertation.*did you mean density\?"):
        load_study("densty")
    Path("density").write_text(ALL)
    assert load_study("density").worlds[0].ground.name == "guide", "a file of that name goes first"


# ---- the schema --------------------


def fits(value: Any, schema: dict[str, Any], whole: dict[str, Any]) -> bool:
    """Whether a value is valid: the part of JSON Schema that our schema uses, and a failure for any other."""
    known = {
        "$ref", "$schema", "$defs", "title", "description", "default", "type", "const", "enum", "anyOf",
        "oneOf", "properties", "required", "additionalProperties", "items", "minItems", "maxItems",
        "minLength", "maxLength", "pattern", "minimum", "maximum", "exclusiveMinimum", "minProperties",
    }  # fmt: skip
    assert set(schema) <= known, set(schema) - known
    if "$ref" in schema and not fits(value, whole["$defs"][schema["$ref"].removeprefix("#/$defs/")], whole):
        return False
    if "anyOf" in schema and not any(fits(value, s, whole) for s in schema["anyOf"]):
        return False
    if "oneOf" in schema and sum(fits(value, s, whole) for s in schema["oneOf"]) != 1:
        return False
    if "const" in schema and (value != schema["const"] or isinstance(value, bool)):
        return False
    if "enum" in schema and value not in schema["enum"]:
        return False
    kinds = {"string": str, "array": list, "object": dict, "boolean": bool, "null": type(None)}
    kind = schema.get("type")
    number = isinstance(value, int | float) and not isinstance(value, bool)
    if kind in kinds and not isinstance(value, kinds[kind]):
        return False
    if kind in ("integer", "number") and not (number and (kind == "number" or isinstance(value, int))):
        return False
    if isinstance(value, str):
        return schema.get("minLength", 0) <= len(value) <= schema.get("maxLength", len(value))
    if isinstance(value, list):
        size = schema.get("minItems", 0) <= len(value) <= schema.get("maxItems", len(value))
        return size and all(fits(item, schema.get("items", {}), whole) for item in value)
    if isinstance(value, dict):
        fields, more = schema.get("properties", {}), schema.get("additionalProperties", True)
        if not set(schema.get("required", ())) <= set(value) or len(value) < schema.get("minProperties", 0):
            return False
        rest = more if isinstance(more, dict) else {}
        return all(
            fits(item, fields.get(key, rest), whole) and (key in fields or more is not False)
            for key, item in value.items()
        )
    if number:
        least, above = schema.get("minimum", value), schema.get("exclusiveMinimum")
        return bool(least <= value <= schema.get("maximum", value) and (above is None or value > above))
    return True


def test_the_schema_and_the_reader_are_of_one_mind() -> None:
    schema = json_schema()
    shapes = {
        "KEY", "TYPE", "KIND", "MOVES", "PRESET", "VERSION", "ROBOT_LIMIT", "MAPS", "MAP", "GRID", "SEEDS",
        "SEED", "BUDGET", "TRAFFIC", "MOBILITY", "PLANNERS", "LAWS", "TRAFFIC_COUNT", "TRAFFIC_RADIUS",
    }  # fmt: skip
    by_meaning = ("with kind", "is in `settings`", "`count` is missing", "an empty table; allowed: exp")
    asked = 0
    for text, code, _, says in MISTAKES:
        if code in shapes and not any(word in says for word in by_meaning):
            assert not fits(read_yaml(text, "x").data, schema, schema), text
            asked += 1
        if code in (
            "DUPLICATE",
            "MAP_NAME",
            "MAP_TWICE",
            "PLANNER",
            "SETTING",
            "LAW",
            "RADIUS",
            "GOAL_OCCUPIED",
        ):
            assert fits(read_yaml(text, "x").data, schema, schema), text
    assert asked > 40
    assert fits(read_yaml(HEAD + "planners: all", "x").data, schema, schema)


@pytest.mark.nightly
def test_every_table_is_closed_and_every_field_described() -> None:
    def tables(schema: Any) -> list[dict[str, Any]]:
        if isinstance(schema, list):
            return [t for one in schema for t in tables(one)]
        if not isinstance(schema, dict):
            return []
        return [schema] * ("properties" in schema) + [t for one in schema.values() for t in tables(one)]

    found = tables(json_schema())
    assert len(found) > 15
    for table in found:
        assert table["additionalProperties"] is False
        for name, field in table["properties"].items():
            assert field["description"].endswith((".", ")")), name
            assert name in table.get("required", ()) or "default" in field, name
            if "default" in field:
                assert fits(field["default"], field, json_schema()), name
    assert json_schema()["required"] == ["version", "maps", "planners"]


@pytest.mark.source
def test_the_copy_in_the_docs_is_current() -> None:
    kept = (ROOT / "docs" / "study.schema.json").read_text(encoding="utf-8")
    assert kept == json.dumps(json_schema(), indent=2) + "\n", (
        "lampyris study schema > docs/study.schema.json"
    )


def test_of_thousands_of_mistakes_a_hundred_are_placed(monkeypatch: pytest.MonkeyPatch) -> None:
    """A file of a few kilobytes with as many mistakes took minutes to be refused."""
    asked: list[object] = []
    at = JsonDocument.at
    monkeypatch.setattr(JsonDocument, "at", lambda self, *way: (asked.append(way), at(self, *way))[1])
    Path("s.json").write_text(
        json.dumps({"version": 1, "maps": ["guide"], "planners": ["astar"], "seeds": [7] * 5000})
    )
    with pytest.raises(
        LampyrisError, match=r"/seeds/1: the same seed .*; the first is at .*/seeds/0"
    ) as caught:
        load_study("s.json")
    assert caught.value.__notes__[-1] == "and 4,979 more"
    assert len(asked) < 300


def test_a_map_that_is_named_many_times_is_read_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Fifty kilobytes that name one large map a thousand times took as long as a thousand maps."""
    read: list[object] = []
    map_of = Files.map_of
    monkeypatch.setattr(Files, "map_of", lambda self, *spec: (read.append(spec), map_of(self, *spec))[1])
    one = "{bundled: guide, queries: [{start: [%d, 9], goal: [7, 0]}]}"
    found = load(MAPS + "[" + ", ".join(one % k for k in (1, 2, 3)) + ", guide]")
    assert len(found.worlds) == 7
    assert len(read) == 2


def test_obstacles_drawn_in_a_map_are_left_out_and_said(tmp_path: Path) -> None:
    (tmp_path / "m.txt").write_text(".....\n..o..\n..o..\n")
    (tmp_path / "s.yaml").write_text(
        "version: 1\nmaps: [{file: m.txt, queries: [{start: [0, 0], goal: [4, 2]}]}]\nplanners: [astar]\n"
    )
    study = load_study(tmp_path / "s.yaml")
    said = "2 moving obstacles drawn in it left out; the obstacles of a study are those under `traffic`"
    assert [note.partition(": ")[2] for note in study.notes] == [said]

"""The published JSON Schema: current, whole, described, and of one mind with the reader about shapes."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from scenario_mistakes import MISTAKES

from lampyris._core.limits import DECISIONS, TICKS
from lampyris._core.settings import meanings_of
from lampyris.errors import LampyrisError
from lampyris.io.scenario.schema import _plain, json_schema
from lampyris.io.text.strict_yaml import read_yaml
from lampyris.model.settings.drive import MAX_PASSED, DriveSettings
from lampyris.model.settings.simulation import SimulationSettings
from lampyris.study.design.schema import json_schema as json_schema_of_studies

ROOT = Path(__file__).resolve().parents[2]
SCHEMA = json_schema()
# Codes of what shapes and ranges cannot say: what is in the files, on the map, known by name.
BY_MEANING = {
    "START_OUTSIDE", "GOAL_OUTSIDE", "RADIUS", "PLANNER", "SETTING", "CHOICE", "LAW", "LAW_SETTING",
    "FILE_MISSING", "MAP_CELL", "MAP_TRUNCATED", "RECIPE", "MAP_TOO_LARGE", "OBSTACLE_TRACK",
    "OBSTACLE_SPEED", "TRACK", "ZONES_MAP", "PATH_OUTSIDE", "EDIT_OUTSIDE", "EDIT_TICK", "EDITS",
}  # fmt: skip
MEANT = (
    "one of them",
    "\\u0007",
    "without line breaks",
    "`start` is missing",
    "late.csv",
    "with a .dob file",
    "twice at tick",
)


def fits(value: Any, schema: dict[str, Any]) -> bool:
    """Whether a value is valid: the part of JSON Schema that our schema uses, and a failure for any other."""
    known = {
        "$ref", "$schema", "$defs", "title", "description", "default", "type", "const", "enum", "anyOf",
        "oneOf", "properties", "required", "additionalProperties", "items", "minItems", "maxItems",
        "minLength", "maxLength", "pattern", "minimum", "maximum", "exclusiveMinimum",
    }  # fmt: skip
    assert set(schema) <= known, set(schema) - known
    if "$ref" in schema:
        return fits(value, SCHEMA["$defs"][schema["$ref"].removeprefix("#/$defs/")])
    if "anyOf" in schema and not any(fits(value, s) for s in schema["anyOf"]):
        return False
    if "oneOf" in schema and sum(fits(value, s) for s in schema["oneOf"]) != 1:
        return False
    if "const" in schema and (value != schema["const"] or isinstance(value, bool)):
        return False
    if "enum" in schema and value not in schema["enum"]:
        return False
    if "type" in schema and not _of_type(value, schema["type"]):
        return False
    if isinstance(value, str):
        short = schema.get("minLength", 0) <= len(value) <= schema.get("maxLength", len(value))
        return short and re.search(schema.get("pattern", ""), value) is not None
    if isinstance(value, list):
        most = schema.get("maxItems", len(value))
        return schema.get("minItems", 0) <= len(value) <= most and all(
            fits(item, schema.get("items", {})) for item in value
        )
    if isinstance(value, dict):
        fields, more = schema.get("properties", {}), schema.get("additionalProperties", True)
        return set(schema.get("required", ())) <= set(value) and all(
            fits(item, fields[key]) if key in fields else bool(more) for key, item in value.items()
        )
    if isinstance(value, int | float) and not isinstance(value, bool):
        least, above = schema.get("minimum", value), schema.get("exclusiveMinimum")
        return least <= value <= schema.get("maximum", value) and (above is None or value > above)
    return True


def _of_type(value: Any, kind: str) -> bool:
    if kind in ("integer", "number"):
        whole = isinstance(value, int) and not isinstance(value, bool)
        return whole or (kind == "number" and isinstance(value, float) and abs(value) < float("inf"))
    kinds = {"string": str, "array": list, "object": dict, "boolean": bool, "null": type(None)}
    return isinstance(value, kinds[kind])


def tables(schema: Any) -> list[dict[str, Any]]:
    """Every schema of an object with properties."""
    if isinstance(schema, list):
        return [t for one in schema for t in tables(one)]
    if not isinstance(schema, dict):
        return []
    return [schema] * ("properties" in schema) + [t for one in schema.values() for t in tables(one)]


def test_every_table_is_closed_and_every_field_described() -> None:
    found = tables(SCHEMA)
    assert len(found) > 12
    for table in found:
        assert table["additionalProperties"] is False
        for name, field in table["properties"].items():
            assert field["description"].endswith((".", ")")), name
            assert name in table.get("required", ()) or "default" in field or name in ("simulate", "drive")
    assert SCHEMA["$schema"].endswith("2020-12/schema")
    assert SCHEMA["required"] == ["version", "map"]
    assert "title" not in json.dumps(SCHEMA["$defs"])


@pytest.mark.parametrize("table", tables(SCHEMA), ids=lambda t: str(t.get("description", ""))[:30])
def test_every_default_fits_its_own_field(table: dict[str, Any]) -> None:
    for field in table["properties"].values():
        if "default" in field:
            assert fits(field["default"], field)


def test_the_schema_and_the_reader_are_of_one_mind() -> None:
    agreed = 0
    for text, code, _, says in MISTAKES:
        if any(word in text or word in says for word in MEANT):
            continue
        data = read_yaml(text, "x").data
        assert fits(data, SCHEMA) == (code in BY_MEANING), text
        agreed += 1
    assert agreed > 60
    assert fits({"version": 1, "map": "guide"}, SCHEMA)
    assert fits({"version": 1, "map": "guide", "$schema": "x", "simulate": {}, "obstacles": []}, SCHEMA)


@pytest.mark.source
def test_the_copy_in_the_docs_is_current() -> None:
    kept = (ROOT / "docs" / "scenario.schema.json").read_text(encoding="utf-8")
    assert kept == json.dumps(SCHEMA, indent=2) + "\n", "lampyris schema > docs/scenario.schema.json"


def _descriptions(node: Any) -> Iterator[str]:
    """Every description of a schema, at any depth."""
    for key, part in node.items() if isinstance(node, dict) else enumerate(node):
        if key == "description" and isinstance(part, str):
            yield part
        elif isinstance(part, dict | list):
            yield from _descriptions(part)


ABBREVIATIONS = {"BMP", "CPU", "CSV", "PGM", "PNG", "ROS", "SHA", "YAML"}


@pytest.mark.parametrize("schema", [SCHEMA, json_schema_of_studies()], ids=["scenario", "study"])
def test_no_description_names_a_constant_or_a_module(schema: dict[str, Any]) -> None:
    texts = list(_descriptions(schema))
    assert len(texts) > 50
    for text in texts:
        assert set(re.findall(r"\b[A-Z][A-Z_]{2,}\b", text)) <= ABBREVIATIONS, text
        assert not re.search(r"\bSee (?!`)|:\w+:`", text), text


def test_the_limits_in_descriptions_are_those_in_force() -> None:
    drive, simulation = meanings_of(DriveSettings), meanings_of(SimulationSettings)
    assert f"At most {DECISIONS.default:,} periods." in drive["time_limit"]
    assert f"At most {MAX_PASSED} cells between" in drive["obstacle_speed"]
    assert f"at most {TICKS.default:,}." in simulation["ticks"]


@pytest.mark.parametrize(
    "field",
    [
        {"const": 1, "enum": [1], "minimum": 0.0, "maximum": 1e3, "title": "Field"},  # pydantic 2.9
        {"const": 1, "minimum": 0, "maximum": 1000, "additionalProperties": True},  # pydantic 2.12
    ],
)
def test_the_schema_is_the_same_under_every_version_of_pydantic(field: dict[str, Any]) -> None:
    """A field that is called like a word of JSON Schema is kept."""
    named = {"properties": {"title": field, "enum": field}}
    plain = {"const": 1, "minimum": 0, "maximum": 1000}
    assert json.dumps(_plain(named)) == json.dumps({"properties": {"title": plain, "enum": plain}})
    assert _plain({"enum": ["a", "b"], "const": "a", "minimum": 0.5, "additionalProperties": False}) == {
        "enum": ["a", "b"],
        "const": "a",
        "minimum": 0.5,
        "additionalProperties": False,
    }


@pytest.mark.source
def test_the_page_names_every_field_and_its_examples_are_right(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import lampyris

    page = (ROOT / "docs" / "scenarios.md").read_text(encoding="utf-8")
    for table in tables(SCHEMA):
        for name in table["properties"]:
            assert re.search(rf"[`{{ \"]{re.escape(name)}[`:\"]|{re.escape(name)}`", page), name
    monkeypatch.chdir(tmp_path)
    (tmp_path / "maps").mkdir()
    (tmp_path / "tracks").mkdir()
    (tmp_path / "maps" / "floor.yaml").write_text(
        "image: floor.pgm\nresolution: 0.05\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\n"
        "free_thresh: 0.196\n"
    )
    (tmp_path / "maps" / "floor.pgm").write_bytes(b"P5\n100 60\n255\n" + b"\xff" * 6000)
    (tmp_path / "tracks" / "forklift.csv").write_text("x,y\n3,3\n3,4\n")
    read = []
    # Those of fleets: tests/fleet/test_fleet_scenario.py.
    texts = [t for t in re.findall(r"```yaml\n(.*?)```", page, re.DOTALL) if "\nfleet:" not in t]
    for k, text in enumerate(texts):
        Path(f"{k}.yaml").write_text(text)
        read.append(lampyris.load_scenario(f"{k}.yaml"))
        assert fits(read_yaml(text, "x").data, SCHEMA)
    assert len(read) == 2
    assert read[0].scene.start == (30, 19)
    assert len(read[0].scene.traffic) == 5
    for line in re.findall(r"^    (error\[.*)$", page, re.MULTILINE):
        code, key = re.findall(r"error\[(\w+)\]: a\.yaml:\d+:\d+: (/\S+):", line)[0]
        body = {"/robot/a_max": "robot: {a_max: 0}", "/seeed": "# one line\nseeed: 1"}[key]
        Path("a.yaml").write_text(f"version: 1\nmap: guide\n{body}\n")
        with pytest.raises(LampyrisError) as caught:
            lampyris.load_scenario("a.yaml")
        assert caught.value.code == code

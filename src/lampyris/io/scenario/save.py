"""From a scenario to a file that says all of it, in YAML or JSON.

Both are written here, not by PyYAML: long lists stand on one line, numbers are written so that any reader
reads the same number, and text is quoted wherever one might take it for something else.
"""

from __future__ import annotations

import json
import math
import os
import re
from collections.abc import Mapping
from dataclasses import asdict, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lampyris.errors import FileError, LimitError, SettingError, UsageError
from lampyris.io.files import write_file
from lampyris.io.maps.formats.document import grid_codes
from lampyris.io.maps.formats.plain_text import MEANING
from lampyris.io.maps.formats.ros_yaml import plain_path
from lampyris.io.maps.map_hash import map_hash
from lampyris.io.scenario.scenario import Bundled, Made, MapFile, MapSource, Scenario
from lampyris.io.text import strict_json, strict_yaml
from lampyris.model.edit import Edit
from lampyris.model.grid import Grid
from lampyris.model.path import Pose
from lampyris.model.robot import Robot
from lampyris.model.traffic import Crossing, ObstacleSpec, Patrol, RandomWalk, Recorded
from lampyris.typing import Cell

if TYPE_CHECKING:
    from lampyris.io.scenario.schema_types import Table

ENDINGS = (".yaml", ".yml", ".json")
_WIDE = 90
"""A list or table longer than this on one line is broken up, if it holds more than numbers."""
# Words no reader of YAML 1.1 or 1.2 takes for anything but text.
_BARE = re.compile(r"(?!(?:y|n|yes|no|on|off|true|false|null)$)[A-Za-z][A-Za-z0-9_./-]*", re.IGNORECASE)


def check_ending(path: str | os.PathLike[str]) -> Path:
    """The path, if its ending is one of a scenario file's.

    Raises
    ------
    UsageError : it is not.
    """
    target = Path(path)
    if target.suffix.lower() not in ENDINGS:
        raise UsageError(
            "SCENARIO_ENDING", repr(target.suffix), where=str(target), allowed=", ".join(ENDINGS)
        )
    return target


def write_scenario(scenario: Scenario, path: str | os.PathLike[str]) -> tuple[str, ...]:
    """Write a scenario, complete; an existing file is replaced.

    Returns
    -------
    Notes for the user: what running the file will need.

    Raises
    ------
    UsageError : another ending than .yaml, .yml and .json.
    FileError : a name or setting that a file may not hold.
    SettingError : a map that is in no file and cannot be written as rows; a setting that is not plain data.
    LimitError : longer than such a file may be.
    FileError : it cannot be written.
    """
    target = check_ending(path)
    from lampyris.io.scenario.schema import ScenarioFile

    return write_plain(target, plain(scenario, target.parent), ScenarioFile)


def write_plain(target: Path, data: dict[str, Any], table: type[Table]) -> tuple[str, ...]:
    """Write a scenario that is plain data, if it is one of that table; see :func:`write_scenario`."""
    as_json = target.suffix.lower() == ".json"
    reader = strict_json if as_json else strict_yaml
    _small_enough(target, _count(data), "values", reader.MAX_VALUES)
    _valid(target, data, table)
    text = (json_of(data) if as_json else yaml_of(data)).encode()
    _small_enough(target, len(text), "bytes", reader.MAX_BYTES)
    write_file(target, text)
    return _needs(data)


def _small_enough(target: Path, size: int, what: str, most: int) -> None:
    """Refuse to write what its reader would refuse."""
    if size > most:
        as_json = target.suffix.lower() == ".json"
        raise LimitError(
            "JSON_SIZE" if as_json else "YAML_SIZE",
            f"{size:,} {what}",
            where=str(target),
            allowed=f"at most {most:,}",
            todo="put long tracks and maps into files" + ("" if as_json else ", or save it as .json"),
        )


def _valid(target: Path, data: dict[str, Any], table: type[Table]) -> None:
    """Refuse names and settings made in Python that a file may not hold."""
    from pydantic import ValidationError

    from lampyris.io.scenario.validation_errors import faults_of

    try:
        table.model_validate(data)
    except ValidationError as problem:
        fault = faults_of(strict_json.JsonDocument(data, str(target), json.dumps(data)), problem, table)[0]
        fault.where = f"{target}: {fault.where.rpartition(': ')[2]}"
        raise fault from None


def _needs(data: Mapping[str, Any]) -> tuple[str, ...]:
    files = {"the map": data["map"].get("file"), "the file of zones": data.get("zones")}
    outside = [what for what, name in files.items() if name is not None and _outside(name)]
    if not outside:
        return ()
    verb = "is" if len(outside) == 1 else "are"
    where_text = f"{' and '.join(outside)} {verb} outside the scenario's folder"
    return (f"{where_text}: running the scenario needs allow_outside=True (--allow-outside)",)


def _outside(name: str) -> bool:
    return name.startswith("../") or os.path.isabs(name)


# ---- plain data --------------------


def plain(scenario: Scenario, folder: Path) -> dict[str, Any]:
    """Everything that decides the run as plain data, nothing left to a default.

    Parameters
    ----------
    scenario : its settings should be complete: see :func:`lampyris.scenarios.completed`.
    folder : what the map's path is relative to.
    """
    scene = scenario.scene
    data: dict[str, Any] = {"version": 1}
    if scenario.name:
        data["name"] = scenario.name
    data |= {
        **plain_map(scenario.drawn, scenario.map, folder),
        "start": _end(scene.start, scene.start_pose),
        "goal": _end(scene.goal, scene.goal_pose),
        **({"via": [list(cell) for cell in scene.via], "via_order": scene.via_order} if scene.via else {}),
        "robot": plain_robot(scene.robot),
        "moves": scene.moves.name,
        "planner": {
            "name": scenario.planner,
            "settings": plain_settings(scenario.planner, scenario.settings),
        },
        "law": {"name": scenario.law, "settings": plain_settings(scenario.law, scenario.law_settings)},
        "seed": scenario.seed,
        "obstacles": [_obstacle(one) for one in scene.traffic],
    }
    if scenario.inflation.inflation_radius > 0:
        data["inflation"] = plain_settings("inflation", asdict(scenario.inflation))
    if (zones := _zones(scenario, folder)) is not None:
        data["zones"] = zones
    if scenario.edits:
        data["edits"] = [_edit(one) for one in scenario.edits]
    if scenario.simulated:
        data["simulate"] = {"ticks": scenario.ticks, "patience": scenario.patience}
        if scenario.sensor_range is not None:
            data["simulate"] |= {
                "sensor_range": scenario.sensor_range,
                "field_of_view": scenario.field_of_view,
                "unseen_cost": scenario.unseen_cost,
            }
        if scenario.goal_track is not None:
            data["simulate"]["goal_track"] = [list(cell) for cell in scenario.goal_track]
    if scenario.drive is not None:
        data["drive"] = plain_settings("drive", scenario.drive)
    return data


def _end(cell: Cell, pose: Pose | None) -> Any:
    return list(cell) if pose is None else {"pose": list(pose)}


def plain_robot(robot: Robot) -> dict[str, Any]:
    """The robot's settings; a footprint stands in place of the radius that comes of it."""
    settings = {f.name: getattr(robot, f.name) for f in fields(Robot)}
    if robot.footprint is None:
        del settings["footprint"]
    else:
        del settings["radius"]
        settings["footprint"] = [list(vertex) for vertex in robot.footprint]
    return settings


def _zones(scenario: Scenario, folder: Path) -> str | None:
    if scenario.zones is None:
        if scenario.scene.zones is not None:
            todo = "save them to a .npy and name it in Scenario.zones"
            raise SettingError("ZONES", "speed zones that are in no file", todo=todo)
        return None
    return named_file(scenario.zones, folder)


def named_file(path: str, folder: Path) -> str:
    """A file's name as a scenario in a folder has it."""
    name = _relative(path, folder)
    if not plain_path(name):
        raise FileError("PATH_FORM", "a scenario cannot name such a file", where=name, todo="rename it")
    return name


def plain_map(grid: Grid, source: MapSource | None, folder: Path) -> dict[str, Any]:
    """The keys ``map`` and ``map_hash`` of a scenario in a folder."""
    return {"map": _map(grid, source, folder), "map_hash": map_hash(grid)}


def _map(grid: Grid, source: MapSource | None, folder: Path) -> dict[str, Any]:
    if isinstance(source, Bundled):
        return {"bundled": source.name, "resolution": grid.resolution}
    if isinstance(source, MapFile):
        return {
            "file": named_file(source.path, folder),
            "resolution": grid.resolution,
            "values": source.values,
            "colour": source.colour,
        }
    if isinstance(source, Made):
        return {
            "recipe": source.recipe,
            "size": list(source.size),
            "seed": source.seed,
            "settings": plain_settings(source.recipe, source.settings),
            "resolution": grid.resolution,
        }
    return {
        "rows": _rows(grid),
        "name": grid.name or "inline",
        "resolution": grid.resolution,
        "origin": list(grid.origin),
    }


def _relative(path: str, folder: Path) -> str:
    """A path as seen from a folder, with / between its parts."""
    try:
        return Path(os.path.relpath(path, folder)).as_posix()
    except ValueError:  # another drive
        return Path(os.path.abspath(path)).as_posix()


def _rows(grid: Grid) -> list[str]:
    known = grid.unknown is None or not (grid.unknown & ~grid.blocked).any()
    if grid.terrain is not None or not known:
        what = "terrain" if grid.terrain is not None else "unknown cells that are free"
        raise SettingError(
            "MAP", f"a map in no file, with {what}", todo="save the map to a file and load it from there"
        )
    letter = {code: character for character, code in MEANING.items()}
    return ["".join(letter[int(code)] for code in row) for row in grid_codes(grid)]


def _obstacle(one: ObstacleSpec) -> dict[str, Any]:
    outline = one.footprint
    shape = {"radius": one.radius} if outline is None else {"footprint": [list(p) for p in outline]}
    if isinstance(one, RandomWalk):
        starts = {"starts": [list(c) for c in one.starts]} if one.starts else {}
        return {"kind": "random-walk", "count": one.count, "rate": one.rate, **shape, **starts}
    if isinstance(one, Crossing):
        return {"kind": "crossing", "count": one.count, **shape}
    if isinstance(one, Patrol):
        return {"kind": "patrol", "waypoints": [list(c) for c in one.waypoints], **shape}
    assert isinstance(one, Recorded)
    yaw = {"yaw": list(one.yaw)} if one.yaw else {}
    return {"kind": "recorded", "track": [list(c) for c in one.track], **shape, **yaw}


def _edit(one: Edit) -> dict[str, Any]:
    return {"tick": one.tick, "blocked": list(map(list, one.blocked)), "freed": list(map(list, one.freed))}


def plain_settings(owner: str, settings: Mapping[str, Any]) -> dict[str, Any]:
    """Settings as plain data; ``owner`` is whose they are, for messages."""
    return {key: _plain_value(owner, key, value) for key, value in settings.items()}


def _plain_value(owner: str, key: str, value: Any) -> Any:
    if isinstance(value, list | tuple):
        return [_plain_value(owner, key, item) for item in value]
    if isinstance(value, Mapping):
        return plain_settings(f"{owner}.{key}", value)
    finite = not isinstance(value, float) or math.isfinite(value)
    if value is None or (isinstance(value, str | int | float) and finite):
        return value
    raise SettingError(
        "SETTING",
        f"{key} {value!r}",
        where=owner,
        allowed="text, finite numbers, true, false, null, lists, tables",
    )


def _count(value: Any) -> int:
    parts = value.values() if isinstance(value, dict) else value if isinstance(value, list) else ()
    return 1 + sum(map(_count, parts))  # bits: whole numbers


# ---- text --------------------


def json_of(data: Mapping[str, Any]) -> str:
    """JSON, one key a line at the top and one obstacle or edit a line."""
    lines = []
    for key, value in data.items():
        text = json.dumps(value, allow_nan=False)
        if key == "fleet":
            rows = ",\n    ".join(json.dumps(one, allow_nan=False) for one in value["agents"])
            text = f'{{"agents": [\n    {rows}\n  ]}}'
        elif key in ("obstacles", "edits") and value:
            text = "[\n    " + ",\n    ".join(json.dumps(one, allow_nan=False) for one in value) + "\n  ]"
        lines.append(f"  {json.dumps(key)}: {text}")
    return "{\n" + ",\n".join(lines) + "\n}\n"


def yaml_of(data: Mapping[str, Any]) -> str:
    """YAML, tables by indentation, what is short on one line."""
    head = "# A lampyris scenario with everything decided. Run it with: lampyris run FILE\n"
    return head + "".join(f"{line}\n" for line in _table(data))


def _table(table: Mapping[str, Any]) -> list[str]:
    lines = []
    for key, value in table.items():
        flow = _flow(value)
        if not isinstance(value, dict | list) or len(flow) <= _WIDE or _numbers(value):
            lines.append(f"{_scalar(key)}: {flow}")
        elif isinstance(value, dict):
            lines += [f"{_scalar(key)}:", *(f"  {line}" for line in _table(value))]
        else:
            lines += [f"{_scalar(key)}:", *(f"  - {_flow(item)}" for item in value)]
    return lines


def _numbers(value: Any) -> bool:
    return isinstance(value, list) and not any(isinstance(item, dict | str) for item in value)


def _flow(value: Any) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{_scalar(k)}: {_flow(v)}" for k, v in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_flow, value)) + "]"
    return _scalar(value)


def _scalar(value: Any) -> str:
    if isinstance(value, str):
        return value if _BARE.fullmatch(value) else f'"{"".join(map(_escaped, value))}"'
    text = json.dumps(value, allow_nan=False)
    # Readers of YAML 1.1 take 1e-06 for text.
    return text.replace("e", ".0e") if isinstance(value, float) and "." not in text else text


def _escaped(character: str) -> str:
    """JSON's escapes are YAML's too, but for pairs of surrogates; nothing is left that could break a line."""
    if ord(character) > 0xFFFF:
        return f"\\U{ord(character):08X}"
    return json.dumps(character)[1:-1]

"""Plain: a study as JSON holds it, to be kept beside its results and compared with what a later call asks.

Maps stand in it by the hash of their cells; the cells themselves are packed by :mod:`lampyris.study.design.study_map`.
"""

from __future__ import annotations

import base64
import binascii
import math
import zlib
from collections.abc import Mapping
from dataclasses import asdict, replace
from typing import Any, NoReturn, get_args

import numpy as np

from lampyris import __version__
from lampyris.errors import FileError, SettingError
from lampyris.io.maps.map_hash import map_hash
from lampyris.io.text.strict_yaml import shown
from lampyris.model.grid import Grid
from lampyris.model.path import Pose
from lampyris.model.settings.sensor import Sensor
from lampyris.model.traffic import obstacle_footprint
from lampyris.study.design.study import (
    RESULTS,
    Config,
    FleetQuery,
    Kind,
    Study,
    StudyMap,
    StudyTraffic,
    World,
    canonical,
    fleet_query,
)
from lampyris.typing import Cell

FORMAT = 2
CALLED = "called"
"""Where the words stand that decide nothing: names, labels, what the study is about."""
_NONE = type(None)
_SAME: Mapping[str, tuple[type, ...]] = {
    "kind": (str,), "moves": (str,), "robot": (dict,), "expansions": (int, _NONE),
    "seconds": (float, int, _NONE), "ticks": (int, _NONE), "patience": (int, _NONE), "drive": (dict,),
    "root": (int,), "memory": (bool,),
}  # fmt: skip
"""Fields of a study that are plain data already, with their types."""
_TRAFFIC: Mapping[str, tuple[type, ...]] = {
    "kind": (str,), "count": (int,), "rate": (float, int, _NONE), "radius": (float, int), "tracks": (str,),
}  # fmt: skip


def study_plain(study: Study) -> dict[str, Any]:
    """All of a study but the cells of its maps; what JSON makes of it and back is the same."""
    grounds = list(study.grounds.values())
    number = {ground.hash: k for k, ground in enumerate(grounds)}
    return {
        "format": FORMAT,
        "version": [__version__, RESULTS],
        **{key: _copied(getattr(study, key)) for key in _SAME},
        "maps": [{"hash": g.hash, "resolution": g.grid.resolution} for g in grounds],
        "worlds": [
            {
                "map": number[w.ground.hash], "start": list(w.start), "goal": list(w.goal),
                "published": w.published, **w.poses,
                **({} if w.goal_track is None else {"goal_track": [list(cell) for cell in w.goal_track]}),
                **({} if w.fleet is None else {"fleet": packed_fleet(w.fleet)}),
            }
            for w in study.worlds
        ],
        "planners": [_config_record(w) for w in study.planners],
        "laws": [_config_record(w) for w in study.laws],
        "traffic_cases": [c.plain for c in study.traffic_cases],
        "seeds": list(study.seeds),
        CALLED: {
            "name": study.name,
            "about": study.about,
            "maps": [g.name for g in grounds],
            "planners": [w.label for w in study.planners],
            "laws": [w.label for w in study.laws],
            **({"fleets": [w.query for w in study.worlds]} if study.kind == "fleet" else {}),
        },
    }  # fmt: skip


def study_of(plain: Mapping[str, Any], grounds: Mapping[str, Grid]) -> Study:
    """The study that :func:`study_plain` made plain: the same jobs, with the same keys and labels.

    Parameters
    ----------
    plain : plain data.
    grounds : the maps by hash.

    Raises
    ------
    FileError : STUDY_VERSION: written by another release, in which the same jobs have other keys;
        STUDY_PLAIN: not such data; STUDY_MAP: a map is missing, or is another one.
    """
    try:
        version = [plain["version"][0], plain["version"][1]]
        if plain["format"] != FORMAT or version != [__version__, RESULTS]:
            raise FileError(
                "STUDY_VERSION",
                f"made by lampyris {version[0]}, results {version[1]}, format {plain['format']}",
                where="study",
                allowed=f"lampyris {__version__}, results {RESULTS}, format {FORMAT}",
                todo="read it with that release, or run the study again",
            )
        return _study(plain, grounds)
    except SettingError:
        raise
    except (KeyError, IndexError, TypeError, ValueError, AttributeError) as problem:
        what = f"{type(problem).__name__} ({str(problem)[:60]})"
        raise FileError("STUDY_PLAIN", what, where="study", allowed="a study made plain") from None


def demand_same(there: Mapping[str, Any], study: Study, where: str) -> None:
    """Refuse a store of another study.

    Parameters
    ----------
    there : the store's study as plain data. where : the store.

    Raises
    ------
    FileError : STORE_OTHER, with the first field that differs.
    """
    found = differing(there, study_plain(study))
    if found:
        what = f"made for another study, which differs in {found}"
        raise FileError("STORE_OTHER", what, where=where, todo="give another one: store=FILE")


def differing(old: Mapping[str, Any], new: Mapping[str, Any]) -> str:
    """Dotted name and both values of the first field in which two plain studies differ; empty if in none.

    Names and labels do not count (see :data:`CALLED`): they decide nothing. A whole number and a fraction of
    the same value differ, as keys of jobs do.
    """
    return _differing(
        {k: v for k, v in old.items() if k != CALLED}, {k: v for k, v in new.items() if k != CALLED}, ""
    )


def _study(plain: Mapping[str, Any], grounds: Mapping[str, Grid]) -> Study:
    called = plain[CALLED]
    maps = [_ground(one, name, grounds) for one, name in zip(plain["maps"], called["maps"], strict=True)]
    planners, laws = (
        tuple(_config_of(one, label) for one, label in zip(plain[key], called[key], strict=True))
        for key in ("planners", "laws")
    )
    for key in ("worlds", "planners", "laws", "traffic_cases", "seeds"):
        if not plain[key]:  # a study of no runs: nothing of ours writes it, and nothing can be said of it
            raise ValueError(f"no {key}")
    same = {key: _typed(plain[key], *kinds) for key, kinds in _SAME.items()}
    if same["kind"] not in get_args(Kind):
        raise ValueError(same["kind"])
    study = Study(
        name=_typed(called["name"], str),
        about=_typed(called["about"], str),
        worlds=_worlds(plain, maps),
        planners=planners,
        laws=laws,
        traffic_cases=tuple(
            StudyTraffic(
                **{key: _typed(one[key], *kinds) for key, kinds in _TRAFFIC.items()},
                footprint=obstacle_footprint(one["footprint"]) if "footprint" in one else None,
            )
            for one in plain["traffic_cases"]
        ),
        seeds=tuple(_typed(seed, int) for seed in plain["seeds"]),
        **same,
    )
    _each_once(study)
    return study


def _each_once(study: Study) -> None:
    """Refuse a study that has something twice: jobs would have the same key."""
    whats: dict[str, list[Any]] = {
        "world": [(w.ground.hash, *w.identity) for w in study.worlds],
        "planner": [canonical(_config_record(w)) for w in study.planners],
        "law": [canonical([w.name, dict(w.settings)]) for w in study.laws],
        "traffic_case": [canonical(c.plain) for c in study.traffic_cases],
        "seed": list(study.seeds),
    }
    for name, keys in whats.items():
        if len(set(keys)) < len(keys):
            raise ValueError(f"a {name} twice")


def _typed(value: Any, *kinds: type) -> Any:
    """The value, if it is of one of these types; true and false are no numbers."""
    if type(value) not in kinds:
        raise TypeError(f"a {type(value).__name__}")
    return value


def _config_of(record: Mapping[str, Any], label: str) -> Config:
    name, settings, origin = record["name"], record["settings"], record["origin"]
    given = record.get("sensor")
    sensor = None if given is None else Sensor(**_typed(given, dict))
    return Config(_typed(name, str), _typed(settings, dict), _typed(label, str), _typed(origin, str), sensor)


def _worlds(plain: Mapping[str, Any], maps: list[StudyMap]) -> tuple[World, ...]:
    worlds = tuple(_world(one, maps) for one in plain["worlds"])
    fleets = plain["kind"] == "fleet"
    if any((world.fleet is not None) != fleets for world in worlds):
        raise ValueError("a fleet in a study of one robot, or a query of one robot in a study of fleets")
    if not fleets:
        return worlds
    named = zip(worlds, plain[CALLED]["fleets"], strict=True)
    return tuple(
        replace(w, fleet=replace(w.fleet, name=_typed(name, str))) for w, name in named if w.fleet is not None
    )


def packed_fleet(fleet: FleetQuery) -> str:
    """The ends of a fleet's robots as JSON holds them."""
    return base64.b64encode(zlib.compress(fleet.ends.tobytes(), 6)).decode("ascii")


def unpacked_fleet(packed: Any, ground: Grid) -> FleetQuery:
    """The robots of what :func:`packed_fleet` made, on their map, without a name.

    Raises
    ------
    ValueError, TypeError : no such data, or a cell that is not on the map.
    """
    most = 16 * ground.width * ground.height  # no two robots have one start
    unfold = zlib.decompressobj()
    try:
        raw = unfold.decompress(base64.b64decode(_typed(packed, str), validate=True), most + 1)
    except (binascii.Error, zlib.error) as problem:
        raise ValueError(f"the robots of a fleet: {problem}") from None
    if len(raw) > most or not raw or len(raw) % 16 or not unfold.eof or unfold.unused_data:
        raise ValueError(f"{len(raw):,} bytes of robots")
    ends = np.frombuffer(raw, "<i4").reshape(-1, 4)
    if (ends < 0).any() or (ends >= (ground.width, ground.height) * 2).any():
        raise ValueError("a robot that is not on the map")
    return fleet_query("", ends)


def _world(record: Mapping[str, Any], maps: list[StudyMap]) -> World:
    number = _typed(record["map"], int)
    if not 0 <= number < len(maps):
        raise IndexError(f"map {number}")
    ground = maps[number]
    start, goal = _cell(record["start"], ground), _cell(record["goal"], ground)
    if "origin" in record and list(ground.grid.origin) != record["origin"]:
        raise ValueError(f"the origin {ground.grid.origin} of map {number}")
    start_pose, goal_pose = (
        _pose(record.get(f"{what}_pose"), cell, ground) for what, cell in (("start", start), ("goal", goal))
    )
    fleet = unpacked_fleet(record["fleet"], ground.grid) if "fleet" in record else None
    published = _typed(record["published"], float, int, _NONE)
    track = tuple(_cell(pair, ground) for pair in record["goal_track"]) if "goal_track" in record else None
    return World(ground, start, goal, published, start_pose, goal_pose, fleet, track)


def _ground(record: Mapping[str, Any], name: str, grounds: Mapping[str, Grid]) -> StudyMap:
    _typed(name, str)
    hash_, grid = record["hash"], grounds.get(record["hash"])
    if grid is None:
        _refuse_map(name, "is missing")
    if map_hash(grid) != hash_:
        _refuse_map(name, "has other cells")
    if grid.resolution != record["resolution"]:
        _refuse_map(name, f"has {grid.resolution!r} metres a cell, not {record['resolution']!r}")
    return StudyMap(name, grid, hash_)


def _refuse_map(name: str, why: str) -> NoReturn:
    raise FileError("STUDY_MAP", f"map {shown(name)} {why}", where="study", allowed="the study's own map")


def _cell(pair: Any, ground: StudyMap) -> Cell:
    x, y = pair
    cell: Cell = (_typed(x, int), _typed(y, int))
    if not ground.grid.contains(cell):
        raise ValueError(f"{cell} is not on the map")
    return cell


def _pose(given: Any, cell: Cell, ground: StudyMap) -> Pose | None:
    """A pose in a cell; None where there is none."""
    if given is None:
        return None
    x, y, yaw = (float(_typed(number, float, int)) for number in given)
    if not (math.isfinite(x + y) and -math.pi <= yaw <= math.pi) or ground.grid.to_cell(x, y) != cell:
        raise ValueError(f"the pose {(x, y, yaw)} is not in the cell {cell}")
    return x, y, yaw


def _config_record(who: Config) -> dict[str, Any]:
    sensor = {} if who.sensor is None else {"sensor": asdict(who.sensor)}
    return {"name": who.name, "settings": dict(who.settings), "origin": who.origin, **sensor}


def _copied(value: Any) -> Any:
    return dict(value) if isinstance(value, Mapping) else value


def _differing(old: Any, new: Any, name: str) -> str:
    if isinstance(old, Mapping) and isinstance(new, Mapping):
        for key in (*old, *(k for k in new if k not in old)):
            inner = f"{name}.{key}" if name else str(key)
            if key not in old or key not in new:
                return f"{inner}: {_brief(old.get(key))} and {_brief(new.get(key))}"
            if found := _differing(old[key], new[key], inner):
                return found
        return ""
    if isinstance(old, list | tuple) and isinstance(new, list | tuple):
        if len(old) != len(new):
            return f"{name}: {_brief(old)} and {_brief(new)}"
        pairs = enumerate(zip(old, new, strict=True))
        return next((f for k, (a, b) in pairs if (f := _differing(a, b, f"{name}.{k}"))), "")
    return "" if canonical(old) == canonical(new) else f"{name}: {_brief(old)} and {_brief(new)}"


def _brief(value: Any) -> str:
    if isinstance(value, list | tuple):
        short = shown(list(value))
        return short if len(value) <= 8 and not short.endswith("...") else f"{len(value):,} values"
    return "a table" if isinstance(value, Mapping) else shown(value)

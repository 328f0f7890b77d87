"""Configurations: planners, speed laws and traffic cases of a study file, every grid of settings unfolded.

How many there will be is counted before anything is unfolded: a grid of eight settings with ten values each
is a hundred million planners in a hundred characters.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import partial
from itertools import product
from math import prod
from typing import Any, TypeAlias, TypeVar

from lampyris.errors import FileError, LampyrisError, LimitError, SettingError
from lampyris.io.scenario.map_source import Mistakes, setting_path
from lampyris.io.scenario.robot_table import with_footprint
from lampyris.io.scenario.validation_errors import Document, spot
from lampyris.io.text.strict_yaml import KeyPath, shown
from lampyris.model.settings.sensor import Sensor
from lampyris.model.settings.simulation import SimulationSettings
from lampyris.model.traffic import RandomWalk
from lampyris.motion.laws import registry as laws
from lampyris.planning import registry
from lampyris.planning.fleet import registry as fleet_planners
from lampyris.study.design import schema as form
from lampyris.study.design.study import Config, StudyTraffic, canonical

T = TypeVar("T")
MAX_CONFIGS = 10_000
"""Planners of a study, each with its settings; the same for speed laws and traffic cases."""
Made: TypeAlias = list[tuple[T, KeyPath]]
"""What came of a list of the file, each with the path to where it is said."""


class Tried:
    """Makes what a file says, and keeps what is wrong with it, at its place.

    Parameters
    ----------
    parsed : the file.
    """

    def __init__(self, parsed: Document) -> None:
        self.parsed = parsed
        self.faults = Mistakes(parsed)

    def __call__(self, key_path: KeyPath, make: Callable[..., T], *given: Any) -> T | None:
        """What ``make(*given)`` makes; None, with the mistake kept, if it cannot."""
        try:
            return make(*given)
        except LampyrisError as fault:
            self.refuse(key_path, fault)
        return None

    def refuse(self, key_path: KeyPath, fault: LampyrisError) -> None:
        """Keep a mistake."""
        self.faults.keep(key_path, fault)

    def count(self, key_path: KeyPath, many: int, what: str) -> bool:
        """Whether so many may be; a mistake is kept if not."""
        if many > MAX_CONFIGS:
            self.refuse(key_path, LimitError("LIMIT", f"{many:,} {what}", allowed=f"at most {MAX_CONFIGS:,}"))
        return many <= MAX_CONFIGS

    def each_once(self, made: Made[T], key: Callable[[T], object], code: str, what: str) -> None:
        """Keep a mistake for whatever is there a second time."""
        first: dict[object, KeyPath] = {}
        for one, key_path in made:
            mark = key(one)
            if mark in first:
                self.faults.keep(key_path, partial(self._second, key_path, first[mark], code, what))
            first.setdefault(mark, key_path)

    def _second(self, key_path: KeyPath, first: KeyPath, code: str, what: str) -> LampyrisError:
        where = "" if first == key_path else f"; the first is at {spot(self.parsed, first)}"
        return FileError(code, what, todo=f"take one away{where}")


@dataclass(frozen=True)
class _Entry:
    """A planner or a law as a file has it; ``swept`` holds the settings that it takes several values of."""

    key_path: KeyPath
    name: str
    settings: Mapping[str, Any] = field(default_factory=dict)
    swept: Mapping[str, list[Any]] = field(default_factory=dict)
    label: str | None = None
    table: bool = False

    @property
    def many(self) -> int:
        """How many it unfolds to."""
        return prod(len(values) for values in self.swept.values())

    def each(self) -> Iterator[tuple[dict[str, Any], str]]:
        """Settings and label of each."""
        head = self.label or self.name
        fixed = "" if self.label else _said(self.settings)
        for values in product(*self.swept.values()):
            some = dict(zip(self.swept, values, strict=True))
            yield {**self.settings, **some}, f"{head}{fixed}{_said(some)}"


def planners_of(given: Any, tried: Tried, *, fleets: bool = False) -> Made[Config]:
    """The planners of a study file, each once, of fleets or of one robot; what is wrong is kept by ``tried``."""
    known = fleet_planners if fleets else registry
    entries = []
    listed = given if isinstance(given, list) else [given]
    for k, one in enumerate(listed):
        key_path: KeyPath = ("planners", k) if isinstance(given, list) else ("planners",)
        if one == "all" or isinstance(one, form.AllTable):
            left_out = [] if one == "all" else one.all.except_
            for j, name in enumerate(left_out):
                tried((*key_path, "all", "except", j), known.demand_name, name)
            entries += [_Entry(key_path, name) for name in known.names() if name not in left_out]
        else:
            entries.append(_entry(one, key_path))
    make = fleet_planner_config if fleets else planner_config
    return _unfolded(entries, make, "planners", tried)


def laws_of(given: list[Any] | None, default: str, tried: Tried) -> Made[Config]:
    """The speed laws of a study file, each once; what is wrong is kept by ``tried``."""
    if given is None:
        return [(law_config(default, {}, default), ("laws",))]
    entries = [_entry(one, ("laws", k)) for k, one in enumerate(given)]
    return _unfolded(entries, law_config, "laws", tried)


def traffic_cases_of(given: list[Any], tried: Tried) -> Made[StudyTraffic]:
    """The traffic cases of a study file, each once; what is wrong is kept by ``tried``."""
    tables = [
        (
            key_path,
            {} if isinstance(one, str) or one.grid is None else one.grid.model_dump(exclude_none=True),
            one,
        )
        for k, one in enumerate(given)
        if (key_path := ("traffic", k))
    ]
    many = sum(prod(len(v) for v in swept.values()) for _, swept, _ in tables)
    if not tried.count(("traffic",), many, "traffic cases"):
        return []
    made: Made[StudyTraffic] = []
    for key_path, swept, one in tables:
        for values in product(*swept.values()):
            traffic = tried(key_path, _traffic, one, dict(zip(swept, values, strict=True)))
            if traffic is not None:
                made.append((traffic, key_path))
    tried.each_once(made, lambda c: canonical(c.plain), "DUPLICATE", "the same obstacles a second time")
    return made


def sensors_of(given: list[Any], tried: Tried) -> Made[Sensor | None]:
    """The sensors of a study file, each once; None: the map is known."""
    made: Made[Sensor | None] = []
    for k, one in enumerate(given):
        key_path: KeyPath = ("sensors", k)
        if isinstance(one, str):
            made.append((None, key_path))
            continue
        settings = tried(key_path, partial(SimulationSettings, **one.model_dump()))
        if settings is not None:
            made.append((settings.sensor, key_path))
    tried.each_once(made, lambda sensor: sensor, "DUPLICATE", "the same sensor a second time")
    return made


def _entry(one: Any, key_path: KeyPath) -> _Entry:
    if isinstance(one, str):
        return _Entry(key_path, one)
    return _Entry(key_path, one.name, one.settings, one.grid or {}, one.label, table=True)


def _setting_at(entry: _Entry, key_path: KeyPath, fault: LampyrisError) -> KeyPath:
    """Where in the file the setting stands that a mistake is about; else ``key_path``."""
    for table, settings in (("grid", entry.swept), ("settings", entry.settings)):
        if path := setting_path(fault, settings):
            return (*entry.key_path, table, *path)
    return (*entry.key_path, "name") if entry.table and fault.setting in ("planner", "law") else key_path


def _unfolded(
    entries: list[_Entry], make: Callable[[str, Mapping[str, Any], str], Config], key: str, tried: Tried
) -> Made[Config]:
    if not tried.count((key,), sum(e.many for e in entries), key):
        return []
    made: Made[Config] = []
    for entry in entries:
        both = [name for name in entry.swept if name in entry.settings]
        if both:
            fault = FileError("KEY", f"{shown(both[0])} is in `settings`, too", allowed="one of them")
            tried.refuse((*entry.key_path, "grid", both[0]), fault)
            continue
        key_path = (*entry.key_path, "grid") if entry.swept else entry.key_path
        for settings, label in entry.each():
            try:
                made.append((make(entry.name, settings, label), key_path))
            except LampyrisError as fault:
                tried.refuse(_setting_at(entry, key_path, fault), fault)
    if not made and not tried.faults:
        tried.refuse((key,), FileError(key.upper(), f"no {key} are left", allowed="one or more"))
    same = "the same settings a second time"
    tried.each_once(made, lambda w: canonical([w.name, dict(w.settings), w.origin]), "DUPLICATE", same)
    if not tried.faults:
        tried.each_once(made, lambda w: w.called, "LABEL", "the same label for other settings")
    return made


def planner_config(name: str, settings: Mapping[str, Any], label: str) -> Config:
    """A planner with every setting that it has.

    Raises
    ------
    UsageError : ``PLANNER``: no such planner.
    SettingError : a setting that it does not have, or out of its range; ``SETTING``: the name of a file, whose content
        the key of a run would not say.
    """
    made = registry.make(name, settings)
    for key in getattr(made, "files", ()):
        if getattr(made, key) is not None:
            raise SettingError(
                "SETTING",
                f"{name}: {key} {shown(settings.get(key))}",
                allowed="null: a run of a study is identified by its settings, not by the content of files",
                setting=key,
            )
    known = registry.settings_of(type(made))
    full = {key: _like(default, getattr(made, key)) for key, default in known.items()}
    return Config(name, _plain(full, name), "" if label == name else label, registry.origin_of(name))


def fleet_planner_config(name: str, settings: Mapping[str, Any], label: str) -> Config:
    """A planner of fleets with every setting that it has.

    Raises
    ------
    UsageError : ``PLANNER``: no such planner.
    SettingError : a setting that it does not have, or out of its range.
    """
    made = fleet_planners.make(name, settings)
    known = registry.settings_of(type(made))
    full = {key: _like(default, getattr(made, key)) for key, default in known.items()}
    return Config(name, _plain(full, name), "" if label == name else label, registry.origin_of(name))


def plans_poses(planner: Config) -> bool:
    """Whether it is registered as a planner of poses."""
    return registry.plans_poses(planner.name)


def law_config(name: str, settings: Mapping[str, Any], label: str) -> Config:
    """A speed law with every setting that it has."""
    full = laws.settings_of(laws.with_settings(name, settings))
    known = laws.settings_of(name)
    full = {key: _like(known.get(key), value) for key, value in full.items()}
    return Config(name, _plain(full, name), "" if label == name else label)


def _traffic(one: Any, some: Mapping[str, Any]) -> StudyTraffic:
    if isinstance(one, str):
        return StudyTraffic()
    given = {**one.model_dump(exclude={"grid"}), **some}
    if given["kind"] == "none":
        return StudyTraffic()
    if given["count"] is None:
        raise FileError("KEY", "`count` is missing", allowed="how many")
    if given["rate"] is not None and given["kind"] not in ("random-walk", "mixed"):
        raise FileError("TRAFFIC_RATE", f"a rate with {given['kind']}", allowed="random walkers")
    given = with_footprint(given, "traffic", "TRAFFIC_FOOTPRINT")
    if not given["count"]:
        return StudyTraffic()
    if given["footprint"] is not None:
        made = RandomWalk(given["count"], None, footprint=given["footprint"])
        given |= {"radius": made.radius, "footprint": made.footprint}
    return StudyTraffic(**given)


def _like(default: Any, value: Any) -> Any:
    """A whole number as a fraction where the default is one: 1 and 1.0 are the same setting, one key."""
    whole = isinstance(value, int) and not isinstance(value, bool)
    return float(value) if isinstance(default, float) and whole else value


def _plain(settings: dict[str, Any], name: str) -> dict[str, Any]:
    """Settings that JSON can hold, as it would give them back.

    Raises
    ------
    SettingError : they are something else.
    """
    try:
        plain: dict[str, Any] = json.loads(canonical(settings))
    except (TypeError, ValueError, OverflowError, RecursionError) as problem:
        raise SettingError(
            "SETTING", f"{name}: {problem}", allowed="numbers that are finite, text, true, false and null"
        ) from None
    return {key: plain[key] for key in settings}


def _said(settings: Mapping[str, Any]) -> str:
    """Settings for a label, such as `` nt=8``."""
    return "".join(f" {k}={v if isinstance(v, str) else json.dumps(v)}" for k, v in settings.items())

"""Configurations: planners, speed laws and crowds of a study file, every grid of settings unfolded.

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
from lampyris.io.scenario.map_source import Mistakes
from lampyris.io.scenario.validation_errors import Document, spot
from lampyris.io.text.strict_yaml import Where, shown
from lampyris.motion.laws import registry as laws
from lampyris.planning import registry
from lampyris.planning.selection import demand_cells
from lampyris.study.design import schema as form
from lampyris.study.design.study import Config, StudyTraffic, canonical

T = TypeVar("T")
MAX_WHO = 10_000
"""Planners of a study, each with its settings; the same for speed laws and for crowds."""
Made: TypeAlias = list[tuple[T, Where]]
"""What came of a list of the file, each with the way to where it is said."""


class Tried:
    """Makes what a file says, and keeps what is wrong with it, at its place.

    Parameters
    ----------
    said : the file.
    """

    def __init__(self, said: Document) -> None:
        self.said = said
        self.faults = Mistakes(said)

    def __call__(self, way: Where, make: Callable[..., T], *given: Any) -> T | None:
        """What ``make(*given)`` makes; None, with the mistake kept, if it cannot."""
        try:
            return make(*given)
        except LampyrisError as fault:
            self.refuse(way, fault)
        return None

    def refuse(self, way: Where, fault: LampyrisError) -> None:
        """Keep a mistake."""
        self.faults.keep(way, fault)

    def count(self, way: Where, many: int, what: str) -> bool:
        """Whether so many may be; a mistake is kept if not."""
        if many > MAX_WHO:
            self.refuse(way, LimitError("LIMIT", f"{many:,} {what}", allowed=f"at most {MAX_WHO:,}"))
        return many <= MAX_WHO

    def each_once(self, made: Made[T], key: Callable[[T], object], code: str, what: str) -> None:
        """Keep a mistake for whatever is there a second time."""
        first: dict[object, Where] = {}
        for one, way in made:
            mark = key(one)
            if mark in first:
                self.faults.keep(way, partial(self._second, way, first[mark], code, what))
            first.setdefault(mark, way)

    def _second(self, way: Where, first: Where, code: str, what: str) -> LampyrisError:
        where = "" if first == way else f"; the first is at {spot(self.said, first)}"
        return FileError(code, what, todo=f"take one away{where}")


@dataclass(frozen=True)
class _Entry:
    """A planner or a law as a file has it; ``swept`` holds the settings that it takes several values of."""

    way: Where
    name: str
    settings: Mapping[str, Any] = field(default_factory=dict)
    swept: Mapping[str, list[Any]] = field(default_factory=dict)
    label: str | None = None

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


def planners_of(given: Any, tried: Tried) -> Made[Config]:
    """The planners of a study file, each once; what is wrong is kept by ``tried``."""
    entries = []
    listed = given if isinstance(given, list) else [given]
    for k, one in enumerate(listed):
        way: Where = ("planners", k) if isinstance(given, list) else ("planners",)
        if one == "all" or isinstance(one, form.AllTable):
            left_out = [] if one == "all" else one.all.except_
            for j, name in enumerate(left_out):
                tried((*way, "all", "except", j), registry.demand_name, name)
            entries += [_Entry(way, name) for name in registry.names() if name not in left_out]
        else:
            entries.append(_entry(one, way))
    return _unfolded(entries, planner_who, "planners", tried)


def laws_of(given: list[Any] | None, default: str, tried: Tried) -> Made[Config]:
    """The speed laws of a study file, each once; what is wrong is kept by ``tried``."""
    if given is None:
        return [(law_who(default, {}, default), ("laws",))]
    entries = [_entry(one, ("laws", k)) for k, one in enumerate(given)]
    return _unfolded(entries, law_who, "laws", tried)


def crowds_of(given: list[Any], tried: Tried) -> Made[StudyTraffic]:
    """The crowds of a study file, each once; what is wrong is kept by ``tried``."""
    tables = [
        (way, {} if isinstance(one, str) or one.grid is None else one.grid.model_dump(exclude_none=True), one)
        for k, one in enumerate(given)
        if (way := ("traffic", k))
    ]
    many = sum(prod(len(v) for v in swept.values()) for _, swept, _ in tables)
    if not tried.count(("traffic",), many, "crowds"):
        return []
    made: Made[StudyTraffic] = []
    for way, swept, one in tables:
        for values in product(*swept.values()):
            crowd = tried(way, _crowd, one, dict(zip(swept, values, strict=True)))
            if crowd is not None:
                made.append((crowd, way))
    tried.each_once(made, lambda c: canonical(c.plain), "DUPLICATE", "the same obstacles a second time")
    return made


def _entry(one: Any, way: Where) -> _Entry:
    if isinstance(one, str):
        return _Entry(way, one)
    return _Entry(way, one.name, one.settings, one.grid or {}, one.label)


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
            tried.refuse((*entry.way, "grid", both[0]), fault)
            continue
        way = (*entry.way, "grid") if entry.swept else entry.way
        for settings, label in entry.each():
            who = tried(way, make, entry.name, settings, label)
            if who is not None:
                made.append((who, way))
    if not made and not tried.faults:
        tried.refuse((key,), FileError(key.upper(), f"no {key} are left", allowed="one or more"))
    same = "the same settings a second time"
    tried.each_once(made, lambda w: canonical([w.name, dict(w.settings), w.origin]), "DUPLICATE", same)
    if not tried.faults:
        tried.each_once(made, lambda w: w.called, "LABEL", "the same label for other settings")
    return made


def planner_who(name: str, settings: Mapping[str, Any], label: str) -> Config:
    """A planner with every setting that it has."""
    made = registry.make(name, settings)
    demand_cells(made, "a study")
    known = registry.settings_of(type(made))
    full = {key: _like(default, getattr(made, key)) for key, default in known.items()}
    return Config(name, _plain(full, name), "" if label == name else label, registry.origin_of(name))


def law_who(name: str, settings: Mapping[str, Any], label: str) -> Config:
    """A speed law with every setting that it has."""
    full = laws.settings_of(laws.with_settings(name, settings))
    known = laws.settings_of(name)
    full = {key: _like(known.get(key), value) for key, value in full.items()}
    return Config(name, _plain(full, name), "" if label == name else label)


def _crowd(one: Any, some: Mapping[str, Any]) -> StudyTraffic:
    if isinstance(one, str):
        return StudyTraffic()
    given = {**one.model_dump(exclude={"grid"}), **some}
    if given["kind"] == "none":
        return StudyTraffic()
    if given["count"] is None:
        raise FileError("KEY", "`count` is missing", allowed="how many")
    if given["rate"] is not None and given["kind"] not in ("random-walk", "mixed"):
        raise FileError("TRAFFIC_RATE", f"a rate with {given['kind']}", allowed="random walkers")
    return StudyTraffic(**given) if given["count"] else StudyTraffic()


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

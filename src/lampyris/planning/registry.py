"""Planners by name: those of this package (:mod:`.built_in`), and those that others register as entry points."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import MISSING, dataclass, fields, is_dataclass
from functools import cache
from pkgutil import resolve_name
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Generic, Literal, NamedTuple, TypeVar, cast, overload
from weakref import WeakKeyDictionary

from lampyris._core.cancellation import uninterrupted
from lampyris.errors import InputError, UnknownSettingError, UsageError, did_you_mean, shown
from lampyris.planning import built_in
from lampyris.planning.base import FleetTraits, Planner, Traits

if TYPE_CHECKING:
    from importlib.metadata import Distribution, EntryPoint

GROUP = "lampyris.planners"
"""Entry points of planners on cells: any verb takes them."""
POSE_GROUP = "lampyris.pose_planners"
"""Entry points of planners of poses, for robots with a shape and a heading: for ``plan`` alone."""
FLEET_GROUP = "lampyris.fleet_planners"
"""Entry points of planners of fleets, for many robots on one map: for ``fleet`` and studies of fleets."""
GROUPS = MappingProxyType({"cells": GROUP, "poses": POSE_GROUP, "fleets": FLEET_GROUP})
"""Groups of entry points by kind of planner."""
_OURS = MappingProxyType({GROUP: built_in.CELLS, POSE_GROUP: built_in.POSES, FLEET_GROUP: built_in.FLEETS})
_OF_SCENES = ("cells", "poses")
LONGEST_TITLE = 40
"""Characters of a planner's title at most: a longer beginning of a summary is no name."""
_T = TypeVar("_T", Traits, FleetTraits)


class _Ours(NamedTuple):
    """What stands for the entry point of a planner of this package."""

    name: str
    value: str
    group: str

    @property
    def dist(self) -> Distribution | None:
        """No other package."""
        return None

    def load(self) -> Any:
        """The planner's class."""
        return resolve_name(self.value)


_CLASSES: dict[EntryPoint | _Ours, type[Any]] = {}
"""Classes of entry points that have been loaded."""
_SETTINGS: WeakKeyDictionary[type[Any], Mapping[str, Any]] = WeakKeyDictionary()
"""Settings of planners that were asked for, with their defaults."""


class PlannerLeftOut(RuntimeWarning):
    """An installed planner that cannot be used was left out of a list."""

    for_people = True


@dataclass(frozen=True, slots=True)
class PlannerInfo(Generic[_T]):
    """One row of the table of planners. ``settings`` maps each setting to its default."""

    name: str
    summary: str
    source: str
    traits: _T
    settings: Mapping[str, Any]

    @property
    def title(self) -> str:
        """What it is called where people read; see :func:`title_of`."""
        return _title(self.name, self.summary)


@cache
def _entries(group: str = GROUP) -> Mapping[str, EntryPoint | _Ours]:
    from importlib.metadata import entry_points  # imports the email package

    found: dict[str, EntryPoint | _Ours] = {e.name: e for e in entry_points(group=group)}
    found |= {name: _Ours(name, value, group) for name, value in _OURS[group].items()}
    return MappingProxyType(dict(sorted(found.items())))


def names() -> tuple[str, ...]:
    """The names of all planners on cells that are registered, sorted; a third-party one may fail to load."""
    return tuple(_entries())


def pose_names() -> tuple[str, ...]:
    """The names of all planners of poses, sorted."""
    return tuple(_entries(POSE_GROUP))


def plans_poses(name: str) -> bool:
    """Whether a planner is one of poses; False, too, if nobody has registered the name."""
    return name in built_in.POSES or (name not in built_in.CELLS and name in pose_names())


def demand_name(name: str) -> None:
    """See that a planner of that name is registered, without loading it.

    Raises
    ------
    UsageError : nobody has registered that name.
    """
    _entry(name, _OF_SCENES)


def fleet_names() -> tuple[str, ...]:
    """The names of all planners of fleets, sorted."""
    return tuple(_entries(FLEET_GROUP))


def _entry(name: str, kinds: tuple[str, ...]) -> EntryPoint | _Ours:
    for kind in kinds:
        try:
            return _Ours(name, _OURS[GROUPS[kind]][name], GROUPS[kind])
        except (KeyError, TypeError):
            continue
    for kind in kinds:
        try:
            return _entries(GROUPS[kind])[name]
        except (KeyError, TypeError):
            continue
    known = tuple(one for kind in kinds for one in _entries(GROUPS[kind]))
    what = "planner of fleets" if kinds == ("fleets",) else "planner"
    raise UsageError(
        "PLANNER",
        f"no {what} is called {shown(name)}",
        allowed=", ".join(known),
        todo=did_you_mean(name, known),
        setting="planner",
    )


def planner_class(name: str) -> type[Planner]:
    """The planner of that name, on cells or of poses.

    Raises
    ------
    UsageError : nobody has registered that name.
    InputError : PLANNER_BROKEN: its package fails to import, or does not hold a planner.
    """
    return cast(type[Planner], any_class(name, _OF_SCENES))


def any_class(name: str, kinds: tuple[str, ...] = tuple(GROUPS)) -> type[Any]:
    """The planner of that name of some kinds; see :func:`planner_class`."""
    entry = _entry(name, kinds)
    if entry in _CLASSES:
        return _CLASSES[entry]
    try:
        with uninterrupted():
            loaded: Any = entry.load()
    except (Exception, SystemExit) as fault:
        if not origin_of(name):
            raise
        raise _broken(entry, f"its import fails: {type(fault).__name__}: {fault}") from fault
    called = "plan" if entry.group == FLEET_GROUP else "open"
    lacks = [word for word in ("name", "summary", "source", "traits", called) if not hasattr(loaded, word)]
    if not isinstance(loaded, type) or not is_dataclass(loaded) or lacks:
        what = f"it has no {', '.join(lacks)}" if lacks else "it is no dataclass"
        raise _broken(entry, f"{entry.value} is no planner: {what}")
    _CLASSES[entry] = loaded
    return cast(type[Any], loaded)


def _broken(entry: EntryPoint | _Ours, what: str) -> InputError:
    """The error for a third-party planner that cannot be used; it names the package that has to be repaired."""
    package = origin_of(entry.name) or "lampyris"
    return InputError(
        "PLANNER_BROKEN",
        what,
        where=f"planner {entry.name} of the installed package {package}",
        todo="repair or uninstall that package",
    )


def title_of(name: str) -> str:
    """What a planner is called where people read: the words of its summary before the colon, such as ``A*`` of ``astar``.

    Without a colon, and if nobody has registered the name, the name itself.
    """
    try:
        _entry(name, tuple(GROUPS))
    except UsageError:
        return name
    return _title(name, any_class(name).summary)


def _title(name: str, summary: str) -> str:
    title, colon, _ = summary.partition(": ")
    return title if colon and len(title) <= LONGEST_TITLE else name


def kind_of(name: str) -> str:
    """The kind of a planner: ``cells``, ``poses`` or ``fleets``.

    Raises
    ------
    UsageError : nobody has registered that name.
    """
    group = _entry(name, tuple(GROUPS)).group
    return next(kind for kind, one in GROUPS.items() if one == group)


@cache
def origin_of(name: str) -> str:
    """The distribution and its version that a third-party planner comes from; empty for our own.

    Raises
    ------
    UsageError : nobody has registered that name.
    """
    dist = _entry(name, tuple(GROUPS)).dist
    if dist is None or dist.name == "lampyris":
        return ""
    return f"{dist.name} {dist.version}"


def settings_of(kind: type[Any]) -> Mapping[str, Any]:
    """Each setting of a planner with its default."""
    found = _SETTINGS.get(kind)
    if found is None:
        found = _SETTINGS[kind] = _settings_of(kind)
    return found


def _settings_of(kind: type[Any]) -> Mapping[str, Any]:
    found = {f.name: f.default if f.default is not MISSING else None for f in fields(kind) if f.init}
    return MappingProxyType(found)


def make(name: str, settings: Mapping[str, Any] | None = None) -> Planner:
    """A planner of that name with these settings, on cells or of poses.

    Raises
    ------
    UsageError : no such planner.
    SettingError : a setting it does not have, or a value out of its range.
    """
    return cast(Planner, configured(planner_class(name), settings))


_AS_THEY_ARE: dict[type[Any], Any] = {}
"""Our own planners without settings of the caller's."""


def configured(kind: type[Any], settings: Mapping[str, Any] | None) -> Any:
    """A planner of this class with these settings; see :func:`make`."""
    if not settings and kind.__module__.startswith("lampyris."):
        if kind not in _AS_THEY_ARE:
            _AS_THEY_ARE[kind] = kind()
        return _AS_THEY_ARE[kind]  # frozen settings: one will do for all
    name, known = kind.name, settings_of(kind)
    for key in settings or {}:
        if key not in known:
            raise UnknownSettingError(
                "SETTING",
                f"{name} has no setting {shown(key)}",
                allowed=", ".join(known) or "none: it has no settings",
                todo=did_you_mean(key, known, cutoff=0.5),  # names are short: nq, nt
                setting=str(key),
            )
    return kind(**(settings or {}))


def row_of(name: str) -> PlannerInfo[Any]:
    """One row of the table, of a planner of any kind.

    Raises
    ------
    UsageError, InputError : as of :func:`planner_class`.
    """
    kind = any_class(name)
    return PlannerInfo(name, kind.summary, kind.source, kind.traits, settings_of(kind))


@overload
def list_planners(kind: Literal["cells", "poses"] = ...) -> Mapping[str, PlannerInfo[Traits]]: ...


@overload
def list_planners(kind: Literal["fleets"]) -> Mapping[str, PlannerInfo[FleetTraits]]: ...


def list_planners(kind: str = "cells") -> Mapping[str, PlannerInfo[Any]]:
    """Every planner of a kind with its traits, settings and source, by name.

    A third-party planner that cannot be used is omitted, with a warning :class:`PlannerLeftOut` that states the reason.

    Parameters
    ----------
    kind : ``cells``; ``poses``, which :func:`lampyris.plan` alone takes; ``fleets``, for :func:`lampyris.plan_fleet`.

    Raises
    ------
    UsageError : ``KIND``: no such kind.

    Examples
    --------
    >>> import lampyris
    >>> lampyris.list_planners()["astar"].traits.optimal
    True
    >>> sorted(lampyris.list_planners("poses"))[:3]
    ['hybrid-astar', 'lattice', 'lattice-sipp']
    """
    if not isinstance(kind, str) or kind not in GROUPS:
        raise UsageError("KIND", f"kind {shown(kind)}", allowed=", ".join(GROUPS))
    rows = {}
    for name in _entries(GROUPS[kind]):
        try:
            rows[name] = row_of(name)
        except InputError as fault:
            warnings.warn(PlannerLeftOut(str(fault)), stacklevel=2)
    return MappingProxyType(rows)

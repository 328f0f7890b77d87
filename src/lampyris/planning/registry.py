"""Planners by name, found by entry point: built-in and third-party alike."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import MISSING, dataclass, fields, is_dataclass
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from types import MappingProxyType
from typing import Any, cast

from lampyris._core.cancellation import uninterrupted
from lampyris.errors import InputError, UnknownSettingError, UsageError, did_you_mean, of_kind, shown
from lampyris.planning.base import Planner, Traits

GROUP = "lampyris.planners"
"""Entry points of planners on cells: any verb takes them."""
POSE_GROUP = "lampyris.pose_planners"
"""Entry points of planners of poses, for robots with a shape and a heading: for ``plan`` alone."""


class PlannerLeftOut(RuntimeWarning):
    """An installed planner that cannot be used was left out of a list."""

    for_people = True


@dataclass(frozen=True, slots=True)
class PlannerInfo:
    """One row of the table of planners. ``settings`` maps each setting to its default."""

    name: str
    summary: str
    source: str
    traits: Traits
    settings: Mapping[str, Any]


@cache
def _entries(group: str = GROUP) -> Mapping[str, EntryPoint]:
    found = {e.name: e for e in sorted(entry_points(group=group), key=lambda e: e.name)}
    return MappingProxyType(found)


def names() -> tuple[str, ...]:
    """The names of all planners on cells that are registered, sorted; a third-party one may fail to load."""
    return tuple(_entries())


def pose_names() -> tuple[str, ...]:
    """The names of all planners of poses, sorted."""
    return tuple(_entries(POSE_GROUP))


def demand_name(name: str) -> None:
    """See that a planner of that name is registered, without loading it.

    Raises
    ------
    UsageError : nobody has registered that name.
    """
    _entry(name)


def _entry(name: str) -> EntryPoint:
    for group in (GROUP, POSE_GROUP):
        try:
            return _entries(group)[name]
        except (KeyError, TypeError):
            continue
    known = (*names(), *pose_names())
    raise UsageError(
        "PLANNER",
        f"no planner is called {shown(name)}",
        allowed=", ".join(known),
        todo=did_you_mean(name, known),
        setting="planner",
    )


def planner_class(name: str) -> type[Planner]:
    """The planner of that name.

    Raises
    ------
    UsageError : nobody has registered that name.
    InputError : PLANNER_BROKEN: its package fails to import, or does not hold a planner.
    """
    entry = _entry(name)
    try:
        with uninterrupted():
            loaded: Any = entry.load()
    except (Exception, SystemExit) as fault:
        if not origin_of(name):
            raise
        raise _broken(entry, f"its import fails: {type(fault).__name__}: {fault}") from fault
    lacks = [word for word in ("name", "summary", "source", "traits", "open") if not hasattr(loaded, word)]
    if not isinstance(loaded, type) or not is_dataclass(loaded) or lacks:
        what = f"it has no {', '.join(lacks)}" if lacks else "it is no dataclass"
        raise _broken(entry, f"{entry.value} is no planner: {what}")
    return cast(type[Planner], loaded)


def _broken(entry: EntryPoint, what: str) -> InputError:
    """The error for a third-party planner that cannot be used; it names the package that has to be repaired."""
    package = origin_of(entry.name) or "lampyris"
    return InputError(
        "PLANNER_BROKEN",
        what,
        where=f"planner {entry.name} of the installed package {package}",
        todo="repair or uninstall that package",
    )


@cache
def origin_of(name: str) -> str:
    """The distribution and its version that a third-party planner comes from; empty for our own.

    Raises
    ------
    UsageError : nobody has registered that name.
    """
    dist = _entry(name).dist
    if dist is None or dist.name == "lampyris":
        return ""
    return f"{dist.name} {dist.version}"


def settings_of(kind: type[Planner]) -> Mapping[str, Any]:
    """Each setting of a planner with its default."""
    return {
        f.name: f.default if f.default is not MISSING else None
        for f in fields(kind)  # type: ignore[arg-type]
        if f.init
    }


def make(name: str, settings: Mapping[str, Any] | None = None) -> Planner:
    """A planner of that name with these settings.

    Raises
    ------
    UsageError : no such planner.
    SettingError : a setting it does not have, or a value out of its range.
    """
    kind = planner_class(name)
    known = settings_of(kind)
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


def row_of(name: str) -> PlannerInfo:
    """One row of the table.

    Raises
    ------
    UsageError, InputError : as of :func:`planner_class`.
    """
    kind = planner_class(name)
    return PlannerInfo(name, kind.summary, kind.source, kind.traits, settings_of(kind))


def list_planners(*, poses: bool = False) -> Mapping[str, PlannerInfo]:
    """Every planner on cells with its traits, settings and source, by name.

    Parameters
    ----------
    poses : the planners of poses instead, which :func:`lampyris.plan` alone takes.

    A third-party planner that cannot be used is left out, with a :class:`PlannerLeftOut` that says why.
    """
    of_kind("poses", poses, bool)
    rows = {}
    for name in pose_names() if poses else names():
        try:
            rows[name] = row_of(name)
        except InputError as fault:
            warnings.warn(PlannerLeftOut(str(fault)), stacklevel=2)
    return MappingProxyType(rows)

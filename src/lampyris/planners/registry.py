"""Planners by name, found by entry point: built-ins and guests alike."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING, dataclass, fields
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from types import MappingProxyType
from typing import Any

from lampyris.errors import SettingError, UsageError, did_you_mean
from lampyris.planners.base import Planner, Traits

GROUP = "lampyris.planners"


@dataclass(frozen=True, slots=True)
class PlannerInfo:
    """One row of the table of planners. ``settings`` maps each setting to its default."""

    name: str
    summary: str
    source: str
    traits: Traits
    settings: Mapping[str, Any]


@cache
def _entries() -> Mapping[str, EntryPoint]:
    found = {e.name: e for e in sorted(entry_points(group=GROUP), key=lambda e: e.name)}
    return MappingProxyType(found)


def names() -> tuple[str, ...]:
    """The names of all planners, sorted."""
    return tuple(_entries())


def planner_class(name: str) -> type[Planner]:
    """The planner of that name.

    Raises
    ------
    UsageError : nobody has registered that name.
    """
    try:
        entry = _entries()[name]
    except (KeyError, TypeError):
        raise UsageError(
            "PLANNER",
            f"no planner is called {name!r}",
            allowed=", ".join(names()),
            todo=did_you_mean(name, names()),
        ) from None
    loaded: type[Planner] = entry.load()
    return loaded


@cache
def origin_of(name: str) -> str:
    """The distribution and its version that a planner of a guest comes from; empty for our own.

    Raises
    ------
    UsageError : nobody has registered that name.
    """
    planner_class(name)
    dist = _entries()[name].dist
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
            raise SettingError(
                "SETTING",
                f"{name} has no setting {key!r}",
                allowed=", ".join(known) or "none: it has no settings",
                todo=did_you_mean(key, known, cutoff=0.5),  # names are short: nq, nt
            )
    return kind(**(settings or {}))


def table() -> Mapping[str, PlannerInfo]:
    """Every planner with its traits, settings and source, by name."""
    rows = {}
    for name in names():
        kind = planner_class(name)
        rows[name] = PlannerInfo(name, kind.summary, kind.source, kind.traits, settings_of(kind))
    return MappingProxyType(rows)

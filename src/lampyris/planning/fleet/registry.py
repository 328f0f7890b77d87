"""Planners of fleets by name."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

from lampyris._core.settings import defaults_of
from lampyris.errors import SettingError, UnknownSettingError, UsageError, did_you_mean, shown
from lampyris.planning.fleet.base import FleetPlanner, FleetTraits
from lampyris.planning.fleet.cbs import Cbs
from lampyris.planning.fleet.eecbs import Eecbs
from lampyris.planning.fleet.lacam import Lacam
from lampyris.planning.fleet.lns import Lns
from lampyris.planning.fleet.pibt import Pibt
from lampyris.planning.fleet.prioritised import PrioritisedSipp

_KINDS: Mapping[str, type[Any]] = MappingProxyType(
    {kind.name: kind for kind in (Lacam, Lns, Pibt, PrioritisedSipp, Cbs, Eecbs)}
)


@dataclass(frozen=True, slots=True)
class FleetPlannerInfo:
    """One row of the table of planners of fleets. ``settings`` maps each setting to its default."""

    name: str
    summary: str
    source: str
    traits: FleetTraits
    settings: Mapping[str, Any]


def names() -> tuple[str, ...]:
    """The names of all planners of fleets."""
    return tuple(_KINDS)


def planner_class(name: str) -> type[Any]:
    """The planner of that name.

    Raises
    ------
    UsageError : ``PLANNER``: there is none.
    """
    kind = _KINDS.get(name) if isinstance(name, str) else None
    if kind is None:
        raise UsageError(
            "PLANNER", f"no planner of fleets is called {shown(name)}", allowed=", ".join(_KINDS),
            todo=did_you_mean(name, _KINDS), setting="planner",
        )  # fmt: skip
    return kind


def make(name: str, settings: Mapping[str, Any] | None = None) -> FleetPlanner:
    """A planner of that name with these settings.

    Raises
    ------
    UsageError : no such planner.
    SettingError : a setting it does not have, or a value out of its range.
    """
    kind = planner_class(name)
    known = defaults_of(kind)
    for key in settings or {}:
        if key not in known:
            raise UnknownSettingError(
                "SETTING", f"{name} has no setting {shown(key)}", allowed=", ".join(known),
                todo=did_you_mean(key, known, cutoff=0.5), setting=str(key),
            )  # fmt: skip
    made: FleetPlanner = kind(**(settings or {}))
    return made


def chosen(planner: object, settings: Mapping[str, Any]) -> FleetPlanner:
    """The planner that a call asks for: a name with settings, or a planner.

    Raises
    ------
    UsageError, SettingError : as of :func:`make`; ``PLANNER``: no planner; settings beside a planner object.
    """
    if isinstance(planner, str):
        return make(planner, settings)
    if isinstance(planner, type) or not isinstance(planner, FleetPlanner):
        allowed = "a name, or an object with name, traits and plan"
        raise SettingError("PLANNER", f"{shown(planner)} is no planner of fleets", allowed=allowed)
    if settings:
        what = f"settings {sorted(settings)} beside a planner object"
        raise SettingError("SETTING", what, allowed="settings inside the object")
    return planner


def list_fleet_planners() -> Mapping[str, FleetPlannerInfo]:
    """Every planner of fleets with its traits, settings and source, by name."""
    return MappingProxyType(
        {
            name: FleetPlannerInfo(name, kind.summary, kind.source, kind.traits, defaults_of(kind))
            for name, kind in _KINDS.items()
        }
    )

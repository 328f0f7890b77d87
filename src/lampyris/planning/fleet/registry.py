"""Planners of fleets by name: those of this package, and those that others register as entry points."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from lampyris.errors import SettingError, shown
from lampyris.planning import registry
from lampyris.planning.fleet.base import FleetPlanner, FleetTraits
from lampyris.planning.registry import PlannerInfo, list_planners

_KINDS = ("fleets",)


def names() -> tuple[str, ...]:
    """The names of all planners of fleets, sorted."""
    return registry.fleet_names()


def demand_name(name: str) -> None:
    """See that there is a planner of that name.

    Raises
    ------
    UsageError : ``PLANNER``: there is none.
    """
    planner_class(name)


def planner_class(name: str) -> type[Any]:
    """The planner of that name.

    Raises
    ------
    UsageError : ``PLANNER``: there is none.
    InputError : ``PLANNER_BROKEN``: its package fails to import, or does not hold a planner of fleets.
    """
    return registry.any_class(name, _KINDS)


def make(name: str, settings: Mapping[str, Any] | None = None) -> FleetPlanner:
    """A planner of that name with these settings.

    Raises
    ------
    UsageError : no such planner.
    SettingError : a setting it does not have, or a value out of its range.
    """
    made: FleetPlanner = registry.configured(planner_class(name), settings)
    return made


def chosen(planner: object, settings: Mapping[str, Any]) -> FleetPlanner:
    """The planner that a call asks for: a name with settings, or a planner.

    Raises
    ------
    UsageError, SettingError : as of :func:`make`; ``PLANNER``: no planner; settings together with a planner object.
    """
    if isinstance(planner, str):
        return make(planner, settings)
    if isinstance(planner, type) or not isinstance(planner, FleetPlanner):
        allowed = "a name, or an object with name, traits and plan"
        raise SettingError("PLANNER", f"{shown(planner)} is no planner of fleets", allowed=allowed)
    if settings:
        what = f"settings {sorted(settings)} together with a planner object"
        raise SettingError("SETTING", what, allowed="settings inside the object")
    return planner


def list_fleet_planners() -> Mapping[str, PlannerInfo[FleetTraits]]:
    """Every planner of fleets with its traits, settings and source, by name."""
    return list_planners("fleets")

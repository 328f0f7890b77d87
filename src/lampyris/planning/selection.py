"""Who plans: a name with settings, or a planner; and settings that are called as an argument is."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable, Mapping
from functools import cache
from typing import Any

from lampyris.errors import SettingError, UsageError, shown
from lampyris.planning import registry
from lampyris.planning.base import Planner


def chosen_planner(
    verb: Callable[..., Any],
    planner: object,
    planner_settings: object,
    settings: Mapping[str, Any],
    /,
    **own: Any,
) -> Planner:
    """The planner that a call of a public function asks for.

    Parameters
    ----------
    verb : the function.
    planner, planner_settings : its arguments of these names.
    settings : its other keywords, which are the planner's settings.
    own : its own arguments that have a default, and keywords that it takes itself, by name. A planner's
        setting may be called as one of these is.

    Raises
    ------
    UsageError : no such planner; ``SETTING_CLASH``: an argument that was given and that is called as one of
        the planner's settings is, without ``planner_settings``; a setting in both.
    SettingError : ``PLANNER``: no planner; settings together with a planner object; a setting it does not have.
    """
    inner = planner_settings
    if inner is not None and not (isinstance(inner, Mapping) and all(isinstance(key, str) for key in inner)):
        raise SettingError("TYPE", shown(inner), where="planner_settings", allowed="settings by name")
    if isinstance(planner, str):
        options = _options_given(verb, own) if inner is None else []
        if options:
            known = registry.settings_of(registry.planner_class(planner))
            _refuse_clash(verb.__name__, planner, known, options)
        for name in settings.keys() & (inner or {}).keys():
            raise UsageError("SETTING_CLASH", f"{name} is set twice", where=name, allowed="once")
        return registry.make(planner, {**settings, **(inner or {})})
    if isinstance(planner, type) or not isinstance(planner, Planner):
        raise SettingError(
            "PLANNER",
            f"{shown(planner)} is no planner",
            allowed="a name, or an object with name, traits and open",
        )
    if settings or inner:
        raise SettingError(
            "SETTING",
            f"settings {sorted({**settings, **(inner or {})})} together with a planner object",
            allowed="settings inside the object",
        )
    return planner


def demand_cells(planner: Planner, doing: str) -> None:
    """Refuse a planner of poses where cells are driven.

    Raises
    ------
    UsageError : ``PLANNER``.
    """
    if planner.traits.plans_headings:
        raise UsageError(
            "PLANNER",
            f"{planner.name} plans poses; {doing} needs a path of cells",
            allowed="a planner on cells, such as astar",
            todo="`lampyris plan`, `drive`, `speed` and `compare` take planners of poses",
            setting="planner",
        )


def plans_times(planner: Planner) -> bool:
    """Whether a planner of poses plans when the robot is at each."""
    return planner.traits.plans_headings and planner.traits.sees_traffic


def _options_given(verb: Callable[..., Any], own: Mapping[str, Any]) -> list[str]:
    """Names of the function's own arguments that were given another value than they have by themselves."""
    defaults = _defaults(verb)
    return [
        name
        for name, value in own.items()
        if name not in defaults or not (value is defaults[name] or _equal(value, defaults[name]))
    ]


@cache
def _defaults(verb: Callable[..., Any]) -> Mapping[str, Any]:
    """The function's arguments that have a default, with it."""
    named = inspect.signature(verb).parameters.values()
    return {p.name: p.default for p in named if p.default is not p.empty}


def _equal(value: Any, default: Any) -> bool:
    return isinstance(value, int | str) and type(value) is type(default) and bool(value == default)


def _refuse_clash(verb: str, planner: str, known: Iterable[str], options: Iterable[str]) -> None:
    for name in options:
        if name in known:
            raise UsageError(
                "SETTING_CLASH",
                f"{name} is an argument of {verb} and a setting of {planner}",
                where=name,
                todo=f'planner_settings={{"{name}": ...}} sets the planner\'s; with planner_settings={{}} '
                f"beside it {name} is that of {verb}",
            )

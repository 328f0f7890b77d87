"""Options that belong together, as dataclasses: a verb takes a group where it would take each option.

:func:`with_groups` makes of such a function one whose signature has every option by itself, which Typer reads.
Options of the robot, of a simulation and of a drive are derived from the declared settings
(:mod:`lampyris._core.settings`): names, types, defaults, units, choices and help. Those groups are made when a verb
asks for them.
"""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable, Mapping
from dataclasses import MISSING, dataclass, fields, is_dataclass, make_dataclass
from dataclasses import field as dataclass_field
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias, get_type_hints

import typer

from lampyris._core import defaults
from lampyris._core.settings import Setting, defaults_of, meanings_of, settings_of
from lampyris.cli import options

SENSOR = ("sensor_range", "field_of_view", "unseen_cost")
"""Settings of a simulation that make the sensor."""
_TYPES = {"number": float, "whole": int, "word": str, "flag": bool}


@dataclass(frozen=True)
class _MapOptions:
    """Which map, and how its file is read."""

    map_: options.Map
    resolution: options.Resolution = None
    values: options.Values = defaults.VALUES
    colour: options.Colour = defaults.COLOUR
    allow_outside: options.AllowOutside = False
    max_cells: options.MaxCells = None


@dataclass(frozen=True)
class EndOptions:
    """From where to where, in cells or in metres."""

    start: options.Start = None
    goal: options.Goal = None
    start_m: options.StartM = None
    goal_m: options.GoalM = None


@dataclass(frozen=True)
class ViaOptions:
    """What is passed between the ends, in cells or in metres, and in which order."""

    via: options.Via = None
    via_m: options.ViaM = None
    via_order: options.ViaOrder = defaults.VIA_ORDER


@dataclass(frozen=True)
class PlannerOptions:
    """Which planner, and its settings as they were typed."""

    planner: options.Planner = defaults.PLANNER
    settings: options.Set = None


@dataclass(frozen=True)
class RuleOptions:
    """Moves, speed law and seed."""

    preset: options.Preset = defaults.PRESET
    moves: options.Moves = None
    seed: options.Seed = 0


@dataclass(frozen=True)
class LawOptions:
    """Which speed law, its settings as they were typed, and speed zones."""

    law: options.Law = None
    set_law: options.SetLaw = None
    zones: options.Zones = None
    keepout: options.Keepout = None


@dataclass(frozen=True)
class TrafficOptions:
    """What moves besides the robot."""

    obstacles: options.Obstacles = 10
    mobility: options.Mobility = defaults.MOBILITY
    rate: options.Rate = None
    obstacle_radius: options.ObstacleRadius = 0.0
    obstacle_rectangle: options.ObstacleRectangle = None
    track: options.Track = None

    @property
    def tracks(self) -> tuple[Path, ...]:
        """Files of recorded obstacles."""
        return tuple(self.track or ())


def option_of(name: str, setting: Setting, meaning: str) -> Any:
    """The annotation of an option for a declared setting."""
    text = meaning.partition(". ")[0].rstrip(".")
    text = text[0].upper() + text[1:]
    if setting.none:
        text += f" (default: {setting.none})"
    unit = setting.unit.upper() or ("N" if setting.kind == "whole" else "NUMBER")
    option = typer.Option(
        f"--{name.replace('_', '-')}", metavar="|".join(setting.words) or unit, help=f"{text}."
    )
    kind = _TYPES[setting.kind]
    return Annotated[kind | None if setting.none else kind, option]


def group_of(
    name: str,
    kind: type,
    first: tuple[Any, ...] = (),
    base: type = object,
    only: tuple[str, ...] | None = None,
) -> type:
    """A group with an option for every declared setting of a dataclass.

    Parameters
    ----------
    name : of the group.
    kind : dataclass whose fields are declared by :mod:`lampyris._core.settings`.
    first : options that come before them, as for :func:`dataclasses.make_dataclass`.
    base : a group whose options come before them too.
    only : which settings; None: all.
    """
    meanings, usual = meanings_of(kind), defaults_of(kind)
    made = [
        (key, option_of(key, setting, meanings.get(key, key)), dataclass_field(default=usual[key]))
        for key, setting in settings_of(kind).items()
        if only is None or key in only
    ]
    return make_dataclass(name, [*first, *made], bases=(base,), frozen=True, repr=False, eq=False)


if TYPE_CHECKING:
    MapOptions: TypeAlias = Any
    RobotOptions: TypeAlias = Any
    DriveOptions: TypeAlias = Any
    SimulationOptions: TypeAlias = Any
    SensorOptions: TypeAlias = Any
    Ticks: TypeAlias = int | None


def _robot_options() -> type:
    from lampyris.model.robot import Robot

    return group_of(
        "RobotOptions", Robot, (("robot_file", options.RobotFile, dataclass_field(default=None)),)
    )


def _map_options() -> type:
    from lampyris.model.settings.inflation import Inflation

    return group_of("MapOptions", Inflation, base=_MapOptions)


def _drive_options() -> type:
    from lampyris.model.settings.drive import DriveSettings

    first = (("set_controller", options.SetController, dataclass_field(default=None)),)
    return group_of("DriveOptions", DriveSettings, first)


def _simulation_options() -> type:
    from lampyris.model.settings.simulation import SimulationSettings

    return group_of("SimulationOptions", SimulationSettings)


def _sensor_options() -> type:
    from lampyris.model.settings.simulation import SimulationSettings

    return group_of("SensorOptions", SimulationSettings, only=SENSOR)


def _ticks() -> Any:
    return get_type_hints(__getattr__("SimulationOptions"), include_extras=True)["ticks"]


_ON_DEMAND: Mapping[str, Callable[[], Any]] = MappingProxyType(
    {
        "RobotOptions": _robot_options,
        "MapOptions": _map_options,
        "DriveOptions": _drive_options,
        "SimulationOptions": _simulation_options,
        "SensorOptions": _sensor_options,
        "Ticks": _ticks,
    }
)
"""How each group of declared settings is made: a verb needs two of them, and making all took a fortieth of a small plan."""


def __getattr__(name: str) -> Any:
    if name not in _ON_DEMAND:
        raise AttributeError(f"module 'lampyris.cli.option_groups' has no attribute {name!r}")
    made = globals()[name] = globals().get(name) or _ON_DEMAND[name]()
    return made


def settings_in(group: Any, kind: type) -> dict[str, Any]:
    """The values of a group's options that are declared settings of a class, by name."""
    return {name: getattr(group, name) for name in settings_of(kind)}


def with_groups(verb: Callable[..., None]) -> Callable[..., None]:
    """The verb with every option by itself, in place of the groups that it takes."""
    hints = get_type_hints(verb, include_extras=True)
    groups: dict[str, tuple[Any, list[str]]] = {}
    flat: list[inspect.Parameter] = []
    for name, parameter in inspect.signature(verb).parameters.items():
        kind = hints.get(name, parameter.annotation)
        if not is_dataclass(kind):
            flat.append(parameter.replace(annotation=kind, kind=inspect.Parameter.KEYWORD_ONLY))
            continue
        own = get_type_hints(kind, include_extras=True)
        groups[name] = (kind, [one.name for one in fields(kind)])
        for one in fields(kind):
            default = inspect.Parameter.empty if one.default is MISSING else one.default
            kind_of = inspect.Parameter.KEYWORD_ONLY
            flat.append(inspect.Parameter(one.name, kind_of, annotation=own[one.name], default=default))

    @functools.wraps(verb)
    def call(**given: Any) -> None:
        made = {name: kind(**{key: given.pop(key) for key in keys}) for name, (kind, keys) in groups.items()}
        verb(**made, **given)

    call.__signature__ = inspect.Signature(flat)  # type: ignore[attr-defined]
    call.__annotations__ = {one.name: one.annotation for one in flat}
    del call.__wrapped__
    return call

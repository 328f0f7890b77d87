"""Settings of the robot, the planner, the speed law and the energy model by name, and a run with other values of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

from lampyris._core.settings import settings_of
from lampyris.errors import InputError, SettingError, UsageError, did_you_mean, shown
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.model.traffic import ObstacleSpec
from lampyris.motion.laws import registry as laws
from lampyris.planning import registry as planners
from lampyris.uncertainty.energy import EnergyModel
from lampyris.uncertainty.inputs import Input


@dataclass(frozen=True)
class Run:
    """What is planned and driven: a scene, a planner and a law, with the settings that they have.

    Parameters
    ----------
    scene : map, ends, moves and robot.
    planner, planner_settings : name and settings.
    law, law_settings : name and settings.
    energy : the energy model.
    traffic : moving obstacles; None: the path is planned and profiled, not driven.
    obstacle_speed : theirs, m/s, of a step.
    """

    scene: Scene
    planner: str
    planner_settings: Mapping[str, Any]
    law: str
    law_settings: Mapping[str, Any]
    energy: EnergyModel
    traffic: tuple[ObstacleSpec, ...] | None = None
    obstacle_speed: float | None = None

    def with_values(self, values: Mapping[str, float]) -> Run:
        """The same run with other values of settings, by their full names, such as ``robot.v_max``.

        Raises
        ------
        SettingError : a value out of its range.
        """
        parts: dict[str, dict[str, Any]] = {owner: {} for owner in OWNERS}
        for name, value in values.items():
            owner, _, key = name.partition(".")
            parts[owner][key] = value
        made = replace(
            self,
            planner_settings={**self.planner_settings, **parts["planner"]},
            law_settings={**self.law_settings, **parts["law"]},
            energy=replace(self.energy, **parts["energy"]),
        )
        planners.make(made.planner, made.planner_settings)
        laws.with_settings(made.law, made.law_settings)
        if parts["robot"]:
            made = replace(made, scene=replace(self.scene, robot=replace(self.scene.robot, **parts["robot"])))
        return made

    def names(self) -> tuple[str, ...]:
        """Full names of all settings that are numbers and may vary."""
        return tuple(f"{owner}.{key}" for owner in OWNERS for key in OWNERS[owner](self))


def full_names(run: Run, vary: Mapping[str, Input]) -> dict[str, str]:
    """The full name of each setting that varies, by the name as it was given.

    Raises
    ------
    UsageError : ``VARY``: no such setting, or one of several owners.
    SettingError : a range that leaves what the setting may be.
    """
    known, found = run.names(), dict[str, str]()
    for name in vary:
        plain = name.replace("-", "_")
        matches = [one for one in known if plain in (one, one.partition(".")[2])]
        if len(matches) != 1:
            what = (
                f"{shown(name)} is no setting that can vary"
                if not matches
                else f"{shown(name)} is one of several"
            )
            allowed = ", ".join(matches or (one.removeprefix("robot.") for one in known))
            near = [one.partition(".")[2] for one in known]
            raise UsageError("VARY", what, where="vary", allowed=allowed, todo=did_you_mean(plain, near))
        if matches[0] in found.values():
            raise UsageError("VARY", f"{matches[0]} is given twice", where="vary", allowed="once each")
        found[name] = matches[0]
    for name, one in vary.items():
        for end in one.range:
            try:
                run.with_values({found[name]: end})
            except InputError as refused:
                low, high = one.range
                what = f"{low:g} to {high:g}"
                raise SettingError(
                    "VARY", what, where=f"vary.{name}", allowed=refused.allowed or refused.what,
                    setting="vary", value=f"{name} from {what}",
                ) from refused  # fmt: skip
    return found


def _of_robot(run: Run) -> list[str]:
    outline = run.scene.robot.footprint is not None
    names = [key for key, one in settings_of(Robot).items() if one.kind == "number"]
    return [key for key in names if not (outline and key == "radius")]


def _of_planner(run: Run) -> list[str]:
    known = planners.settings_of(planners.planner_class(run.planner))
    given = {**known, **run.planner_settings}
    return [key for key, value in given.items() if isinstance(value, float)]


def _of_law(run: Run) -> list[str]:
    known = laws.settings_of(laws.with_settings(run.law, run.law_settings))
    return [key for key, value in known.items() if isinstance(value, float)]


def _of_energy(run: Run) -> list[str]:
    return list(settings_of(EnergyModel))


OWNERS: Mapping[str, Callable[[Run], list[str]]] = {
    "robot": _of_robot,
    "planner": _of_planner,
    "law": _of_law,
    "energy": _of_energy,
}
"""Who has settings: the first part of a full name, and the settings of theirs that are numbers."""

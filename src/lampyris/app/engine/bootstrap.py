"""Hello: what there is to choose from, as plain data. The page makes its forms from this.

Ranges and meanings come from the declarations of the settings (:mod:`lampyris._core.settings`).
"""

from __future__ import annotations

import math
from dataclasses import asdict
from functools import cache
from typing import Any

from lampyris import __version__
from lampyris._core.limits import MAX_CELLS
from lampyris._core.settings import defaults_of, meanings_of, settings_of
from lampyris.fleets import PLANNER
from lampyris.io.maps import library
from lampyris.io.maps.recipes.make import RECIPES
from lampyris.io.maps.recipes.recipe import Recipe
from lampyris.model.moves import MOVES
from lampyris.model.race.race import MOST_RACERS
from lampyris.model.robot import Robot
from lampyris.model.settings.drive import DriveSettings
from lampyris.model.settings.simulation import SimulationSettings
from lampyris.model.settings.steering import CONTROLLERS, Steering
from lampyris.model.traffic import MAX_OBSTACLES
from lampyris.motion.laws import physical
from lampyris.motion.laws import registry as laws
from lampyris.planning import registry
from lampyris.sim.traffic.mobility import MOBILITIES


@cache
def hello() -> dict[str, Any]:
    """All there is to choose from; made once."""
    return {
        "version": __version__,
        "planners": [_planner(row) for row in registry.list_planners().values()],
        "planners_of_poses": [_planner(row) for row in registry.list_planners("poses").values()],
        "planners_of_fleets": [  # the default first
            {"name": row.name, "title": row.title, "summary": row.summary}
            for row in sorted(registry.list_planners("fleets").values(), key=lambda row: row.name != PLANNER)
        ],
        "laws": [_law(row) for row in laws.LAWS.values()],
        "robot": [_setting(key, v, Robot, key) for key, v in defaults_of(Robot).items()],
        "simulate": [
            _setting(key, v, SimulationSettings, key) for key, v in defaults_of(SimulationSettings).items()
        ],
        "drive": [
            _setting(key, v, DriveSettings, key)
            for key, v in defaults_of(DriveSettings).items()
            if key not in ("controller", "controller_settings")
        ],
        "controllers": [_controller(kind) for kind in CONTROLLERS.values()],
        "moves": list(MOVES),
        "mobilities": list(MOBILITIES),
        "maps": list(library.names()),
        "recipes": [_recipe(row) for row in RECIPES.values()],
        "limits": {"cells": MAX_CELLS, "obstacles": MAX_OBSTACLES, "racers": MOST_RACERS},
    }


def _planner(row: registry.PlannerInfo[Any]) -> dict[str, Any]:
    kind = registry.planner_class(row.name)
    return {
        "name": row.name,
        "title": row.title,
        "summary": row.summary,
        "source": row.source,
        "traits": asdict(row.traits),
        "settings": [_setting(key, value, kind, key) for key, value in row.settings.items()],
    }


def _law(row: laws.Law) -> dict[str, Any]:
    kinds = {"": type(row.settings), **physical.RULES}
    return {
        "name": row.name,
        "units": row.units,
        "summary": row.summary,
        "source": row.source,
        "settings": [
            _switch(key, kinds[""])
            if key in physical.RULES
            else _setting(key, value, kinds[key.rpartition(".")[0]], key.rpartition(".")[2])
            for key, value in laws.settings_of(row.name).items()
        ],
        "rules": laws.rules_of(row.name),
    }


def _controller(kind: type[Steering]) -> dict[str, Any]:
    """A controller that steers."""
    return {
        "name": kind.name,
        "summary": kind.summary,
        "source": kind.source,
        "settings": [_setting(key, value, kind, key) for key, value in defaults_of(kind).items()],
    }


def _recipe(row: Recipe) -> dict[str, Any]:
    """A recipe; settings that are lists of cells have no control in a form, and stay at their defaults."""
    return {
        "name": row.name,
        "summary": row.summary,
        "connected": row.connected,
        "least": row.least,
        "settings": [
            {
                "name": one.name, "type": _type(one.default), "default": one.default, "choices": None,
                "least": one.least, "most": one.most, "about": one.what, "allowed": one.range,
            }
            for one in row.table
            if one.least is not None
        ],
    }  # fmt: skip


def _switch(rule: str, kind: type) -> dict[str, Any]:
    """A rule of a law that is off, for a form."""
    about = meanings_of(kind).get(rule, "")
    return _plain(rule, None, about) | {"type": "word", "choices": ["on", "off"], "allowed": "on, off"}


def _plain(name: str, default: Any, about: str) -> dict[str, Any]:
    """A setting of which nothing is declared."""
    allowed = f"{len(default)} numbers" if isinstance(default, tuple) else ""
    return {
        "name": name, "type": _type(default), "default": default, "choices": None, "least": None, "most": None,
        "about": about, "allowed": allowed, "unit": "", "none": "",
    }  # fmt: skip


def _setting(key: str, value: Any, kind: type, name: str) -> dict[str, Any]:
    """A setting for a form: its name, type, default, range and meaning, as its field declares them.

    Parameters
    ----------
    key : what the setting is called, with the rule that it belongs to.
    value : its default.
    kind, name : the class and the field. A third-party planner need not declare ranges: its form has none.
    """
    declared = settings_of(kind).get(name)
    made = _plain(key, value, meanings_of(kind).get(name, ""))
    if declared is None:
        return made
    low = declared.low if declared.off is None else min(declared.low, declared.off[0])
    return made | {
        "type": declared.kind,
        "choices": list(declared.words) or None,
        "least": low if math.isfinite(low) else None,
        "most": declared.high if math.isfinite(declared.high) else None,
        "allowed": declared.allowed,
        "unit": declared.unit,
        "none": declared.none,
        **({"title": declared.title} if declared.title else {}),
    }


def _type(value: Any) -> str:
    kinds = ((bool, "flag"), (int, "whole"), (float, "number"), (str, "word"))
    return next((word for kind, word in kinds if isinstance(value, kind)), "any")

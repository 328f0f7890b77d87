"""Hello: what there is to choose from, as plain data. The page makes its forms from this.

What a setting may be is asked of the planner itself: it is given something it can only refuse, and its
refusal says what is allowed. So a guest's planner has a form too, and no list here can go stale.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import asdict
from functools import cache
from typing import Any

from lampyris import __version__
from lampyris._core.limits import MAX_CELLS
from lampyris.errors import LampyrisError
from lampyris.io.maps import library
from lampyris.io.maps.recipes.make import RECIPES
from lampyris.io.maps.recipes.recipe import Recipe
from lampyris.model.moves import MOVES
from lampyris.motion.laws import physical
from lampyris.motion.laws import registry as laws
from lampyris.planning import registry
from lampyris.sim.traffic.mobility import MOBILITIES

_RANGE = re.compile(r"(?<![\w.])(-?[\d.,]+(?:e[+-]?\d+)?) to (-?[\d.,]+(?:e[+-]?\d+)?)")
_BETWEEN = re.compile(r"(-?[\d.]+) <=? \w+ <=? (-?[\d.]+)")
_WORD = re.compile(r"[a-z0-9][a-z0-9_-]*")


class _Nothing:
    """A value that no setting has."""

    def __repr__(self) -> str:
        return "nothing"


@cache
def hello() -> dict[str, Any]:
    """All there is to choose from; made once."""
    return {
        "version": __version__,
        "planners": [_planner(row) for row in registry.list_planners().values()],
        "laws": [_law(row) for row in laws.LAWS.values()],
        "moves": list(MOVES),
        "mobilities": list(MOBILITIES),
        "maps": list(library.names()),
        "recipes": [_recipe(row) for row in RECIPES.values()],
        "limits": {"cells": MAX_CELLS},
    }


def _planner(row: registry.PlannerInfo) -> dict[str, Any]:
    about = _words(registry.planner_class(row.name))
    return {
        "name": row.name,
        "summary": row.summary,
        "source": row.source,
        "traits": asdict(row.traits),
        "settings": [
            _setting(key, value, lambda k, v: registry.make(row.name, {k: v}), about.get(key, ""))
            for key, value in row.settings.items()
        ],
    }


def _law(row: laws.Law) -> dict[str, Any]:
    about = dict(_words(type(row.settings)))
    for rule, kind in physical.RULES.items():
        about |= {f"{rule}.{key}": text for key, text in _words(kind).items()}
    return {
        "name": row.name,
        "units": row.units,
        "summary": row.summary,
        "source": row.source,
        "settings": [
            _setting(key, value, lambda k, v: laws.with_settings(row.name, {k: v}), about.get(key, ""))
            for key, value in laws.settings_of(row.name).items()
        ],
        "rules": laws.rules_of(row.name),
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


def _setting(key: str, value: Any, give: Callable[[str, Any], Any], about: str) -> dict[str, Any]:
    """A setting: its name, type, default, and what is allowed as far as a refusal says."""
    made: dict[str, Any] = {
        "name": key, "type": _type(value), "default": value, "choices": None, "least": None, "most": None,
        "about": about, "allowed": "",
    }  # fmt: skip
    try:
        give(key, _Nothing())
    except LampyrisError as refusal:
        made |= _allowed(refusal.allowed, made["type"])
    except Exception:
        # A guest's planner that does not check: its default has to do.
        return made
    if made["least"] is not None and isinstance(value, int | float):
        # Some say the range of what is on, and have another value for off.
        made["least"] = min(made["least"], value)
    return made


def _type(value: Any) -> str:
    kinds = ((bool, "flag"), (int, "whole"), (float, "number"), (str, "word"))
    return next((word for kind, word in kinds if isinstance(value, kind)), "any")


def _allowed(text: str, kind: str) -> dict[str, Any]:
    """What the words of a refusal allow."""
    if found := _RANGE.search(text) or _BETWEEN.search(text):
        least, most = (float(found[i].replace(",", "")) for i in (1, 2))
        return {
            "type": "whole" if "whole" in text else "number",
            "least": least,
            "most": most,
            "allowed": text,
        }
    if "true or false" in text:
        return {"type": "flag", "allowed": text}
    words = [word.strip() for word in re.split(",| or ", text.partition(";")[0])]
    if kind in ("word", "any") and len(words) > 1 and all(_WORD.fullmatch(word) for word in words):
        return {"type": "word", "choices": words, "allowed": text}
    return {"allowed": text}


def _words(kind: type) -> Mapping[str, str]:
    """What the docstrings of a class and its parents say of each parameter."""
    found: dict[str, str] = {}
    for base in reversed(kind.__mro__):
        text = base.__doc__ or ""
        _, _, part = text.partition("Parameters\n")
        for name, said in re.findall(r"^ {4}([a-z][\w, ]*?) : (.*(?:\n {8}.*)*)", part, re.MULTILINE):
            for one in name.split(","):
                found[one.strip()] = " ".join(said.split()).replace("``", "")
    return found

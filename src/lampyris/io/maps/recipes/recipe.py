"""What a recipe is: a function, and a table of its settings with their ranges.

The range of a setting is written once, in the table; nothing reaches a recipe's function unchecked.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

from lampyris.errors import SettingError, UnknownSettingError, did_you_mean
from lampyris.typing import BoolGrid, ByteGrid


@dataclass(frozen=True, slots=True)
class RecipeSetting:
    """One setting of a recipe: a whole number, a share, or a list of cells.

    Parameters
    ----------
    name, default : its name, and its value where none is given.
    least, most : its range, ends included; None: the setting is a list of cells (x, y).
    what : what it does, in a few words, with its unit.
    """

    name: str
    default: Any
    least: float | None
    most: float | None
    what: str

    @property
    def kind(self) -> str:
        """``whole number``, ``number`` or ``cells``."""
        if self.least is None:
            return "cells"
        return "whole number" if isinstance(self.default, int) else "number"

    @property
    def range(self) -> str:
        """What is allowed, in words."""
        if self.least is None:
            return "cells X,Y;X,Y;..."
        return f"a {self.kind}, {self.least:g} to {self.most:g}"

    def check(self, value: Any) -> Any:
        """The value as the recipe takes it.

        Raises
        ------
        SettingError : of the wrong kind, or out of range.
        """
        if self.least is None or self.most is None:
            return self._cells(value)
        kinds = int if self.kind == "whole number" else (int, float)
        if not isinstance(value, kinds) or isinstance(value, bool) or not self.least <= value <= self.most:
            raise self._error(value)
        return value

    def read(self, text: str) -> Any:
        """The value that a word of the command line stands for.

        Raises
        ------
        SettingError : not of this kind, or out of range.
        """
        try:
            if self.kind == "whole number":
                return self.check(int(text))
            if self.kind == "number":
                return self.check(float(text))
            return self.check([tuple(map(int, c.split(","))) for c in text.split(";") if c])
        except SettingError:
            raise
        except ValueError:
            raise self._error(text) from None

    def _cells(self, value: Any) -> tuple[tuple[int, int], ...]:
        try:
            return tuple((int(x), int(y)) for x, y in value)
        except (TypeError, ValueError):
            raise self._error(value) from None

    def _error(self, value: Any) -> SettingError:
        return SettingError.of("RECIPE", self.name, repr(value), allowed=self.range)


@dataclass(frozen=True, slots=True)
class Recipe:
    """One way of making maps.

    Parameters
    ----------
    name, summary : what to call it and what it makes.
    build : ``(draw, width, height, **settings) -> blocked``, or ``-> (blocked, terrain)``; it is given every
        setting, checked.
    table : its settings.
    connected : whether all free cells are one region, from side to side (4 neighbours).
    least : least width and height, cells.
    """

    name: str
    summary: str
    build: Callable[..., BoolGrid | tuple[BoolGrid, ByteGrid]]
    table: tuple[RecipeSetting, ...]
    connected: bool = True
    least: int = 4

    @property
    def settings(self) -> Mapping[str, Any]:
        """Each setting with its default."""
        return MappingProxyType({s.name: s.default for s in self.table})

    def setting(self, name: str) -> RecipeSetting:
        """The setting of that name.

        Raises
        ------
        SettingError : there is none.
        """
        for setting in self.table:
            if setting.name == name:
                return setting
        known = [s.name for s in self.table]
        raise UnknownSettingError(
            "RECIPE",
            f"{self.name} has no setting {name!r}",
            allowed=", ".join(known),
            todo=did_you_mean(name, known),
            setting=name,
        )

    def complete(self, given: Mapping[str, Any]) -> dict[str, Any]:
        """Every setting: those given, checked, and the defaults of the others.

        Raises
        ------
        SettingError : a setting it does not have, a value out of its range.
        """
        checked = {name: self.setting(name).check(value) for name, value in given.items()}
        return {**self.settings, **checked}


def too_small(what: str, width: int, height: int, need: str) -> SettingError:
    """The error for a map that cannot hold one of what it is made of."""
    return SettingError(
        "MAP_SIZE",
        f"{width} x {height} cells are too small for {what}",
        allowed=need,
        todo="make the map larger or its parts smaller",
        setting="size",
    )

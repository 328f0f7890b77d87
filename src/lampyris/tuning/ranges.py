"""What is searched: a range for each setting, from its own declaration."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from lampyris._core.settings import Setting
from lampyris.errors import SettingError, UnknownSettingError, UsageError, did_you_mean
from lampyris.tuning.subject import Subject

AROUND = 10.0
"""A range that nobody states reaches from a tenth of the default to ten times the default, within the declared one."""
LOG = 20.0
"""Ranges whose ends have at least this ratio are searched by logarithm."""
DIGITS = 4
"""Of a number that is tried, so that a settings file can be read."""


@dataclass(frozen=True, slots=True)
class SearchRange:
    """What a setting may be.

    Parameters
    ----------
    name : of the setting.
    kind : ``number``, ``whole``, ``flag`` or ``word``.
    low, high : of a number, both possible.
    words : of a word.
    """

    name: str
    kind: str
    low: float = 0.0
    high: float = 0.0
    words: tuple[str, ...] = ()

    @property
    def log(self) -> bool:
        """Whether it is searched by logarithm."""
        return self.low > 0 and self.high / self.low >= LOG

    @property
    def plain(self) -> Any:
        """As JSON holds it: the ends, or the words."""
        if self.kind == "flag":
            return [False, True]
        if self.kind == "word":
            return list(self.words)
        return [int(self.low), int(self.high)] if self.kind == "whole" else [self.low, self.high]

    def clipped(self, value: Any) -> Any:
        """The nearest value within; None where there is none."""
        if value is None or self.kind in ("flag", "word"):
            return value if self.kind == "flag" or value in self.words else None
        return min(max(value, self.low), self.high)

    def suggest(self, trial: Any) -> Any:
        """A value that a trial of Optuna proposes."""
        if self.kind == "flag":
            return trial.suggest_categorical(self.name, [False, True])
        if self.kind == "word":
            return trial.suggest_categorical(self.name, list(self.words))
        if self.kind == "whole":
            return trial.suggest_int(self.name, int(self.low), int(self.high), log=self.log)
        value = float(f"{trial.suggest_float(self.name, self.low, self.high, log=self.log):.{DIGITS}g}")
        return min(max(value, self.low), self.high)


def ranges_of(subject: Subject, wanted: Sequence[str] = ()) -> tuple[SearchRange, ...]:
    """The ranges that are searched.

    Parameters
    ----------
    subject : the planner or speed law; a range that nobody states lies around its settings in the study.
    wanted : words as ``--range`` takes them: ``NAME``, ``NAME=LOW:HIGH`` or ``NAME=WORD,WORD``; empty: every setting that
        is free and has a value.

    Raises
    ------
    UsageError : ``RANGE``: a setting twice, or a range that cannot be read; there is nothing to tune.
    SettingError : a range beyond the declared one.
    """
    called, held, declared = subject.config.name, subject.config.settings, subject.declared
    if not wanted:
        found = [
            _around(name, one, held[name]) for name, one in subject.free.items() if held.get(name) is not None
        ]
        made = tuple(one for one in found if one is not None)
        if not made:
            raise UsageError(
                "RANGE", f"{called} has no settings to tune", where=subject.kind,
                allowed=f"another {subject.kind}",
            )  # fmt: skip
        return made
    chosen: dict[str, SearchRange] = {}
    for word in wanted:
        name, equals, text = (part.strip() for part in word.partition("="))
        if name not in declared:
            what = f"{called} has no declared setting {name!r}"
            raise UnknownSettingError(
                "RANGE", what, where="range", allowed=", ".join(declared), todo=did_you_mean(name, declared)
            )
        if name in chosen:
            raise UsageError("RANGE", f"{name} twice", where="range", allowed="each setting once")
        stated = (
            _stated(name, declared[name], text) if equals else _around(name, declared[name], held.get(name))
        )
        if stated is None:
            what = f"{name} has no value to search around"
            raise UsageError("RANGE", what, where="range", allowed=f"{name}=LOW:HIGH")
        chosen[name] = stated
    return tuple(chosen.values())


def _around(name: str, one: Setting, value: Any) -> SearchRange | None:
    """The range around a value; None where there is nothing to vary."""
    if one.kind == "flag":
        return SearchRange(name, "flag")
    if one.kind == "word":
        return SearchRange(name, "word", words=one.words) if len(one.words) > 1 else None
    if value is None:
        return None
    low, high = (value / AROUND, value * AROUND) if value > 0 else (0.0, AROUND)
    least = math.nextafter(one.low, math.inf) if one.above else one.low
    low, high = max(low, least), min(high, one.high)
    if one.kind == "whole":
        low, high = float(math.ceil(low)), float(math.floor(high))
    return SearchRange(name, one.kind, low, high) if low < high else None


def _stated(name: str, one: Setting, text: str) -> SearchRange:
    if one.kind in ("flag", "word"):
        words = tuple(part.strip() for part in text.split(","))
        known = ("true", "false") if one.kind == "flag" else one.words
        if len(words) < 2 or len(set(words)) < len(words) or not set(words) <= set(known):
            raise UsageError(
                "RANGE", f"{name}={text}", where="range", allowed=f"two or more of {', '.join(known)}"
            )
        return SearchRange(name, "flag") if one.kind == "flag" else SearchRange(name, "word", words=words)
    parts = text.split(":")
    try:
        low, high = (float(part) for part in parts)
    except ValueError:
        raise UsageError(
            "RANGE", f"{name}={text}", where="range", allowed=f"{name}=LOW:HIGH, two numbers"
        ) from None
    numbers = (
        (int(low), int(high))
        if one.kind == "whole" and low.is_integer() and high.is_integer()
        else (low, high)
    )
    if not all(one.accepts(number) for number in numbers) or not low < high:
        raise SettingError.of(
            "RANGE", "range", f"{name}={text}", allowed=f"LOW below HIGH, each {one.allowed}"
        )
    return SearchRange(name, one.kind, low, high)

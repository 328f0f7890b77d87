"""Everything lampyris refuses, as one tree.

::

    LampyrisError                 anything raised on purpose
    ├── UsageError        exit 2  the call's own words are off (options that contradict, unknown names)
    │   └── BusyError             an object for one call at a time is at work in another call
    ├── InputError        exit 3  something given is wrong
    │   ├── FileError             a file cannot be read as what it claims to be
    │   ├── SceneError            an end outside the map, an obstacle in a wall
    │   └── SettingError          a number or name out of its range (a ValueError, too)
    │       └── UnknownSettingError   there is no such setting
    ├── LimitError        exit 5  more than a stated limit allows
    └── InternalFault     exit 6  the referee refused our own result; must never be seen

An answer is not an error: "no path" is a :class:`lampyris.model.plan.Status` (exit 4).

Every message reads ``error[CODE]: WHERE: what is wrong (value); allowed: what is; what to do``.
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from typing import Self


class LampyrisError(Exception):
    """Base class of all errors that lampyris raises.

    Parameters
    ----------
    code : upper-case word that names the kind of mistake and does not change between releases.
    what : what is wrong, with the value that was found.
    where : file, line, column, pixel or setting, as far as they are known.
    allowed : what would have been accepted.
    todo : what to do about it.
    setting : name of the argument, option or setting that is wrong, dotted where its owner tells it from
        others (``robot.radius``); empty: ``where`` if that is such a name, else none.
    value : its value in words, if ``what`` is the setting's name and its value; see :meth:`of`.

    Examples
    --------
    >>> import lampyris
    >>> try:
    ...     lampyris.load_grid("no-such-map")
    ... except lampyris.LampyrisError as error:
    ...     print(error.code)
    FILE_MISSING
    """

    exit_code = 3

    def __init__(
        self,
        code: str,
        what: str,
        *,
        where: str = "",
        allowed: str = "",
        todo: str = "",
        setting: str = "",
        value: str = "",
    ) -> None:
        self.code = code
        self.what = what
        self.where = where
        self.allowed = allowed
        self.todo = todo
        self.setting = setting or (where if _is_name(where) else "")
        self.value = value
        super().__init__(code, what, where, allowed, todo)

    @classmethod
    def of(
        cls, code: str, setting: str, value: str, *, where: str = "", allowed: str = "", todo: str = ""
    ) -> Self:
        """The error about a setting's value; it reads ``SETTING VALUE``, without the setting's owner."""
        what = f"{setting.rpartition('.')[2]} {value}"
        return cls(code, what, where=where, allowed=allowed, todo=todo, setting=setting, value=value)

    def __str__(self) -> str:
        place = f"{self.where}: " if self.where else ""
        parts = (self.what, f"allowed: {self.allowed}" if self.allowed else "", self.todo)
        return f"error[{self.code}]: {_line(place)}" + "; ".join(_line(p) for p in parts if p)

    def __reduce__(self) -> tuple[object, ...]:
        # Keyword-only arguments do not survive Exception's own pickling; workers of a study send these home.
        said = (self.code, self.what, self.where, self.allowed, self.todo, self.setting, self.value)
        return (_rebuild, (type(self), *said))


def _is_name(where: str) -> bool:
    """Whether a place is that of a setting and neither an option, a file nor a part of a list."""
    parts = where.replace("-", "_").split(".")
    return not where.startswith("-") and all(part.isidentifier() for part in parts)


MAX_SHOWN = 200
"""Characters of a value in a message."""
MAX_DIGITS = 60
"""Digits of a whole number in a message; Python does not write those of more than 4300 at all."""


def shown(value: object) -> str:
    """A value as a message shows it; whatever it is, this does not raise, and is not long."""
    if isinstance(value, int) and value.bit_length() > MAX_DIGITS / 0.30103:
        about = int(value.bit_length() * 0.30103) + 1
        return f"a whole number of about {about} digits"
    try:
        text = repr(value)
    except Exception:
        return f"a {type(value).__name__}"
    return text if len(text) <= MAX_SHOWN else f"{text[: MAX_SHOWN - 4]} ..."


def of_kind(where: str, value: object, kind: type, *, none: bool = False) -> None:
    """Refuse what is of another type.

    Parameters
    ----------
    where : the argument's name.
    kind : the type.
    none : whether None is allowed, too.

    Raises
    ------
    SettingError : ``TYPE``.
    """
    if not (isinstance(value, kind) or (none and value is None)):
        name = "True or False" if kind is bool else f"a {kind.__name__}{', or None' if none else ''}"
        raise SettingError("TYPE", f"a {type(value).__name__}", where=where, allowed=name)


def callable_or_none(where: str, value: object) -> None:
    """Refuse what cannot be called.

    Raises
    ------
    SettingError : ``TYPE``.
    """
    if value is not None and not callable(value):
        raise SettingError("TYPE", f"a {type(value).__name__}", where=where, allowed="a function, or None")


def file_name(where: str, value: object) -> str:
    """A file's name as text.

    Raises
    ------
    SettingError : ``TYPE``: neither text nor a path.
    """
    try:
        return os.fsdecode(value)  # type: ignore[arg-type]
    except TypeError:
        what = f"a {type(value).__name__}"
        raise SettingError("TYPE", what, where=where, allowed="a name or a path") from None


MAX_PART = 1000
"""Characters of a message's part; what a file says there can be longer than anyone reads."""


def _line(text: str) -> str:
    """One line, without what a terminal would obey: words and names in messages are those of files."""
    if not text.isprintable():
        text = "".join(c if c.isprintable() else repr(c)[1:-1] for c in text)
    return text if len(text) <= MAX_PART else f"{text[: MAX_PART - 4]} ..."


def _rebuild(kind: type[LampyrisError], code: str, what: str, *said: str) -> LampyrisError:
    where, allowed, todo, setting, value = said
    return kind(code, what, where=where, allowed=allowed, todo=todo, setting=setting, value=value)


class UsageError(LampyrisError):
    """The call's own words are off: options that contradict each other, an unknown name."""

    exit_code = 2


class BusyError(UsageError):
    """An object that serves one call at a time is at work in another call: see :mod:`lampyris._core.exclusive`."""


class InputError(LampyrisError):
    """Something that was given is wrong."""

    exit_code = 3


class FileError(InputError):
    """A file cannot be read as what it claims to be."""


class SceneError(InputError):
    """The pieces of a scene do not fit: an end outside the map, an obstacle in a wall."""


class SettingError(InputError, ValueError):
    """A number or name is out of its range; also a ``ValueError``.

    Examples
    --------
    >>> import lampyris
    >>> try:
    ...     lampyris.Robot(v_max=-1.0)
    ... except lampyris.SettingError as error:
    ...     print(error.setting)
    robot.v_max
    """


class UnknownSettingError(SettingError):
    """There is no setting of that name; ``setting`` is what was given."""


class LimitError(LampyrisError):
    """More than a stated limit allows."""

    exit_code = 5


class InternalFault(LampyrisError):
    """The referee refused a result of lampyris. A fault of lampyris, never the user's mistake."""

    exit_code = 6


def did_you_mean(word: object, known: Iterable[str], cutoff: float = 0.6) -> str:
    """``did you mean NAME?`` for the nearest known name; empty where none is near.

    Parameters
    ----------
    word : what was given.
    known : the names there are.
    cutoff : least likeness, 0 to 1.
    """
    import difflib

    if not isinstance(word, str):
        return ""
    near = difflib.get_close_matches(word[:100], list(known), 1, cutoff)
    return f"did you mean {near[0]}?" if near else ""


def plural(n: int, thing: str) -> str:
    """``1 pixel``, ``2 pixels``."""
    return f"{n:,} {thing}" + ("" if n == 1 else "s")

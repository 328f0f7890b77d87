"""Errors as the command line reports them: which option is wrong, as it was typed, and the exit code.

The library's errors carry the name of the setting that is wrong (``robot.v_max``, ``nt``, ``seed``) and know
nothing of options. This module finds the option of the running verb that gave that setting. A bad
value on the command line is a :class:`lampyris.errors.UsageError` (exit code 2) wherever it is found; a bad value
in a file stays what it is (exit code 3). Limits keep their exit code 5 and get the option's name.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterable, Mapping
from typing import Any, cast

import typer
from typer.core import TyperCommand

from lampyris.cli.panels import panel_of, write_panels
from lampyris.errors import (
    FileError,
    InputError,
    InternalFault,
    LampyrisError,
    LimitError,
    UnknownSettingError,
    UsageError,
    did_you_mean,
)

BadParameter: Any = typer.BadParameter
ClickUsageError: Any = typer.BadParameter.__mro__[1]
"""Of click, or of the copy of click within newer releases of Typer."""
ClickException: Any = typer.BadParameter.__mro__[2]
Abort: Any = typer.Abort

OPTIONS: Mapping[str, str] = {
    "traffic.count": "obstacles",
    "traffic.rate": "rate",
    "traffic.radius": "obstacle_radius",
    "faults": "fault",
    "delays.probability": "delays",
    "delays.duration": "delay_duration",
    "width": "size",
    "height": "size",
}
"""Settings that an option has another name for; of all others the option's name is the last of theirs."""

_ARGUMENT = re.compile(r"\b([a-z_]+)=(?:\"(\w+)\"|(True|[A-Z]+))")
_NONE = re.compile(r", or [Nn]one(?: \((.+)\))?$")
"""The value of a setting that no option takes, and what it means."""
_QUOTED = re.compile(r"(.*) is not (?:a valid|in the range)")
_WITH_KEYS = ("--set", "--planners", "--laws")
"""Options whose values are settings, which may be ``none``."""
_FILES = frozenset(("path", "file"))
"""Kinds of parameters that name a file: what is wrong with its content is not wrong with the option."""
_READ = frozenset(("map_", "scenario", "study", "source", "ready"))
"""Parameters that are text and name a file or a ready map or study."""


class Command(TyperCommand):
    """A verb whose errors name its options and whose ``--help`` groups them (also ``-h``)."""

    def __init__(self, *args: Any, **settings: Any) -> None:
        context = {"help_option_names": ["-h", "--help"], **(settings.pop("context_settings", None) or {})}
        super().__init__(*args, context_settings=context, **settings)
        for parameter in self.params:
            if parameter.param_type_name == "option":
                cast(Any, parameter).rich_help_panel = panel_of(parameter, self.name)

    def format_options(self, ctx: Any, formatter: Any) -> None:
        """Options in plain text, panel by panel."""
        write_panels(ctx, formatter, self.get_params(ctx))

    def invoke(self, ctx: Any) -> Any:
        """Run the verb."""
        # Typer has its own click in new releases and the installed one in old ones: no type names both.
        try:
            return super().invoke(ctx)
        except (InputError, UsageError, LimitError) as error:
            error.todo = with_options(error.todo, ctx)
            named = as_typed(error, ctx)
            if named is error:
                raise
            raise named from error


def with_options(todo: str, ctx: Any) -> str:
    """Advice that names arguments of Python (``values="costmap"``), with the verb's options instead."""
    options = {p.name: max(p.opts, key=len) for p in ctx.command.params if p.param_type_name == "option"}

    def option(found: re.Match[str]) -> str:
        name, word = options.get(found[1]) or options.get(f"{found[1]}_"), found[2] or found[3] or ""
        return found[0] if name is None else name if word == "True" else f"{name} {word}"

    return _ARGUMENT.sub(option, todo)


def as_typed(error: LampyrisError, ctx: Any) -> LampyrisError:
    """The error with the option that it is about; the same error if it is about none.

    Parameters
    ----------
    error : as the library raised it; a bad variable of the environment is wrong use as well.
    ctx : click's context of the verb.
    """
    if isinstance(error, FileError | InternalFault):
        return error
    if error.where.startswith("-") or error.code == "LIMIT_VARIABLE":
        option, what = error.where, error.value or error.what
    else:
        found = _option_of(error, _options_given(ctx))
        if found is None:
            return error
        option, what = found
    kind = UsageError if isinstance(error, InputError) else type(error)
    allowed = error.allowed if option.startswith(_WITH_KEYS) else without_none(error.allowed)
    named = kind(error.code, what, where=option, allowed=allowed, todo=error.todo)
    for note in getattr(error, "__notes__", ()):
        named.add_note(note)
    return named


def without_none(allowed: str) -> str:
    """What an option takes: no value of it stands for None, which is to leave it out."""
    return _NONE.sub(
        lambda found: "; leave the option out for the default" + (f" ({found[1]})" if found[1] else ""),
        allowed,
    )


def _options_given(ctx: Any) -> dict[str, str]:
    """Setting -> option as typed, of all that the command line gave a value; ``--set`` by ``=`` and its keys."""
    given: dict[str, str] = {}
    for parameter in ctx.command.params:
        source = ctx.get_parameter_source(parameter.name)
        if source is None or source.name != "COMMANDLINE":
            continue
        if parameter.name in _READ or parameter.type.name in _FILES:
            continue
        shown = spelled(parameter)
        value = ctx.params.get(parameter.name)
        if parameter.metavar == "KEY=VALUE" and isinstance(value, list | tuple):
            for word in value:
                key = str(word).partition("=")[0].strip().replace("-", "_")
                given[f"={key}"] = f"{shown} {key}"
                given.setdefault("", shown)
            continue
        for name in (parameter.name, *parameter.opts):
            given[name.strip("-_").replace("-", "_")] = shown
    return given


def spelled(parameter: Any) -> str:
    """An option as it was typed, or its long form; an argument by the name that ``--help`` shows."""
    if parameter.param_type_name == "argument":
        return str(parameter.metavar or parameter.name).strip("[]")
    options = [*parameter.opts, *parameter.secondary_opts]
    typed = {word.partition("=")[0] for word in sys.argv[1:]}
    return str(next((o for o in options if o in typed), max(options, key=len)))


def _option_of(error: LampyrisError, given: Mapping[str, str]) -> tuple[str, str] | None:
    """The option that an error is about, and what is wrong with its value."""
    setting = error.setting.replace("-", "_")
    if isinstance(error, UnknownSettingError):
        option = given.get(f"={setting}", given.get(""))
        return None if option is None else (option.partition(" ")[0], error.what)
    # A planner's name or a law's is no place: "ad-gso: nt 0" is about --set nt.
    is_place = error.where != error.setting and ("/" in error.where or "." in error.where)
    if error.value and error.where.startswith(
        f"{error.setting}."
    ):  # "vary.v_max", and the value says so again
        is_place = False
    name = OPTIONS.get(setting, setting)
    # A setting of a planner or a law is by --set, even where the verb has an option of the same name.
    owned = bool(error.where) and not is_place and error.where != error.setting
    while name:
        keys = (f"={name}", name) if owned else (name, f"={name}")
        name_given = next((key for key in keys if key in given), None)
        if name_given is not None:
            # The value of --size is both sides: which of them is wrong has to be said.
            what = error.what if setting in ("width", "height") else error.value or error.what
            return f"{given[name_given]}: {error.where}" if is_place else given[name_given], what
        name = name.partition(".")[2]
    return None


def usage_error(problem: Any) -> UsageError:
    """What click says of the words of a call, in our style."""
    ctx = problem.ctx
    todo = f"`{ctx.command_path} --help` shows the options" if ctx is not None else ""
    message = problem.format_message().rstrip(".")
    parameter = getattr(problem, "param", None)
    if isinstance(problem, BadParameter) and parameter is not None:
        where, allowed = spelled(parameter), allowed_by(parameter.type)
        if type(problem).__name__ == "MissingParameter":
            return UsageError("MISSING", "nothing is given", where=where, todo=todo)
        quoted = _QUOTED.match(problem.message)
        what = quoted[1] if quoted is not None and allowed else problem.message.rstrip(".")
        return UsageError("TYPE", what, where=where, allowed=allowed)
    option = getattr(problem, "option_name", "")
    if type(problem).__name__ == "NoSuchOption" or message.startswith("No such option"):
        known = [] if ctx is None else [o[2:] for p in ctx.command.params for o in p.opts if o[:2] == "--"]
        near = did_you_mean(option.lstrip("-"), known).replace("mean ", "mean --")
        return UsageError("OPTION", "there is no such option", where=option, todo=near or todo)
    if message.startswith("No such command"):
        verbs = [] if ctx is None else ctx.command.list_commands(ctx)
        word = message.partition(". Did you mean")[0].partition("'")[2].rpartition("'")[0]
        return UsageError(
            "VERB", f"there is no verb {word!r}", allowed=", ".join(verbs), todo=did_you_mean(word, verbs)
        )
    if option:
        what = message.partition("' ")[2] or message
        return UsageError("OPTION", what, where=option, todo=todo)
    return UsageError("USAGE", message, todo=todo)


def allowed_by(kind: Any) -> str:
    """What a parameter's type takes, in words."""
    whole = "a whole number"
    words = {"int": whole, "integer": whole, "float": "a number", "boolean": "true or false"}
    base = kind.name.partition(" ")[0]
    text = words.get(base, "")
    low, high = getattr(kind, "min", None), getattr(kind, "max", None)
    if low is not None and high is not None:
        return f"{text}, {low} to {high}"
    if low is not None:
        return f"{text}, {low} or more"
    return f"{text}, at most {high}" if high is not None else text


def check_choice(code: str, option: str, word: str, words: Iterable[str]) -> str:
    """Return the word if it is one that an option accepts.

    Raises
    ------
    UsageError : the option does not accept it.
    """
    words = tuple(words)
    if word not in words:
        raise UsageError(
            code, repr(word), where=option, allowed=", ".join(words), todo=did_you_mean(word, words)
        )
    return word

"""The checks there are, by name; each is imported when it is asked for."""

from __future__ import annotations

from importlib import import_module

from lampyris.errors import UsageError, did_you_mean
from lampyris.selfcheck.check import Check

NAMES: tuple[str, ...] = (
    "grids",
    "random",
    "moving",
    "profile",
    "sim",
    "monitor",
    "faults",
    "fuzz",
    "repair",
    "reuse",
    "metamorphic",
    "store",
    "kill",
    "oserrors",
    "mutants",
    "swarm",
    "determinism",
    "scen",
    "referee",
    "deadline",
    "maps",
    "flake",
)
"""Each the name of a module of this room that holds ``CHECK``; in the order in which they are run."""


def check(name: str) -> Check:
    """The check of that name.

    Raises
    ------
    UsageError : there is none.
    """
    if name not in NAMES:
        raise UsageError(
            "CHECK",
            f"no check is called {name!r}",
            allowed=", ".join(NAMES),
            todo=did_you_mean(name, NAMES),
        )
    found: Check = import_module(f"lampyris.selfcheck.{name}").CHECK
    return found

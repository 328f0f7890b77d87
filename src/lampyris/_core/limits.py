"""Limits of use: how much memory, path and time one call may take, and what raises them.

The limits of files are in :mod:`lampyris.io.maps`; these are of what is done with a file that was read. Each is
looked at before the memory is asked for, and is raised or lowered by a variable of the environment.
"""

from __future__ import annotations

import os
from dataclasses import dataclass

from lampyris.errors import LimitError, SettingError

MAX_CELLS = 2**24
"""Cells a map may have, and planners plan on: beyond it one integer is no longer an exact cost (see
:mod:`lampyris.model.moves`)."""

_END = 10**12


@dataclass(frozen=True, slots=True)
class Limit:
    """One limit.

    Parameters
    ----------
    code : of the error.
    variable : of the environment that replaces ``default``.
    default : how much is allowed.
    unit : of what.
    """

    code: str
    variable: str
    default: int
    unit: str

    @property
    def allowed(self) -> int:
        """How much is allowed in this process now.

        Raises
        ------
        SettingError : the variable is not a whole number from 1 to 1e12.
        """
        given = os.environ.get(self.variable, "")
        if not given:
            return self.default
        digits = given if given.isascii() and given.isdigit() and len(given) <= 13 else "0"
        if not 1 <= int(digits) <= _END:
            allowed = f"a whole number of {self.unit}, 1 to {_END:,}"
            raise SettingError("LIMIT_VARIABLE", repr(given), where=self.variable, allowed=allowed)
        return int(digits)

    def demand(
        self, needed: int, what: str, *, where: str = "", instead: str = "", least: bool = False
    ) -> None:
        """Refuse what needs more.

        Parameters
        ----------
        needed : in the limit's unit.
        what : what needs so much, such as ``the path``.
        where : file or option that it comes from.
        instead : what else helps, such as another option.
        least : whether ``needed`` is a lower bound.

        Raises
        ------
        LimitError : it is more than is allowed.
        """
        if needed > self.allowed:
            more = f"{self.variable}={needed}" + (" or more" if least else "")
            raise LimitError(
                self.code,
                f"{what} needs {'at least ' if least else ''}{needed:,} {self.unit}",
                where=where,
                allowed=f"{self.allowed:,} {self.unit}",
                todo=f"{instead}, or allow it: {more}" if instead else f"allow it: {more}",
            )


MEMORY = Limit("MEMORY", "LAMPYRIS_MAX_MEMORY", 2048, "MiB")
"""Memory that planning on a map may take, as estimated from its size and the planner."""

PATH = Limit("PATH_LENGTH", "LAMPYRIS_MAX_PATH", 1_000_000, "cells")
"""Cells of a path that is judged, timed and reported: up to 600 bytes and 7 microseconds each."""

NODES = Limit("NODES", "LAMPYRIS_MAX_NODES", 500_000, "nodes")
"""Nodes of a sampled path, where speeds are decided: some 2 KiB and 70 microseconds each."""

TICKS = Limit("TICKS", "LAMPYRIS_MAX_TICKS", 250_000, "ticks")
"""Ticks of a simulation without a given end: some 2 milliseconds each."""

DECISIONS = Limit("DECISIONS", "LAMPYRIS_MAX_DECISIONS", 100_000, "decisions")
"""Decisions of a drive, one a period: some 0.1 milliseconds each, and as much for each obstacle near."""

LIMITS = (MEMORY, PATH, NODES, TICKS, DECISIONS)
"""All of them."""

PER_CELL = 100
"""Bytes that planners take for a cell of the map and of its border at the most."""
PER_STATE = 11
"""Bytes of a state of a lattice."""


def demand_states(
    height: int, width: int, border: int, headings: int, planner: str, *, each: int = PER_STATE
) -> None:
    """Refuse a search of cells and headings that would take more memory than is allowed.

    Parameters
    ----------
    height, width : of the map, cells.
    border : cells around the map that the robot's motions may reach.
    headings : states of a cell.
    planner : its name.
    each : bytes of a state.

    Raises
    ------
    LimitError : ``MEMORY``.
    """
    cells = (height + 2 * border) * (width + 2 * border)
    needed = -(-cells * (PER_CELL + headings * each) // 2**20)
    what = f"planning with {planner} on {width:,} x {height:,} cells, {headings} headings and motions of {border:,} cells"
    MEMORY.demand(needed, what, instead="take a smaller map or a coarser resolution")


def demand_memory(height: int, width: int, border: int, what: str) -> None:
    """Refuse to work on a map that would take more memory than is allowed.

    Parameters
    ----------
    height, width : of the map, cells.
    border : how wide the border is that searches lay around it; a map of one row has more border than cells.
    what : the caller, such as ``planning with astar``.

    Raises
    ------
    LimitError : ``MEMORY``.
    """
    cells = (height + 2 * border) * (width + 2 * border)
    needed = -(-cells * PER_CELL // 2**20)
    if needed <= MEMORY.allowed:
        return
    MEMORY.demand(needed, f"{what} on {width:,} x {height:,} cells", instead="take a smaller map")

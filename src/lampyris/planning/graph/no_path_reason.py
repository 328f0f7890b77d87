"""Why there is no path: walls or moving obstacles, and how much of the map is left on either side."""

from __future__ import annotations

from typing import Protocol

from lampyris.kernels.graph.search import EXHAUSTED, FOUND, LIMIT
from lampyris.model.plan import Plan, Status
from lampyris.planning.graph.grid_graph import SearchResult
from lampyris.typing import Cell


class Finder(Protocol):
    """A search over the map as it is without moving obstacles."""

    def find_path(self, start: Cell, goal: Cell, budget: int | None = None) -> SearchResult:
        """Cheapest path between two free cells."""
        ...

    def region(self, cell: Cell, budget: int | None = None) -> SearchResult:
        """How many cells can be reached from a free cell: the expansions of the answer."""
        ...


def why_not(
    name: str,
    finder: Finder,
    start: Cell,
    goal: Cell,
    *,
    spent: int,
    budget: int | None,
    here: int | None,
) -> Plan:
    """The plan of a search that found no path.

    Parameters
    ----------
    name : the planner.
    finder : asked for a path without obstacles, and for the size of the goal's region.
    start, goal : free cells.
    spent : expansions so far; what is found out here comes on top.
    budget : of all of it; None: no limit.
    here : how many cells can be reached from the start, if that is known, and that no obstacle is to blame;
        None: not known.
    """

    def left() -> int | None:
        return None if budget is None else budget - spent

    def failed(status: Status, detail: str = "") -> Plan:
        return Plan(status, name, iterations=1, expansions=spent, detail=detail)

    if here is None:
        static = finder.find_path(start, goal, left())
        spent += static.expansions
        if static.ending == LIMIT:
            return failed(Status.LIMIT)
        if static.ending == FOUND:
            return failed(Status.HEMMED_IN, "No path for now: walls leave a path, moving obstacles close it.")
        here = static.expansions
    there = finder.region(goal, left())
    spent += there.expansions
    size = f"{there.expansions}" if there.ending == EXHAUSTED else f"over {there.expansions}"
    regions = f"start region {here} cells, goal region {size} cells"
    return failed(Status.NO_PATH, f"{Status.NO_PATH.sentence[:-1]} ({regions}).")

"""What a search on a lattice is asked: the states at both ends, and what the curves to them cost."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from lampyris.planning.lattice.ends.joined_end import AT_STATES, Ends


class Query(NamedTuple):
    """The states at which a path may begin and end.

    Parameters
    ----------
    starts, goals : cell index and heading of each; of a joined end the states that it is joined to.
    start_costs, goal_costs : of the curves between the ends and their states, in units of the lattice; 0 where there are none.
    ends : the poses at the ends.
    """

    starts: list[tuple[int, int]]
    goals: list[tuple[int, int]]
    start_costs: list[int]
    goal_costs: list[int]
    ends: Ends

    @classmethod
    def between(
        cls, starts: list[tuple[int, int]], goals: list[tuple[int, int]], ends: Ends = AT_STATES
    ) -> Query:
        """From states, or a joined start, to states, or a joined goal.

        Parameters
        ----------
        starts, goals : what counts where the end is not joined.
        """
        start, goal = ends
        begun, begun_costs = (starts, [0] * len(starts)) if start is None else (start.states, start.costs)
        ended, ended_costs = (goals, [0] * len(goals)) if goal is None else (goal.states, goal.costs)
        return cls(begun, ended, begun_costs, ended_costs, ends)

    def starting_at(self, kept: list[int]) -> Query:
        """The same with some of the starts, by their numbers."""
        return self._replace(
            starts=[self.starts[k] for k in kept], start_costs=[self.start_costs[k] for k in kept]
        )

    def ending_at(self, kept: list[int]) -> Query:
        """The same with some of the goals, by their numbers."""
        return self._replace(
            goals=[self.goals[k] for k in kept], goal_costs=[self.goal_costs[k] for k in kept]
        )

    def known_in(self, heuristic: NDArray[np.int64]) -> Query:
        """The same with those of its goals that a heuristic is known at."""
        return self.ending_at([k for k, (cell, _) in enumerate(self.goals) if heuristic[cell] >= 0])

    @property
    def goal_key(self) -> object:
        """What the heuristic depends on besides the map; equal for queries with the same."""
        return frozenset(cell for cell, _ in self.goals) if self.ends.goal is None else self.ends.goal

    @property
    def field_cells(self) -> tuple[int, ...]:
        """The cells, rising, whose field the heuristic comes from: of the goals, or of a joined goal's cheapest state."""
        if self.ends.goal is not None:
            return (self.ends.goal.states[0][0],)
        return tuple(sorted({cell for cell, _ in self.goals}))

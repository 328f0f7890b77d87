"""Following: the plan a robot is on, how far along it is, and until when it is to ask nobody."""

from __future__ import annotations

from dataclasses import dataclass, field

from lampyris.errors import InternalFault
from lampyris.model.plan import Plan
from lampyris.typing import Cell, Cells


@dataclass(slots=True)
class Following:
    """A path that is being driven.

    Attributes
    ----------
    route : its cells; empty if the plan found none.
    at : the index of the robot's cell.
    until : the index of the last cell that the plan commits to.
    ticks : when each cell is to be entered, None for one step a tick.
    until_tick : with ticks, the last tick that the plan commits to.
    counted : whether the plan's iterations have been added up.
    cells : the route as an array, int32 (n, 2), as the plan has it; None: it is known as a list alone.
    """

    route: list[Cell] = field(default_factory=list)
    at: int = 0
    until: int = 0
    ticks: list[int] | None = None
    until_tick: int = 0
    counted: bool = False
    cells: Cells | None = field(default=None, compare=False, repr=False)  # the same as `route`

    @property
    def ahead(self) -> Cell | None:
        """The next cell, committed to or not."""
        return self.route[self.at + 1] if self.at + 1 < len(self.route) else None

    @property
    def to_be_driven(self) -> bool:
        """Whether a step is left that the plan commits to."""
        return self.at < self.until

    def waits(self, now: int) -> bool:
        """Whether the plan says to stay in the tick ``now``."""
        if self.ticks is None or now > self.until_tick or self.at + 1 >= len(self.route):
            return False
        return self.ticks[self.at + 1] > now


def follow(plan: Plan, robot: Cell) -> Following:
    """Begin to follow a plan from where the robot stands.

    Raises
    ------
    InternalFault : the plan begins somewhere else: a bug of the planner.
    """
    if plan.path is None:
        return Following()
    route = list(zip(*plan.path.cells.T.tolist(), strict=True))
    if route[0] != robot:
        raise InternalFault("PLAN_START", f"{plan.planner} planned from {route[0]}, the robot is at {robot}")
    steps = len(route) - 1
    if plan.schedule is None:
        # At least one step, or the same question would be asked forever.
        until = steps if plan.commit is None else max(min(plan.commit, steps), min(steps, 1))
        return Following(route, until=until, cells=plan.path.cells)
    ticks = plan.schedule.tolist()
    last = ticks[-1] if plan.commit is None else ticks[0] + plan.commit
    return Following(
        route, until=sum(t <= last for t in ticks) - 1, ticks=ticks, until_tick=last, cells=plan.path.cells
    )

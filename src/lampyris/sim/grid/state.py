"""The state of a simulation in ticks: what changes from tick to tick, besides the places of the obstacles."""

from __future__ import annotations

from dataclasses import dataclass, field

from lampyris.model.plan import Plan
from lampyris.model.trace import Event, Outcome
from lampyris.sim.grid.following import Following
from lampyris.typing import Cell


@dataclass(slots=True)
class SimulationState:
    """What a simulation has done, and where it is in its plan.

    Parameters
    ----------
    cells : the robot's cell at each tick.
    tracks : cell number of each obstacle at each tick, from its appearance on.
    last_tick : the simulation ends with it; None until the first plan is known.
    now : the last tick that is over.
    plan : the planner's last answer; None before the first.
    following : the robot's place on that plan.
    started : whether there was anything to drive.
    outcome, detail : how it ended; None while it has not.
    speeds, causes : at each tick.
    events : in order.
    gates_met : gates that have been replanned for.
    map_news : why the plan is out of date because walls have changed; empty: it is not.
    repaired : whether moving obstacles count as walls in the plan.
    waiting, holding : ticks in a row that the robot has waited: for an obstacle, by its schedule.
    replans, waits, path_switches, iterations, expansions : counts.
    planning_s, total_s, loading_s : seconds.
    """

    cells: list[Cell]
    tracks: list[list[int]]
    last_tick: int | None
    now: int = 0
    plan: Plan | None = None
    following: Following = field(default_factory=lambda: Following(counted=True))
    started: bool = True
    outcome: Outcome | None = None
    detail: str = ""
    speeds: list[float] = field(default_factory=lambda: [0.0])
    causes: list[str] = field(default_factory=lambda: ["start"])
    events: list[Event] = field(default_factory=list)
    gates_met: set[Cell] = field(default_factory=set)
    map_news: str = ""
    repaired: bool = False
    waiting: int = 0
    holding: int = 0
    replans: int = 0
    waits: int = 0
    path_switches: int = 0
    iterations: int = 0
    expansions: int = 0
    planning_s: float = 0.0
    total_s: float = 0.0
    loading_s: float = 0.0

"""Plans of fleets for the page: from the beginning, and again from where the robots are when a wall is painted."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Mapping
from time import perf_counter
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from lampyris import fleets
from lampyris.app.engine.fleets.alone import conflicts_alone
from lampyris.app.engine.frames import json_frame, layer_frame, paths_frame
from lampyris.app.engine.layers import grid_at
from lampyris.app.engine.parse import scenario_of_request
from lampyris.app.engine.progress import SELDOM, tell
from lampyris.errors import FileError, LimitError, SettingError, shown
from lampyris.kernels import _jit
from lampyris.model.fleet.fleet import Agent, Fleet
from lampyris.model.fleet.fleet_plan import FleetPlan
from lampyris.model.grid import Grid
from lampyris.planning.base import Budget
from lampyris.typing import BoolGrid, Cell

MOST_ROBOTS: Final = 1_000
MOST_SECONDS: Final = 30.0
"""Seconds of planning; a job of the app may use twice as much processor time."""
MOST_PLACES: Final = 25_000_000
"""Robots times ticks of a plan: the page holds four bytes for each."""
STEPS: Final = ((0, 0), (1, 0), (0, 1), (-1, 0), (0, -1))
"""What a robot does in a tick, by its number in a frame: waits, or steps on x or y."""

Looks = Callable[[], None]


def fleet(question: Mapping[str, Any], look: Looks) -> Iterator[bytes]:
    """A plan for all robots: ``H R L Z``; ``L`` are the conflicts that it avoids, by cell.

    Parameters
    ----------
    question : ``scenario``: its map and the walls painted on it (edits of tick 0). ``robots``: how many, drawn at random
        with ``seed``; or ``agents``: a flat list of four numbers each, the cell where it is and its goal. ``planner``,
        ``settings``, ``seconds``: as ``lampyris fleet`` takes them.

    Raises
    ------
    SettingError : ``ROBOTS``, ``AGENTS``, ``SECONDS``.
    LimitError : ``FLEET_PLACES``: the plan is too long for the page.
    LampyrisError : as :func:`lampyris.plan_fleet`.
    """
    grid = ground_of(question)
    seed = question.get("seed", 0)
    planner = question.get("planner", fleets.PLANNER)
    seconds = seconds_of(question)
    lost: list[int] = []
    if question.get("agents") is None:
        made = fleets.random_fleet(grid, robots_of(question, MOST_ROBOTS), seed=seed)
    else:
        made, lost = present_fleet(grid, question["agents"])
    yield json_frame("H", {"job": question.get("job"), "robots": len(made), "planner": planner, "seed": seed})
    _load(planner)
    look()
    tell("planning", done=0, cost=None)
    last = perf_counter()

    def progress(done: int, cost: int | None) -> None:
        nonlocal last
        look()
        if perf_counter() - last >= SELDOM:
            last = perf_counter()
            tell("planning", done=done, cost=cost)

    found = fleets.plan_fleet(
        made, planner, seed=seed, budget=Budget(seconds=seconds), progress=progress,
        planner_settings=question.get("settings") or {},
    )  # fmt: skip
    look()
    if found.paths:
        ticks = max(len(path) for path in found.paths)
        if ticks * len(made) > MOST_PLACES:
            raise LimitError(
                "FLEET_PLACES", f"{len(made):,} robots for {ticks:,} ticks", allowed=f"{MOST_PLACES:,} robots times ticks",
                todo="take fewer robots, or lampyris fleet on the command line",
            )  # fmt: skip
        yield paths_frame(found.paths, made.goals, found.shortest)
    tell("counting", done=0)
    alone = conflicts_alone(made, look)
    if alone is not None:
        yield layer_frame("conflicts", np.where(alone.where > 0, alone.where, np.nan))
    avoided = None if alone is None else {"vertex": alone.vertex, "swap": alone.swap}
    yield json_frame("Z", {**ending(found), "lost": lost, "alone": avoided})


def ground_of(question: Mapping[str, Any]) -> Grid:
    """The map of a question with the walls painted on it.

    Raises
    ------
    LampyrisError : as :func:`lampyris.app.engine.parse.scenario_of_request`.
    """
    scenario = question.get("scenario")
    if not isinstance(scenario, dict):
        raise FileError("KEY", "no scenario", where="scenario", allowed="a table")
    # Ends anywhere: what is looked at is the map.
    ends = {"start": [0, 0], "goal": [1, 1]}
    asked = {**question, "scenario": {"version": 1, **scenario, **ends}}
    scene = scenario_of_request(asked).scene
    return grid_at(scene, 0)


def robots_of(question: Mapping[str, Any], most: int) -> int:
    """How many robots are asked for.

    Raises
    ------
    SettingError : ``ROBOTS``.
    """
    robots: Any = question.get("robots")
    if type(robots) is not int or not 1 <= robots <= most:
        allowed = f"a whole number, 1 to {most:,}"
        raise SettingError("ROBOTS", shown(robots), where="robots", allowed=allowed)
    return robots


def present_fleet(grid: Grid, agents: Any) -> tuple[Fleet, list[int]]:
    """Robots where they are now, and those of them whose goal a wall has taken or cut off.

    Each of the latter is sent to the nearest cell that is nobody's goal, so that the others can be planned around it.

    Raises
    ------
    SettingError : ``AGENTS``: no flat list of four numbers a robot.
    LampyrisError : as :class:`lampyris.Fleet`: a robot on a wall or off the map, two in one cell.
    """
    right = isinstance(agents, list) and agents and len(agents) % 4 == 0 and len(agents) <= 4 * MOST_ROBOTS
    if not right or not all(type(one) is int and 0 <= one < 2**15 for one in agents):
        allowed = f"four cells' coordinates (x, y, goal x, goal y) for each of 1 to {MOST_ROBOTS:,} robots"
        raise SettingError("AGENTS", shown(agents), where="agents", allowed=allowed)
    rows = [((x, y), (gx, gy)) for x, y, gx, gy in zip(*(iter(agents),) * 4, strict=True)]
    from scipy import ndimage

    regions, _ = ndimage.label(~grid.blocked)
    lost = [k for k, (at, goal) in enumerate(rows) if _cut_off(grid, regions, at, goal)]
    taken = {goal for k, (_, goal) in enumerate(rows) if k not in set(lost)}
    robots = [Agent(at, goal) for at, goal in rows]
    for k in lost:
        robots[k] = Agent(rows[k][0], parking(grid.blocked, rows[k][0], taken))
        taken.add(robots[k].goal)
    return Fleet(grid, robots), lost


def _cut_off(grid: Grid, regions: NDArray[Any], at: Cell, goal: Cell) -> bool:
    """Whether a robot cannot reach its goal any more. Where it stands is checked by the fleet."""
    if not grid.contains(goal) or not grid.contains(at):
        return not grid.contains(goal)
    return bool(grid.blocked[goal[1], goal[0]] or regions[goal[1], goal[0]] != regions[at[1], at[0]])


def parking(blocked: BoolGrid, at: Cell, taken: set[Cell]) -> Cell:
    """The cell with the fewest steps from ``at`` that is not taken; ``at`` itself if all are."""
    height, width = blocked.shape
    seen, waiting = {at}, deque([at])
    while waiting:
        x, y = waiting.popleft()
        if (x, y) not in taken:
            return (x, y)
        for dx, dy in STEPS[1:]:
            cell = (x + dx, y + dy)
            inside = 0 <= cell[0] < width and 0 <= cell[1] < height
            if inside and cell not in seen and not blocked[cell[1], cell[0]]:
                seen.add(cell)
                waiting.append(cell)
    return at


def ending(found: FleetPlan) -> dict[str, Any]:
    """How planning ended, as ``lampyris fleet --json`` names it."""
    return {
        "status": found.status.value,
        "found": bool(found),
        "sentence": found.sentence,
        "planner": found.planner,
        "makespan": found.makespan,
        "sum_of_costs": found.sum_of_costs,
        "lower_bound": found.lower_bound,
        "gap": found.gap,
        "iterations": found.iterations,
        "notes": list(found.notes),
        "timing": dict(found.timing),
    }


def seconds_of(question: Mapping[str, Any]) -> float | None:
    """Seconds that planning may take; None: until there is a plan.

    Raises
    ------
    SettingError : ``SECONDS``.
    """
    given: Any = question.get("seconds")
    if given is None:
        return None
    if isinstance(given, bool) or not isinstance(given, int | float) or not 0 < given <= MOST_SECONDS:
        allowed = f"more than 0, at most {MOST_SECONDS:g}"
        raise SettingError("SECONDS", shown(given), where="seconds", allowed=allowed)
    return float(given)


def _load(planner: str) -> None:
    """Load or compile what a planner runs: the seconds are for planning."""
    if _jit.jit_disabled():
        return
    small = Fleet(Grid([[False] * 3] * 2), [Agent((0, 0), (2, 1)), Agent((2, 0), (0, 1))])
    with _jit.compiled_only():
        fleets.plan_fleet(small, planner)

"""What a scenario file of a fleet may hold: one pydantic model a table, as :mod:`lampyris.io.scenario.schema`.

Tables of other scenario files mean the same here. A scenario with the key ``fleet`` is one of a fleet.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeAlias

from pydantic import Discriminator, Field, Tag

from lampyris.io.fleet_scenario.scenario import LIFELONG_PLANNER, MAX_ITERATIONS, MAX_TIME, PLANNER
from lampyris.io.scenario.declared_table import table_of
from lampyris.io.scenario.schema import NameOrTable, Place, RobotTable, ScenarioHead, schema_of
from lampyris.io.scenario.schema_types import FileName, Rule, Seed, Table
from lampyris.model.fleet.delays import Delays
from lampyris.model.fleet.lifelong import MAX_RELEASE, MAX_WINDOW
from lampyris.model.settings.fleet_drive import FleetDriveSettings
from lampyris.model.settings.simulation import MAX_TICKS

VERSION = 1
MAX_ROBOTS = 100_000
_COUNT = Rule("ROBOTS", f"a whole number, 1 to {MAX_ROBOTS:,}")
Robots: TypeAlias = Annotated[Annotated[int, Field(ge=1, le=MAX_ROBOTS)], _COUNT]
_RADIUS = Rule("FLEET_ROBOT", "0 to 1e6 metres")


class AgentTable(Table):
    """One robot of the fleet."""

    start: Place = Field(description="Where it starts.")
    goal: Place = Field(description="Where it goes.")
    radius: Annotated[Annotated[float, Field(ge=0, le=1e6)] | None, _RADIUS] = Field(
        None, description="Its radius, metres; null: that of `robot`."
    )
    tasks: list[Place] = Field(
        [], description="Cells that it visits after its goal, one after another, with `lifelong`."
    )


class AgentsFleet(Table):
    """Robots that are listed."""

    agents: Annotated[
        list[AgentTable],
        Field(min_length=1, max_length=MAX_ROBOTS),
        Rule("FLEET", "a list of {start: ..., goal: ...}, one or more"),
    ] = Field(description="The robots.")


class ScenFleet(Table):
    """The first lines of a MovingAI .scen."""

    scen: FileName = Field(description="Its path, relative to the scenario file's folder.")
    robots: Robots | None = Field(None, description="How many lines; null: all.")


class FileFleet(Table):
    """A list of agents in a file of its own, or a problem of the League of Robot Runners."""

    file: FileName = Field(description="Its path, relative to the scenario file's folder.")
    robots: Robots | None = Field(None, description="How many of its robots; null: all.")


class RandomFleet(Table):
    """Robots with random starts and goals in the largest region of the map."""

    random: Robots = Field(description="How many.")
    seed: Seed | None = Field(None, description="Of the draws; null: the scenario's.")


FLEET_KEYS = ("agents", "scen", "file", "random")


def _fleet_kind(value: Any) -> str | None:
    """The form of a fleet by its key; None: no such key, or more than one."""
    found = [f"fleet-{key}" for key in FLEET_KEYS if isinstance(value, dict) and key in value]
    return found[0] if len(found) == 1 else None


FleetSpec: TypeAlias = Annotated[
    Annotated[AgentsFleet, Tag("fleet-agents")]
    | Annotated[ScenFleet, Tag("fleet-scen")]
    | Annotated[FileFleet, Tag("fleet-file")]
    | Annotated[RandomFleet, Tag("fleet-random")],
    Discriminator(_fleet_kind),
    Rule(
        "FLEET",
        "one of {random: N}, {agents: [{start: ..., goal: ...}]}, {scen: FILE, robots: N} and {file: FILE, robots: N}",
        keys=FLEET_KEYS,
    ),
]


class FleetBudgetTable(Table):
    """When the planner stops."""

    iterations: Annotated[
        Annotated[int, Field(ge=1, le=MAX_ITERATIONS)] | None,
        Rule("BUDGET", f"a whole number, 1 to {MAX_ITERATIONS:,}, or null"),
    ] = Field(None, description="Iterations of the planner; lacam and lns improve their plans until then.")
    seconds: Annotated[
        Annotated[float, Field(gt=0, le=1e6)] | None,
        Rule("BUDGET", "more than 0 and at most 1e6 seconds, or null"),
    ] = Field(None, description="The same in seconds. The result then depends on the machine.")


class TaskTable(Table):
    """A task of a lifelong fleet."""

    stops: Annotated[list[Place], Field(min_length=1), Rule("TASK", "one or more cells [x, y]")] = Field(
        description="Cells to visit in this order."
    )
    release: Annotated[int, Field(ge=0, le=MAX_RELEASE), Rule("TASK", "a tick, a whole number >= 0")] = Field(
        0, description="Tick from which on a robot may have it."
    )
    robot: Annotated[
        Annotated[int, Field(ge=0, lt=MAX_ROBOTS)] | None,
        Rule("TASK", "the number of a robot, from 0, or null"),
    ] = Field(None, description="The robot that has to do it; null: whichever is free.")


class WindowsTable(Table):
    """Robots that have arrived get new tasks, cells drawn at random."""

    ticks: Annotated[int, Field(ge=1, le=MAX_TICKS), Rule("TICKS", f"a whole number, 1 to {MAX_TICKS:,}")] = (
        Field(description="How long.")
    )
    window: Annotated[
        Annotated[int, Field(ge=1, le=MAX_WINDOW)] | None,
        Rule("WINDOW", f"a whole number, 1 to {MAX_WINDOW:,}, or null"),
    ] = Field(None, description="Ticks driven before planning again; null: 1 with pibt, 5 with lacam.")


class LifelongTable(WindowsTable):
    """Robots that have arrived get new tasks."""

    tasks: Annotated[list[TaskTable] | None, Rule("TASK", "a list of {stops: [[x, y]]}, or null")] = Field(
        None, description="The tasks; null: those of the fleet's file, or random cells."
    )
    tasks_file: FileName | None = Field(
        None, description="A table of tasks (.csv) instead, relative to the scenario file's folder."
    )


class FaultTable(Table):
    """A robot that stops permanently."""

    robot: Annotated[int, Field(ge=0), Rule("FAULTS", "the number of a robot, from 0")] = Field(
        description="Its number, from 0."
    )
    time: Annotated[float, Field(ge=0, lt=MAX_TIME), Rule("FAULTS", "a number >= 0, less than 1e12")] = Field(
        description="Second of the drive, or tick of the lifelong fleet."
    )


if TYPE_CHECKING:
    ExecuteTable: TypeAlias = Table
else:
    _Drive = table_of(
        "ExecuteTable", FleetDriveSettings, "How the robots drive in continuous time.", "FLEET_DRIVE"
    )
    _Delays = table_of("DelaysTable", Delays, "Random delays of moves.", "DELAYS")

    class ExecuteTable(_Drive):
        """How the robots drive in continuous time."""

        delays: _Delays = Field(_Delays.model_validate({}), description="Random delays of moves.")


class FleetScenarioFile(ScenarioHead):
    """A lampyris scenario of a fleet: everything that decides a plan of many robots, or their drive."""

    cell: Annotated[
        Annotated[float, Field(ge=1e-6, le=1e6)] | None,
        Rule("CELL", "a whole multiple of the map's resolution"),
    ] = Field(
        None,
        description="Side of larger cells in metres, for maps whose own are smaller than the robots; null: the map's own.",
    )
    fleet: FleetSpec = Field(description="The robots.")
    robot: RobotTable | None = Field(
        None, description="Size and limits of the robots; null: each fits in its cell."
    )
    moves: Annotated[Literal["four-connected", "octile"], Rule("MOVES", "four-connected or octile")] = Field(
        "four-connected",
        description="A step to one of four or eight neighbours, or a wait; each takes a tick.",
    )
    planner: NameOrTable | None = Field(
        None,
        description=f"The planner: see `lampyris planners`; null: {PLANNER}, with `lifelong` {LIFELONG_PLANNER}.",
    )
    budget: FleetBudgetTable = Field(
        FleetBudgetTable.model_validate({}),
        description="When the planner stops; without it its first plan is taken.",
    )
    seed: Seed = Field(0, description="Seed of all random draws: same seed, same bytes.")
    execute: ExecuteTable | None = Field(
        None, description="Present, if empty ({}): the robots drive in continuous time."
    )
    lifelong: LifelongTable | None = Field(
        None, description="Present: robots that have arrived get new tasks. Not beside `execute`."
    )
    faults: Annotated[list[FaultTable], Rule("FAULTS", "a list of {robot: K, time: T}")] = Field(
        [], description="Robots that stop permanently, with `execute` or `lifelong`."
    )


def json_schema() -> dict[str, Any]:
    """The JSON Schema of scenario files of fleets."""
    return schema_of(FleetScenarioFile, "lampyris scenario of a fleet")

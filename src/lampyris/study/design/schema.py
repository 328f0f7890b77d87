"""What a study file may hold: one pydantic model a table, which is its check and its published schema.

Tables of scenario files mean the same here. pydantic is imported by this module when a study file is read.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeAlias

from pydantic import AfterValidator, Discriminator, Field, StringConstraints, Tag
from pydantic_core import PydanticCustomError

from lampyris._core import defaults
from lampyris._core.defaults import MOBILITY, TRACKS
from lampyris.io.fleet_scenario.schema import ExecuteTable, WindowsTable
from lampyris.io.scenario.declared_table import key_of
from lampyris.io.scenario.run_settings import DriveTable, InflationTable
from lampyris.io.scenario.scenario import PRESETS
from lampyris.io.scenario.schema import (
    MAP_KEYS,
    OUTLINE,
    RECTANGLE,
    BundledMap,
    Count,
    End,
    FileMap,
    Named,
    Outline,
    Radius,
    RecipeMap,
    Rectangle,
    RobotTable,
    RowsMap,
    schema_of,
)
from lampyris.io.scenario.schema_types import Pair, Rule, Seed, Table, Word
from lampyris.io.text.strict_yaml import shown
from lampyris.io.tracks.csv_tracks import MAX_TICKS
from lampyris.model.settings.simulation import SimulationSettings
from lampyris.sim.traffic.mobility import MOBILITIES

VERSION = 1
MAX_ENTRIES = 1000
"""Entries of a list in a study file."""
MAX_QUERIES = 100_000
"""Queries drawn on one map."""
MAX_SEEDS = 1_000_000
MAX_ABOUT = 4000
MAX_ROBOTS = 100_000
"""Robots of a fleet."""
EXPANSIONS = 5_000_000
"""Budget of one call of a planner where none is given."""

_FileName: TypeAlias = Annotated[
    str,
    StringConstraints(min_length=1, max_length=1000),
    Rule("PATH_FORM", "a path with / between its parts, relative to the study's folder"),
]
_RELATIVE = "Its path, relative to the study file's folder or to --data."


if TYPE_CHECKING:
    Ticks: TypeAlias = int | None
    Patience: TypeAlias = int | None
    _TICKS: Any = None
    _PATIENCE: Any = None
    SensorRange: TypeAlias = float | None
    FieldOfView: TypeAlias = float
    UnseenCost: TypeAlias = float
    _FIELD_OF_VIEW: Any = None
    _UNSEEN_COST: Any = None
else:
    Ticks, _TICKS = key_of(SimulationSettings, "ticks")
    Patience, _PATIENCE = key_of(SimulationSettings, "patience")
    SensorRange, _ = key_of(SimulationSettings, "sensor_range")
    FieldOfView, _FIELD_OF_VIEW = key_of(SimulationSettings, "field_of_view")
    UnseenCost, _UNSEEN_COST = key_of(SimulationSettings, "unseen_cost")


def _by_type(**tags: str) -> Discriminator:
    """Which of several forms a value has, by the name of its type."""
    return Discriminator(lambda value: tags.get(type(value).__name__))


GoalTrack: TypeAlias = Annotated[
    Annotated[list[Pair], Field(min_length=1, max_length=MAX_TICKS)] | None,
    Rule("GOAL_TRACK", "one or more cells [x, y], one a tick, or null"),
]


# ---- maps and queries --------------------


class QueryTable(Table):
    """A query: from where to where."""

    start: End = Field(description="Where the robot starts.")
    goal: End = Field(description="Where it drives.")
    goal_track: GoalTrack = Field(
        None,
        description="The goal's cell at each tick from 0, which is `goal`; after the last it stays. Null: it stands still.",
    )


class RandomTable(Table):
    """Queries drawn from the study's seed: different pairs of free cells with a path between them."""

    random: Annotated[
        int, Field(ge=1, le=MAX_QUERIES), Rule("QUERIES", f"a whole number, 1 to {MAX_QUERIES:,}", limit=True)
    ] = Field(description="How many.")
    least: Annotated[float, Field(ge=0, le=1e6), Rule("QUERIES", "0 to 1e6 cells")] = Field(
        0.0, description="Least distance from start to goal, straight, in cells."
    )
    headings: bool = Field(
        False,
        description="Whether both ends have a heading, one of eight, with the footprint clear of walls; for planners of poses.",
    )


_Queries: TypeAlias = Annotated[
    Annotated[Literal["stored"], Rule("QUERIES", "stored, {random: N} or a list"), Tag("queries-word")]
    | Annotated[RandomTable, Tag("queries-random")]
    | Annotated[
        list[QueryTable],
        Field(min_length=1, max_length=MAX_QUERIES),
        Rule("QUERIES", "one or more queries"),
        Tag("queries-list"),
    ],
    _by_type(str="queries-word", dict="queries-random", list="queries-list"),
    Rule(
        "QUERIES",
        "stored, {random: N, least: CELLS, headings: true}, or a list of {start: [x, y], goal: [x, y]}",
    ),
]
_Limit: TypeAlias = Annotated[
    Annotated[int, Field(ge=1, le=MAX_QUERIES)] | None,
    Rule("QUERIES", f"a whole number, 1 to {MAX_QUERIES:,}, or null"),
]
_QUERIES = "Which queries; stored: those of the map, or its own start and goal."
_LIMIT = "At most so many of them, the first, the last and evenly between; null: all."
_CALLED = "What tables call the map; null: its own name."


class StudyBundled(BundledMap):
    """A bundled map (see `lampyris maps`). A name alone, instead of this table, means it and its queries."""

    queries: _Queries = Field("stored", description=_QUERIES)
    limit: _Limit = Field(None, description=_LIMIT)
    name: Word | None = Field(None, description=_CALLED)


class StudyFileMap(FileMap):
    """A map file: ROS YAML, PNG, BMP, PGM, MovingAI, text or NumPy."""

    file: _FileName = Field(description=_RELATIVE)
    queries: _Queries = Field("stored", description=_QUERIES)
    limit: _Limit = Field(None, description=_LIMIT)
    name: Word | None = Field(None, description=_CALLED)


class StudyRecipe(RecipeMap):
    """A map made by a seeded recipe (see `lampyris maps recipes`)."""

    queries: _Queries = Field("stored", description="Which queries; a recipe has no stored ones.")
    limit: _Limit = Field(None, description=_LIMIT)
    name: Word | None = Field(None, description=_CALLED)


class StudyRows(RowsMap):
    """A map written into the study."""

    queries: _Queries = Field("stored", description=_QUERIES)
    limit: _Limit = Field(None, description=_LIMIT)


class ScenTable(Table):
    """MovingAI benchmarks: the queries of a `.scen`, or of every `.scen` of a folder."""

    scen: _FileName = Field(
        description="Path of the file or folder, relative to the study's folder or --data."
    )
    limit: _Limit = Field(
        None, description="At most so many queries of each file, evenly over its buckets; null: all."
    )
    map: _FileName | None = Field(
        None, description="The map, or a folder of maps; null: the maps are beside the `.scen` files."
    )


def _map_kind(value: Any) -> str | None:
    if isinstance(value, str):
        return "map-name"
    return next((f"map-{key}" for key in _MAPS if isinstance(value, dict) and key in value), None)


_MAPS = ("scen", *MAP_KEYS)  # first what only it has: a `.scen` table may have `map`, too
StudyMap: TypeAlias = Annotated[
    Annotated[Word, Tag("map-name")]
    | Annotated[StudyBundled, Tag("map-bundled")]
    | Annotated[StudyFileMap, Tag("map-file")]
    | Annotated[StudyRecipe, Tag("map-recipe")]
    | Annotated[StudyRows, Tag("map-rows")]
    | Annotated[ScenTable, Tag("map-scen")],
    Discriminator(_map_kind),
    Rule("MAP", "a bundled name, or a table with bundled, file, recipe, rows or scen", keys=_MAPS),
]

# ---- who plans, by which law, among what --------------------

Grid: TypeAlias = Annotated[
    dict[str, Annotated[list[Any], Field(min_length=1), Rule("GRID", "a list of one or more values")]],
    Field(min_length=1),
    Rule("GRID", "{setting: [value, ...]}"),
]


class Swept(Named):
    """A name with settings, and settings to be tried in every combination."""

    grid: Grid | None = Field(None, description="Values of each setting; one entry for every combination.")
    label: Word | None = Field(
        None, description="What tables call it; null: its name and the settings given here."
    )


class Except(Table):
    """All but some."""

    except_: list[Word] = Field([], alias="except", description="Names that are left out.")


class AllTable(Table):
    """Every planner that is installed."""

    all: Except = Field(description="Which are left out; {} for none.")


def _planner_kind(value: Any) -> str | None:
    if isinstance(value, dict):
        return "config-all" if "all" in value else "config-table"
    return "config-word" if isinstance(value, str) else None


PlannerEntry: TypeAlias = Annotated[
    Annotated[Word, Tag("config-word")]
    | Annotated[Swept, Tag("config-table")]
    | Annotated[AllTable, Tag("config-all")],
    Discriminator(_planner_kind),
    Rule("TYPE", "a name, {name: ..., settings: {...}, grid: {...}}, all, or {all: {except: [...]}}"),
]


Planners: TypeAlias = Annotated[
    Annotated[Literal["all"], Rule("TYPE", "all, or a list of planners"), Tag("planners-word")]
    | Annotated[AllTable, Tag("planners-all")]
    | Annotated[
        list[PlannerEntry],
        Field(min_length=1, max_length=MAX_ENTRIES),
        Rule("PLANNERS", "one or more planners"),
        Tag("planners-list"),
    ],
    _by_type(str="planners-word", dict="planners-all", list="planners-list"),
    Rule("TYPE", "a list of planners, all, or {all: {except: [...]}}"),
]


LawEntry: TypeAlias = Annotated[
    Annotated[Word, Tag("law-word")] | Annotated[Swept, Tag("law-table")],
    _by_type(str="law-word", dict="law-table"),
    Rule("TYPE", "a name, or {name: ..., settings: {...}, grid: {...}}"),
]

_Kind: TypeAlias = Annotated[
    Literal["none", "random-walk", "patrol", "crossing", "mixed"],
    Rule("MOBILITY", ", ".join(("none", *MOBILITIES))),
]
_Rate: TypeAlias = Annotated[
    Annotated[float, Field(gt=0, le=1)] | None, Rule("TRAFFIC_RATE", "0 < rate <= 1, or null")
]
_Tracks: TypeAlias = Annotated[Literal["replayed", "live"], Rule("TRACKS", "replayed or live")]
_MANY: Any = Field(None, min_length=1, max_length=MAX_ENTRIES, description="Each of these, instead of one.")


class TrafficGrid(Table):
    """What is tried in every combination."""

    kind: list[_Kind] | None = _MANY
    count: list[Count] | None = _MANY
    rate: list[_Rate] | None = _MANY
    radius: list[Radius] | None = _MANY
    tracks: list[_Tracks] | None = _MANY


class TrafficTable(Table):
    """What moves besides the robot."""

    kind: _Kind = Field(MOBILITY, description="How they move; mixed: a third of each.")
    count: Count | None = Field(None, description="How many; null: the grid says.")
    rate: _Rate = Field(
        None, description="Chance a tick that one more random walker appears; null: all from the start."
    )
    radius: Radius = Field(0.0, description="Radius of each, metres; 0 is one cell.")
    footprint: Outline = Field(None, description=OUTLINE)
    rectangle: Rectangle = Field(None, description=RECTANGLE)
    tracks: _Tracks = Field(
        TRACKS,
        description="replayed: drawn once without the robot, the same for all planners; live: they wait for it.",
    )
    grid: TrafficGrid | None = Field(None, description="Values to be tried in every combination.")


TrafficEntry: TypeAlias = Annotated[
    Annotated[Literal["none"], Rule("MOBILITY", "none, or a table"), Tag("traffic-none")]
    | Annotated[TrafficTable, Tag("traffic-table")],
    _by_type(str="traffic-none", dict="traffic-table"),
    Rule("TYPE", "none, or {kind: ..., count: ...}"),
]


class SensorTable(Table):
    """A sensor in place of the map: the robot knows the walls that it has seen."""

    sensor_range: SensorRange = Field(
        None, description="How far it sees, metres. Null: as `none`, the map is known."
    )
    field_of_view: FieldOfView = _FIELD_OF_VIEW
    unseen_cost: UnseenCost = _UNSEEN_COST


SensorEntry: TypeAlias = Annotated[
    Annotated[Literal["none"], Rule("SENSOR", "none, or a table"), Tag("sensor-none")]
    | Annotated[SensorTable, Tag("sensor-table")],
    _by_type(str="sensor-none", dict="sensor-table"),
    Rule("TYPE", "none, or {sensor_range: METRES, field_of_view: DEGREES, unseen_cost: FACTOR}"),
]


# ---- the whole --------------------


_SEEDS_RULE = Rule("SEEDS", f"how many, 1 to {MAX_SEEDS:,}, or a list of whole numbers", True, limit=True)
Seeds: TypeAlias = Annotated[
    Annotated[int, Field(ge=1, le=MAX_SEEDS), _SEEDS_RULE, Tag("seeds-number")]
    | Annotated[list[Seed], Field(min_length=1), Rule("SEEDS", "one or more seeds"), Tag("seeds-list")],
    _by_type(int="seeds-number", list="seeds-list"),
    _SEEDS_RULE,
]


_ROBOTS_RULE = Rule("ROBOTS", f"a whole number, 1 to {MAX_ROBOTS:,}, or a list of them")
_Count: TypeAlias = Annotated[Annotated[int, Field(ge=1, le=MAX_ROBOTS)], _ROBOTS_RULE]
_Robots: TypeAlias = (
    Annotated[
        Annotated[_Count, Tag("robots-number")]
        | Annotated[
            list[_Count], Field(min_length=1, max_length=MAX_ENTRIES), _ROBOTS_RULE, Tag("robots-list")
        ],
        _by_type(int="robots-number", list="robots-list"),
        _ROBOTS_RULE,
    ]
    | None
)


def _swept(one: Any, rule: Rule) -> Any:
    """A number, a list of different ones, or null."""
    value = Annotated[one, rule]
    several = Annotated[list[value], Field(min_length=1, max_length=MAX_ENTRIES), rule, Tag("swept-list")]
    by_type = _by_type(float="swept-number", int="swept-number", list="swept-list")
    return Annotated[Annotated[value, Tag("swept-number")] | several, by_type, rule] | None


if TYPE_CHECKING:
    _Cell: TypeAlias = float | list[float] | None
    _Radii: TypeAlias = float | list[float] | None
    _Delayed: TypeAlias = float | list[float] | None
else:
    _Cell = _swept(
        Annotated[float, Field(ge=1e-6, le=1e6)],
        Rule("CELL", "a whole multiple of the map's resolution, or a list of them"),
    )
    _Radii = _swept(
        Annotated[float, Field(ge=0, le=1e6)], Rule("FLEET_ROBOT", "0 to 1e6 metres, or a list of them")
    )
    _Delayed = _swept(Annotated[float, Field(ge=0, le=1)], Rule("DELAYS", "0 to 1, or a list of them"))


class BudgetTable(Table):
    """When a run is stopped."""

    expansions: Annotated[
        Annotated[int, Field(ge=1, le=10**12)] | None, Rule("BUDGET", "a whole number >= 1, or null")
    ] = Field(
        None,
        description=f"Cells expanded by one call of a planner; without a budget: {EXPANSIONS:,}. "
        "Of fleets: iterations of the planner; without a budget: no limit.",
    )
    seconds: Annotated[
        Annotated[float, Field(ge=1e-3, le=1e6)] | None, Rule("BUDGET", "0.001 to 1e6 seconds, or null")
    ] = Field(None, description="CPU seconds of one run. Results then depend on the machine, and are marked.")


def _lines(text: str) -> str:
    if not all(c.isprintable() or c == "\n" for c in text):
        raise PydanticCustomError("text", "{what}", {"what": f"{shown(text)} is not printable"})
    return text


class StudyFile(Table):
    """A lampyris study: many runs of many planners in the same worlds."""

    version: Annotated[Literal[1], Rule("VERSION", "1", always=True)] = Field(
        description="Of this format: 1."
    )
    schema_: str | None = Field(
        None, alias="$schema", description="For editors. Not looked at, and never fetched."
    )
    name: Annotated[Word | None, Rule("TEXT", "1 to 64 printable characters")] = Field(
        None, description="What to call the study; null: the file's name without its ending."
    )
    about: Annotated[
        str,
        StringConstraints(max_length=MAX_ABOUT),
        AfterValidator(_lines),
        Rule("TEXT", f"at most {MAX_ABOUT:,} characters"),
    ] = Field("", description="What it asks, for people.")
    kind: Annotated[
        Literal["plan", "simulate", "drive", "fleet"] | None, Rule("KIND", "plan, simulate, drive or fleet")
    ] = Field(
        None,
        description="What a run is; null: fleet if there are `robots`, simulate if there is traffic, a sensor or a "
        "goal that moves, else plan.",
    )
    robots: _Robots = Field(
        None,
        description="In a study of fleets, how many robots: a number or several, each met by all planners.",
    )
    cell: _Cell = Field(
        None,
        description="In a study of fleets: side of larger cells in metres, or several; null: the map's own.",
    )
    radius: _Radii = Field(
        None,
        description="In a study of fleets: radius of all robots in metres, or several; null: that of `robot`.",
    )
    execute: ExecuteTable | None = Field(
        None, description="In a study of fleets, present, if empty ({}): the robots drive in continuous time."
    )
    delays: _Delayed = Field(
        None,
        description="With `execute`: chance that a move is delayed, or several; null: that of `execute`.",
    )
    lifelong: WindowsTable | None = Field(
        None,
        description="In a study of fleets, present: robots that have arrived get new tasks. Not beside `execute`.",
    )
    preset: Annotated[Literal["robot", "dissertation"], Rule("PRESET", ", ".join(PRESETS))] = Field(
        defaults.PRESET,
        description="Moves and law where they are not given: octile and physical, or its own.",
    )
    moves: Annotated[
        Literal["dissertation", "octile", "four-connected", "sixteen-connected"] | None,
        Rule("MOVES", "dissertation, octile, four-connected or sixteen-connected"),
    ] = Field(None, description="Which steps the robot makes; null: the preset's.")
    robot: RobotTable = Field(RobotTable.model_validate({}), description="Size and limits, SI units.")
    inflation: InflationTable = Field(
        InflationTable.model_validate({}),
        description="Costs of the cells near walls; without it there are none.",
    )
    maps: Annotated[
        list[StudyMap], Field(min_length=1, max_length=MAX_ENTRIES), Rule("MAPS", "one or more maps")
    ] = Field(description="Maps with their queries.")
    planners: Planners = Field(description="The planner: see `lampyris planners`.")
    laws: Annotated[
        Annotated[list[LawEntry], Field(min_length=1, max_length=MAX_ENTRIES)] | None,
        Rule("LAWS", "one or more speed laws"),
    ] = Field(None, description="Speed laws (see `lampyris laws`); null: the preset's.")
    traffic: Annotated[
        list[TrafficEntry],
        Field(min_length=1, max_length=MAX_ENTRIES),
        Rule("TRAFFIC", "one or more entries; none for a world without obstacles"),
    ] = Field(["none"], description="What moves besides the robot: every entry is a world of its own.")
    sensors: Annotated[
        list[SensorEntry],
        Field(min_length=1, max_length=MAX_ENTRIES),
        Rule("SENSORS", "one or more entries; none for a map that is known"),
    ] = Field(
        ["none"],
        description="What the robot sees of a map that it does not know: every planner plans with each entry.",
    )
    seeds: Seeds = Field(1, description="Numbers of the seeds: how many, from 0 on, or which.")
    seed: Seed = Field(0, description="Seed of all random draws: same seed, same bytes.")
    budget: BudgetTable | None = Field(
        BudgetTable.model_validate({"expansions": EXPANSIONS}),
        description="When a run is stopped; null: never.",
    )
    ticks: Ticks = _TICKS
    patience: Patience = _PATIENCE
    drive: DriveTable | None = Field(None, description="How to drive, for `kind: drive`; null: its defaults.")
    memory: bool = Field(False, description="Whether memory is measured, in a second run of each job.")


def json_schema() -> dict[str, Any]:
    """The JSON Schema of study files."""
    return schema_of(StudyFile, "lampyris study")

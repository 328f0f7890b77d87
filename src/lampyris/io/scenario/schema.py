"""What a scenario file may hold: one pydantic model a table, which is its check and its published schema.

The models say shape, type and range, with the code of the error and the words for what is allowed beside each
field. They hold plain data; :mod:`lampyris.io.scenario.build` makes nouns of it. pydantic is imported by this
module and by nobody else's import of the package: it takes 70 ms.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeAlias

from pydantic import Discriminator, Field, StringConstraints, Tag

from lampyris._core import defaults
from lampyris.io.maps.load import COLOURS, VALUES
from lampyris.io.scenario.declared_table import table_of
from lampyris.io.scenario.run_settings import DriveTable, InflationTable, SimulateTable
from lampyris.io.scenario.scenario import PRESETS
from lampyris.io.scenario.schema_types import (
    FileName,
    Metres,
    Pair,
    Resolution,
    Rule,
    Seed,
    Settings,
    Table,
    Word,
)
from lampyris.model.edit import MAX_EDITS
from lampyris.model.robot import Robot
from lampyris.model.scene import MAX_VIA
from lampyris.model.traffic import COUNT_RANGE, MAX_OBSTACLES

VERSION = 1
MAX_SIDE = 2**24


# ---- the map --------------------


class BundledMap(Table):
    """A bundled map (see `lampyris maps`). A name alone, instead of this table, means the same."""

    bundled: Word = Field(description="Its name.")
    resolution: Resolution = Field(1.0, description="Metres a cell.")


class FileMap(Table):
    """A map file: ROS YAML, PNG, BMP, PGM, MovingAI, text or NumPy."""

    file: FileName = Field(description="Its path, relative to the scenario file's folder.")
    resolution: Resolution | None = Field(
        None,
        description="Metres per cell, for files that do not state it (default 1); otherwise it must be the same.",
    )
    values: Annotated[Literal["occupancy", "costmap"], Rule("VALUES", " or ".join(VALUES))] = Field(
        defaults.VALUES, description="What grey samples and numbers are; costmap: ROS 2 costmap values."
    )
    colour: Annotated[Literal["legend", "luminance"], Rule("COLOUR", " or ".join(COLOURS))] = Field(
        defaults.COLOUR, description="Colours that are not of the legend: refused, or read as grey."
    )


class RecipeMap(Table):
    """A map made by a seeded recipe (see `lampyris maps recipes`)."""

    recipe: Word = Field(description="The recipe's name.")
    size: Annotated[
        list[Annotated[int, Field(ge=1, le=MAX_SIDE)]],
        Field(min_length=2, max_length=2),
        Rule("MAP_SIZE", "[width, height]: two whole numbers of cells"),
    ] = Field(description="Columns and rows.")
    seed: Seed = Field(0, description="Same seed, same cells.")
    settings: Settings = Field({}, description="Settings of the recipe; the others have their defaults.")
    resolution: Resolution = Field(1.0, description="Metres a cell.")


class RowsMap(Table):
    """A map written into the scenario."""

    rows: Annotated[
        list[Annotated[str, StringConstraints(min_length=1)]],
        Field(min_length=1),
        Rule("MAP_ROW", "rows of # blocked, . free, ? unknown, S start, G goal"),
    ] = Field(description="One text a row, one character a cell, as in text maps.")
    name: Word = Field("inline", description="What to call it in tables and pictures.")
    resolution: Resolution = Field(1.0, description="Metres a cell.")
    origin: Annotated[
        list[Annotated[float, Field(ge=-1e9, le=1e9)]],
        Field(min_length=3, max_length=3),
        Rule("MAP_ORIGIN", "[x, y, yaw]: two metres and an angle in radians"),
    ] = Field([0.0, 0.0, 0.0], description="Pose of the lower left corner in the map frame: x, y, yaw.")


MAP_KEYS = ("bundled", "file", "recipe", "rows")


def _map_kind(value: Any) -> str | None:
    if isinstance(value, str):
        return "map-name"
    return next((f"map-{key}" for key in MAP_KEYS if isinstance(value, dict) and key in value), None)


MapSpec: TypeAlias = Annotated[
    Annotated[Word, Tag("map-name")]
    | Annotated[BundledMap, Tag("map-bundled")]
    | Annotated[FileMap, Tag("map-file")]
    | Annotated[RecipeMap, Tag("map-recipe")]
    | Annotated[RowsMap, Tag("map-rows")],
    Discriminator(_map_kind),
    Rule("MAP", "a bundled name, or a table with bundled, file, recipe or rows", keys=MAP_KEYS),
]

# ---- ends, robot, who plans --------------------


class Pose(Table):
    """A place in metres and a heading, for planners of poses."""

    pose: Annotated[
        Annotated[list[float], Field(min_length=3, max_length=3)],
        Rule("TYPE", "[x, y, yaw]: metres of the map frame and radians"),
    ] = Field(
        description="x, y in metres of the map frame, and yaw in radians counterclockwise from its x axis."
    )


class Point(Table):
    """A place in metres."""

    m: Annotated[Metres, Rule("TYPE", "[x, y]: two numbers")] = Field(
        description="Metres of the map frame; the cell that holds the point is meant."
    )


class CellPose(Table):
    """The centre of a cell and a heading, for planners of poses."""

    cell: Pair = Field(description="Column and row from the top left.")
    yaw: Annotated[float, Rule("TYPE", "a number: radians")] = Field(
        description="Radians counterclockwise from the x axis of the map frame."
    )


def _end_kind(value: Any) -> str | None:
    if isinstance(value, list):
        return "end-pair"
    if isinstance(value, dict):
        return next((f"end-{key}" for key in ("pose", "cell") if key in value), "end-point")
    return None


End: TypeAlias = Annotated[
    Annotated[Pair, Tag("end-pair")]
    | Annotated[Point, Tag("end-point")]
    | Annotated[Pose, Tag("end-pose")]
    | Annotated[CellPose, Tag("end-cell")],
    Discriminator(_end_kind),
    Rule(
        "TYPE",
        "[x, y]: two whole numbers, column and row from the top left; {m: [x, y]} in metres; {pose: [x, y, yaw]}; "
        "or {cell: [x, y], yaw: radians}",
    ),
]
Place: TypeAlias = Annotated[
    Annotated[Pair, Tag("end-pair")] | Annotated[Point, Tag("end-point")],
    Discriminator(_end_kind),
    Rule(
        "TYPE",
        "[x, y]: two whole numbers, column and row from the top left; or {m: [x, y]} in metres",
    ),
]
if TYPE_CHECKING:
    RobotTable: TypeAlias = Table
else:
    _Limits = table_of("RobotTable", Robot, "Shape, drive and limits of the robot.", "ROBOT_LIMIT")

    class RobotTable(_Limits):
        """Shape, drive and limits of the robot."""

        footprint: Annotated[list[Metres] | None, Rule("ROBOT_FOOTPRINT", "pairs [x, y] of metres")] = Field(
            None,
            description="Vertices of its outline, metres, x ahead and y to the left of its base; in place of radius.",
        )
        rectangle: Annotated[Metres | None, Rule("ROBOT_FOOTPRINT", "[length, width] in metres")] = Field(
            None, description="Length and width of a rectangle around its base; in place of radius."
        )


class Named(Table):
    """A name with settings."""

    name: Word = Field(description="Its name.")
    settings: Settings = Field({}, description="Its settings; the others have their defaults.")


def _named_kind(value: Any) -> str | None:
    if isinstance(value, str):
        return "named-word"
    return "named-table" if isinstance(value, dict) else None


NameOrTable: TypeAlias = Annotated[
    Annotated[Word, Tag("named-word")] | Annotated[Named, Tag("named-table")],
    Discriminator(_named_kind),
    Rule("TYPE", "a name, or {name: ..., settings: {...}}"),
]

# ---- what moves besides the robot --------------------

Radius: TypeAlias = Annotated[float, Field(ge=0, le=1e6), Rule("TRAFFIC_RADIUS", "0 to 1e6 metres")]
_RADIUS = "Radius of each, metres; 0 is one cell."
Outline: TypeAlias = Annotated[list[Metres] | None, Rule("TRAFFIC_FOOTPRINT", "pairs [x, y] of metres")]
OUTLINE = (
    "Vertices of the outline of each, metres, x ahead and y to the left of its centre; in place of radius."
)
Rectangle: TypeAlias = Annotated[Metres | None, Rule("TRAFFIC_FOOTPRINT", "[length, width] in metres")]
RECTANGLE = "Length and width of a rectangle around the centre of each, metres; in place of radius."
Count: TypeAlias = Annotated[
    int,
    Field(ge=0, le=MAX_OBSTACLES),
    Rule("TRAFFIC_COUNT", COUNT_RANGE, limit=True),
]


class WalkTable(Table):
    """Obstacles that step to a random free neighbour or stay; they wait for the robot."""

    kind: Literal["random-walk"] = Field(description="Random walkers.")
    count: Count = Field(description="How many.")
    rate: Annotated[
        Annotated[float, Field(gt=0, le=1)] | None, Rule("TRAFFIC_RATE", "0 < rate <= 1, or null")
    ] = Field(None, description="Chance a tick that one more appears; null: all are there from the start.")
    radius: Radius = Field(0.0, description=_RADIUS)
    starts: Annotated[
        list[Pair],
        Field(max_length=MAX_OBSTACLES),
        Rule("TRAFFIC_STARTS", "cells [x, y], no more than `count`"),
    ] = Field([], description="Cells where the first of them begin; the others begin where the seed says.")
    footprint: Outline = Field(None, description=OUTLINE)
    rectangle: Rectangle = Field(None, description=RECTANGLE)


class PatrolTable(Table):
    """One obstacle that drives along waypoints and back forever; it waits for the robot."""

    kind: Literal["patrol"] = Field(description="A patrol.")
    waypoints: Annotated[
        list[Pair], Field(min_length=1), Rule("TRAFFIC_WAYPOINTS", "one or more cells [x, y]")
    ] = Field(description="Cells, joined by shortest paths.")
    radius: Radius = Field(0.0, description=_RADIUS)
    footprint: Outline = Field(None, description=OUTLINE)
    rectangle: Rectangle = Field(None, description=RECTANGLE)


class CrossingTable(Table):
    """Obstacles that cross the map from side to side and back; they do not wait for the robot."""

    kind: Literal["crossing"] = Field(description="Crossing obstacles.")
    count: Count = Field(description="How many; their paths are drawn from the seed.")
    radius: Radius = Field(0.0, description=_RADIUS)
    footprint: Outline = Field(None, description=OUTLINE)
    rectangle: Rectangle = Field(None, description=RECTANGLE)


class TrackTable(Table):
    """One obstacle that replays a track, whatever the others do."""

    kind: Literal["recorded"] = Field(description="A recorded obstacle.")
    track: Annotated[
        list[Pair], Field(min_length=1), Rule("OBSTACLE_TIME", "one or more cells [x, y], one a tick")
    ] = Field(description="Its cell at each tick from 0; after the last it stays.")
    radius: Radius = Field(0.0, description=_RADIUS)
    footprint: Outline = Field(None, description=OUTLINE)
    rectangle: Rectangle = Field(None, description=RECTANGLE)
    yaw: Annotated[list[float], Rule("OBSTACLE_YAW", "a number for each cell of the track: radians")] = Field(
        [],
        description="With a footprint, its heading at each tick, radians; none: it follows the direction of motion.",
    )


class TrackFileTable(Table):
    """Recorded obstacles from a file: a CSV (columns x, y and perhaps tick, or t, x_m, y_m), or a `.dob` file."""

    kind: Literal["recorded"] = Field(description="A recorded obstacle.")
    file: FileName = Field(description="Its path, relative to the scenario file's folder.")
    radius: Annotated[float | None, Field(ge=0, le=1e6), Rule("TRAFFIC_RADIUS", "0 to 1e6 metres")] = Field(
        None, description="Metres; null: 0, and what the file says where it says so (.dob)."
    )
    id: Annotated[int | None, Field(ge=0), Rule("OBSTACLE_ID", "a whole number >= 0, or null")] = Field(
        None, description=".dob: which obstacle of the file; null: all of them, one after the other."
    )
    tick_s: Annotated[
        Annotated[float, Field(ge=1e-6, le=1e6)] | None, Rule("OBSTACLE_TIME", "1e-6 to 1e6 seconds")
    ] = Field(
        None,
        description=".dob and CSV with t, x_m, y_m: seconds a tick; null: what the robot needs for a cell at its maximum speed.",
    )
    footprint: Outline = Field(None, description=OUTLINE)
    rectangle: Rectangle = Field(None, description=RECTANGLE)


KINDS = ("random-walk", "patrol", "crossing", "recorded")


def _obstacle_kind(value: Any) -> str | None:
    kind = value.get("kind") if isinstance(value, dict) else None
    if kind == "recorded":
        return "recorded-file" if "file" in value else "recorded-track"
    return kind if isinstance(kind, str) and kind in KINDS else None


Obstacle: TypeAlias = Annotated[
    Annotated[WalkTable, Tag("random-walk")]
    | Annotated[PatrolTable, Tag("patrol")]
    | Annotated[CrossingTable, Tag("crossing")]
    | Annotated[TrackTable, Tag("recorded-track")]
    | Annotated[TrackFileTable, Tag("recorded-file")],
    Discriminator(_obstacle_kind),
    Rule("OBSTACLE_KIND", "kind: " + ", ".join(KINDS), kinds=KINDS),
]


# ---- walls that come and go --------------------

Painted: TypeAlias = Annotated[list[Pair], Rule("EDIT", "a list of cells [x, y]")]


class EditTable(Table):
    """Cells that turn into walls or free at the beginning of a tick."""

    tick: Annotated[int, Field(ge=0), Rule("EDIT", "a whole number >= 0")] = Field(
        description="When; 0: before the first plan. Later than the edit before."
    )
    blocked: Painted = Field([], description="Cells that turn into walls.")
    freed: Painted = Field([], description="Cells that turn free.")
    polygons: Annotated[
        list[Annotated[list[Metres], Rule("POLYGON", "pairs [x, y] of metres")]],
        Field(max_length=MAX_EDITS),
        Rule("POLYGON", "a list of polygons, each of pairs [x, y] of metres"),
    ] = Field(
        [],
        description="Polygons, vertices in metres of the map frame: every cell that one covers turns into a wall.",
    )


# ---- the whole --------------------


def _no_default(schema: dict[str, Any]) -> None:
    """Null is not a value: `simulate:` with nothing behind it may mean either."""
    schema.pop("default")


class ScenarioHead(Table):
    """What every scenario file begins with."""

    version: Annotated[Literal[1], Rule("VERSION", "1", always=True)] = Field(
        description="Of this format: 1."
    )
    schema_: str | None = Field(
        None, alias="$schema", description="For editors. Not looked at, and never fetched."
    )
    name: Annotated[Word | None, Rule("TEXT", "1 to 64 printable characters")] = Field(
        None, description="What to call the scenario: 1 to 64 printable characters."
    )
    map: MapSpec = Field(description="The map.")
    map_hash: Annotated[
        Annotated[str, StringConstraints(pattern="^[0-9a-f]{64}$")] | None,
        Rule("MAP_HASH", "64 hexadecimal digits in small letters"),
    ] = Field(None, description="SHA-256 of the map's cells; another map is refused.")


class ScenarioFile(ScenarioHead):
    """A lampyris scenario: everything that decides a plan or a simulation."""

    start: End | None = Field(None, description="Where the robot starts; null: the map's own start.")
    goal: End | None = Field(None, description="Where it drives; null: the map's own goal.")
    via: list[Place] = Field(
        [], max_length=MAX_VIA, description="What the robot passes on the way, one after the other."
    )
    via_order: Annotated[Literal["given", "best"], Rule("VIA_ORDER", ", ".join(defaults.VIA_ORDERS))] = Field(
        defaults.VIA_ORDER, description="The order of `via`: as given, or that with the shortest path."
    )
    robot: RobotTable = Field(RobotTable.model_validate({}), description="Shape, drive and limits, SI units.")
    preset: Annotated[Literal["robot", "dissertation"], Rule("PRESET", ", ".join(PRESETS))] = Field(
        defaults.PRESET,
        description="Moves and law where they are not given: octile and physical, or its own.",
    )
    moves: Annotated[
        Literal["dissertation", "octile", "four-connected", "sixteen-connected"] | None,
        Rule("MOVES", "dissertation, octile, four-connected or sixteen-connected"),
    ] = Field(None, description="Which steps the robot makes; null: the preset's.")
    planner: NameOrTable = Field(defaults.PLANNER, description="The planner: see `lampyris planners`.")
    law: NameOrTable | None = Field(
        None, description="The speed law (see `lampyris laws`); null: the preset's."
    )
    inflation: InflationTable = Field(
        InflationTable.model_validate({}),
        description="Costs of the cells near walls; without it there are none.",
    )
    zones: FileName | None = Field(
        None, description="Speed zones: a Nav2 speed mask (.yaml), or m/s for each cell (.npy, .csv)."
    )
    seed: Seed = Field(0, description="Seed of all random draws: same seed, same bytes.")
    obstacles: list[Obstacle] = Field(
        [],
        max_length=MAX_OBSTACLES,
        description="What moves besides the robot, for simulations; called by their places in the list. "
        "Absent: the obstacles drawn in the map, as random walkers.",
    )
    edits: list[EditTable] = Field(
        [],
        max_length=MAX_EDITS,
        description="Walls that come and go in a simulation; `map_hash` is of the map before them.",
    )
    simulate: SimulateTable = Field(
        None,  # type: ignore[assignment]
        description="Present, if empty ({}): simulate. Absent: plan.",
        json_schema_extra=_no_default,
    )
    drive: DriveTable = Field(
        None,  # type: ignore[assignment]
        description="Present, if empty ({}): drive in continuous time, instead of `simulate`.",
        json_schema_extra=_no_default,
    )


def json_schema() -> dict[str, Any]:
    """The JSON Schema of scenario files."""
    return schema_of(ScenarioFile, "lampyris scenario")


def schema_of(file: type[Table], title: str) -> dict[str, Any]:
    """The JSON Schema of the files that a table is the whole of."""
    made = _plain(file.model_json_schema())
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": title,
        "description": made.pop("description"),
        **made,
    }


_BOUNDS = frozenset({"minimum", "maximum", "exclusiveMinimum", "exclusiveMaximum"})


def _plain(schema: Any) -> Any:
    """A schema without what differs between versions of pydantic and says nothing.

    That is: titles made of the names of fields and classes, an ``enum`` beside the ``const`` that it repeats,
    ``additionalProperties`` that are true, which is the default, and bounds such as ``1000.0``.
    """
    if isinstance(schema, list):
        return [_plain(one) for one in schema]
    if not isinstance(schema, dict):
        return schema
    return {key: _bound(key, _plain(value)) for key, value in schema.items() if _says(key, value, schema)}


def _says(key: str, value: Any, schema: dict[str, Any]) -> bool:
    if key == "title":
        return not isinstance(value, str)
    if key == "enum" and "const" in schema:
        return bool(value != [schema["const"]])
    return not (key == "additionalProperties" and value is True)


def _bound(key: str, value: Any) -> Any:
    return int(value) if key in _BOUNDS and isinstance(value, float) and value.is_integer() else value

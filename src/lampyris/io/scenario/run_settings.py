"""The tables of a scenario file that say how to run it: tick by tick, or in continuous time."""

from __future__ import annotations

from typing import Annotated, Literal, TypeAlias

from pydantic import Field

from lampyris._core.defaults import DRIVE_SPACING, SIMULATION_PATIENCE
from lampyris.io.scenario.schema_types import Rule, Table

MAX_TICKS = 10**9


class SimulateTable(Table):
    """How to simulate."""

    ticks: Annotated[
        Annotated[int, Field(ge=1, le=MAX_TICKS)] | None,
        Rule("TICKS", f"a whole number, 1 to {MAX_TICKS:,}, or null"),
    ] = Field(None, description="The last tick; null: generous for the map's size.")
    patience: Annotated[
        Annotated[int, Field(ge=0, le=MAX_TICKS)] | None,
        Rule("PATIENCE", f"a whole number, 0 to {MAX_TICKS:,}, or null"),
    ] = Field(
        None, description=f"Ticks in a row the robot waits before it gives up; null: {SIMULATION_PATIENCE}."
    )


Seconds: TypeAlias = Annotated[float, Field(ge=1e-6, le=1e6), Rule("DRIVE_SETTING", "1e-6 to 1e6 seconds")]
Late: TypeAlias = Annotated[float, Field(ge=0, le=1e6), Rule("DRIVE_SETTING", "0 to 1e6 seconds")]
_OR_NULL = Rule("DRIVE_SETTING", "1e-6 to 1e6, or null")


class DriveTable(Table):
    """How to drive in continuous time."""

    period: Seconds = Field(0.1, description="Seconds between two decisions.")
    time_limit: Annotated[Seconds | None, _OR_NULL] = Field(
        None, description="Seconds after which it ends; null: generous for the first way."
    )
    obstacle_speed: Annotated[Annotated[float, Field(ge=1e-6, le=1e6)] | None, _OR_NULL] = Field(
        None, description="Speed of a straight step of obstacles, m/s; null: the robot's greatest."
    )
    obstacle_info: Annotated[
        Literal["positions", "velocities", "tracks"],
        Rule("DRIVE_SETTING", "positions, velocities or tracks"),
    ] = Field("positions", description="What the law knows of the obstacles.")
    tracking: Annotated[
        Literal["perfect", "velocity", "position"], Rule("DRIVE_SETTING", "perfect, velocity or position")
    ] = Field("perfect", description="How the robot follows what it is told to do.")
    command_period: Annotated[Seconds | None, _OR_NULL] = Field(
        None, description="Seconds between two commands, unless tracking is perfect; null: the period."
    )
    delay: Late = Field(0.0, description="Seconds a command takes to arrive, unless tracking is perfect.")
    lag: Late = Field(0.1, description="Seconds by which the motors lag, unless tracking is perfect.")
    noise: Annotated[float, Field(ge=0, le=1e6), Rule("DRIVE_SETTING", "0 to 1e6 metres")] = Field(
        0.0, description="Metres by which a told position may be off."
    )
    patience: Late = Field(5.0, description="Seconds it stands for obstacles before it plans anew.")
    give_up: Seconds = Field(60.0, description="Seconds of standing after which it gives up.")
    on_hit: Annotated[Literal["end", "go-on"], Rule("DRIVE_SETTING", "end or go-on")] = Field(
        "end", description="What happens when an obstacle runs into the standing robot."
    )
    smooth: Annotated[Literal["arcs", "none"], Rule("DRIVE_SETTING", "arcs or none")] = Field(
        "arcs",
        description="arcs: drawn taut, corners rounded; none: the planned cells, each corner rounded within "
        "half a step, or a stop.",
    )
    data_timeout: Late = Field(2.0, description="Seconds without trustworthy data after which it gives up.")
    max_age: Seconds = Field(0.5, description="Seconds; older data are not trusted.")
    spacing: Annotated[Seconds | None, Rule("DRIVE_SETTING", "1e-6 to 1e6 metres, or null")] = Field(
        None, description=f"Metres between two nodes of the way; null: {DRIVE_SPACING:g} of a cell."
    )

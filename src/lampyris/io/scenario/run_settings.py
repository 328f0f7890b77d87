"""The tables of a scenario file that say how to run it: tick by tick, in continuous time, among which costs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, TypeAlias

from pydantic import Field

from lampyris.io.scenario.declared_table import table_of
from lampyris.io.scenario.schema_types import FileName, Pair, Rule, Settings, Table
from lampyris.model.settings.drive import DriveSettings
from lampyris.model.settings.inflation import Inflation
from lampyris.model.settings.simulation import SimulationSettings

if TYPE_CHECKING:
    SimulateTable: TypeAlias = Table
    DriveTable: TypeAlias = Table
    InflationTable: TypeAlias = Table
else:
    _Simulate = table_of("SimulateTable", SimulationSettings, "How to simulate.")

    class SimulateTable(_Simulate):
        """How to simulate."""

        goal_track: Annotated[
            list[Pair] | None,
            Field(min_length=1),
            Rule("GOAL_TRACK", "one or more cells [x, y], one a tick, or null"),
        ] = Field(
            None,
            description="The goal's cell at each tick from 0; after the last it stays. Null: it stands still.",
        )
        goal_track_file: FileName | None = Field(
            None,
            description="A CSV with the goal's cells (columns x, y and perhaps tick), in place of goal_track.",
        )

    _Drive = table_of("DriveTable", DriveSettings, "How to drive in continuous time.", "DRIVE_SETTING")

    class DriveTable(_Drive):
        """How to drive in continuous time."""

        controller_settings: Settings = Field(
            {}, description="Settings of the controller that steers, by name."
        )

    InflationTable = table_of(
        "InflationTable", Inflation, "Costs of the cells near walls, as Nav2's inflation layer has them."
    )

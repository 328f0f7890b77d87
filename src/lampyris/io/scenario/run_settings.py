"""The tables of a scenario file that say how to run it: tick by tick, in continuous time, among which costs."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

from pydantic import Field

from lampyris.io.scenario.declared_table import table_of
from lampyris.io.scenario.schema_types import Settings, Table
from lampyris.model.settings.drive import DriveSettings
from lampyris.model.settings.inflation import Inflation
from lampyris.model.settings.simulation import SimulationSettings

if TYPE_CHECKING:
    SimulateTable: TypeAlias = Table
    DriveTable: TypeAlias = Table
    InflationTable: TypeAlias = Table
else:
    SimulateTable = table_of("SimulateTable", SimulationSettings, "How to simulate.")
    _Drive = table_of("DriveTable", DriveSettings, "How to drive in continuous time.", "DRIVE_SETTING")

    class DriveTable(_Drive):
        """How to drive in continuous time."""

        controller_settings: Settings = Field(
            {}, description="Settings of the controller that steers, by name."
        )

    InflationTable = table_of(
        "InflationTable", Inflation, "Costs of the cells near walls, as Nav2's inflation layer has them."
    )

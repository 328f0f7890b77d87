"""Plan paths on grid maps, compute velocity profiles, and simulate a robot among moving obstacles.

Public names are loaded when first used, so that importing the package, and ``lampyris --help``, are instant.
"""

from __future__ import annotations

import importlib as _importlib
from typing import TYPE_CHECKING

from lampyris._core import presentation as _presentation

__version__ = "0.1.0"

_HOME = {
    "smooth": "lampyris.api",
    "drive": "lampyris.api",
    "list_planners": "lampyris.planning.registry",
    "inflate": "lampyris.io.maps.inflation",
    "inflation_costs": "lampyris.io.maps.inflation",
    "load_grid": "lampyris.api",
    "load_primitives": "lampyris.io.primitives.load",
    "motion_primitives": "lampyris.planning.lattice.generate",
    "save_primitives": "lampyris.io.primitives.write",
    "plan": "lampyris.api",
    "speed_profile": "lampyris.api",
    "fastest_time_settings": "lampyris.travel_time.of_law",
    "propagate_uncertainty": "lampyris.uncertainty.propagate",
    "simulate": "lampyris.api",
    "load_scenario": "lampyris.scenarios",
    "run": "lampyris.scenarios",
    "save_scenario": "lampyris.scenarios",
    "load_study": "lampyris.study.design.study_file",
    "run_study": "lampyris.study.front",
    "solve_field": "lampyris.planning.field.solve",
    "solve_fields": "lampyris.planning.field.many",
    "dissertation_speeds": "lampyris.motion.laws.dissertation",
    "node_table": "lampyris.motion.laws.node_table",
    "export_fleet": "lampyris.fleets",
    "load_fleet": "lampyris.fleets",
    "plan_fleet": "lampyris.fleets",
    "random_fleet": "lampyris.fleets",
    "simulate_fleet": "lampyris.fleet_drives",
    "lifelong_fleet": "lampyris.lifelong",
    "load_tasks": "lampyris.lifelong",
    "drawn_sources": "lampyris.swarms",
    "load_sources": "lampyris.swarms",
    "swarm_robots": "lampyris.swarms",
    "segment_photo": "lampyris.photos.segment",
    "draw_chain": "lampyris.chains",
    "plan_chain": "lampyris.chains",
    "Agent": "lampyris.model.fleet.fleet",
    "Budget": "lampyris.planning.base",
    "Chain": "lampyris.model.chain.chain",
    "ChainPlan": "lampyris.model.chain.chain_plan",
    "Change": "lampyris.model.change",
    "Crossing": "lampyris.model.traffic",
    "Curve": "lampyris.model.curve",
    "Delays": "lampyris.model.fleet.delays",
    "Drive": "lampyris.model.drive",
    "Edit": "lampyris.model.edit",
    "FleetScenario": "lampyris.io.fleet_scenario.scenario",
    "Field": "lampyris.model.field",
    "Fleet": "lampyris.model.fleet.fleet",
    "FleetPlan": "lampyris.model.fleet.fleet_plan",
    "FleetTrace": "lampyris.model.fleet.fleet_trace",
    "Gate": "lampyris.model.field",
    "Grid": "lampyris.model.grid",
    "InverseSquare": "lampyris.model.swarm.sources",
    "LampyrisError": "lampyris.errors",
    "MapModel": "lampyris.model.plan",
    "MOVES": "lampyris.model.moves",
    "ObstacleStates": "lampyris.model.obstacles",
    "LifelongTrace": "lampyris.model.fleet.lifelong",
    "Motion": "lampyris.model.lattice.motion_primitives",
    "MotionPrimitives": "lampyris.model.lattice.motion_primitives",
    "Moves": "lampyris.model.moves",
    "Outcome": "lampyris.model.trace",
    "Path": "lampyris.model.path",
    "Patrol": "lampyris.model.traffic",
    "Plan": "lampyris.model.plan",
    "Plume": "lampyris.model.swarm.sources",
    "Profile": "lampyris.model.profile",
    "RandomWalk": "lampyris.model.traffic",
    "Recorded": "lampyris.model.traffic",
    "Robot": "lampyris.model.robot",
    "SampledPath": "lampyris.motion.geometry.sampled_path",
    "Scenario": "lampyris.io.scenario.scenario",
    "SegmentedPhoto": "lampyris.model.photos.segmented_photo",
    "Scene": "lampyris.model.scene",
    "Sensor": "lampyris.model.settings.sensor",
    "SettingError": "lampyris.errors",
    "Status": "lampyris.model.plan",
    "CancelToken": "lampyris._core.cancellation",
    "Study": "lampyris.study.design.study",
    "SwarmTrace": "lampyris.model.swarm.swarm_trace",
    "FleetTask": "lampyris.model.fleet.lifelong",
    "ThreePeaks": "lampyris.model.swarm.sources",
    "Trace": "lampyris.model.trace",
    "Track": "lampyris.model.obstacles",
}

_MODULES = ("curves", "notebook", "plot", "uncertainty")

__all__ = ["__version__", *_HOME, *_MODULES]

if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any

    from lampyris import curves as curves
    from lampyris import notebook as notebook
    from lampyris import plot as plot
    from lampyris import uncertainty as uncertainty
    from lampyris._core.cancellation import CancelToken as CancelToken
    from lampyris.api import drive as drive
    from lampyris.api import load_grid as load_grid
    from lampyris.api import plan as plan
    from lampyris.api import simulate as simulate
    from lampyris.api import smooth as smooth
    from lampyris.api import speed_profile as speed_profile
    from lampyris.chains import draw_chain as draw_chain
    from lampyris.chains import plan_chain as plan_chain
    from lampyris.errors import LampyrisError as LampyrisError
    from lampyris.errors import SettingError as SettingError
    from lampyris.fleet_drives import simulate_fleet as simulate_fleet
    from lampyris.fleets import export_fleet as export_fleet
    from lampyris.fleets import load_fleet as load_fleet
    from lampyris.fleets import plan_fleet as plan_fleet
    from lampyris.fleets import random_fleet as random_fleet
    from lampyris.io.fleet_scenario.scenario import FleetScenario as FleetScenario
    from lampyris.io.maps.inflation import inflate as inflate
    from lampyris.io.maps.inflation import inflation_costs as inflation_costs
    from lampyris.io.primitives.load import load_primitives as load_primitives
    from lampyris.io.primitives.write import save_primitives as save_primitives
    from lampyris.io.scenario.scenario import Scenario as Scenario
    from lampyris.lifelong import lifelong_fleet as lifelong_fleet
    from lampyris.lifelong import load_tasks as load_tasks
    from lampyris.model.chain.chain import Chain as Chain
    from lampyris.model.chain.chain_plan import ChainPlan as ChainPlan
    from lampyris.model.change import Change as Change
    from lampyris.model.curve import Curve as Curve
    from lampyris.model.drive import Drive as Drive
    from lampyris.model.edit import Edit as Edit
    from lampyris.model.field import Field as Field
    from lampyris.model.field import Gate as Gate
    from lampyris.model.fleet.delays import Delays as Delays
    from lampyris.model.fleet.fleet import Agent as Agent
    from lampyris.model.fleet.fleet import Fleet as Fleet
    from lampyris.model.fleet.fleet_plan import FleetPlan as FleetPlan
    from lampyris.model.fleet.fleet_trace import FleetTrace as FleetTrace
    from lampyris.model.fleet.lifelong import FleetTask as FleetTask
    from lampyris.model.fleet.lifelong import LifelongTrace as LifelongTrace
    from lampyris.model.grid import Grid as Grid
    from lampyris.model.lattice.motion_primitives import Motion as Motion
    from lampyris.model.lattice.motion_primitives import MotionPrimitives as MotionPrimitives
    from lampyris.model.moves import MOVES as MOVES
    from lampyris.model.moves import Moves as Moves
    from lampyris.model.obstacles import ObstacleStates as ObstacleStates
    from lampyris.model.obstacles import Track as Track
    from lampyris.model.path import Path as Path
    from lampyris.model.photos.segmented_photo import SegmentedPhoto as SegmentedPhoto
    from lampyris.model.plan import MapModel as MapModel
    from lampyris.model.plan import Plan as Plan
    from lampyris.model.plan import Status as Status
    from lampyris.model.profile import Profile as Profile
    from lampyris.model.robot import Robot as Robot
    from lampyris.model.scene import Scene as Scene
    from lampyris.model.settings.sensor import Sensor as Sensor
    from lampyris.model.swarm.sources import InverseSquare as InverseSquare
    from lampyris.model.swarm.sources import Plume as Plume
    from lampyris.model.swarm.sources import ThreePeaks as ThreePeaks
    from lampyris.model.swarm.swarm_trace import SwarmTrace as SwarmTrace
    from lampyris.model.trace import Outcome as Outcome
    from lampyris.model.trace import Trace as Trace
    from lampyris.model.traffic import Crossing as Crossing
    from lampyris.model.traffic import Patrol as Patrol
    from lampyris.model.traffic import RandomWalk as RandomWalk
    from lampyris.model.traffic import Recorded as Recorded
    from lampyris.motion.geometry.sampled_path import SampledPath as SampledPath
    from lampyris.motion.laws.dissertation import dissertation_speeds as dissertation_speeds
    from lampyris.motion.laws.node_table import node_table as node_table
    from lampyris.photos.segment import segment_photo as segment_photo
    from lampyris.planning.base import Budget as Budget
    from lampyris.planning.field.many import solve_fields as solve_fields
    from lampyris.planning.field.solve import solve_field as solve_field
    from lampyris.planning.lattice.generate import motion_primitives as motion_primitives
    from lampyris.planning.registry import list_planners as list_planners
    from lampyris.scenarios import load_scenario as load_scenario
    from lampyris.scenarios import run as run
    from lampyris.scenarios import save_scenario as save_scenario
    from lampyris.study.design.study import Study as Study
    from lampyris.study.design.study_file import load_study as load_study
    from lampyris.study.front import run_study as run_study
    from lampyris.swarms import drawn_sources as drawn_sources
    from lampyris.swarms import load_sources as load_sources
    from lampyris.swarms import swarm_robots as swarm_robots
    from lampyris.travel_time.of_law import fastest_time_settings as fastest_time_settings
    from lampyris.uncertainty.propagate import propagate_uncertainty as propagate_uncertainty


def _later(module: str, name: str) -> Callable[..., Any]:
    """A function of a layer above the model, loaded when it is first called; the model knows of none of them."""

    def call(*given: Any, **named: Any) -> Any:
        return getattr(_importlib.import_module(f"lampyris.{module}"), name)(*given, **named)

    return call


_presentation.html_of = _later("report.pictures.noun_view", "html_of")
_presentation.frame_of = _later("report.data.frames", "frame_of")
_presentation.array_of = _later("report.data.arrays", "array_of")
_presentation.irsim_grid = _later("irsim", "grid_of")


def __getattr__(name: str) -> object:
    if name not in _HOME and name not in _MODULES:
        raise AttributeError(f"module 'lampyris' has no attribute {name!r}")
    from lampyris._core.cancellation import uninterrupted

    with uninterrupted():  # NumPy cannot be imported twice, nor taken as half an import left it
        if name in _MODULES:
            return _importlib.import_module(f"lampyris.{name}")
        value: object = getattr(_importlib.import_module(_HOME[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*__all__, *(name for name in globals() if name.startswith("__"))})

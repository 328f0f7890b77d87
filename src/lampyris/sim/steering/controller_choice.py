"""Driving with the controller that the settings name."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from lampyris.model.drive import Drive
from lampyris.model.scene import Scene
from lampyris.model.settings.drive import DriveSettings
from lampyris.model.settings.steering import Dwa, Mppi, PurePursuit, RegulatedPurePursuit, Steering
from lampyris.motion.laws.registry import SpeedLaw
from lampyris.planning.base import Budget, Planner
from lampyris.sim.continuous.drive import DriveSimulation
from lampyris.sim.sensor import ObstacleSensor
from lampyris.sim.steering.control import SteeringController
from lampyris.sim.steering.pure_pursuit import Pursuit, RegulatedPursuit
from lampyris.sim.steering.sampling import DynamicWindow, PathIntegral
from lampyris.sim.steering.steered_drive import SteeredSimulation
from lampyris.sim.traffic.motion_sources import MotionSource, stream

CONTROLLERS: dict[type[Steering], Callable[[Any, np.random.Generator], SteeringController]] = {
    PurePursuit: lambda one, rng: Pursuit(one),
    RegulatedPurePursuit: lambda one, rng: RegulatedPursuit(one),
    Dwa: lambda one, rng: DynamicWindow(one),
    Mppi: PathIntegral,
}
"""What makes a controller of its settings and a generator of random numbers."""

_STREAM = 1_000_003
"""Number of the controller's random stream, beside those of planner, traffic and noise."""


def simulation_of(
    scene: Scene,
    planner: Planner,
    *,
    law: SpeedLaw = "physical",
    seed: int = 0,
    sources: Sequence[MotionSource] = (),
    sensor: ObstacleSensor | None = None,
    budget: Budget | None = None,
    **settings: Any,
) -> DriveSimulation:
    """A drive that can be stopped between two periods, with the controller of the settings; see :func:`drive`."""
    steering = DriveSettings.of(settings).steering
    given: dict[str, Any] = {"law": law, "seed": seed, "sources": sources, "sensor": sensor, "budget": budget}
    if steering is None:
        return DriveSimulation(scene, planner, **given, **settings)
    controller = CONTROLLERS[type(steering)](steering, stream(seed, _STREAM))
    return SteeredSimulation(scene, planner, controller, steering, **given, **settings)


def drive(
    scene: Scene, planner: Planner, *, progress: Callable[[float], None] | None = None, **given: Any
) -> Drive:
    """As :func:`lampyris.sim.continuous.drive.drive`, with the controller of the settings.

    Raises
    ------
    UsageError : ``CONTROLLER``: a controller that steers and a planner without headings; and what that function raises.
    """
    return simulation_of(scene, planner, **given).run(progress)

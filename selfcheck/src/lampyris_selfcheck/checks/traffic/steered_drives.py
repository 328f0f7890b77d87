"""Controllers that steer, among moving obstacles: with the braking rule no contact while moving, by the referee."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from lampyris.errors import SceneError
from lampyris.model.drive import Drive
from lampyris.model.robot import DRIVES
from lampyris.sim.steering.controller_choice import drive
from lampyris_selfcheck.check import Ask, Check, Kind, Outcome, Part
from lampyris_selfcheck.checks.traffic.pose_drives import Case, judged
from lampyris_selfcheck.checks.traffic.pose_drives import draw as draw_poses

KINDS = {
    name: Kind(
        f"the robots, maps and obstacles of pose-drives, each drive type in turn, steered by {name}",
        commit=commit,
        nightly=nightly,
        release=10 * nightly,
        chunk=10,
        least={"arrived": 0.3, "met": 0.3},
    )
    for name, commit, nightly in (
        ("pure-pursuit", 2, 3_000),
        ("rpp", 5, 3_000),
        ("dwa", 6, 1_000),
        ("mppi", 6, 1_000),
    )
}


def draw(rng: np.random.Generator, drive_type: str) -> Case:
    """A case of ``pose-drives`` of a robot of one drive type."""
    case = draw_poses(rng)
    robot = case.scene.robot
    if drive_type == "ackermann" and robot.turn_radius == 0.0:
        robot = replace(robot, turn_radius=1.5 * case.scene.grid.resolution)
    return case._replace(scene=replace(case.scene, robot=replace(robot, drive=drive_type)))


def driven(case: Case, controller: str) -> Drive | None:
    """The drive; None where the obstacles do not fit the map."""
    settings: dict[str, Any] = case.settings | {"controller": controller}
    if controller == "mppi":
        settings["controller_settings"] = {"samples": 200, "steps": 30}
    try:
        return drive(case.scene, case.planner, **settings)
    except SceneError:
        return None


def run(ask: Ask, part: Part) -> Outcome:
    """Drive some cases and have the referee look at each."""
    return judged(
        part,
        lambda number: draw(ask.rng("steered-drives", part.kind, number), DRIVES[number % len(DRIVES)]),
        lambda case: driven(case, part.kind),
    )


CHECK = Check(
    "steered-drives",
    ("G33",),
    "a controller that steers, filtered by the braking rule, touches no moving obstacle while it moves, and no wall",
    KINDS,
    run,
)

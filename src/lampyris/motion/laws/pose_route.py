"""Paths of poses as speed laws are to see them: nodes on the curve that they drive, and a scene with another robot."""

from __future__ import annotations

from dataclasses import replace

from lampyris._core.defaults import SAMPLE_SPACING
from lampyris.model.path import PosePath
from lampyris.model.robot import disc, inscribed_disc
from lampyris.model.scene import Scene
from lampyris.motion.geometry.pose_curve import curve_of_poses
from lampyris.motion.geometry.sampled_path import SampledPath, sample_curve
from lampyris.motion.laws.node_refinement import refined
from lampyris.motion.laws.registry import SpeedLaw, settings_named
from lampyris.motion.laws.rpp import Rpp


def pose_route(
    poses: PosePath, scene: Scene, law: SpeedLaw, spacing: float | None = None
) -> tuple[SampledPath, Scene]:
    """Nodes along a path of poses, and the scene for the law.

    The curve has the robot's outline, so that the robot of that scene has no radius; a law that looks at the robot alone
    (``rpp``) gets the disc within its footprint.

    Parameters
    ----------
    spacing : metres between two nodes at most; None: the usual share of a cell.
    """
    curve = curve_of_poses(poses, scene.grid, scene.robot)
    plain = isinstance(settings_named(law), Rpp)
    seen = replace(scene, robot=inscribed_disc(scene.robot) if plain else disc(scene.robot, 0.0))
    step = SAMPLE_SPACING * scene.grid.resolution if spacing is None else spacing
    return refined(sample_curve(curve, step), seen), seen

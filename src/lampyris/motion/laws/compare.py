"""Laws side by side on one sampled path: how long each takes, how hard it drives, and which limits it breaks."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from lampyris._core import elementary
from lampyris.errors import SettingError
from lampyris.model.obstacles import ObstacleStates
from lampyris.model.profile import Profile
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.motion.geometry.sampled_path import SampledCellPath, SampledPath
from lampyris.motion.jerk import jerks
from lampyris.motion.laws import registry as laws
from lampyris.typing import Floats

Make: TypeAlias = Callable[[laws.SpeedLaw], Profile]
"""What makes a law's profile."""

_ROUNDING = 1e-9
"""Share of a limit that rounding may be beyond it."""


@dataclass(frozen=True, slots=True, eq=False)
class LawResult:
    """One law on the sampled path.

    Parameters
    ----------
    law : its name.
    profile : in metres and seconds.
    duration_s : seconds from start to goal.
    mean : m/s: the path's length over its duration; 0 where there is no path.
    peak_accel, peak_braking : m/s2, the greatest of each; 0 where there is none.
    peak_lateral : m/s2: the greatest ``v^2 kappa``, of a path of cells on the arcs of its corners.
    broken : which of the robot's limits it breaks: ``acceleration``, ``braking``, ``lateral``, ``v_max``, and
        ``jerk`` if it has one.
    ratio : of its duration to that of the time optimum; 1 where there is no path.
    """

    law: str
    profile: Profile
    duration_s: float
    mean: float
    peak_accel: float
    peak_braking: float
    peak_lateral: float
    broken: tuple[str, ...]
    ratio: float


def compare(
    samples: SampledPath,
    scene: Scene,
    chosen: Sequence[laws.SpeedLaw],
    *,
    obstacle_states: ObstacleStates | None = None,
    v0: float = 0.0,
    make: Make | None = None,
    refused: dict[str, str] | None = None,
) -> tuple[LawResult, ...]:
    """An entry for each law, in the order asked for.

    Parameters
    ----------
    samples : where all of them drive.
    scene : map, zones and robot.
    chosen : names, or settings of laws.
    obstacle_states : moving obstacles as sensed now, for laws that consider them.
    v0 : m/s at the start.
    make : what makes the profile of a law on the sampled path; None: :func:`lampyris.motion.laws.registry.profile`.
    refused : laws that do not let the robot drive are put in here, with why; None: they raise.

    Raises
    ------
    UsageError : no such law.
    SettingError : as :func:`lampyris.motion.laws.registry.profile`.
    """

    def plain(law: laws.SpeedLaw) -> Profile:
        return laws.profile(samples, scene, law=law, obstacle_states=obstacle_states, v0=v0)

    made_by = plain if make is None else make
    # The optimum leaves moving obstacles aside: the others are measured against what no obstacle holds.
    best = laws.profile(samples, scene, law="optimum", v0=v0).duration
    out = []
    for law in chosen:
        try:
            made = made_by(law)
        except SettingError as fault:
            if refused is None or fault.code != "PROFILE_BLOCKED":
                raise
            refused[law if isinstance(law, str) else laws.name_of(law)] = fault.what
            continue
        out.append(entry_of(made, samples, scene.robot, best))
    return tuple(out)


def entry_of(profile: Profile, samples: SampledPath, robot: Robot, best: float) -> LawResult:
    """What one profile does, judged from it alone; ``best``: seconds that the time optimum takes."""
    took = profile.duration
    length = float(profile.s[-1] - profile.s[0])
    lateral = lateral_of(profile, samples)
    peaks = {
        "acceleration": (float(max(profile.a.max(), 0.0)), robot.a_max),
        "braking": (float(max(-profile.a.min(), 0.0)), robot.d_max),
        "lateral": (float(lateral.max()) if len(lateral) else 0.0, robot.a_lat_max),
        "v_max": (float(profile.v.max()), robot.v_max),
        "jerk": (jerk_of(profile), math.inf if robot.jerk_max is None else robot.jerk_max),
    }
    return LawResult(
        profile.law,
        profile,
        took,
        length / took if took > 0.0 else 0.0,
        peaks["acceleration"][0],
        peaks["braking"][0],
        peaks["lateral"][0],
        tuple(name for name, (peak, limit) in peaks.items() if peak > limit * (1.0 + _ROUNDING)),
        took / best if best > 0.0 else 1.0,
    )


def lateral_of(profile: Profile, samples: SampledPath) -> Floats:
    """Lateral acceleration on each edge of a profile at the greater of its two speeds, m/s2; (n - 1,)."""
    s = profile.s
    if isinstance(samples, SampledCellPath) and len(s) > 1:
        return _lateral_in_corners(profile, samples)
    if samples.curve is None or len(s) < 2:
        return np.zeros(max(len(s) - 1, 0))
    begins = samples.curve.begins
    piece = np.clip(np.searchsorted(begins, 0.5 * (s[1:] + s[:-1]), side="right") - 1, 0, len(begins) - 2)
    fast = np.maximum(profile.v[1:], profile.v[:-1])
    out: Floats = fast * fast * np.abs(samples.curve.curvature[piece])
    return out


def _lateral_in_corners(profile: Profile, samples: SampledCellPath) -> Floats:
    """The same on a path of cells: on the arcs of its corners, straight between them."""
    s, x, out = profile.s, np.square(profile.v), np.zeros(len(profile.s) - 1)
    corners = samples.corners
    arcs = np.flatnonzero(~corners.stop)
    if not len(arcs):
        return out
    middle, tangent = samples.s[corners.node[arcs]], corners.tangent[arcs]
    begin, end, bend = middle - tangent, middle + tangent, 1.0 / corners.radius[arcs]
    cuts = np.unique(np.concatenate((s, begin, end)))
    cuts = cuts[(cuts >= s[0]) & (cuts <= s[-1])]
    # The square of the speed changes evenly between nodes; from stop to stop there is no arc.
    fast = elementary.interp(cuts, s, x)
    fast = np.maximum(fast[1:], fast[:-1])
    at = 0.5 * (cuts[1:] + cuts[:-1])
    k = np.clip(np.searchsorted(begin, at, side="right") - 1, 0, len(arcs) - 1)
    inside = (at > begin[k]) & (at < end[k])
    edge = np.clip(np.searchsorted(s, at, side="right") - 1, 0, len(out) - 1)
    np.maximum.at(out, edge[inside], (fast * bend[k])[inside])
    return out


def jerk_of(profile: Profile) -> float:
    """The maximum jerk of a profile, m/s3, as :mod:`lampyris.motion.jerk` has it; 0 where it never moves.

    An edge from rest to rest has that of the gentlest motion that takes its time. A wait is one node.
    """
    fresh = np.append(True, np.diff(profile.s) > 0.0)
    s, v = profile.s[fresh], profile.v[fresh]
    if len(s) < 2:
        return 0.0
    ds, took = np.diff(s), np.diff(profile.t)[fresh[1:]]
    rest = (v[1:] == 0.0) & (v[:-1] == 0.0)
    hops = 32.0 * ds[rest] / (took[rest] * took[rest] * took[rest])
    return max(float(jerks(ds, v).max()), float(hops.max(initial=0.0)))

"""The cap of blind areas judged at some nodes of a drawn way: it minds what hides, and no more than there is.

The distances are those of :mod:`lampyris_selfcheck.reference.motion.blind_areas`, and so is what a speed uses up of them.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from lampyris.model.path import Path
from lampyris.model.profile import Profile
from lampyris.motion.laws.physical import PhysicalLaw
from lampyris.motion.safety.blind_areas import BlindArea
from lampyris.typing import Floats, Points
from lampyris_selfcheck.check import Tally
from lampyris_selfcheck.checks.speed.profile_paths import ProfilePath
from lampyris_selfcheck.reference.motion import blind_areas as reference

NODES = 6
"""Nodes of a way that are judged."""

_ROUNDING = 1e-9


def drawn(rng: np.random.Generator) -> PhysicalLaw:
    """The law as it is, or with other settings of what may be hidden."""
    if rng.random() < 0.3:
        return PhysicalLaw(blind=BlindArea(), name="blind")
    speed, reaction = float(rng.choice([0.0, 0.3, 1.0, 2.0])), float(rng.choice([0.0, 0.1, 0.5]))
    radius = float(rng.choice([0.05, 0.2, 0.4]))
    return PhysicalLaw(blind=BlindArea(speed, radius, reaction), name="blind")


def fault_of(ground: ProfilePath, made: Profile, law: PhysicalLaw, tally: Tally) -> str:
    """What is wrong with the cap; empty: nothing."""
    settings, robot = law.blind, ground.scene.robot
    assert settings is not None
    cap = np.minimum(dict(made.caps)["blind area"], robot.v_max)
    if (made.v[1:] > cap[1:] * (1 + _ROUNDING)).any():
        return "faster than the cap of blind areas"
    way = ground.way
    xy = way.cells.astype(np.float64) if isinstance(way, Path) else way.xy
    blocked = ground.scene.grid.blocked
    walls = np.argwhere(blocked)[:, ::-1].astype(np.float64)
    places, owners = reference.corners(blocked)
    if len(xy) < 2:
        return ""
    about = (settings, robot, ground.scene.grid)
    for k in np.unique(np.linspace(0, len(xy) - 2, NODES).astype(int)).tolist():
        if len(walls) and (np.abs(walls - xy[k]).max(axis=1) < 0.5 + reference.CLEAR).any():
            continue  # a course may touch a wall, where the eye is in it
        tally.count("blind areas judged")
        fault = _at(k, xy, cap, (places, owners, walls), about, tally)
        if fault:
            return fault
    return ""


def _at(
    k: int,
    xy: Points,
    cap: Floats,
    found: tuple[Points, Points, Points],
    about: tuple[Any, ...],
    tally: Tally,
) -> str:
    """The cap at node k, the next one's too: both obey what is seen from the edge between them."""
    (places, owners, walls), (settings, robot, grid) = found, about
    resolution, size = grid.resolution, (grid.width, grid.height)
    creep = settings.creep * robot.v_max * (1 + _ROUNDING)

    def spent(v: float) -> float:
        return reference.spent(
            v, a=robot.a_max, p=robot.d_max, reaction=settings.reaction, hidden_speed=settings.hidden_speed
        )

    eye, ahead = xy[k], xy[k + 1]
    apart = reference.to_edge(places, eye, ahead)
    near = np.argsort(apart, kind="stable")[: reference.NEAREST]
    rho = settings.hidden_radius / resolution
    fastest = float(max(cap[k], cap[k + 1]))
    for c in near.tolist():
        left = float(apart[c]) * resolution - robot.radius
        if fastest <= creep or spent(fastest) <= left * (1 + _ROUNDING) + _ROUNDING:
            break  # what is farther asks for less
        if float((ahead - eye) @ (places[c] - eye)) <= reference.CLEAR:
            continue
        if reference.hides(eye, places[c], owners[c], walls, rho, size):
            corner = places[c].tolist()
            return f"{fastest!r} m/s at node {k}, {left!r} m from what corner {corner} may hide"
    around = [reference.to_edge(places, xy[j], xy[j + 1]) for j in (k - 1, k) if j >= 0]
    least = min((float(some.min()) for some in around if len(some)), default=np.inf) * resolution
    v = float(cap[k])
    if v < robot.v_max and spent(v) < (least - robot.radius) * (1 - _ROUNDING) - _ROUNDING:
        return f"{v!r} m/s at node {k}; no corner is nearer than {least!r} m"
    if v < robot.v_max:
        tally.count("blind areas: slowed")
    return ""

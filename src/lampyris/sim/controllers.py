"""Controllers by law: who drives, and the ceiling of speeds that it is given along each way."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from lampyris.model.profile import Profile
from lampyris.model.scene import Scene
from lampyris.motion import laws
from lampyris.motion.bounds import Constant, Optimum
from lampyris.motion.course import Course
from lampyris.motion.dissertation import DissertationLaw
from lampyris.motion.physical import PhysicalLaw
from lampyris.motion.rpp import Rpp
from lampyris.sim.careful import Careful
from lampyris.sim.control import Controller, Follow
from lampyris.sim.foresight import Foresight
from lampyris.sim.leg import Ceiling
from lampyris.sim.rivals import ByRings, Regulated
from lampyris.sim.sources import Roster


class Wheel(NamedTuple):
    """A law at the wheel: its name, its controller, what makes its ceiling, whether it counts cells."""

    name: str
    controller: Controller
    ceiling: Ceiling
    cells: bool


def wheel(scene: Scene, law: laws.SpeedLaw, know: str, roster: Roster) -> Wheel:
    """Who drives by a law, given by name or by settings.

    Parameters
    ----------
    know : what our law uses of the obstacles; with ``tracks`` the roster's recorded ones are known.

    Raises
    ------
    UsageError : ``LAW``: no such law.
    """
    settings: Any = laws.named(law).settings if isinstance(law, str) else law
    laws.settings_of(settings)  # refuses what is no law

    foresight = None
    if know != "positions":
        foresight = Foresight(roster if know == "tracks" else None)

    def ceiling(course: Course) -> Profile | None:
        return laws.profile(course, scene, law=settings)

    def limits(course: Course) -> Profile | None:
        return None

    table: dict[type, tuple[Callable[[Any], Controller], Ceiling]] = {
        PhysicalLaw: (lambda one: Careful(scene, one, know, foresight), ceiling),
        Constant: (lambda one: Follow(), ceiling),
        Optimum: (lambda one: Follow(), limits),
        DissertationLaw: (lambda one: ByRings(scene, one), limits),
        Rpp: (lambda one: Regulated(scene, one), limits),
    }
    make, static = table[type(settings)]
    name = getattr(settings, "name", "") or next(
        row.name for row in laws.LAWS.values() if type(row.settings) is type(settings)
    )
    return Wheel(name, make(settings), static, isinstance(settings, DissertationLaw))

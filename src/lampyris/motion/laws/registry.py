"""Speed laws by name. Adding one: settings, a function like :class:`Build`, and one row of the table."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Protocol, TypeAlias

from numpy.typing import NDArray

from lampyris._core.scalars import is_word
from lampyris.errors import UsageError, did_you_mean, shown
from lampyris.model.obstacles import ObstacleStates
from lampyris.model.path import Path
from lampyris.model.profile import Profile
from lampyris.model.scene import Scene
from lampyris.motion import settings
from lampyris.motion.geometry.sampled_path import SampledPath, sample_with_corners
from lampyris.motion.laws import physical
from lampyris.motion.laws.bounds import Constant, Optimum, constant_profile, optimum_profile
from lampyris.motion.laws.dissertation import DissertationLaw, path_profile
from lampyris.motion.laws.dissertation_in_metres import profile_on_samples
from lampyris.motion.laws.physical import PhysicalLaw, physical_profile
from lampyris.motion.laws.rpp import Rpp, rpp_profile
from lampyris.motion.profile import OnInfeasible
from lampyris.typing import Cell

SpeedLaw: TypeAlias = str | DissertationLaw | PhysicalLaw | Rpp | Constant | Optimum
"""A law's name, or its settings."""


class Build(Protocol):
    """How a law makes a profile; see :func:`profile` for the arguments."""

    def __call__(
        self,
        route: Path | SampledPath,
        scene: Scene,
        law: Any,
        *,
        obstacles: Iterable[Cell] | NDArray[Any],
        obstacle_states: ObstacleStates | None,
        v0: float,
        previous: Cell | None,
        on_infeasible: OnInfeasible,
    ) -> Profile: ...


@dataclass(frozen=True, slots=True)
class Law:
    """One row of the table: what the law is, where it comes from, its settings and how it is computed.

    ``units`` are those on a path of cells; on a sampled path every law speaks of m/s.
    """

    name: str
    units: str
    summary: str
    source: str
    settings: Any
    build: Build


def _dissertation(
    route: Path | SampledPath,
    scene: Scene,
    law: DissertationLaw,
    *,
    obstacles: Iterable[Cell] | NDArray[Any] = (),
    obstacle_states: ObstacleStates | None = None,
    v0: float = 0.0,
    previous: Cell | None = None,
    on_infeasible: OnInfeasible = "raise",
) -> Profile:
    """The dissertation's law: in velocity units on a path, in m/s on a sampled path."""
    if isinstance(route, SampledPath):
        return profile_on_samples(
            route, scene, law, obstacles=obstacles, obstacle_states=obstacle_states, v0=v0
        )
    return path_profile(route, scene, law, obstacles=obstacles, v0=v0, previous=previous)


def _ours(name: str, rule: str, summary: str, source: str) -> Law:
    """Our law with one more rule switched on, under its own name."""
    chosen = PhysicalLaw(**{rule: physical.RULES[rule]()}, name=name)
    return Law(name, "m/s", summary, source, chosen, physical_profile)


LAWS: Mapping[str, Law] = MappingProxyType(
    {
        row.name: row
        for row in (
            Law(
                "physical",
                "m/s",
                "the robot's limits, curvature, braking distance to walls and obstacles, speed zones; in SI units",
                "two passes in v^2 under constant acceleration between nodes; docs/speed/README.md",
                PhysicalLaw(),
                physical_profile,
            ),
            Law(
                "dissertation",
                "velocity units",
                "blocked cells in two rings, the angle of the path, a fixed change of speed from node to node",
                "dissertation, Algorithms 3.10-3.13, as in its Tables 4.12-4.17",
                DissertationLaw(),
                _dissertation,
            ),
            _ours(
                "uncertainty",
                "uncertainty",
                "physical, and slower where the position is uncertain in narrow or undecided places",
                "criteria of Miura, Negishi and Shirai (2006), formulas ours; docs/speed/uncertainty.md",
            ),
            _ours(
                "blind",
                "blind",
                "physical, and able to stop for obstacles that may come out of unseen areas",
                "stopping within what is visible (Lumelsky), with a hidden obstacle; docs/speed/blind_area.md",
            ),
            _ours(
                "three-speed",
                "three_speed",
                "physical, and slow, normal or fast by the predicted motion of obstacles",
                "after Foka and Trahanias (2010), formulas ours; docs/speed/three_speeds.md",
            ),
            _ours(
                "cloud",
                "cloud",
                "physical, and slower where a cloud model of the velocity obstacle rates danger",
                "cloud model and velocity obstacle, combined here; docs/speed/cloud.md",
            ),
            Law(
                "rpp",
                "m/s",
                "the command of Regulated Pure Pursuit at each node, with a backward pass for braking",
                "Nav2's controller; docs/speed/rpp.md",
                Rpp(),
                rpp_profile,
            ),
            Law(
                "constant",
                "m/s",
                "one speed for the whole path: the greatest that is safe everywhere on it",
                "the minimum of the caps of the map and the robot",
                Constant(),
                constant_profile,
            ),
            Law(
                "optimum",
                "m/s",
                "as fast as the robot's limits allow; ignores obstacles and clearance",
                "the time optimum under v_max, a_lat_max, a_max and d_max",
                Optimum(),
                optimum_profile,
            ),
        )
    }
)
"""Every law by name."""


def names() -> tuple[str, ...]:
    """The names of all laws, sorted."""
    return tuple(sorted(LAWS))


def profile(
    route: Path | SampledPath,
    scene: Scene,
    *,
    law: SpeedLaw = "physical",
    obstacles: Iterable[Cell] | NDArray[Any] = (),
    obstacle_states: ObstacleStates | None = None,
    v0: float = 0.0,
    previous: Cell | None = None,
    on_infeasible: OnInfeasible = "raise",
) -> Profile:
    """A speed for every node of a path, each with its cause.

    Parameters
    ----------
    route : a path of cells or a sampled path, whole, or what is left of it from where the robot is.
    scene : its map, zones and robot are used.
    law : a name, or settings of a law (see :func:`with_settings`).
    obstacles : cells that moving obstacles cover now; any iterable of pairs, or an integer array (m, 2).
    obstacle_states : moving obstacles in continuous time, as sensed now.
    v0 : the robot's speed at the first node, in the profile's units.
    previous : the cell the robot came from, if it came from one.
    on_infeasible : ``raise`` for a plan. ``brake`` for a robot on its way, when an obstacle has turned up
        too near for its speed: see :func:`lampyris.motion.profile.feasible_profile`. The dissertation's law
        has no use for it.

    Raises
    ------
    UsageError : ``LAW``: no law of that name.
    SettingError : ``PROFILE_INFEASIBLE``, ``PROFILE_BLOCKED``, ``START_SPEED`` and what the law's own page
        names.
    """
    row, chosen = _found(law)
    if not is_word(on_infeasible, ("raise", "brake")):
        raise UsageError(
            "ON_INFEASIBLE", shown(on_infeasible), where="on_infeasible", allowed="raise or brake"
        )
    return row.build(
        route,
        scene,
        chosen,
        obstacles=obstacles,
        obstacle_states=obstacle_states,
        v0=v0,
        previous=previous,
        on_infeasible=on_infeasible,
    )


def profile_on_cells(
    path: Path,
    scene: Scene,
    *,
    law: SpeedLaw = "physical",
    obstacle_states: ObstacleStates | None = None,
    v0: float = 0.0,
) -> Profile:
    """A speed for every cell of a planned path; its corners are rounded, or stops.

    What :func:`lampyris.speed_profile` and ``lampyris plan`` do unless they are asked for a curve: see
    :func:`lampyris.motion.geometry.sampled_path.corners_of_path`. Laws in velocity units have a rule for corners of their
    own, and know no limits of the robot.

    Parameters
    ----------
    path, scene, law, obstacle_states, v0 : as for :func:`profile`.

    Raises
    ------
    UsageError, SettingError : as :func:`profile`.
    """
    route: Path | SampledPath = path
    if _found(law)[0].units == "m/s":
        route = sample_with_corners(path, scene.grid.resolution, scene.robot)
    return profile(route, scene, law=law, obstacle_states=obstacle_states, v0=v0)


def named(law: str) -> Law:
    """The law of that name.

    Raises
    ------
    UsageError : ``LAW``: no law of that name.
    """
    return _found(law)[0]


def with_settings(name: str, given: Mapping[str, Any]) -> Any:
    """A law's settings, some of them changed.

    Parameters
    ----------
    name : of the law.
    given : by name; a rule's own settings by dotted names such as ``blind.reach``, or as a mapping under the
        rule's name. A rule named here is on; ``{"blind": True}`` (or ``"on"``) turns it on as it is, None,
        False or ``"off"`` off.

    Raises
    ------
    UsageError : ``LAW``: no law of that name.
    SettingError : ``LAW_SETTING``: a setting it does not have, or out of its range.
    """
    row = named(name)
    kinds = physical.RULES if isinstance(row.settings, PhysicalLaw) else {}
    return settings.changed(row.settings, given, kinds, name)


def settings_of(law: SpeedLaw) -> dict[str, Any]:
    """All settings of a law as one flat table, dotted names for a rule's own, None where a rule is off.

    What :func:`with_settings` makes of it is the same law.
    """
    return settings.flattened(settings_named(law))


def settings_named(law: SpeedLaw) -> Any:
    """The settings of a law: its defaults where it is named.

    Raises
    ------
    UsageError : ``LAW``: no law of that name.
    """
    return _found(law)[1]


def name_of(law: SpeedLaw) -> str:
    """The name of a law.

    Raises
    ------
    UsageError : ``LAW``: no law of that name.
    """
    return _found(law)[0].name


def rules_of(name: str) -> dict[str, dict[str, Any]]:
    """The rules of a law that have settings of their own, with their defaults; dotted names."""
    row = named(name)
    kinds = physical.RULES if isinstance(row.settings, PhysicalLaw) else {}
    return {
        rule: {f"{rule}.{k}": v for k, v in settings.flattened(kind()).items()}
        for rule, kind in kinds.items()
    }


def _found(law: Any) -> tuple[Law, Any]:
    if isinstance(law, str) and law in LAWS:
        return LAWS[law], LAWS[law].settings
    if isinstance(law, PhysicalLaw) and law.name in LAWS:
        return LAWS[law.name], law
    for row in LAWS.values():
        if isinstance(law, type(row.settings)) and not isinstance(law, PhysicalLaw):
            return row, law
    raise UsageError(
        "LAW",
        f"no speed law is called {shown(law)}",
        where="law",
        allowed=", ".join(names()),
        todo=did_you_mean(law, names()),
    )

"""Speed laws by name. Adding one: settings, a function like :class:`Build`, and one row of the table."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Protocol

from numpy.typing import NDArray

from lampyris.errors import UsageError, did_you_mean
from lampyris.model.movers import Movers
from lampyris.model.path import Path
from lampyris.model.profile import Profile
from lampyris.model.scene import Scene
from lampyris.motion.course import Course
from lampyris.motion.dissertation import DissertationLaw, law_profile
from lampyris.motion.physical import PhysicalLaw, physical_profile
from lampyris.motion.profile import OnInfeasible
from lampyris.typing import Cell


class Build(Protocol):
    """How a law makes a profile; see :func:`profile` for the arguments."""

    def __call__(
        self,
        way: Path | Course,
        scene: Scene,
        law: Any,
        *,
        obstacles: Iterable[Cell] | NDArray[Any],
        movers: Movers | None,
        v0: float,
        previous: Cell | None,
        on_infeasible: OnInfeasible,
    ) -> Profile: ...


@dataclass(frozen=True, slots=True)
class Law:
    """One row of the table: what the law is, where it comes from, its settings and how it is computed."""

    name: str
    units: str
    summary: str
    source: str
    settings: Any
    build: Build


LAWS: Mapping[str, Law] = MappingProxyType(
    {
        row.name: row
        for row in (
            Law(
                "dissertation",
                "velocity units",
                "obstacles in two rings, the angle of the path, so much more or less a transfer",
                "dissertation, Algorithms 3.10-3.13, as its Tables 4.12-4.17 have it",
                DissertationLaw(),
                law_profile,
            ),
            Law(
                "physical",
                "m/s",
                "limits of the robot and room to stop before the nearest surface, in SI units",
                "two passes in v^2 under constant acceleration between nodes",
                PhysicalLaw(),
                physical_profile,
            ),
        )
    }
)
"""Every law by name."""


def names() -> tuple[str, ...]:
    """The names of all laws, sorted."""
    return tuple(sorted(LAWS))


def profile(
    way: Path | Course,
    scene: Scene,
    *,
    law: str | DissertationLaw | PhysicalLaw = "physical",
    obstacles: Iterable[Cell] | NDArray[Any] = (),
    movers: Movers | None = None,
    v0: float = 0.0,
    previous: Cell | None = None,
    on_infeasible: OnInfeasible = "raise",
) -> Profile:
    """A speed for every node of a way, each with its cause.

    Parameters
    ----------
    way : a path of cells or a course, whole, or what is left of it from where the robot is.
    scene : its map and robot are used.
    law : a name, or settings of a law.
    obstacles : cells that moving bodies cover now; any iterable of pairs, or an integer array (m, 2).
    movers : moving obstacles in continuous time, as sensed now.
    v0 : the robot's speed at the first node, in the law's units.
    previous : the cell the robot came from, if it came from one.
    on_infeasible : ``raise`` for a plan. ``brake`` for a robot on its way, when an obstacle has turned up
        too near for its speed: see :func:`lampyris.motion.profile.feasible_profile`. The dissertation's law
        has no use for it.

    Raises
    ------
    UsageError : ``LAW``: no law of that name.
    SettingError : ``PROFILE_INFEASIBLE``, ``START_SPEED`` and what the law's own page names.
    """
    row, settings = _found(law)
    if on_infeasible not in ("raise", "brake"):
        raise UsageError(
            "ON_INFEASIBLE", f"{on_infeasible!r}", where="on_infeasible", allowed="raise or brake"
        )
    return row.build(
        way,
        scene,
        settings,
        obstacles=obstacles,
        movers=movers,
        v0=v0,
        previous=previous,
        on_infeasible=on_infeasible,
    )


def named(law: str) -> Law:
    """The law of that name.

    Raises
    ------
    UsageError : ``LAW``: no law of that name.
    """
    return _found(law)[0]


def _found(law: Any) -> tuple[Law, Any]:
    if isinstance(law, str) and law in LAWS:
        return LAWS[law], LAWS[law].settings
    for row in LAWS.values():
        if isinstance(law, type(row.settings)):
            return row, law
    raise UsageError(
        "LAW",
        f"no speed law is called {law!r}",
        where="law",
        allowed=", ".join(names()),
        todo=did_you_mean(law, names()),
    )

"""Glowworms over waypoints: GSO as published, and an improved one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from lampyris._core.settings import default_of, number, whole, word
from lampyris.errors import SettingError, shown
from lampyris.planning.swarm.encoding import Encoding
from lampyris.planning.swarm.optimisers.glowworm import CHOICES, GSO
from lampyris.planning.swarm.optimisers.steps import CoolingStep, FixedStep
from lampyris.planning.swarm.session import Task
from lampyris.planning.swarm.waypoints import WaypointPlanner


@dataclass(frozen=True, slots=True)
class Gso(WaypointPlanner):
    """Glowworm swarm optimisation whose glowworms are whole paths, written as waypoints.

    The swarm is that of Krishnanand and Ghose (see :mod:`lampyris.planning.swarm.optimisers.glowworm`) in the unit box; luciferin
    takes in minus the fitness. That a glowworm is a path is ours: theirs is a point.

    Parameters
    ----------
    sensor : r_s as a share of the box's diagonal, > 0 to 1.
    step : length of a move in the unit box, > 0 to 1.
    nt : desired number of neighbours, 0 to 2000.
    rho, gamma, beta : decay and renewal of luciferin, and how fast ranges adapt.
    choice : ``roulette`` or ``greedy`` (deterministic GSO).
    """

    sensor: float = number(0.5, 1e-6, 1.0, title="sensor radius")
    step: float = number(0.03, 1e-6, 1.0, title="step length")
    nt: int = whole(default_of(GSO, "nt"), 0, 2000, title="neighbours wanted")
    rho: float = number(default_of(GSO, "rho"), 0.0, 1.0, title="luciferin decay")
    gamma: float = number(default_of(GSO, "gamma"), 1e-6, 1e6, title="luciferin enhancement")
    beta: float = number(default_of(GSO, "beta"), 0.0, 1e6, title="range adaptation")
    choice: str = word(default_of(GSO, "choice"), CHOICES, title="choice of the leader")

    name: ClassVar[str] = "gso"
    summary: ClassVar[str] = "GSO: a glowworm swarm over waypoints."
    source: ClassVar[str] = (
        "Krishnanand and Ghose 2009: the swarm. Ours: waypoints as glowworms, the fitness, the exact seed."
    )

    def optimiser(self, task: Task, encoding: Encoding) -> GSO:
        """Glowworms in the unit box."""
        return GSO(
            n=self.swarm,
            sensor=self.sensor * encoding.box.diagonal,
            rho=self.rho,
            gamma=self.gamma,
            beta=self.beta,
            nt=self.nt,
            step=FixedStep(self.step),
            choice=self.choice,
        )


@dataclass(frozen=True, slots=True)
class Igso(WaypointPlanner):
    """Improved glowworm swarm optimisation over waypoints.

    After what the dissertation and an abstract tell of He and Huang (Math. Probl. Eng. 2016, 3196958): a step
    that changes with time, a range as wide as the space, random moves of the brightest. Their formulas could
    not be found; those used are ours (:class:`lampyris.planning.swarm.optimisers.steps.CoolingStep`, and ``wander`` of
    :class:`lampyris.planning.swarm.optimisers.glowworm.GSO`).

    Parameters
    ----------
    step, least : length of the first and of the last moves in the unit box, least <= step.
    wander : how far the brightest try a place, in sides of the box. 0: not at all.
    """

    step: float = number(0.1, 1e-6, 1.0, title="step length")
    least: float = number(0.005, 1e-6, 1.0, title="last step length")
    wander: float = number(0.05, 0.0, 1.0, title="random steps of the brightest")

    name: ClassVar[str] = "igso"
    summary: ClassVar[str] = "IGSO: an improved glowworm swarm over waypoints."
    source: ClassVar[str] = (
        "He and Huang 2016, known from its abstract alone: every formula is ours, as are the waypoints."
    )

    def __post_init__(self) -> None:
        WaypointPlanner.__post_init__(self)
        if self.least > self.step:
            allowed = f"at most the first step, {self.step:g}"
            raise SettingError.of("LEAST", "least", shown(self.least), where=self.name, allowed=allowed)

    def optimiser(self, task: Task, encoding: Encoding) -> GSO:
        """Glowworms in the unit box whose steps shrink over the iterations."""
        step = CoolingStep(most=self.step, least=self.least, horizon=float(self.iterations))
        return GSO(n=self.swarm, step=step, wander=self.wander)

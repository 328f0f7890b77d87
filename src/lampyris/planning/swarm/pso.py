"""Particles over waypoints: one best for all, a ring, adaptive inertia, grid lines, a potential field."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from lampyris._core.settings import default_of, number, redeclared, whole
from lampyris.errors import SettingError, shown
from lampyris.planning.swarm.encoding import Encoding, on_lines
from lampyris.planning.swarm.optimisers.particle import PSO, DiversityRule, FixedInertia, SuccessInertia
from lampyris.planning.swarm.potential_field import push_of
from lampyris.planning.swarm.session import SwarmPlanner, Task
from lampyris.planning.swarm.waypoints import WaypointPlanner


@dataclass(frozen=True, slots=True)
class ParticlePlanner(WaypointPlanner):
    """Particle swarm optimisation over waypoints. Abstract.

    Parameters
    ----------
    inertia : share of its speed a particle keeps, 0 to 1.
    own, others : pulls towards its own best place and its neighbourhood's, 0 to 10.
    clamp : maximum speed in sides of the map an iteration, > 0 to 1.
    """

    inertia: float = number(0.7298, 0.0, 1.0)
    own: float = number(default_of(PSO, "own"), 0.0, 10.0, title="pull to its own best")
    others: float = number(default_of(PSO, "others"), 0.0, 10.0, title="pull to the neighbours' best")
    clamp: float = number(default_of(PSO, "clamp"), 1e-6, 1.0, title="maximum speed")

    def optimiser(self, task: Task, encoding: Encoding) -> PSO:
        """Particles in the unit box."""
        return PSO(
            n=self.swarm,
            inertia=FixedInertia(self.inertia),
            own=self.own,
            others=self.others,
            clamp=self.clamp,
        )


@dataclass(frozen=True, slots=True)
class Pso(ParticlePlanner):
    """Particle swarm optimisation over waypoints: every particle is drawn to the best of all.

    The swarm is that of Kennedy and Eberhart with inertia (see :mod:`lampyris.planning.swarm.optimisers.particle`). The waypoints
    and the fitness are ours.
    """

    name: ClassVar[str] = "pso"
    summary: ClassVar[str] = "PSO: a particle swarm with one best for all, over waypoints."
    source: ClassVar[str] = (
        "Kennedy and Eberhart 1995, inertia after Shi and Eberhart 1998: the swarm. Ours: waypoints, "
        "fitness, the exact seed."
    )


@dataclass(frozen=True, slots=True)
class LPso(ParticlePlanner):
    """Particle swarm optimisation over waypoints: every particle sees its neighbours on a ring (lbest).

    Parameters
    ----------
    ring : neighbours seen on each side, 1 to 1000.
    """

    ring: int = whole(1, 1, 1000, title="neighbours on each side")

    name: ClassVar[str] = "lpso"
    summary: ClassVar[str] = "Lbest PSO: a particle swarm with a ring neighbourhood, over waypoints."
    source: ClassVar[str] = (
        "Kennedy and Eberhart 1995, ring neighbourhood: the swarm. Ours: waypoints, fitness, the exact seed."
    )

    def optimiser(self, task: Task, encoding: Encoding) -> PSO:
        """Particles on a ring."""
        return PSO(
            n=self.swarm,
            ring=self.ring,
            inertia=FixedInertia(self.inertia),
            own=self.own,
            others=self.others,
            clamp=self.clamp,
        )


@dataclass(frozen=True, slots=True)
class APso(WaypointPlanner):
    """Adaptive particle swarm over waypoints; near walls weighs more in its fitness than elsewhere.

    The dissertation tells of X. Li's APSO that its objective takes the distances to the goal and to the
    obstacles into account; the paper could not be found. Ours: what adapts (the inertia follows the share of
    particles that just improved), and the clearance's greater weight for the distance to obstacles.

    Parameters
    ----------
    low, high : inertia when no particle improves and when all do, 0 to 1.
    """

    clearance: float = redeclared(SwarmPlanner, "clearance", 0.3)
    low: float = number(default_of(SuccessInertia, "low"), 0.0, 1.0, title="least inertia")
    high: float = number(default_of(SuccessInertia, "high"), 0.0, 1.0, title="greatest inertia")

    name: ClassVar[str] = "apso"
    summary: ClassVar[str] = "APSO: an adaptive particle swarm over waypoints."
    source: ClassVar[str] = (
        "APSO (X. Li), paper not found: the adaptation (inertia follows success) and the weights are ours."
    )

    def optimiser(self, task: Task, encoding: Encoding) -> PSO:
        """Particles whose inertia follows success."""
        return PSO(n=self.swarm, inertia=SuccessInertia(self.low, self.high))


@dataclass(frozen=True, slots=True)
class DiversityPso(ParticlePlanner):
    """Particle swarm over waypoints that is driven apart where its diversity is low.

    The particles are divided into groups. A particle is pulled to its own best place and to the best of its group. Where
    the diversity of a group, the mean distance of its particles from their centre, falls below ``low``, the second pull
    becomes a push until the diversity exceeds ``high``. See
    :class:`lampyris.planning.swarm.optimisers.particle.DiversityRule`.

    Parameters
    ----------
    low, high : diversity below which a group is driven apart, and up to which; shares of the box's diagonal, low <= high.
    groups : of particles, each with its own diversity and its own best, 1 to 100; never more than there are particles.
    """

    low: float = number(default_of(DiversityRule, "low"), 0.0, 1.0, title="least diversity")
    high: float = number(default_of(DiversityRule, "high"), 0.0, 1.0, title="greatest diversity")
    groups: int = whole(3, 1, 100, title="groups of particles")

    name: ClassVar[str] = "diversity-pso"
    summary: ClassVar[str] = (
        "Diversity PSO: groups of particles that are driven apart where their diversity is low."
    )
    source: ClassVar[str] = (
        "Riget and Vesterstroem 2002: attraction and repulsion by diversity. Groups after what the dissertation (2.4.3) "
        "says of an adaptive PSO for unconstrained optimisation, paper not found. Ours: waypoints, fitness, the seed."
    )

    def __post_init__(self) -> None:
        WaypointPlanner.__post_init__(self)
        if self.low > self.high:
            allowed = f"at most high, {self.high:g}"
            raise SettingError.of("LOW", "low", shown(self.low), where=self.name, allowed=allowed)

    def optimiser(self, task: Task, encoding: Encoding) -> PSO:
        """Particles in groups."""
        return PSO(
            n=self.swarm,
            inertia=FixedInertia(self.inertia),
            own=self.own,
            others=self.others,
            clamp=self.clamp,
            diversity=DiversityRule(self.low, self.high, self.groups),
        )


@dataclass(frozen=True, slots=True)
class IPso(ParticlePlanner):
    """Particle swarm over waypoints that slide along grid lines between start and goal.

    Each waypoint has a grid line of its own, across the main direction of travel: evenly spaced lines, or
    those through the seed's waypoints. The dissertation tells of Dewang's IPSO that about 20 iterations are
    enough (the default here), and of Shahab's PSO that it samples grid lines between start and goal; neither
    paper could be found, so everything beyond these two sentences is ours.
    """

    iterations: int = redeclared(SwarmPlanner, "iterations", 20)

    name: ClassVar[str] = "ipso"
    summary: ClassVar[str] = "IPSO: a particle swarm whose waypoints slide along grid lines."
    source: ClassVar[str] = (
        "IPSO (Dewang) and grid-line sampling (Shahab) as the dissertation tells of them; papers not found, "
        "the rest is ours."
    )

    def encoding(self, task: Task, base: np.ndarray[Any, np.dtype[np.int64]]) -> Encoding:
        """One number for each waypoint: how far along its line it is."""
        return on_lines(task.ground, task.start, base)


@dataclass(frozen=True, slots=True)
class PsoApf(ParticlePlanner):
    """Particle swarm over waypoints in an artificial potential field.

    The field's force is added to the particles' speeds. Girija and Joshi's paper could not be found; that the
    force enters the speed is how later hybrids couple the two. The repulsion is Khatib's (IJRR 5(1), 1986):
    ``U = eta / 2 (1/d - 1/d0)^2`` within d0 of a wall. Instead of a pull to the goal, under which all
    waypoints would gather there, each is pulled to the middle of its neighbours (ours).

    Parameters
    ----------
    attract : share of the distance to the middle of its neighbours that a waypoint is pulled, 0 to 1.
    repel : eta, in cells cubed an iteration, 0 to 100. No push exceeds one cell.
    reach : d0 in cells, > 0.5 to 50.
    """

    attract: float = number(0.05, 0.0, 1.0, title="pull to the middle")
    repel: float = number(0.5, 0.0, 100.0, title="repulsion from walls")
    reach: float = number(3.0, 0.5, 50.0, unit="cells", title="reach of the repulsion")

    name: ClassVar[str] = "pso-apf"
    summary: ClassVar[str] = (
        "PSO-APF: a particle swarm over waypoints, pushed from walls by a potential field."
    )
    source: ClassVar[str] = (
        "Khatib 1986: the repulsion. PSO-APF (Girija and Joshi 2019), paper not found: the coupling and the "
        "attraction are ours."
    )

    def optimiser(self, task: Task, encoding: Encoding) -> PSO:
        """Particles pushed by the field."""
        return PSO(
            n=self.swarm,
            inertia=FixedInertia(self.inertia),
            own=self.own,
            others=self.others,
            clamp=self.clamp,
            push=push_of(task, encoding, self.attract, self.repel, self.reach),
        )

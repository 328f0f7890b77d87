"""Particle swarm optimisation (PSO): one best for all, or the best of a ring neighbourhood.

J. Kennedy, R. Eberhart, "Particle swarm optimization", ICNN 1995; inertia after Y. Shi, R. Eberhart, "A
modified particle swarm optimizer", ICEC 1998; the default constants are those of M. Clerc, J. Kennedy, IEEE
TEC 6(1):58-73, 2002 (inertia 0.7298, both pulls 2.05 times that). For particle i with best place y_i and best
place yhat_i of its neighbourhood, coordinate by coordinate, r1 and r2 uniform:

* ``v_i = w v_i + c1 r1 (y_i - x_i) + c2 r2 (yhat_i - x_i)``, kept within plus and minus ``clamp`` sides of
  the box
* ``x_i = x_i + v_i``; where that leaves the box the particle stays on its wall, and that speed is lost (ours;
  the sources differ)

Speeds are zero at first.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

from lampyris._core.exclusive import Exclusive, one_call
from lampyris._core.scalars import in_range, is_whole
from lampyris.errors import SettingError, shown
from lampyris.planning.swarm.optimisers.box import Box, Points, Values, checked_values, norms

MOST = 100_000


class Inertia(Protocol):
    """How much of its speed a particle keeps."""

    def after(self, share: float) -> float:
        """w, once ``share`` of the particles, 0 to 1, have just found a better place of their own."""
        ...


def _within(rule: Any, least: float, most: float) -> None:
    for f in fields(rule):
        value = getattr(rule, f.name)
        if not in_range(value, least, most):
            raise SettingError.of("INERTIA", f.name, shown(value), allowed=f"a number, {least:g} to {most:g}")


@dataclass(frozen=True, slots=True)
class FixedInertia:
    """The same inertia always."""

    w: float = 0.7298

    def __post_init__(self) -> None:
        _within(self, 0.0, 1.0)

    def after(self, share: float) -> float:
        """w."""
        return self.w


@dataclass(frozen=True, slots=True)
class SuccessInertia:
    """Adaptive inertia: ``w = low + (high - low) * share of particles that just improved``.

    While many succeed the swarm keeps going, when few do it settles down. Ours: the paper behind the name
    APSO (X. Li and others) could not be found; letting inertia follow success is a known idea.
    """

    low: float = 0.4
    high: float = 0.9

    def __post_init__(self) -> None:
        _within(self, 0.0, 1.0)

    def after(self, share: float) -> float:
        """w after a round in which that share improved."""
        return self.low + (self.high - self.low) * share


@dataclass(frozen=True, slots=True)
class DiversityRule:
    """Attraction and repulsion by diversity, in groups of particles.

    The diversity of a group is the mean distance of its particles from their centre, as a share of the box's diagonal.
    Every particle is drawn to its own best place, and to the best of its group; when the group's diversity falls below
    ``low`` that second pull becomes a push, until the diversity exceeds ``high``. J. Riget, J. S. Vesterstroem, "A
    diversity-guided particle swarm optimizer", EVALife 2002-02, turn both pulls around, in one group. That particles
    are divided into groups, and in a group of low diversity follow their own best place, is what the dissertation
    (2.4.3) says of an adaptive PSO for unconstrained optimisation, a paper that could not be found.

    Parameters
    ----------
    low, high : shares of the diagonal, 0 <= low <= high <= 1.
    groups : of particles with numbers that follow each other, 1 or more; each particle is one where there are fewer.

    Raises
    ------
    SettingError : ``DIVERSITY``.
    """

    low: float = 0.02
    high: float = 0.1
    groups: int = 1

    def __post_init__(self) -> None:
        if not in_range(self.low, 0.0, 1.0) or not in_range(self.high, 0.0, 1.0) or self.low > self.high:
            what = f"low {shown(self.low)}, high {shown(self.high)}"
            raise SettingError("DIVERSITY", what, allowed="0 <= low <= high <= 1", setting="low")
        if not is_whole(self.groups, 1, MOST):
            raise SettingError.of("DIVERSITY", "groups", shown(self.groups), allowed=f"1 to {MOST:,}")


Push = Callable[[Points], Points]
"""From positions (n, d) to what is added to the speeds (n, d)."""


@dataclass(frozen=True, slots=True)
class PSO:
    """Settings of particle swarm optimisation.

    Parameters
    ----------
    n : particles, 1 to 100,000.
    ring : neighbours on each side whose best a particle looks at (lbest); None: the whole swarm (gbest).
    inertia : the inertia rule.
    own, others : c1 and c2, the pulls towards the own best place and the neighbourhood's, >= 0.
    clamp : maximum speed, in sides of the box an iteration, > 0.
    push : an outside force: what it says is added to the speeds before they are clamped.
    diversity : turns the pull of the best around where a group is too close together; without a ring. None: never.

    Raises
    ------
    SettingError : a setting out of its range.
    """

    n: int = 30
    ring: int | None = None
    inertia: Inertia = FixedInertia()
    own: float = 1.49618
    others: float = 1.49618
    clamp: float = 0.5
    push: Push | None = None
    diversity: DiversityRule | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.n, int) or isinstance(self.n, bool) or not 1 <= self.n <= MOST:
            raise SettingError.of(
                "SWARM", "n", shown(self.n), where="pso", allowed=f"a whole number, 1 to {MOST}"
            )
        ring = self.ring
        if ring is not None and (not isinstance(ring, int) or isinstance(ring, bool) or ring < 1):
            raise SettingError.of(
                "RING", "ring", shown(ring), where="pso", allowed="a whole number >= 1, or None"
            )
        for name, least in (("own", 0.0), ("others", 0.0), ("clamp", 5e-324)):
            value = getattr(self, name)
            if not in_range(value, least, math.inf):
                allowed = f"a finite number from {least:g}"
                raise SettingError.of("PSO", name, shown(value), where="pso", allowed=allowed)

    def start(self, box: Box, rng: np.random.Generator, first: ArrayLike | None = None) -> ParticleSwarm:
        """A swarm at its first iteration; see :meth:`lampyris.planning.swarm.optimisers.loop.Optimiser.start`."""
        return ParticleSwarm(self, box, rng, first)


def apso(n: int = 30) -> PSO:
    """Adaptive PSO: one best for all, and an inertia that follows success (:class:`SuccessInertia`)."""
    return PSO(n=n, inertia=SuccessInertia())


class ParticleSwarm(Exclusive):
    """One run of PSO. The state is public; nothing else is remembered. It serves one call at a time.

    Attributes
    ----------
    iteration : rounds so far.
    positions, speeds : (n, d).
    places, values : (n, d) and (n,); each particle's own best place and its value.
    group, apart : (n,) and (groups,); which group a particle is in, and which groups are being driven apart.
    """

    def __init__(
        self, settings: PSO, box: Box, rng: np.random.Generator, first: ArrayLike | None = None
    ) -> None:
        self.settings = settings
        self.box = box
        self.iteration = 0
        self.positions = box.begin(rng, settings.n, first)
        self.speeds = np.zeros_like(self.positions)
        self.places = self.positions
        self.values = np.full(settings.n, -np.inf)
        rule = settings.diversity
        many = 1 if rule is None else min(rule.groups, settings.n)
        self.group = np.arange(settings.n) * many // settings.n
        self.apart = np.zeros(many, dtype=np.bool_)
        self._rng = rng

    def ask(self) -> Points:
        """Where the particles are, (n, d)."""
        return self.positions

    @one_call
    def tell(self, values: Values) -> None:
        """Take in the value at every particle, (n,), the greater the better, and let all of them move."""
        s, x = self.settings, self.positions
        now = checked_values(values, s.n)
        better = now > self.values
        self.values = np.where(better, now, self.values)
        self.places = np.where(better[:, np.newaxis], x, self.places)
        share = float(np.count_nonzero(better)) / s.n
        own, others = self._rng.random(x.shape), self._rng.random(x.shape)
        speeds = s.inertia.after(share) * self.speeds
        speeds = speeds + s.own * own * (self.places - x)
        pull = self.places[self.guides()] - x
        if s.diversity is not None:
            spread = self.diversity()
            self.apart = np.where(self.apart, spread <= s.diversity.high, spread < s.diversity.low)
            pull = np.where(self.apart[self.group][:, np.newaxis], -pull, pull)
        speeds = speeds + s.others * others * pull
        if s.push is not None:
            speeds = speeds + s.push(x)
        most = s.clamp * self.box.span
        speeds = np.minimum(np.maximum(speeds, -most), most)
        moved = x + speeds
        kept = np.minimum(np.maximum(moved, self.box.low), self.box.high)
        self.speeds = np.where(kept == moved, speeds, 0.0)
        self.positions = kept
        self.iteration += 1

    def diversity(self) -> Values:
        """Of each group: the mean distance of its particles from their centre, as a share of the diagonal."""
        found = []
        for k in range(self.apart.size):
            x = self.positions[self.group == k]
            away = norms(x - np.cumsum(x, axis=0)[-1] / len(x))
            found.append(np.cumsum(away)[-1] / len(x) / self.box.diagonal)
        return np.array(found)

    def guides(self) -> np.ndarray[tuple[int, ...], np.dtype[np.intp]]:
        """Index of the particle whose best place each one looks at, (n,). Ties: itself, then the nearer, then
        the one behind."""
        n, ring = self.settings.n, self.settings.ring
        if self.apart.size > 1:
            first = np.searchsorted(self.group, np.arange(self.apart.size))
            best = np.array([a + self.values[self.group == k].argmax() for k, a in enumerate(first)])
            return best[self.group].astype(np.intp)
        if ring is None:
            return np.full(n, self.values.argmax(), dtype=np.intp)
        at = np.arange(n)
        best = at
        for k in range(1, min(ring, n // 2) + 1):
            for other in ((at - k) % n, (at + k) % n):
                best = np.where(self.values[other] > self.values[best], other, best)
        return best

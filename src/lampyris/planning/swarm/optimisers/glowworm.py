"""Glowworm swarm optimisation (GSO), as Krishnanand and Ghose published it, and its variants.

K. N. Krishnanand, D. Ghose, "Glowworm swarm optimization for simultaneous capture of multiple local optima of
multimodal functions", Swarm Intelligence 3(2):87-124, 2009. For glowworm i at iteration t, maximising J:

1. luciferin ``l_i(t) = (1 - rho) l_i(t-1) + gamma J(x_i(t))``
2. neighbours ``N_i(t) = { j : d_ij(t) < r_i(t) and l_i(t) < l_j(t) }``
3. leader j, drawn with probability ``p_ij = (l_j - l_i) / sum over k in N_i of (l_k - l_i)``; with no
   neighbour it does not move
4. move ``x_i(t+1) = x_i(t) + s (x_j - x_i) / |x_j - x_i|``
5. range ``r_i(t+1) = min(r_s, max(0, r_i(t) + beta (n_t - |N_i(t)|)))``

As in the authors' program, all leaders are chosen from the old positions before anyone moves, a move that
would leave the box is not taken, and step 5 counts the neighbours of before the move. That program's
neighbours have ``d <= r``; here it is ``<``, as printed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lampyris._core.defaults import BETA, GAMMA, LUCIFERIN, NEIGHBOURS, RHO
from lampyris._core.exclusive import Exclusive, one_call
from lampyris._core.scalars import in_range, is_word
from lampyris.errors import SettingError, shown
from lampyris.planning.swarm.optimisers.box import Box, Points, Values, checked_values, norms
from lampyris.planning.swarm.optimisers.steps import HORIZON, CoolingStep, DecayingStep, FixedStep, StepRule

CHOICES = ("roulette", "greedy")
MOST = 5000
"""Glowworms at most: every pair of them is looked at."""
_PUBLISHED_STEP = FixedStep()


@dataclass(frozen=True, slots=True)
class GSO:
    """Settings of glowworm swarm optimisation; the defaults are the authors' where they give one.

    Parameters
    ----------
    n : glowworms, 1 to 5000.
    sensor : r_s, the greatest range, and the range at first; None: the diagonal of the box (IGSO). The one
        value besides n that the authors leave to the user.
    rho, gamma : decay of luciferin, 0 <= rho <= 1, and its renewal, > 0.
    beta, nt : how fast the range adapts, >= 0, and the neighbours it aims at, >= 0.
    step : the step rule.
    luciferin : at first, l_0.
    choice : ``roulette``, as published; ``greedy``, the brightest neighbour (ties: the first), which the
        authors call deterministic GSO and report to find a single source sooner.
    wander : a glowworm without a neighbour tries a place at random, ``wander (u - 1/2)`` sides of the box
        away in each coordinate, u uniform in 0 to 1, and goes back if it is worse there. 0: it stays. Ours.

    Raises
    ------
    SettingError : a setting out of its range.
    """

    n: int = 100
    sensor: float | None = None
    rho: float = RHO
    gamma: float = GAMMA
    beta: float = BETA
    nt: int = NEIGHBOURS
    step: StepRule = _PUBLISHED_STEP
    luciferin: float = LUCIFERIN
    choice: str = "roulette"
    wander: float = 0.0

    def __post_init__(self) -> None:
        if not isinstance(self.n, int) or isinstance(self.n, bool) or not 1 <= self.n <= MOST:
            raise SettingError.of(
                "SWARM", "n", shown(self.n), where="gso", allowed=f"a whole number, 1 to {MOST}"
            )
        if not is_word(self.choice, CHOICES):
            raise SettingError("CHOICE", shown(self.choice), where="gso", allowed=", ".join(CHOICES))
        ranges = (
            ("rho", 0.0, 1.0),
            ("gamma", 5e-324, math.inf),
            ("beta", 0.0, math.inf),
            ("nt", 0, math.inf),
            ("luciferin", -math.inf, math.inf),
            ("wander", 0.0, 1.0),
            ("sensor", 5e-324, math.inf),
        )
        for name, least, most in ranges:
            value = getattr(self, name)
            if name == "sensor" and value is None:
                continue
            if not in_range(value, least, most):
                allowed = f"a finite number, {least:g} to {most:g}"
                raise SettingError.of("GSO", name, shown(value), where="gso", allowed=allowed)

    def start(self, box: Box, rng: np.random.Generator, first: ArrayLike | None = None) -> GlowwormSwarm:
        """A swarm at its first iteration; see :meth:`lampyris.planning.swarm.optimisers.loop.Optimiser.start`."""
        return GlowwormSwarm(self, box, rng, first)


def adaptive_gso(n: int = 100, sensor: float | None = None, step: DecayingStep | None = None) -> GSO:
    """GSO with an adaptive step (see :class:`lampyris.planning.swarm.optimisers.steps.DecayingStep`)."""
    return GSO(n=n, sensor=sensor, step=step or DecayingStep())


def igso(n: int = 100, horizon: float = HORIZON, most: float = 0.3, wander: float = 0.1) -> GSO:
    """Improved GSO after what is known of He and Huang, Math. Probl. Eng. 2016, 3196958.

    Known: a new step rule, a range as wide as the space, random moves of the brightest. Their formulas could
    not be found; the three used here (:class:`CoolingStep`, ``sensor=None``, ``wander``) are ours.

    Parameters
    ----------
    n : glowworms.
    horizon : iterations over which the step shrinks.
    most : length of the first steps.
    wander : see :class:`GSO`.
    """
    return GSO(n=n, step=CoolingStep(most=most, least=most / 30.0, horizon=horizon), wander=wander)


class GlowwormSwarm(Exclusive):
    """One run of GSO. The state is public; nothing else is remembered. It serves one call at a time.

    Attributes
    ----------
    iteration : t.
    positions : (n, d); where the glowworms are (and where the next values are wanted).
    luciferin : (n,).
    ranges : (n,); r_i.
    """

    def __init__(
        self, settings: GSO, box: Box, rng: np.random.Generator, first: ArrayLike | None = None
    ) -> None:
        n = settings.n
        self.settings = settings
        self.box = box
        self.iteration = 0
        self.positions = box.begin(rng, n, first)
        self.luciferin = np.full(n, float(settings.luciferin))
        self._sensor = box.diagonal if settings.sensor is None else float(settings.sensor)
        self.ranges = np.full(n, self._sensor)
        self._rng = rng
        self._home = self.positions
        self._home_values = np.full(n, -np.inf)

    def ask(self) -> Points:
        """Where the glowworms are, (n, d)."""
        return self.positions

    @one_call
    def tell(self, values: Values) -> None:
        """Take in J at every glowworm, (n,), and let all of them move."""
        s = self.settings
        light = checked_values(values, s.n)
        if s.wander > 0:
            light = self._back_home(light)
        self.luciferin = (1.0 - s.rho) * self.luciferin + s.gamma * light
        x = self.positions
        distance = norms(x[np.newaxis, :, :] - x[:, np.newaxis, :])
        brighter = self.luciferin[np.newaxis, :] - self.luciferin[:, np.newaxis]
        near = (distance < self.ranges[:, np.newaxis]) & (brighter > 0.0)
        weights = np.where(near, brighter, 0.0)
        count = near.sum(axis=1)
        if s.choice == "roulette":
            leader = roulette(weights, self._rng.random(s.n))
        else:
            leader = weights.argmax(axis=1)
        rows = np.arange(s.n)
        gap = distance[rows, leader]
        goes = (count > 0) & (gap > 0.0)
        toward = (x[leader] - x) / np.where(goes, gap, 1.0)[:, np.newaxis]
        moved = x + s.step.at(self.iteration) * toward
        goes &= self.box.contains(moved)
        self.positions = np.where(goes[:, np.newaxis], moved, x)
        if s.wander > 0:
            self._wander(count == 0, light)
        wanted = self.ranges + s.beta * (s.nt - count)
        self.ranges = np.minimum(self._sensor, np.maximum(0.0, wanted))
        self.iteration += 1

    def _back_home(self, light: Values) -> Values:
        """Those that tried a place and found it worse are back where they were, with the light they had."""
        worse = light < self._home_values
        self.positions = np.where(worse[:, np.newaxis], self._home, self.positions)
        return np.where(worse, self._home_values, light)

    def _wander(self, alone: NDArray[np.bool_], light: Values) -> None:
        s = self.settings
        away = s.wander * (self._rng.random(self.positions.shape) - 0.5) * self.box.span
        tried = self.positions + away
        alone &= self.box.contains(tried)
        self._home = self.positions
        self._home_values = np.where(alone, light, -np.inf)
        self.positions = np.where(alone[:, np.newaxis], tried, self.positions)


def roulette(weights: NDArray[np.float64], draws: Values) -> NDArray[np.intp]:
    """One column for each row, drawn with probability proportional to its weight; intp, (m,).

    Parameters
    ----------
    weights : (m, n), >= 0. A row of zeros gives column 0.
    draws : (m,), uniform in 0 <= u < 1.

    Sums run from left to right (``cumsum``), so that they are the same everywhere. The threshold is kept
    below the last sum, which ``u * sum`` may reach by rounding.
    """
    sums = np.cumsum(weights, axis=1)
    last = sums[:, -1]
    threshold = np.minimum(draws * last, np.nextafter(last, 0.0))
    column: NDArray[np.intp] = (sums > threshold[:, np.newaxis]).argmax(axis=1)
    return column

"""Drawn questions to the feasible profile: distances, caps, limits and stops, tame and extreme."""

from __future__ import annotations

import itertools
import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from lampyris.motion.profile import Feasible, feasible_profile
from lampyris.referee import check_motion
from lampyris.referee.verdict import Violation
from lampyris.typing import Floats

_SIZES = np.array([1, 2, 2, 3, 4, 6, 10, 25, 60])


class ProfileCase(NamedTuple):
    """One question.

    Parameters
    ----------
    s : metres, (n,).
    caps : cause and m/s (n,); the first is the top speed.
    a, d : m/s2.
    stop : bool (n,), where the robot stands and turns.
    """

    s: Floats
    caps: list[tuple[str, Floats]]
    a: float
    d: float
    stop: NDArray[np.bool_]

    def made(self, **more: Any) -> Feasible:
        """The answer of what is judged."""
        given: dict[str, Any] = {"a_max": self.a, "d_max": self.d, "stop": self.stop}
        return feasible_profile(self.s, self.caps, **(given | more))

    @property
    def least(self) -> Floats:
        """The least cap at each node, m/s."""
        least: Floats = np.minimum.reduce([c for _, c in self.caps])
        return least

    def broken(self, made: Feasible, v0: float) -> Violation | None:
        """What the referee says of an answer."""
        top = float(self.caps[0][1][0])
        return check_motion(
            *(self.s, made.v, made.a, made.t),
            a_max=self.a,
            d_max=self.d,
            v_max=top,
            caps=self.caps,
            v0=v0,
        )

    def told(self) -> dict[str, Any]:
        """The case in words of JSON; None for no cap."""
        caps = {name: [None if math.isinf(c) else c for c in v.tolist()] for name, v in self.caps}
        return {
            "s": self.s.tolist(),
            "caps": caps,
            "a_max": self.a,
            "d_max": self.d,
            "stop": np.flatnonzero(self.stop).tolist(),
        }


def extreme(rng: np.random.Generator, n: int | None = None) -> ProfileCase:
    """1 to 60 nodes, edges of 1e-9 to 1e6 m side by side, limits of 1e-3 to 1e3, caps far below them."""
    n = int(_SIZES[int(rng.integers(len(_SIZES)))]) if n is None else n
    low, high = sorted(rng.uniform(-9, 6, 2).tolist()) if rng.random() < 0.5 else (-9.0, 6.0)
    ds = 10.0 ** rng.uniform(low, high, n - 1)
    s = np.concatenate(([0.0], np.cumsum(ds)))
    if not (s[1:] > s[:-1]).all():  # an edge too short to be told at its distance: short ones first then
        s = np.concatenate(([0.0], np.cumsum(np.sort(ds))))
    a, d, top = (10.0 ** rng.uniform(-3, 3, 3)).tolist()
    share = (0.0, 0.3, 1.0)[int(rng.integers(3))]
    bend = np.where(rng.random(n) < share, top * 10.0 ** rng.uniform(-6, 0.5, n), np.inf)
    stop = rng.random(n) < (0.0, 0.0, 0.2)[int(rng.integers(3))]
    stop[[0, -1]] = False
    return ProfileCase(s, [("limit", np.full(n, top)), ("curvature", bend)], a, d, stop)


def halted(rng: np.random.Generator, case: ProfileCase) -> ProfileCase:
    """Stops in a row and beside the ends; caps of 0 where the robot stands anyway."""
    n, stop, bend = len(case.s), case.stop.copy(), case.caps[1][1].copy()
    if n > 2 and rng.random() < 0.2:
        k = (1, int(rng.integers(1, n - 1)), n - 2)[int(rng.integers(3))]
        stop[k : min(k + int(rng.integers(1, 4)), n - 1)] = True
    if rng.random() < 0.3:
        still = stop.copy()
        still[[0, -1]] = True
        bend[still & (rng.random(n) < 0.5)] = 0.0
    return case._replace(caps=[case.caps[0], ("curvature", bend)], stop=stop)


def middling(rng: np.random.Generator) -> ProfileCase:
    """Few nodes and middling sizes, so that caps, accelerating and braking all get their turn."""
    n = int(rng.integers(2, 9))
    s = np.concatenate(([0.0], np.cumsum(10.0 ** rng.uniform(-1, 1, n - 1))))
    a, d = (10.0 ** rng.uniform(-1, 1, 2)).tolist()
    top = math.sqrt(2 * a * float(s[-1])) * 10.0 ** float(rng.uniform(-0.7, 0.3))
    bend = np.where(rng.random(n) < 0.5, top * rng.uniform(0.05, 1.2, n), np.inf)
    stop = rng.random(n) < (0.0, 0.2)[int(rng.integers(2))]
    stop[[0, -1]] = False
    return ProfileCase(s, [("limit", np.full(n, top)), ("curvature", bend)], a, d, stop)


def shut(case: ProfileCase) -> bool:
    """Whether nothing may move at either node of an edge: then there is no profile."""
    still = (case.least == 0.0).tolist()
    return any(here and there for here, there in itertools.pairwise(still))


def greatest_start(case: ProfileCase) -> float:
    """The greatest start speed, m/s, by its closed form: the least of all bounds seen from the first node."""
    cap = np.where(case.stop, 0.0, case.least)
    cap[-1] = 0.0
    return math.sqrt(float((cap * cap + 2.0 * case.d * (case.s - case.s[0])).min()))

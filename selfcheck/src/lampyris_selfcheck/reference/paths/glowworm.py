"""Glowworm swarm optimisation in plain Python: the five published equations, one glowworm at a time."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence


def run(
    at: Sequence[Sequence[float]],
    f: Callable[[Sequence[float]], float],
    draws: Callable[[], Sequence[float]] | None,
    *,
    low: float,
    high: float,
    iterations: int,
    sensor: float,
    step: float = 0.03,
    rho: float = 0.4,
    gamma: float = 0.6,
    beta: float = 0.08,
    nt: int = 5,
    first_light: float = 5.0,
) -> tuple[list[list[float]], list[float], list[float]]:
    """Positions, luciferin and ranges after so many iterations.

    ``draws()`` gives one number in [0, 1) for each glowworm; without it the brightest neighbour leads.
    """
    x = [list(p) for p in at]
    light = [first_light] * len(x)
    reach = [sensor] * len(x)
    for _ in range(iterations):
        light = [(1.0 - rho) * old + gamma * f(p) for old, p in zip(light, x, strict=True)]
        lots = draws() if draws else None
        chosen: list[int | None] = []
        counts = []
        for i, p in enumerate(x):
            near = [j for j, q in enumerate(x) if _gap(p, q) < reach[i] and light[i] < light[j]]
            counts.append(len(near))
            if not near:
                chosen.append(None)
            elif lots is None:
                chosen.append(max(near, key=lambda j: (light[j], -j)))
            else:
                chosen.append(_spin(near, [light[j] - light[i] for j in near], lots[i]))
        moved = []
        for p, j in zip(x, chosen, strict=True):
            there = p
            if j is not None and _gap(p, x[j]) > 0:
                gap = _gap(p, x[j])
                there = [a + step * ((b - a) / gap) for a, b in zip(p, x[j], strict=True)]
                if not all(low <= v <= high for v in there):
                    there = p
            moved.append(there)
        x = moved
        reach = [min(sensor, max(0.0, r + beta * (nt - n))) for r, n in zip(reach, counts, strict=True)]
    return x, light, reach


def _spin(names: list[int], shares: list[float], u: float) -> int:
    """Roulette: equation 2.9."""
    total = 0.0
    for s in shares:
        total += s
    mark, passed = u * total, 0.0
    for name, s in zip(names, shares, strict=True):
        passed += s
        if passed > mark:
            return name
    return names[-1]


def _gap(p: Sequence[float], q: Sequence[float]) -> float:
    total = 0.0
    for a, b in zip(p, q, strict=True):
        total += (b - a) * (b - a)
    return math.sqrt(total)

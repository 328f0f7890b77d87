"""Best: who has the best number of a comparison, and whether the runs can tell them from the others."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from lampyris.study.analysis import compare
from lampyris.study.analysis.measures import ALL, WHOLE
from lampyris.study.analysis.runs import Cube, Runs
from lampyris.study.analysis.summary import per_unit
from lampyris.typing import Floats

FEWEST: Final = 6
"""With fewer units no planner is distinguished: with five, no signed-rank test comes under 0.05 whatever they say,
and a bootstrap of two differences excludes 0 each second time by chance."""


class Best(NamedTuple):
    """The best of one measure.

    Parameters
    ----------
    who : labels of those with the best mean, several where they agree in every run.
    sure : whether the interval of the paired difference to all others excludes 0, on that side.
    """

    who: tuple[str, ...]
    sure: bool


def best(runs: Runs, traffic: int = 0) -> dict[str, Best]:
    """The best of each measure that has a better side; none where all are the same, or only one has a number.

    Means are those that :func:`~lampyris.study.analysis.summary.summarise` tells of each entrant's own runs.
    Differences are taken run by run in the same world, as its pairs are: over the runs that both solved; of
    shares and collisions over all.
    """
    out = {}
    for name, measure in ALL.items():
        if not (measure.better and runs.has(name)):
            continue
        sign = -1.0 if measure.better == "more" else 1.0
        signed = sign * runs.values[name][:, traffic]
        paired = signed if name in WHOLE else sign * runs.of_solved(name)[:, traffic]
        found = _best(runs.entrants, signed, paired)
        if found is not None:
            out[name] = found
    return out


def _best(entrants: tuple[str, ...], signed: Cube, paired: Cube) -> Best | None:
    """Less is better here."""
    means = {e: compare.mean(per_unit(signed[..., e])).value for e in range(len(entrants))}
    there = [e for e in means if np.isfinite(means[e])]
    least = min((means[e] for e in there), default=0.0)
    top = [e for e in there if compare.same(means[e], least)]
    if len(there) < 2 or len(top) == len(there):
        return None
    sure = all(_less(paired[..., a], paired[..., b]) for a in top for b in there if b not in top)
    # Those of one mean share the first place only where no run tells them apart.
    agree = all(_equal(signed[..., top[0]], signed[..., e]) for e in top[1:])
    return Best(tuple(entrants[e] for e in top), sure and agree)


def _less(a: Floats, b: Floats) -> bool:
    gap = compare.mean(per_unit(compare.gaps(a, b)))
    return gap.n >= FEWEST and gap.high < 0


def _equal(a: Floats, b: Floats) -> bool:
    return bool(np.all(compare.same(a, b) | (np.isnan(a) & np.isnan(b))))

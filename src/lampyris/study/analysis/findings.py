"""Findings: the nouns of a summary, and how they are written for machines."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from lampyris.study.analysis import compare
from lampyris.study.analysis.compare import Performance, Ranking, Signed
from lampyris.study.analysis.measures import cost_of

ROUND = 10
"""Digits of numbers in the machine's form: the rest is rounding of sums."""


@dataclass(frozen=True, slots=True)
class Estimate:
    """A mean or share over units, with its interval and the runs behind it; NaN where nothing can be said."""

    value: float
    low: float
    high: float
    units: int
    runs: int


@dataclass(frozen=True, slots=True)
class EntrantFindings:
    """One planner and law in one traffic case, on all maps or on one.

    Parameters
    ----------
    place : the map; empty: all of them.
    traffic, entrant : what a table calls them.
    runs, queries : that have a result, of whatever ending.
    endings, outcomes : how many runs of each, by name.
    own : estimates over all runs of its own that have a value; ``found`` and ``arrived`` over all runs.
    common : the same over the runs of worlds in which all found a path.
    """

    place: str
    traffic: str
    entrant: str
    runs: int
    queries: int
    endings: Mapping[str, int]
    outcomes: Mapping[str, int]
    own: Mapping[str, Estimate]
    common: Mapping[str, Estimate] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class PairedDifference:
    """One measure of one entrant less that of the reference, in the same worlds.

    Parameters
    ----------
    difference : mean over units in which both have a value.
    test : Wilcoxon's signed-rank test over the same units; ``less`` and ``more`` count them.
    holm : its p, corrected for all comparisons of this measure in the study.
    each : the differences themselves, a unit each, for pictures.
    """

    measure: str
    traffic: str
    entrant: str
    reference: str
    difference: Estimate
    test: Signed
    holm: float
    each: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Order:
    """Average ranks of all entrants by one measure in one traffic case, and the sets that do not differ."""

    measure: str
    traffic: str
    ranking: Ranking
    groups: tuple[tuple[int, ...], ...]


@dataclass(frozen=True, slots=True)
class Within:
    """Performance profiles of all entrants by one measure in one traffic case; a problem is a run's world."""

    measure: str
    traffic: str
    profiles: tuple[Performance, ...]


@dataclass(frozen=True, slots=True)
class Summary:
    """What a study found.

    Parameters
    ----------
    name, kind : of the study.
    unit : ``query``, or ``seed`` in a study of one query.
    asked, known : jobs of the study, and those that have a result.
    queries, maps, seeds : how many.
    entrants, traffic_cases : what tables call them, in order.
    reference : the entrant that others are compared with.
    common : of each traffic case, the worlds (queries and seeds) in which all found a path; ``left_out`` names those
        that never did in that case, who would leave none.
    seed : of the bootstrap.
    start_exact : the entrants whose swarm starts from the exact shortest path.
    notes : a sentence for each entrant some of whose runs did otherwise than asked, such as with a wish
        weakened.
    """

    name: str
    kind: str
    unit: str
    asked: int
    known: int
    queries: int
    maps: int
    seeds: int
    entrants: tuple[str, ...]
    traffic_cases: tuple[str, ...]
    reference: str
    common: tuple[int, ...]
    left_out: tuple[tuple[str, ...], ...]
    entries: tuple[EntrantFindings, ...]
    by_map: tuple[EntrantFindings, ...]
    pairs: tuple[PairedDifference, ...]
    orders: tuple[Order, ...]
    within: tuple[Within, ...]
    seed: int = 0
    start_exact: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def of_poses(self) -> bool:
        """Whether some run is a plan of poses."""
        return any("cost_m" in e.own and e.own["cost_m"].units for e in self.entries)

    @property
    def cost(self) -> str:
        """The measure that is compared as the cost."""
        return cost_of(self.kind, self.of_poses)

    @property
    def unit_many(self) -> str:
        """The word for several units."""
        if self.unit != "query":
            return "seeds"
        return "fleets" if self.kind == "fleet" else "queries"

    def as_json(self) -> dict[str, Any]:
        """As plain data: numbers to ten digits, null where nothing can be said."""
        plain = _plain(self)
        assert isinstance(plain, dict)
        return plain | {"level": compare.LEVEL, "resamples": compare.RESAMPLES}


def _plain(value: Any) -> Any:
    """Nouns and named tuples as mappings, numbers to ten digits, None for what is not a number."""
    if isinstance(value, bool | int | str) or value is None:
        return value
    if isinstance(value, float):
        return float(f"{value:.{ROUND}g}") if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {k: _plain(v) for k, v in value.items()}
    if hasattr(value, "_asdict"):
        return _plain(value._asdict())
    if hasattr(value, "__dataclass_fields__"):
        return {k: _plain(getattr(value, k)) for k in value.__dataclass_fields__}
    return [_plain(v) for v in value]

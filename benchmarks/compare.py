"""Hold one record of the benchmarks against an older one: ratios to rivals, never seconds.

    python -m benchmarks.compare OLD.json NEW.json [--worse 1.25] [--strict]

A ratio has got worse if it fell to less than 1/1.25 of what it was and the quartiles of the two runs do not
meet. Figures without a rival are compared where their unit is not a time (bytes, expansions, calls). A slope
has got worse if it rose by more than 0.1 and by more than the errors of both fits: slopes lie around 0 and 1,
where 0.01 and 0.03 are the same and their ratio says nothing.
"""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchmarks.figures import Figure, figures_of

TIMES = ("ns", "us", "ms", "s")
SLOPE = 0.1
"""By how much slopes of the same thing differ from run to run."""


@dataclass(frozen=True, slots=True)
class Shift:
    """One figure in both records; ``factor`` above 1 is better than before, None where values are told apart
    by their difference and a rise is worse.
    """

    key: str
    before: float
    after: float
    factor: float | None
    apart: bool

    def worse(self, times: float) -> bool:
        """Whether it got worse, by so many times where it is a matter of times."""
        return self.apart and (self.after > self.before if self.factor is None else self.factor < 1 / times)

    def better(self, times: float) -> bool:
        """Whether it got better."""
        return self.apart and (self.after < self.before if self.factor is None else self.factor > times)

    def __str__(self) -> str:
        by = f"{self.after - self.before:+.2f}" if self.factor is None else f"{self.factor:.2f} times"
        return f"{self.key}: {self.before:.3g} -> {self.after:.3g} ({by})"


def shifts(old: list[dict[str, Any]], new: list[dict[str, Any]]) -> tuple[list[Shift], list[str]]:
    """What is in both records, and the keys that are in one alone."""
    before, after = _by_key(old), _by_key(new)
    both = [_shift(key, before[key], after[key]) for key in before if key in after]
    return [s for s in both if s is not None], sorted(before.keys() ^ after.keys())


def _by_key(sections: list[dict[str, Any]]) -> dict[str, Figure]:
    return {f"{s['name']}: {f.key}": f for s in sections for f in figures_of(s)}


def _shift(key: str, old: Figure, new: Figure) -> Shift | None:
    if old.ratio is not None and new.ratio is not None:
        a, b = _range(old), _range(new)
        return Shift(key, old.ratio, new.ratio, new.ratio / old.ratio, a[1] < b[0] or b[1] < a[0])
    if old.unit == "slope":
        was, now = old.ours, new.ours
        error = (was.high - was.low) / 2 + (now.high - now.low) / 2
        return Shift(key, was.middle, now.middle, None, abs(now.middle - was.middle) > max(SLOPE, error))
    if (
        old.unit.split()[0] in TIMES
        or old.unit.endswith("a second")
        or old.ratio is not None
        or new.ratio is not None
    ):
        return None
    a, b = old.ours.middle, new.ours.middle
    if a <= 0 or b <= 0:
        return Shift(key, a, b, 1.0, a != b)
    return Shift(key, a, b, b / a if old.more_is_better else a / b, a != b)


def _range(f: Figure) -> tuple[float, float]:
    """The ratio at the unhappiest and the happiest pairing of quartiles."""
    assert f.theirs is not None
    a, b = (f.ours, f.theirs) if f.more_is_better else (f.theirs, f.ours)
    return a.low / b.high, a.high / b.low


def main() -> int:
    """Print what moved; with --strict exit 1 if anything got worse."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("old", type=Path)
    parser.add_argument("new", type=Path)
    parser.add_argument("--worse", type=float, default=1.25, help="how many times as bad counts (1.25)")
    parser.add_argument("--strict", action="store_true", help="exit 1 if anything got worse")
    given = parser.parse_args()
    records = [json.loads(p.read_text(encoding="utf-8"))["sections"] for p in (given.old, given.new)]
    found, alone = shifts(*records)
    worse = [s for s in found if s.worse(given.worse)]
    better = [s for s in found if s.better(given.worse)]
    for name, several in (("WORSE", worse), ("better", better)):
        for s in sorted(several, key=lambda s: s.factor or 1.0):
            print(f"{name:7} {s}")
    same = len(found) - len(worse) - len(better)
    print(
        f"{len(found)} figures in both: {len(worse)} worse, {len(better)} better, "
        f"{same} within {given.worse:g} times (slopes: within {SLOPE:g} or the errors of their fits)"
    )
    if alone:
        print(f"{len(alone)} in one record alone: {', '.join(alone[:5])}{' ...' if len(alone) > 5 else ''}")
    return 1 if worse and given.strict else 0


if __name__ == "__main__":
    sys.exit(main())

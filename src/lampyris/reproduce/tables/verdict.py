"""Verdict: what is to be said of one printed figure, and the words for it."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

EXACT = "exact"
ROUNDED = "rounded"
GIVEN = "given"
MISPRINT = "misprint"
NOT_REPRODUCIBLE = "not reproducible"
IMPOSSIBLE = "impossible"

KINDS: Mapping[str, str] = MappingProxyType(
    {
        EXACT: "ours is the same at the printed digits, whether the table rounds or cuts them off",
        ROUNDED: "ours differs by no more than rounding of the figures it is computed from can explain",
        GIVEN: "chosen by the author (a setting, a start, a cell of a path): there is nothing to compute; "
        "what can be checked of it is",
        MISPRINT: "contradicts the rule or the figures printed beside it, which say what it should be: a "
        "slip of printing, of calculation or of the program, with the corrected value",
        NOT_REPRODUCIBLE: "cannot be computed again, and why; it was checked against what is possible",
        IMPOSSIBLE: "breaks a bound that holds whatever the lost maps looked like",
    }
)  # fmt: skip
"""The verdicts and what each means, in the order in which they are shown."""


@dataclass(frozen=True, slots=True)
class Verdict:
    """What is to be said of one printed figure.

    Parameters
    ----------
    table : which table, as the dissertation numbers it; ``text`` for what its text claims.
    where : row and column, for people.
    printed : as printed.
    ours : what it should be or what we get; empty where there is nothing.
    verdict : a key of :data:`KINDS`.
    why : one or two sentences that can be checked.
    """

    table: str
    where: str
    printed: str
    ours: str
    verdict: str
    why: str

    def __post_init__(self) -> None:
        if self.verdict not in KINDS:
            raise ValueError(f"{self.verdict!r} is not a verdict")
        if not self.why:
            raise ValueError(f"{self.table}, {self.where}: a verdict needs its reason")


def count(verdicts: Iterable[Verdict]) -> dict[str, int]:
    """How many of each kind, every kind in it, in the order of :data:`KINDS`."""
    found = Counter(v.verdict for v in verdicts)
    return {kind: found[kind] for kind in KINDS}


def digits(printed: str) -> int:
    """Digits after the point."""
    return len(printed.partition(".")[2])


def same(printed: str, ours: float) -> bool:
    """Whether ``ours`` is ``printed`` when rounded, or cut off, to as many digits."""
    scale = 10 ** digits(printed)
    value = round(float(printed) * scale)
    exact = ours * scale
    return value in (math.floor(exact + 1e-6), math.floor(exact + 0.5 + 1e-6))


def short(value: float, most: int = 4) -> str:
    """A number with no more digits than it needs, ``most`` after the point at most."""
    text = f"{value:.{most}f}"
    return (text.rstrip("0").rstrip(".") if "." in text else text) or "0"

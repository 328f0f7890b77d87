"""Row: what came of one job, as it is stored, sent and counted."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Final, Literal, TypeAlias, get_args

Ending: TypeAlias = Literal["done", "refused", "timeout", "failed"]
"""``done``: there is a result, of whatever outcome (no path is a result). ``refused``: the question was wrong
for this planner (a typed error). ``timeout``: the budget in seconds was used up. ``failed``: a fault of ours
or of a third-party planner. All stay in every denominator."""

ENDINGS: Final[tuple[Ending, ...]] = get_args(Ending)


@dataclass(frozen=True, slots=True)
class Row:
    """One result.

    Parameters
    ----------
    key : of its job.
    ending : see :data:`Ending`.
    metrics : numbers, words and None by name; reproducible. Nothing that is not finite.
    timing : seconds and bytes by name, and ``cost_by_s``, words; left out of every comparison of bytes.
    error : code and words of what went wrong; empty where nothing did.
    """

    key: str
    ending: Ending
    metrics: Mapping[str, Any] = field(default_factory=dict)
    timing: Mapping[str, Any] = field(default_factory=dict)
    error: str = ""

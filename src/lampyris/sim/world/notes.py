"""Notes of a planner over a whole run: the worst about each setting."""

from __future__ import annotations

import re
from collections.abc import Iterable

_FIGURE = re.compile(r"[0-9]+(?:\.[0-9]+)?")
_WEAKENED = " was weakened to "


class Notes:
    """Sentences that plans carried (:attr:`lampyris.Plan.notes`), in order of their first appearance.

    A run asks for many plans. Of sentences about one weakened setting (``min_clearance 3 was weakened to 2 cells:
    ...``) the one with the least value is kept; of others that differ in their figures alone, the latest.
    """

    def __init__(self) -> None:
        self._kept: dict[str, str] = {}

    def add(self, notes: Iterable[str]) -> None:
        """Take in the notes of a plan."""
        for note in notes:
            setting, weakened, _ = note.partition(_WEAKENED)
            key = setting if weakened else _FIGURE.sub("#", note)
            before = self._kept.get(key)
            if not weakened or before is None or _value(note) <= _value(before):
                self._kept[key] = note

    def all(self) -> tuple[str, ...]:
        """What is kept."""
        return tuple(self._kept.values())


def _value(note: str) -> float:
    """What a setting was weakened to."""
    found = _FIGURE.match(note.partition(_WEAKENED)[2])
    return float(found[0]) if found is not None else 0.0

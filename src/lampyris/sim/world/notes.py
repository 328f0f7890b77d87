"""Notes of a planner over a whole run: the latest about each setting."""

from __future__ import annotations

import re
from collections.abc import Iterable

_FIGURE = re.compile(r"[0-9]+")


class Notes:
    """Sentences that plans carried (:attr:`lampyris.Plan.notes`), in order of their first appearance.

    A run asks for many plans. Of sentences about one setting (``keep_away 3 was weakened to 2 cells: ...``),
    and of others that differ in their figures alone, the latest is kept.
    """

    def __init__(self) -> None:
        self._latest: dict[str, str] = {}

    def add(self, notes: Iterable[str]) -> None:
        """Take in the notes of a plan."""
        for note in notes:
            setting, weakened, _ = note.partition(" was weakened to ")
            self._latest[setting if weakened else _FIGURE.sub("#", note)] = note

    def all(self) -> tuple[str, ...]:
        """What is kept."""
        return tuple(self._latest.values())

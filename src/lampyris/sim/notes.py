"""Notes of a planner over a whole run: the latest of each kind."""

from __future__ import annotations

import re
from collections.abc import Iterable

_FIGURE = re.compile(r"[0-9][0-9.]*")


class Notes:
    """Sentences that plans carried (:attr:`lampyris.Plan.notes`), in order of their first appearance.

    Sentences that differ in their figures alone say the same of another moment: the latest is kept.
    """

    def __init__(self) -> None:
        self._latest: dict[str, str] = {}

    def add(self, notes: Iterable[str]) -> None:
        """Take in the notes of a plan."""
        for note in notes:
            self._latest[_FIGURE.sub("#", note)] = note

    def all(self) -> tuple[str, ...]:
        """What is kept."""
        return tuple(self._latest.values())

"""Copies of sessions: each goes its own way from where the original was."""

from __future__ import annotations

from copy import deepcopy
from typing import Self


class Copied:
    """A session of which every copy is whole.

    ``copy.copy``, ``copy.deepcopy`` and pickling all give a session that answers as the original would, and
    shares nothing with it: a copy that shared the map or the generator of random numbers would plan on what
    the other one is told.
    """

    def __copy__(self) -> Self:
        return deepcopy(self)

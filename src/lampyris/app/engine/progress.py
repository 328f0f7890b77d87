"""Telling: what is said while a question is worked on, beside its answer: how far it is, what it waits for.

Who works deep inside a drawing or a search has no frame to hand out; so the code that answers the question lends an
ear here, and nobody has to pass one down. Without an ear nothing is said and nothing is made.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from time import perf_counter
from typing import Any, Final

from lampyris.app.engine.frames import json_frame

SELDOM: Final = 0.1
"""Seconds between two sayings of how far the same thing is."""

_ears: list[Callable[[bytes], None]] = []


@contextmanager
def heard(ear: Callable[[bytes], None]) -> Iterator[None]:
    """Pass progress reports to ``ear`` meanwhile, as frames ``P``."""
    _ears.append(ear)
    try:
        yield
    finally:
        _ears.remove(ear)


def tell(what: str, **more: Any) -> None:
    """Say something."""
    if _ears:
        _ears[-1](json_frame("P", {"what": what, **more}))


class Share:
    """How much of something is done, reported now and then.

    Parameters
    ----------
    what : is done: a word that the page knows.
    of : how much there is; None: unknown.
    """

    def __init__(self, what: str, of: int | None = None) -> None:
        self._what, self._of, self._last = what, of, perf_counter()
        tell(what, done=0, of=of)

    def __call__(self, done: int) -> None:
        """So much is done."""
        now = perf_counter()
        if now - self._last >= SELDOM or done == self._of:
            self._last = now
            tell(self._what, done=done, of=self._of)

"""Forget: take runs out of a store, so that the study runs them again."""

from __future__ import annotations

import os
from collections.abc import Collection, Iterator

from lampyris.errors import UsageError
from lampyris.study.design.row import ENDINGS
from lampyris.study.design.study import canonical
from lampyris.study.store.file import real, speaking
from lampyris.study.store.lock import held
from lampyris.study.store.new_store import write_new
from lampyris.study.store.store import Store


def forget(path: str | os.PathLike[str], endings: Collection[str]) -> int:
    """Take out every run that ended so; returns how many.

    The store is written anew beside the old one and then given its name: whenever it is killed, all runs are
    there, or all but these.

    Parameters
    ----------
    path : of a store that nobody else writes to.
    endings : such as ``failed`` and ``timeout``: a worker that died, a machine that was busy.

    Raises
    ------
    UsageError : ENDING: no such ending.
    FileError : as :meth:`lampyris.study.store.store.Store.open`.
    """
    for word in endings:
        if word not in ENDINGS:
            raise UsageError("ENDING", f"{word!r}", where="endings", allowed=", ".join(ENDINGS))
    place = real(path)
    with Store.open(place) as store:  # What is in its log goes into the main file.
        count = len(store)
    with held(place) as hold, Store.open(place, writable=False) as store:
        study, maps = canonical(store.plain()).decode("ascii"), store.maps()
        kept: Iterator[tuple[str, ...]] = (
            texts for ending, texts in store.records() if ending not in endings
        )
        with speaking(place, "write", count):
            tally = write_new(place, study, maps, kept)
            hold.start(tally)
            hold.release(remove=True)
    return count - tally.count

"""Timing by turns: everybody once a round, so that a busy neighbour on the machine hurts all alike."""

from __future__ import annotations

import gc
import time
from collections.abc import Callable, Mapping
from typing import Any

from benchmarks.figures import Spread

Call = Callable[[], Any]


def take_turns(
    calls: Mapping[str, Call],
    *,
    rounds: int,
    per: float = 1.0,
    clock: Callable[[], int] = time.thread_time_ns,
    often: int = 1,
    before: Mapping[str, Call] | None = None,
    warm: bool = True,
) -> dict[str, Spread]:
    """Nanoseconds of each call, divided by ``per``.

    Parameters
    ----------
    calls : name and call; everything but the call itself is prepared before. Each is made once untimed.
    rounds : everybody is timed ``often`` times in each.
    per : what to divide by: cells, queries, 1e6 for milliseconds.
    clock : this thread's processor time; ``time.perf_counter_ns`` where threads or processes help.
    often : times in a row, the same for everybody: who is called again and again finds its caches filled.
    before : what is done, untimed, before each call of that name.
    warm : whether the untimed call is needed; not where everybody has just been called.
    """
    times: dict[str, list[float]] = {name: [] for name in calls}
    ready = before or {}
    for name, call in calls.items() if warm else ():
        ready.get(name, _nothing)()
        call()
    was = gc.isenabled()
    gc.collect()
    gc.freeze()  # what is there now, a million nodes of somebody's graph, need not be looked at each round
    gc.disable()
    try:
        for _ in range(rounds):
            for name, call in calls.items():
                for _ in range(often):
                    ready.get(name, _nothing)()
                    began = clock()
                    call()
                    times[name].append((clock() - began) / per)
            gc.collect()
    finally:
        gc.unfreeze()
        if was:
            gc.enable()
    return {name: Spread.of(values) for name, values in times.items()}


def _nothing() -> None:
    pass

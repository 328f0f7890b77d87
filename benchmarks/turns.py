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
    often: Mapping[str, int] | None = None,
) -> dict[str, Spread]:
    """Nanoseconds of each call, divided by ``per``.

    Parameters
    ----------
    calls : name and call; everything but the call itself is prepared before. Each is made once untimed.
    rounds : everybody is timed once in each, or ``often[name]`` times, of which the middle counts.
    per : what to divide by: cells, queries, 1e6 for milliseconds.
    clock : this thread's processor time; ``time.perf_counter_ns`` where threads or processes help.
    """
    times: dict[str, list[float]] = {name: [] for name in calls}
    for call in calls.values():
        call()
    was = gc.isenabled()
    gc.disable()
    try:
        for _ in range(rounds):
            for name, call in calls.items():
                for _ in range((often or {}).get(name, 1)):
                    began = clock()
                    call()
                    times[name].append((clock() - began) / per)
            gc.collect()
    finally:
        if was:
            gc.enable()
    return {name: Spread.of(values) for name, values in times.items()}

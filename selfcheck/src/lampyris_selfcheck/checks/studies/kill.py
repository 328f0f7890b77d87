"""Check: a study that is killed loses nothing that it acknowledged, and ends with the same bytes.

A warm process is killed at drawn moments (``random``); so is the command as it is used, with workers, which are
killed too (``study``).
"""

from __future__ import annotations

import signal

from lampyris_selfcheck.check import Ask, Check, Kind, Outcome, Part, Tally
from lampyris_selfcheck.checks.studies.kill_study import hunted
from lampyris_selfcheck.checks.studies.sittings import Bench, bench

KINDS = {
    "random": Kind(
        "a warm process is killed up to four times at drawn moments: no acknowledged row lost, changed or "
        "stored twice; at the end the table has the bytes of an undisturbed one",
        8, 1200, 10_000, 20,
    ),
    "study": Kind(
        "`lampyris study` with two workers, it and they killed three times at drawn moments; no process is "
        "left over",
        1, 60, 334, 1,
    ),
}  # fmt: skip


def _run(ask: Ask, part: Part) -> Outcome:
    tally = Tally(part)
    if part.kind == "study":
        for number in part.numbers:
            hunted(tally, number, int(ask.rng("kill", part.kind, number).integers(2**31)))
        return tally.outcome()
    with bench() as one:
        for number in part.numbers:
            one.fresh()
            try:
                wrong = _random(ask, one, tally, number)
            except Exception as fault:
                wrong = f"{type(fault).__name__}: {fault!s:.300}"
            if wrong:
                tally.fail(number, wrong)
    return tally.outcome()


def _random(ask: Ask, one: Bench, tally: Tally, number: int) -> str:
    """Killed up to four times."""
    rng = ask.rng("kill", "random", number)
    kills, wrong = 0, ""
    for _ in range(int(rng.integers(1, 5))):
        ended = one.sit(kill_after=float(rng.random()) * one.whole.seconds)
        if ended.code == 0:
            break
        if ended.code != -signal.SIGKILL or ended.late:
            return f"it ended with {ended.code}: {ended.errors[-300:]}"
        kills += 1
        if wrong := one.kept():
            return f"after {kills} kills: {wrong}"
    tally.case(f"killed {kills} times")
    tally.count("kills", kills)
    return one.gone_on_with()


CHECK = Check(
    "kill",
    ("G16",),
    "a study killed at any time loses no acknowledged result and ends with the same bytes",
    KINDS,
    _run,
)

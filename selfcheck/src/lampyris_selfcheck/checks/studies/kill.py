"""Check: a study that is killed loses nothing that it acknowledged, and ends with the same bytes.

Sittings are killed at a drawn moment (``random``), before and after each call that changes a file, SQLite's
own among them (``points``), and as the command is used, with workers, which are killed too (``study``).
"""

from __future__ import annotations

import signal
from math import gcd

from lampyris_selfcheck.check import Ask, Check, Kind, Outcome, Part, Tally
from lampyris_selfcheck.checks.studies.kill_study import hunted
from lampyris_selfcheck.checks.studies.sittings import Bench, bench

KINDS = {
    "random": Kind(
        "a warm process is killed up to four times at drawn moments: no acknowledged row lost, changed or "
        "stored twice; at the end the table has the bytes of an undisturbed one",
        4, 400, 3000, 20,
    ),
    "points": Kind(
        "the same, killed before and after every call that creates, writes, syncs, renames or removes; once "
        "all were asked, again at another when it goes on",
        8, 1200, 10_000, 40,
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
                wrong = (_random if part.kind == "random" else _point)(ask, one, tally, number)
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


def _point(ask: Ask, one: Bench, tally: Tally, number: int) -> str:
    """Killed before or after one call, and from the second lap on once more; the first are from all over."""
    points = 2 * one.changes
    step = next(k for k in range(int(0.618 * points), points) if gcd(k, points) == 1)
    lap, place = divmod(number, points)
    point, after = divmod(place * step % points, 2)
    ended = one.sit(plan={"kill": point, "after": bool(after)})
    if ended.code != -signal.SIGKILL or ended.late:
        return f"change {point} was not reached: {ended.code}, {ended.errors[-200:]}"
    where, wrong = f"{'after' if after else 'before'} change {point}", one.kept()
    if lap and not wrong:
        again = int(ask.rng("kill", "points", number).integers(one.changes))
        ended = one.sit(plan={"kill": again, "after": False})
        where += f" and before change {again}"
        wrong = one.kept() if ended.code in (0, -signal.SIGKILL) else f"it ended with {ended.code}"
        tally.count("kills", ended.code != 0)
    tally.case("after" if after else "before")
    tally.count("kills")
    wrong = wrong or one.gone_on_with()
    return f"{where}: {wrong}" if wrong else ""


CHECK = Check(
    "kill",
    ("G16",),
    "a study killed at any time loses no acknowledged result and ends with the same bytes",
    KINDS,
    _run,
)

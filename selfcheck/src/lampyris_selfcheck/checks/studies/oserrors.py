"""Check: a full disk, a broken one, lost power, a clock set back: a clear line, and the study can go on.

What the system refuses is tried at every call of a small study in turn, SQLite's calls among them
(:mod:`lampyris_selfcheck.checks.studies.os_calls`): once, or from then on. Lost power is a replay of what was written, in
which whatever was not synced may be missing (:mod:`lampyris_selfcheck.checks.studies.power`).
"""

from __future__ import annotations

import errno
import re
import signal
from math import gcd

from lampyris_selfcheck.check import Ask, Check, Kind, Outcome, Part, Tally
from lampyris_selfcheck.checks.studies.power import Disk, changes_of
from lampyris_selfcheck.checks.studies.sittings import Bench, SittingEnding, bench

ERRORS = ("ENOSPC", "EIO", "EDQUOT", "EROFS", "EMFILE", "EACCES")
FAULTS = [(name, stays) for name in ERRORS for stays in (False, True)]
"""What the system says, and whether it goes on saying it."""
CODES = frozenset(("STORE_WRITE", "STORE_READ", "STORE_DAMAGED", "FILE_WRITE", "FILE_READ", "FILE_MISSING"))
"""What a study that stops for it may say."""
_LINE = re.compile(r"^error\[([A-Z_]+)\]: \S.*$", re.MULTILINE)
CLOCKS = ("back", "stands")

KINDS = {
    "faults": Kind(
        "6 errors, once or from then on, at each call: the study goes on, or stops with a clear line; "
        "what was acknowledged is there, and going on ends with the bytes of an undisturbed run",
        12, 1200, 12_000, 24,
    ),
    "power": Kind(
        "the power fails at a drawn moment, and of what was not synced any part is missing: as above, and "
        "the store needs no repair",
        8, 1200, 20_000, 40,
    ),
    "clock": Kind(
        "the clock is set back or stands still, and the study is killed at a drawn call", 2, 100, 500, 10
    ),
}  # fmt: skip


def _run(ask: Ask, part: Part) -> Outcome:
    tally = Tally(part)
    case = {"faults": _fault, "power": _power, "clock": _clock}[part.kind]
    with bench() as one:
        for number in part.numbers:
            one.fresh()
            try:
                wrong = case(ask, one, tally, number)
            except Exception as fault:
                wrong = f"{type(fault).__name__}: {fault!s:.300}"
            if wrong:
                tally.fail(number, wrong)
    return tally.outcome()


def _fault(ask: Ask, one: Bench, tally: Tally, number: int) -> str:
    """One call fails; the first cases are calls from all over, each with another error."""
    lap, place = divmod(number, one.calls)
    step = next(k for k in range(int(0.618 * one.calls), one.calls) if gcd(k, one.calls) == 1)
    call = place * step % one.calls
    name, stays = FAULTS[(number + lap) % len(FAULTS)]
    ended = one.sit(plan={"fail": call, "errno": getattr(errno, name), "stays": stays})
    wrong = _spoken(ended) or one.kept()
    if not wrong and ended.code == 0 and (one.place / "s.csv").read_bytes() != one.csv:
        wrong = "it went on to its end, and its table is another"
    said = _LINE.search(ended.errors)
    tally.case(name, "stays" if stays else "once", said[1] if said and ended.code else "went on")
    wrong = wrong or one.gone_on_with()
    return f"{name}{' from' if stays else ' at'} call {call}: {wrong}" if wrong else ""


def _spoken(ended: SittingEnding) -> str:
    """What is wrong with how it stopped, or did not."""
    if ended.late:
        return "it hung"
    if "Traceback" in ended.errors or "Exception ignored" in ended.errors:
        return f"a traceback: {ended.errors[-500:]}"
    if ended.code == 0:
        return ""
    said = _LINE.search(ended.errors)
    if ended.code != 3 or said is None or said[1] not in CODES:
        return f"it ended with {ended.code}: {ended.errors[-300:]}"
    return ""


def _power(ask: Ask, one: Bench, tally: Tally, number: int) -> str:
    """Lost power: what was written before is replayed on a disk that keeps what it must."""
    record = one.at / "record"
    if not record.exists():
        one.sit(plan={"record": str(record)})
        (one.at / "whole.log").write_bytes(one.log.read_bytes())
    rng = ask.rng("oserrors", "power", number)
    changes = changes_of(record)
    moment = int(rng.integers(len(changes) + 1))
    if rng.integers(2):  # Half of them soon after a name was given, changed or taken.
        names = [k for k, one_ in enumerate(changes) if one_.op in ("create", "rename", "unlink", "truncate")]
        moment = min(names[int(rng.integers(len(names)))] + int(rng.integers(1, 4)), len(changes))
    disk = Disk(rng)
    for change in changes[:moment]:
        disk.do(change)
    one.fresh()
    acknowledged = (one.at / "whole.log").read_bytes()
    if moment < len(changes):
        acknowledged = acknowledged[: changes[moment].acknowledged]
    one.log.write_bytes(acknowledged)
    there = disk.after_power_failed()
    for path, data in there.items():
        with open(path, "wb") as file:
            file.write(data)
    store = str(one.place / "s.db")
    tally.case("with a log" if f"{store}-wal" in there else "no log", "store" if store in there else "none")
    wrong = one.kept() or one.gone_on_with()
    left = ", ".join(f"{path.rpartition('/')[2]} ({len(data)})" for path, data in there.items())
    return f"power lost before change {moment}, left {left}: {wrong}" if wrong else ""


def _clock(ask: Ask, one: Bench, tally: Tally, number: int) -> str:
    """A clock that is wrong, in a sitting that is killed and in one that is not."""
    how = CLOCKS[number % len(CLOCKS)]
    point = int(ask.rng("oserrors", "clock", number).integers(one.changes))
    ended = one.sit(clock=how, plan={"kill": point})
    tally.case(how, "killed" if ended.code else "not killed")
    if ended.code not in (0, -signal.SIGKILL) or ended.late:
        return f"clock {how}: it ended with {ended.code}: {ended.errors[-300:]}"
    wrong = one.kept()
    if not wrong:
        ended = one.sit(clock=how)
        wrong = f"it ended with {ended.code}: {ended.errors[-300:]}" if ended.code else one.gone_on_with()
    return f"clock {how}, killed before change {point}: {wrong}" if wrong else ""


CHECK = Check(
    "oserrors",
    ("G18",),
    "a full disk, a broken one, lost power, a clock set back: a clear line, and the study can go on",
    KINDS,
    _run,
)

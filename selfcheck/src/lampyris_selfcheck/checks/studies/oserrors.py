"""Check: a full disk, a clock set back: a clear line, and the study can be resumed.

Full is a disk on which no file may grow beyond a drawn size (``RLIMIT_FSIZE``): the store cannot be made, a
transaction cannot be written, the log cannot be moved into the main file, or the table cannot be written.
"""

from __future__ import annotations

import re
import signal
from functools import partial

from lampyris_selfcheck.check import Ask, Check, Kind, Outcome, Part
from lampyris_selfcheck.checks.studies.sittings import STORE, Bench, judged

CODES = frozenset(("STORE_WRITE", "FILE_WRITE"))
"""What a study that stops for it may report."""
_LINE = re.compile(r"^error\[([A-Z_]+)\]: \S.*$", re.MULTILINE)
CLOCKS = ("back", "stands")
LEAST, MOST = 4096, 300_000
"""Bytes that a file may have: the list of what was acknowledged needs less; the store's log has about 250 kB."""

KINDS = {
    "full": Kind(
        "no file may grow beyond a drawn size: the study stops with a clear line or does not need more; what "
        "was acknowledged is there, and resuming it ends with the bytes of an undisturbed run",
        12, 1200, 12_000, 20,
    ),
    "clock": Kind(
        "the clock is set back or stands still, and the study is killed at a drawn moment", 2, 100, 500, 10
    ),
}  # fmt: skip


def _run(ask: Ask, part: Part) -> Outcome:
    return judged(part, partial({"full": _full, "clock": _clock}[part.kind], ask))


def _full(ask: Ask, one: Bench, number: int) -> tuple[list[str], str]:
    """A disk with little room, in one sitting; then one with enough."""
    room = int(ask.rng("oserrors", "full", number).integers(LEAST, MOST))
    ended = one.sit(room=room)
    code = _LINE.search(ended.errors)
    made = "store" if (one.place / STORE).exists() else "no store"
    properties = [code[1] if code and ended.code else "needed no more", made]
    wrong = ""
    if ended.late:
        wrong = "it hung"
    elif "Traceback" in ended.errors or "Exception ignored" in ended.errors:
        wrong = f"a traceback: {ended.errors[-500:]}"
    elif ended.code and (ended.code != 3 or code is None or code[1] not in CODES):
        wrong = f"it ended with {ended.code}: {ended.errors[-300:]}"
    wrong = wrong or one.kept() or one.finish()
    return properties, f"no file larger than {room} bytes: {wrong}" if wrong else ""


def _clock(ask: Ask, one: Bench, number: int) -> tuple[list[str], str]:
    """A clock that is wrong, in a sitting that is killed and in one that is not."""
    how = CLOCKS[number % len(CLOCKS)]
    after = float(ask.rng("oserrors", "clock", number).random()) * one.whole.seconds
    ended = one.sit(clock=how, kill_after=after)
    properties = [how, "killed" if ended.code else "not killed"]
    if ended.code not in (0, -signal.SIGKILL) or ended.late:
        return properties, f"clock {how}: it ended with {ended.code}: {ended.errors[-300:]}"
    wrong = one.kept()
    if not wrong:
        ended = one.sit(clock=how)
        wrong = f"it ended with {ended.code}: {ended.errors[-300:]}" if ended.code else one.finish()
    return properties, f"clock {how}, killed after {after:.3f} s: {wrong}" if wrong else ""


CHECK = Check(
    "oserrors",
    ("G18",),
    "a full disk, a clock set back: a clear line, and the study can be resumed",
    KINDS,
    _run,
)

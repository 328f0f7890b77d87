"""A process in which ``lampyris`` works on a study: it can be killed, its disk be full, its clock be wrong.

``python -m lampyris_selfcheck.checks.studies.sitting_child`` waits warm: all is imported and compiled, and each line
it reads is a sitting, done in a fork of it. So a sitting takes hundredths of a second and not two seconds.

What was acknowledged is known outside of the product: when ``Store.add`` has returned, keys and contents are
written to a log, and synced.
"""

from __future__ import annotations

import hashlib
import json
import os
import signal
import sys
import time
import traceback
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from lampyris._core.system import limit_file_size

STEP = 0.06
"""Seconds between two looks at the clock of a sitting: rows are stored after every other batch."""
BACK_AFTER = 20
"""Looks at the clock, of some four hundred, after which it is set back."""


def digest(row: Any) -> str:
    """Of what a row says, timing aside."""
    from lampyris.study.design.study import canonical

    return hashlib.sha256(canonical([row.key, row.ending, row.metrics, row.error])).hexdigest()


def log_acknowledged(log: str) -> None:
    """From now on what a store acknowledges is in the log before the product knows."""
    from lampyris.study.store.store import Store

    add, write, sync = Store.add, os.write, os.fsync
    out = os.open(log, os.O_WRONLY | os.O_APPEND | os.O_CREAT, 0o644)

    def add_and_log(self: Store, rows: Sequence[Any]) -> int:
        fresh = add(self, rows)
        # Each block begins with an end of line: the last of the block before may have been torn off.
        lines = "".join(f"{row.key} {digest(row)} .\n" for row in rows)
        write(out, f"\n{lines}".encode("ascii"))
        sync(out)
        return fresh

    Store.add = add_and_log  # type: ignore[method-assign]


def sitting(given: dict[str, Any]) -> int:
    """One sitting; its exit code.

    Parameters
    ----------
    given : ``argv`` of the command; ``folder`` it is called in; ``log`` of what is acknowledged; ``room``:
        bytes that no file may exceed; ``clock``: ``steps``, ``back`` or ``stands``.
    """
    from lampyris import cli
    from lampyris.study.execution import batches

    os.chdir(given["folder"])
    log_acknowledged(given["log"])
    batches.MAX_JOBS = 2  # many small batches: many moments between them
    time.perf_counter, time.time = clocks(given.get("clock", "steps"), time.time)
    sys.argv = ["lampyris", *given["argv"]]
    if "room" in given:
        limit_file_size(given["room"])
    try:
        cli.main()
    except SystemExit as done:
        return done.code if isinstance(done.code, int) else int(done.code is not None)
    return 0


def clocks(how: str, now: Callable[[], float]) -> tuple[Callable[[], float], Callable[[], float]]:
    """The clock that work is measured by, and that of the day: ``steps``, ``back`` or ``stands``.

    Both are set back at one moment of the run, not before it: a clock that was always wrong never goes back.
    """
    looks, began = 0, now()

    def measured() -> float:
        nonlocal looks
        looks += 1
        if how == "stands":
            return 1000.0
        return 1000.0 + STEP * (looks - 1) - (3600.0 if how == "back" and looks > BACK_AFTER else 0.0)

    def of_the_day() -> float:
        if how == "stands":
            return began
        return now() - (86_400.0 if how == "back" and looks > BACK_AFTER else 0.0)

    return measured, of_the_day


def _fork(given: dict[str, Any]) -> dict[str, Any]:
    """A sitting in a fork of this process; how it ended."""
    began = time.monotonic()
    pid = os.fork()
    if pid == 0:
        code = 99
        try:
            for fd, name in ((1, "out"), (2, "err")):
                os.dup2(os.open(given[name], os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o644), fd)
            code = sitting(given)
        except BaseException:
            traceback.print_exc()
        finally:
            for stream in (sys.stdout, sys.stderr):
                stream.flush()
            os._exit(code)
    stop = min(given["seconds"], given.get("kill_after", given["seconds"]))
    done, status = os.waitpid(pid, os.WNOHANG)
    while not done:
        if time.monotonic() - began > stop:
            os.kill(pid, signal.SIGKILL)
            done, status = os.waitpid(pid, 0)
        else:
            time.sleep(0.0005)
            done, status = os.waitpid(pid, os.WNOHANG)
    spent = time.monotonic() - began
    return {
        "code": os.waitstatus_to_exitcode(status),
        "seconds": spent,
        "late": spent > given["seconds"],
    }


def _warm(file: str, csv: str) -> None:
    """Run the study here, without a store: all that it needs is loaded."""
    from typer.main import get_command

    from lampyris.cli import app
    from lampyris.cli.verbs.study import files, running, tables  # noqa: F401
    from lampyris.study.analysis.export import write_csv
    from lampyris.study.analysis.table import table_of
    from lampyris.study.design.study_file import load_study
    from lampyris.study.execution.run import run

    study = load_study(file)
    rows: list[Any] = []
    run(study, rows.extend)
    table = table_of(study, rows)
    files.summary_of(study, table)
    write_csv(Path(csv), table)
    app.app = get_command(app.app)  # type: ignore[assignment]  # what typer builds at every call is built


if __name__ == "__main__":
    _warm(*json.loads(sys.stdin.readline()))
    print("warm", flush=True)
    for line in sys.stdin:
        print(json.dumps(_fork(json.loads(line))), flush=True)

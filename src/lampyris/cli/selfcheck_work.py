"""What ``lampyris selfcheck`` does."""

from __future__ import annotations

import datetime
import re
import shlex
import sys
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import lampyris
from lampyris.cli import outputs, verbs
from lampyris.errors import FileError, InternalFault, UsageError
from lampyris.selfcheck import registry
from lampyris.selfcheck.check import SIZES, Ask, Check, Failure, Outcome
from lampyris.selfcheck.ledger import Ledger, append, fingerprint, versions
from lampyris.selfcheck.plain import plain, text
from lampyris.selfcheck.runner import Range, Result, Told, planned, run, spread

BROKEN = InternalFault.exit_code
TENTHS = 10
SHOWN = 3
"""Failing cases of a check that are printed whole; `--failures` keeps more."""


@dataclass(frozen=True)
class Asked:
    """What the command line said."""

    names: tuple[str, ...]
    ask: Ask
    which: Range
    ledger: Path | None = None
    failures: Path | None = None
    record: Path | None = None
    json: bool = False


def processes(workers: int | None) -> int:
    """As many as asked, or one a core."""
    from lampyris._core.processors import processors

    return workers if workers is not None else processors()


def selfcheck(asked: Asked) -> int:
    """``lampyris selfcheck``. Returns the exit code: 0 only if every check held."""
    checks = _checks(asked)
    # Before the first of them runs for an hour: whether all of them can do what they are asked.
    checks = [check for check in checks if _can_run(check, asked)]
    _demand_places(asked)
    ledger = Ledger(asked.ledger)
    results = []
    for check in checks:
        with _progress(check.name, quiet=asked.json) as tell:
            result = run(check, _ask(check, asked), asked.which, ledger, tell)
        results.append(result)
        _tell(result, asked)
    broken = [result.check.name for result in results if not result.holds]
    if broken and not asked.json:
        print(f"broken: {', '.join(broken)}")
    return BROKEN if broken else 0


def _tell(result: Result, asked: Asked) -> None:
    """Print what came of a check, and keep it where that was asked."""
    record = _record(result, asked.which)
    if asked.json:
        verbs.print_json(plain(record))
    else:
        _print(result, record)
    if asked.record is not None:
        append(asked.record, record)
    if asked.failures is not None:
        for failure in result.outcome.failures:
            _keep(asked.failures, result, failure)


def list_checks(asked: Asked) -> int:
    """``lampyris selfcheck --list``. Returns the exit code."""
    for check in _checks(asked):
        kinds = check.kinds_for(_ask(check, asked))
        if asked.json:
            verbs.print_json(
                {
                    "check": check.name,
                    "goals": list(check.goals),
                    "title": check.title,
                    "kinds": {
                        name: {"what": kind.what} | {size: kind.cases(size) for size in SIZES}
                        for name, kind in kinds.items()
                    },
                }
            )
            continue
        print(f"{check.name}  ({', '.join(check.goals)})  {check.title}")
        for name, kind in kinds.items():
            sizes = ", ".join(f"{size} {kind.cases(size):,}" for size in SIZES)
            print(f"    {name}: {kind.what}\n        {sizes}")
    return 0


def _checks(asked: Asked) -> list[Check]:
    if asked.ask.size not in SIZES:
        raise UsageError("SIZE", f"no size is called {asked.ask.size!r}", allowed=", ".join(SIZES))
    if len(asked.names) != 1 and asked.which.only is not None:
        raise UsageError("KIND", "--only goes with one check", todo="name the check whose kind it is")
    checks = [registry.check(name) for name in asked.names or registry.NAMES]
    if asked.ask.folder is not None and not any(check.folder for check in checks):
        taken = ", ".join(name for name in registry.NAMES if registry.check(name).folder)
        raise UsageError("FOLDER", "none of these checks reads a folder", where="--folder", allowed=taken)
    return checks


def _ask(check: Check, asked: Asked) -> Ask:
    """What one of the checks is asked: a folder only if it reads one."""
    return asked.ask if check.folder else replace(asked.ask, folder=None)


def _can_run(check: Check, asked: Asked) -> bool:
    try:
        planned(check, _ask(check, asked), asked.which)
    except UsageError as error:
        if asked.names or error.code != "CHECKOUT":
            raise
        # Asked for everything, where the project's own tests are not installed: told, and no failure.
        print(f"note: {check.name} was left out: {error.what}", file=sys.stderr)
        return False
    return True


def _record(result: Result, which: Range) -> dict[str, Any]:
    outcome = result.outcome
    return {
        "check": result.check.name,
        "goals": list(result.check.goals),
        "holds": result.holds,
        "size": result.ask.size if which == Range(which.only) else "part",
        "only": which.only,
        "seed": result.ask.seed,
        "kinds": {name: _of_kind(result, name) for name in result.of_kind},
        "cases": outcome.cases,
        "failures": outcome.failed,
        "unfinished": outcome.unfinished,
        "bound": result.bound,
        "lacks": list(result.lacks),
        "counts": dict(outcome.counts),
        "spreads": {name: spread(values) for name, values in outcome.spreads.items()},
        "failed": [
            {"kind": f.kind, "command": _command(result, f), "what": f.what, "data": f.data}
            for f in outcome.failures
        ],
        "seconds": round(result.seconds, 1),
        "wall": round(result.wall, 1),
        "workers": result.ask.workers,
        "date": datetime.datetime.now(datetime.UTC).date().isoformat(),
        "version": lampyris.__version__,
        "code": fingerprint(),
        "versions": versions(),
    }


def _of_kind(result: Result, name: str) -> dict[str, Any]:
    seen, kind = result.of_kind[name], result.planned.kinds[name]
    first, cases = result.planned.ranges[name]
    return {
        "first": first,
        "cases": cases,
        "failures": seen.outcome.failed,
        "drawn": kind.whole is None,
        "seconds": round(seen.seconds, 1),
        "counts": dict(seen.outcome.counts),
        "spreads": {word: spread(values) for word, values in seen.outcome.spreads.items()},
    }


def _print(result: Result, record: dict[str, Any]) -> None:
    outcome = result.outcome
    bound = f" bound={result.bound:.1e}" if result.bound is not None else ""
    print(
        f"{result.check.name}: cases={outcome.cases} failures={outcome.failed} "
        f"seconds={result.seconds:.1f} seed={result.ask.seed} size={record['size']}{bound}"
    )
    if outcome.counts:
        print("    " + ", ".join(f"{name} {n:,}" for name, n in outcome.counts.items()))
    for name, values in outcome.spreads.items():
        print(f"    {name}: " + ", ".join(f"{word} {value:.3g}" for word, value in spread(values).items()))
    if not outcome.cases:
        print("    no case was asked: nothing is proved")
    for what in result.lacks:
        print(f"    FAILED {what}")
    for failure in outcome.failures[:SHOWN]:
        print(f"    FAILED {failure.kind} {failure.number}: {failure.what}")
        print(f"        again: {_command(result, failure)}")
    sys.stdout.flush()


def _command(result: Result, failure: Failure) -> str:
    words = ["lampyris", "selfcheck", result.check.name, "--only", failure.kind]
    words += ["--first", str(failure.number), "--cases", str(failure.cases)]
    words += ["--seed", str(result.ask.seed), "--size", result.ask.size]
    if result.ask.folder:
        words += ["--folder", str(result.ask.folder)]
    return shlex.join(words)


def _slug(kind: str) -> str:
    """A file name's part: what cannot stand in one is replaced, and what was replaced is told by a number."""
    plainly = re.sub(r"[^A-Za-z0-9._-]+", "-", kind)
    return plainly if plainly == kind else f"{plainly}-{zlib.crc32(kind.encode()):08x}"


def _keep(folder: Path, result: Result, failure: Failure) -> None:
    words = {
        "check": result.check.name,
        "kind": failure.kind,
        "number": failure.number,
        "seed": result.ask.seed,
        "command": _command(result, failure),
        "what": failure.what,
        "data": failure.data,
    }
    name = f"{result.check.name}-{_slug(failure.kind)}-seed{result.ask.seed}-{failure.number}.json"
    path = folder / name
    try:
        path.write_text(text(words, indent=1) + "\n", encoding="utf-8")
    except OSError as error:
        raise FileError("FILE_WRITE", error.strerror or str(error), where=str(path)) from None


def _demand_places(asked: Asked) -> None:
    """Whether all that is to be kept can be: before the first check runs for an hour."""
    for path in (asked.failures, asked.ledger, asked.record):
        if path is None:
            continue
        if path is not asked.failures:
            outputs.check_ending("ledger" if path is asked.ledger else "record", path)
            outputs.demand_place(path, append=True)
        try:
            if path is asked.failures:
                path.mkdir(parents=True, exist_ok=True)
            else:
                path.open("ab").close()
        except OSError as error:
            raise FileError("FILE_WRITE", error.strerror or str(error), where=str(path)) from None


@contextmanager
def _progress(name: str, *, quiet: bool) -> Iterator[Told | None]:
    """A bar on stderr for people at a terminal; elsewhere a line with every tenth."""
    if quiet:
        yield None
    elif sys.stderr.isatty():
        from rich.console import Console
        from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

        failed = TextColumn("{task.description}")
        columns = TextColumn(name), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn(), failed
        with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
            task = progress.add_task("", total=None)

            def bar(done: int, total: int, so_far: Outcome) -> None:
                failed = f"{so_far.failed} failed" if so_far.failed else ""
                progress.update(task, completed=done, total=total, description=failed)

            yield bar
    else:
        last = 0

        def line(done: int, total: int, so_far: Outcome) -> None:
            nonlocal last
            tenth = TENTHS * done // max(1, total)
            if tenth > last:
                last = tenth
                print(f"{name}: {done:,} of {total:,}, {so_far.failed} failed", file=sys.stderr, flush=True)

        yield line

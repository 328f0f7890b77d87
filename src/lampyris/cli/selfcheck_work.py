"""What ``lampyris selfcheck`` does."""

from __future__ import annotations

import datetime
import json
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import lampyris
from lampyris.cli import verbs
from lampyris.errors import FileError, InternalFault, UsageError
from lampyris.selfcheck import registry
from lampyris.selfcheck.check import SIZES, Ask, Check, Failure, Outcome
from lampyris.selfcheck.ledger import Ledger, append, fingerprint
from lampyris.selfcheck.runner import Range, Result, Told, run, spread

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
    from lampyris.processors import processors

    return workers if workers is not None else processors()


def selfcheck(asked: Asked) -> int:
    """``lampyris selfcheck``. Returns the exit code: 0 only if every check held."""
    checks = _checks(asked)
    ledger = Ledger(asked.ledger)
    if asked.failures is not None:
        _folder(asked.failures)
    results = []
    for check in checks:
        try:
            with _progress(check.name, quiet=asked.json) as tell:
                result = run(check, asked.ask, asked.which, ledger, tell)
        except UsageError as error:
            if asked.names or error.code != "CHECKOUT":
                raise
            # Asked for everything, where the project's own tests are not installed: told, and no failure.
            print(f"note: {check.name} was left out: {error.what}", file=sys.stderr)
            continue
        results.append(result)
        record = _record(result, asked.which)
        if asked.json:
            verbs.print_json(record)
        else:
            _print(result)
        if asked.record is not None:
            append(asked.record, record)
        if asked.failures is not None:
            for failure in result.outcome.failures:
                _keep(asked.failures, result, failure)
    broken = [result.check.name for result in results if not result.holds]
    if broken and not asked.json:
        print(f"broken: {', '.join(broken)}")
    return BROKEN if broken else 0


def list_checks(asked: Asked) -> int:
    """``lampyris selfcheck --list``. Returns the exit code."""
    for check in _checks(asked):
        kinds = check.kinds_for(asked.ask)
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
    return [registry.check(name) for name in asked.names or registry.NAMES]


def _record(result: Result, which: Range) -> dict[str, Any]:
    outcome = result.outcome
    return {
        "check": result.check.name,
        "goals": list(result.check.goals),
        "holds": result.holds,
        "size": result.ask.size if which == Range(which.only) else "part",
        "only": which.only,
        "seed": result.ask.seed,
        "kinds": {name: {"first": first, "cases": cases} for name, (first, cases) in result.kinds.items()},
        "cases": outcome.cases,
        "failures": outcome.failed,
        "bound": result.bound,
        "lacks": list(result.lacks),
        "counts": dict(outcome.counts),
        "spreads": {name: spread(values) for name, values in outcome.spreads.items()},
        "failed": [
            {"command": _command(result, f), "what": f.what, "data": dict(f.data)} for f in outcome.failures
        ],
        "seconds": round(result.seconds, 1),
        "workers": result.ask.workers,
        "date": datetime.datetime.now(datetime.UTC).date().isoformat(),
        "version": lampyris.__version__,
        "code": fingerprint(),
    }


def _print(result: Result) -> None:
    outcome = result.outcome
    bound = f" bound={result.bound:.1e}" if result.bound is not None else ""
    print(
        f"{result.check.name}: cases={outcome.cases} failures={outcome.failed} "
        f"seconds={result.seconds:.1f} seed={result.ask.seed} size={result.ask.size}{bound}"
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
    folder = f" --folder {result.ask.folder}" if result.ask.folder else ""
    return (
        f"lampyris selfcheck {result.check.name} --only {failure.kind} --first {failure.number} --cases 1 "
        f"--seed {result.ask.seed}{folder}"
    )


def _keep(folder: Path, result: Result, failure: Failure) -> None:
    words = {
        "check": result.check.name,
        "kind": failure.kind,
        "number": failure.number,
        "seed": result.ask.seed,
        "command": _command(result, failure),
        "what": failure.what,
        "data": dict(failure.data),
    }
    path = folder / f"{result.check.name}-{failure.kind}-{failure.number}.json"
    try:
        path.write_text(json.dumps(words, indent=1, default=str) + "\n", encoding="utf-8")
    except OSError as error:
        raise FileError("FILE_WRITE", error.strerror or str(error), where=str(path)) from None


def _folder(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FileError("FILE_WRITE", error.strerror or str(error), where=str(folder)) from None


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

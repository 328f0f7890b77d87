"""``lampyris selfcheck``: the promises, each a command.

Heavy modules are imported when the verb runs, so that --help is instant.
"""

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
from typing import TYPE_CHECKING, Annotated, Any

import typer

import lampyris
from lampyris._core.system import processors
from lampyris.cli import outputs
from lampyris.cli.options import Json
from lampyris.cli.text import print_json
from lampyris.errors import FileError, InternalFault, UsageError

if TYPE_CHECKING:
    from lampyris_selfcheck.check import Ask, Check, Failure, Outcome
    from lampyris_selfcheck.runner import Range, Result, Told

Names = Annotated[
    list[str] | None,
    typer.Argument(metavar="[NAME]...", help="The checks to run (default: all; see --list)."),
]
Size = Annotated[
    str,
    typer.Option(
        "--size",
        metavar="commit|nightly|release",
        help="commit (minutes in all), nightly (hours) or release (a day).",
    ),
]
Only = Annotated[str | None, typer.Option("--only", metavar="KIND", help="Only this kind of cases.")]
First = Annotated[int, typer.Option("--first", metavar="K", help="Number of the first case.", min=0)]
Cases = Annotated[
    int | None,
    typer.Option(
        "--cases", metavar="N", help="Number of cases of each kind (default: as --size says).", min=1
    ),
]
Seed = Annotated[
    int, typer.Option("--seed", metavar="N", help="Seed of all random draws: same seed, same cases.", min=0)
]
Folder = Annotated[
    Path | None,
    typer.Option("--folder", metavar="DIR", help="Input data: MovingAI maps, for `scen`."),
]
Workers = Annotated[
    int | None,
    typer.Option("--workers", metavar="N", help="Number of worker processes (default: one per core).", min=1),
]
Ledger = Annotated[
    Path | None,
    typer.Option(
        "--ledger", metavar="FILE", help="Record finished work in FILE and resume from it next time."
    ),
]
Failures = Annotated[
    Path | None,
    typer.Option("--failures", metavar="DIR", help="Write each failing case to a file."),
]
Record = Annotated[
    Path | None, typer.Option("--record", metavar="FILE", help="Append the results (JSON lines).")
]
List = Annotated[bool, typer.Option("--list", help="Print the checks and their kinds of cases.")]

BROKEN = InternalFault.exit_code
TENTHS = 10
SHOWN = 3
"""Failing cases of a check that are printed whole; `--failures` keeps more."""


def selfcheck(
    names: Names = None,
    size: Size = "commit",
    only: Only = None,
    first: First = 0,
    cases: Cases = None,
    seed: Seed = 1,
    folder: Folder = None,
    workers: Workers = None,
    ledger: Ledger = None,
    failures: Failures = None,
    record: Record = None,
    list_: List = False,
    json_: Json = False,
) -> None:
    """Test the documented guarantees: cases, failures, seconds and seed of each check.

    Exits with 0 only if all of them hold, with 6 if a guarantee is violated.
    """
    from lampyris_selfcheck.check import Ask
    from lampyris_selfcheck.runner import Range

    request = SelfcheckRequest(
        tuple(names or ()),
        Ask(seed, size, folder, processors() if workers is None else workers),
        Range(only, first, cases),
        ledger,
        failures,
        record,
        json_,
    )
    raise typer.Exit(list_checks(request) if list_ else run_checks(request))


@dataclass(frozen=True)
class SelfcheckRequest:
    """The options of a call."""

    names: tuple[str, ...]
    ask: Ask
    which: Range
    ledger: Path | None = None
    failures: Path | None = None
    record: Path | None = None
    json: bool = False


def run_checks(request: SelfcheckRequest) -> int:
    """Run the checks. Returns the exit code: 0 only if every check held."""
    from lampyris_selfcheck.ledger import Ledger as WorkLedger
    from lampyris_selfcheck.runner import run

    checks = _checks(request)
    # Before the first of them runs for an hour: whether all of them can run as requested.
    checks = [check for check in checks if _can_run(check, request)]
    _demand_places(request)
    ledger = WorkLedger(request.ledger)
    results = []
    for check in checks:
        with _progress(check.name, quiet=request.json) as report:
            result = run(check, _ask(check, request), request.which, ledger, report)
        results.append(result)
        _report(result, request)
    failed = [result.check.name for result in results if not result.holds]
    if failed and not request.json:
        print(f"failed: {', '.join(failed)}")
    return BROKEN if failed else 0


def _report(result: Result, request: SelfcheckRequest) -> None:
    """Print the result of a check, and write it to the files of the request."""
    from lampyris_selfcheck.ledger import append
    from lampyris_selfcheck.serialize import plain

    record = _record(result, request.which)
    if request.json:
        print_json(plain(record))
    else:
        _print(result, record)
    if request.record is not None:
        append(request.record, record)
    if request.failures is not None:
        for failure in result.outcome.failures:
            _keep(request.failures, result, failure)


def list_checks(request: SelfcheckRequest) -> int:
    """Print the checks and their kinds of cases. Returns the exit code."""
    from lampyris_selfcheck.check import SIZES

    for check in _checks(request):
        kinds = check.kinds_for(_ask(check, request))
        if request.json:
            print_json(
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


def _checks(request: SelfcheckRequest) -> list[Check]:
    from lampyris_selfcheck import registry
    from lampyris_selfcheck.check import SIZES

    if request.ask.size not in SIZES:
        raise UsageError("SIZE", f"no size is called {request.ask.size!r}", allowed=", ".join(SIZES))
    if len(request.names) != 1 and request.which.only is not None:
        raise UsageError("KIND", "--only goes with one check", todo="name the check whose kind it is")
    checks = [registry.check(name) for name in request.names or registry.NAMES]
    if request.ask.folder is not None and not any(check.folder for check in checks):
        taken = ", ".join(name for name in registry.NAMES if registry.check(name).folder)
        raise UsageError("FOLDER", "none of these checks reads a folder", where="--folder", allowed=taken)
    return checks


def _ask(check: Check, request: SelfcheckRequest) -> Ask:
    """The settings of one check: with a folder only if it reads one."""
    return request.ask if check.folder else replace(request.ask, folder=None)


def _can_run(check: Check, request: SelfcheckRequest) -> bool:
    from lampyris_selfcheck.runner import planned

    try:
        planned(check, _ask(check, request), request.which)
    except UsageError as error:
        if request.names or error.code != "CHECKOUT":
            raise
        # Asked for everything, where the project's own tests are not installed: a note, and no failure.
        print(f"note: {check.name} was left out: {error.what}", file=sys.stderr)
        return False
    return True


def _record(result: Result, which: Range) -> dict[str, Any]:
    from lampyris_selfcheck.ledger import fingerprint, versions
    from lampyris_selfcheck.runner import Range, spread

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
    from lampyris_selfcheck.runner import spread

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
    from lampyris_selfcheck.runner import spread

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
    """A file name's part: what cannot stand in one is replaced, and a checksum keeps names apart that would become the same."""
    plainly = re.sub(r"[^A-Za-z0-9._-]+", "-", kind)
    return plainly if plainly == kind else f"{plainly}-{zlib.crc32(kind.encode()):08x}"


def _keep(folder: Path, result: Result, failure: Failure) -> None:
    from lampyris_selfcheck.serialize import text

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


def _demand_places(request: SelfcheckRequest) -> None:
    """Whether all that is to be kept can be: before the first check runs for an hour."""
    for path in (request.failures, request.ledger, request.record):
        if path is None:
            continue
        if path is not request.failures:
            outputs.check_ending("ledger" if path is request.ledger else "record", path)
            outputs.demand_place(path, append=True)
        try:
            if path is request.failures:
                path.mkdir(parents=True, exist_ok=True)
            else:
                path.open("ab").close()
        except OSError as error:
            raise FileError("FILE_WRITE", error.strerror or str(error), where=str(path)) from None


@contextmanager
def _progress(name: str, *, quiet: bool) -> Iterator[Told | None]:
    """Show a bar on stderr at a terminal; elsewhere print a line for every tenth."""
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

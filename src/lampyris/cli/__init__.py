"""The command line: one function for each verb.

Exit codes: 0 done, 2 usage (a bad value on the command line, too), 3 bad input (a bad value in a file, or a
file that cannot be read or written), 4 no path or not arrived (a valid answer), 5 limit, 6 internal fault,
130 interrupted.
"""

from __future__ import annotations

import contextlib
import gc
import os
import sys
import warnings
from typing import Any

from lampyris._core.cancellation import interrupts
from lampyris.cli.exit_codes import BAD_INPUT, INTERNAL_FAULT, INTERRUPTED, Interrupted
from lampyris.cli.streams import Diagnostics, Pipe, demand_streams, to_nowhere
from lampyris.errors import FileError, LampyrisError, LimitError

GC_THRESHOLD = 150_000
"""Objects created between two garbage collections (Python's default is 700): what start-up creates is kept, and
collecting again and again took a twelfth of the time of a small plan. Importing what a plan needs makes 60,000."""


THREADS = ("OPENBLAS_NUM_THREADS", "GOTO_NUM_THREADS", "OMP_NUM_THREADS")
"""What OpenBLAS asks for its number of threads, in this order."""


def program() -> None:
    """:func:`main` as the whole of a process.

    What there is at its end goes with the process and is not searched for garbage: an eighth of the time of a short call.
    Unless the environment says how many threads OpenBLAS shall start, it starts none: starting them is a third of the
    processor time of importing NumPy, and no verb multiplies large matrices.
    """
    gc.set_threshold(GC_THRESHOLD)
    if not any(os.environ.get(name) for name in THREADS):
        os.environ[THREADS[0]] = "1"
    try:
        main()
    finally:
        gc.freeze()


def main() -> None:
    """Run the command line; every ending has its exit code, and none is a traceback."""
    demand_streams()
    if sys.stdout is None:
        print("error[FILE_WRITE]: standard output is closed", file=sys.stderr)
        sys.exit(BAD_INPUT)
    stdout, stderr = sys.stdout, sys.stderr
    sys.stdout, sys.stderr = Pipe(stdout), Diagnostics(stderr)
    threshold, show = gc.get_threshold(), warnings.showwarning
    warnings.showwarning = _note
    gc.set_threshold(GC_THRESHOLD)
    try:
        _run()
    except SystemExit as done:
        if done.code == INTERRUPTED and not isinstance(done, Interrupted):
            _leave()
        raise
    finally:
        gc.set_threshold(*threshold)
        warnings.showwarning = show
        try:
            # Here, where a closed pipe can still be distinguished from a fault; not at the interpreter's end.
            sys.stdout.flush()
            sys.stderr.flush()
        finally:
            sys.stdout, sys.stderr = stdout, stderr


def _leave() -> None:
    """End at once with the right exit code; everything is unwound already.

    Taking the interpreter down takes up to a quarter of a second; and where Ctrl-C came while some library
    ran code from a string, Python would end itself by the signal instead, even if the exception was caught.
    Where processes were started, they are ended as usual. That multiprocessing is imported says
    nothing: SciPy imports it for its own use, and planners that use SciPy took a fifth of a second to end.
    """
    processes = sys.modules.get("multiprocessing.process")
    if "joblib" in sys.modules or (processes is not None and processes.active_children()):
        return
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(OSError, ValueError):
            stream.flush()
    os._exit(INTERRUPTED)


def _note(
    message: Warning | str, category: type[Warning], filename: str, lineno: int, *rest: Any, **more: Any
) -> None:
    """Print a warning; one that is meant for people as a note, without the line of code that raised it."""
    if getattr(category, "for_people", False):
        print(f"note: {message}", file=sys.stderr)
    else:
        sys.stderr.write(warnings.formatwarning(message, category, filename, lineno))


def _run() -> None:
    try:
        from lampyris.cli import app  # noqa: F401

        with interrupts():
            code = _call()
        sys.exit(code)
    except SystemExit as done:
        if done.code == INTERRUPTED and not isinstance(done, Interrupted):
            print("interrupted", file=sys.stderr)  # typer has printed nothing
        raise
    except LampyrisError as error:
        _fail(error, *getattr(error, "__notes__", ()), code=error.exit_code)
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        sys.exit(INTERRUPTED)
    except OSError as error:
        if os.environ.get("LAMPYRIS_DEBUG"):
            raise
        to_nowhere(sys.stdout)
        name = error.filename if isinstance(error.filename, str) else ""
        _fail(FileError("FILE_WRITE", error.strerror or str(error), where=name), code=BAD_INPUT)
    except MemoryError as error:
        what = str(error) or "memory ran out"
        limit = LimitError("MEMORY", what, todo="take a smaller map, or allow more memory")
        _fail(limit, code=LimitError.exit_code)
    except Exception as error:
        if os.environ.get("LAMPYRIS_DEBUG"):
            raise
        _fail(
            f"error[INTERNAL]: {type(error).__name__}: {error}; a fault of lampyris, please report it; "
            "LAMPYRIS_DEBUG=1 shows where",
            code=INTERNAL_FAULT,
        )


def _call() -> int:
    """Run the verb and return the exit code; errors of the call are reported in the style of this package."""
    from lampyris.cli import option_errors
    from lampyris.cli.app import app, plain_help

    more = {} if sys.stdout.isatty() else plain_help()
    try:
        code = app(prog_name="lampyris", standalone_mode=False, **more)
    except option_errors.ClickException as problem:
        if type(problem).__name__ == "NoArgsIsHelpError":
            print(problem.format_message(), file=sys.stderr)
            return 2
        raise option_errors.usage_error(problem) from None
    except option_errors.Abort:
        raise KeyboardInterrupt from None
    return code if isinstance(code, int) else 0


def _fail(*words: object, code: int) -> None:
    """Print what is wrong and exit."""
    print(*words, sep="\n", file=sys.stderr)
    sys.exit(code)

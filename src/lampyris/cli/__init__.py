"""The command line: one function for each verb.

Exit codes: 0 done, 2 usage, 3 bad input, 4 no path or not arrived (a valid answer), 5 limit, 6 internal
fault, 130 interrupted.
"""

from __future__ import annotations

import contextlib
import gc
import os
import sys
import warnings
from typing import Any, NoReturn, TextIO

from lampyris.errors import FileError, LampyrisError, LimitError
from lampyris.halting import interrupts

BAD_INPUT = 3
INTERNAL_FAULT = 6
INTERRUPTED = 130
SELDOM = 50_000
"""Objects made between two looks for rubbish, 700 being Python's own choice: what a start makes is kept, and
looking at it again and again was a twelfth of a plan of a small map."""


class Interrupted(SystemExit):
    """Ctrl-C, and whoever pressed it has been told what is kept and how to go on."""


def main() -> None:
    """Run the command line; every way out has its exit code, and none is a traceback."""
    if sys.stdout is None:
        print("error[FILE_WRITE]: standard output is closed", file=sys.stderr)
        sys.exit(BAD_INPUT)
    stdout = sys.stdout
    sys.stdout = _Pipe(stdout)
    often, show = gc.get_threshold(), warnings.showwarning
    warnings.showwarning = _note
    gc.set_threshold(SELDOM)
    try:
        _run()
    except SystemExit as done:
        if done.code == INTERRUPTED and not isinstance(done, Interrupted):
            _leave()
        raise
    finally:
        gc.set_threshold(*often)
        warnings.showwarning = show
        try:
            # Here, where a reader that has left can still be told from a fault; not at the interpreter's end.
            sys.stdout.flush()
        finally:
            sys.stdout = stdout


def _leave() -> None:
    """End here and now, everything being unwound, with the right exit code.

    Taking the interpreter down takes up to a quarter of a second; and where Ctrl-C came while some library
    ran code from a string, Python would end itself by the signal instead, whoever had caught the exception.
    Where processes were started, they are ended in the usual way. That multiprocessing is imported says
    nothing: SciPy does so for its own use, and planners that use it took a fifth of a second to end.
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
    """A warning; one that is meant for people comes as a note, without the line of code it was raised in."""
    if getattr(category, "for_people", False):
        print(f"note: {message}", file=sys.stderr)
    else:
        sys.stderr.write(warnings.formatwarning(message, category, filename, lineno))


def _run() -> None:
    try:
        from lampyris.cli.app import app

        with interrupts():
            app(standalone_mode=True)
    except SystemExit as done:
        if done.code == INTERRUPTED and not isinstance(done, Interrupted):
            print("interrupted", file=sys.stderr)  # typer has said nothing
        raise
    except LampyrisError as error:
        print(error, *getattr(error, "__notes__", ()), sep="\n", file=sys.stderr)
        sys.exit(error.exit_code)
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        sys.exit(INTERRUPTED)
    except OSError as error:
        if os.environ.get("LAMPYRIS_DEBUG"):
            raise
        _to_nowhere(sys.stdout)
        name = error.filename if isinstance(error.filename, str) else ""
        print(FileError("FILE_WRITE", error.strerror or str(error), where=name), file=sys.stderr)
        sys.exit(BAD_INPUT)
    except MemoryError as error:
        what = str(error) or "memory ran out"
        print(LimitError("MEMORY", what, todo="take a smaller map, or allow more memory"), file=sys.stderr)
        sys.exit(LimitError.exit_code)
    except Exception as error:
        if os.environ.get("LAMPYRIS_DEBUG"):
            raise
        print(
            f"error[INTERNAL]: {type(error).__name__}: {error}; a fault of lampyris, please report it; "
            "LAMPYRIS_DEBUG=1 shows where",
            file=sys.stderr,
        )
        sys.exit(INTERNAL_FAULT)


class _Pipe:
    """Standard output whose reader may leave (`| head`): then the work is done, exit code 0.

    Caught where it happens, because typer and rich each turn a broken pipe into exit code 1 on the way up.
    """

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream

    def write(self, text: str) -> int:
        """Write, or leave."""
        try:
            return self._stream.write(text)
        except BrokenPipeError:
            self._leave()

    def flush(self) -> None:
        """Flush, or leave."""
        try:
            self._stream.flush()
        except BrokenPipeError:
            self._leave()

    def _leave(self) -> NoReturn:
        _to_nowhere(self._stream)
        sys.exit(0)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


def _to_nowhere(stream: TextIO) -> None:
    """Let what is still to be written vanish: Python would complain again when it flushes at its end."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())

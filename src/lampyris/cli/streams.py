"""Standard streams that are closed, full, or whose reader has left."""

from __future__ import annotations

import contextlib
import io
import os
import sys
from typing import Any, NoReturn, TextIO


def demand_streams() -> None:
    """See that descriptors 0 to 2 are open, and that standard error can be written to.

    A shell may have closed them (``2>&-``). The next file that is opened would then get the number of a
    standard stream, and what libraries write to that stream would land in it.
    """
    for number in (0, 1, 2):
        try:
            os.fstat(number)
        except OSError:
            # The lowest free number is taken: those below are open by now. Standard output stays None.
            opened = os.open(os.devnull, os.O_RDONLY if number == 0 else os.O_WRONLY)
            if opened != number:
                os.dup2(opened, number)
                os.close(opened)
    if sys.stderr is None:
        sys.stderr = open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper) and stream.errors == "strict":
            # Names of files may hold what the terminal's encoding does not have.
            stream.reconfigure(errors="backslashreplace")


class Pipe:
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
        to_nowhere(self._stream)
        sys.exit(0)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


class Diagnostics:
    """Standard error, which may be full or have lost its reader: the exit code alone then says what was."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream

    def write(self, text: str) -> int:
        """Write; or let it go."""
        try:
            return self._stream.write(text)
        except OSError:
            to_nowhere(self._stream)
            return len(text)

    def flush(self) -> None:
        """Flush; or let it go."""
        try:
            self._stream.flush()
        except OSError:
            to_nowhere(self._stream)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


def to_nowhere(stream: TextIO) -> None:
    """Let what is still to be written vanish: Python would complain again when it flushes at its end."""
    with contextlib.suppress(OSError, ValueError, io.UnsupportedOperation):
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, stream.fileno())
        os.close(nowhere)

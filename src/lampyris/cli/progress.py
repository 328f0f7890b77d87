"""Progress on standard error: a spinner, a running count, or a bar with the time left."""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import TracebackType
from typing import TYPE_CHECKING, Self

if TYPE_CHECKING:
    from rich.live import Live
    from rich.table import Table

QUIET_S = 30.0
"""Without a terminal a line is printed for every tenth of the runs, or after so many seconds."""


@contextmanager
def working(what: str, *, quiet: bool) -> Iterator[None]:
    """Show a spinner on stderr while something runs, at a terminal."""
    if quiet or not sys.stderr.isatty():
        yield
        return
    from rich.console import Console

    with Console(stderr=True).status(f"{what} ..."):
        yield


@contextmanager
def counting(what: str, unit: str, *, quiet: bool) -> Iterator[Callable[[int], None] | None]:
    """Show a running count on stderr, at a terminal."""
    if quiet or not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console

    with Console(stderr=True).status(f"{what} ...") as status:
        yield lambda n: status.update(f"{what} ... {n} {unit}")


def clock(seconds: float | None) -> str:
    """``1:02:03``, ``2:03``; ``-:--`` where it is not known."""
    if seconds is None or not math.isfinite(seconds):
        return "-:--"
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{rest:02}" if hours else f"{minutes}:{rest:02}"


class ProgressDisplay:
    """Progress of many runs on stderr: a bar at a terminal, otherwise a line now and then.

    Parameters
    ----------
    quiet : no lines where there is no terminal.
    """

    def __init__(self, *, quiet: bool) -> None:
        self._quiet = quiet
        self._tenth, self._printed = -1, time.monotonic()
        self._live: Live | None = None
        if sys.stderr.isatty():
            from rich.console import Console
            from rich.live import Live

            self._live = Live(console=Console(stderr=True), refresh_per_second=4, transient=True)

    def __enter__(self) -> Self:
        if self._live is not None:
            self._live.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._live is not None:
            self._live.stop()

    def update(
        self, name: str, done: int, total: int, more: str, left: float | None, table: Table | None = None
    ) -> None:
        """Show the progress; ``table`` stands under the bar."""
        words = f"{done:,} of {total:,} runs{more}"
        if self._live is not None:
            from rich.console import Group
            from rich.progress_bar import ProgressBar
            from rich.table import Table
            from rich.text import Text

            bar = ProgressBar(total=max(1, total), completed=done, width=40)
            line = Table.grid(padding=(0, 2))
            line.add_row(Text(name), bar, Text(words), Text(f"{clock(left)} left"))
            self._live.update(line if table is None else Group(line, table))
            return
        tenth, now = 10 * done // max(1, total), time.monotonic()
        if self._tenth < 0:
            self._tenth = tenth  # what was there before has been printed already
        late = now - self._printed >= QUIET_S
        if not self._quiet and (tenth > self._tenth or late):
            about = "" if left is None or done >= total else f", about {clock(left)} left"
            print(f"{words}{about}", file=sys.stderr, flush=True)
            self._printed = now
        self._tenth = max(self._tenth, tenth)

"""``lampyris warm``: compile every kernel now, so that nobody waits for it later.

Work is imported when the verb runs, so that --help is instant.
"""

from __future__ import annotations

import typer

from lampyris.cli.options import Json


def warm(json_: Json = False) -> None:
    """Compile all that large maps need, once for a machine, and say where it is kept."""
    from lampyris.cli import warm_work as work

    raise typer.Exit(work.warm(json_))

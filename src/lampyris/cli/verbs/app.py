"""``lampyris app``: the page in the browser.

Heavy modules are imported when the verb runs, so that --help is instant.
"""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path
from typing import Annotated

import typer

from lampyris.errors import UsageError


def app(
    map_: Annotated[
        str | None,
        typer.Argument(metavar="[MAP]", help="The map to open: one of `lampyris maps`, or of --folder."),
    ] = None,
    port: Annotated[
        int | None,
        typer.Option(
            "--port",
            metavar="N",
            min=0,
            max=65535,
            help="The port to listen on; 0: any free one. Default: 8770, or a free one if that is taken; "
            "the browser keeps drafts per port.",
        ),
    ] = None,
    folder: Annotated[
        Path | None,
        typer.Option(
            "--folder", metavar="DIR", help="A folder of your own maps, listed with the bundled ones."
        ),
    ] = None,
    no_browser: Annotated[
        bool, typer.Option("--no-browser", help="Print the address and do not open a browser.")
    ] = False,
    allow_remote: Annotated[
        str | None,
        typer.Option(
            "--allow-remote",
            metavar="HOSTNAME",
            help="Accept other machines, under this host name and unencrypted. "
            "By default only this machine is served.",
        ),
    ] = None,
) -> None:
    """Open the app: draw, plan, watch and compare in the browser."""
    missing = [name for name in ("starlette", "uvicorn") if find_spec(name) is None]
    if missing:
        what = f"the app needs {' and '.join(missing)}, which {'are' if missing[1:] else 'is'} not installed"
        raise UsageError("APP", what, todo=f"pip install {' '.join(missing)}")
    from lampyris.app.server.run import run_app

    raise typer.Exit(
        run_app(map_, port=port, folder=folder, browser=not no_browser, allow_remote=allow_remote)
    )

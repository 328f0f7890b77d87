"""``lampyris schema``: the JSON Schema of scenario files."""

from __future__ import annotations

import json
import sys
from typing import Annotated

import typer


def schema(
    fleet: Annotated[
        bool, typer.Option("--fleet", help="Schema of scenario files of fleets, with the key `fleet`.")
    ] = False,
) -> None:
    """Print the JSON Schema of scenario files."""
    if fleet:
        from lampyris.io.fleet_scenario.schema import json_schema
    else:
        from lampyris.io.scenario.schema import json_schema

    sys.stdout.write(json.dumps(json_schema(), indent=2) + "\n")

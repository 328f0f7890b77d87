"""``lampyris schema``: the JSON Schema of scenario files."""

from __future__ import annotations

import json
import sys


def schema() -> None:
    """Print the JSON Schema of scenario files."""
    from lampyris.io.scenario.schema import json_schema

    sys.stdout.write(json.dumps(json_schema(), indent=2) + "\n")

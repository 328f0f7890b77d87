"""What a check saw, in words of JSON: for the ledger, the record, `--json` and the files of failing cases."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from collections.abc import Set as AbstractSet
from typing import Any

import numpy as np


def plain(value: Any) -> Any:
    """The same in mappings, lists, text, numbers, booleans and None.

    NumPy's numbers and arrays become Python's; NaN and infinities, which JSON has no numbers for, become the
    words ``nan``, ``inf`` and ``-inf``, which ``float`` reads; anything unknown becomes its ``str``.
    """
    if isinstance(value, np.generic | np.ndarray):
        value = value.tolist()
    if value is None or isinstance(value, bool):
        return value
    if isinstance(value, str):
        return str(value)
    if isinstance(value, int):
        return int(value)
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else str(float(value))
    if isinstance(value, Mapping):
        return {str(key): plain(inner) for key, inner in value.items()}
    if isinstance(value, AbstractSet):
        return sorted((plain(inner) for inner in value), key=repr)
    if isinstance(value, list | tuple | range):
        return [plain(inner) for inner in value]
    return str(value)


def text(value: Any, indent: int | None = None) -> str:
    """One line of JSON, or several with an indent; ASCII."""
    return json.dumps(plain(value), indent=indent, allow_nan=False)

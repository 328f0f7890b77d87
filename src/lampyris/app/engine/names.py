"""Names: which words may be a file's, before any file is looked for."""

from __future__ import annotations

import re
from typing import Final

from lampyris.errors import FileError

PLAIN: Final = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,63}", re.ASCII)
MOST: Final = 255
_DEVICES: Final = frozenset(
    ("con", "prn", "aux", "nul", "conin$", "conout$", *(f"{w}{k}" for w in ("com", "lpt") for k in range(10)))
)
_BESIDES: Final = " ._-()"


def is_plain_name(name: str) -> bool:
    """Whether a file of a library may be called so: a few letters, and nothing that any system takes for
    more than a name (devices of Windows, a dot at the end).
    """
    return PLAIN.fullmatch(name) is not None and not name.endswith(".") and not is_device(name)


def is_device(name: str) -> bool:
    """Whether Windows takes a name for a device, whatever its ending."""
    return name.partition(".")[0].rstrip(" ").casefold() in _DEVICES


def check_file_name(name: str) -> str:
    """The name of an uploaded file, which is shown and never used, if it is one that a person gives a file.

    Raises
    ------
    FileError : FILE_NAME.
    """
    good = all(c.isalnum() or c in _BESIDES for c in name) and name.isprintable()
    whole = 0 < len(name) <= MOST and not name.startswith((".", " ", "-")) and not name.endswith((".", " "))
    if not good or not whole or ".." in name or is_device(name):
        raise FileError(
            "FILE_NAME", ascii(name[:60]), where="file", allowed="letters, digits, spaces and . _ - ( )",
            todo="rename the file",
        )  # fmt: skip
    return name


def shown_name(name: str) -> str:
    """A name that fits into a scenario: 1 to 64 characters."""
    return name if len(name) <= 64 else f"{name[:48]}...{name[-13:]}"

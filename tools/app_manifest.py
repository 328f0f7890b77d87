"""Write down what the app ships: `python tools/app_manifest.py`, after any change to src/lampyris/app/static.

One line a file, as `sha256sum --check` reads it from that folder. A test compares them: what is not in the
list was not meant to be shipped, and a file of other bytes was changed by nobody who said so.
"""

from __future__ import annotations

import hashlib
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
STATIC = ROOT / "src" / "lampyris" / "app" / "static"
LIST = ROOT / "tests" / "app" / "shipped.sha256"


def lines() -> list[str]:
    """One for each file, by name."""
    files = sorted(file for file in STATIC.rglob("*") if file.is_file())
    return [
        f"{hashlib.sha256(file.read_bytes()).hexdigest()}  {file.relative_to(STATIC).as_posix()}\n"
        for file in files
    ]


if __name__ == "__main__":
    LIST.write_text("".join(lines()), encoding="ascii")
    print(f"{LIST.relative_to(ROOT)}: {len(lines())} files")

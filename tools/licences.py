"""Write docs/licences.md: under which licence everything is that lampyris runs on, by its own word.

``python tools/licences.py`` after a change of requirements/run.txt; the versions must be those installed.
"""

from __future__ import annotations

import re
import sys
from importlib.metadata import Distribution, PackageNotFoundError, distribution
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PINS = ROOT / "requirements" / "run.txt"
PAGE = ROOT / "docs" / "licences.md"
LONGEST = 60
"""Characters of a licence's name; longer is the licence itself."""

HEAD = """# Licences of what lampyris runs on

lampyris itself is MIT. Installed with it, at these versions (`requirements/run.txt`); the licences' names are
the packages' own. The page of `lampyris app` holds a copy of uPlot 1.6.32 (MIT), and nothing else of others.

| Package | Version | Licence |
|---|---|---|
"""


def pins() -> dict[str, str]:
    """Version by name of all that is pinned to run on."""
    text = PINS.read_text(encoding="utf-8")
    return dict(re.findall(r"^([A-Za-z0-9._-]+)==(\S+)", text, re.MULTILINE))


def licence(found: Distribution) -> str:
    """As the package's metadata say: an SPDX expression, a short name, or its classifier."""
    told = found.metadata
    expression = told.get("License-Expression")
    if expression:
        return str(expression)
    classified = [
        line.rpartition(" :: ")[2].removesuffix(" License")
        for line in told.get_all("Classifier") or []
        if line.startswith("License :: ")
    ]
    name = (told.get("License") or "").strip()
    if name and len(name) <= LONGEST and "\n" not in name:
        return name.removesuffix(" License")
    return ", ".join(classified) or "not told"


def page() -> str:
    """The text of docs/licences.md."""
    rows = []
    for name, version in sorted(pins().items()):
        try:
            found = distribution(name)
        except PackageNotFoundError:
            sys.exit(f"{name} is not installed: make test installs it")
        if found.version != version:
            sys.exit(f"{name} {found.version} is installed, {version} is pinned")
        rows.append(f"| {name} | {version} | {licence(found)} |")
    return HEAD + "\n".join(rows) + "\n"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")

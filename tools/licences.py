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
    name = _short(found)
    return (bsd(_text(found)) or name) if name == "BSD" else name


def bsd(text: str) -> str:
    """Which of the BSD licences a text is, by its clauses; nothing: it cannot be told.

    Parameters
    ----------
    text : of a licence; what comes after its first disclaimer is of other things that are in the package.
    """
    first, ended, _ = " ".join(text.split()).lower().partition("this software is provided by")
    clauses = ("redistributions of source code must", "redistributions in binary form must")
    if not ended or not all(one in first for one in clauses):
        return ""
    if "advertising materials" in first:
        return "BSD-4-Clause"
    return "BSD-3-Clause" if "endorse or promote products" in first else "BSD-2-Clause"


def _text(found: Distribution) -> str:
    """The licence's text: in the metadata, or in the file beside them."""
    told = found.metadata.get("License") or ""
    if len(told) > LONGEST:
        return told
    beside = [
        one for one in found.files or [] if re.search(r"\.dist-info/(licenses/)?LICENSE(\.\w+)?$", str(one))
    ]
    return beside[0].read_text(encoding="utf-8") if beside else ""


def _short(found: Distribution) -> str:
    """A short name, or the classifier's."""
    told = found.metadata
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

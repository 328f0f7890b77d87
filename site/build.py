"""Build the site: put pages together, derive the reference from the program, and run Sphinx.

    python site/build.py [OUT] [--quick]

Pages are copied with their places in the repository, so that their links work in both. ``--quick`` draws no
gallery and leaves out the check of the docstrings (tools/docstrings.py). Warnings are errors.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
SITE = ROOT / "site"
sys.path.insert(0, str(SITE))

import derived_pages  # noqa: E402 - beside this file


def put_together(source: Path) -> None:
    """Copy what the site is made of to ``source``, and write the pages that are derived."""
    shutil.rmtree(source, ignore_errors=True)
    source.mkdir(parents=True)
    shutil.copy2(SITE / "index.md", source / "index.md")
    for name in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md", "LICENSE"):
        shutil.copy2(ROOT / name, source / name)
    for folder in ("docs", "examples"):
        shutil.copytree(ROOT / folder, source / folder)
    derived_pages.write_pages(source / "reference")


def main() -> int:
    """Build; the exit code of Sphinx."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", nargs="?", default=str(ROOT / "build" / "site" / "html"))
    parser.add_argument("--quick", action="store_true", help="draw no gallery, check no docstrings")
    given = parser.parse_args()
    docstrings = [sys.executable, str(ROOT / "tools" / "docstrings.py")]
    if not given.quick and subprocess.run(docstrings, check=False, cwd=ROOT).returncode:
        return 1
    source, out = ROOT / "build" / "site" / "source", Path(given.out)
    put_together(source)
    command = [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", "-b", "html", "-c", str(SITE)]
    command += ["-d", str(source.parent / "doctrees"), str(source), str(out)]
    quick = {"LAMPYRIS_NO_GALLERY": "1"} if given.quick else {}
    done = subprocess.run(command, check=False, cwd=ROOT, env={**os.environ, "MPLBACKEND": "Agg", **quick})
    if not done.returncode:
        print(f"wrote {out / 'index.html'}")
    return done.returncode


if __name__ == "__main__":
    sys.exit(main())

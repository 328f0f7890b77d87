"""Threats: what is shipped is what was meant to be, and what it runs on is not known to be bad (W20)."""

from __future__ import annotations

import importlib.util
import re
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
SOURCE = ROOT / "src" / "lampyris"
pytestmark = pytest.mark.source
ENDINGS = {
    "": {".py"},
    "app/static": {".js", ".css", ".html", ".svg", ".json", ".txt"},
}
"""What may be where; bundled data has a list of its own."""
DATA = {".json", ".yaml", ".map", ".png", ".csv", ".txt", ".npz", ".pgm", ".md", ".tsv"}
DATA |= {".toml", ".typed", ".scen"}
# uPlot 1.6.32, MIT, as its own release has it. It is never edited here.
VENDORED = {"uplot.js", "uplot.css", "uplot-licence.txt"}


def manifest() -> dict[str, str]:
    """Hash by name, as it was written down."""
    text = (ROOT / "tests" / "app" / "shipped.sha256").read_text(encoding="ascii")
    return {name: digest for digest, _, name in (line.partition("  ") for line in text.splitlines())}


def test_the_page_is_the_files_that_were_written_down() -> None:
    spec = importlib.util.spec_from_file_location("app_manifest", ROOT / "tools" / "app_manifest.py")
    assert spec is not None
    assert spec.loader is not None
    tool = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(tool)
    now = {name: digest for digest, _, name in (line.strip().partition("  ") for line in tool.lines())}
    assert now == manifest(), "if this was meant: python tools/app_manifest.py"
    assert set(now) >= VENDORED | {"index.html", "main.js"}
    assert all(re.fullmatch(r"[a-z][a-z0-9-]*\.(js|css|html|svg|json|txt)", name) for name in now)


def expected() -> set[str]:
    """Every file of the package, by its name in the wheel."""
    return {
        f"lampyris/{file.relative_to(SOURCE).as_posix()}"
        for file in SOURCE.rglob("*")
        if file.is_file() and "__pycache__" not in file.parts
    }


def test_the_wheel_holds_the_package_and_nothing_else(tmp_path: Path) -> None:
    pytest.importorskip("hatchling")
    done = subprocess.run(
        [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(tmp_path)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    (wheel,) = tmp_path.glob("*.whl")
    with zipfile.ZipFile(wheel) as packed:
        names = set(packed.namelist())
    inside = {name for name in names if name.startswith("lampyris/")}
    told = {name.partition("/")[2] for name in names - inside}
    assert inside == expected()
    assert told == {"METADATA", "WHEEL", "RECORD", "entry_points.txt", "licenses/LICENSE"}
    for name in inside:
        path = Path(name)
        allowed = ENDINGS["app/static"] if "static" in path.parts else ENDINGS[""] | DATA
        assert path.suffix in allowed or path.name == "py.typed", name
        assert not path.name.startswith("."), name


def test_what_it_runs_on_is_pinned() -> None:
    for name in ("run.txt", "dev.txt", "nightly.txt", "bench.txt"):
        lines = (ROOT / "requirements" / name).read_text(encoding="utf-8").splitlines()
        pins = [line.split(";")[0].strip(" \\") for line in lines if re.match(r"[a-z0-9]", line)]
        assert len(pins) > 20
        for pin in pins:
            assert re.fullmatch(r"[a-z0-9._-]+(\[[a-z,]+\])?==[0-9][a-z0-9.]*", pin), pin


def test_the_list_of_licences_is_of_what_is_pinned() -> None:
    spec = importlib.util.spec_from_file_location("licences", ROOT / "tools" / "licences.py")
    assert spec is not None
    assert spec.loader is not None
    tool = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(tool)
    page = (ROOT / "docs" / "licences.md").read_text(encoding="utf-8")
    rows = [[cell.strip() for cell in line.split("|")[1:4]] for line in page.splitlines()]
    told = {row[0]: (row[1], row[2]) for row in rows if len(row) == 3 and re.match(r"[0-9]", row[1])}
    assert {name: version for name, (version, _) in told.items()} == tool.pins(), "python tools/licences.py"
    for name, (_, licence) in told.items():
        assert licence != "not told", name
        assert not re.search(r"GPL|SSPL|BUSL|Commons Clause", licence), name


@pytest.mark.nightly
def test_nothing_it_runs_on_has_a_known_advisory() -> None:
    """At a release; needs pip-audit and its database."""
    pytest.importorskip("pip_audit", reason="pip-audit is not installed")
    done = subprocess.run(
        [
            sys.executable,
            "-m",
            "pip_audit",
            "--strict",
            "--no-deps",
            "--disable-pip",
            "-r",
            "requirements/run.txt",
        ],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    if re.search(
        r"ConnectionError|Max retries|timed out|HTTPError|could not be audited|not found on PyPI", done.stderr
    ):
        pytest.skip("the database of advisories does not answer")
    assert done.returncode == 0, done.stdout + done.stderr

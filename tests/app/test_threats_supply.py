"""Threats: what is shipped is what was meant to be, and what it runs on is not known to be bad (W20)."""

from __future__ import annotations

import importlib.util
import json
import re
import subprocess
import sys
import zipfile
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).resolve().parents[2]
SOURCE = ROOT / "src" / "lampyris"
pytestmark = pytest.mark.source
ENDINGS = {
    "": {".py"},
    "app/static": {".js", ".css", ".html", ".svg", ".json", ".txt"},
    "app/replay": {".js"},
    "app/recorded": {".gz"},
    "notebook": {".js"},
}
"""What may be where; bundled data has a list of its own."""
DATA = {".json", ".yaml", ".map", ".png", ".csv", ".txt", ".npz", ".pgm", ".md", ".tsv"}
DATA |= {".toml", ".typed", ".scen", ".j2", ".css"}
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
        folder = next((name for name in ENDINGS if name and path.is_relative_to(f"lampyris/{name}")), "")
        allowed = ENDINGS[folder] | (DATA | {".py"} if folder != "app/static" else set())
        assert path.suffix in allowed or path.name == "py.typed", name
        assert not path.name.startswith("."), name


def test_what_it_runs_on_is_pinned() -> None:
    for name in ("run.txt", "dev.txt", "nightly.txt", "bench.txt"):
        lines = (ROOT / "requirements" / name).read_text(encoding="utf-8").splitlines()
        pins = [line.split(";")[0].strip(" \\") for line in lines if re.match(r"[a-z0-9]", line)]
        assert len(pins) > 20
        for pin in pins:
            assert re.fullmatch(r"[a-z0-9._-]+(\[[a-z,]+\])?==[0-9][a-z0-9.]*", pin), pin


@pytest.fixture(scope="module")
def licences() -> ModuleType:
    spec = importlib.util.spec_from_file_location("licences", ROOT / "tools" / "licences.py")
    assert spec is not None
    assert spec.loader is not None
    tool = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(tool)
    return tool


def test_the_list_of_licences_is_of_what_is_pinned(licences: ModuleType) -> None:
    page = (ROOT / "docs" / "licences.md").read_text(encoding="utf-8")
    rows = [[cell.strip() for cell in line.split("|")[1:4]] for line in page.splitlines()]
    told = {row[0]: (row[1], row[2]) for row in rows if len(row) == 3 and re.match(r"[0-9]", row[1])}
    assert {name: version for name, (version, _) in told.items()} == licences.pins(), (
        "python tools/licences.py"
    )
    for name, (_, licence) in told.items():
        assert licence not in {"not told", "BSD"}, name
        assert not re.search(r"GPL|SSPL|BUSL|Commons Clause", licence), name


def test_the_list_of_licences_is_what_the_packages_say_themselves(licences: ModuleType) -> None:
    """As far as they are installed at the pinned version: some are for one system only."""
    rows = (ROOT / "docs" / "licences.md").read_text(encoding="utf-8").splitlines()
    asked = 0
    for name, version in licences.pins().items():
        try:
            found = distribution(name)
        except PackageNotFoundError:
            continue
        if found.version == version:
            assert f"| {name} | {version} | {licences.licence(found)} |" in rows, "python tools/licences.py"
            asked += 1
    assert asked > 20
    if asked == len(licences.pins()):
        assert licences.page().splitlines() == rows, "python tools/licences.py"


BSD_2 = """Redistribution and use in source and binary forms are permitted:
1. Redistributions of source code must retain the above. 2. Redistributions in
binary form must reproduce the above. {} THIS SOFTWARE IS PROVIDED BY THE AUTHORS "AS IS". {}"""
THIRD = "Neither the name nor the names of its contributors may be used to endorse or promote products."


@pytest.mark.parametrize(
    ("text", "which"),
    [
        (BSD_2.format("", ""), "BSD-2-Clause"),
        (BSD_2.format("3. " + THIRD, ""), "BSD-3-Clause"),
        (BSD_2.format("", "Bundled with it: " + THIRD), "BSD-2-Clause"),
        (BSD_2.format("3. All advertising materials must say so. " + THIRD, ""), "BSD-4-Clause"),
        ("BSD", ""),
        ("Permission is hereby granted. THIS SOFTWARE IS PROVIDED BY X", ""),
    ],
)
def test_which_bsd_licence_it_is(licences: ModuleType, text: str, which: str) -> None:
    assert licences.bsd(text) == which


OFFLINE = r"ConnectionError|Max retries|timed out|NameResolutionError|Failed to establish a new connection"


def audited(code: int, out: str, err: str) -> str:
    """What is wrong by pip-audit's answer; nothing: all is well. Skips where the database is not reached.

    A pin that could not be audited is no reason to hear nothing of the others, nor is all well with it.
    """
    try:
        told = json.loads(out)["dependencies"]
    except (ValueError, KeyError, TypeError):
        if re.search(OFFLINE, err):
            pytest.skip("the database of advisories does not answer")
        return f"exit {code}: {err[-2000:]}"
    known = [f"{one['name']} {one['version']}: {v['id']}" for one in told for v in one.get("vulns", ())]
    unasked = [f"{one['name']}: {one['skip_reason']}" for one in told if "skip_reason" in one]
    if told and len(unasked) == len(told):
        pytest.skip("what answers knows not one of the pins: a mirror without the database of advisories")
    wrong = known + unasked
    return "\n".join(wrong) if wrong or code == 0 else f"exit {code}: {err[-2000:]}"


FINE = {"name": "a", "version": "1", "vulns": []}
KNOWN = {"name": "b", "version": "2", "vulns": [{"id": "PYSEC-1"}]}
UNASKED = {"name": "c", "skip_reason": "could not be audited: not found on PyPI"}


@pytest.mark.parametrize(
    ("code", "told", "wrong"),
    [
        (0, [FINE], ""),
        (1, [FINE, KNOWN], "b 2: PYSEC-1"),
        (1, [UNASKED, KNOWN], "b 2: PYSEC-1\nc: could not be audited: not found on PyPI"),
        (0, [FINE, UNASKED], "c: could not be audited: not found on PyPI"),
        (1, [FINE], "exit 1: Max retries exceeded"),
    ],
)
def test_one_pin_that_cannot_be_audited_hides_no_advisory(
    code: int, told: list[dict[str, object]], wrong: str
) -> None:
    assert audited(code, json.dumps({"dependencies": told}), "Max retries exceeded") == wrong


def test_only_without_a_connection_nothing_is_asked() -> None:
    with pytest.raises(pytest.skip.Exception):
        audited(1, "", "requests.exceptions.ConnectionError: Max retries exceeded")
    with pytest.raises(pytest.skip.Exception):
        audited(0, json.dumps({"dependencies": [UNASKED, UNASKED]}), "")
    assert audited(1, "", "could not be audited").startswith("exit 1")


@pytest.mark.nightly
def test_nothing_it_runs_on_has_a_known_advisory() -> None:
    """At a release; needs pip-audit and its database."""
    pytest.importorskip("pip_audit", reason="pip-audit is not installed")
    done = subprocess.run(
        [
            sys.executable,
            "-m",
            "pip_audit",
            "--no-deps",
            "--disable-pip",
            "--format=json",
            "--progress-spinner=off",
            "-r",
            "requirements/run.txt",
        ],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    wrong = audited(done.returncode, done.stdout, done.stderr)
    assert not wrong, wrong

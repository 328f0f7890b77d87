"""Every Python block of README, CONTRIBUTING and docs, and every example, passes mypy --strict; and every page runs."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import lampyris
from bad_inputs.case import inside

ROOT = Path(__file__).resolve().parents[1]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]
BLOCK = re.compile(r"^```python\n(.*?)^```$", re.MULTILINE | re.DOTALL)
FILE = re.compile(r"# (\w+\.py)\n")
"""The first line of a block that its page has the reader save, under this name."""
RUN_ELSEWHERE = {
    "README.md": "test_readme.py",
    "CONTRIBUTING.md": "test_contributing.py",
    "docs/python.md": "test_docs_python.py",
    "docs/studies.md": "test_docs_studies.py",
    **{f"docs/speed/{name}.md": "test_docs_speed.py" for name in ("README", "curve", "driving", "profile")},
}
"""Pages whose blocks a test of the page itself runs."""

pytestmark = pytest.mark.source


def blocks() -> dict[str, list[str]]:
    """The Python blocks of each page that has any."""
    found = {str(page.relative_to(ROOT)): BLOCK.findall(page.read_text(encoding="utf-8")) for page in PAGES}
    return {page: made for page, made in found.items() if made}


def check_types(files: list[Path]) -> str:
    """What mypy says of these files, as strictly as of the package."""
    command = [
        sys.executable,
        "-m",
        "mypy",
        "--strict",
        "--allow-redefinition",  # a page may use a name again, for something else
        "--config-file",
        str(ROOT / "pyproject.toml"),
        *map(str, files),
    ]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=ROOT)
    return done.stdout + done.stderr


@pytest.mark.nightly
def test_examples_and_blocks_are_typed(tmp_path: Path) -> None:
    files = sorted((ROOT / "examples").glob("*.py"))
    assert len(files) >= 4
    for page, made in blocks().items():
        # As they are run: one after the other with the same names, but for those that the reader saves.
        whole = "".join(block for block in made if not FILE.match(block))
        named = {saved[1]: block for block in made if (saved := FILE.match(block))}
        if whole:
            named[re.sub(r"\W", "_", page.removesuffix(".md")) + ".py"] = whole
        for name, block in named.items():
            files.append(tmp_path / name)
            files[-1].write_text(block, encoding="utf-8")
    wrong = tmp_path / "wrong.py"
    wrong.write_text('import lampyris\n\nlampyris.load_grid("env-1", resolution="fine").no_such_name\n')
    said = check_types([*files, wrong])
    lines = [line for line in said.splitlines() if "error:" in line]
    assert sorted({re.sub(r":\d+: error: .*\[(.*)\]$", r" \1", Path(line).name) for line in lines}) == [
        "wrong.py arg-type",
        "wrong.py attr-defined",
    ], said
    assert f"checked {len(files) + 1} source files" in said


def test_every_block_is_run_by_a_test(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    tests = {path.name for path in (ROOT / "tests").glob("test_*.py")}
    assert set(RUN_ELSEWHERE.values()) <= tests
    assert set(RUN_ELSEWHERE) <= set(blocks())
    here = {page: made for page, made in blocks().items() if page not in RUN_ELSEWHERE}
    assert here
    lampyris.save_scenario(
        lampyris.Scenario(lampyris.Scene(lampyris.load_grid("guide"), (0, 9), (7, 0))), tmp_path / "a.yaml"
    )
    shutil.copy(ROOT / "docs" / "img" / "photo.jpg", tmp_path / "floor.jpg")
    monkeypatch.syspath_prepend(str(tmp_path))
    with inside(tmp_path):
        for page, made in here.items():
            names: dict[str, object] = {}
            for block in made:
                if saved := FILE.match(block):
                    Path(saved[1]).write_text(block, encoding="utf-8")
                exec(compile(block, page, "exec"), names)
    assert (tmp_path / "b.json").exists()

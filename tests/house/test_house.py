"""The house stays in order: sizes of files and functions, what start-up imports, what no file may hold."""

from __future__ import annotations

import ast
import subprocess
import sys
from importlib.metadata import distribution
from pathlib import Path

import pytest

import lampyris
from source_tree import statements

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = Path(lampyris.__file__).parent
SOURCES = sorted(PACKAGE.rglob("*.py"))

MAX_FILE = 800
MAX_FUNCTION = 80
MAX_KERNEL = 150  # One loop with its bookkeeping inlined: splitting it would cost calls in the plain form.


def test_there_are_sources() -> None:
    assert len(SOURCES) > 20


def test_files_and_functions_hold_one_idea() -> None:
    long = []
    for path in SOURCES:
        text = path.read_text(encoding="utf-8")
        name = path.relative_to(PACKAGE)
        if len(text.splitlines()) > MAX_FILE:
            long.append(f"{name}: a file this long holds two ideas")
        limit = MAX_KERNEL if "kernels" in name.parts else MAX_FUNCTION
        for node in statements(ast.parse(text)):
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                body = node.body[1:] if ast.get_docstring(node) else node.body
                length = (node.end_lineno or 0) - body[0].lineno + 1 if body else 0
                if length > limit:
                    long.append(f"{name}: {node.name} has {length} lines")
    assert long == []


SCRIPTS = sorted(
    path
    for folder in ("static", "replay")
    for path in (PACKAGE / "app" / folder).glob("*.js")
    if path.name != "uplot.js"
)


def test_scripts_hold_one_idea() -> None:
    lengths = {path.name: len(path.read_text(encoding="utf-8").splitlines()) for path in SCRIPTS}
    assert len(lengths) > 20
    assert not {name for name, length in lengths.items() if length > MAX_FILE}


@pytest.mark.commit(3)
@pytest.mark.parametrize(
    "words",
    [
        ("--help",),
        ("--version",),
        *((verb, "--help") for verb in ("plan", "simulate", "speed", "drive", "laws")),
    ],
)
def test_help_is_instant_because_it_imports_nothing_heavy(words: tuple[str, ...]) -> None:
    code = (
        f"import sys; sys.argv = ['lampyris', *{words!r}]\n"
        "from lampyris.cli import main\n"
        "try:\n    main()\nexcept SystemExit as e:\n    assert not e.code, e.code\n"
        "heavy = set('numpy numba scipy matplotlib PIL'.split()) & set(sys.modules)\n"
        "assert not heavy, heavy\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_a_small_plan_imports_no_numba() -> None:
    code = (
        "import sys, lampyris\n"
        "g = lampyris.load_grid('guide')\n"
        "p = lampyris.plan(lampyris.Scene(g, (0, 9), (7, 0), moves='dissertation'))\n"
        "assert p.cost == 12.4, p.cost\n"
        "assert 'numba' not in sys.modules and 'matplotlib' not in sys.modules\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_planners_are_listed_with_their_traits() -> None:
    table = lampyris.list_planners()
    assert {"ad-gso", "astar", "dijkstra"} <= set(table)
    assert table["astar"].traits.optimal
    assert not table["ad-gso"].traits.optimal


def test_every_public_name_can_be_had() -> None:
    for name in lampyris.__all__:
        assert getattr(lampyris, name) is not None
    with pytest.raises(AttributeError):
        _ = lampyris.no_such_thing


def test_the_distribution_is_typed_and_licensed() -> None:
    assert (PACKAGE / "py.typed").exists()
    assert distribution("lampyris").metadata["License-Expression"] == "MIT"


@pytest.mark.source
def test_no_tracked_file_names_this_machine_or_a_package_host() -> None:
    done = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, check=False)
    if done.returncode != 0:
        pytest.skip("not a git checkout")
    forbidden = [
        str(ROOT) + "/",
        str(Path.home()) + "/",
        "--index" + "-url",
        "--extra-index" + "-url",
        "--find" + "-links",
    ]
    for name in done.stdout.decode().split("\0"):
        path = ROOT / name
        if not name or path.suffix in {".png", ".npy", ".webp"} or not path.is_file():
            continue
        text = path.read_text(encoding="utf-8", errors="replace")
        hits = [word for word in forbidden if word in text]
        assert not hits or (name == "tools/compile_requirements.sh"), f"{name}: {hits}"

"""The page's modules have the types that their comments say: tsc --checkJs. Skipped where there is no tsc.

``tsc -p tests/app/tsconfig.json`` is the same by hand, with TypeScript 5. The distribution's may be 4.8,
which reads a tag of a comment only at the beginning of a line, so that it is given copies with a tag a line.
"""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from importlib.resources import files
from pathlib import Path
from typing import Any

import pytest

TSC = shutil.which("tsc")
pytestmark = pytest.mark.skipif(
    TSC is None, reason="tsc is not installed: the types of the page's modules were not checked"
)
ONE_TAG_A_LINE = 5
"""The first TypeScript that reads a tag wherever it stands."""
COMMENT = re.compile(r"/\*\*.*?\*/", re.DOTALL)
TAG = re.compile(r"(?<=[^\s*{]) @(?=(?:param|returns|type|typedef|template)\b)")
STREAM = "{ constructor(form: string); readable: ReadableStream; writable: WritableStream; }"
STREAMS = f"declare class CompressionStream {STREAM}\ndeclare class DecompressionStream {STREAM}\n"
"""What browsers have and the older TypeScript does not know."""
NEWER = {"AbortSignal.timeout(": "(/** @type {(ms: number) => AbortSignal} */ (/** @type {any} */ (0)))("}
"""The same of what it knows, but not with all that it has: said so that its type is the right one."""
ERROR = re.compile(r"^(?:.*/)?([a-z]+\.js)\((\d+),(\d+)\): (.*)$", re.MULTILINE)


def version() -> int:
    """Of tsc, the first number."""
    said = subprocess.run(
        [str(TSC), "--version"], capture_output=True, text=True, check=True, timeout=60
    ).stdout
    found = re.search(r"(\d+)\.", said)
    assert found, said
    return int(found[1])


def tag_a_line(text: str) -> tuple[str, list[int]]:
    """The same with each tag on a line of its own, and which line each line was."""
    spread = COMMENT.sub(lambda found: TAG.sub("\0 * @", found[0]), text)
    for newer, known in NEWER.items():
        spread = spread.replace(newer, known)
    lines, was = [], []
    for number, line in enumerate(spread.split("\n"), 1):
        for part in line.split("\0"):
            lines.append(part)
            was.append(number)
    return "\n".join(lines), was


def complaints(modules: dict[str, str], folder: Path) -> list[str]:
    """What tsc says of these modules, with the lines of the originals."""
    older = version() < ONE_TAG_A_LINE
    was: dict[str, list[int]] = {}
    for name, text in modules.items():
        given, was[name] = tag_a_line(text) if older else (text, list(range(1, text.count("\n") + 2)))
        (folder / name).write_text(given, "utf-8")
    if older:
        (folder / "newer.d.ts").write_text(STREAMS)
    config = json.loads(Path(__file__).with_name("tsconfig.json").read_text())
    # The older one takes `a ||= b` for no use of a.
    options = {**config["compilerOptions"], **({"noUnusedLocals": False} if older else {})}
    own = {"compilerOptions": options, "include": ["*.js", "*.d.ts"]}
    (folder / "tsconfig.json").write_text(json.dumps(own))
    done = subprocess.run(
        [str(TSC), "-p", str(folder), "--pretty", "false"],
        capture_output=True,
        text=True,
        check=False,
        timeout=300,
    )

    def at_home(found: re.Match[str]) -> str:
        return f"{found[1]}:{was[found[1]][int(found[2]) - 1]}: {found[4]}"

    said = ERROR.sub(at_home, done.stdout).splitlines()
    assert (done.returncode == 0) == (not said), (done.stdout, done.stderr)
    return said


def page_modules() -> dict[str, str]:
    """All of them but uPlot, which is not ours; those of replays as if they were in the same folder."""
    found: dict[str, Any] = {
        file.name: file.read_text("utf-8").replace('"../static/', '"./')
        for folder in ("static", "replay")
        for file in files("lampyris.app").joinpath(folder).iterdir()
        if file.name.endswith(".js") and file.name != "uplot.js"
    }
    return found


@pytest.mark.nightly
def test_the_modules_of_the_page_keep_their_types_and_a_wrong_one_is_found(tmp_path: Path) -> None:
    """Beside them two modules with two mistakes, which are found where they stand: tsc has read its files."""
    modules = page_modules()
    assert len(modules) > 30
    one = "/** Half. @param {number} n @returns {number} */\nexport function half(n) {\n  return n / 2;\n}\n"
    two = 'import { half } from "./one.js";\nhalf(4);\nhalf("4");\n/** @type {string} */\n'
    two += "export const s = half(4);\n"
    assert not modules.keys() & {"one.js", "two.js"}
    said = complaints({**modules, "one.js": one, "two.js": two}, tmp_path)
    assert [line.split(" error")[0] for line in said] == ["two.js:3:", "two.js:5:"], "\n".join(said)


def test_lines_are_counted_as_in_the_originals() -> None:
    text = (
        "a\n/** What. @param {number} x of it @returns {string} */\nb\n/**\n * @type {string}\n */\nc @type d"
    )
    spread, was = tag_a_line(text)
    assert spread.split("\n")[:4] == [
        "a",
        "/** What.",
        " * @param {number} x of it",
        " * @returns {string} */",
    ]
    assert spread.split("\n")[-1] == "c @type d", "only comments are changed"
    assert was == [1, 2, 2, 2, 3, 4, 5, 6, 7]

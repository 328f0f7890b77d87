"""Find what could give another answer on another machine, in code that decides.

    python tools/lint_determinism.py

Allowed in such code are whole numbers, ``+ - * /`` and ``sqrt`` on floats (IEEE 754 defines them to the last
bit), raw draws of PCG64 from a SeedSequence, and :mod:`lampyris._core.elementary` for exp, log, sin, cos and atan2.
Each finding is told as ``file:line: rule: what; why; instead``; exit 1 if there are any.

An exception is said where it is, ``# bits: reason`` on one of its lines, or for a whole file in
:data:`EXCEPTIONS`. An exception that excuses nothing is a finding too.

The lint reads one file at a time and knows no types but those that are written there: sets by how they are
made, by annotation and by attributes annotated anywhere in the rooms. It is a net with known meshes; the
check ``lampyris selfcheck determinism`` is the other one.
"""

from __future__ import annotations

import argparse
import ast
import gc
import io
import re
import sys
import tokenize
from functools import cache
from pathlib import Path

from determinism_rules import Finding, Reader
from determinism_sets import said_sets

SOURCE = Path(__file__).resolve().parents[1] / "src" / "lampyris"

ROOMS = (
    "kernels", "planning", "motion", "sim", "model", "io", "study", "scenarios.py", "api.py", "movingai.py",
    "_core/elementary.py", "_core/values.py", "_core/arrays.py",
)  # fmt: skip
"""What decides: rooms and modules of the package.

Not the referee: what it asks has a slack a million times wider than a last bit. Not what draws, prints and
serves."""

_MEASURED = "how long it took is told, and decides nothing"
_LIMITED = "a time limit that the user set; what is not found by then is said to be so"
_WAITED = "how long to wait for others; which run comes back first does not show"
_COUNTED = "whole numbers"
_TOLD = "figures about results, for the reader; no run hangs on them"

EXCEPTIONS: dict[tuple[str, str], str] = {
    **dict.fromkeys(
        (
            (file, "time")
            for file in (
                "api.py", "movingai.py", "kernels/loading.py", "kernels/_helpers.py", "kernels/_machine.py",
                "sim/continuous/drive.py", "sim/continuous/replanner.py", "sim/grid/loop.py",
                "sim/grid/compiled_ticks.py",
                "planning/incremental/session.py", "planning/graph/jps_search.py", "planning/graph/session.py",
                "planning/map_models/polyanya_search.py",
                "planning/sampling/session.py",
                "planning/spacetime/session.py", "planning/swarm/session.py", "planning/swarm/step_session.py",
                "study/execution/fleets/fleet_runs.py",
            )
        ),
        _MEASURED,
    ),
    ("study/execution/worker.py", "time"): _LIMITED,
    **dict.fromkeys(((f"study/execution/{name}.py", "time") for name in ("cluster", "pool", "run")), _WAITED),
    **dict.fromkeys((("study/analysis/compare.py", "bits"), ("study/analysis/compare.py", "scipy")), _TOLD),
    ("study/analysis/summary_tables.py", "bits"): _TOLD,
    ("study/execution/eta.py", "sum"): "how long it will take, told meanwhile",
    ("kernels/_jit.py", "sum"): _COUNTED,
    **dict.fromkeys(
        (
            (f"study/{name}.py", "sum")
            for name in (
                "execution/evidence", "execution/pool", "design/config",
            )
        ),
        _COUNTED,
    ),
}  # fmt: skip
"""Why a rule does not hold in a file: (file, rule) to reason."""

MARK = re.compile(r"#\s*bits:\s*(\S.*)?$")


def marks(text: str) -> dict[int, str]:
    """Reasons given in a file, by line."""
    found: dict[int, str] = {}
    if "bits:" not in text:
        return found  # most files give none, and tokens take a third of the time
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type == tokenize.COMMENT and (mark := MARK.search(token.string)):
            found[token.start[0]] = (mark.group(1) or "").strip()
    return found


@cache
def parsed(text: str, file: str) -> ast.Module:
    """A file's tree, which is read twice."""
    return ast.parse(text, file)


def lint(
    text: str, file: str, attributes: frozenset[str] = frozenset()
) -> tuple[list[Finding], set[tuple[str, str]]]:
    """Findings of one file, and the entries of :data:`EXCEPTIONS` that excused something."""
    tree = parsed(text, file)
    reasons = marks(text)
    left: list[Finding] = []
    used: set[int] = set()
    excused: set[tuple[str, str]] = set()
    for one in Reader(file, attributes or said_sets([tree])).read(tree):
        said = [line for line in range(one.line, one.last + 1) if reasons.get(line)]
        if said:
            used.update(said)
        elif (file, one.rule) in EXCEPTIONS:
            excused.add((file, one.rule))
        else:
            left.append(one)
    for line, reason in sorted(reasons.items()):
        if line not in used:
            what = "excuses nothing" if reason else "no reason given"
            left.append(Finding(file, line, "mark", "# bits:", what, "take it out, or say why"))
    return sorted(set(left)), excused


def files(source: Path = SOURCE) -> list[Path]:
    """The modules that decide."""
    found = [path for room in ROOMS for path in (source / room,) if path.is_file()]
    found += [path for room in ROOMS for path in (source / room).rglob("*.py")]
    return sorted(found)


def lint_all(source: Path = SOURCE) -> list[Finding]:
    """Findings of all rooms."""
    texts = {str(path.relative_to(source)): path.read_text(encoding="utf-8") for path in files(source)}
    attributes = said_sets([parsed(text, file) for file, text in texts.items()])
    found: list[Finding] = []
    excused: set[tuple[str, str]] = set()
    for file, text in texts.items():
        left, some = lint(text, file, attributes)
        found += left
        excused |= some
    for file, rule in sorted(set(EXCEPTIONS) - excused):
        found.append(Finding(file, 0, "mark", f"exception of {rule!r}", "excuses nothing", "take it out"))
    return sorted(found)


def main() -> int:
    """Print the findings; 1 if there are any."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--source", type=Path, default=SOURCE, help="the package's folder")
    gc.disable()  # millions of nodes that all stay: looking for garbage among them takes as long as the rest
    found = lint_all(parser.parse_args().source)
    for one in found:
        print(f"src/lampyris/{one}")
    print(f"{len(found)} findings in {len(files())} files")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())

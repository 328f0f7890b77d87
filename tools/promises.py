"""Keep docs/promises.md: every goal, its command, and what was last measured.

::

    python tools/promises.py page            # docs/promises.md from the .toml and .jsonl beside it
    python tools/promises.py run G19 G25     # run the commands of these goals and record what came of them
    python tools/promises.py run all

The checks of ``lampyris selfcheck`` record themselves (``--record docs/promises.jsonl``); goals that tests or
a tool prove are run and counted here. Nothing on the page is written by hand.
"""

from __future__ import annotations

import datetime
import json
import os
import shlex
import subprocess
import sys
import tempfile
import time
import tomllib
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
GOALS = ROOT / "docs" / "promises.toml"
RECORDS = ROOT / "docs" / "promises.jsonl"
PAGE = ROOT / "docs" / "promises.md"
SIZES = ("part", "commit", "nightly", "release")

HEAD = """# What is promised, and what was measured

Each line is a goal, the command that proves it, and what that command last said on two cores of a shared
machine. A check of `lampyris selfcheck` asks seeded questions and has every answer judged by a stranger: a
slow twin that shares no code with what it judges, the referee, a published figure. It exits with 0 only if
nothing failed, prints a failing case so that it can be run again, and goes on where it was stopped
(`--ledger FILE`). "0 of n" proves, at 95 % confidence, that fewer than 3/n of such cases fail: the bound.
Exhaustive kinds prove all there is. `commit` sizes are part of `make test`, `nightly` of
`make check-nightly`.

This page is made by `python tools/promises.py page` from `promises.toml` and `promises.jsonl`; `code` is the
state of the package that was measured (`lampyris selfcheck --json` prints it).

"""


def goals() -> list[dict[str, Any]]:
    """The goals, in order."""
    return tomllib.loads(GOALS.read_text(encoding="utf-8"))["goal"]


def records() -> list[dict[str, Any]]:
    """What was recorded, oldest first."""
    if not RECORDS.exists():
        return []
    return [json.loads(line) for line in RECORDS.read_text(encoding="utf-8").splitlines()]


# ---- the page ------------------------------------------------------------------------------------------


def page() -> str:
    """The text of docs/promises.md."""
    known = records()
    lines = [HEAD, "| | Goal | Command | Measured | |", "|---|---|---|---|---|"]
    lines += [_row(goal, known) for goal in goals()]
    lines += ["", "## Figures behind the table", ""]
    for goal in goals():
        lines += _details(goal, known)
    return "\n".join(lines).rstrip() + "\n"


def _last(goal: dict[str, Any], known: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The goal's last record of each size and choice of kinds, smallest first."""
    mine = [r for r in known if r.get("goal") == goal["id"] or r.get("check") == goal.get("check")]
    last = {(r.get("size", ""), tuple(r.get("kinds", ()))): r for r in mine}
    return sorted(last.values(), key=lambda r: (SIZES.index(r["size"]) if r.get("size") else -1, r["cases"]))


def _row(goal: dict[str, Any], known: list[dict[str, Any]]) -> str:
    found = _last(goal, known)
    measured = "<br>".join(_figure(r) for r in found) or "not run yet"
    notes = goal.get("blank", "")
    command = f"`{goal['command']}`"
    return f"| {goal['id']} | {goal['must']} | {command} | {measured} | {notes} |"


def _figure(record: dict[str, Any]) -> str:
    size = record.get("size", "")
    kinds = record.get("kinds") or {}
    only = f" {', '.join(kinds)}" if record.get("only") else ""
    if "percent" in record:
        return f"{record['percent']:.1f} % in {_time(record['seconds'])}, {record['date']}"
    failures = record["failures"]
    said = f"{failures:,} failures" if not failures else f"**{failures:,} failures**"
    bound = f" (bound {record['bound']:.1e})" if record.get("bound") and record["cases"] >= 1000 else ""
    words = f"{size}{only}: " if size else ""
    return f"{words}{record['cases']:,} cases, {said}{bound}, {_time(record['seconds'])}, {record['date']}"


def _time(seconds: float) -> str:
    if seconds < 120:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min"


def _details(goal: dict[str, Any], known: list[dict[str, Any]]) -> list[str]:
    found = [r for r in _last(goal, known) if "kinds" in r]
    if not found:
        return []
    lines = [f"**{goal['id']}, `{goal['check']}`**", ""]
    for record in found:
        kinds = ", ".join(f"{name} {k['cases']:,}" for name, k in record["kinds"].items())
        lines.append(
            f"- {record['size']}, seed {record['seed']}, {record['date']}, code `{record['code']}`, "
            f"{record['workers']} workers, {_time(record['seconds'])} of work: {kinds}"
        )
        if record["counts"]:
            lines.append("  - seen: " + ", ".join(f"{name} {n:,}" for name, n in record["counts"].items()))
        for name, values in record["spreads"].items():
            lines.append(f"  - {name}: " + ", ".join(f"{word} {v:.3g}" for word, v in values.items()))
        lines += [f"  - **failed**: `{f['command']}`: {f['what']}" for f in record["failed"]]
    return [*lines, ""]


# ---- running -------------------------------------------------------------------------------------------


def run(names: list[str]) -> int:
    """Run the commands of goals; the number of those that do not hold."""
    chosen = [goal for goal in goals() if "all" in names or goal["id"] in names]
    missing = set(names) - {"all"} - {goal["id"] for goal in chosen}
    if missing:
        sys.exit(f"no goal is called {', '.join(sorted(missing))}; allowed: G1..G30, all")
    broken = 0
    for goal in chosen:
        print(f"{goal['id']}: {goal['command']}", flush=True)
        holds = _run(goal)
        print(f"{goal['id']}: {'holds' if holds else 'BROKEN'}", flush=True)
        broken += not holds
    PAGE.write_text(page(), encoding="utf-8")
    return broken


def _run(goal: dict[str, Any]) -> bool:
    words = shlex.split(goal["command"])
    if words[:2] == ["lampyris", "selfcheck"]:
        words = [sys.executable, "-m", *words, "--record", str(RECORDS)]
        return subprocess.run(words, cwd=ROOT, check=False).returncode == 0
    if words[:2] == ["python", "-m"]:
        return _tests(goal, words[2:])
    began = time.monotonic()
    if words[0] == "python":
        words[0] = sys.executable
    done = subprocess.run(words, cwd=ROOT, check=False, stdout=subprocess.PIPE, text=True)
    print(done.stdout[-2000:], end="")
    record = {"goal": goal["id"], "seconds": round(time.monotonic() - began, 1), "date": _today()}
    told = [json.loads(line[9:]) for line in done.stdout.splitlines() if line.startswith("MEASURED ")]
    for figure in told or [{"cases": 1, "failures": int(done.returncode != 0)}]:
        _keep(record | figure)
    return done.returncode == 0


def _tests(goal: dict[str, Any], words: list[str]) -> bool:
    """Run a part of the test suite; its cases are its tests, counted by pytest itself."""
    began = time.monotonic()
    with tempfile.TemporaryDirectory() as folder:
        report = Path(folder) / "tests.xml"
        command = [sys.executable, "-m", *words, f"--junitxml={report}", "-p", "no:cacheprovider"]
        done = subprocess.run(command, cwd=ROOT, check=False, env=os.environ | {"PYTEST_ADDOPTS": ""})
        suite = ElementTree.parse(report).getroot()[0].attrib if report.exists() else {}
    number = {key: int(suite.get(key, 0)) for key in ("tests", "failures", "errors", "skipped")}
    failures = number["failures"] + number["errors"]
    cases = number["tests"] - number["skipped"]
    record = {"goal": goal["id"], "cases": cases, "failures": failures, "bound": None}
    _keep(record | {"seconds": round(time.monotonic() - began, 1), "date": _today()})
    return done.returncode == 0 and cases > 0


def _keep(record: dict[str, Any]) -> None:
    with RECORDS.open("a", encoding="utf-8") as file:
        file.write(json.dumps(record) + "\n")


def _today() -> str:
    return datetime.datetime.now(datetime.UTC).date().isoformat()


def main() -> int:
    """Do what the command line says."""
    match sys.argv[1:]:
        case ["page"]:
            PAGE.write_text(page(), encoding="utf-8")
            return 0
        case ["run", *names] if names:
            return min(run(names), 1)
    print(__doc__)
    return 2


if __name__ == "__main__":
    sys.exit(main())

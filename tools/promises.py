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
from collections import Counter
from pathlib import Path
from typing import Any

from lampyris_selfcheck import registry
from lampyris_selfcheck.check import Ask
from lampyris_selfcheck.ledger import append

RENAMED = {"dearer": "costlier"}
"""Labels of counts in records of earlier versions, by their present names."""
ROOT = Path(__file__).resolve().parents[1]
GOALS = ROOT / "docs" / "promises.toml"
RECORDS = ROOT / "docs" / "promises.jsonl"
PAGE = ROOT / "docs" / "promises.md"
SIZES = ("part", "commit", "nightly", "release")
NAMED = {"Python": "python", "NumPy": "numpy"}

HEAD = """# What is promised, and what was measured

Each line is a goal, the command that tries it, and what was last measured, size by size, on two cores of a
shared machine. A check of `lampyris selfcheck` asks seeded questions and has the answers judged by code that
is independent of what is tested: a slow reference, the referee, a published figure; or by the bytes, the clock,
the exit code. It exits with 0 only if nothing failed, prints the command that asks a failing case again,
and goes on where it was stopped (`--ledger FILE`). Of n drawn cases none failing says, at 95 % confidence,
that fewer than 3/n of such cases fail: the bound, shown where 1,000 cases ran, of which only the drawn ones
count in it. All records have the seed that development used too: another is `--seed`. Exhaustive kinds
leave nothing open. `commit` sizes are part of `make test` (those that `tests/selfcheck/test_promises.py` leaves
to the night of `make check-nightly`), `nightly` of `make check-nightly`, save published `.scen` files, which
need `--folder`.

This page is made by `python tools/promises.py page` from `promises.toml` and `promises.jsonl`; `code` is the
state of the package that a check measured (`lampyris selfcheck --json` prints it), and *earlier code* is any
but that of the newest record; goals that tests prove have a date alone.

"""


def goals() -> list[dict[str, Any]]:
    """The goals, in order."""
    return tomllib.loads(GOALS.read_text(encoding="utf-8"))["goal"]


def records() -> list[dict[str, Any]]:
    """What was recorded, oldest first; half a line, left by a killed run, is told and passed over."""
    if not RECORDS.exists():
        return []
    found = []
    for number, line in enumerate(RECORDS.read_text(encoding="utf-8").splitlines(), 1):
        try:
            found.append(json.loads(line))
        except ValueError:
            print(f"{RECORDS}, line {number}: half a record, passed over: {line[:60]}", file=sys.stderr)
    return found


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


def _of(goal: dict[str, Any], record: dict[str, Any]) -> dict[str, Any] | None:
    """What a record says of the goal; None: nothing. A goal with ``kinds`` has the figures of these alone."""
    if record.get("goal") == goal["id"]:
        return record
    if "check" not in goal or record.get("check") != goal["check"]:
        return None
    if "kinds" not in goal:
        return record
    # Records made before the figures of kinds were kept: what failed may be of any kind.
    old = {"failures": record["failures"], "drawn": False, "seconds": record["seconds"]}
    old |= {"counts": {}, "spreads": {}}
    kinds = {name: old | kind for name, kind in record["kinds"].items() if name in goal["kinds"]}
    if not kinds:
        return None
    figures = list(kinds.values())
    drawn = sum(kind["cases"] for kind in figures if kind["drawn"])
    failures = min(sum(kind["failures"] for kind in figures), record["failures"])
    lacks = [
        what for what in record.get("lacks", ()) if what.startswith(tuple(f"{name}: " for name in kinds))
    ]
    return record | {
        "kinds": kinds,
        "cases": sum(kind["cases"] for kind in figures),
        "failures": failures,
        "lacks": lacks,
        "holds": not failures and not lacks,
        "seconds": min(sum(kind["seconds"] for kind in figures), record["seconds"]),
        "bound": min(1.0, 3 / drawn) if drawn and not failures and not lacks else None,
        "counts": dict(sum((Counter(kind["counts"]) for kind in figures), Counter())),
        "spreads": {word: told for kind in figures for word, told in kind["spreads"].items()},
        "failed": [one for one in record["failed"] if one.get("kind", "") in {"", *kinds}],
    }


def _last(goal: dict[str, Any], known: list[dict[str, Any]]) -> list[list[dict[str, Any]]]:
    """The goal's last record of each size, seed and choice of kinds, smallest first.

    Of pieces of a run (``--first``, ``--cases``) those of one code without a case in common stand together.
    A record is left out where a later one has all its cases, and other kinds too.
    """
    last: dict[Any, list[dict[str, Any]]] = {}
    for record in known:
        mine = _of(goal, record)
        if mine is None:
            continue
        key = (mine.get("size", ""), mine.get("seed"), tuple(mine.get("kinds", ())))
        for old in [old for old, pieces in last.items() if old[:2] == key[:2] and _covers(mine, pieces)]:
            del last[old]
        others = last.get(key, []) if mine.get("size") == "part" else []
        last[key] = [one for one in others if one["code"] == mine["code"] and _disjoint(one, mine)] + [mine]
    return sorted(last.values(), key=lambda pieces: (_rank(pieces[0]), sum(one["cases"] for one in pieces)))


def _rank(record: dict[str, Any]) -> int:
    return SIZES.index(record["size"]) if record.get("size") else -1


def _covers(record: dict[str, Any], pieces: list[dict[str, Any]]) -> bool:
    """Whether a record of a whole size has every case of these."""
    kinds = record.get("kinds", {})
    return record.get("size", "part") != "part" and all(
        name in kinds and kinds[name]["cases"] >= kind["cases"]
        for one in pieces
        for name, kind in one["kinds"].items()
    )


def _disjoint(one: dict[str, Any], other: dict[str, Any]) -> bool:
    """Whether two pieces have no case in common."""
    return all(
        kind["first"] + kind["cases"] <= then["first"] or then["first"] + then["cases"] <= kind["first"]
        for kind, then in ((kind, other["kinds"][name]) for name, kind in one["kinds"].items())
    )


def _sum(pieces: list[dict[str, Any]]) -> dict[str, Any]:
    """Pieces as one record, as far as the table tells of it."""
    if len(pieces) == 1:
        return pieces[0]
    failures = sum(one["failures"] for one in pieces)
    drawn = sum(kind["cases"] for one in pieces for kind in one["kinds"].values() if kind.get("drawn"))
    lacks = [what for one in pieces for what in one.get("lacks", ())]
    return pieces[-1] | {
        "cases": sum(one["cases"] for one in pieces),
        "failures": failures,
        "lacks": lacks,
        "seconds": sum(one["seconds"] for one in pieces),
        "bound": min(1.0, 3 / drawn) if drawn and not failures and not lacks else None,
    }


def _row(goal: dict[str, Any], known: list[dict[str, Any]]) -> str:
    found = _last(goal, known)
    newest = next((record["code"] for record in reversed(known) if "code" in record), "")
    told = [_figure(_sum(pieces)) + _age(pieces, newest) for pieces in found]
    measured = "<br>".join([*told, *_lacking(goal, found)]) if told else "not run yet"
    notes = goal.get("blank", "")
    command = f"`{goal['command']}`"
    return f"| {goal['id']} | {goal['must']} | {command} | {measured} | {notes} |"


def _age(pieces: list[dict[str, Any]], newest: str) -> str:
    """A word, if a record is not of the newest code."""
    return ", *earlier code*" if any(one.get("code", newest) != newest for one in pieces) else ""


def _lacking(goal: dict[str, Any], found: list[list[dict[str, Any]]]) -> list[str]:
    """What the goal's command would run that no record has."""
    words = goal["command"].split()
    if "check" not in goal or "--size" not in words:
        return []
    size = words[words.index("--size") + 1]
    # Kinds that need a folder of files are those of the records.
    kinds = registry.check(goal["check"]).kinds_for(Ask())
    asked = {name for name, kind in kinds.items() if name in goal.get("kinds", kinds) and kind.cases(size)}
    ran = {name for pieces in found if pieces[0].get("size") == size for name in pieces[0]["kinds"]}
    if not ran:
        return [f"{size}: not run yet"]
    return [f"{size}, not run yet: {', '.join(sorted(asked - ran))}"] if asked - ran else []


def _figure(record: dict[str, Any]) -> str:
    size = record.get("size", "")
    kinds = record.get("kinds") or {}
    only = f" {', '.join(kinds)}" if record.get("only") else ""
    failures = record["failures"]
    said = f"**{failures:,} failures**" if failures else "0 failures"
    if record.get("lacks"):
        said += f", **{'; '.join(record['lacks'])}**"
    if record.get("skipped"):
        said += f", {record['skipped']:,} skipped"
    if "percent" in record:
        ill = f", {said}" if failures else ""
        return f"{record['percent']:.1f} %{ill} in {_time(record['seconds'])}, {record['date']}"
    bound = f" (bound {record['bound']:.1e})" if record.get("bound") and record["cases"] >= 1000 else ""
    words = f"{size}{only}: " if size else ""
    # Of all workers; how long it took stands below the table.
    work = _time(record["seconds"]) + (" of work" if kinds else "")
    cases = "1 case" if record["cases"] == 1 else f"{record['cases']:,} cases"
    return f"{words}{cases}, {said}{bound}, {work}, {record['date']}"


def _time(seconds: float) -> str:
    if seconds < 120:
        return f"{seconds:.0f} s" if seconds >= 1 else "under 1 s"
    return f"{seconds / 60:.0f} min"


def _details(goal: dict[str, Any], known: list[dict[str, Any]]) -> list[str]:
    found = [r for pieces in _last(goal, known) for r in pieces if "kinds" in r]
    if not found:
        return []
    lines = [f"**{goal['id']}, `{goal['check']}`**", ""]
    for record in found:
        kinds = ", ".join(_range(name, kind) for name, kind in record["kinds"].items())
        lines.append(
            f"- {record['size']}, seed {record['seed']}, {record['date']}, code `{record['code']}`, "
            f"{record['workers']} workers, {_time(record['seconds'])} of work{_surroundings(record)}: {kinds}"
        )
        if record["counts"]:
            named = ((RENAMED.get(name, name), n) for name, n in record["counts"].items())
            lines.append("  - seen: " + ", ".join(f"{name} {n:,}" for name, n in named))
        for name, values in record["spreads"].items():
            lines.append(f"  - {name}: " + ", ".join(f"{word} {float(v):.3g}" for word, v in values.items()))
        lines += [f"  - **too few**: {what}" for what in record.get("lacks", ())]
        lines += [f"  - **failed**: `{f['command']}`: {f['what']}" for f in record["failed"]]
    return [*lines, ""]


def _range(name: str, kind: dict[str, Any]) -> str:
    """A kind's cases; of a piece from which number on."""
    return f"{name} {kind['cases']:,}" + (f" from {kind['first']:,} on" if kind["first"] else "")


def _surroundings(record: dict[str, Any]) -> str:
    """Python and NumPy, and the seconds that went by, where the record has them."""
    wall = f" in {_time(record['wall'])}" if "wall" in record else ""
    there = record.get("versions", {})
    return wall + "".join(f", {word} {there[name]}" for word, name in NAMED.items() if name in there)


# ---- running -------------------------------------------------------------------------------------------


def run(names: list[str]) -> int:
    """Run the commands of goals; the number of those that do not hold."""
    chosen = [goal for goal in goals() if "all" in names or goal["id"] in names]
    known = [goal["id"] for goal in goals()]
    missing = set(names) - {"all", *known}
    if missing:
        sys.exit(f"no goal is called {', '.join(sorted(missing))}; allowed: {known[0]}..{known[-1]}, all")
    broken = 0
    ran: dict[str, bool] = {}
    for goal in chosen:
        command = _with_folder(goal["command"])
        if command is None:
            print(f"{goal['id']}: cannot be run: LAMPYRIS_SHARED and ../shared are no folder", flush=True)
            broken += goal["id"] in names
            continue
        print(f"{goal['id']}: {command}", flush=True)
        if command not in ran:  # Two goals may share a check, which serves them both.
            ran[command] = _run(goal, command)
        print(f"{goal['id']}: {'holds' if ran[command] else 'BROKEN'}", flush=True)
        broken += not ran[command]
    PAGE.write_text(page(), encoding="utf-8")
    return broken


def _with_folder(command: str) -> str | None:
    """The command with a folder of this machine for ``DIR``; None if there is none."""
    words = shlex.split(command)
    if "DIR" not in words:
        return command
    folder = Path(os.environ.get("LAMPYRIS_SHARED") or ROOT.parent / "shared").resolve()
    return shlex.join(str(folder) if word == "DIR" else word for word in words) if folder.is_dir() else None


def _run(goal: dict[str, Any], command: str) -> bool:
    words = shlex.split(command)
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
    for figure in told or [{"cases": 1, "failures": 0}]:
        figure["failures"] = max(figure["failures"], int(done.returncode != 0))
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
    cases = number["tests"] - number["skipped"]
    failures = max(number["failures"] + number["errors"], int(done.returncode != 0 or not cases))
    record = {"goal": goal["id"], "cases": cases, "failures": failures, "skipped": number["skipped"]}
    _keep(record | {"seconds": round(time.monotonic() - began, 1), "date": _today()})
    return done.returncode == 0 and cases > 0


def _keep(record: dict[str, Any]) -> None:
    append(RECORDS, record)


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

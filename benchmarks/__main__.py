"""Run benchmarks, each in a process of its own; write the page and the record.

    python -m benchmarks [NAME ...] [--quick] [--page FILE] [--json FILE]

With names, only those run, and what the record holds of the others stays as it is.
"""

from __future__ import annotations

import argparse
import datetime
import importlib
import json
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

from benchmarks.about import machine
from benchmarks.limits import unanswered
from benchmarks.page import page

NAMES = (
    "field",
    "weighted",
    "repair",
    "query",
    "timed",
    "poses",
    "pose_maps",
    "pose_rivals",
    "sampling",
    "fleets",
    "steering",
    "speed",
    "study",
    "calls",
    "start",
    "first",
    "memory",
    "scaling",
)


def main() -> int:
    """Run, print, write. A verdict never changes the exit code: a benchmark informs, it does not gate."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"of {', '.join(NAMES)}; all if none")
    parser.add_argument("--quick", action="store_true", help="fewer maps and rounds")
    parser.add_argument("--page", type=Path, help="write the page there")
    parser.add_argument("--json", type=Path, help="write, or bring up to date, the record there")
    parser.add_argument("--into", type=Path, help=argparse.SUPPRESS)
    given = parser.parse_args()
    unknown = [name for name in given.names if name not in NAMES]
    if unknown:
        parser.error(f"no benchmark is called {', '.join(unknown)}; there are {', '.join(NAMES)}")
    if given.into:
        _one(given.names[0], given.quick, given.into)
        return 0
    known: dict[str, dict[str, Any]] = {}
    if given.json and given.json.exists():
        known = {r["name"]: r for r in json.loads(given.json.read_text(encoding="utf-8"))["sections"]}
    failed = []
    began = time.monotonic()
    for name in given.names or NAMES:
        print(f"== {name}", flush=True)
        record = _in_its_own_process(name, given.quick)
        if record is None:
            failed.append(name)
            continue
        known[name] = record
        # After each, for a run of an hour that is stopped must not have been for nothing.
        _write(known, given.json, given.page)
    print(f"took {time.monotonic() - began:.0f} s", flush=True)
    measured = [known[name] for name in given.names or NAMES if name in known]
    short = sum(not verdict["holds"] for record in measured for verdict in record["verdicts"])
    left = unanswered(measured)
    print(f"{short} claims SHORT, {len(left)} of them without a limit and a claim in their place that holds")
    print("\n".join(f"  {one}" for one in left), end="\n" if left else "", flush=True)
    if failed:
        print(f"could not measure: {', '.join(failed)}", file=sys.stderr)
    return 1 if failed else 0


def _one(name: str, quick: bool, into: Path) -> None:
    module = importlib.import_module(f"benchmarks.bench_{name}")
    about = machine()
    began = time.monotonic()
    found = module.bench(quick)
    about |= found.about
    about["date"] = datetime.datetime.now(tz=datetime.UTC).date().isoformat()
    about["took"] = f"{time.monotonic() - began:.0f} s" + (" (quick)" if quick else "")
    record = replace(found, name=name, about=about).record()
    for verdict in record["verdicts"]:
        print(("HOLDS  " if verdict["holds"] else "SHORT  ") + verdict["text"], flush=True)
    into.write_text(json.dumps(record) + "\n", encoding="utf-8")


def _in_its_own_process(name: str, quick: bool) -> dict[str, Any] | None:
    with tempfile.TemporaryDirectory() as folder:
        into = Path(folder) / "record.json"
        command = [
            sys.executable,
            "-m",
            "benchmarks",
            name,
            "--into",
            str(into),
            *(["--quick"] if quick else []),
        ]
        if subprocess.run(command, check=False).returncode != 0:
            return None
        record: dict[str, Any] = json.loads(into.read_text(encoding="utf-8"))
        return record


def _write(known: dict[str, dict[str, Any]], record: Path | None, to: Path | None) -> None:
    sections = [known[name] for name in NAMES if name in known]
    if record:
        record.write_text(json.dumps({"sections": sections}, indent=1) + "\n", encoding="utf-8")
    if to:
        to.write_text(page(sections), encoding="utf-8")


if __name__ == "__main__":
    sys.exit(main())

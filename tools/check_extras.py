"""Each extra of the package in a fresh environment of its own: time and size of the installation, and what it is for.

    python tools/check_extras.py [--wheel FILE] [--folder DIR] [EXTRA ...]

For each extra the wheel is installed with it into a new environment. There its use is called and must work, and
`import lampyris` with a plan must import nothing that the extra brought. In an environment without any extra the same use
must end in one sentence that names the command. It needs a package index; environments stay in the folder for a look.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
STUDY = """
version: 1
name: s
kind: plan
maps:
  - {bundled: env-1, queries: {random: 6, least: 20}}
planners:
  - {name: ad-gso}
"""
LOOPBACK = (
    "<CycloneDDS><Domain><General><Interfaces><NetworkInterface name='lo' multicast='true'/></Interfaces>"
    "</General></Domain></CycloneDDS>"
)
PLAN = """
import sys, lampyris
lampyris.plan(lampyris.Scene(lampyris.Grid([[0, 0], [0, 0]]), (0, 0), (1, 1)), "astar")
"""
USES = {
    "ros": ["-m", "lampyris", "plan", "env-1", "--bag", "run.mcap", "--force"],
    "ros-live": ["-m", "lampyris", "ros", "--transport", "dds", "--seconds", "0.5"],
    "rl": [
        "-c",
        "import lampyris.rl, gymnasium; e = gymnasium.make('lampyris/GridNav-v0'); e.reset(seed=1); e.step(0)",
    ],
    "tune": ["-m", "lampyris", "tune", "s.yaml", "--trials", "2", "--force"],
    "notebook": ["-c", "import lampyris; lampyris.Grid([[0, 1]]).to_xarray()"],
    "parquet": ["-m", "lampyris", "study", "export", "s.study.db", "--parquet", "s.parquet", "--force"],
    "pandas": [
        "-c",
        "import lampyris; lampyris.plan(lampyris.Scene(lampyris.Grid([[0, 0]]), (0, 0), (1, 0))).to_pandas()",
    ],
    "dask": ["-m", "lampyris", "study", "s.yaml", "--store", "d.study.db", "--dask", "tcp://127.0.0.1:1"],
}
"""What an extra is for; that of dask must come as far as the connection, which nothing answers."""
PACKAGES = {
    "ros": ("rosbags",), "ros-live": ("cyclonedds", "rosbags"), "rl": ("gymnasium", "pettingzoo"), "tune": ("optuna",),
    "notebook": ("anywidget", "xarray"), "parquet": ("pyarrow",), "pandas": ("pandas",), "dask": ("distributed",),
}  # fmt: skip


def extras() -> list[str]:
    """Those that users ask for by name."""
    with open(ROOT / "pyproject.toml", "rb") as file:
        named = tomllib.load(file)["project"]["optional-dependencies"]
    return [name for name in named if name in USES]


def made(folder: Path, wheel: Path, extra: str) -> tuple[Path, float, float]:
    """A new environment with the wheel and an extra: its Python, seconds, and megabytes."""
    place = folder / (extra or "none")
    subprocess.run([sys.executable, "-m", "venv", "--clear", str(place)], check=True)
    python = place / "bin" / "python"
    before, began = size(place), time.monotonic()
    what = f"lampyris[{extra}] @ {wheel.as_uri()}" if extra else str(wheel)
    words = [
        str(python),
        "-m",
        "pip",
        "install",
        "-qq",
        "--disable-pip-version-check",
        "--no-compile",
        what,
    ]
    subprocess.run(words, check=True, env=plain())
    return python, time.monotonic() - began, size(place) - before


def size(place: Path) -> float:
    return sum(f.stat().st_size for f in place.rglob("*") if f.is_file() and not f.is_symlink()) / 1e6


def plain() -> dict[str, str]:
    held = {k: v for k, v in os.environ.items() if k != "PYTHONPATH"}
    return {**held, "CYCLONEDDS_URI": LOOPBACK, "COLUMNS": "500"}


def call(python: Path, words: list[str], folder: Path) -> tuple[int, str]:
    done = subprocess.run(
        [str(python), *words], capture_output=True, text=True, env=plain(), cwd=folder, check=False
    )
    return done.returncode, done.stderr.strip()


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("extras", nargs="*", metavar="EXTRA")
    parser.add_argument("--wheel", type=Path, help="default: built from this checkout")
    parser.add_argument("--folder", type=Path, default=ROOT / "build" / "extras", help="for the environments")
    asked = parser.parse_args()
    folder: Path = asked.folder.resolve()
    folder.mkdir(parents=True, exist_ok=True)
    wheel = asked.wheel
    if wheel is None:
        with tempfile.TemporaryDirectory(
            dir=folder
        ) as fresh:  # an older wheel in the folder must not be taken
            command = [sys.executable, "-m", "build", "-w", "-o", fresh, str(ROOT)]
            subprocess.run(command, check=True, capture_output=True)
            (built,) = Path(fresh).glob("lampyris-*.whl")
            wheel = built.replace(folder / built.name)
    wheel = wheel.resolve()
    work = folder / "work"  # beside the environments: a folder called dask is a package to Python
    work.mkdir(exist_ok=True)
    (work / "s.yaml").write_text(STUDY)
    base, seconds, megabytes = made(folder, wheel, "")
    print(f"{'none':10} {seconds:6.1f} s {megabytes:7.1f} MB", flush=True)
    call(base, ["-m", "lampyris", "study", "s.yaml", "--store", "s.study.db"], work)
    faults = 0
    for extra in asked.extras or extras():
        code, said = call(base, USES[extra], work)
        last = said.splitlines()[-1] if said else ""
        told = (
            code != 0
            and f"pip install 'lampyris[{extra}]'" in last
            and "Traceback" not in said.replace(last, "")
        )
        if USES[extra][0] == "-c":  # an exception of Python: its last line is the sentence
            told = code != 0 and f"pip install 'lampyris[{extra}]'" in last
        python, seconds, more = made(folder, wheel, extra)
        code, said = call(python, USES[extra], work)
        works = "CLUSTER_ADDRESS" in said if extra == "dask" else code == 0
        asks = PLAN + f"assert not set({PACKAGES[extra]!r}) & set(sys.modules), sorted(sys.modules)"
        quiet = call(python, ["-c", asks], work)[0] == 0
        faults += not (told and works and quiet)
        marks = [
            word if good else f"NOT {word}"
            for good, word in ((told, "told"), (works, "works"), (quiet, "not imported"))
        ]
        print(
            f"{extra:10} {seconds:6.1f} s {more:7.1f} MB (+{more - megabytes:.1f})  {', '.join(marks)}: {last}",
            flush=True,
        )
        if not works:
            print(said, file=sys.stderr)
    return int(faults > 0)


if __name__ == "__main__":
    raise SystemExit(main())

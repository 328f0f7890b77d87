"""Try lampyris with every dependency at the lowest version that pyproject.toml allows.

    python tools/check_floors.py                     # every Python from 3.11 on that is on PATH
    python tools/check_floors.py python3.12 PATH ... # these
    python tools/check_floors.py --suite ...         # the whole test suite without browsers as well
    python tools/check_floors.py --list              # the floors alone, Python by Python

For each Python: a new environment in build/floors, the floors (wheels only: a floor without a wheel for that
Python is a fault), both packages built from this checkout, then each verb once, the app, the hashes of
`selfcheck determinism` and the tests of the model and of the command line. Exits with 1 if anything failed.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import tomllib
import urllib.request
from collections.abc import Iterator
from pathlib import Path

from packaging.requirements import Requirement
from packaging.version import Version

ROOT = Path(__file__).resolve().parents[1]
PYTHONS = ("3.11", "3.12", "3.13", "3.14")
# What the tests need besides; of these only what is pinned is promised.
TEST_TOOLS = ("pytest", "hypothesis", "pytest-xdist", "shapely")
# What the extra `dev` names and the suite does not run without a source checkout or a browser.
NOT_FOR_THE_SUITE = ("import-linter", "mypy", "playwright", "ruff", "scipy-stubs", "types-pyyaml")
TESTS = (
    "tests/model",
    "tests/cli/test_cli.py",
    "tests/cli/test_cli_maps.py",
    "tests/cli/test_cli_speed.py",
    "tests/app/test_app_start.py",
    "tests/io/test_scenario_schema.py",
)
STUDY = """version: 1
maps:
  - {bundled: guide}
planners: [ad-gso, astar]
seeds: 2
"""
LIMIT = 900.0  # Seconds for one command: only what hangs gets there.
SUITE_LIMIT = 7200.0  # Seconds for the whole suite.
WORKERS = 2


def floors(requirements: list[str], python: str) -> dict[str, str]:
    """The lowest version of each dependency on a Python such as "3.12", by name.

    Raises
    ------
    ValueError : a dependency has no floor there, or two.
    """
    found: dict[str, str] = {}
    for line in requirements:
        one = Requirement(line)
        environment = {"python_version": python, "python_full_version": f"{python}.0"}
        if one.marker is not None and not one.marker.evaluate(environment):
            continue
        low = [s.version for s in one.specifier if s.operator in (">=", "==", "~=")]
        if len(low) != 1 or one.name in found:
            raise ValueError(f"{one.name} has no single floor on Python {python}: {line!r}")
        found[one.name] = low[0]
    missing = {Requirement(line).name for line in requirements} - set(found)
    if missing:
        raise ValueError(f"no floor on Python {python}: {', '.join(sorted(missing))}")
    return found


def project() -> tuple[list[str], list[str]]:
    """What pyproject.toml asks for: to run, and to build."""
    said = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    return said["project"]["dependencies"], said["build-system"]["requires"]


def suite_tools(python: str) -> list[str]:
    """What the whole suite needs besides, from the extra `dev`, in versions that agree with the floors.

    pyarrow does not say which NumPy it needs, so that it is taken at its own floor.
    """
    said = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    extras = said["project"]["optional-dependencies"]
    out = (*NOT_FOR_THE_SUITE, "pyarrow")
    kept = [line for line in extras["dev"] if Requirement(line).name not in out]
    return kept + [f"{name}=={low}" for name, low in floors(extras["parquet"], python).items()]


def pins() -> dict[str, str]:
    """The versions of requirements/run.txt and dev.txt, by name."""
    text = "".join(
        (ROOT / "requirements" / name).read_text(encoding="utf-8") for name in ("run.txt", "dev.txt")
    )
    return dict(re.findall(r"^([\w.-]+)==(\S+)", text, re.MULTILINE))


def pythons(asked: list[str]) -> Iterator[tuple[str, str]]:
    """(version, command) of the Pythons to try: those asked for, or each version that answers, once."""
    seen: set[str] = set()
    for command in asked or [f"python{version}" for version in PYTHONS]:
        told = (
            subprocess.run(
                [command, "-c", "import sys; print('%d.%d' % sys.version_info[:2])"],
                capture_output=True,
                text=True,
                check=False,
            )
            if shutil.which(command)
            else None
        )
        if told is None or told.returncode:
            print(f"{command}: not here" + (", FAILED" if asked else ", left out"), flush=True)
            if asked:
                yield "", command
            continue
        version = told.stdout.strip()
        if version not in seen:
            seen.add(version)
            yield version, command


class Trial:
    """One Python: its environment, and what failed in it."""

    def __init__(self, version: str, command: str, folder: Path, suite: bool = False) -> None:
        self.version, self.command, self.folder, self.whole_suite = version, command, folder, suite
        self.failed: list[str] = []
        # Nothing of the checkout is imported, and nothing of the environment that this script runs in.
        self.environment = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "VIRTUAL_ENV")}
        self.environment["LAMPYRIS_SHARED"] = str(folder / "none")
        self.bin = folder / "bin"

    def run(self, *words: str, where: Path = ROOT, wants: str = "", limit: float = LIMIT) -> str:
        """Run a command, say how it went and keep the failure; its standard output."""
        began = time.monotonic()
        try:
            done = subprocess.run(
                words,
                cwd=where,
                env=self.environment,
                capture_output=True,
                text=True,
                timeout=limit,
                check=False,
            )
            code, out, err = done.returncode, done.stdout, done.stderr
        except subprocess.TimeoutExpired:
            code, out, err = -1, "", f"not done after {limit:.0f} s"
        said = " ".join(words).replace(f"{self.bin}/", "").replace(f"{ROOT}/", "")
        fault = f"exit code {code}" if code else "" if wants in out else f"{wants!r} is not in the output"
        self.tell(said[:160], fault, time.monotonic() - began)
        if fault:
            print("\n".join((out[-3000:] + err[-1500:]).splitlines()), flush=True)
        return out

    def tell(self, said: str, fault: str, seconds: float) -> None:
        print(f"  {'FAILED (' + fault + ')' if fault else 'ok'}: {said} ({seconds:.1f} s)", flush=True)
        if fault:
            self.failed.append(f"Python {self.version}: {said}: {fault}")

    def install(self) -> bool:
        """The environment, with every dependency at its floor and the package built by that of hatchling."""
        to_run, to_build = project()
        low = floors(to_run, self.version) | floors(to_build, self.version)
        print("  " + ", ".join(f"{name} {version}" for name, version in low.items()), flush=True)
        shutil.rmtree(self.folder, ignore_errors=True)
        python = str(self.bin / "python")
        pip = (python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check")
        at_floor = [f"{name}=={version}" for name, version in low.items()]
        tools = [f"{name}=={pins()[name]}" for name in TEST_TOOLS]
        if self.whole_suite:
            tools += suite_tools(self.version)
        self.run("tools/make_venv.sh", self.command, str(self.folder))
        self.run(*pip, "--only-binary", ":all:", *at_floor, *tools)
        self.run(*pip, "--no-deps", "--no-build-isolation", str(ROOT), str(ROOT / "selfcheck"))
        self.run(python, "-m", "pip", "check", "--disable-pip-version-check")
        if not self.failed:
            have = json.loads(self.run(python, "-m", "pip", "list", "--format", "json"))
            named = {one["name"].lower(): one["version"] for one in have}
            moved = [
                f"{k} {named[k.lower()]}" for k, v in low.items() if Version(named[k.lower()]) != Version(v)
            ]
            self.tell("every dependency is at its floor", ", ".join(moved), 0.0)
        return not self.failed

    def smoke(self) -> None:
        """Each verb once, the app, the schemas, the hashes and some tests."""
        lampyris = str(self.bin / "lampyris")
        with tempfile.TemporaryDirectory(prefix="lampyris-floors-") as name:
            where = Path(name)
            (where / "small.yaml").write_text(STUDY, encoding="utf-8")
            self.run(lampyris, "--help", where=where, wants="drive")
            self.run(lampyris, "plan", "--help", where=where, wants="--planner")
            self.run(
                lampyris,
                "plan",
                "env-1",
                "--picture",
                "env-1.png",
                "--csv",
                "a.csv",
                where=where,
                wants="63.3137",
            )
            self.run(
                lampyris, "plan", "guide", "--preset", "dissertation", "--explain", where=where, wants="12.4"
            )
            self.run(lampyris, "speed", "env-3", "--chart", "laws.png", where=where)
            self.run(lampyris, "simulate", "env-3", "--obstacles", "5", "--film", "run.webp", where=where)
            self.run(lampyris, "drive", "env-3", "--obstacles", "5", "--chart", "drive.png", where=where)
            self.run(lampyris, "simulate", "env-3", "--save-scenario", "run.yaml", where=where)
            self.run(lampyris, "run", "run.yaml", where=where)
            self.run(lampyris, "study", "small.yaml", "--workers", "2", "--report", "small.html", where=where)
            self.app(lampyris, where)
            schemas = {"scenario": ("schema",), "fleet": ("schema", "--fleet"), "study": ("study", "schema")}
            for kind, words in schemas.items():
                kept = (ROOT / "docs" / f"{kind}.schema.json").read_text(encoding="utf-8")
                same = self.run(lampyris, *words, where=where) == kept
                self.tell(f"docs/{kind}.schema.json", "" if same else "differs from what is printed", 0.0)
            self.run(lampyris, "selfcheck", "determinism", "--only", "as it is", where=where)
        # An old dependency may call what a newer one of its own deprecates (matplotlib 3.9, of pyparsing).
        told = ("-q", "-p", "no:cacheprovider", "-W", "ignore::DeprecationWarning")
        pytest = (str(self.bin / "python"), "-m", "pytest", *told)
        self.run(*pytest, "-m", "not nightly", *TESTS)

    def suite(self) -> None:
        """The whole suite, from a copy of the tests as `make test-wheel` runs it.

        Tests in a browser are skipped there: playwright is not installed.
        """
        self.environment["LAMPYRIS_SHARED"] = os.environ.get("LAMPYRIS_SHARED", str(self.folder / "none"))
        with tempfile.TemporaryDirectory(prefix="lampyris-floors-") as name:
            where = Path(name)
            for folder in ("tests", "examples"):
                shutil.copytree(ROOT / folder, where / folder)
            for file in ("pyproject.toml", "README.md"):
                shutil.copy2(ROOT / file, where / file)
            told = ("-q", "-n", str(WORKERS), "--dist", "worksteal", "-W", "ignore::DeprecationWarning")
            python = str(self.bin / "python")
            words = (python, "-m", "pytest", *told, "-m", "not nightly and not source")
            said = self.run(*words, where=where, limit=SUITE_LIMIT)
            print(f"  {said.splitlines()[-1] if said else ''}", flush=True)

    def app(self, lampyris: str, where: Path) -> None:
        """Start the app, get its page, stop it as Ctrl-C does."""
        began = time.monotonic()
        with subprocess.Popen(
            [lampyris, "app", "--no-browser", "--port", "0"],
            cwd=where,
            env=self.environment | {"XDG_DATA_HOME": str(where), "HOME": str(where)},
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        ) as started:
            assert started.stdout is not None
            fault, said = "no address was printed", []
            for line in started.stdout:
                said.append(line)
                if address := re.search(r"http://\S+", line):
                    try:
                        with urllib.request.urlopen(address.group(), timeout=30) as page:
                            fault = "" if b"lampyris" in page.read() else "not the page"
                    except OSError as error:
                        fault = str(error)
                    break
            started.send_signal(signal.SIGINT)
            rest = started.communicate(timeout=60)[0]
            if not fault and started.returncode not in (0, 130):
                fault = f"exit code {started.returncode}: {''.join(said)}{rest}"[-1500:]
        self.tell("lampyris app --no-browser --port 0", fault, time.monotonic() - began)


def main() -> int:
    parser = argparse.ArgumentParser(description=str(__doc__).partition("\n")[0])
    parser.add_argument("python", nargs="*", help="commands of the Pythons to try")
    parser.add_argument("--list", action="store_true", help="print the floors and try nothing")
    parser.add_argument("--suite", action="store_true", help="run the whole test suite without browsers, too")
    parser.add_argument("--folder", type=Path, default=ROOT / "build" / "floors", help="for the environments")
    asked = parser.parse_args()
    if asked.list:
        for version in PYTHONS:
            print(version, ", ".join(f"{k} {v}" for k, v in floors(project()[0], version).items()))
        return 0
    failed: list[str] = []
    tried = 0
    for version, command in pythons(asked.python):
        if not version:
            failed.append(f"{command}: not here")
            continue
        print(f"Python {version} ({command})", flush=True)
        trial = Trial(version, command, asked.folder.resolve() / version, asked.suite)
        if trial.install():
            trial.smoke()
            if asked.suite:
                trial.suite()
        failed += trial.failed
        tried += 1
    print(f"{tried} Pythons tried, {len(failed)} failures", *failed, sep="\n  ")
    return 1 if failed or not tried else 0


if __name__ == "__main__":
    sys.exit(main())

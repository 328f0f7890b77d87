"""Build the live page: the app without a server, its Python in the browser by Pyodide.

    python site/live/build.py [OUT] [--recorded]

OUT (build/live) is a folder of files that any web server can serve; the page asks for nothing outside it. Pyodide and
NumPy's build for it are npm packages of stated versions, whose files are checked. Where they cannot be had (no npm, no
network), or with ``--recorded``, the page shows a recording instead; the last line printed says which it is.
"""

from __future__ import annotations

import argparse
import base64
import hashlib
import json
import re
import shutil
import subprocess
import sys
import tarfile
import tempfile
import zipfile
from pathlib import Path
from typing import Any

LIVE = Path(__file__).resolve().parent
ROOT = LIVE.parents[1]

PYODIDE = "0.29.4"
RUNTIME = (
    f"pyodide@{PYODIDE}",
    "3ebbf05087d9a796c61b2163252e9049c7394a8f2b6f8dd4b00c5a373fb06efb",
    ("pyodide.mjs", "pyodide.asm.js", "pyodide.asm.wasm", "python_stdlib.zip", "pyodide-lock.json"),
)
"""npm package, SHA-256 of its archive, the files that a page needs."""
NUMPY = (
    "@bentopdf/pymupdf-wasm@0.11.16",
    "assets/numpy-2.2.5-cp313-cp313-pyodide_2025_0_wasm32.whl",
    "125230b4c3ecd08803e5c43f1162e017c0718d9f253146225a705a952b9c16c2",
)
"""A package that carries NumPy's wheel for this Pyodide, the wheel, its SHA-256 (that of Pyodide 0.28.0a3, which has the
binary interface of 0.29: 2025_0). Nothing else is taken from the package. Pyodide itself publishes its wheels where npm
does not reach."""

KERNELS = ROOT / "src" / "lampyris" / "kernels"
MAP = "env-3"


def main() -> int:
    """Build; 0, also where only a recording could be built."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", nargs="?", type=Path, default=ROOT / "build" / "live")
    parser.add_argument("--recorded", action="store_true", help="a recording, though Pyodide could be had")
    given = parser.parse_args()
    out: Path = given.out
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir(parents=True)
    page(out)
    (out / "recorded.json").write_text(json.dumps(recorded(), separators=(",", ":")), encoding="utf-8")
    why = "--recorded was given" if given.recorded else runtime(out)
    made = {"python": not why, "pyodide": "" if why else PYODIDE}
    (out / "made.json").write_text(json.dumps(made) + "\n", encoding="utf-8")
    if why:
        shutil.rmtree(out / "pyodide", ignore_errors=True)
        print(f"wrote {out}: a recording ({why})")
    else:
        size = sum(file.stat().st_size for file in out.rglob("*") if file.is_file())
        print(f"wrote {out}: Python by Pyodide {PYODIDE}, {size / 1e6:.1f} MB")
    return 0


def page(out: Path) -> None:
    """The app's own page and modules, with this folder's script in front."""
    shutil.copytree(ROOT / "src" / "lampyris" / "app" / "static", out / "static")
    text = (out / "static" / "index.html").read_text(encoding="utf-8")
    (out / "static" / "index.html").unlink()
    script = '<script src="/static/main.js" type="module"></script>'
    assert script in text
    policy = (
        "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; style-src 'self'; img-src 'self' data: blob:; "
        "connect-src 'self'; worker-src 'self'"
    )
    head = f'<meta charset="utf-8">\n<meta http-equiv="Content-Security-Policy" content="{policy}">'
    text = text.replace('<meta charset="utf-8">', head)
    text = text.replace(script, '<script src="live.js" type="module"></script>').replace(
        '"/static/', '"static/'
    )
    banner = '<div id="gone"'
    assert banner in text
    text = text.replace(banner, f'<div id="starting" class="gone" role="status" hidden></div>\n\n{banner}')
    (out / "index.html").write_text(text, encoding="utf-8")
    for name in ("live.js", "worker.js"):
        shutil.copy2(LIVE / name, out / name)


def runtime(out: Path) -> str:
    """Place Pyodide, NumPy and lampyris; why it was not possible, or empty."""
    if shutil.which("npm") is None or shutil.which("node") is None:
        return "npm and node are not installed"
    with tempfile.TemporaryDirectory() as folder:
        work = Path(folder)
        try:
            package, digest, names = RUNTIME
            archive = packed(package, work)
            check(archive, digest)
            (out / "pyodide").mkdir()
            with tarfile.open(archive) as files:
                for name in names:
                    (out / "pyodide" / name).write_bytes(member(files, f"package/{name}"))
            package, wheel, digest = NUMPY
            with tarfile.open(packed(package, work)) as files:
                (work / "numpy.whl").write_bytes(member(files, f"package/{wheel}"))
            check(work / "numpy.whl", digest)
            together(work / "plain.zip", work / "numpy.whl")
            command = ["node", str(LIVE / "compile.mjs"), str(out / "pyodide"), str(work / "plain.zip")]
            subprocess.run([*command, str(out / "python.zip")], check=True, timeout=600)
        except (OSError, subprocess.SubprocessError, LookupError, tarfile.TarError, ValueError) as fault:
            return f"{type(fault).__name__}: {str(fault)[-300:]}"
    return ""


def packed(package: str, work: Path) -> Path:
    """An npm package's archive."""
    command = ["npm", "pack", package, "--silent", "--pack-destination", str(work)]
    done = subprocess.run(command, check=True, capture_output=True, text=True, timeout=300)
    return work / done.stdout.strip().splitlines()[-1]


def member(archive: tarfile.TarFile, name: str) -> bytes:
    """A file of an archive."""
    found = archive.extractfile(name)
    if found is None:
        raise LookupError(name)
    return found.read()


def check(file: Path, digest: str) -> None:
    """Refuse other bytes than those that were looked at.

    Raises
    ------
    ValueError : they are.
    """
    found = hashlib.sha256(file.read_bytes()).hexdigest()
    if found != digest:
        raise ValueError(f"{file.name}: SHA-256 {found}, not {digest}")


def together(out: Path, wheel: Path) -> None:
    """One archive of all Python files: NumPy, PyYAML, lampyris, and what stands in for compiled packages."""
    import yaml

    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as made:
        with zipfile.ZipFile(wheel) as numpy:
            for name in numpy.namelist():
                if "/tests/" not in name and not name.endswith((".pyi", ".a", ".h")) and "/f2py/" not in name:
                    made.writestr(name, numpy.read(name))
        # PyYAML's compiled part is optional.
        for file in sorted(Path(yaml.__file__).parent.glob("*.py")):
            made.write(file, f"yaml/{file.name}")
        for folder, name in ((LIVE / "stand_ins", ""), (ROOT / "src", "")):
            for file in sorted(folder.rglob("*")):
                place = file.relative_to(folder)
                if (
                    file.is_file()
                    and "__pycache__" not in place.parts
                    and place.parts[1:3] != ("app", "static")
                ):
                    made.writestr(name + place.as_posix(), plain(file))
        made.write(LIVE / "live_engine.py", "live_engine.py")
        for name in ("entry_points.txt", "METADATA"):
            made.writestr(f"lampyris-0.dist-info/{name}", metadata(name))


def plain(file: Path) -> bytes:
    """A file as the page runs it: kernels without prefetching, which means nothing in plain Python and is called in
    the innermost loops."""
    data = file.read_bytes()
    if file.parent == KERNELS or KERNELS not in file.parents:
        return data
    return re.sub(rb"^( +)fetch\(.*\)$", rb"\1pass", data, flags=re.MULTILINE)


def metadata(name: str) -> str:
    """A file of the installed distribution's metadata."""
    from importlib.metadata import distribution

    found = distribution("lampyris").read_text(name)
    assert found is not None
    return found


def recorded() -> dict[str, Any]:
    """The answers to what the page asks for one scenario, by path and layer."""
    sys.path.insert(0, str(LIVE))
    import live_engine

    from lampyris.app.engine.layers import LAYERS

    scenario = {"version": 1, "map": MAP, "planner": "ad-gso"}
    ground = live_engine.ask(f"/api/maps/{MAP}", None).next()
    assert ground is not None
    head = json.loads(ground[5 : 4 + int.from_bytes(ground[:4], "little")])
    scenario |= {"start": head["start"], "goal": head["goal"]}
    walkers = [{"kind": "random-walk", "count": 6}]
    asked: dict[str, Any] = {"/api/hello": None, "/api/maps": None, f"/api/maps/{MAP}": None}
    asked |= {f"/api/thumbs/{name}": None for name in (MAP,)}
    asked |= {
        "/api/plan": {"scenario": scenario},
        "/api/simulate": {"scenario": {**scenario, "obstacles": walkers, "simulate": {}}},
    }
    asked |= {f"/api/layer {name}": {"scenario": scenario, "layer": name} for name in LAYERS}
    answers = {}
    for key, body in asked.items():
        answer = live_engine.ask(key.split()[0], None if body is None else json.dumps(body).encode())
        data = b"".join(iter(answer.next, None))
        if answer.status != 200 and not key.startswith("/api/layer "):
            raise SystemExit(f"site/live/build.py: {key} was answered with {answer.status}: {data[:200]!r}")
        if answer.status == 200:
            answers[key] = {
                "status": 200,
                "kind": answer.kind,
                "body": base64.b64encode(data).decode(),
            }
    same = {"map": MAP, "start": head["start"], "goal": head["goal"], "planner": "ad-gso"}
    return {"link": f"#m={MAP}", "same": same, "answers": answers}


if __name__ == "__main__":
    sys.exit(main())

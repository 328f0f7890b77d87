"""The stage of bench_app: maps, a real `lampyris app`, Chromium, and what their processes use."""

from __future__ import annotations

import base64
import json
import os
import platform
import re
import shutil
import subprocess
import sys
import tempfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
FLAGS = (
    "--headless=new",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-background-networking",
    "--no-first-run",
    "--disable-component-update",
    "--disable-sync",
    "--enable-precise-memory-info",
)
PROBE = Path(__file__).with_name("app_probe.js").read_text(encoding="utf-8")
SIZES = (512, 1024, 2048)

FIRST = """
(() => {
  const { putImageData, drawImage } = CanvasRenderingContext2D.prototype;
  let ground = false;
  CanvasRenderingContext2D.prototype.putImageData = function (image, ...more) {
    putImageData.call(this, image, ...more);
    ground ||= !this.canvas.isConnected && image.width >= 10 && image.height >= 10;
  };
  CanvasRenderingContext2D.prototype.drawImage = function (...all) {
    drawImage.apply(this, all);
    if (!ground || this.canvas.id !== "map" || window.firstFrame !== undefined) return;
    window.firstFrame = 0;
    // Behind the frame that shows it.
    requestAnimationFrame(() => setTimeout(() => (window.firstFrame = performance.now())));
  };
})();
"""
"""Told before the page is loaded: when a map was on the screen first, milliseconds from the navigation."""


def write_maps(folder: Path) -> None:
    """Random maps of a tenth of walls, as MovingAI files."""
    for size in SIZES:
        walls = np.random.default_rng(size).random((size, size)) < 0.1
        walls[:4, :4] = walls[-4:, -4:] = False
        rows = "\n".join("".join(".@"[wall] for wall in row) for row in walls.astype(int).tolist())
        text = f"type octile\nheight {size}\nwidth {size}\nmap\n{rows}\n"
        (folder / f"m{size}.map").write_text(text, encoding="ascii")


def scenario(size: int, obstacles: int) -> dict[str, Any]:
    """From corner to corner of a map, among random walkers."""
    crowd = [{"kind": "random-walk", "count": obstacles, "rate": None}] if obstacles else []
    return {
        "version": 1, "map": {"library": f"m{size}.map"}, "start": [2, 2], "goal": [size - 3, size - 3],
        "robot": {}, "preset": "robot", "moves": None, "planner": {"name": "astar", "settings": {}},
        "law": None, "seed": 1, "obstacles": crowd, "edits": [],
        "simulate": {"ticks": None, "patience": None},
    }  # fmt: skip


def link(made: dict[str, Any]) -> str:
    """A scenario as a part of the page's address."""
    pack = zlib.compressobj(9, zlib.DEFLATED, -15)
    data = pack.compress(json.dumps(made).encode()) + pack.flush()
    return "&s=" + base64.urlsafe_b64encode(data).decode().rstrip("=")


@contextmanager
def app() -> Iterator[tuple[str, int]]:
    """A real app on a folder of maps: its address and the number of its process."""
    with tempfile.TemporaryDirectory() as home:
        folder = Path(home) / "maps"
        folder.mkdir()
        write_maps(folder)
        code = "import sys; from lampyris.cli import main; sys.exit(main())"
        command = [sys.executable, "-c", code, "app", "--no-browser", "--folder", str(folder)]
        env = {**os.environ, "XDG_DATA_HOME": home}
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=env) as server:
            try:
                assert server.stdout is not None
                said = server.stdout.readline()
                found = re.search(r"http://\S+", said)
                if not found:
                    raise RuntimeError(f"the app did not start: {said!r}")
                yield found[0], server.pid
            finally:
                server.terminate()
                server.wait(20)


def tree(pid: int) -> list[int]:
    """A process and all below it."""
    below: dict[int, list[int]] = {}
    for file in Path("/proc").glob("[0-9]*/stat"):
        try:
            parent = int(file.read_text().rsplit(")", 1)[1].split()[1])
        except OSError:
            continue
        below.setdefault(parent, []).append(int(file.parent.name))
    out = [pid]
    for one in out:
        out += below.get(one, [])
    return out


def resident(pid: int) -> int:
    """Bytes of memory that a process holds; 0: there is none."""
    try:
        return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")
    except OSError:
        return 0


def drawing(seconds_of: str = "renderer|gpu-process") -> dict[int, float]:
    """Processor seconds so far of the browser's processes of some kinds."""
    out = {}
    for pid in tree(os.getpid()):
        try:
            kind = re.search(rb"--type=(renderer|gpu-process)", Path(f"/proc/{pid}/cmdline").read_bytes())
            told = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
        except OSError:
            continue
        if kind and re.fullmatch(seconds_of, kind[1].decode()):
            out[pid] = (int(told[11]) + int(told[12])) / os.sysconf("SC_CLK_TCK")
    return out


def cpu() -> str:
    """What the processor is called."""
    told = Path("/proc/cpuinfo").read_text(encoding="utf-8")
    found = re.search(r"^model name\s*:\s*(.+)$", told, re.MULTILINE)
    return found[1] if found else platform.machine()

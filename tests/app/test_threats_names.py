"""Threats: names as paths by way of the server (W11), and what a whole session leaves behind (W16, W17)."""

from __future__ import annotations

import contextlib
import json
import os
import re
import signal
import stat
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import quote

import pytest
from app_server import World, own, run
from test_app_library import HOSTILE, SEEN, SMALL, WATCHING
from test_app_secrets import POSIX, tree
from test_threats_bombs import Live

from lampyris.app.server.library import Library, container
from lampyris.app.server.opening import recorded_answers

# ---- names, by HTTP, to the real library (W11) --------------------


@pytest.fixture
def world(tmp_path: Path) -> World:
    """A server with the real library on a folder that holds traps."""
    maps = tmp_path / "maps"
    maps.mkdir()
    (maps / "map.png").write_bytes(SMALL)
    (tmp_path / "secret.txt").write_text("...\n")
    if os.name == "posix":
        os.symlink(tmp_path / "secret.txt", maps / "link.png")
        os.mkfifo(maps / "pipe.png")
    made = World()
    made.services.library = Library(maps, tmp_path / "spool")
    run(made.ask("GET", "/api/thumbs/guide", own()))
    # The package's own record of the opening scene is read once.
    recorded_answers()
    return made


def ways(name: str) -> Iterator[tuple[str, str, bytes]]:
    """Every way in which a name may be said: to read, to look, to delete, to plan on, to export, to save."""
    escaped = quote(name, safe="")
    # As it is too, where a line of HTTP can hold it.
    sayable = name.isascii() and name.isprintable() and not set(name) & set(" ?#")
    for path in {escaped, name if sayable else escaped}:
        yield "GET", f"/api/maps/{path}", b""
        yield "GET", f"/api/thumbs/{path}", b""
        yield "POST", f"/api/maps/{path}/delete", b"{}"
    for spec in (name, {"library": name}, {"file": name}, {"bundled": name}):
        scenario = json.dumps({"scenario": {"version": 1, "map": spec}, "what": "png"}).encode()
        yield "POST", "/api/export", scenario
        yield "POST", "/api/study", scenario.replace(b', "what": "png"', b"")


@pytest.mark.commit(6)
@pytest.mark.parametrize("name", HOSTILE, ids=ascii)
def test_no_name_leads_out_of_the_library(world: World, tmp_path: Path, name: str) -> None:
    before = sorted(tmp_path.rglob("*"))
    for method, path, body in ways(name):
        SEEN.clear()
        WATCHING[0] = True
        try:
            told = run(world.ask(method, path, own(json_=method == "POST"), body))
        finally:
            WATCHING[0] = False
        assert SEEN == [], path
        asks = path in ("/api/export", "/api/study")
        # A table that names no map of the library goes on to the engine, which looks names up itself.
        passed = asks and told.status == 200 and b'"bundled"' in body
        assert told.status in (400, 404, 405) or passed or (path == "/api/maps/" and told.status == 404), path
        assert b"secret" not in told.body.replace(b"secret.txt", b"")
        assert str(tmp_path).encode() not in told.body
    assert sorted(tmp_path.rglob("*")) == before


# ---- a whole session (W16, W17) --------------------

SESSION = """\
import sys
from pathlib import Path
from lampyris.app.server.run import run_app
sys.exit(run_app(browser=False, folder=Path(sys.argv[1])))
"""
STRANGER = """\
import os, sys
for path in sys.argv[1:]:
    for work in (os.listdir, lambda p: open(p).read(), lambda p: open(os.path.join(p, 'x'), 'w')):
        try:
            work(path)
            print('open', path)
        except OSError:
            print('shut')
"""
SCENARIO = {
    "version": 1, "map": "guide", "start": [0, 9], "goal": [7, 0], "planner": "astar",
    "obstacles": [{"kind": "random-walk", "count": 1}],
}  # fmt: skip


def modes(folder: Path) -> set[tuple[str, int]]:
    """Kinds and modes of all that is in a folder now."""
    found = set()
    for file in folder.rglob("*"):
        try:
            told = file.lstat()
        except OSError:
            continue
        found.add(("folder" if stat.S_ISDIR(told.st_mode) else "file", stat.S_IMODE(told.st_mode)))
    return found


@pytest.mark.nightly
@POSIX
def test_a_whole_session_keeps_its_secrets_and_leaves_nothing(tmp_path: Path) -> None:
    temp, home = tmp_path / "temp", tmp_path / "home"
    maps = tmp_path / "maps"
    for folder in (temp, home, maps):
        folder.mkdir()
    (maps / "hall.png").write_bytes(SMALL)
    errors = tmp_path / "stderr"
    env = {
        **os.environ, "TMPDIR": str(temp), "XDG_DATA_HOME": str(home), "LAMPYRIS_DEBUG": "1",
        "PYTHONPATH": os.pathsep.join(filter(None, sys.path)),
    }  # fmt: skip
    seen: set[tuple[str, int]] = set()
    answers: list[bytes] = []
    with errors.open("w") as stderr:
        process = subprocess.Popen(
            [sys.executable, "-c", SESSION, str(maps)],
            stdout=subprocess.PIPE,
            stderr=stderr,
            text=True,
            env=env,
        )
    try:
        assert process.stdout is not None
        line = process.stdout.readline()
        found = re.search(r":(\d+)/#t=([0-9a-f]{64})", line)
        assert found, line
        live = Live(process.pid, int(found[1]), found[2])
        token = live.token.encode()
        until = time.monotonic() + 120
        while time.monotonic() < until:
            try:
                live.ask("/api/hello")
                break
            except OSError:
                time.sleep(0.05)

        def ask(path: str, body: Any = None) -> tuple[int, bytes]:
            data = body if body is None or isinstance(body, bytes) else json.dumps(body).encode()
            kind = "octet-stream" if isinstance(body, bytes) else "json"
            status, told, _ = live.ask(path, data, kind)
            answers.append(told)
            seen.update(modes(temp), modes(home))
            return status, told

        assert ask("/api/maps")[0] == 200
        assert ask("/api/thumbs/hall.png")[0] == 200
        assert ask("/api/maps", container({"hall (2).png": SMALL}))[0] == 200
        assert ask("/api/plan", {"scenario": SCENARIO, "record": True, "layers": []})[0] == 200
        for what in ("png", "svg", "csv", "scenario", "webp"):
            assert ask("/api/export", {"scenario": SCENARIO, "what": what})[0] == 200
        assert ask("/api/export", {"scenario": SCENARIO, "what": "exe"})[0] == 400
        job = json.loads(ask("/api/study", {"scenario": SCENARIO, "seeds": 1, "queries": 1})[1])["job"]
        until = time.monotonic() + 240
        while json.loads(ask(f"/api/study/{job}")[1])["state"] != "done" and time.monotonic() < until:
            time.sleep(0.1)
        ticket = json.loads(ask("/api/ticket", {"job": job})[1])["ticket"]
        assert ask(f"/view/{ticket}")[0] == 200
        everybody = tree(process.pid) if Path("/proc/self/task").exists() else []
        for pid in everybody:
            for name in ("cmdline", "environ"):
                with contextlib.suppress(OSError):  # it has ended meanwhile
                    assert token not in Path(f"/proc/{pid}/{name}").read_bytes()
        assert not any(token in told for told in answers)
        # Everything it wrote is the user's alone, while it was there.
        assert seen
        assert {mode for kind, mode in seen if kind == "file"} == {0o600}
        assert {mode for kind, mode in seen if kind == "folder"} == {0o700}
        held = [file.read_bytes() for file in (*temp.rglob("*"), *home.rglob("*")) if file.is_file()]
        assert held
        assert not any(token in data for data in held)
        if os.geteuid() == 0:
            _stranger(tmp_path, temp, home)
        process.send_signal(signal.SIGINT)
        out, _ = process.communicate(timeout=120)
        assert process.returncode == 0
        log = errors.read_text()
        assert live.token not in log + out
        assert "POST /api/export 200" in log
        assert "Traceback" not in log
        assert list(temp.iterdir()) == []
        assert not any(Path(f"/proc/{pid}").exists() for pid in everybody)
    finally:
        process.kill()
        process.communicate()


def _stranger(place: Path, temp: Path, home: Path) -> None:
    """Another user sees none of it, though he may come as far as the folders around."""
    for folder in (place, *place.parents[:-1], temp, home):
        if os.stat(folder).st_uid == 0 and str(folder).startswith(str(place.parents[1])):
            folder.chmod(0o755)
    inner = [str(path) for path in (*temp.iterdir(), *home.iterdir())]
    done = subprocess.run(
        ["/usr/bin/env", "python3", "-c", STRANGER, *inner],
        user=65534,
        group=65534,
        extra_groups=[],
        cwd="/",
        env={"PATH": "/usr/local/bin:/usr/bin:/bin"},
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode in (126, 127):
        return  # no python3 that another user may run
    assert set(done.stdout.split()) == {"shut"}, done.stdout + done.stderr

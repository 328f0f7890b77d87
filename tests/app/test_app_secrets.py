"""Secrets: where the token may be and never is (W16), what another user can do (W17), start and end."""

from __future__ import annotations

import contextlib
import json
import logging
import os
import re
import signal
import socket
import stat
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest
from app_server import TOKEN, World, own, run

from lampyris.app.server import run as run_module
from lampyris.app.server.run import run_app
from lampyris.errors import UsageError

HERE = Path(__file__).parent
POSIX = pytest.mark.skipif(os.name != "posix", reason="modes, signals and other users of POSIX")

STARTED = """\
import asyncio
import sys
sys.path.insert(0, sys.argv[1])
from app_server import Engines, Library, Studies
from lampyris.app.engine.frames import json_frame
from lampyris.app.server.run import run_app
from lampyris.app.server.server import Services
class Ended(Engines):
    async def usual(self, question):
        while True:
            await asyncio.sleep(0.01)
            yield json_frame('P', {})
    async def close(self):
        print('engines ended', flush=True)
def services(folder):
    (folder / 'kept').write_text('something of the user')
    return Services(Ended(), Library(), dict, Studies())
sys.exit(run_app('guide', port=int(sys.argv[2]), browser=bool(sys.argv[3:]), services=services))
"""


@dataclass
class App:
    """A running app."""

    process: subprocess.Popen[str]
    address: str
    port: int
    token: str
    temp: Path
    errors: Path

    def end(self, word: int = signal.SIGINT) -> str:
        """End it; what it had to say."""
        self.process.send_signal(word)
        out, _ = self.process.communicate(timeout=60)
        return out

    def ask(self, head: str) -> bytes:
        """One request, without its Host."""
        with socket.create_connection(("127.0.0.1", self.port), 5) as wire:
            first, _, more = head.partition("\r\n")
            wire.sendall(f"{first}\r\nHost: 127.0.0.1:{self.port}\r\n{more}\r\n".encode())
            got = b""
            while piece := wire.recv(65536):
                got += piece
        return got


@contextlib.contextmanager
def started(folder: Path, port: int = 0, browser: str = "", debug: bool = False) -> Iterator[App]:
    """The app as a process of its own, with temporary files in a folder that can be looked at."""
    temp = folder / "temp"
    temp.mkdir(exist_ok=True)
    errors = folder / "stderr"
    more = {"TMPDIR": str(temp), "BROWSER": browser, "LAMPYRIS_DEBUG": "1" if debug else ""}
    with errors.open("w") as stderr:
        process = subprocess.Popen(
            [sys.executable, "-c", STARTED, str(HERE), str(port), *(["open"] if browser else [])],
            stdout=subprocess.PIPE,
            stderr=stderr,
            env={**os.environ, **more},
            text=True,
        )
    try:
        assert process.stdout is not None
        line = process.stdout.readline()
        found = re.fullmatch(r"lampyris app: (http://127\.0\.0\.1:(\d+)/#t=([0-9a-f]{64})&m=guide)\n", line)
        assert found, line + errors.read_text()
        at = int(found[2])
        until = time.monotonic() + 60
        app = App(process, found[1], at, found[3], temp, errors)
        while time.monotonic() < until:
            with contextlib.suppress(OSError):
                app.ask("GET / HTTP/1.1\r\n")
                break
        yield app
    finally:
        if process.poll() is None:
            process.kill()
        process.communicate()


def tree(pid: int) -> list[int]:
    """A process and those it started."""
    found = [pid]
    for child in Path(f"/proc/{pid}/task/{pid}/children").read_text().split():
        found += tree(int(child))
    return found


@POSIX
def test_the_token_is_where_it_must_be_and_nowhere_else(tmp_path: Path) -> None:
    recorder = tmp_path / "browser.py"
    seen = tmp_path / "seen"
    recorder.write_text(
        "import json, os, sys\nfrom urllib.request import url2pathname\n"
        "path = url2pathname(sys.argv[1].removeprefix('file://'))\n"
        "modes = [oct(os.stat(p).st_mode & 0o777) for p in (path, os.path.dirname(path))]\n"
        f"told = json.dumps((sys.argv, modes, open(path).read()))\npart = {str(seen)!r} + '.part'\n"
        f"open(part, 'w').write(told)\nos.rename(part, {str(seen)!r})\n"
    )
    with started(tmp_path, browser=f"{sys.executable} {recorder} %s", debug=True) as app:
        token = app.token.encode()
        answers = [
            app.ask(f"GET {path} HTTP/1.1\r\n{more}")
            for path in (
                "/",
                "/static/state.js",
                "/api/hello",
                f"/api/maps?t={app.token}",
                f"/{app.token}",
                "/x\t",
            )
            for more in ("", f"X-Lampyris-Token: {app.token}\r\n", "Origin: http://evil\r\n")
        ]
        assert any(answer.startswith(b"HTTP/1.1 200") for answer in answers)
        assert not any(token in answer for answer in answers)
        if Path("/proc/self/task").exists():
            for pid in tree(app.process.pid):
                assert token not in Path(f"/proc/{pid}/cmdline").read_bytes()
                assert token not in Path(f"/proc/{pid}/environ").read_bytes()
        until = time.monotonic() + 60
        while not seen.exists() and time.monotonic() < until:
            time.sleep(0.02)
        argv, modes, text = json.loads(seen.read_text())
        assert app.token not in " ".join(argv)
        assert modes == ["0o600", "0o700"]
        assert app.address.replace("&", "&amp;") in text
        for folder, folders, files in os.walk(app.temp):
            for name in folders:
                assert stat.S_IMODE((Path(folder) / name).stat().st_mode) == 0o700
            for name in files:
                assert stat.S_IMODE((Path(folder) / name).stat().st_mode) == 0o600
        said = app.end()
        assert "engines ended" in said
        assert app.process.returncode == 0
        log = app.errors.read_text()
        assert "GET /api/hello 200" in log
        assert "GET /*** 401" in log
        assert app.token not in log
        assert app.token not in said
        assert "Traceback" not in log
        assert list(app.temp.iterdir()) == []


@pytest.mark.nightly
@POSIX
def test_the_port_may_be_had_again_at_once_and_the_token_is_another(tmp_path: Path) -> None:
    with started(tmp_path) as first:
        # A connection that the server closes stays with the system for a minute.
        assert first.ask("GET / HTTP/1.1\r\n").startswith(b"HTTP/1.1 ")
        first.end()
    with started(tmp_path, first.port) as second:
        assert second.port == first.port
        assert second.token != first.token
        old = second.ask(f"GET /api/maps HTTP/1.1\r\nX-Lampyris-Token: {first.token}\r\n")
        assert old.startswith(b"HTTP/1.1 401")
        second.process.kill()
    with started(tmp_path, first.port) as third:
        assert third.port == first.port
        assert "engines ended" in third.end(signal.SIGTERM)
        assert third.process.returncode == 0


@pytest.mark.commit(1)
@POSIX
@pytest.mark.parametrize("word", [signal.SIGINT, signal.SIGTERM])
def test_ctrl_c_ends_a_server_that_streams(tmp_path: Path, word: int) -> None:
    with (
        started(tmp_path) as app,
        socket.create_connection(("127.0.0.1", app.port), 5) as half,
        socket.create_connection(("127.0.0.1", app.port), 5) as stream,
    ):
        half.sendall(b"POST /api/maps HTTP/1.1\r\nHost: ")  # and nobody goes on
        body = '{"scenario":{}}'
        stream.sendall(
            f"POST /api/simulate HTTP/1.1\r\nHost: 127.0.0.1:{app.port}\r\nX-Lampyris-Token: {app.token}\r\n"
            f"Content-Type: application/json\r\nContent-Length: {len(body)}\r\n\r\n{body}".encode()
        )
        assert stream.recv(12) == b"HTTP/1.1 200"
        assert "engines ended" in app.end(word)
        assert app.process.returncode == 0
        assert "Traceback" not in app.errors.read_text()
        assert list(app.temp.iterdir()) == []


STRANGER = """\
import os, sys, socket
for path in ('/api/hello', '/api/maps', '/api/maps/guide', '/api/plan', '/x'):
    for method in ('GET', 'POST'):
        wire = socket.create_connection(('127.0.0.1', int(sys.argv[1])))
        wire.sendall(f'{method} {path} HTTP/1.1\\r\\nHost: 127.0.0.1:{sys.argv[1]}\\r\\n\\r\\n'.encode())
        print(wire.recv(12).decode()[9:])
names = os.listdir(sys.argv[2])
for path in [os.path.join(sys.argv[2], name) for name in names] + [f'/proc/{sys.argv[3]}/fd']:
    try:
        print(os.listdir(path))
    except PermissionError:
        print('shut')
"""


@POSIX
@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() != 0, reason="only root can be somebody else")
def test_another_user_of_this_machine_gets_nothing() -> None:
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        folder.chmod(0o755)
        with started(folder, browser=f"{sys.executable} -c 1 %s") as app:
            app.temp.chmod(0o755)
            done = subprocess.run(
                [
                    "/usr/bin/env",
                    "python3",
                    "-c",
                    STRANGER,
                    str(app.port),
                    str(app.temp),
                    str(app.process.pid),
                ],
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
            pytest.skip("no python3 that another user may run")
        assert done.returncode == 0, done.stderr
        assert done.stdout.split() == ["401"] * 10 + ["shut"] * 2


@pytest.mark.parametrize(
    "path",
    [f"/api/{TOKEN}", "/a\r\nGET /forged 200", "/\x1b[31m", "/\u2028x", "/%0d%0aforged", "/" + "a" * 3000],
)
def test_a_line_of_the_log_is_one_line_and_no_command(path: str, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO, "lampyris.app")
    world = World()
    run(world.ask("GET", path, own()))
    run(world.ask("GE\x1b\nT", "/", own()))
    assert len(caplog.records) == 2
    for record in caplog.records:
        line = record.getMessage()
        assert line.isascii()
        assert line.isprintable()
        assert TOKEN not in line
        assert len(line) < 1000


def test_formatting_of_the_log_escapes_what_is_left() -> None:
    record = logging.LogRecord("x", logging.INFO, "", 0, "a\r\nb\x1b[1m\u2029", None, None)
    assert run_module._OneLine("%(message)s").format(record) == "a\\r\\nb\\x1b[1m\\u2029"


@pytest.mark.parametrize("name", ["", "A", "a b", "a/b", "a:80", "-a", "a..b", "é", "a\n", "a" * 300, "a@b"])
def test_names_to_let_others_in_under(name: str) -> None:
    with pytest.raises(UsageError, match="HOSTNAME"):
        run_app(allow_remote=name, services=lambda folder: World().services)


def test_a_folder_that_is_none(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="FOLDER"):
        run_app(folder=tmp_path / "none", services=lambda folder: World().services)


@pytest.mark.parametrize(("name", "warned"), [(None, False), ("robot.lan", True)])
def test_letting_others_in_is_said_aloud(
    name: str | None, warned: bool, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    seen = []

    async def serve(app: object, sockets: list[socket.socket], services: object, ends: object) -> None:
        seen.append((app, [s.getsockname()[0] for s in sockets]))

    monkeypatch.setattr(run_module, "_serve", serve)
    before = os.umask(0o022)
    try:
        assert run_app(browser=False, allow_remote=name, services=lambda folder: World().services) == 0
        assert os.umask(0o022) == 0o022  # as it was
    finally:
        os.umask(before)
    out, err = capsys.readouterr()
    assert ("not encrypted" in err) == warned
    assert f"lampyris app: http://{name or '127.0.0.1'}:" in out
    assert "/#t=" in out
    app, at = seen[0]
    assert (at[0] == "0.0.0.0") == warned
    assert any(str(host).startswith("robot.lan:") for host in app._door.hosts) == warned  # type: ignore[attr-defined]

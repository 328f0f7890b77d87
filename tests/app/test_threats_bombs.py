"""Threats: bombs one at a time and eight at once (W12), readers that do not read (W13); on a real server."""

from __future__ import annotations

import contextlib
import http.client
import json
import math
import os
import socket
import subprocess
import sys
import time
from collections.abc import AsyncIterator, Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from app_server import World, alive, asks, head, raw, rest, serving
from test_app_decode import BOMBS

from bad_inputs.pictures import packed_zeros
from lampyris.app.engine.frames import frame
from lampyris.app.server import listening
from lampyris.app.server.library import container
from sizes import some

MIB = 2**20
LINUX = pytest.mark.skipif(not Path("/proc/self/clear_refs").exists(), reason="needs /proc")

SERVER = """\
import sys
from pathlib import Path
sys.path.insert(0, sys.argv[1])
from app_server import Engines, Studies
from lampyris.app.server.library import Library
from lampyris.app.server.run import run_app
from lampyris.app.server.server import Services
home = Path(sys.argv[2])
run_app(browser=False, services=lambda _: Services(Engines(), Library(home, home / 'spool'), dict, Studies()))
"""


@dataclass
class Live:
    """A server with the real library."""

    pid: int
    port: int
    token: str

    def ask(self, path: str, body: bytes | None = None, kind: str = "json") -> tuple[int, bytes, float]:
        """Status, answer and seconds."""
        wire = http.client.HTTPConnection("127.0.0.1", self.port, timeout=120)
        headers = {"X-Lampyris-Token": self.token}
        if body is not None:
            headers["Content-Type"] = f"application/{kind}"
        began = time.monotonic()
        with contextlib.closing(wire):
            wire.request("GET" if body is None else "POST", path, body, headers)
            answer = wire.getresponse()
            return answer.status, answer.read(), time.monotonic() - began

    def memory(self, word: str = "VmRSS") -> int:
        """Bytes it holds now, or has ever held since the last :meth:`forget`."""
        with open(f"/proc/{self.pid}/status") as told:
            return next(1024 * int(line.split()[1]) for line in told if line.startswith(word))

    def forget(self) -> None:
        """Count the most that is held anew."""
        Path(f"/proc/{self.pid}/clear_refs").write_text("5")


@pytest.fixture(scope="module")
def live(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Live]:
    home = tmp_path_factory.mktemp("home")
    code = [sys.executable, "-c", SERVER, str(Path(__file__).parent), str(home)]
    env = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    with subprocess.Popen(code, stdout=subprocess.PIPE, text=True, env=env) as process:
        try:
            assert process.stdout is not None
            address = process.stdout.readline().split("http://127.0.0.1:")[1].strip()
            port, _, token = address.partition("/#t=")
            made = Live(process.pid, int(port), token)
            while True:
                with contextlib.suppress(OSError):
                    assert made.ask("/api/maps")[0] == 200
                    break
            made.ask("/api/maps", container({"a.png": b"x"}), "octet-stream")
            yield made
        finally:
            process.kill()


PNG = b"\x89PNG\r\n\x1a\n"
MAPS: dict[str, tuple[str, Callable[[], bytes]]] = {
    **{name: bomb for name, bomb in BOMBS.items() if name != "text line"},
    # Of these the first row is all there is, and its first cell is wrong.
    "csv of one row": ("a.csv", lambda: b"," * 15_000_000),
    "csv of one cell": ("a.csv", lambda: b"1" * 15_000_000),
    "plain pgm": ("a.pgm", lambda: b"P2\n4096 4096\n255\n" + b"1 " * 7_000_000),
    "zip in an npy": ("a.npy", lambda: b"PK\3\4" + packed_zeros(200)),
    "long names": ("a" * 250 + ".png", lambda: PNG + b"\0" * 2**20),
    "zeros": ("a.png", lambda: PNG + bytes(15_000_000)),
}
"""Files of at most 16 MiB that would like to be more."""


def text(name: str, content: str) -> bytes:
    """The request that holds a scenario's text."""
    return json.dumps({"name": name, "text": content}).encode()


def aliases() -> bytes:
    """YAML of nine to the ninth values."""
    lines = "".join(f"k{k}: &a{k + 1} [{','.join([f'*a{k}'] * 9)}]\n" for k in range(9))
    return text("a.yaml", "a: &a0 [x]\n" + lines)


SAID: dict[str, tuple[str, Callable[[], bytes]]] = {
    "aliases": ("/api/scenario", aliases),
    "brackets": ("/api/scenario", lambda: text("a.yaml", "a: " + "[" * 60_000)),
    "a long list": ("/api/scenario", lambda: text("a.yaml", "a: [" + "1," * 2_000_000 + "1]")),
    "deep json": ("/api/scenario", lambda: text("a.json", '{"a":' * 100_000)),
    "much json": ("/api/scenario", lambda: text("a.json", '{"a":[' + "1," * 2_000_000 + "1]}")),
    "digits": ("/api/scenario", lambda: text("a.json", '{"a":' + "9" * 5_000_000 + "}")),
    "deep question": ("/api/plan", lambda: b'{"scenario":' + b"[" * 400_000),
    "lists of nothing": ("/api/plan", lambda: b'{"scenario":[' + b"[]," * 2_600_000 + b"[]]}"),
    "tables of nothing": ("/api/layer", lambda: b'{"scenario":[' + b"{}," * 2_600_000 + b"{}]}"),
    "numbers": ("/api/simulate", lambda: b'{"scenario":[' + b"1," * 4_000_000 + b"1]}"),
    "a number": ("/api/export", lambda: b'{"scenario":' + b"1" * 8_000_000 + b"}"),
    "sixteen million": ("/api/study", lambda: b'{"scenario":"' + b"x" * 16_000_000 + b'"}'),
}
"""Scenarios and questions that would like to be more."""
BY_NAME = [*MAPS, *SAID]
ALIKE = (
    "csv of one row",
    "csv of one cell",
    "plain pgm",
    "zeros",
    "png of 13000 x 13000",
    "pgm of 60000 x 60000",
)
"""For the night, when one is thrown: larger or smaller ones of another's kind."""


def bomb(name: str) -> tuple[str, bytes, str]:
    """One of them as a request."""
    if name in SAID:
        path, made = SAID[name]
        return path, made(), "json"
    file, made = MAPS[name]
    return "/api/maps", container({file: made()}), "octet-stream"


def check_typed(status: int, told: bytes) -> None:
    """A refusal in a sentence, and not a fault of ours."""
    assert 400 <= status < 500, (status, told[:300])
    error = json.loads(told)["error"]
    assert error["code"].isupper()
    assert error["code"] not in ("CPU_LIMIT", "INTERNAL", "DECODER")
    assert error["what"]
    assert b"Traceback" not in told
    assert len(told) < 2000


def thrown(
    live: Live, which: list[tuple[str, bytes, str]], most: float = math.inf, others: float = math.inf
) -> None:
    """Throw some at once; each is refused in time, and a sound request is answered all the while.

    With every commit no clock judges: what a decoder may use of the processor is limited, and ``CPU_LIMIT`` is
    no answer to a bomb.
    """
    live.forget()
    before = live.memory()
    beats = []
    with ThreadPoolExecutor(len(which)) as pool:
        asked = [pool.submit(live.ask, path, body, kind) for path, body, kind in which]
        while not all(one.done() for one in asked) or not beats:
            status, _, took = live.ask("/api/maps/guide")
            assert status == 200
            beats.append(took)
            time.sleep(0.02)
    for one in asked:
        status, told, took = one.result()
        check_typed(status, told)
        assert took < most
    assert max(beats) < others, beats
    grown = live.memory("VmHWM") - before
    assert grown < 100 * MIB, f"{grown / MIB:.0f} MiB"


@pytest.mark.commit(4)
@LINUX
@pytest.mark.parametrize("name", some(sorted(BY_NAME, key=ALIKE.__contains__), len(BY_NAME) - len(ALIKE)))
def test_one_bomb(live: Live, name: str) -> None:
    thrown(live, [bomb(name)])


@pytest.mark.nightly
@LINUX
@pytest.mark.parametrize("seed", some(range(2)))
def test_eight_bombs_at_once(live: Live, seed: int) -> None:
    thrown(live, [bomb(name) for name in BY_NAME[seed::2][:8]])


@LINUX
@pytest.mark.nightly
def test_bombs_by_the_clock(live: Live) -> None:
    """On a machine that does nothing else: 2 s for a refusal, 1 s for others."""
    for name in BY_NAME:
        thrown(live, [bomb(name)], 2.0, 1.0)
    for name in BY_NAME:
        thrown(live, [bomb(name)] * 8, 16.0, 1.0)


# ---- readers that do not read --------------------


@contextlib.contextmanager
def impatient(world: World, seconds: float) -> Iterator[int]:
    """A server that waits so long for a reader."""
    usual = listening.Protocol.stall_seconds
    listening.Protocol.stall_seconds = seconds
    try:
        with serving(world) as (port, _):
            yield port
    finally:
        listening.Protocol.stall_seconds = usual


def flooding() -> World:
    """Engines that have always more to say."""
    world = World()

    async def flood(question: Any) -> AsyncIterator[bytes]:
        while True:
            yield frame("B", bytes(65536))

    world.engines.answer = flood
    return world


def ask_for_more(port: int) -> socket.socket:
    """Ask, and read nothing."""
    wire = socket.create_connection(("127.0.0.1", port), 20)
    sent = head(port, "POST", "/api/simulate", "Content-Length: 15").replace(b"octet-stream", b"json")
    wire.sendall(sent + b'{"scenario":{}}')
    return wire


def until(done: Any) -> bool:
    """Whether it comes true in a minute."""
    for _ in range(3000):
        if done():
            return True
        time.sleep(0.02)
    return False


def test_who_stays_and_does_not_read_is_let_go_and_the_engine_is_free() -> None:
    world = flooding()
    with impatient(world, 0.2) as port:
        with ask_for_more(port):
            assert until(lambda: world.engines.closed == 1)
        assert world.services.streams == 0
        alive(port)


def test_a_byte_now_and_then_is_not_reading() -> None:
    world = flooding()
    with impatient(world, 0.2) as port, ask_for_more(port) as wire:

        def sip() -> bool:
            with contextlib.suppress(OSError):
                wire.recv(16)
            return world.engines.closed == 1

        assert until(sip)


@pytest.mark.nightly
def test_who_reads_slowly_is_waited_for() -> None:
    """Five times as long as one who does not read; the reader, a thread, need not get its turn at once."""
    world = flooding()
    with impatient(world, 2.0) as port, ask_for_more(port) as wire:
        for _ in range(30):
            got = 0
            while got < listening.SEND_BUFFER:
                got += len(piece := wire.recv(2**18))
                assert piece
            time.sleep(0.35)
        assert world.engines.closed == 0
        assert world.services.streams == 1


def test_an_answer_that_is_over_does_not_wait_for_its_reader() -> None:
    """The last bytes too: else 32 strangers who ask and never read would shut everybody out."""
    world = World()

    async def much(question: Any) -> AsyncIterator[bytes]:
        yield frame("B", bytes(16 * MIB))

    world.engines.answer = much
    with impatient(world, 0.2) as port:
        held = [ask_for_more(port) for _ in range(4)]
        state = world.server.server_state  # type: ignore[attr-defined]
        assert until(lambda: world.engines.closed == 4 and not state.connections)
        for wire in held:
            with contextlib.suppress(OSError):
                rest(wire)
            wire.close()
        alive(port)


@pytest.mark.nightly
def test_large_bodies_wait_for_one_another_and_small_ones_do_not() -> None:
    """Thirty-two bodies of 16 MiB are half a gigabyte; two are held, and the rest stays with the clients."""
    world = World()
    with serving(world) as (port, _), contextlib.ExitStack() as wires:
        first = head(port, "POST", "/api/maps", f"Content-Length: {2 * MIB}")
        slow = [wires.enter_context(socket.create_connection(("127.0.0.1", port), 20)) for _ in range(4)]
        for wire in slow[:2]:
            wire.sendall(first + b"x" * MIB)
        door = world.server.config.app  # type: ignore[attr-defined]
        assert until(door._large.locked)
        for wire in slow[2:]:
            wire.sendall(first + b"x" * 2 * MIB)
        # Those who wait keep nobody else from being answered, and are not answered themselves.
        bytes_ = {"Content-Type": "application/octet-stream"}
        assert asks(port, "POST", "/api/maps", b"x" * 1000, **bytes_)[0] == 200
        time.sleep(0.2)
        assert world.library.changes == [("add", 1000)]
        for wire in slow[:2]:
            wire.sendall(b"x" * MIB)
        assert [rest(wire).split()[1] for wire in slow] == [b"200"] * 4
        # One that leaves while it waits takes no turn with it.
        left = socket.create_connection(("127.0.0.1", port), 20)
        left.sendall(first)
        left.close()
        for _ in range(3):
            got = raw(port, first + b"x" * 2 * MIB)
            assert got.startswith(b"HTTP/1.1 200")

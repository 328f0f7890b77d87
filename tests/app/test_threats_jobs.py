"""Threats: jobs that never end, grow, fork, crash or are left alone (W15), and engines that lie (W19)."""

from __future__ import annotations

import asyncio
import json
import os
import signal
import struct
import subprocess
import sys
import textwrap
import time
from pathlib import Path
from typing import Any, cast

import pytest
from app_server import World, asks
from test_app_engine import LINUX, ODD, alive, first, gone, run, unframed, whole
from test_threats_bombs import ask_for_more, impatient, until

from lampyris.app.engine.frames import frame, json_frame
from lampyris.app.server.engines import GRACE, Engines
from lampyris_selfcheck.reference.files.watching import Readings
from sizes import some

SLACK = 2.0
"""Seconds after its limit in which a job is over."""


@pytest.mark.commit(2)
@LINUX
@pytest.mark.parametrize(
    ("then", "close"),
    some(
        [
            ("crash", True),
            ("sleep", False),
            ("wait", True),
            ("left", False),
            ("crash", False),
            ("spin", True),
        ],
        4,
    ),
)
def test_what_a_job_started_ends_with_its_engine(then: str, close: bool) -> None:
    """Also where the others hold the pipe on which the engine answers."""

    async def ask() -> tuple[list[bool], Any, Any]:
        engines = Engines(1, command=ODD, seconds=1)
        said = {"verb": "fork", "then": "sleep" if then == "left" else then, "close": close}
        answer = engines.ask(said)
        head = await first(answer)
        frames = []
        if then in ("sleep", "wait"):
            stopping = asyncio.ensure_future(engines.cancel(head["job"]))
            frames = [unframed(piece) async for piece in answer]
            await stopping
        elif then == "left":
            await answer.aclose()  # type: ignore[attr-defined]
        else:
            frames = [unframed(piece) async for piece in answer]
        after = await whole(engines, verb="quick")
        await engines.close()
        return [await gone(pid) for pid in head["some"]], frames, after[-1][0]

    ends, frames, after = run(ask())
    assert ends == [True] * 3
    assert after == "Z"
    codes = {"crash": "ENGINE", "spin": "CPU_LIMIT", "sleep": "CANCELLED", "wait": "CANCELLED"}
    if then != "left":
        assert frames[-1][1]["code"] == codes[then]


@pytest.mark.commit(1)
@LINUX
@pytest.mark.parametrize("then", ["sleep", "tell"])
@pytest.mark.parametrize("word", [signal.SIGKILL, signal.SIGTERM])
def test_when_the_server_goes_nobody_is_left(word: int, then: str) -> None:
    """Also where the engine finds out by an answer that nobody takes, before it hears that questions end."""
    code = textwrap.dedent(f"""
        import asyncio, json
        from lampyris.app.server.engines import Engines
        async def main():
            engines = Engines(1, command={ODD!r})
            answer = engines.ask({{"verb": "fork", "then": {then!r}, "close": True}})
            head = json.loads((await anext(answer))[5:])
            print(head["pid"], *head["some"], flush=True)
            await asyncio.sleep(1000)
        asyncio.run(main())
    """)
    server = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)
    assert server.stdout is not None
    pids = [int(pid) for pid in server.stdout.readline().split()]
    assert len(pids) == 4
    assert all(map(alive, pids))
    os.kill(server.pid, word)
    server.wait()
    server.stdout.close()
    assert [asyncio.run(gone(pid)) for pid in pids] == [True] * 4


ENDLESS = {
    # What is asked, the limit in seconds of what counts, and how it is told.
    "never ends": ({"verb": "spin"}, 1.0, "CPU_LIMIT"),
    "does not listen": ({"verb": "sleep"}, GRACE, "CANCELLED"),
    "says nothing": ({"verb": "mute"}, 0.5, "ENGINE"),
    "crashes": ({"verb": "crash"}, 0.0, "ENGINE"),
    "takes 10 GB": ({"verb": "grow"}, 0.0, "MEMORY"),
}


def ended(name: str) -> float:
    """Ask for a job without an end; the seconds until it was over, the next one being answered.

    Of the clock; of the processor where that is what is limited, which others slow down less.
    """
    import resource

    said, _, code = ENDLESS[name]

    def used() -> float:
        return sum(resource.getrusage(resource.RUSAGE_CHILDREN)[:2])

    async def ask() -> float:
        engines = Engines(1, command=ODD, seconds=1, memory=2**28)
        await whole(engines, verb="quick")
        usual = engines.silence
        if name == "says nothing":
            engines.silence = 0.5
        began, before = time.monotonic(), used()
        answer = engines.ask(said)
        kind, told = unframed(await anext(answer))
        stopping = asyncio.ensure_future(engines.cancel(told["job"])) if "job" in told else None
        async for piece in answer:
            kind, told = unframed(piece)
        took, worked = time.monotonic() - began, used() - before
        if stopping:
            await stopping
        engines.silence = usual  # an engine that has to start first may take longer than half a second
        after = await whole(engines, verb="quick")
        await engines.close()
        assert (kind, told["code"], after[-1][0]) == ("X", code, "Z")
        return worked if name == "never ends" else took

    return float(run(ask()))


@pytest.mark.nightly
@pytest.mark.commit(1)
@LINUX
@pytest.mark.parametrize("name", ENDLESS)
def test_a_job_without_an_end_is_ended_and_the_next_one_is_answered(name: str) -> None:
    ended(name)


@LINUX
@pytest.mark.nightly
@pytest.mark.parametrize("name", ENDLESS)
def test_a_job_is_over_within_two_seconds_of_its_limit(name: str) -> None:
    """At the least of some readings, where the first is too much."""
    most = ENDLESS[name][1] + SLACK
    assert Readings().least(lambda: ended(name), lambda took: took, most) < most


@LINUX
def test_temporary_files_of_an_engine_that_is_ended_are_in_the_servers_folder(tmp_path: Path) -> None:
    async def ask() -> str:
        engines = Engines(1, command=ODD, folder=tmp_path)
        frames = await whole(engines, verb="place")
        await engines.close()
        return str(frames[-1][1]["place"])

    assert run(ask()) == str(tmp_path)


# ---- engines that are somebody else (W19) --------------------

LIES = {
    "another job's answer": struct.pack("<II", 5, 999) + frame("Z", b"")[:5],
    "an answer that is over": struct.pack("<II", 0, 0),
    "an oversize frame": struct.pack("<II", 2**31, 1),
    "a pickle": b"\x80\x04\x95\x1c\x00\x00\x00\x00\x00\x00\x00cos\nsystem\n(S'true'\ntR.",
    "half a head": b"\x01\x02\x03",
    "text": b"HTTP/1.1 200 OK\r\n\r\n",
    "nothing": b"",
}
LIAR = """
import sys
head = sys.stdin.buffer.read(4)
sys.stdin.buffer.read(int.from_bytes(head, "little"))
sys.stdout.buffer.write(bytes.fromhex(sys.argv[1]))
sys.stdout.buffer.flush()
"""
UNPICKLED: list[object] = []
sys.addaudithook(lambda event, given: UNPICKLED.append(given) if event == "pickle.find_class" else None)


@pytest.mark.parametrize("data", LIES.values(), ids=list(LIES))
def test_an_engine_that_lies_is_not_believed(data: bytes) -> None:
    """Forged, late, oversize and foreign answers end the engine, and are an error of one line."""
    before = len(UNPICKLED)

    async def ask() -> list[tuple[str, Any]]:
        engines = Engines(1, command=(sys.executable, "-c", LIAR, data.hex()))
        frames = [await whole(engines, verb="quick"), await whole(engines, verb="quick")]
        await engines.close()
        assert len(frames[0]) == len(frames[1]) == 1
        return [found[0] for found in frames]

    for kind, told in run(ask()):
        assert (kind, told["code"]) == ("X", "ENGINE")
        assert "Traceback" not in json.dumps(told)
    assert len(UNPICKLED) == before


def test_the_hook_sees_what_is_unpickled() -> None:
    import pickle

    before = len(UNPICKLED)
    pickle.loads(pickle.dumps(struct.Struct))
    assert len(UNPICKLED) == before + 1


def test_a_late_answer_is_not_the_next_ones() -> None:
    """What an engine still says of a job after its end is not taken for the next job's."""

    async def ask() -> list[tuple[str, Any]]:
        engines = Engines(1, command=ODD)
        await whole(engines, verb="late")
        found = await whole(engines, verb="quick", said="mine")
        again = await whole(engines, verb="quick", said="mine")
        await engines.close()
        return [*found, *again]

    frames = run(ask())
    assert all(told.get("said") in ("mine", None) for _, told in frames), frames
    assert frames[0][0] == "X"
    assert frames[0][1]["code"] == "ENGINE"
    assert frames[1] == ("Z", frames[1][1])


def test_the_engines_have_no_port() -> None:
    """They listen nowhere: what they hear is what the server writes into their pipe."""
    if not Path("/proc/net/tcp").exists():
        pytest.skip("needs /proc")

    async def ask() -> tuple[list[str], int]:
        engines = Engines(2, command=ODD)
        answers = [engines.ask({"verb": "wait"}) for _ in range(2)]
        pids = [(await first(answer))["pid"] for answer in answers]
        links = [
            os.readlink(f"/proc/{pid}/fd/{number}")
            for pid in pids
            for number in os.listdir(f"/proc/{pid}/fd")
            if os.path.lexists(f"/proc/{pid}/fd/{number}")
        ]
        await engines.close()
        return links, len(pids)

    links, engines = run(ask())
    tables = [Path(f"/proc/net/{name}") for name in ("tcp", "tcp6", "udp", "udp6")]
    known = {row.split()[9] for path in tables for row in path.read_text().splitlines()[1:]}
    sockets = {link.removeprefix("socket:[").rstrip("]") for link in links if link.startswith("socket:")}
    assert engines == 2
    assert not sockets & known
    assert json_frame("Z", {})


def test_who_does_not_read_keeps_nobody_from_planning() -> None:
    """Two who read nothing hold both engines; plans are answered, runs once these are let go."""
    world = World(engines=cast(Any, Engines(2, command=ODD)))
    scenario: dict[str, Any] = {"scenario": {}}
    with impatient(world, 600.0) as port:
        held = [ask_for_more(port) for _ in range(2)]
        assert until(lambda: world.services.streams == 2)
        for _ in range(5):
            assert asks(port, "POST", "/api/plan", scenario)[0] == 200
        assert world.services.streams == 2
        for wire in held:
            wire.close()
        assert until(lambda: world.services.streams == 0)
    world = World(engines=cast(Any, Engines(2, command=ODD)))
    with impatient(world, 0.5) as port:
        held = [ask_for_more(port) for _ in range(2)]
        # What waits behind them has its turn when their half a second is over.
        assert asks(port, "POST", "/api/make", {"map": {}})[0] == 200
        for wire in held:
            wire.close()

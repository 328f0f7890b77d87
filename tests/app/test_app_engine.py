"""Engines: limits, turns, cancelling, ends; nothing is left running, anyone who ends (W15, W19)."""

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
from collections.abc import AsyncIterator, Coroutine
from pathlib import Path
from typing import Any

import pytest

from lampyris.app.engine.frames import json_frame
from lampyris.app.server.engines import Busy, Engines, _Engine
from sizes import some

ODD = (sys.executable, str(Path(__file__).with_name("odd_engine.py")))
LINUX = pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="needs /proc")


def run(work: Coroutine[Any, Any, Any]) -> Any:
    async def soon() -> Any:
        async with asyncio.timeout(600):
            return await work

    return asyncio.run(soon())


async def whole(engines: Engines, **question: Any) -> list[tuple[str, Any]]:
    return [unframed(piece) async for piece in engines.ask(question)]


def unframed(piece: bytes) -> tuple[str, Any]:
    (size,) = struct.unpack_from("<I", piece)
    assert size == len(piece) - 4
    kind = chr(piece[4])
    return kind, json.loads(piece[5:]) if kind in "HEZXPS" else piece[5:]


def alive(pid: int) -> bool:
    try:
        with open(f"/proc/{pid}/stat") as told:
            return told.read().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


async def gone(pid: int) -> bool:
    for _ in range(200):
        if not alive(pid):
            return True
        await asyncio.sleep(0.01)
    return False


def test_an_engine_that_is_asked_while_it_starts_is_one_process() -> None:
    async def both() -> tuple[Any, Any]:
        engine = _Engine((sys.executable, "-c", "import sys; sys.stdin.read()"))
        found = await asyncio.gather(engine.start(), engine.start())
        await engine.close()
        return found[0], found[1]

    one, other = run(both())
    assert one is other


async def first(answer: AsyncIterator[bytes]) -> dict[str, Any]:
    kind, head = unframed(await anext(answer))
    assert kind == "H"
    return head  # type: ignore[no-any-return]


def test_an_answer_is_that_of_its_own_question_and_the_engine_is_kept() -> None:
    async def ask() -> tuple[Any, Any]:
        engines = Engines(2, command=ODD)
        many = await asyncio.gather(*(whole(engines, verb="quick", said=k) for k in range(9)))
        await engines.close()
        return [frames[-1][1]["said"] for frames in many], {frames[-1][1]["pid"] for frames in many}

    said, pids = run(ask())
    assert said == list(range(9))
    assert len(pids) <= 2


def test_more_than_two_and_eight_are_refused() -> None:
    async def ask() -> tuple[str, list[Any]]:
        engines = Engines(2, 8, command=ODD)
        running = [engines.ask({"verb": "wait"}) for _ in range(2)]
        jobs = [(await first(answer))["job"] for answer in running]
        waiting = [asyncio.ensure_future(whole(engines, verb="quick", said=k)) for k in range(8)]
        await asyncio.sleep(0)
        with pytest.raises(Busy) as refused:
            await whole(engines, verb="quick")
        for job in jobs:
            await engines.cancel(job)
        for answer in running:
            assert unframed(await anext(answer))[1]["code"] == "CANCELLED"
            assert [piece async for piece in answer] == []
        done = [frames[-1][1]["said"] for frames in await asyncio.gather(*waiting)]
        await engines.close()
        return refused.value.code, done

    assert run(ask()) == ("BUSY", list(range(8)))
    told = Busy(2, 8)
    assert ("busy" in told.what, "try again" in told.todo) == (True, True)


@pytest.mark.nightly
def test_plans_and_layers_never_wait_for_what_takes_long() -> None:
    """All that may run and wait of the long ones does; plans are answered, also while a layer is made."""

    async def ask() -> tuple[list[str], list[str], list[str], Any]:
        engines = Engines(2, 2, command=ODD)
        running = [engines.ask({"verb": "wait"}) for _ in range(2)]
        heads = [await first(answer) for answer in running]
        waiting = [asyncio.ensure_future(whole(engines, verb="quick")) for _ in range(2)]
        await asyncio.sleep(0)
        plans = [(await whole(engines, verb="plan"))[-1][0] for _ in range(5)]
        layer = engines.ask({"verb": "layer"})
        job = (await first(layer))["job"]
        late = [asyncio.ensure_future(whole(engines, verb="plan")) for _ in range(2)]
        await asyncio.sleep(0)
        with pytest.raises(Busy):
            await whole(engines, verb="plan")
        await engines.cancel(job)
        left = [unframed(piece)[1]["code"] async for piece in layer]
        plans += [frames[-1][0] for frames in await asyncio.gather(*late)]
        still = [one.done() for one in waiting]
        # An engine for short questions takes no long one, though it has nothing to do.
        pids = {(await whole(engines, verb="plan"))[-1][1]["pid"] for _ in range(3)}
        assert not pids & {head["pid"] for head in heads}
        for head in heads:
            await engines.cancel(head["job"])
        codes = [unframed(await anext(answer))[1]["code"] for answer in running]
        for answer in running:
            assert [piece async for piece in answer] == []
        await asyncio.gather(*waiting)
        done = {one.result()[-1][1]["pid"] for one in waiting}
        await engines.close()
        return plans, left + codes, [str(any(still))], done & pids

    plans, codes, still, both = run(ask())
    assert plans == ["Z"] * 7
    assert codes == ["CANCELLED"] * 3
    assert still == ["False"]
    assert not both


@pytest.mark.nightly
def test_plans_use_the_others_while_these_are_idle() -> None:
    async def ask() -> int:
        engines = Engines(2, command=ODD)
        layers = [engines.ask({"verb": "layer"}) for _ in range(2)]
        pids = {(await first(layer))["pid"] for layer in layers}
        pids.add((await whole(engines, verb="plan"))[-1][1]["pid"])
        for layer in layers:
            await layer.aclose()  # type: ignore[attr-defined]
        await engines.close()
        return len(pids)

    assert run(ask()) == 3


@pytest.mark.commit(1)
@LINUX
@pytest.mark.parametrize("wanted", [False, True])
def test_a_kill_is_want_of_memory_only_if_the_system_says_so(
    wanted: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    told = tmp_path / "vmstat"
    told.write_text("nr_free_pages 7\noom_kill 3\n")
    monkeypatch.setattr(
        "lampyris._core.system.MEMORY_KILLS", ((str(told), "oom_kill"), ("/nowhere", "oom_kill"))
    )

    async def ask() -> Any:
        engines = Engines(1, command=ODD)
        answer = engines.ask({"verb": "sleep"})
        head = await first(answer)
        if wanted:
            told.write_text("nr_free_pages 7\noom_kill 4\n")
        os.kill(head["pid"], signal.SIGKILL)
        kind, error = unframed(await anext(answer))
        assert [piece async for piece in answer] == []
        after = await whole(engines, verb="quick")
        await engines.close()
        return kind, error, after[-1][0]

    kind, error, after = run(ask())
    assert (kind, after) == ("X", "Z")
    assert error["code"] == ("MEMORY" if wanted else "ENGINE")
    assert ("memory" in error["what"]) == wanted


def test_who_waits_can_be_cancelled_and_can_leave() -> None:
    async def ask() -> tuple[Any, Any]:
        engines = Engines(1, 2, command=ODD)
        running = engines.ask({"verb": "wait"})
        job = (await first(running))["job"]
        one, other = (asyncio.ensure_future(whole(engines, verb="quick")) for _ in range(2))
        await asyncio.sleep(0)
        await engines.cancel(job + 1)
        cancelled = await one
        other.cancel()
        await asyncio.gather(other, return_exceptions=True)
        await running.aclose()  # type: ignore[attr-defined]
        after = await whole(engines, verb="quick", said="next")
        await engines.close()
        return cancelled, after

    cancelled, after = run(ask())
    assert [(kind, told["code"]) for kind, told in cancelled] == [("X", "CANCELLED")]
    assert after[-1][1]["said"] == "next"


@LINUX
@pytest.mark.parametrize("verb", some(["wait", "sleep"]))
def test_a_reader_that_leaves_ends_the_job(verb: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("lampyris.app.server.engines.GRACE", 5.0)

    async def ask() -> tuple[bool, bool]:
        engines = Engines(1, command=ODD)
        answer = engines.ask({"verb": verb})
        pid = (await first(answer))["pid"]
        began = time.monotonic()
        await answer.aclose()  # type: ignore[attr-defined]
        left = time.monotonic() - began
        after = (await whole(engines, verb="quick"))[-1][1]["pid"]
        await engines.close()
        assert verb == "wait" or left < 0.8 * 5.0, "who leaves does not wait"
        return after == pid, await gone(after) and await gone(pid)

    same, all_gone = run(ask())
    # What stops by itself is kept; what does not is killed and started anew.
    assert same == (verb == "wait")
    assert all_gone


@LINUX
def test_a_job_that_does_not_stop_is_killed() -> None:
    async def ask() -> Any:
        engines = Engines(1, command=ODD)
        answer = engines.ask({"verb": "sleep"})
        head = await first(answer)
        stopping = asyncio.ensure_future(engines.cancel(head["job"]))
        kind, told = unframed(await anext(answer))
        await stopping
        after = await whole(engines, verb="quick")
        dead = await gone(head["pid"])
        await engines.close()
        return kind, told["code"], after[-1][0], dead

    assert run(ask()) == ("X", "CANCELLED", "Z", True)


async def in_loop(engines: Engines, mark: Path) -> tuple[AsyncIterator[bytes], dict[str, Any]]:
    """A job that is within a compiled loop, and its head."""
    mark.write_bytes(b"\0")
    answer = engines.ask({"verb": "loop", "file": str(mark)})
    head = await first(answer)
    while mark.read_bytes() != b"\1":
        await asyncio.sleep(0.01)
    return answer, head


async def rest(answer: AsyncIterator[bytes]) -> list[tuple[str, Any]]:
    return [unframed(piece) async for piece in answer]


def test_a_job_within_a_compiled_loop_hears_that_it_is_cancelled(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The loop ends for nothing else: the next jobs find its process only if it was not killed. The first of
    them is within the loop as well, and is not stopped by a cancellation of the one before."""
    monkeypatch.setattr("lampyris.app.server.engines.GRACE", 20.0)  # others may have all processors meanwhile

    async def ask() -> Any:
        engines = Engines(1, quick=0, command=ODD)
        codes, pids = [], set()
        for k in range(2):
            answer, head = await in_loop(engines, tmp_path / f"mark{k}")
            ended = asyncio.ensure_future(rest(answer))
            for other in (head["job"] - 1, head["job"] + 1, 0):
                await engines._all[0].cancel(other)
            assert not (await asyncio.wait({ended}, timeout=0.3))[0]
            await engines.cancel(head["job"])
            codes += [told.get("code") for kind, told in await ended if kind != "P"]
            pids.add(head["pid"])
        pids.add((await whole(engines, verb="quick"))[-1][1]["pid"])
        await engines.close()
        return codes, pids

    codes, pids = run(ask())
    assert codes == ["CANCELLED"] * 2
    assert len(pids) == 1


@pytest.mark.nightly
def test_who_leaves_a_job_within_a_compiled_loop_leaves_the_engine_free(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("lampyris.app.server.engines.GRACE", 20.0)

    async def ask() -> tuple[int, int]:
        engines = Engines(1, quick=0, command=ODD)
        answer, head = await in_loop(engines, tmp_path / "mark")
        await answer.aclose()  # type: ignore[attr-defined]
        after = (await whole(engines, verb="quick"))[-1][1]["pid"]
        await engines.close()
        return head["pid"], after

    before, after = run(ask())
    assert after == before


def test_a_job_that_is_cancelled_before_its_turn_is_not_begun() -> None:
    """Two questions at once, as no server sends them; the second is cancelled while the first is answered."""
    sent = ({"job": 1, "verb": "wait"}, {"job": 2, "verb": "wait"}, {"cancel": 2}, {"cancel": 1})
    engine = subprocess.Popen((*ODD, "60", str(2**30)), stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    assert engine.stdin is not None
    assert engine.stdout is not None
    for said in sent:
        data = json.dumps(said).encode()
        engine.stdin.write(struct.pack("<I", len(data)) + data)
    engine.stdin.flush()
    told = []
    while len(told) < 2:
        size, job = struct.unpack("<II", engine.stdout.read(8))
        piece = engine.stdout.read(size)
        if size and piece[4:5] == b"X":
            told.append((job, json.loads(piece[5:])["code"]))
        assert not (job == 2 and piece[4:5] == b"H")
    engine.stdin.close()
    engine.stdout.close()
    engine.wait(30)
    assert told == [(1, "CANCELLED"), (2, "CANCELLED")]


@pytest.mark.nightly
@LINUX
def test_processor_time_has_its_limit() -> None:
    async def ask() -> Any:
        engines = Engines(1, command=ODD, seconds=1)
        frames = await whole(engines, verb="spin")
        after = await whole(engines, verb="quick")
        await engines.close()
        return frames[-1], after[-1][0]

    (kind, told), after = run(ask())
    assert (kind, told["code"], after) == ("X", "CPU_LIMIT", "Z")
    assert "1 seconds" in told["what"]


@LINUX
def test_memory_has_its_limit_and_others_are_answered() -> None:
    async def ask() -> Any:
        engines = Engines(2, command=ODD, memory=2**28)
        big, small = await asyncio.gather(whole(engines, verb="grow"), whole(engines, verb="quick"))
        again = await whole(engines, verb="grow")
        await engines.close()
        return big[-1], again[-1], small[-1][0]

    big, again, small = run(ask())
    assert (big[0], big[1]["code"]) == ("X", "MEMORY")
    assert again == big
    assert small == "Z"


@pytest.mark.commit(1)
@pytest.mark.parametrize(("verb", "code"), [("crash", "ENGINE"), ("forge", "ENGINE"), ("fault", "INTERNAL")])
def test_an_engine_that_ends_or_talks_nonsense_is_told_of_and_replaced(verb: str, code: str) -> None:
    async def ask() -> Any:
        engines = Engines(1, command=ODD)
        frames = await whole(engines, verb=verb)
        after = await whole(engines, verb="quick")
        await engines.close()
        return frames[-1], after

    (kind, told), after = run(ask())
    assert (kind, told["code"]) == ("X", code)
    assert "Traceback" not in json.dumps(told)
    assert [k for k, _ in after] == ["Z"]


@pytest.mark.nightly
def test_who_reads_slowly_holds_the_engine_back(tmp_path: Path) -> None:
    async def ask() -> tuple[int, int]:
        engines = Engines(1, command=ODD)
        told = tmp_path / "told"
        answer = engines.ask({"verb": "pour", "file": str(told)})
        await anext(answer)
        before, now = -1, 0
        while before != now or not now:
            await asyncio.sleep(0.2)
            before, now = now, int((told.read_text() if told.exists() else "") or 0)
        rest = [len(piece) async for piece in answer]
        await engines.close()
        return before, len(rest)

    poured, rest = run(ask())
    assert poured < 20
    assert rest == 100


@LINUX
def test_closing_leaves_nobody() -> None:
    async def ask() -> bool:
        engines = Engines(2, command=ODD)
        heads = [await first(engines.ask({"verb": verb})) for verb in ("wait", "sleep")]
        await engines.close()
        return all([await gone(head["pid"]) for head in heads])

    assert run(ask())


@LINUX
def test_when_the_server_is_killed_its_engines_end() -> None:
    code = textwrap.dedent(f"""
        import asyncio, json
        from lampyris.app.server.engines import Engines
        async def main():
            engines = Engines(2, command={ODD!r})
            answers = [engines.ask({{"verb": verb}}) for verb in ("wait", "sleep")]
            pids = [json.loads((await anext(a))[5:])["pid"] for a in answers]
            print(*pids, flush=True)
            await asyncio.sleep(1000)
        asyncio.run(main())
    """)
    server = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)
    assert server.stdout is not None
    pids = [int(word) for word in server.stdout.readline().split()]
    assert len(pids) == 2
    assert all(map(alive, pids))
    os.kill(server.pid, signal.SIGKILL)
    server.wait()
    server.stdout.close()
    assert all(asyncio.run(gone(pid)) for pid in pids)


FORGED = {
    "no json": struct.pack("<I", 4) + b"{{{{",
    "a pickle": struct.pack("<I", 12) + b"\x80\x04cos\nsystem\n.",
    "a list": struct.pack("<I", 2) + b"[]",
    "no number": struct.pack("<I", 11) + b'{"job":"x"}',
    "oversize": struct.pack("<I", 2**31) + b"{}",
    "cancels no number": struct.pack("<I", 14) + b'{"cancel":[1]}',
    "empty": struct.pack("<I", 0),
    "cut short": struct.pack("<I", 100) + b"{}",
}


@pytest.mark.commit(1)
@pytest.mark.parametrize("data", FORGED.values(), ids=list(FORGED))
def test_an_engine_that_is_sent_nonsense_ends_without_a_word(data: bytes) -> None:
    done = subprocess.run(ODD, input=data, capture_output=True, timeout=120, check=False)
    assert done.stdout == b""
    assert b"Traceback" not in done.stderr


def test_a_question_that_is_too_large_is_not_sent() -> None:
    async def ask() -> str:
        engines = Engines(1, command=ODD)
        try:
            await whole(engines, verb="quick", said="x" * 2**26)
        except Exception as fault:
            return str(getattr(fault, "code", fault))
        finally:
            await engines.close()
        return ""

    assert run(ask()) == "QUESTION_SIZE"


def test_nothing_of_the_app_unpickles_or_evaluates() -> None:
    import lampyris.app as room

    for path in Path(str(room.__file__)).parent.glob("*.py"):
        text = path.read_text(encoding="utf-8")
        for word in ("import pickle", "import marshal", "import shelve", "eval(", "exec(", "shell=True"):
            assert word not in text.replace("subprocess_exec(", "").replace("create_subprocess_exec", ""), (
                path
            )


def test_frames_hold_what_json_can() -> None:
    assert unframed(json_frame("Z", {"a": None})) == ("Z", {"a": None})
    with pytest.raises(ValueError, match="JSON"):
        json_frame("Z", float("nan"))

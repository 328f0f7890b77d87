"""Chromium driven through its pipe, with nothing of the browser's tools switched on but what is asked for.

A browser whose network is watched, as Playwright's is, keeps the bodies of what a page was sent: 200 answers
of 50 kB and their garbage collected, the page's process had grown by 10 MB; unwatched, by none. So memory is
measured with this.
"""

from __future__ import annotations

import json
import os
import subprocess
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from benchmarks import app_stage as stage

START = 4.0
"""Seconds a page may take before its document is there."""


class Page:
    """One page, with the few of Playwright's methods that measuring memory needs."""

    def __init__(self, send: int, heard: int) -> None:
        self._send, self._heard = send, heard
        self._rest, self._number, self._session = b"", 0, ""
        self._snapshot: list[str] = []
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        self._session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]

    def call(self, method: str, **params: Any) -> dict[str, Any]:
        """One command and its answer; of other messages only parts of a snapshot of the heap are kept."""
        self._number += 1
        message: dict[str, Any] = {"id": self._number, "method": method, "params": params}
        if self._session:
            message["sessionId"] = self._session
        os.write(self._send, json.dumps(message).encode() + b"\0")
        while True:
            while b"\0" not in self._rest:
                told = os.read(self._heard, 1 << 16)
                if not told:
                    raise RuntimeError("the browser has gone")
                self._rest += told
            one, self._rest = self._rest.split(b"\0", 1)
            answer = json.loads(one)
            if answer.get("method") == "HeapProfiler.addHeapSnapshotChunk":
                self._snapshot.append(answer["params"]["chunk"])
            if answer.get("id") == self._number:
                if "error" in answer:
                    raise RuntimeError(f"{method}: {answer['error']}")
                result: dict[str, Any] = answer["result"]
                return result

    def goto(self, address: str) -> None:
        """Open an address and wait until its document is complete."""
        self.call("Page.navigate", url=address)
        end = time.monotonic() + START
        while self.evaluate("document.readyState") != "complete" and time.monotonic() < end:
            self.wait_for_timeout(50)

    def evaluate(self, expression: str, argument: Any = None) -> Any:
        """What an expression, or a function of the argument, comes to."""
        code = expression if argument is None else f"({expression})({json.dumps(argument)})"
        told = self.call("Runtime.evaluate", expression=code, returnByValue=True, awaitPromise=True)
        if "exceptionDetails" in told:
            raise RuntimeError(f"{code[:80]}: {told['exceptionDetails']}")
        return told["result"].get("value")

    def heap_by_kind(self) -> dict[str, int]:
        """Bytes of the JavaScript heap by the kind of what holds them, such as ``object``, ``string`` or ``code``."""
        self._snapshot = []
        self.call("HeapProfiler.takeHeapSnapshot", reportProgress=False)
        told, self._snapshot = json.loads("".join(self._snapshot)), []
        fields = told["snapshot"]["meta"]["node_fields"]
        kinds = told["snapshot"]["meta"]["node_types"][fields.index("type")]
        held = dict.fromkeys(kinds, 0)
        nodes, width = told["nodes"], len(fields)
        for kind, size in zip(
            nodes[fields.index("type") :: width], nodes[fields.index("self_size") :: width], strict=True
        ):
            held[kinds[kind]] += size
        return held

    def wait_for_timeout(self, ms: float) -> None:
        """Wait."""
        time.sleep(ms / 1000)


@contextmanager
def browser() -> Iterator[Page]:
    """A browser with one page, a folder of its own, and nobody watching its network."""
    here, theirs = os.pipe(), os.pipe()
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        command = [str(stage.CHROMIUM), *stage.FLAGS, "--remote-debugging-pipe", "--window-size=1280,720"]
        command += [f"--user-data-dir={folder}", "about:blank"]
        # The browser reads commands from 3 and answers on 4.
        shell = ["bash", "-c", f'exec "$@" 3<&{here[0]} 4>&{theirs[1]}', "chromium", *command]
        quiet = subprocess.DEVNULL
        with subprocess.Popen(shell, pass_fds=(here[0], theirs[1]), stdout=quiet, stderr=quiet) as process:
            os.close(here[0])
            os.close(theirs[1])
            try:
                yield Page(here[1], theirs[0])
            finally:
                process.terminate()
                process.wait(20)
                os.close(here[1])
                os.close(theirs[0])

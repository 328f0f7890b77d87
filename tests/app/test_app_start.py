"""Starting: which port, whom it is for, and what is said of it."""

from __future__ import annotations

import os
import signal
import socket
from pathlib import Path
from typing import Any

import pytest
from app_server import World
from typer.testing import CliRunner

from lampyris.app.server import listening
from lampyris.app.server import run as running
from lampyris.app.server.server import Services
from lampyris.cli.app import app
from lampyris.errors import UsageError


def port_of(sockets: list[socket.socket]) -> int:
    found = int(sockets[0].getsockname()[1])
    for each in sockets:
        each.close()
    return found


@pytest.fixture
def usual(monkeypatch: pytest.MonkeyPatch) -> int:
    """A port that is free and stands for the usual one."""
    free = port_of(listening.open_sockets(0))
    monkeypatch.setattr(running, "USUAL", free)
    return free


def test_without_a_port_it_is_the_same_at_each_start(usual: int) -> None:
    assert [port_of(running._sockets(None, False)) for _ in range(3)] == [usual] * 3


def test_a_second_app_beside_it_gets_another_port_and_a_port_that_is_asked_for_is_that_one(
    usual: int,
) -> None:
    first = running._sockets(None, False)
    try:
        assert port_of(running._sockets(None, False)) != usual
        with pytest.raises(UsageError, match="PORT"):
            running._sockets(usual, False)
    finally:
        for each in first:
            each.close()
    assert port_of(running._sockets(0, False)) != usual


def started(monkeypatch: pytest.MonkeyPatch, **more: Any) -> list[tuple[Any, ...]]:
    """How an app would be started: sockets and door; nothing is served."""
    found: list[tuple[Any, ...]] = []

    def opened(port: int, remote: bool = False) -> list[socket.socket]:
        found.append(("sockets", remote))
        made = socket.socket()
        made.bind(("127.0.0.1", 0))
        return [made]

    async def served(app: Any, sockets: Any, services: Any, ends: Any) -> None:
        found.append(("served", app._door.hosts))

    monkeypatch.setattr(listening, "open_sockets", opened)
    monkeypatch.setattr(running, "_serve", served)
    services: Any = Services(None, None, dict)  # type: ignore[arg-type]
    assert running.run_app(browser=False, services=lambda _: services, **more) == 0
    return found


def test_other_machines_are_served_only_if_that_is_asked_for(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    found = started(monkeypatch)
    told = capsys.readouterr()
    assert found[0] == ("sockets", False)
    assert not any("lab-7" in host for host in found[1][1])
    assert "http://127.0.0.1:" in told.out
    assert told.err == ""

    found = started(monkeypatch, allow_remote="lab-7")
    told = capsys.readouterr()
    assert found[0] == ("sockets", True)
    assert any("lab-7" in host for host in found[1][1])
    assert "http://lab-7:" in told.out
    assert "not encrypted" in told.err


@pytest.mark.skipif(os.name != "posix", reason="signals")
@pytest.mark.parametrize("word", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_before_it_serves_ends_it_in_order(word: int) -> None:
    """A KeyboardInterrupt raised there could be lost in a finaliser, and the app went on."""
    before = signal.getsignal(word)
    raised = 0

    def services(_: Path) -> Services:
        nonlocal raised
        os.kill(os.getpid(), word)
        raised += 1  # a handler that raises does not come here
        return World().services

    assert running.run_app(browser=False, services=services) == 0
    assert raised == 1
    assert signal.getsignal(word) is before


@pytest.mark.source
def test_the_command_line_and_the_documents_say_so(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[dict[str, Any]] = []
    monkeypatch.setattr(running, "run_app", lambda map_, **how: asked.append(how) or 0)
    assert CliRunner().invoke(app, ["app"]).exit_code == 0
    assert (asked[0]["allow_remote"], asked[0]["port"]) == (None, None)
    text = (Path(__file__).parents[2] / "docs" / "app.md").read_text(encoding="utf-8")
    assert "--allow-remote" in text
    for line in running.REMOTE.format(name="HOSTNAME").splitlines():
        assert line in text
    assert str(running.USUAL) in text

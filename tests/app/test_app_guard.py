"""The guard: anyone who is not our own page reaches no handler, on any route, by any method (W1-W8)."""

from __future__ import annotations

import asyncio
import re
import socket
from collections import Counter
from pathlib import Path

import pytest
from app_server import (
    HOST,
    PATHS,
    PORT,
    TOKEN,
    WAYS,
    World,
    answers,
    check_safe,
    filled,
    own,
    parsed,
    raw,
    run,
    serving,
)

import lampyris.app
from lampyris.app.server.guard import OPEN, SAFE, door
from lampyris.app.server.listening import open_sockets
from lampyris.app.server.server import EXPORTS, VIEW_CSP
from lampyris.errors import UsageError

STATIC = Path(lampyris.app.__file__).parent / "static"
NAMES = sorted(file.name for file in STATIC.iterdir())
METHODS = ("GET", "HEAD", "POST", "PUT", "DELETE", "PATCH", "OPTIONS", "TRACE", "CONNECT")
HOSTS: tuple[tuple[str, ...], ...] = (
    ("evil.example",),
    (f"evil.example:{PORT}",),
    ("127.0.0.1",),
    (f"0.0.0.0:{PORT}",),
    (f"[::]:{PORT}",),
    (f"127.0.0.1.nip.io:{PORT}",),
    (f"localhost.evil:{PORT}",),
    (f"LOCALHOST:{PORT}",),
    (f"localhost.:{PORT}",),
    ("",),
    (),
    (HOST, f"evil.example:{PORT}"),
    (f"http://{HOST}",),
    (f"127.0.0.1\xe9:{PORT}",),
)
ORIGINS: tuple[tuple[str, ...], ...] = (
    (f"http://evil.example:{PORT}",),
    ("null",),
    (f"https://{HOST}",),
    (f"http://127.0.0.1:{PORT + 1}",),
    ("http://localhost.evil",),
    ("http://127.0.0.1@evil",),
    (f"HTTP://{HOST}",),
    (f"http://{HOST}", "http://evil.example"),
    ("file://",),
    ("chrome-extension://abcdefghijklmnop",),
)


def sent(method: str, path: str) -> tuple[list[tuple[str, str]], bytes]:
    """Headers and body with which our own page would be answered there."""
    takes = next((way.takes for way in WAYS if (way.method, filled(way)) == (method, path)), None)
    return ([("X-Lampyris-Token", TOKEN)] + ([("Content-Type", takes)] if takes else [])), b"{}"


def test_the_lists_are_as_long_as_promised() -> None:
    assert (len(set(HOSTS)), len(set(ORIGINS)), len(set(METHODS))) == (14, 10, 9)


@pytest.mark.nightly
def test_no_foreign_host_or_origin_reaches_a_handler() -> None:
    world = World()
    statuses: Counter[int] = Counter()

    async def all_of_them() -> None:
        for path in PATHS:
            for method in METHODS:
                headers, body = sent(method, path)
                for hosts in (*HOSTS, (HOST,)):
                    for origins in (*ORIGINS, ()):
                        if hosts == (HOST,) and not origins:
                            continue  # our own: below
                        whence = [("Host", h) for h in hosts] + [("Origin", o) for o in origins]
                        told = await world.ask(method, path, whence + headers, body)
                        assert told.status == (403 if hosts == (HOST,) else 421), (method, path, whence)
                        check_safe(told)
                        statuses[told.status] += 1

    run(all_of_them())
    assert world.reached == 0
    assert statuses.total() >= 14 * 10 * 9 * len(PATHS)
    assert not world.engines.asked
    assert not world.library.changes
    assert not world.studies.begun


def test_our_own_page_reaches_every_handler() -> None:
    # The other half of the test above: it would pass as well if nobody were let in.
    world = World()
    for count, way in enumerate(WAYS, 1):
        headers, body = sent(way.method, filled(way))
        for host in (HOST, f"localhost:{PORT}", f"[::1]:{PORT}"):
            whence = [("Host", host), ("Origin", f"http://{host}"), ("Sec-Fetch-Site", "same-origin")]
            told = run(world.ask(way.method, filled(way), whence + headers, body))
            assert told.status not in (401, 403, 405, 408, 413, 415, 421, 500), (way, told)
        assert world.reached == 3 * count


def test_names_of_this_server_are_not_one_anothers_origin() -> None:
    told = run(World().ask("GET", "/api/maps", own(("Origin", f"http://localhost:{PORT}"))))
    assert told.status == 403


def test_an_origin_is_said_once() -> None:
    twice = [("Origin", f"http://{HOST}")] * 2
    assert run(World().ask("GET", "/api/maps", own(*twice))).status == 403


def test_rebinding_is_refused_though_host_and_origin_agree() -> None:
    world = World()
    for path in PATHS:
        for method in METHODS:
            whence = [("Host", f"evil.example:{PORT}"), ("Origin", f"http://evil.example:{PORT}")]
            headers, body = sent(method, path)
            assert run(world.ask(method, path, whence + headers, body)).status == 421
    assert world.reached == 0


@pytest.mark.parametrize("site", ["cross-site", "same-site", "SAME-ORIGIN", "", "none, cross-site"])
def test_requests_of_other_sites_are_refused(site: str) -> None:
    world = World()
    for path in PATHS:
        for more in ([], [("Sec-Fetch-Mode", "no-cors"), ("Sec-Fetch-Dest", "script")]):
            told = run(world.ask("GET", path, own(("Sec-Fetch-Site", site), *more)))
            assert told.status == 403, path
    assert world.reached == 0


def test_a_link_may_lead_to_the_page_and_nowhere_else() -> None:
    world = World()
    link = [("Sec-Fetch-Site", "cross-site"), ("Sec-Fetch-Mode", "navigate")]
    for path in PATHS:
        told = run(world.ask("GET", path, [("Host", HOST), *link, ("Sec-Fetch-Dest", "document")]))
        assert (told.status != 403) == (path == "/"), path
        framed = run(world.ask("GET", path, [("Host", HOST), *link, ("Sec-Fetch-Dest", "iframe")]))
        assert framed.status == 403


@pytest.mark.commit(4)
@pytest.mark.parametrize(
    "headers",
    [
        [],
        [("X-Lampyris-Token", "")],
        [("X-Lampyris-Token", TOKEN[:-1])],
        [("X-Lampyris-Token", TOKEN + "0")],
        [("X-Lampyris-Token", TOKEN.upper())],
        [("X-Lampyris-Token", TOKEN), ("X-Lampyris-Token", TOKEN)],
        [("X-Lampyris-Token", "\xe9")],
        [("Cookie", f"token={TOKEN}; X-Lampyris-Token={TOKEN}")],
        [("Authorization", f"Bearer {TOKEN}")],
        [("X-HTTP-Method-Override", "POST"), ("X-Method-Override", "DELETE")],
    ],
)
def test_without_the_token_nothing_but_the_page_is_there(headers: list[tuple[str, str]]) -> None:
    world = World()
    for path in PATHS:
        is_open = path == "/" or path.startswith(OPEN)
        for method in METHODS:
            for query in ("", f"?token={TOKEN}"):
                told = run(world.ask(method, path + query, [("Host", HOST), *headers], b""))
                if not is_open:
                    assert told.status == 401, (method, path)
                elif method not in ("GET", "HEAD"):
                    assert told.status == 405, (method, path)
    for unknown in ("/api/unknown", "/unknown", "/Static/state.js", "//static/state.js"):
        assert run(world.ask("GET", unknown, [("Host", HOST), *headers])).status == 401
    assert not world.library.changes
    assert not world.engines.asked


def test_only_the_methods_of_a_way_are_answered() -> None:
    world = World()
    for path in PATHS:
        allowed = {way.method for way in WAYS if filled(way) == path}
        for method in {*METHODS, "FOO", "get", "POST "} - allowed - {"HEAD"}:
            told = run(world.ask(method, path, own(json_=True), b"{}"))
            assert told.status == 405, (method, path)
            check_safe(told)
    assert not world.library.changes
    assert not world.engines.asked


@pytest.mark.parametrize(
    "kind",
    [
        "text/plain", "application/x-www-form-urlencoded", "multipart/form-data; boundary=x", "", "text/json",
        "application/json; charset=utf-16", "application/json, text/plain", "application/xml",
    ],
)  # fmt: skip
def test_forms_and_plain_text_are_not_taken(kind: str) -> None:
    world = World()
    for way in WAYS:
        if way.takes:
            for headers in (
                own(("Content-Type", kind)),
                own(),
            ):
                assert run(world.ask("POST", filled(way), headers, b"{}")).status == 415
    assert not world.library.changes
    assert not world.engines.asked


def test_no_preflight_is_ever_allowed() -> None:
    world = World()
    for path in PATHS:
        headers = [
            ("Host", HOST), ("Origin", f"http://{HOST}"), ("Access-Control-Request-Method", "POST"),
            ("Access-Control-Request-Headers", "x-lampyris-token"),
        ]  # fmt: skip
        told = run(world.ask("OPTIONS", path, headers))
        assert told.status == (405 if path == "/" or path.startswith(OPEN) else 401)
        check_safe(told)


def test_there_are_no_web_sockets() -> None:
    said = []

    async def send(message: dict[str, object]) -> None:
        said.append(message["type"])

    async def never() -> None:
        await asyncio.sleep(3600)

    for path in PATHS:
        asyncio.run(World().app({"type": "websocket", "path": path, "headers": []}, never, send))  # type: ignore[arg-type]
    assert said == ["websocket.close"] * len(PATHS)


def test_every_answer_has_the_headers_of_every_answer() -> None:
    world = World()
    seen = set()
    for way in WAYS:
        headers, body = sent(way.method, filled(way))
        told = run(world.ask(way.method, filled(way), [("Host", HOST), *headers], body))
        check_safe(told)
        seen.add(told.status)
    for told in (
        run(world.ask("GET", "/api/nothing", own())),
        run(world.ask("GET", "/static/none.js", own())),
        run(world.ask("POST", "/api/plan", own(json_=True), b"{")),
        run(world.ask("POST", "/api/maps/other/delete", own(json_=True), b"{}")),
    ):
        check_safe(told)
        assert told.error()["code"]
        seen.add(told.status)
    assert {200, 400, 404} <= seen


def test_streams_downloads_and_every_file_have_the_headers_too() -> None:
    world = World()
    scenario = b'{"scenario": {"map": "guide"}'
    for verb in ("plan", "simulate", "layer", "compare"):
        told = run(world.ask("POST", f"/api/{verb}", own(json_=True), scenario + b"}"))
        assert told.status == 200
        check_safe(told)
    for what in EXPORTS:
        body = scenario + b', "what": "%s"}' % what.encode()
        told = run(world.ask("POST", "/api/export", own(json_=True), body))
        assert told.status == 200
        assert told.header("content-disposition").startswith("attachment; ")
        check_safe(told)
    for name in NAMES:
        for more in ([], [("Accept-Encoding", "gzip")]):
            told = run(world.ask("GET", f"/static/{name}", [("Host", HOST), *more]))
            assert told.status == 200
            check_safe(told)


STRANGE = ("/nothing", "/api/", "/static/", "/static/../server.py", "//", "/api/maps/a/b/c", "*", "/%2e%2e/")


def test_what_is_not_there_is_guarded_as_what_is() -> None:
    """No path is a way past the list of hosts or the token."""
    world = World()
    evil = [("Host", f"evil.example:{PORT}"), ("Origin", f"http://evil.example:{PORT}")]
    for path in STRANGE:
        for method in (*METHODS, "FOO"):
            for headers, status in (
                ([*evil, ("X-Lampyris-Token", TOKEN)], 421),
                ([("Host", HOST), ("Origin", "null"), ("X-Lampyris-Token", TOKEN)], 403),
                ([("Host", HOST)], 405 if path.startswith(OPEN) and method not in ("GET", "HEAD") else 401),
                (own(), 404),
            ):
                if path.startswith(OPEN):  # answered by the files of the page, which are open to all
                    status = {401: 404, 404: 404 if method in ("GET", "HEAD") else 405}.get(status, status)
                told = run(world.ask(method, path, headers))
                assert told.status == status, (method, path, headers)
                check_safe(told)


def test_a_fault_of_ours_says_nothing_about_itself(caplog: pytest.LogCaptureFixture) -> None:
    world = World()

    def broken() -> None:
        raise RuntimeError("/home/someone/secret.py line 3")

    world.library.listing = broken  # type: ignore[method-assign]
    told = run(world.ask("GET", "/api/maps", own()))
    assert told.status == 500
    check_safe(told)
    assert told.error()["code"] == "INTERNAL"
    assert b"secret" not in told.body
    assert b"Traceback" not in told.body
    assert "secret" not in caplog.text


def test_a_report_has_a_policy_of_its_own_and_a_ticket_opens_it_once() -> None:
    world = World()
    told = run(world.ask("POST", "/api/ticket", own(json_=True), b'{"job": "job1"}'))
    ticket = told.body.decode().split('"')[3]
    assert len(ticket) >= 43  # 256 bits
    view = run(world.ask("GET", f"/view/{ticket}", [("Host", HOST)]))
    assert view.status == 200
    assert "sandbox" in VIEW_CSP
    assert "script" not in VIEW_CSP
    check_safe(view, VIEW_CSP)
    assert run(world.ask("GET", f"/view/{ticket}", [("Host", HOST)])).status == 404
    assert run(world.ask("POST", "/api/ticket", own(json_=True), b'{"job": "job2"}')).status == 404


def test_a_ticket_is_old_after_half_a_minute(monkeypatch: pytest.MonkeyPatch) -> None:
    world = World()
    now = [0.0]
    monkeypatch.setattr("lampyris.app.server.server.time.monotonic", lambda: now[0])
    tickets = [
        run(world.ask("POST", "/api/ticket", own(json_=True), b'{"job": "job1"}')).body.decode().split('"')[3]
        for _ in range(20)
    ]
    assert len(world.services.tickets) == 16
    now[0] = 29.9
    assert run(world.ask("GET", f"/view/{tickets[-1]}", [("Host", HOST)])).status == 200
    now[0] = 30.0
    assert run(world.ask("GET", f"/view/{tickets[-2]}", [("Host", HOST)])).status == 404
    assert run(world.ask("GET", f"/view/{tickets[0]}", [("Host", HOST)])).status == 404


@pytest.mark.parametrize(
    "name",
    [
        "..", "../x", "..%2fserver.py", "%2e%2e%2fserver.py", "%252e%252e%252f", "....//server.py",
        "//etc/passwd", "/etc/passwd", "C:%5Cx", "C:\\x", "\\\\host\\share", "a:b", "state.js%00",
        "state.js.", "STATE.JS", "st%C3%A4te.js", "\xc0\xae\xc0\xae/", "a" * 300,
        "", "__init__.py", "CON",
    ],
)  # fmt: skip
def test_a_name_is_looked_up_and_never_joined(name: str) -> None:
    world = World()
    for path in (f"/static/{name}", f"/api/maps/{name}", f"/api/thumbs/{name}", f"/view/{name}"):
        told = run(world.ask("GET", path, own()))
        assert told.status in (400, 404), path
        told = run(world.ask("POST", f"/api/maps/{name}/delete", own(json_=True), b"{}"))
        assert told.status in (400, 404, 405)
    assert not world.library.changes


def test_every_file_of_the_page_is_served_with_its_type() -> None:
    world = World()
    kinds = {".js": "text/javascript", ".css": "text/css"}
    assert "state.js" in NAMES
    for name in NAMES:
        told = run(world.ask("GET", f"/static/{name}", [("Host", HOST)]))
        source = (STATIC / name).read_bytes()
        ours = name.endswith((".js", ".css")) and not name.startswith("uplot")
        if ours:
            sent, there = told.body.split(b"\n"), source.split(b"\n")
            assert len(sent) == len(there)
            for kept, line in zip(sent, there, strict=True):
                bare = re.sub(rb"/\*.*?\*/", b"", line)
                assert kept.replace(b" ", b"") in bare.replace(b" ", b""), (name, line)
        else:
            assert told.body == source
        kind = told.header("content-type")
        assert (kind if ours else kind.split(";")[0]) == kinds.get(Path(name).suffix, kind.split(";")[0])
        assert told.header("cache-control") == "no-store"


def test_the_door_of_port_80_and_of_another_name() -> None:
    assert door(80, TOKEN).hosts >= {"localhost", "localhost:80", "[::1]"}
    assert "localhost" not in door(81, TOKEN).hosts
    assert "robot.lan:81" in door(81, TOKEN, "robot.lan").hosts
    assert "robot.lan:81" not in door(81, TOKEN).hosts
    assert TOKEN not in repr(door(81, TOKEN))


# ------------------------------------------------------------------------------------ with real sockets


def test_sockets_are_of_this_machine_alone() -> None:
    with serving() as (port, world):
        del world
        listening = [
            line.split()
            for table in ("/proc/net/tcp", "/proc/net/tcp6")
            if Path(table).exists()
            for line in Path(table).read_text(encoding="ascii").splitlines()[1:]
        ]
        at = {
            row[1].rpartition(":")[0]
            for row in listening
            if row[3] == "0A" and row[1].endswith(f":{port:04X}")
        }
        assert at
        assert at <= {"0100007F", "00000000000000000000000001000000"}
        other = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            other.connect(("192.0.2.1", 9))  # sends nothing: it only asks which address would be used
            mine = other.getsockname()[0]
        except OSError:
            return
        finally:
            other.close()
        if not mine.startswith("127."):
            with pytest.raises(OSError, match=r"refused|timed out|unreachable"):
                socket.create_connection((mine, port), 1).close()


def test_a_port_that_is_taken_is_a_sentence() -> None:
    with serving() as (port, _), pytest.raises(UsageError, match="PORT"):
        open_sockets(port)


def test_remote_is_every_address() -> None:
    sockets = open_sockets(0, remote=True)
    try:
        assert sockets[0].getsockname()[0] == "0.0.0.0"
    finally:
        for each in sockets:
            each.close()


def test_foreign_requests_by_real_sockets() -> None:
    world = World()
    with serving(world) as (port, _):
        token = f"X-Lampyris-Token: {TOKEN}\r\n".encode()
        base = b"GET /api/maps HTTP/1.1\r\n"
        here = b"Host: 127.0.0.1:%d\r\n" % port
        assert parsed(raw(port, base + here + token + b"\r\n")).status == 200
        for hosts in HOSTS:
            own_port = [h.replace(str(PORT), str(port)) for h in hosts]
            head = b"".join(b"Host: " + h.encode("latin-1") + b"\r\n" for h in own_port)
            told = parsed(raw(port, base + head + token + b"\r\n"))
            assert told.status in (400, 421), hosts
        for target in (
            b"http://evil.example/api/maps",
            b"http://127.0.0.1:%d/" % port,
            b"*",
            b"evil:443",
            b"//x",
        ):
            told = parsed(raw(port, b"GET " + target + b" HTTP/1.1\r\n" + here + token + b"\r\n"))
            assert told.status in (400, 401, 404)
        for origins in ORIGINS:
            own_port = [o.replace(str(PORT), str(port)) for o in origins]
            head = b"".join(b"Origin: " + o.encode() + b"\r\n" for o in own_port)
            told = parsed(raw(port, base + here + head + token + b"\r\n"))
            if origins != (f"http://127.0.0.1:{PORT + 1}",) or port != PORT + 1:
                assert told.status in (400, 403), origins


def test_one_request_a_connection() -> None:
    with serving() as (port, _):
        one = (
            f"GET /api/maps HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nX-Lampyris-Token: {TOKEN}\r\n\r\n".encode()
        )
        got = raw(port, one + one)
        assert answers(got) == 1
        assert dict(parsed(got).headers)[b"connection"] == SAFE["connection"].encode() == b"close"

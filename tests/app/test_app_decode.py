"""Strangers' map files: read in a process of their own, refused in a sentence, bombs cut off (W12)."""

from __future__ import annotations

import os
import struct
import subprocess
import sys
import textwrap
import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

import sizes
from bad_inputs.pictures import header_only, text_bomb, wide_png
from lampyris.app.engine import decode as reading
from lampyris.app.engine.decode import decode, files_of
from lampyris.app.engine.parse import unpacked
from lampyris.app.server.library import container
from lampyris.errors import InternalFault, LampyrisError, LimitError
from lampyris_selfcheck.reference.files.map_files import png, rows

GREY = 0
SMALL = png(3, 2, 8, GREY, rows([0, 255, 255], [255, 255, 0]))
YAML = (
    "image: {}\nresolution: 0.05\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
)


def refusal(files: dict[str, bytes] | bytes) -> LampyrisError:
    with pytest.raises(LampyrisError) as found:
        decode(files if isinstance(files, bytes) else container(files))
    text = str(found.value)
    assert "\n" not in text
    assert "/tmp" not in text
    assert "Traceback" not in text
    return found.value


def test_a_picture_becomes_its_cells() -> None:
    told = decode(container({"My Map (2).png": SMALL}))
    assert told["name"] == "My Map (2).png"
    assert told["format"] == "png"
    grid = unpacked(told["ground"]).grid
    assert np.array_equal(grid.blocked, [[True, False, False], [False, False, True]])
    assert grid.name == "My Map (2).png"


def test_a_ros_map_comes_with_its_picture() -> None:
    told = decode(container({"hall.yaml": YAML.format("hall.png").encode(), "hall.png": SMALL}))
    grid = unpacked(told["ground"]).grid
    assert (told["format"], grid.resolution, grid.width) == ("ros", 0.05, 3)
    assert refusal({"hall.yaml": YAML.format("other.png").encode(), "hall.png": SMALL}).code == "FILE_MISSING"


@pytest.mark.commit(2)
@pytest.mark.parametrize(
    "name", ["/etc/passwd", "../hole.png", "~/hole.png", "//host/share/a.png", "C:\\a.png"]
)
def test_a_yaml_opens_nothing_but_what_came_with_it(name: str) -> None:
    fault = refusal({"hall.yaml": YAML.format(f"'{name}'").encode(), "hall.png": SMALL})
    assert fault.code in ("PATH_OUTSIDE", "PATH_FORM", "FILE_MISSING", "YAML_ESCAPE")


@pytest.mark.parametrize(
    ("line", "alone"),
    [
        ("/home/robot/hall.png", "hall.png"),
        ("'../a b/hall.png'  # saved", "'hall.png'  # saved"),
        ('"~/maps/hall.png"', '"hall.png"'),
        ("maps\\hall.png\r", "hall.png\r"),
        ("hall.png", "hall.png"),
        ("maps/hole.png", "maps/hole.png"),
    ],
)
def test_the_path_that_a_picture_had_on_the_robot_means_the_picture_that_came(line: str, alone: str) -> None:
    text = "negate: 0\nimage: {}\norigin: [0, 0, 0]\n"
    told, _ = reading.beside(text.format(line).encode(), ("hall.png",))
    assert told == text.format(alone).encode()
    twice = text.format(line).encode() * 2
    assert reading.beside(twice, ("hall.png",)) == (twice, ""), "which one is meant is not ours to say"


def test_a_map_saved_with_its_whole_path_is_read() -> None:
    yaml = YAML.format("/home/robot/maps/hall.png").encode()
    assert decode(container({"hall.yaml": yaml, "hall.png": SMALL}))["format"] == "ros"
    assert "open hall.yaml and hall.png together" in str(refusal({"hall.yaml": yaml}))


BROKEN = {
    "nothing": b"",
    "no files": struct.pack("<I", 0),
    "too many": struct.pack("<I", 17),
    "billions": struct.pack("<I", 2**32 - 1),
    "cut in the count": b"\1\0",
    "cut in a name": struct.pack("<IH", 1, 9) + b"a.png",
    "no contents": struct.pack("<IH", 1, 5) + b"a.png",
    "contents that lie": struct.pack("<IH", 1, 5) + b"a.png" + struct.pack("<I", 2**32 - 1) + b"x",
    "a name that is no UTF-8": struct.pack("<IH", 1, 2) + b"\xc0\xae" + struct.pack("<I", 1) + b"x",
    "something behind": container({"a.png": SMALL}) + b"x",
    "json": b'{"files": []}',
}


@pytest.mark.parametrize("data", BROKEN.values(), ids=list(BROKEN))
def test_containers_that_are_none(data: bytes) -> None:
    with pytest.raises(LampyrisError, match="MAP_FILES"):
        files_of(data)


def test_which_file_is_the_map_must_be_plain() -> None:
    for some in ({"a.png": SMALL, "b.png": SMALL}, {"a.yaml": b"x", "b.yml": b"x"}):
        assert refusal(some).code == "MAP_FILES"
    with pytest.raises(LampyrisError, match="two files of one name"):
        files_of(container({"a.png": SMALL, "A.PNG": SMALL}))


def test_a_wrong_file_is_a_sentence() -> None:
    fault = refusal({"notes.png": b"hello"})
    assert fault.code == "IMG_FORMAT"
    assert fault.where == "notes.png"


NPY = (
    b"\x93NUMPY\x01\0\x70\0{'descr': '|u1', 'fortran_order': False, 'shape': (3200000, 3200000), }"
    + b" " * 40
    + b"\n"
)
ALIASES = b"image: &a [x,x,x,x,x,x,x,x,x]\n" + b"".join(
    b"k%d: &%c [%s]\n" % (k, 98 + k, b",".join([b"*%c" % (97 + k)] * 9)) for k in range(9)
)
BOMBS: dict[str, tuple[str, Callable[[], bytes]]] = {
    "png of 60000 x 60000": ("a.png", lambda: header_only(60000, 60000)),
    "png of 13000 x 13000": ("a.png", wide_png),
    "packed text": ("a.png", text_bomb),
    "pgm of 60000 x 60000": ("a.pgm", lambda: b"P5\n60000 60000\n255\n" + b"\0" * 64),
    "pgm comment": ("a.pgm", lambda: b"P5\n#" + b"x" * 15_000_000 + b"\n2 2\n255\n\0\0\0\0"),
    "npy of 10 TB": ("a.npy", lambda: NPY),
    "yaml aliases": ("a.yaml", lambda: ALIASES),
    "yaml brackets": ("a.yaml", lambda: b"image: " + b"[" * 100_000),
    "yaml list": ("a.yaml", lambda: b"image: [" + b"1," * 1_000_000 + b"1]"),
    "movingai that lies": ("a.map", lambda: b"type octile\nheight 2000000000\nwidth 2000000000\nmap\n...\n"),
    "csv of commas": ("a.csv", lambda: b"," * 4_000_000),
    "text line": ("a.txt", lambda: b"." * 16_000_000 + b"#"),
}
"""Files by what is wrong with them; their bytes are made when they are asked for."""


@pytest.mark.parametrize("name", sizes.some(sorted(BOMBS, key="text line".__ne__)))
def test_a_bomb_is_a_typed_answer(name: str) -> None:
    # With every commit ``test_threats_bombs.py`` throws the others, at a whole server.
    file, made = BOMBS[name]
    data = made()
    assert len(data) <= 2**24
    if name == "text line":
        # Large, and a map: it must be read, or refused by its size, and never anything else.
        try:
            decode(container({file: data}))
        except LimitError:
            return
        return
    fault = refusal({file: data})
    assert not isinstance(fault, InternalFault), fault
    assert fault.code != "CPU_LIMIT"


@pytest.mark.nightly
def test_eight_bombs_at_once_leave_this_process_alone() -> None:
    with open("/proc/self/statm") as told:
        before = int(told.read().split()[1])
    bombs = [(file, made()) for file, made in (BOMBS["png of 13000 x 13000"], BOMBS["pgm comment"])] * 4
    beats = 0
    with ThreadPoolExecutor(8) as pool:
        asked = [pool.submit(refusal, {file: data}) for file, data in bombs]
        while not all(one.done() for one in asked):
            beats += 1
            time.sleep(0.01)
    assert all(one.result().code for one in asked)
    assert beats > 10, "others go on meanwhile"
    with open("/proc/self/statm") as told:
        grown = (int(told.read().split()[1]) - before) * os.sysconf("SC_PAGESIZE")
    assert grown < 150 * 2**20


def test_no_more_than_two_read_at_a_time(monkeypatch: pytest.MonkeyPatch) -> None:
    running, most, lock = [0], [0], threading.Lock()

    def slow(container: bytes) -> dict[str, object]:
        with lock:
            running[0] += 1
            most[0] = max(most[0], running[0])
        time.sleep(0.02)
        with lock:
            running[0] -= 1
        return {}

    monkeypatch.setattr(reading, "_asked", slow)
    with ThreadPoolExecutor(8) as pool:
        list(pool.map(decode, [b""] * 8))
    assert most[0] == 2


# ---- the process: what it may do --------------------


def inside(code: str) -> str:
    """What a decoder does that has been taken over as far as Python goes."""
    words = textwrap.dedent(f"""
        import os, socket, subprocess, sys, tempfile, pickle
        from pathlib import Path
        from lampyris.app.engine.decode import confine
        folder = tempfile.mkdtemp()
        confine(folder)
        try:
            {code}
        except PermissionError as no:
            sys.stdout.write("refused: " + str(no))
        else:
            sys.stdout.write("done")
    """)
    done = subprocess.run(
        [sys.executable, "-c", words], capture_output=True, text=True, timeout=60, check=False
    )
    return done.stdout


@pytest.mark.commit(4)
@pytest.mark.parametrize(
    "code",
    [
        "open('/etc/passwd')",
        "os.open('/etc/passwd', os.O_RDONLY)",
        "open(folder + '/../x', 'w')",
        "open(os.__file__, 'a')",
        "socket.socket()",
        "socket.getaddrinfo('example.invalid', 80)",
        "subprocess.run(['true'])",
        "os.system('true')",
        "os.fork()",
        "os.execv('/bin/true', ['true'])",
        "pickle.loads(b'cos\\nsystem\\n.')",
        "os.symlink('/etc/passwd', folder + '/l'), open(folder + '/l')",
    ],
)
def test_what_a_reader_of_maps_may_not_do(code: str) -> None:
    assert inside(code).startswith("refused: ")


def test_what_it_may_do() -> None:
    assert inside("Path(folder, 'a').write_bytes(b'x'), open(os.__file__).read()") == "done"


def test_its_memory_and_its_time_have_limits(tmp_path: Path) -> None:
    code = textwrap.dedent("""
        import os, resource, sys
        from lampyris.app.engine import decode
        seen = {}
        def read(data, folder):
            seen["as"] = resource.getrlimit(resource.RLIMIT_AS)[0]
            seen["cpu"] = resource.getrlimit(resource.RLIMIT_CPU)[0]
            bytearray(2**31)
        decode.read_container = read
        decode.main()
        used = sum(resource.getrusage(resource.RUSAGE_SELF)[:2])
        assert 0 < seen["cpu"] <= used + decode.SECONDS + 2, seen
        assert decode.MEMORY < seen["as"] < 3 * decode.MEMORY, seen
    """)
    done = subprocess.run(
        [sys.executable, "-c", code, str(tmp_path)], input=b"", capture_output=True, timeout=60, check=False
    )
    assert done.returncode == 0, done.stderr
    assert b'"MEMORY"' in done.stdout


@pytest.mark.parametrize(
    ("code", "wanted"), [(-24, "CPU_LIMIT"), (-9, "MEMORY"), (3, "DECODER"), (0, "DECODER")]
)
def test_an_end_without_an_answer_is_told(monkeypatch: pytest.MonkeyPatch, code: int, wanted: str) -> None:
    def ends(*_: object, **__: object) -> subprocess.CompletedProcess[bytes]:
        return subprocess.CompletedProcess((), code, b"", b"Traceback")

    monkeypatch.setattr(subprocess, "run", ends)
    assert refusal(b"").code == wanted


@pytest.mark.nightly
def test_its_files_are_gone_when_it_ends(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr("tempfile.tempdir", None)
    decode(container({"a.png": SMALL}))
    refusal({"a.png": b"x"})
    monkeypatch.setattr(reading, "WALL", 0.05)
    assert refusal({"a.png": SMALL}).code == "CPU_LIMIT"
    assert list(tmp_path.iterdir()) == []

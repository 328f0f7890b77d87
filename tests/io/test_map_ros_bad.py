"""ROS maps gone wrong: each mistake has its code, its place and a way out; nothing else happens."""

from __future__ import annotations

import os
import re
import struct
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from test_map_fuzz import mutate
from test_map_ros import YAML, pgm, ros

from lampyris.errors import FileError, LampyrisError, LimitError
from lampyris.io.maps.load import load_map
from lampyris.model.grid import Grid
from lampyris_selfcheck.reference.files.map_files import cells, png, put, rows

WATCHED: list[tuple[str, tuple[Any, ...]]] = []
_on = False


def _hook(event: str, args: tuple[Any, ...]) -> None:
    if event == "open" and isinstance(args[0], int):
        return  # opened by its name before
    if _on and event in (
        "open",
        "os.system",
        "os.exec",
        "os.posix_spawn",
        "subprocess.Popen",
        "socket.connect",
    ):
        WATCHED.append((event, args))


sys.addaudithook(_hook)


@contextmanager
def watched() -> Iterator[list[tuple[str, tuple[Any, ...]]]]:
    """What is opened, run or connected to meanwhile."""
    global _on
    WATCHED.clear()
    _on = True
    try:
        yield WATCHED
    finally:
        _on = False


def edited(old: str, new: str) -> bytes:
    assert old in YAML
    return YAML.replace(old, new).encode()


RESOLUTION, ORIGIN = "resolution: 0.050", "origin: [0.000, 0.000, 0]"
BOMB = "a: &a [x,x,x,x,x,x,x,x,x]\n" + "".join(
    f"{chr(98 + k)}: &{chr(98 + k)} [{','.join(['*' + chr(97 + k)] * 9)}]\n" for k in range(7)
)
BAD = [
    # 33: empty, a list, two documents
    (b"", "YAML_SHAPE", r"m\.yaml:1:1: the file is empty"),
    (b"# nothing\n", "YAML_SHAPE", "the file is empty"),
    (b"- image: m.pgm\n", "YAML_SHAPE", r"m\.yaml:1:1: a list; allowed: one mapping"),
    (b"m.pgm\n", "YAML_SHAPE", r"m\.yaml:1:1: a single value"),
    (YAML.encode() + b"---\nimage: x\n", "YAML_SHAPE", r"m\.yaml:8:1: a second document"),
    # 34: tab, NUL, not UTF-8, UTF-16
    (edited("mode: trinary", "mode:\ttrinary"), "YAML_SYNTAX", r"m\.yaml:2:6: "),
    (edited("mode: trinary", "mode: \0"), "YAML_SYNTAX", r"m\.yaml:2:7: character U\+0000"),
    (YAML.encode() + b"x: \xff\n", "YAML_SYNTAX", r"m\.yaml:8:4: byte 0xff is not UTF-8; save it as UTF-8"),
    (YAML.encode("utf-16"), "YAML_SYNTAX", r"m\.yaml:1:1: this is UTF-16"),
    # 35: image missing or empty
    (edited("image: m.pgm\n", ""), "MAP_KEY", r"m\.yaml:1:1: `image` is missing.*names its picture"),
    (edited("image: m.pgm", "image:"), "MAP_KEY", r"m\.yaml:1:7: `image` is empty"),
    (edited("image: m.pgm", "image: ''"), "MAP_KEY", r"m\.yaml:1:8: `image` is empty"),
    (edited("image: m.pgm", "image: [m.pgm]"), "MAP_KEY", r"`image` is \['m.pgm'\]"),
    (edited("negate: 0\n", ""), "MAP_KEY", "`negate` is missing"),
    (b"image: m.pgm\nresolution: 1\n", "MAP_KEY", "`origin` and `negate` and .* are missing"),
    # 36: the picture is missing
    (edited("m.pgm", "maps/a.pgm"), "FILE_MISSING", r"m\.yaml:1:8: .*maps/a\.pgm'?: no such file"),
    # 37: outside
    (edited("m.pgm", "../../etc/passwd"), "PATH_OUTSIDE", r"m\.yaml:1:8: '../../etc/passwd' is outside"),
    (edited("m.pgm", "maps/../../a.pgm"), "PATH_OUTSIDE", "outside the map's folder"),
    (edited("m.pgm", ".."), "PATH_OUTSIDE", "outside"),
    # 38: not a plain name
    (edited("m.pgm", "http://host/m.pgm"), "PATH_FORM", "not a plain file name"),
    (edited("m.pgm", "msl:x"), "PATH_FORM", "not a plain"),
    (edited("m.pgm", "'|cmd'"), "PATH_FORM", "not a plain"),
    (edited("m.pgm", "m.pgm|"), "PATH_FORM", "not a plain"),
    (edited("m.pgm", "'@list'"), "PATH_FORM", "not a plain"),
    (edited("m.pgm", r"\\host\share"), "PATH_FORM", "not a plain"),
    (edited("m.pgm", "//host/share"), "PATH_FORM", "not a plain"),
    (edited("m.pgm", "C:/maps/m.pgm"), "PATH_FORM", "not a plain"),
    (edited("m.pgm", r'"m\0.pgm"'), "PATH_FORM", "not a plain"),
    # 39, 41: resolution
    *(
        (edited("0.050", value), "MAP_RESOLUTION", rf"m\.yaml:3:13: {shown}.*1e-6 to 1000")
        for value, shown in [
            ("0", "0"), ("-0.05", "-0.05"), (".nan", "nan"), (".inf", "inf"), ("-.inf", "-inf"),
            ("1e-300", "1e-300"), ("1e300", r"1e\+300"), ("1001", "1001"), ("true", "True is not a number"),
            ("'abc'", "'abc' is not a number"), ("'0.05'", "'0.05' is not a number"), ("~", "None"),
            ("[1]", r"\[1\]"), ("1_0", "'1_0'"), ("1:30", "'1:30' is not a number"),
        ]
    ),
    (edited("0.050", "'0.05'"), "MAP_RESOLUTION", "take the quotation marks away"),
    (edited("0.050", "010"), "YAML_NUMBER", "m.yaml:3:13: 010 is 10 to some readers and octal to others"),
    (edited("0.050", "1e999"), "YAML_NUMBER", "too large"),
    # 42: origin
    (edited(ORIGIN, "origin: [0, 0]"), "MAP_ORIGIN", r"m\.yaml:4:9: 2 values; allowed: 3 numbers"),
    (edited(ORIGIN, "origin: [0, 0, 0, 0]"), "MAP_ORIGIN", "4 values"),
    (edited(ORIGIN, "origin: [0, .nan, 0]"), "MAP_ORIGIN", r"m\.yaml:4:13: nan"),
    (edited(ORIGIN, "origin: [0, 0, .inf]"), "MAP_ORIGIN", "inf"),
    (edited(ORIGIN, "origin: [1e300, 0, 0]"), "MAP_ORIGIN", r"1e\+300; allowed: -1e\+09 to 1e\+09"),
    (edited(ORIGIN, "origin: [a, 0, 0]"), "MAP_ORIGIN", "'a' is not a number"),
    (edited(ORIGIN, "origin: 5"), "MAP_ORIGIN", "5; allowed: 3 numbers"),
    (edited(ORIGIN, "origin: {x: 0}"), "MAP_ORIGIN", "3 numbers"),
    # 44: thresholds
    (edited("free_thresh: 0.196", "free_thresh: 1.5"), "MAP_THRESH", "7:14: free_thresh 1.5; allowed: 0"),
    (edited("free_thresh: 0.196", "free_thresh: -0.1"), "MAP_THRESH", "0 to 1"),
    (edited("free_thresh: 0.196", "free_thresh: .nan"), "MAP_THRESH", "nan; allowed: 0 to 1"),
    (edited("occupied_thresh: 0.65", "occupied_thresh: x"), "MAP_THRESH", "'x' is not a number"),
    # 45: negate
    (edited("negate: 0", "negate: maybe"), "MAP_NEGATE", "5:9: negate 'maybe'; allowed: 0, 1, true or false"),
    (edited("negate: 0", "negate: 0.5"), "MAP_NEGATE", "negate 0.5"),
    (edited("negate: 0", "negate:"), "MAP_NEGATE", "negate None"),
    (edited("negate: 0", "negate: nO"), "MAP_NEGATE", "negate 'nO'"),
    # 46: mode
    (edited("mode: trinary", "mode: tri"), "MAP_MODE", "2:7: mode 'tri'; allowed: trinary, scale, raw"),
    (edited("mode: trinary", "mode: scales"), "MAP_MODE", "did you mean scale"),
    (edited("mode: trinary", "mode: 1"), "MAP_MODE", "mode 1"),
    # 47: twice
    (edited("negate: 0", "resolution: 1"), "YAML_DUPLICATE", "m.yaml:5:1: 'resolution' on lines 3 and 5"),
    # 48: tags
    (edited("m.pgm", "!!python/object/apply:os.system ['touch x']"), "YAML_TAG", "m.yaml:1:8: .*nothing"),
    (edited("0.050", "!!float 1"), "YAML_TAG", "m.yaml:3:13"),
    (edited("0.050", "! 1"), "YAML_TAG", "m.yaml:3:13"),
    (edited("0.050", "!x!y 1"), "YAML_TAG", "m.yaml:3"),
    # 49: aliases
    (BOMB.encode() + YAML.encode(), "YAML_ALIAS", "m.yaml:1:4: .*'a'"),
    (edited(ORIGIN, "origin: *o"), "YAML_ALIAS", "m.yaml:4:9"),
    # 50: depth and size
    (b"image: " + b"[" * 2000, "YAML_DEPTH", "m.yaml:1:39: nested too deep; allowed: 32 levels"),
    (b"image: [" + b"0," * 200_000 + b"]", "YAML_SIZE", "400,009 bytes; allowed: at most 65,536"),
    (b"image: [" + b"0," * 30_000 + b"]", "YAML_SIZE", "too many values"),
    # 51: unknown keys
    (edited("resolution", "resoluton"), "MAP_KEY", "m.yaml:3:1: .*'resoluton'.*did you mean `resolution`"),
]  # fmt: skip


@pytest.mark.commit(25)
@pytest.mark.parametrize(
    ("data", "code", "says"), BAD, ids=lambda v: None if isinstance(v, bytes) else str(v)[:30]
)
def test_each_mistake_is_named_at_its_place(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    timely: Callable[..., Any],
    data: bytes,
    code: str,
    says: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    put(tmp_path, pgm([0, 255]), "m.pgm")
    put(tmp_path, YAML.encode(), "m.yaml")
    load_map("./m.yaml")  # opens what a first call opens: modules, the list of bundled maps
    put(tmp_path, data, "m.yaml")
    with watched() as seen, pytest.raises(LampyrisError) as caught:
        timely(1, load_map, "./m.yaml")
    problem = caught.value
    assert problem.code == code, str(problem)
    assert re.search(says, str(problem)), str(problem)
    assert problem.exit_code == (5 if isinstance(problem, LimitError) else 3)
    assert "m.yaml" in problem.where
    assert len(str(problem)) < 400
    assert {event for event, _ in seen} <= {"open"}, "nothing is run"
    assert not (tmp_path / "x").exists()
    assert [args[0] for event, args in seen if event == "open" and not _below(args[0], tmp_path)] == []


def _below(name: object, folder: Path) -> bool:
    return isinstance(name, str | bytes) and os.path.realpath(os.fsdecode(name)).startswith(str(folder))


STRICT = [
    ("negate: 0", "negate: 2", "MAP_NEGATE", "negate 2; allowed: 0, 1, true or false"),
    ("0.196", "0.7", "MAP_THRESH", "free_thresh 0.7 >= occupied_thresh 0.65"),
    ("negate: 0", "negate: 0\nmap_type: x", "MAP_KEY", "unknown key 'map_type'"),
]


@pytest.mark.parametrize(("old", "new", "code", "says"), STRICT)
def test_strangers_get_no_benefit_of_the_doubt(
    tmp_path: Path, old: str, new: str, code: str, says: str
) -> None:
    put(tmp_path, pgm([0, 255]), "m.pgm")
    path = put(tmp_path, edited(old, new), "m.yaml")
    assert load_map(path).notes
    with pytest.raises(FileError, match=f"{code}.*{says}"):
        load_map(path, strict=True)
    put(tmp_path, YAML.encode(), "m.yaml")
    assert cells(load_map(path, strict=True)) == ["#."]


def test_where_a_picture_may_be(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    maps, other = tmp_path / "maps", tmp_path / "other"
    (maps / "sub").mkdir(parents=True)
    other.mkdir()
    for folder in (maps, maps / "sub", other):
        put(folder, pgm([0, 255]), "m.pgm")
    (maps / "link.pgm").symlink_to(other / "m.pgm")
    monkeypatch.chdir(maps)
    monkeypatch.setenv("HOME", str(other))

    def load(image: str, **how: bool) -> tuple[str, ...]:
        found = load_map(put(maps, edited("m.pgm", image), "m.yaml"), **how)
        assert cells(found) == ["#."]
        return found.notes

    for inside in ("m.pgm", "./m.pgm", "sub/m.pgm", "sub/../m.pgm", "../maps/m.pgm", str(maps / "m.pgm")):
        assert load(inside) == load(inside, strict=True) == ()
    for absolute in (str(other / "m.pgm"), "~/m.pgm"):
        (note,) = load(absolute)
        assert re.search(r"m\.yaml:1:8: .* outside the map's folder; an absolute path, followed", note)
        assert load(absolute, allow_outside=True) == ()
        with pytest.raises(FileError, match="PATH_OUTSIDE"):
            load(absolute, strict=True)
    with pytest.raises(FileError, match="PATH_OUTSIDE"):
        load("../other/m.pgm")
    assert load("../other/m.pgm", allow_outside=True) == ()
    # An installed ROS package is made of links; in a stranger's folder a link may point anywhere.
    assert load("link.pgm") == ()
    with pytest.raises(FileError, match="PATH_OUTSIDE"):
        load("link.pgm", strict=True)
    assert cells(load_map("m.yaml")) == ["#."]


def test_the_folder_is_the_yaml_files_own_wherever_one_stands(tmp_path: Path) -> None:
    (tmp_path / "a").mkdir()
    put(tmp_path / "a", pgm([0, 255]), "m.pgm")
    put(tmp_path / "a", YAML.encode(), "m.yaml")
    assert cells(load_map(os.path.relpath(tmp_path / "a" / "m.yaml"))) == ["#."]
    assert cells(load_map(tmp_path / "a" / ".." / "a" / "m.yaml")) == ["#."]


@pytest.mark.parametrize("image", ["sub", "pipe", "/dev/zero", "."])
def test_a_picture_that_is_not_a_regular_file(tmp_path: Path, image: str) -> None:
    (tmp_path / "sub").mkdir()
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(FileError, match=r"FILE_KIND.*m\.yaml:1:8"):
        load_map(put(tmp_path, edited("m.pgm", image), "m.yaml"))


@pytest.mark.parametrize(
    ("picture", "code", "says"),
    [
        (b"", "IMG_EMPTY", "empty"),
        (b"hello", "IMG_FORMAT", "not a PNG, BMP or PGM; allowed: PNG, BMP, PGM"),
        (b"GIF89a" + bytes(9), "IMG_FORMAT", "this is GIF"),
        (YAML.encode(), "IMG_FORMAT", "PNG, BMP, PGM"),
        (b"P5 9 9 255\n", "IMG_TRUNCATED", "0 of 81"),
        (b"P5 60000 60000 255\n", "IMG_TOO_LARGE", "3,600,000,000"),
        (png(1, 1, 16, 2, rows(bytes(6))), "IMG_DEPTH", "save it with 8 bits"),
        (png(1, 1, 16, 4, rows(bytes(4))), "IMG_DEPTH", "16 bits a channel"),
        (png(1, 1, 8, 3, rows([3]), before=b""), "IMG_CORRUPT", "palette"),
    ],
)
def test_a_picture_that_is_none(tmp_path: Path, picture: bytes, code: str, says: str) -> None:
    with pytest.raises(LampyrisError, match=f"{code}.*m\\.pgm.*{says}"):
        load_map(ros(tmp_path, picture))


SECRET = b"qzxjwvk"


@pytest.mark.parametrize(
    "content",
    [
        SECRET,
        b"\x89PNG\r\n\x1a\n" + SECRET * 9,
        png(2, 2, 8, 0, rows(bytes(2), bytes(2)))[:-12] + struct.pack(">I", 0) + SECRET[:4] + SECRET,
        b"BM" + SECRET * 9,
        b"P2 " + SECRET,
        b"P5 3 " + SECRET,
        b"P5 3 3 " + SECRET,
        b"P2 2 2 255 1 2 3 " + SECRET,
        b"P1 2 2 1 0 " + SECRET,
        b"P5 # " + SECRET + b"\n1 x",
        b"\x93NUMPY" + SECRET,
        b"type octile\n" + SECRET,
        b"%" + SECRET + b"\x00",
    ],
)
def test_no_content_of_what_the_map_names_is_printed(tmp_path: Path, content: bytes) -> None:
    """`image:` may name any file, /etc/passwd too: a message must not show what stands in it."""
    put(tmp_path, content, "m.pgm")
    with pytest.raises(LampyrisError) as found:
        load_map(put(tmp_path, YAML.encode(), "m.yaml"))
    said = f"{found.value} {found.value.__dict__}"
    assert "m.pgm" in said
    for begin in range(len(SECRET) - 2):
        assert SECRET[begin : begin + 3].decode() not in said


def test_a_file_that_the_user_names_is_quoted(tmp_path: Path) -> None:
    with pytest.raises(LampyrisError, match="'qzxjwvk' is not a number"):
        load_map(put(tmp_path, b"P2 " + SECRET, "m.pgm"))


def test_a_point_too_far_to_count_in_cells() -> None:
    grid = Grid([[False]], resolution=0.05)
    with pytest.raises(LampyrisError, match="POINT"):
        grid.to_cell(1.7e308, -1.7e308)


SEEDS = [
    YAML.encode(),
    (
        b"\xef\xbb\xbf{image: m.pgm, resolution: 5e-2, origin: [1, 2, 0.5], negate: no,\n"
        b" 'occupied_thresh': 0.6, \"free_thresh\": 2e-1, mode: Scale}\r\n"
    ),
    (
        b"%YAML 1.2\n---\nimage: >-\n  m.pgm\nresolution: 1\norigin:\n- 0\n- -1\n- .5\nnegate: false\n"
        b"occupied_thresh: 0.65 # a comment\nfree_thresh: 0.196\nmode: raw\n...\n"
    ),
]
WORDS = [
    b"../", b"/etc/passwd", b"~/", b"http://x", b"|", b"\\", b"&a ", b"*a", b"!!int ", b"!", b"%TAG ! x:\n",
    b"? ",
    b"- ", b"[", b"]", b"{", b"}", b": ", b"---\n", b"...\n", b"\t", b"\r\n", b"'", b'"', b'"\\U00110000"',
    b"\xc2\x85",
    b"\xe2\x80\xa8", b"\xed\xa0\x80", b'"\\ud800"', b".nan", b"1e999", b"0x", b"0o7", b"010", b"9" * 5000,
    b"<<: ", b"|2\n",
    b"%YAML 9" + b"9" * 5000 + b".1\n", b"image: ", b"null", b"\0", b"#", b"mode: raw\n", b"\xf0\x9f\x97\xba",
]  # fmt: skip


def mutant(rng: np.random.Generator, k: int) -> bytes:
    """Every fourth with bytes changed anywhere, every fourth with a word put in, the rest in one figure."""
    data = SEEDS[k % 3]
    if k % 4 == 0:
        return mutate(rng, data)
    if k % 4 == 1:
        for _ in range(int(rng.integers(1, 3))):
            at = int(rng.integers(0, len(data) + 1))
            word = WORDS[int(rng.integers(0, len(WORDS)))]
            data = data[:at] + word + data[at + int(rng.integers(0, 4)) :]
        return data
    digits = [at for at, byte in enumerate(data) if byte in b"0123456789."]
    at = digits[int(rng.integers(0, len(digits)))]
    return data[:at] + bytes([b"0123456789.-e x"[int(rng.integers(0, 15))]]) + data[at + 1 :]


@pytest.mark.nightly
def test_mutants_are_a_map_or_a_named_error(tmp_path: Path, timely: Callable[..., Any]) -> None:
    folder = tmp_path / "m"
    folder.mkdir()
    put(folder, pgm([0, 205, 254], [100, 255, 90]), "m.pgm")
    for k, seed in enumerate(SEEDS):
        load_map(put(folder, seed, f"seed{k}.yaml"), strict=True)
    rng = np.random.Generator(np.random.PCG64(20250424))
    read = refused = 0
    codes = set()
    for k in range(600):
        data = mutant(rng, k)
        path = put(folder, data, "m.yaml")
        with watched() as seen:
            try:
                found = timely(1, load_map, path, strict=True)
            except LampyrisError as problem:
                refused += 1
                codes.add(problem.code)
                message = str(problem)
            else:
                read += 1
                message = "error["
                assert found.grid.blocked.size <= 6
        assert message.startswith("error[")
        for event, args in seen:
            assert event == "open", data
            assert _below(args[0], folder), data
    assert read > 50, "the mutations are too rough to tell anything"
    assert refused > 100
    assert len(codes) >= 10, sorted(codes)

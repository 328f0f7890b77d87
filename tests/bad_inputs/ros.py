"""Rows 33 to 51: ROS map_server YAML.

Where Nav2 accepts what the table refuses (an absolute path, an integer negate, thresholds the other way
round, a key it does not know), so does the command line, with a note; a stranger's file is refused.
"""

from __future__ import annotations

import re
from pathlib import Path

from bad_inputs.case import Case, Content, bad_map, good_map
from bad_inputs.pictures import p5

YAML = (
    "image: m.pgm\n"
    "mode: trinary\n"
    "resolution: 0.050\n"
    "origin: [0.000, 0.000, 0]\n"
    "negate: 0\n"
    "occupied_thresh: 0.65\n"
    "free_thresh: 0.196\n"
)
PICTURE = p5(3, 1, 255, bytes([0, 254, 205]))
READ = ("#.?",)
UNKNOWN = "1 cell unknown (blocked for planning)"


def _edited(old: str, new: str) -> bytes:
    assert len(re.findall(re.escape(old), YAML)) == 1
    return YAML.replace(old, new).encode()


def _bad(row: int, name: str, content: Content, code: str, place: str, *says: str, exit: int = 3) -> Case:
    place = place if place.startswith(("m.pgm", "maps")) else f"m.yaml{place}"
    return bad_map(row, name, "m.yaml", content, code, place, *says, exit=exit, files={"m.pgm": PICTURE})


def _good(row: int, name: str, content: Content, *notes: str, strict: str = "") -> Case:
    return good_map(
        row, name, "m.yaml", content, READ, *notes, UNKNOWN, files={"m.pgm": PICTURE}, strict=strict
    )


BOMB = "a: &a [x,x,x,x,x,x,x,x,x]\n" + "".join(
    f"{chr(98 + k)}: &{chr(98 + k)} [{','.join(['*' + chr(97 + k)] * 9)}]\n" for k in range(7)
)
ONE = "one mapping of keys to values"
METRES = "1e-6 to 1000"
TAGS = "nothing in a file is run"
PLAIN = "not a plain file name"

SYNTAX = [
    _bad(33, "empty", b"", "YAML_SHAPE", ":1:1", "the file is empty", ONE),
    _bad(33, "comments only", b"# nothing\n", "YAML_SHAPE", "", "the file is empty", ONE),
    _bad(33, "a list", b"- image: m.pgm\n", "YAML_SHAPE", ":1:1", "a list", ONE),
    _bad(33, "two documents", YAML.encode() + b"---\nimage: x\n", "YAML_SHAPE", ":8:1", "second document"),
    _bad(34, "tab", _edited("mode: trinary", "mode:\ttrinary"), "YAML_SYNTAX", ":2:6"),
    _bad(34, "NUL", _edited("mode: trinary", "mode: \0"), "YAML_SYNTAX", ":2:7", "U+0000", "take it out"),
    _bad(34, "not UTF-8", YAML.encode() + b"x: \xff\n", "YAML_SYNTAX", ":8:4", "0xff", "save it as UTF-8"),
    _bad(34, "UTF-16", YAML.encode("utf-16"), "YAML_SYNTAX", ":1:1", "UTF-16", "save it as UTF-8"),
    _bad(47, "twice", _edited("negate: 0", "resolution: 1"), "YAML_DUPLICATE", ":5:1", "lines 3 and 5"),
    _bad(
        48,
        "os.system",
        _edited("m.pgm", "!!python/object/apply:os.system ['touch run']"),
        "YAML_TAG",
        ":1:8",
        "no tags",
        TAGS,
    ),
    _bad(48, "a harmless tag", _edited("0.050", "!!float 1"), "YAML_TAG", ":3:13", TAGS),
    _bad(49, "alias bomb", BOMB.encode() + YAML.encode(), "YAML_ALIAS", ":1:4", "'a'", "written out"),
    _bad(50, "2000 brackets", b"image: " + b"[" * 2000, "YAML_DEPTH", ":1:39", "32 levels", exit=5),
    _bad(
        50, "400 kB", b"image: [" + b"0," * 200_000 + b"]", "YAML_SIZE", "", "400,009 bytes", "65,536", exit=5
    ),
    _bad(50, "60 kB of values", b"image: [" + b"0," * 30_000 + b"]", "YAML_SIZE", ":1:", "10,000", exit=5),
]

IMAGE = [
    _bad(35, "missing", _edited("image: m.pgm\n", ""), "MAP_KEY", ":1:1", "`image` is missing"),
    _bad(35, "nothing", _edited("image: m.pgm", "image:"), "MAP_KEY", ":1:7", "`image` is empty", "PNG"),
    _bad(35, "empty", _edited("image: m.pgm", "image: ''"), "MAP_KEY", ":1:8", "`image` is empty", "PNG"),
    _bad(36, "no such picture", _edited("m.pgm", "maps/a.pgm"), "FILE_MISSING", ":1:8", "maps/a.pgm"),
    _bad(
        37,
        "outside",
        _edited("m.pgm", "../../etc/passwd"),
        "PATH_OUTSIDE",
        ":1:8",
        "../../etc/passwd",
        "--allow-outside",
    ),
    _bad(37, "hidden", _edited("m.pgm", "maps/../../m.pgm"), "PATH_OUTSIDE", ":1:8", "the map's folder"),
    _bad(38, "http", _edited("m.pgm", "http://127.0.0.1/m.pgm"), "PATH_FORM", ":1:8", PLAIN, "no address"),
    _bad(38, "msl", _edited("m.pgm", "msl:x"), "PATH_FORM", ":1:8", PLAIN),
    _bad(38, "pipe", _edited("m.pgm", "'|touch run'"), "PATH_FORM", ":1:8", PLAIN, "touch run"),
    _bad(38, "share", _edited("m.pgm", r"\\host\share"), "PATH_FORM", ":1:8", PLAIN, "share"),
    _bad(38, "other share", _edited("m.pgm", "//host/share"), "PATH_FORM", ":1:8", PLAIN, "share"),
]

VALUES = [
    *(
        _bad(39, value, _edited("0.050", value), "MAP_RESOLUTION", ":3:13", shown, METRES)
        for value, shown in [
            ("0", ": 0;"), ("-0.05", "-0.05"), (".nan", "nan"), (".inf", "inf"), ("1e-300", "1e-300"),
            ("1e300", "1e+300"),
        ]
    ),
    _good(40, "5e-2", _edited("0.050", "5e-2")),
    _bad(41, "true", _edited("0.050", "true"), "MAP_RESOLUTION", ":3:13", "True is not a number", METRES),
    _bad(41, "abc", _edited("0.050", '"abc"'), "MAP_RESOLUTION", ":3:13", "'abc' is not a number", METRES),
    _bad(42, "2 values", _edited("[0.000, 0.000, 0]", "[0, 0]"), "MAP_ORIGIN", ":4:9", "2 values", "3 numb"),
    _bad(42, "4 values", _edited("[0.000, 0.000, 0]", "[0, 0, 0, 0]"), "MAP_ORIGIN", ":4:9", "4 values"),
    _bad(42, "nan", _edited("[0.000, 0.000, 0]", "[0, .nan, 0]"), "MAP_ORIGIN", ":4:13", "nan", "1e+09"),
    _bad(44, "1.5", _edited("0.196", "1.5"), "MAP_THRESH", ":7:14", "free_thresh 1.5", "0 to 1"),
    _bad(44, "-0.1", _edited("0.65", "-0.1"), "MAP_THRESH", ":6:18", "occupied_thresh -0.1", "0 to 1"),
    _bad(44, "nan", _edited("0.196", ".nan"), "MAP_THRESH", ":7:14", "nan", "0 to 1"),
    _bad(45, "maybe", _edited("negate: 0", "negate: maybe"), "MAP_NEGATE", ":5:9", "'maybe'", "0, 1, true"),
    _bad(46, "tri", _edited("mode: trinary", "mode: tri"), "MAP_MODE", ":2:7", "'tri'", "trinary, scale"),
    _bad(51, "resoluton", _edited("resolution", "resoluton"), "MAP_KEY", ":3:1", "'resoluton'",
         "did you mean `resolution`"),
    _good(51, "map_type", YAML.encode() + b"map_type: occupancy\n", "m.yaml:8:1: unknown key 'map_type'",
          "left aside", strict="MAP_KEY"),
]  # fmt: skip

# Turned by a quarter: the lower left corner of the picture's lower left pixel stays, east becomes north.
TURNED = YAML.replace("[0.000, 0.000, 0]", "[1, 2, 1.5707963267948966]")


def _elsewhere(folder: Path) -> None:
    """``maps/m.yaml`` names a picture of another folder by its whole path."""
    (folder / "maps").mkdir()
    picture = (folder / "pictures" / "m.pgm").as_posix()
    (folder / "maps" / "m.yaml").write_text(YAML.replace("m.pgm", picture))


OTHER = [
    Case(
        37,
        "absolute",
        ("plan", "maps/m.yaml", "--start", "1,0", "--goal", "1,0"),
        {"pictures/m.pgm": PICTURE},
        says=(
            "maps/m.yaml:1:8: ",
            "outside the map's folder; an absolute path, followed as Nav2 does",
            UNKNOWN,
        ),
        cells=READ,
        setup=_elsewhere,
        strict="PATH_OUTSIDE",
    ),
    Case(
        37,
        "outside, allowed",
        ("plan", "maps/m.yaml", "--allow-outside", "--start", "1,0", "--goal", "1,0"),
        {"maps/m.yaml": _edited("m.pgm", "../m.pgm"), "m.pgm": PICTURE},
        says=(UNKNOWN,),
    ),
    good_map(
        44,
        "ends swapped",
        "m.yaml",
        _edited("0.196", "0.7"),
        ("#..",),
        "m.yaml:7:14: free_thresh 0.7 >= occupied_thresh 0.65",
        "where both hold, the cell is free",
        "1 pixel of grey 205, which map savers write for unknown, read as free",
        files={"m.pgm": PICTURE},
        strict="MAP_THRESH",
    ),
    Case(
        43,
        "yaw",
        ("plan", "m.yaml", "--start-m", "0.975,2.075", "--goal-m", "0.975,2.075", "--json"),
        {"m.yaml": TURNED.encode(), "m.pgm": PICTURE},
        says=(UNKNOWN,),
        cells=READ,
    ),
    good_map(
        45,
        "2",
        "m.yaml",
        _edited("negate: 0", "negate: 2"),
        (".#?",),
        "m.yaml:5:9: negate 2",
        "white is occupied",
        files={"m.pgm": p5(3, 1, 255, bytes([0, 254, 128]))},
        strict="MAP_NEGATE",
    ),
]

CASES: list[Case] = [*SYNTAX, *IMAGE, *VALUES, *OTHER]

"""Patterns take time in proportion to the text, whatever strangers write.

Python's matcher tries every way to share out a run of characters between neighbours that both take them. A
number of 20,000 digits and a letter took 8 s so, 2,000 blanks in a line of YAML 22 s, and a head of 16 KiB
kept the app from all others for 2 s.
"""

from __future__ import annotations

import importlib
import pkgutil
import re
from collections.abc import Callable
from typing import Any

import pytest

import lampyris

OURS = "matched with our own words only"
# Each pattern that is kept in a module: how it is asked, and texts that it takes.
ASKED: dict[str, tuple[str, tuple[str, ...]] | str] = {
    "app.decode._IMAGE": ("search", ("image: 'a/b c.png' # d\r\n", "image : a.png", "image: \\a\\b.png ")),
    "app.guard._PLAIN_PATH": ("fullmatch", ("/a/b.c",)),
    "app.hello._BETWEEN": OURS,
    "app.hello._RANGE": OURS,
    "app.hello._WORD": OURS,
    "app.listening._HEADER": ("fullmatch", ("a-b: \tc d \t",)),
    "app.listening._REQUEST_LINE": ("fullmatch", ("GET /a?b HTTP/1.1",)),
    "app.names.PLAIN": ("fullmatch", ("a.b-c",)),
    "app.run._HOSTNAME": ("fullmatch", ("a-b.c.d",)),
    "cli.option_errors._ARGUMENT": ("search", ('a b_c="d"', "a_b=True")),
    "cli.option_errors._QUOTED": ("match", ("'a' is not a valid",)),
    "maps.csv_file._FLOAT": ("fullmatch", ("-1.5e+10", ".5", "1.", "12")),
    "maps.csv_table.NUMBER": ("fullmatch", ("-1.5e+10", ".5", "1.", "12")),
    "maps.json_text._NUMBER": ("match", ("-1.5e+10", "0")),
    "maps.json_text._ODD": ("search", ("a\x01",)),
    "maps.json_text._SPACE": ("match", (" \t\n",)),
    "maps.json_text._WORD": ("match", ("-Infinity",)),
    "maps.movingai._LENGTH": ("fullmatch", ("1.5e-10",)),
    "maps.movingai._NUMBER": ("fullmatch", ("12",)),
    "maps.numpy_file._DESCR": ("search", ("{'descr' : '<f8'",)),
    "maps.numpy_file._ENTRIES[0]": ("search", ("'fortran_order' : True",)),
    "maps.numpy_file._ENTRIES[1]": ("search", ("'shape' : ( 1L , 2 , )",)),
    "maps.numpy_file._REAL": ("fullmatch", ("<f8",)),
    "maps.numpy_file._SHAPE": ("fullmatch", (" 1L , 2 , ",)),
    "maps.numpy_file._TYPE": ("fullmatch", ("|u1",)),
    "maps.pgm._MAGIC": ("match", ("P5 ",)),
    "maps.pgm._TOKEN": ("match", (" # a\n # b\r 12",)),
    "maps.ros._LIKELY": ("search", ('\ufeff{ "image" : "a"', "a\n image: b")),
    "maps.ros_write._PLAIN_NAME": ("fullmatch", ("a-b.c",)),
    "maps.ros_yaml._ODD_PATH": ("search", ("ab+c:", "//a", "a|b")),
    "maps.scenario_save._BARE": ("fullmatch", ("a/b-c", "yes")),
    "maps.text._NUMBERS": ("match", ("-12  \t,",)),
    "maps.tracks._WHOLE": ("fullmatch", (" -12 ",)),
    "maps.yaml_text._BASED": ("fullmatch", ("0o17", "0xff")),
    "maps.yaml_text._REAL": ("fullmatch", ("-1.5e+10", ".5")),
    "maps.yaml_text._UNPRINTABLE": ("search", ("a\x01",)),
    "maps.yaml_text._WHOLE": ("fullmatch", ("-12",)),
    "report.html._INTERVAL": ("fullmatch", ("a b [1, 2] n 3",)),
    "report.html._NAME": ("fullmatch", ("a-b",)),
    "sim.notes._FIGURE": ("search", ("a 1.5 b",)),
    "study.carve._HEAD": ("search", ("\x05\x00\u0081\r",)),
    "study.crowd_words._LABEL": ("fullmatch", ("12 a-b c",)),
    "study.export._FORMULA": ("match", ("=a",)),
    "study.export._QUOTED": ("search", ("a, b ",)),
}


def kept() -> dict[str, re.Pattern[str] | re.Pattern[bytes]]:
    """Every pattern of the package that a module keeps, once, but for those of the checks."""
    found: dict[str, re.Pattern[str] | re.Pattern[bytes]] = {}
    for module in pkgutil.walk_packages(lampyris.__path__, "lampyris."):
        if ".selfcheck" in module.name or module.name.endswith("__main__"):
            continue
        room = importlib.import_module(module.name)
        for name, value in vars(room).items():
            several = isinstance(value, tuple | list)
            for k, one in enumerate(value if several else (value,)):
                if isinstance(one, re.Pattern) and not any(one is other for other in found.values()):
                    found[f"{module.name[9:]}.{name}{f'[{k}]' if several else ''}"] = one
    return found


def test_every_pattern_is_listed() -> None:
    assert sorted(kept()) == sorted(ASKED)


@pytest.mark.parametrize("name", [name for name, how in ASKED.items() if how != OURS])
def test_no_run_of_a_character_keeps_a_pattern_busy(name: str, timely: Callable[..., Any]) -> None:
    """Longer and longer runs, at every place of a text that it takes: a second's work would show at once."""
    pattern, (way, texts) = kept()[name], ASKED[name]
    ask = getattr(pattern, way)
    as_given = str if isinstance(pattern.pattern, str) else lambda text: text.encode("latin-1", "replace")
    for text in texts:
        for at in range(len(text) + 1):
            for char in sorted({*text[max(0, at - 1) : at + 1], *"1a /\"'\\"}):
                for end in ("", "\x01", 'x"y'):
                    for many in (300, 20_000):
                        long = as_given(text[:at] + char * many + text[at:] + end)
                        timely(0.25, ask, long)

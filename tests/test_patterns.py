"""Patterns take time in proportion to the text, whatever strangers write.

Python's matcher tries every way to share out a run of characters between neighbours that both take them. A
number of 20,000 digits and a letter took 8 s so, 2,000 blanks in a line of YAML 22 s, and a head of 16 KiB
kept the app from all others for 2 s.
"""

from __future__ import annotations

import importlib
import inspect
import pkgutil
import re
from collections.abc import Callable
from functools import cache
from typing import Any

import pytest

import lampyris

OURS = "matched with our own words only"
# Each pattern that is kept in a module: how it is asked, and texts that it takes.
ASKED: dict[str, tuple[str, tuple[str, ...]] | str] = {
    "app.engine.decode._IMAGE": (
        "search",
        ("image: 'a/b c.png' # d\r\n", "image : a.png", "image: \\a\\b.png "),
    ),
    "_core.settings._PARAMETER": OURS,
    "_core.settings._ROLE": OURS,
    "testing.questions._PARTICULARS": OURS,
    "app.server.scripts.COMMENTS": OURS,
    "app.engine.names.PLAIN": ("fullmatch", ("a.b-c",)),
    "app.server.run._HOSTNAME": ("fullmatch", ("a-b.c.d",)),
    "io.primitives.mprim._NUMBER": ("fullmatch", ("-1.5e-10", "+.5", "12.")),
    "io.primitives.mprim._WHOLE": ("fullmatch", ("-12", "+3")),
    "cli.option_errors._ARGUMENT": ("search", ('a b_c="d"', "a_b=True")),
    "cli.option_errors._NONE": ("search", ("50, or none (50)",)),
    "cli.option_errors._QUOTED": ("match", ("'a' is not a valid",)),
    "io.maps.formats.csv._FLOAT": ("fullmatch", ("-1.5e+10", ".5", "1.", "12")),
    "io.text.csv_table.NUMBER": ("fullmatch", ("-1.5e+10", ".5", "1.", "12")),
    "io.text.strict_json._NUMBER": ("match", ("-1.5e+10", "0")),
    "io.text.strict_json._ODD": ("search", ("a\x01",)),
    "io.text.strict_json._SPACE": ("match", (" \t\n",)),
    "io.text.strict_json._WORD": ("match", ("-Infinity",)),
    "io.maps.formats.movingai._LENGTH": ("fullmatch", ("1.5e-10",)),
    "io.maps.formats.movingai._NUMBER": ("fullmatch", ("12",)),
    "io.maps.formats.npy._DESCR": ("search", ("{'descr' : '<f8'",)),
    "io.maps.formats.npy._ENTRIES[0]": ("search", ("'fortran_order' : True",)),
    "io.maps.formats.npy._ENTRIES[1]": ("search", ("'shape' : ( 1L , 2 , )",)),
    "io.maps.formats.npy._REAL": ("fullmatch", ("<f8",)),
    "io.maps.formats.npy._SHAPE": ("fullmatch", (" 1L , 2 , ",)),
    "io.maps.formats.npy._TYPE": ("fullmatch", ("|u1",)),
    "io.maps.formats.pgm._MAGIC": ("match", ("P5 ",)),
    "io.maps.formats.pgm._TOKEN": ("match", (" # a\n # b\r 12",)),
    "io.maps.formats.ros._LIKELY": ("search", ('\ufeff{ "image" : "a"', "a\n image: b")),
    "io.maps.formats.ros_write._PLAIN_NAME": ("fullmatch", ("a-b.c",)),
    "io.maps.formats.ros_yaml._ODD_PATH": ("search", ("ab+c:", "//a", "a|b")),
    "io.scenario.save._BARE": ("fullmatch", ("a/b-c", "yes")),
    "io.maps.formats.plain_text._NUMBERS": ("match", ("-12  \t,",)),
    "io.tracks.csv_tracks._WHOLE": ("fullmatch", (" -12 ",)),
    "io.text.strict_yaml._BASED": ("fullmatch", ("0o17", "0xff")),
    "io.text.strict_yaml._REAL": ("fullmatch", ("-1.5e+10", ".5")),
    "io.text.strict_yaml._UNPRINTABLE": ("search", ("a\x01",)),
    "io.text.strict_yaml._WHOLE": ("fullmatch", ("-12",)),
    "report.html.render._INTERVAL": ("fullmatch", ("a b [1, 2] n 3",)),
    "sim.world.notes._FIGURE": ("search", ("a 1.5 b",)),
    "study.design.traffic_labels._LABEL": ("fullmatch", ("12 a-b c",)),
    "study.analysis.export._FORMULA": ("match", ("=a",)),
    "study.analysis.export._QUOTED": ("search", ("a, b ",)),
}


@cache
def kept() -> dict[str, re.Pattern[str] | re.Pattern[bytes]]:
    """Every pattern of the package that a module keeps, once, but for those of the checks."""
    found: dict[str, re.Pattern[str] | re.Pattern[bytes]] = {}
    for module in pkgutil.walk_packages(lampyris.__path__, "lampyris."):
        if ".selfcheck" in module.name or module.name.endswith("__main__"):
            continue
        room = importlib.import_module(module.name)
        text = inspect.getsource(room)
        for name, value in vars(room).items():
            if not re.search(rf"^{name}\b.* = ", text, re.MULTILINE):
                continue  # imported
            several = isinstance(value, tuple | list)
            for k, one in enumerate(value if several else (value,)):
                if isinstance(one, re.Pattern) and not any(one is other for other in found.values()):
                    found[f"{module.name[9:]}.{name}{f'[{k}]' if several else ''}"] = one
    return found


@pytest.mark.nightly
def test_every_pattern_is_listed() -> None:
    assert sorted(kept()) == sorted(ASKED)


STRANGERS = [name for name, how in ASKED.items() if how != OURS]


def judge(name: str, runs: tuple[int, ...], call: Callable[..., Any]) -> None:
    """Ask for longer and longer runs, at every place of a text that the pattern takes."""
    pattern, (way, texts) = kept()[name], ASKED[name]
    ask = getattr(pattern, way)
    as_given = str if isinstance(pattern.pattern, str) else lambda text: text.encode("latin-1", "replace")
    for text in texts:
        for at in range(len(text) + 1):
            for char in sorted({*text[max(0, at - 1) : at + 1], *"1a /\"'\\"}):
                for end in ("", "\x01", 'x"y'):
                    for many in runs:
                        call(0.25, ask, as_given(text[:at] + char * many + text[at:] + end))


@pytest.mark.commit(5)
@pytest.mark.parametrize("name", STRANGERS)
def test_no_run_of_a_character_doubles_a_pattern_s_work(name: str) -> None:
    """Work that doubles with each of 300 characters has no end."""
    judge(name, (300,), lambda seconds, ask, long: ask(long))


@pytest.mark.nightly
@pytest.mark.parametrize("name", STRANGERS)
def test_no_run_of_a_character_keeps_a_pattern_busy(name: str, timed: Callable[..., Any]) -> None:
    """A second's work would show at once."""
    judge(name, (300, 20_000), timed)

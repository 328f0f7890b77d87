"""Random combinations of options over all verbs, drawn from the command tree, and what becomes of them.

A case is known by the seed and its number. Each runs the command line's own ``main`` in a process forked from
one that has imported everything, in a folder of its own, under limits of CPU time and memory. Whatever the
words are, the exit code is 0, 2, 3, 4 or 5 and there is no traceback. Large sizes, in pieces::

    python tests/cli/option_draws.py --first 0 --cases 5000 --seed 1
"""

from __future__ import annotations

import argparse
import os
import re
import resource
import shutil
import signal
import stat
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import typer.main
from PIL import Image

from lampyris._core.defaults import VIA_ORDERS
from lampyris.cli import main
from lampyris.cli.app import app, plain_help
from lampyris.model.moves import MOVES
from lampyris.model.robot import DRIVES
from lampyris.model.settings.fleet_drive import OBSTACLE_INFO, POLICIES
from lampyris.model.settings.swarm import METHODS
from lampyris.motion.laws import registry as laws
from lampyris.planning import registry
from lampyris.planning.fleet import registry as fleets
from lampyris.sim.traffic.mobility import MOBILITIES

MAY = frozenset((0, 2, 3, 4, 5))
CPU_S = 20
WALL_S = 120.0
MEMORY = 3 * 2**30
FILE_BYTES = 2**28

MAPS = ("guide", "guide", "m.txt", "m.txt", "m.map", "m.npy", "cost.csv", "m.yaml", "m.pgm")
PATHS = (
    "s.yaml", "sim.yaml", "drive.yaml", "way.csv", "way.json", "track.csv", "movers.csv", "zones.csv",
    "zones.npy", "study.yaml", "m.map.scen", "kept.study.db", "garbage", "empty", "d", "pipe", "loop",
    "sock", "missing", "missing/x.csv", "", "-", "ü ñ.csv", "/dev/null", "/dev/full", "/dev/zero",
    "x" * 300, "new.csv", "new.png", "new.svg", "new.gif", "new.webp", "new.yaml", "new.json", "new.html",
    "new.tex", "new.parquet", "new.txt", "new.map", "new.pgm", "new.npy", "new.bmp", "new.jsonl",
    "new.ledger", "new.study.db", "new.bag", "new", "there.csv", "~", "./m.txt", "../x.csv",
)  # fmt: skip
"""Files of a case's folder, good and bad ones, and names of files to be written."""
SWARM = {
    "sources": ("three-peaks", "drawn", "missing.yaml"),
    "method": METHODS,
    "settings": (
        "noise=0.1",
        "line_of_sight=false",
        "radius=0.1",
        "radius=9",
        "nois=1",
        "rho=2",
        "small_step=0.01",
    ),
}
"""Values of options of ``swarm``."""
ODD = ("d", "pipe", "loop", "sock", "/dev/null", "/dev/full", "/dev/zero", "garbage", "x" * 300)
HUGE = "9" * 400
INTEGERS = (
    "0", "1", "2", "3", "5", "7", "-1", "1.5", "x", "", " 4 ", "٣", "1e3", "2147483648",
    "9223372036854775807", "9223372036854775808", "-9223372036854775809", HUGE, "nan", "0x10", "1_0",
)  # fmt: skip
REALS = (
    "0", "1", "0.5", "0.1", "0.25", "2", "3.7", "10", "-1", "-0.0", "1e-9", "1e-6", "1e-320", "1e6", "1e9",
    "1e300", "1e400", HUGE, "nan", "inf", "-inf", "x", "", "1,5", "١",
)  # fmt: skip
WORDS = (
    "", "x", "-", "--", "none", "all", "ad-gso", "ü", "a,b", "=", ":", "\x07", "NONE", "None", "nul",
    "x" * 500, "'", '"', "%s", "\udcff",
)  # fmt: skip
CELLS = (
    "0,0", "3,1", "5,4", "7,0", "0,9", "-1,0", "99,99", "1.5,2", "1", "1,2,3", "", "x,y", f"{HUGE},0",
    "nan,nan", "inf,0", "1e300,0", " 1 , 1 ",
)  # fmt: skip
SIZES = ("10,10", "30,20", "40x30", "0,0", "-1,5", "5", "x", f"{HUGE},4", "60,60", "1,1000")
CHOICES: dict[str, tuple[str, ...]] = {
    "preset": ("robot", "dissertation"),
    "moves": tuple(MOVES),
    "values": ("occupancy", "costmap"),
    "to_values": ("occupancy", "costmap"),
    "colour": ("legend", "luminance"),
    "layer": ("luciferin", "cost", "none"),
    "mobility": tuple(MOBILITIES),
    "smooth": ("straight", "arcs", "none"),
    "units": ("metres", "cells"),
    "colour_by": ("speed", "cause"),
    "obstacle_info": ("positions", "velocities", "tracks"),
    "tracking": ("perfect", "velocity", "position"),
    "on_hit": ("end", "go-on"),
    "again": ("failed", "timeout", "refused", "failed,timeout"),
    "size": ("commit", "nightly", "release"),
    "recipe": ("caves", "gates", "hills", "maze", "office", "random", "rooms", "street", "warehouse"),
    "ready": ("density", "dissertation", "laws", "line-up", "movingai", "sensitivity"),
}
"""Words of options that are text. An option that is new has those of its help."""
SLOW: dict[str, tuple[tuple[str, ...], ...]] = {
    "app": (
        ("--port", "99999"),
        ("--folder", "missing"),
        ("--allow-remote", "Bad Host"),
        ("--folder", "empty"),
    ),
    "reproduce": (("--out", "empty"), ("--workers", "0"), ("--out", "loop")),
    "ros": (("--seconds", "0"), ("--remap", "x"), ("--transport", "x")),
    "warm": (("--help",), ("--jsn",), ("x",)),
}
"""Verbs that run for minutes or for ever: with words that they refuse."""
NEVER = {"dask": ("", "x", "http://127.0.0.1:1"), "workers": ("1", "1", "0", "-1", "x", HUGE)}
"""No cluster is waited for, and no case starts a crowd of processes."""


@dataclass(frozen=True)
class Ended:
    """What became of a case.

    Parameters
    ----------
    number, words : the case.
    code : exit code; negative: the signal that ended it.
    out, err : what it printed, the beginning and the end of it.
    seconds : CPU time.
    """

    number: int
    words: tuple[str, ...]
    code: int
    out: str
    err: str
    seconds: float

    @property
    def wrong(self) -> str:
        """What is wrong with it; empty: nothing is."""
        if self.code not in MAY:
            return f"exit {self.code}: {self.err[-600:]}"
        if "Traceback" in self.err or "Traceback" in self.out:
            return f"a traceback: {self.err[-600:]}"
        told = [line for line in self.err.splitlines() if line.startswith("error[")]
        disagrees = self.words[:1] == ("movingai",) and "--strict" in self.words and self.code == 3
        if self.code in (2, 3) and self.words and not (told or disagrees or "Usage: " in self.err):
            return f"exit {self.code} and no error is told: {self.err[-600:]!r}"
        return ""


@cache
def verbs() -> dict[str, Any]:
    """Every verb by its words: ``plan``, ``maps make``."""
    found: dict[str, Any] = {}

    def walk(command: Any, words: tuple[str, ...]) -> None:
        for name, inner in command.commands.items():
            if hasattr(inner, "commands"):
                walk(inner, (*words, name))
            else:
                found[" ".join((*words, name))] = inner

    walk(tree(), ())
    return found


@cache
def tree() -> Any:
    """The command tree, as the command line makes it where no terminal is; making it takes 50 ms."""
    plain_help()
    return typer.main.get_command(app)


@dataclass(frozen=True)
class Chance:
    """How the values of a case are drawn.

    Parameters
    ----------
    rng : of the case.
    verb : its words.
    share : of good values.
    chosen : the planner and the law, whose settings are drawn.
    """

    rng: np.random.Generator
    verb: str
    share: float
    chosen: dict[str, str]


def drawn(seed: int, number: int) -> tuple[str, ...]:
    """The words of a case."""
    rng = np.random.Generator(np.random.PCG64(np.random.SeedSequence([seed, number])))
    names = sorted(verbs())
    # The more options a verb has, the more combinations there are.
    weights = np.array([1 if name in SLOW else 2 + len(verbs()[name].params) for name in names], float)
    name = names[int(rng.choice(len(names), p=weights / weights.sum()))]
    if rng.random() < 0.01:
        mine = (name.split()[0], "--help")
        odd = ((), ("--version",), ("--help",), ("nope",), mine, ("maps",), ("maps", "--json"))
        return odd[int(rng.integers(len(odd)))]
    command, words = verbs()[name], list(name.split())
    options, arguments = [], []
    chance = Chance(
        rng, name, (0.6, 0.9, 1.0)[int(rng.integers(3))], {"planner": "ad-gso", "law": "physical"}
    )
    for parameter in command.params:
        if parameter.param_type_name == "argument":
            if parameter.required or rng.random() < 0.5:
                arguments.append(_value(chance, parameter))
        elif parameter.required or rng.random() < 5.0 / max(5, len(command.params)):
            options.append(_option(chance, parameter))
    if name == "selfcheck":
        arguments = [str(rng.choice(["grids", "metamorphic", "x", ""]))] if rng.random() < 0.9 else ["grids"]
        options.append(["--list"] if rng.random() < 0.5 else ["--cases", "0"])
    if name == "study run":
        # The ready studies run for minutes or hours.
        tiny = arguments == ["study.yaml"] and rng.random() < 0.4
        options.append(["--workers", "1"] if tiny else ["--dry-run"])
    if "start_m" in {p.name for p in command.params} and rng.random() < 0.8:
        ends = {option[0].partition("=")[0].removesuffix("-m") for option in options}
        options += [
            [f"--{end}", cell] for end, cell in (("start", "0,0"), ("goal", "5,4")) if f"--{end}" not in ends
        ]
    if name == "fleet" and rng.random() < 0.8 and not any("--robots" in option[0] for option in options):
        options.append(["--robots", "2"])
    if name == "fleet" and rng.random() < 0.9:
        options = _that_go_together(rng, options)
    options = [options[int(k)] for k in rng.permutation(len(options))]
    flat = [word for option in options for word in option]
    parts = [arguments, flat] if rng.random() < 0.5 else [flat, arguments]
    words += [word for part in parts for word in part]
    if rng.random() < 0.02:
        words.append(str(rng.choice(["--nope", "extra", "--", "-x", ""])))
    if name in SLOW:
        choices = SLOW[name]
        words += choices[int(rng.integers(len(choices)))]
    # No argument of a process holds a zero byte.
    return tuple(word.replace("\0", "") for word in words)


RIGHT = {
    "free": ("bright", "dark", "0", "1"),
    "cell": ("1", "2"),
    "median": ("1", "3"),
    "thresholds": ("1", "2"),
    "via_order": VIA_ORDERS,
    "vary": ("v_max=0.8:1.2", "a_max=normal(0.5,0.05)"),
    "of": ("duration", "length", "energy"),
    "samples": ("1", "50"),
    "max_cells": ("100", "1000000"),  # the bundled map that is drawn has 100
    "export": ("new.scen", "new.json", "new.txt"),
}
"""Good values of options whose kind does not tell them."""
DRIVEN = (
    "policy", "delays", "delay-duration", "fault", "drive-limit", "obstacles", "obstacle-radius", "obstacle-speed",
    "obstacle-info", "radius", "v-max", "a-max", "d-max", "drive", "yaw-rate-max",
)  # fmt: skip
"""Options of ``fleet`` that go with ``--execute``."""


def _that_go_together(rng: np.random.Generator, options: list[list[str]]) -> list[list[str]]:
    """The options of ``fleet`` without those that would be refused beside the others."""
    kind = str(rng.choice(["", "execute", "lifelong"], p=[0.5, 0.35, 0.15]))
    kept = {"": (), "execute": DRIVEN, "lifelong": ("window", "tasks", "fault")}[kind]
    out = {*DRIVEN, "window", "tasks", "execute", "lifelong"} - {*kept} | (
        {"robot"} if kind == "lifelong" else set()
    )
    made = [one for one in options if one[0].partition("=")[0].removeprefix("--") not in out]
    return made + {"": [], "execute": [["--execute"]], "lifelong": [["--lifelong", "7"]]}[kind]


def _option(chance: Chance, parameter: Any) -> list[str]:
    rng = chance.rng
    name = str(rng.choice([*parameter.opts, *parameter.secondary_opts]))
    if parameter.is_flag:
        return [name]
    value = _value(chance, parameter)
    if value.startswith("-") or (name.startswith("--") and rng.random() < 0.3):
        return [f"{name}={value}"] if name.startswith("--") else [name, value]
    return [name, value]


def _value(chance: Chance, parameter: Any) -> str:
    """A value for a parameter."""
    rng, verb = chance.rng, chance.verb
    good = rng.random() < chance.share
    name = str(parameter.name)
    kind = str(parameter.type.name).partition(" ")[0]
    if name in NEVER:
        return _one(rng, NEVER[name])
    if name == "fault":
        return _one(
            rng, ("0@1", "1@2") if good else ("0@1", "x", "@", "9@1", "0@nan", "0@-1", "0@1.5", f"{HUGE}@1")
        )
    if good and name in RIGHT:
        return _one(rng, RIGHT[name])
    if verb == "fleet" and name in ("policy", "obstacle_info", "drive") and good:
        return _one(rng, {"policy": POLICIES, "obstacle_info": OBSTACLE_INFO, "drive": DRIVES[::2]}[name])
    if name == "robots" and good:  # as many as the files of a case have
        return _one(rng, ("1", "2"))
    if kind in ("int", "integer"):
        return _one(rng, INTEGERS[1:6] if good else INTEGERS)
    if kind == "float":
        return _one(rng, REALS[1:7] if good else REALS)
    if kind in ("path", "file"):
        return _path(rng, verb, parameter, good)
    if not good:
        return _one(rng, (*WORDS, *CELLS, *PATHS[:20]))
    if name in ("map_", "source") or (verb == "maps show" and name == "name"):
        return _one(rng, MAPS)
    if name in ("start", "goal", "start_m", "goal_m", "via", "via_m"):
        return _one(rng, CELLS[:4])
    if verb == "swarm" and name in SWARM:
        return _one(rng, SWARM[name])
    if name == "size" and verb == "maps make":
        return _one(rng, SIZES)
    if verb == "fleet" and name == "planner":
        chance.chosen["planner"] = _one(rng, fleets.names())
        return chance.chosen["planner"]
    if verb == "fleet" and name == "settings":
        return _planner_setting(rng, _fleet_planner(chance), fleets)
    if verb == "fleet" and name == "moves":
        return _one(rng, ("four-connected", "octile"))
    if name == "planner" or (verb == "planners" and name == "name"):
        chance.chosen["planner"] = _one(rng, registry.names())
        return chance.chosen["planner"]
    if name == "planners":
        return ",".join(_setting_list(rng, registry.names(), _planner_setting))
    if name == "law" or (verb == "laws" and name == "name"):
        chance.chosen["law"] = _one(rng, tuple(laws.LAWS))
        return chance.chosen["law"]
    if name in ("laws", "laws_"):
        return ",".join(_setting_list(rng, tuple(laws.LAWS), _law_setting))
    if name == "settings":
        recipe = verb == "maps make"
        return _recipe_setting(rng) if recipe else _planner_setting(rng, chance.chosen["planner"])
    if name == "set_law":
        return _law_setting(rng, chance.chosen["law"])
    if name == "study":
        return _one(rng, ("study.yaml", "study.yaml", "line-up", "density"))
    words = CHOICES.get(name) or tuple(re.findall(r"[a-z][a-z-]+", parameter.help or "")) or WORDS
    return _one(rng, words)


def _fleet_planner(chance: Chance) -> str:
    """The planner of fleets whose settings are drawn."""
    return chance.chosen["planner"] if chance.chosen["planner"] in fleets.names() else fleets.names()[0]


ENDINGS = {
    "csv": ("new.csv", "-"), "picture": ("new.png", "new.svg"), "film": ("new.gif", "new.webp"), "replay": ("new.html",),
    "chart": ("new.png", "new.svg"), "save": ("new.yaml", "new.json"), "report": ("new.html",),
    "parquet": ("new.parquet",), "latex": ("new.tex",), "zones": ("zones.csv", "zones.npy"),
    "path": ("way.csv", "way.json"), "obstacle_states": ("movers.csv",), "track": ("track.csv",),
    "scen": ("m.map.scen",), "agents": ("agents.csv",),
    "store": ("new.study.db", "kept.study.db"), "scenario": ("s.yaml", "sim.yaml", "drive.yaml"),
    "out": ("new.png", "new.txt", "new.npy", "new.yaml"),
    "photo": ("photo.pgm", "photo.jpg"),
    "target": ("new.png", "new.txt", "new.map", "new.yaml"),
    "file": ("m.map.scen", "new.yaml"), "page": ("new.html",), "data": ("d", "."), "folder": ("d", "."),
    "ledger": ("new.ledger",), "record": ("new.jsonl",), "failures": ("new", "d"), "study": ("study.yaml",),
}  # fmt: skip


def _path(rng: np.random.Generator, verb: str, parameter: Any, good: bool) -> str:
    name = str(parameter.name)
    if good and verb.startswith("study ") and parameter.param_type_name == "argument" and name == "store":
        return "kept.study.db"
    if good and name in ENDINGS:
        return _one(rng, ENDINGS[name])
    return _one(rng, PATHS if rng.random() < 0.6 else ODD)


def _setting_list(rng: np.random.Generator, names: tuple[str, ...], one: Any) -> list[str]:
    chosen = [_one(rng, names) for _ in range(int(rng.integers(1, 4)))]
    return [name if rng.random() < 0.6 else f"{name}:{one(rng, name)}" for name in chosen]


def _planner_setting(rng: np.random.Generator, planner: str, table: Any = registry) -> str:
    known = registry.settings_of(table.planner_class(planner))
    key = _one(rng, tuple(known) or ("x",)) if rng.random() < 0.9 else _one(rng, WORDS)
    small = {"swarm": "4", "iterations": "5", "ants": "4", "particles": "4"}
    value = small.get(key) if rng.random() < 0.7 else None
    any_ = _one(rng, (*REALS, *INTEGERS, *WORDS, "exact", "replan", "true"))
    return f"{key}={any_ if value is None else value}"


def _law_setting(rng: np.random.Generator, law: str) -> str:
    known = tuple(laws.settings_of(law))
    key = _one(rng, known or ("x",)) if rng.random() < 0.9 else _one(rng, WORDS)
    return f"{key}={_one(rng, (*REALS, 'on', 'off', 'true', 'none', 'dark', 'map'))}"


def _recipe_setting(rng: np.random.Generator) -> str:
    from lampyris.io.maps.recipes.make import RECIPES

    keys = tuple(setting.name for recipe in RECIPES.values() for setting in recipe.table)
    return f"{_one(rng, keys)}={_one(rng, (*REALS, *INTEGERS, *CELLS))}"


def _one(rng: np.random.Generator, words: tuple[str, ...]) -> str:
    return words[int(rng.integers(len(words)))]


# ---- the folder of a case --------------------------------------------------------------------------------

ROOM = "......\n.##...\n......\n...#..\n......\n"


def template(folder: Path) -> None:
    """The files that every case finds, but those that are no regular files."""
    from lampyris.io.maps.convert import convert

    here = os.getcwd()
    os.chdir(folder)
    try:
        texts = {
            "m.txt": ROOM,
            "m.map": "type octile\nheight 5\nwidth 6\nmap\n......\n.@@...\n......\n...@..\n......\n",
            "m.map.scen": "version 1\n0\tm.map\t6\t5\t0\t0\t5\t4\t6.6\n0\tm.map\t6\t5\t1\t0\t5\t0\t4\n",
            "cost.csv": "0,0,0\n0,100,0\n0,0,50\n",
            "zones.csv": "\n".join(["1,1,1,1,1,1"] * 5) + "\n",
            "way.csv": "x_m,y_m\n0.5,0.5\n3.5,0.5\n5.5,0.5\n",
            "way.json": '{"poses": [{"position": {"x": 0.5, "y": 0.5}}, {"position": {"x": 2, "y": 0.5}}]}',
            "track.csv": "x,y\n5,0\n4,0\n3,0\n",
            "agents.csv": "start_x,start_y,goal_x,goal_y\n0,0,5,4\n5,4,0,0\n",
            "movers.csv": "x_m,y_m,radius,top_speed\n5.5,4.5,0.2,0.5\n",
            "s.yaml": "version: 1\nmap: {file: m.txt}\nstart: [0, 0]\ngoal: [5, 4]\n",
            "sim.yaml": "version: 1\nmap: {file: m.txt}\nstart: [0, 0]\ngoal: [5, 4]\n"
            "obstacles: [{kind: random-walk, count: 2}]\nsimulate: {ticks: 60}\n",
            "drive.yaml": "version: 1\nmap: {file: m.txt}\nstart: [0, 0]\ngoal: [5, 4]\n"
            "drive: {time_limit: 30}\n",
            "study.yaml": "version: 1\nname: s\nkind: plan\nmaps: [guide]\nplanners: [astar]\nseeds: 1\n",
            "garbage": "\x00\x01\udcff[}{]\n", "empty": "",
            "there.csv": "kept\n", "ü ñ.csv": "x,y\n0,0\n1,0\n",
        }  # fmt: skip
        for name, text in texts.items():
            Path(name).write_bytes(text.encode(errors="surrogateescape"))
        levels = np.tile(np.array([9, 9, 60, 250, 240, 9], np.uint8), (5, 1))
        Path("photo.pgm").write_bytes(b"P5 6 5 255\n" + levels.tobytes())
        Image.fromarray(levels).save("photo.jpg")
        np.save("m.npy", np.zeros((5, 6), dtype=bool))
        np.save("zones.npy", np.ones((5, 6)))
        convert("m.txt", Path("m.yaml"))
        ended = _forked(
            ("study", "run", "study.yaml", "--store", "kept.study.db", "--workers", "1"), folder, -1
        )
        assert ended.code == 0, ended.err
    finally:
        os.chdir(here)


def prepared(source: Path, folder: Path) -> None:
    """A case's own folder."""
    folder.mkdir()
    for file in source.iterdir():
        if file.is_file() and not file.name.startswith("."):
            shutil.copyfile(file, folder / file.name)
    (folder / "d").mkdir()
    (folder / "d" / "inner.txt").write_text(ROOM)
    os.mkfifo(folder / "pipe")
    (folder / "loop").symlink_to("loop")
    os.mknod(folder / "sock", stat.S_IFSOCK | 0o600)


# ---- running ---------------------------------------------------------------------------------------------


def warm() -> None:
    """Import what verbs import, so that a forked case does not."""
    import lampyris.cli.request
    import lampyris.cli.verbs.compare.tables
    import lampyris.cli.verbs.speed_laws
    import lampyris.cli.verbs.study.files
    import lampyris.cli.verbs.study.running
    import lampyris.cli.verbs.study.tables
    import lampyris.model.settings.drive
    import lampyris.movingai
    import lampyris.races.race
    import lampyris.report.charts.drive_chart
    import lampyris.report.charts.speed_compare
    import lampyris.report.data.adgso_tables
    import lampyris.report.data.csv
    import lampyris.report.data.metrics
    import lampyris.report.film.drive_film
    import lampyris.report.film.race_film
    import lampyris.report.film.simulation_film
    import lampyris.report.pictures.plan_picture
    import lampyris.scenarios
    import lampyris.study.execution.run  # noqa: F401

    for name in registry.names():
        registry.planner_class(name)
    tree()


def _forked(words: tuple[str, ...], folder: Path, number: int) -> Ended:
    """Run the command line in a process of its own."""
    out, err = folder.parent / f"{folder.name}.out", folder.parent / f"{folder.name}.err"
    began = resource.getrusage(resource.RUSAGE_CHILDREN)
    pid = os.fork()
    if not pid:
        code = 99
        try:
            _limited(words, folder, out, err)
            main()
            code = 0
        except SystemExit as done:
            code = done.code if isinstance(done.code, int) else 0 if done.code is None else 1
        except BaseException as fault:  # as the interpreter would: a traceback, and exit code 1
            code = 1
            sys.__stderr__.write(f"Traceback: {type(fault).__name__}: {fault}\n")
        finally:
            for stream in (sys.stdout, sys.stderr):
                try:
                    stream.flush()
                except (OSError, ValueError):
                    code = 120
            os._exit(code)
    status = _waited(pid)
    code = os.waitstatus_to_exitcode(status)
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    seconds = used.ru_utime + used.ru_stime - began.ru_utime - began.ru_stime
    told = []
    for file in (out, err):
        data = file.read_bytes() if file.exists() else b""
        told.append((data[:3000] + data[-3000:]).decode("utf-8", "replace"))
        file.unlink(missing_ok=True)
    return Ended(number, words, code, *told, seconds)


def _limited(words: tuple[str, ...], folder: Path, out: Path, err: Path) -> None:
    """In the new process: its place, its streams and its limits."""
    os.setsid()
    for number, place in ((1, out), (2, err)):
        handle = os.open(place, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        os.dup2(handle, number)
        os.close(handle)
    null = os.open(os.devnull, os.O_RDONLY)
    os.dup2(null, 0)
    how: dict[str, Any] = {"mode": "w", "encoding": "utf-8", "closefd": False}
    sys.stdout = sys.__stdout__ = open(1, **how)  # noqa: SIM115
    sys.stderr = sys.__stderr__ = open(2, errors="backslashreplace", **how)  # noqa: SIM115
    os.chdir(folder)
    os.environ["XDG_DATA_HOME"] = str(folder)
    sys.argv = ["lampyris", *words]
    typer.main.get_command = lambda _: tree()  # once for all cases
    signal.signal(signal.SIGXCPU, signal.SIG_DFL)
    resource.setrlimit(resource.RLIMIT_CPU, (CPU_S, CPU_S + 2))
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    resource.setrlimit(resource.RLIMIT_FSIZE, (FILE_BYTES, FILE_BYTES))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def _waited(pid: int) -> int:
    end = time.monotonic() + WALL_S
    pause = 0.001
    while time.monotonic() < end:
        done, status = os.waitpid(pid, os.WNOHANG)
        if done:
            return status
        time.sleep(pause)
        pause = min(0.02, pause * 1.5)
    os.killpg(pid, signal.SIGKILL)
    return os.waitpid(pid, 0)[1]


def run(seed: int, numbers: range) -> Iterator[Ended]:
    """Run cases, one after another."""
    warm()
    with tempfile.TemporaryDirectory(prefix="lampyris-options-") as place:
        source = Path(place) / "template"
        source.mkdir()
        template(source)
        for number in numbers:
            folder = Path(place) / f"case{number}"
            prepared(source, folder)
            try:
                yield _forked(drawn(seed, number), folder, number)
            finally:
                shutil.rmtree(folder)


def told(cases: int, counts: Counter[str], wrong: list[Ended], seconds: float) -> str:
    """One line on what was run."""
    codes = ", ".join(f"{code} x{n:,}" for code, n in sorted(counts.items()))
    return f"{cases:,} cases, {len(wrong)} wrong, exit codes {codes}, {seconds:.0f} s"


def command_line() -> int:
    """Run a piece of a large size. 0: nothing is wrong."""
    asked = argparse.ArgumentParser(description=__doc__)
    asked.add_argument("--seed", type=int, default=1)
    asked.add_argument("--first", type=int, default=0)
    asked.add_argument("--cases", type=int, default=1000)
    asked.add_argument("--slow", type=float, default=8.0, help="tell of cases that take more CPU seconds")
    given = asked.parse_args()
    counts: Counter[str] = Counter()
    wrong: list[Ended] = []
    began = time.monotonic()
    for ended in run(given.seed, range(given.first, given.first + given.cases)):
        counts[str(ended.code)] += 1
        if (ended.number - given.first) % 500 == 499:
            print(f"{ended.number + 1 - given.first} cases, {time.monotonic() - began:.0f} s", flush=True)
        if ended.wrong:
            wrong.append(ended)
            print(f"{ended.number} {ended.words!r}\n    {ended.wrong}", flush=True)
        elif ended.seconds > given.slow:
            print(f"{ended.number} {ended.words!r}\n    {ended.seconds:.1f} s", flush=True)
    print(told(given.cases, counts, wrong, time.monotonic() - began))
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(command_line())

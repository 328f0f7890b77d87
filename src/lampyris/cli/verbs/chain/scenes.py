"""Scenes of chains: a map, a chain, and its configurations at start and goal; bundled ones, and YAML files."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from lampyris.errors import FileError, InputError, UsageError
from lampyris.model.chain.chain import MOST_LINKS, Chain
from lampyris.model.grid import Grid

BUNDLED = {
    "open": "a chain that turns where nothing is between",
    "tip": "a post that the tip of the outstretched chain meets",
    "post": "a post halfway, around which the chain has to fold",
    "gap": "a wall with a gap into which a chain of 8 links folds",
}
"""Bundled scenes, and what they are."""
KEYS = ("map", "resolution", "base", "links", "widths", "joint_limits", "start", "goal")
_NEEDED = ("map", "base", "links", "start", "goal")
_REACH = 4.0
"""Metres, of bundled chains."""


@dataclass(frozen=True, slots=True, eq=False)
class ChainScene:
    """What is planned.

    Parameters
    ----------
    grid, chain : the map and the chain.
    start, goal : one angle for each joint, radians.
    """

    grid: Grid
    chain: Chain
    start: Sequence[float]
    goal: Sequence[float]


def scene_of(name: str, links: int | None) -> ChainScene:
    """A bundled scene, or that of a file.

    Parameters
    ----------
    name : of :data:`BUNDLED`, or a file.
    links : how many links of equal length a bundled chain has; None: as the scene has it.

    Raises
    ------
    UsageError : ``LINKS``: a file states its own links, ``gap`` has eight.
    FileError : ``CHAIN_SCENE``: a file that cannot be read, or a value that is wrong, with its line.
    """
    if name in BUNDLED:
        if links is not None and not (1 <= links <= MOST_LINKS and (name != "gap" or links == 8)):
            allowed = "8, for the scene gap" if name == "gap" else f"1 to {MOST_LINKS}"
            raise UsageError("LINKS", f"{links} links", where="--links", allowed=allowed)
        return _bundled(name, links or (8 if name == "gap" else 4))
    if links is not None:
        allowed = f"one of the bundled scenes: {', '.join(BUNDLED)}"
        raise UsageError(
            "LINKS",
            "--links together with a scene file, which states its links",
            where="--links",
            allowed=allowed,
        )
    return _read(Path(name))


def _bundled(name: str, links: int) -> ChainScene:
    blocked = np.zeros((40, 40), dtype=np.bool_)
    walls = {
        "open": [(2, 4, 2, 4)],
        "tip": [(18, 22, 34, 36)],
        "post": [(18, 22, 28, 30)],
        "gap": [(0, 16, 28, 30), (21, 40, 28, 30)],
    }
    for top, low, left, right in walls[name]:
        blocked[top:low, left:right] = True
    width = min(0.2, 0.6 * _REACH / links)
    limits: Any = (-2.6, 2.6)
    start, goal = [-0.9, *[0.0] * (links - 1)], [0.9, *[0.0] * (links - 1)]
    if name == "open":
        goal = [1.5, *[0.2] * (links - 1)] if links < 8 else goal
    if name == "gap":
        width, limits = 0.15, [(-3.1, 3.1)] + [(-2.2, 2.2)] * 7
        start, goal = [2.6] + [0.15] * 7, [0.2, 0.0, 0.0, -0.2, 0.0, 0.0, 0.0, 0.0]
    chain = Chain((5.0, 5.0), [_REACH / links] * links, width, limits)
    return ChainScene(Grid(blocked, resolution=0.25, name=name), chain, start, goal)


def _read(path: Path) -> ChainScene:
    from lampyris import api
    from lampyris.io.files import read_regular
    from lampyris.io.text.strict_yaml import MAX_BYTES, read_yaml

    name = str(path)
    if not path.exists() and not path.suffix:
        allowed = f"{', '.join(BUNDLED)}, or a YAML file"
        raise FileError("CHAIN_SCENE", "no such scene", where=name, allowed=allowed)
    document = read_yaml(read_regular(name, MAX_BYTES), name)
    data = document.data
    for key in data:
        if key not in KEYS:
            raise FileError(
                "CHAIN_SCENE", f"unknown key {key!r}", where=document.at_key(key), allowed=", ".join(KEYS)
            )
    missing = [key for key in _NEEDED if key not in data]
    if missing:
        raise document.error("CHAIN_SCENE", f"no {missing[0]}", allowed=f"the keys {', '.join(_NEEDED)}")
    for key in ("base", "links", "start", "goal"):
        value = data[key]
        numbers = isinstance(value, list) and all(type(one) in (int, float) for one in value)
        if not numbers or not value:
            raise document.error(
                "CHAIN_SCENE", f"{key} is not a list of numbers", key, allowed="such as [0.5, 0.5]"
            )
    given, resolution = data["map"], data.get("resolution")
    if not isinstance(given, str):
        raise document.error("CHAIN_SCENE", "map is not a name", "map", allowed="a map file or a bundled map")
    beside = path.parent / given
    grid = api.load_grid(beside if beside.is_file() else given, resolution=resolution)
    more = {key: data[key] for key in ("widths", "joint_limits") if key in data}
    try:
        chain = Chain(data["base"], data["links"], **more)
        for key in ("start", "goal"):
            chain.joint_points(data[key])
    except InputError as wrong:
        field = wrong.where.removeprefix("chain.")
        if field not in data:
            field = "start" if len(data["start"]) != len(data["links"]) else "goal"
        raise document.error(wrong.code, wrong.what, field, allowed=wrong.allowed) from wrong
    return ChainScene(grid, chain, data["start"], data["goal"])

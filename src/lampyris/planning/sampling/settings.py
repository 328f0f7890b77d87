"""Settings that several planners that sample have: the field of each is declared here, once."""

from __future__ import annotations

from typing import Any

from lampyris._core.settings import flag, number, whole, word

ANYWHERE, CENTRES = "anywhere", "centres"
"""Where paths turn."""


def samples_of_first_path() -> Any:
    """Samples at most, of a planner that ends with its first path."""
    return whole(100_000, 1, 10_000_000)


def batch_of_first_path() -> Any:
    """Samples of one iteration of such a planner."""
    return whole(1000, 1, 1_000_000)


def samples_of_improving() -> Any:
    """Samples at most, of a planner that makes its path shorter until the end."""
    return whole(20_000, 1, 10_000_000)


def batch_of_improving() -> Any:
    """Samples of one iteration, or batch, of such a planner."""
    return whole(100, 1, 1_000_000)


def step() -> Any:
    """Longest line by which a tree grows."""
    return number(None, 2.0, 1e4, unit="cells", none="a tenth of the map's diagonal, 4 to 64")


def step_of_two_trees() -> Any:
    """Longest line by which a tree of two grows."""
    return number(None, 2.0, 1e4, unit="cells", none="a twentieth of the map's diagonal, 2 to 32")


def goal_bias() -> Any:
    """Share of samples that are the goal."""
    return number(0.05, 0.0, 1.0)


def narrow() -> Any:
    """Share of samples in narrow places."""
    return number(0.1, 0.0, 0.9)


def near_path() -> Any:
    """Share of samples near the best path."""
    return number(0.5, 0.0, 0.9)


def seeded() -> Any:
    """Whether a search begins with the cheapest path of the grid, pulled straight."""
    return flag(False)


def seed_after() -> Any:
    """Samples after which a search goes on from the cheapest path of the grid, pulled straight, if it has no shorter one."""
    return whole(2000, 1, 10_000_000, none="never")


def ancestors() -> Any:
    """Ancestors of a parent that are tried in its place."""
    return whole(2, 0, 1000)


def turns() -> Any:
    """Where the path of a planner that makes it shorter may turn."""
    return word(CENTRES, (CENTRES, ANYWHERE))

"""Labels of traffic for people; tables for programs keep the short label."""

from __future__ import annotations

import re

_KINDS = {
    "random-walk": ("random walker", "random walkers"),
    "patrol": ("patrol", "patrols"),
    "crossing": ("crossing obstacle", "crossing obstacles"),
    "mixed": ("mixed obstacle", "mixed obstacles"),
    "robots": ("robot", "robots"),
}
_LABEL = re.compile(r"(\d+) ([a-z-]+)(.*)", re.DOTALL)


def traffic_words(label: str) -> str:
    """``10 random walkers (live)`` of the label ``10 random-walk (live)``; of none ``no obstacles``."""
    if label == "none":
        return "no obstacles"
    found = _LABEL.fullmatch(label)
    if found is None:
        return label
    count, kind, more = found.groups()
    return f"{count} {kind_words(kind, int(count))}{more}"


def place_words(label: str) -> str:
    """``without moving obstacles``, ``among 10 random walkers``, ``with 100 robots``."""
    if label == "none":
        return "without moving obstacles"
    return f"{'with' if ' robots' in label else 'among'} {traffic_words(label)}"


def kind_words(kind: str, count: int = 2) -> str:
    """``random walkers`` of ``random-walk``; a kind that is not known as it is."""
    one, many = _KINDS.get(kind, (kind, kind))
    return one if count == 1 else many

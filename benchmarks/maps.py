"""The maps that benchmarks share, always the same, and where MovingAI's maps are."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from lampyris.api import load_grid


def random_map(size: int, share: float) -> np.ndarray:
    """Free cells of a map with that share of them blocked."""
    return np.random.default_rng(size + int(1000 * share)).random((size, size)) >= share


def maze(size: int, branching: float = 0.0) -> np.ndarray:
    """A perfect maze with corridors one cell wide, dug depth first.

    ``branching``: how often digging goes on from a cell picked at random. At 0 corridors are as long as they
    can be and a front is a cell or two wide, which is the worst there is for anything that works level by
    level; at 1/3 there are as many junctions as in the mazes of published benchmarks.
    """
    half = (size - 1) // 2
    rng = np.random.default_rng(size + int(1000 * branching))
    free = np.zeros((size, size), dtype=np.bool_)
    seen = np.zeros((half, half), dtype=np.bool_)
    stack = [(half // 2, half // 2)]
    seen[stack[0]] = True
    free[2 * stack[0][0] + 1, 2 * stack[0][1] + 1] = True
    while stack:
        if branching and rng.random() < branching:
            k = int(rng.integers(len(stack)))
            stack[k], stack[-1] = stack[-1], stack[k]
        y, x = stack[-1]
        ways = [
            (y + dy, x + dx)
            for dy, dx in ((0, 1), (1, 0), (0, -1), (-1, 0))
            if 0 <= y + dy < half and 0 <= x + dx < half and not seen[y + dy, x + dx]
        ]
        if not ways:
            stack.pop()
            continue
        v, u = ways[int(rng.integers(len(ways)))]
        seen[v, u] = True
        free[y + v + 1, x + u + 1] = True
        free[2 * v + 1, 2 * u + 1] = True
        stack.append((v, u))
    return free


def rooms(size: int, side: int = 15) -> np.ndarray:
    """Square rooms with a door, one cell wide, in each wall between two of them."""
    rng = np.random.default_rng(size)
    pitch = side + 1
    free = np.ones((size, size), dtype=np.bool_)
    free[::pitch] = False
    free[:, ::pitch] = False
    for top in range(0, size, pitch):
        for left in range(0, size, pitch):
            down, along = (int(v) for v in rng.integers(1, side + 1, 2))
            if left and top + down < size:
                free[top + down, left] = True
            if top and left + along < size:
                free[top, left + along] = True
    return free


def middle(free: np.ndarray) -> tuple[int, int]:
    """The free cell nearest to the middle of the map."""
    ys, xs = np.nonzero(free)
    k = int(np.argmin((ys - free.shape[0] // 2) ** 2 + (xs - free.shape[1] // 2) ** 2))
    return int(xs[k]), int(ys[k])


def published_folder(given: str | None = None) -> Path | None:
    """Where MovingAI's maps are (N. Sturtevant, IEEE TCIAIG 4(2), 2012), or None: they are not ours to ship.

    Looked for in maps/movingai of the folder that LAMPYRIS_SHARED names, or of a folder ``shared`` beside the
    project.
    """
    root = Path(__file__).resolve().parents[1]
    shared = Path(os.environ.get("LAMPYRIS_SHARED") or root.parent / "shared")
    folder = Path(given) if given else shared / "maps" / "movingai"
    return folder if folder.is_dir() else None


def published_map(name: str) -> np.ndarray | None:
    """Free cells of one of them, or None where it is not at hand."""
    folder = published_folder()
    for where in (folder, folder.with_name("mapf")) if folder else ():
        path = where / f"{name}.map"
        if path.is_file():
            return ~load_grid(path).blocked
    return None


def published_maps() -> list[tuple[str, np.ndarray]]:
    """Name and free cells of every map of both benchmarks of Moving AI Lab, the smallest first; empty if not at hand."""
    folder = published_folder()
    if folder is None:
        return []
    files = [*folder.glob("*.map"), *folder.with_name("mapf").glob("*.map")]
    found = [(path.stem, ~load_grid(path).blocked) for path in files]
    return sorted(found, key=lambda one: (one[1].size, one[0]))

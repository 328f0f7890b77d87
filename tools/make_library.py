"""Make the bundled maps again: ``python tools/make_library.py [env-1 ...]``.

Writes the maps ``env-1`` to ``env-6`` into ``src/lampyris/io/maps/data``. Run ``tools/make_recipe_maps.py``
after it: that makes the other maps, and measures all of them (size, hash, lengths, thumbnail).

The six 50x50 maps of the dissertation are lost with its figures; what is left of each are five start and
goal pairs and how many gates AD-GSO met on the way (Table 4.11). For each map this looks for walls of our
own where *every* optimal path of a pair passes exactly that many gates, for the dissertation's moves
(10/14, corners cut) and for octile moves (no corner cut): simulated annealing over the openings of a map
made by the recipe ``gates``. With all gates closed at once every other free cell can still be reached, so
a planner that closes them pays a longer way and never the loss of every way. What the search changed is
kept as edits, so the map is recipe + seed + edits, and ``tests/io/test_map_library.py`` makes it again and
compares every cell.

The search is not needed to use the maps, and takes about six minutes for all six.
"""

from __future__ import annotations

import json
import math
import re
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.ndimage import label

from lampyris.io.maps.recipes.draw import Draw
from lampyris.io.maps.recipes.gates import Wall, divide, put_clutter
from lampyris.io.maps.recipes.make import RectangleEdit, make
from lampyris.io.maps.recipes.regions import keep_largest
from lampyris.kernels._jit import kernel

DATA = Path(__file__).resolve().parent.parent / "src" / "lampyris" / "maps" / "data"
SIZE = 50
# What weighs as much as so many gates too many: a pair without a way, a part reached through gates only.
UNREACHED = 40
CUT_OFF = 1.5
# Straight and diagonal cost. 577/408 is a convergent of sqrt 2: exact order for paths with under 408
# diagonals.
COSTS = ((10, 14, True), (408, 577, False))
MAX_COST = 400_000


@dataclass(frozen=True)
class Target:
    """What one map must be like.

    ``pairs`` are the rows of Table 4.11 for AD-GSO, ``free`` the greatest share of cells that are free,
    ``settings`` the recipe's.
    """

    title: str
    description: str
    free: float
    pairs: tuple[tuple[int, int, int, int, int], ...]
    settings: dict[str, int | float]


TARGETS = {
    "env-1": Target(
        "Crowded rooms",
        "Small rooms full of things; the short ways lead through gates, the wide openings lie off them.",
        0.765,
        ((37, 8, 5, 38, 3), (45, 6, 19, 41, 4), (0, 42, 6, 2, 3), (3, 2, 2, 48, 3), (21, 14, 21, 37, 4)),
        {
            "room": 7,
            "rooms": 20,
            "doors": 2,
            "narrow": 0.75,
            "wide": 4,
            "clutter": 1500,
            "bulk": 8,
            "large": 1500,
        },
    ),
    "env-2": Target(
        "Rooms with doors",
        "Rooms with narrow and wide openings, cluttered; from three gates on a way to none.",
        0.8,
        (
            (24, 24, 35, 38, 3),
            (34, 38, 25, 13, 2),
            (18, 21, 32, 42, 2),
            (33, 18, 25, 35, 1),
            (42, 3, 0, 37, 0),
        ),
        {
            "room": 7,
            "rooms": 15,
            "doors": 2,
            "narrow": 0.6,
            "wide": 5,
            "clutter": 500,
            "bulk": 5,
            "large": 200,
        },
    ),
    "env-3": Target(
        "Halls",
        "Larger rooms, most of their openings wide, some clutter.",
        0.845,
        ((28, 7, 26, 26, 2), (14, 48, 33, 16, 1), (43, 47, 23, 15, 1), (8, 0, 48, 46, 0), (48, 24, 1, 24, 0)),
        {"room": 9, "rooms": 10, "doors": 2, "narrow": 0.5, "wide": 6, "clutter": 260, "bulk": 5},
    ),
    "env-4": Target(
        "Open halls",
        "A few large halls and scattered blocks.",
        0.885,
        ((3, 6, 47, 14, 2), (25, 22, 47, 14, 1), (41, 1, 2, 3, 1), (5, 49, 18, 0, 0), (27, 1, 16, 48, 0)),
        {"room": 10, "rooms": 7, "doors": 2, "narrow": 0.45, "wide": 7, "clutter": 130, "bulk": 5},
    ),
    "env-5": Target(
        "Yard with walls",
        "Three or four long walls in a yard, little else.",
        0.925,
        ((22, 13, 27, 17, 1), (33, 36, 22, 12, 1), (11, 42, 31, 8, 1), (1, 48, 49, 1, 0), (26, 4, 23, 48, 0)),
        {"room": 11, "rooms": 5, "doors": 2, "narrow": 0.4, "wide": 9, "clutter": 60, "bulk": 4},
    ),
    "env-6": Target(
        "Open field",
        "An open field with a few blocks; nothing narrow anywhere.",
        0.975,
        ((48, 49, 1, 49, 0), (0, 49, 0, 3, 0), (0, 0, 49, 49, 0), (0, 49, 49, 0, 0), (39, 2, 15, 37, 0)),
        {"room": 20, "rooms": 1, "doors": 1, "narrow": 0.0, "wide": 9, "clutter": 22, "bulk": 4},
    ),
}


GUIDE = {
    "file": "guide.txt",
    "title": "Guide map",
    "description": "The 10x10 example of the dissertation, read off its Table 4.2, with its start and goal.",
    "gates": 1,
    "recipe": None,
    "queries": [{"start": [0, 9], "goal": [7, 0], "gates": 0, "label": "Tables 4.3 to 4.6"}],
}


@kernel(out=("dist", "least", "most", "head", "link"))
def gates_on_optimal_paths(
    free, gate, width, height, start, goal, straight, diagonal, cutting, dist, least, most, head, link
):  # type: ignore[no-untyped-def]
    """Fewest and most gates over all optimal paths, written at ``goal``: Dijkstra, a bucket for each cost.

    ``link`` holds 8 entries a cell (a cell is put in again when it gets cheaper); ``dist`` is -1 where
    never reached.
    """
    n = width * height
    for c in range(n):
        dist[c] = -1
    for d in range(len(head)):
        head[d] = -1
    if not free[start] or not free[goal]:
        return
    used = 1
    dist[start] = 0
    least[start] = most[start] = gate[start]
    head[0] = 0
    link[0] = -1
    link[len(link) // 2] = start
    d = 0
    while d < len(head) and (dist[goal] < 0 or d <= dist[goal]):
        entry = head[d]
        if entry < 0:
            d += 1
            continue
        head[d] = link[entry]
        c = link[len(link) // 2 + entry]
        if dist[c] != d:
            continue
        x, y = c % width, c // width
        for k in range(9):
            dx, dy = k % 3 - 1, k // 3 - 1
            if k == 4 or not (0 <= x + dx < width and 0 <= y + dy < height):
                continue
            t = c + dy * width + dx
            if not free[t]:
                continue
            both = dx != 0 and dy != 0
            if both and not cutting and not (free[c + dx] and free[c + dy * width]):
                continue
            e = d + (diagonal if both else straight)
            if dist[t] == e:
                least[t] = min(least[t], least[c] + gate[t])
                most[t] = max(most[t], most[c] + gate[t])
            elif dist[t] < 0 or e < dist[t]:
                dist[t] = e
                least[t] = least[c] + gate[t]
                most[t] = most[c] + gate[t]
                link[used] = head[e]
                link[len(link) // 2 + used] = t
                head[e] = used
                used += 1


def gate_mask(blocked: np.ndarray) -> np.ndarray:
    """Free cells between two blocked cells of the map, left and right or above and below (a gate)."""
    pad = np.pad(blocked, 1)
    mask: np.ndarray = ~blocked & ((pad[1:-1, :-2] & pad[1:-1, 2:]) | (pad[:-2, 1:-1] & pad[2:, 1:-1]))
    return mask


class Judge:
    """Counts, for a map, how far each pair is from the gates it should meet."""

    def __init__(self, pairs: tuple[tuple[int, int, int, int, int], ...]) -> None:
        self.pairs = pairs
        n = SIZE * SIZE
        self.dist, self.least, self.most = (np.zeros(n, dtype=np.int64) for _ in range(3))
        self.head = np.zeros(MAX_COST, dtype=np.int64)
        self.link = np.zeros(16 * n, dtype=np.int64)

    def counts(self, blocked: np.ndarray) -> Iterator[tuple[int, int, int]]:
        """(wanted, fewest, most) for each pair and each move set; most = -1 where there is no way."""
        free = np.ascontiguousarray(~blocked).ravel()
        gate = gate_mask(blocked).ravel().astype(np.int64)
        count = gates_on_optimal_paths.compiled()
        for x0, y0, x1, y1, wanted in self.pairs:
            goal = y1 * SIZE + x1
            for straight, diagonal, cutting in COSTS:
                head = self.head[: straight * 400]
                count(
                    free, gate, SIZE, SIZE, y0 * SIZE + x0, goal, straight, diagonal, cutting,
                    self.dist, self.least, self.most, head, self.link,
                )  # fmt: skip
                if self.dist[goal] < 0:
                    yield wanted, 0, -1
                else:
                    yield wanted, int(self.least[goal]), int(self.most[goal])

    def miss(self, blocked: np.ndarray) -> float:
        """0 when all pairs are as wanted, and a closed gate never cuts a cell off."""
        # By sides only: who gets through without passing a corner gets through with either move set.
        pieces = label(~blocked & ~gate_mask(blocked))[1]
        total = CUT_OFF * (pieces - 1.0)
        for wanted, least, most in self.counts(blocked):
            total += UNREACHED if most < 0 else abs(least - wanted) + abs(most - wanted)
        return total


def draw_map(walls: list[Wall], clutter: np.ndarray) -> np.ndarray:
    """The blocked cells of walls with their openings, and of clutter."""
    blocked = clutter.copy()
    for wall in walls:
        wall.build(blocked)
    for wall in walls:
        wall.open(blocked)
    return blocked


def change_one_wall(draw: Draw, wall: Wall, wide: int, narrow: float) -> list[tuple[int, int]]:
    """New openings for one wall; returns the old ones."""
    old = list(wall.openings)
    act = draw.below(4)
    if act == 0 and len(wall.openings) > 1:
        wall.openings.pop(draw.below(len(wall.openings)))
    else:
        if act != 1 and wall.openings:
            wall.openings.pop(draw.below(len(wall.openings)))
        width = 1 if draw.unit() < narrow else draw.between(2, wide)
        for _ in range(8):
            first = draw.between(wall.low + 1, max(wall.low + 1, wall.high - width))
            if wall.fits(first, width) and len(wall.openings) < 3:
                wall.openings.append((first, width))
                break
    return old


def search(target: Target, seed: int, steps: int) -> tuple[np.ndarray, np.ndarray, float]:
    """One annealing run: the recipe's map, the best map found, and how far it is off."""
    keep = tuple(c for p in target.pairs for c in (p[:2], p[2:4]))
    s = dict(target.settings)
    recipe = make("gates", SIZE, SIZE, seed, keep=keep, **s)
    draw = Draw(seed)
    clutter, bulk, large = int(s.pop("clutter")), int(s.pop("bulk")), int(s.pop("large", 0))
    walls = divide(draw, SIZE, SIZE, keep=keep, **s)  # type: ignore[arg-type]
    whole = np.zeros((SIZE, SIZE), dtype=np.bool_)
    for wall in walls:
        wall.build(whole)
    put_clutter(draw, whole, large, bulk, keep, least=(bulk + 1) // 2)
    put_clutter(draw, whole, clutter, bulk, keep)
    judge = Judge(target.pairs)
    shuffle = Draw(seed + 2**40)
    now = draw_map(walls, whole)
    assert np.array_equal(keep_largest(now), recipe)
    value = judge.miss(now)
    best, best_value = now, value
    for k in range(steps):
        if best_value == 0 or not walls:
            break
        wall = shuffle.pick(walls)
        old = change_one_wall(shuffle, wall, int(s["wide"]), float(s["narrow"]))
        new = draw_map(walls, whole)
        new_value = judge.miss(new) if wall.openings else math.inf
        heat = 1.5 * (1 - k / steps) + 0.05
        if new_value <= value or shuffle.unit() < math.exp((value - new_value) / heat):
            now, value = new, new_value
            if value < best_value:
                best, best_value = now, value
        else:
            wall.openings[:] = old
    return recipe, best, best_value


def edits_between(before: np.ndarray, after: np.ndarray) -> list[RectangleEdit]:
    """Rectangles that turn one map into the other: runs along rows, equal runs below each other joined."""
    edits: list[RectangleEdit] = []
    differs = before != after
    done = np.zeros_like(differs)
    for y in range(SIZE):
        for x in range(SIZE):
            if not differs[y, x] or done[y, x]:
                continue
            wall = bool(after[y, x])
            same = differs & ~done & (after == wall)
            w = 1
            while x + w < SIZE and same[y, x + w]:
                w += 1
            h = 1
            while y + h < SIZE and same[y + h, x : x + w].all():
                h += 1
            done[y : y + h, x : x + w] = True
            edits.append(RectangleEdit(x, y, w, h, wall))
    return edits


def text(blocked: np.ndarray) -> str:
    """The map as the text format has it."""
    return "".join("".join("#" if c else "." for c in row) + "\n" for row in blocked)


def compact(text: str) -> str:
    """JSON with its innermost lists, and its queries, on one line each."""
    for innermost in (r"\[[^\[\]{}]*\]", r"\{[^{}]*\}"):
        text = re.sub(innermost, lambda m: re.sub(r"\s*\n\s*", " ", m[0]) if len(m[0]) < 400 else m[0], text)
    return text


def main(names: list[str]) -> None:
    """Search each named map and write its text and its entry in the index."""
    index_file = DATA / "index.json"
    index = json.loads(index_file.read_text()) if index_file.exists() else {"maps": {}}
    index["maps"]["guide"] = GUIDE
    for name in names or list(TARGETS):
        target = TARGETS[name]
        for seed in range(1000 * int(name[-1]), 1000 * int(name[-1]) + 200):
            recipe, best, off = search(target, seed, 3000)
            free = 1 - best.mean()
            print(f"{name}, seed {seed}: off by {off}, {free:.1%} free", flush=True)
            if off == 0 and free <= target.free:
                break
        else:
            raise SystemExit(f"{name}: no seed fits")
        (DATA / f"{name}.txt").write_text(text(best))
        keep = [list(c) for p in target.pairs for c in (p[:2], p[2:4])]
        index["maps"][name] = {
            "file": f"{name}.txt",
            "title": target.title,
            "description": target.description,
            "gates": int(gate_mask(best).sum()),
            "recipe": {
                "name": "gates",
                "width": SIZE,
                "height": SIZE,
                "seed": seed,
                "settings": {**target.settings, "keep": keep},
                "edits": [[e.x, e.y, e.width, e.height, int(e.wall)] for e in edits_between(recipe, best)],
            },
            "queries": [
                {
                    "start": p[:2],
                    "goal": p[2:4],
                    "gates": p[4],
                    "label": f"Table 4.11, environment {name[-1]}, path {k}",
                }
                for k, p in enumerate(target.pairs, 1)
            ],
        }
        index_file.write_text(compact(json.dumps(index, indent=1)) + "\n")


if __name__ == "__main__":
    main(sys.argv[1:])

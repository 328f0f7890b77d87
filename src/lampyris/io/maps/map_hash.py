"""One name for what a map says, whichever file it came from."""

from __future__ import annotations

import hashlib

import numpy as np

from lampyris.model.grid import Grid


def map_hash(grid: Grid) -> str:
    """SHA-256 of a map's cells, 64 hexadecimal digits; the same for every format the map is kept in.

    Over the size, which cells are blocked and, where there is such, which are unknown and the terrain. Not
    over resolution and origin, which most formats cannot say, nor over the name, start, goal and moving
    obstacles: two hashes are equal when a planner would be asked about the same cells. A format that
    cannot tell unknown from blocked (MovingAI) therefore gives a map with unknown cells another hash.
    """
    digest = hashlib.sha256(f"lampyris map 1\nsize {grid.width} {grid.height}\nblocked\n".encode())
    digest.update(np.packbits(grid.blocked).tobytes())
    if grid.unknown is not None and grid.unknown.any():
        # A section of its own, left out when empty: what is added to maps later leaves the old hashes alone.
        digest.update(b"unknown\n")
        digest.update(np.packbits(grid.unknown).tobytes())
    if grid.terrain is not None:
        digest.update(b"terrain\n")
        digest.update(np.ascontiguousarray(grid.terrain).tobytes())
    return digest.hexdigest()

"""Rooms of many sizes, wall to wall, with doors."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lampyris.io.maps.recipes.draw import Draw
from lampyris.io.maps.recipes.recipe import RecipeSetting
from lampyris.io.maps.recipes.regions import open_doors
from lampyris.typing import BoolGrid

SETTINGS = (
    RecipeSetting("room", 5, 2, 1024, "least side of a room, cells"),
    RecipeSetting(
        "hall", 14, 2, 4096, "a room with a longer side is divided again where that is possible, cells"
    ),
    RecipeSetting("door", 2, 1, 64, "width of a door, cells; less where two rooms share less wall"),
    RecipeSetting("loops", 0.35, 0.0, 1.0, "share of the neighbours that get a door without need"),
)


def rooms(draw: Draw, width: int, height: int, *, room: int, hall: int, door: int, loops: float) -> BoolGrid:
    """Rooms behind walls one cell thick, divided again and again across their longer side.

    The doors of a random spanning tree make every room reachable; ``loops`` adds others.
    """
    blocked = np.ones((height, width), dtype=np.bool_)
    number = np.zeros((height, width), dtype=np.int32)
    boxes = divide(draw, width, height, room, hall)
    for k, (x0, y0, x1, y1) in enumerate(boxes.tolist(), 1):
        number[y0 : y1 + 1, x0 : x1 + 1] = k
        blocked[y0 : y1 + 1, x0 : x1 + 1] = False
    open_doors(draw, blocked, number, door, loops)
    return blocked


def divide(draw: Draw, width: int, height: int, room: int, hall: int) -> NDArray[np.int64]:
    """The rooms inside a wall around the map: x0, y0, x1, y1, ends included; int64 (n, 4).

    All boxes of one generation are divided at once; a box is done when it is no longer than ``hall``, or
    cannot hold two rooms and the wall between them.
    """
    boxes = np.array([[1, 1, width - 2, height - 2]], dtype=np.int64)
    done = []
    while len(boxes):
        sides = boxes[:, 2:] - boxes[:, :2] + 1
        across = np.where(
            sides[:, 0] == sides[:, 1], draw.belows(np.full(len(boxes), 2)), sides.argmax(axis=1)
        )
        side = sides[np.arange(len(boxes)), across]
        small = (side <= hall) | (side < 2 * room + 1)
        done.append(boxes[small])
        boxes, across, side = boxes[~small], across[~small], side[~small]
        row = np.arange(len(boxes))
        wall = boxes[row, across] + room + draw.belows(side - 2 * room)
        before, behind = boxes.copy(), boxes.copy()
        before[row, across + 2] = wall - 1
        behind[row, across] = wall + 1
        boxes = np.concatenate((before, behind))
    return np.concatenate(done)

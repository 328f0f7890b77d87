"""The collision check of moving footprints against exact polygons."""

from __future__ import annotations

import math

import numpy as np
import pytest
from shapely import STRtree, affinity
from shapely.geometry import Polygon as Shape
from shapely.geometry import box

from lampyris.kernels.hybrid.collision import FINE, piece_free
from lampyris.model.grid import Grid
from lampyris.model.robot import Polygon
from lampyris.planning.hybrid.map import HybridMap
from lampyris.planning.hybrid.motions import HybridShape
from reference.kernel_forms import use
from sizes import sized

FOOTPRINTS: dict[str, Polygon] = {
    "car": ((1.9, 0.6), (-0.5, 0.6), (-0.5, -0.6), (1.9, -0.6)),
    "wide": ((0.5, 2.6), (-0.4, 2.6), (-0.4, -2.6), (0.5, -2.6)),
    "arrow": ((1.4, 0.0), (-0.7, 0.9), (-0.3, 0.0), (-0.7, -0.9)),
}


def shape_of(footprint: Polygon) -> HybridShape:
    return HybridShape(footprint, "omnidirectional", 2.0, 72, 1.5, 2.0, 1.0, 0.0)


def is_free(
    hybrid_map: HybridMap, pose: tuple[float, float, float], piece: tuple[float, float, float]
) -> bool:
    shape, border = hybrid_map.shape, hybrid_map.border
    vertices = np.array(shape.footprint)
    return bool(
        piece_free(
            hybrid_map.walls, hybrid_map.clear, hybrid_map.stride, hybrid_map.walls.size // hybrid_map.stride, border,
            vertices[:, 0].copy(), -vertices[:, 1], shape.cover.ravel(), shape.inner, shape.outer, pose[0] + border,
            pose[1] + border, pose[2], *piece,
        )
    )  # fmt: skip


def poses_along(
    pose: tuple[float, float, float], piece: tuple[float, float, float]
) -> list[tuple[float, float, float]]:
    """Dense poses of a piece, by small steps (y down)."""
    (x, y, yaw), (length, turn, lateral) = pose, piece
    n = 400
    found = []
    for k in range(n + 1):
        t = turn * k / n
        if abs(turn) < 1e-12:
            z = length * k / n * np.exp(1j * (yaw + lateral))
        else:
            z = length / turn * (np.exp(1j * (yaw + lateral + t)) - np.exp(1j * (yaw + lateral))) / 1j
        found.append((x + z.real, y + z.imag, yaw + t))
    return found


@pytest.mark.commit(1)
@sized("count", 8, 4000)
@pytest.mark.parametrize("footprint", FOOTPRINTS)
def test_no_collision_is_missed_and_hardly_any_is_invented(footprint: str, count: int) -> None:
    rng = np.random.default_rng(len(footprint))
    outline = Shape([(x, -y) for x, y in FOOTPRINTS[footprint]])
    free = blocked = close = 0
    while free + blocked < count:
        walls = rng.random((22, 22)) < 0.03
        hybrid_map = HybridMap(Grid(walls), shape_of(FOOTPRINTS[footprint]))
        squares = [box(x - 0.5, y - 0.5, x + 0.5, y + 0.5) for y, x in np.argwhere(walls).tolist()]
        tree = STRtree(squares)
        for _ in range(10):
            pose = (*rng.uniform(2, 20, 2).tolist(), float(rng.uniform(-4, 4)))
            if not hybrid_map.stands(*pose):
                continue
            piece = tuple(
                float(rng.choice([0.0, 1.0])) * float(rng.uniform(-size, size)) for size in (6, 2, math.pi)
            )
            found = is_free(hybrid_map, pose, piece)  # type: ignore[arg-type]
            least, deep, inside = math.inf, 0.0, True
            for x, y, yaw in poses_along(pose, piece):  # type: ignore[arg-type]
                placed = affinity.translate(affinity.rotate(outline, yaw, (0, 0), use_radians=True), x, y)
                edge = min(x + 0.5, y + 0.5, 21.5 - x, 21.5 - y)  # where the base meets the end of the map
                inside &= edge >= 0.0
                least = min(
                    [least, edge, *(placed.distance(squares[k]) for k in tree.query(placed.buffer(0.5)))]
                )
                deep = max([deep, *(placed.intersection(squares[k]).area for k in tree.query(placed))])
            if found:
                free += 1
                assert inside
                assert deep < 1e-9
            else:
                blocked += 1
                if inside and deep == 0.0:
                    close += 1
                    # The piece is judged by axes, so diagonally it is root 2 times as careful.
                    assert least < 2 * math.sqrt(2) * FINE + 0.02
    assert free > count / 10
    assert blocked > count / 10
    assert close < blocked / 3


@pytest.mark.parametrize("footprint", FOOTPRINTS)
def test_discs_cover_the_footprint(footprint: str) -> None:
    shape = shape_of(FOOTPRINTS[footprint])
    outline = Shape([(x, -y) for x, y in FOOTPRINTS[footprint]])
    discs = [
        Shape.from_bounds(0, 0, 1, 1).centroid.__class__(x, y).buffer(r * 1.01, 64) for x, y, r in shape.cover
    ]
    covered = discs[0]
    for one in discs[1:]:
        covered = covered.union(one)
    assert covered.contains(outline)


def test_both_forms_agree(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(3)
    walls = rng.random((20, 20)) < 0.05
    hybrid_map = HybridMap(Grid(walls), shape_of(FOOTPRINTS["car"]))
    drawn = rng.uniform(-1, 1, (200, 6))
    found = {}
    for form in ("plain", "compiled"):
        use(monkeypatch, form)
        found[form] = [
            is_free(hybrid_map, (10 + 8 * a, 10 + 8 * b, 3 * c), (4 * d, 2 * e, f))
            for a, b, c, d, e, f in drawn.tolist()
        ]
    assert found["plain"] == found["compiled"]
    assert 10 < sum(found["plain"]) < 190

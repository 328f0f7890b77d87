"""Pictures for docs/speed: what a robot sees, what it chooses among three speeds, and a cloud with its drops.

    python tools/related_speed_figures.py

Writes docs/img/speed-blind.png, speed-three.png and speed-cloud.png.
"""

from __future__ import annotations

from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.colors import ListedColormap

from lampyris.model.grid import Grid
from lampyris.model.obstacles import ObstacleStates
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.motion.cap_values import Around
from lampyris.motion.geometry.sampled_path import SampledPath, sample_path
from lampyris.motion.laws.physical import PhysicalLaw
from lampyris.motion.laws.registry import profile
from lampyris.motion.safety.blind_areas import BlindArea, blind_cap, visible_cells
from lampyris.motion.safety.danger_cloud import Cloud, degree, drops, membership
from lampyris.motion.safety.three_speed import ThreeSpeed, ThreeSpeedControl
from related_speed_table import office

matplotlib.use("Agg")
from matplotlib import pyplot as plt

OUT = Path("docs/img")


def save(figure: plt.Figure, name: str) -> None:
    """Write a small picture, the same bytes every time."""
    figure.savefig(OUT / name, dpi=80, metadata={"Software": None})
    plt.close(figure)
    print(name, (OUT / name).stat().st_size)


def blind() -> None:
    """The office: what is seen from one node, and the speed with the law."""
    scene, path = office()
    course = sample_path(path, scene.grid.resolution)
    cap = blind_cap(course, scene, BlindArea(), Around())[0].v
    made = profile(course, scene, law=PhysicalLaw(clearance=False, blind=BlindArea()))
    slow = np.flatnonzero((cap < 0.5) & (course.s > 0.3 * course.s[-1]))
    x, y = (int(v) for v in course.xy[slow[0]])
    seen = visible_cells(scene.grid, (x, y), 15.0)
    figure, (top, low) = plt.subplots(
        2, 1, figsize=(7.2, 6.6), layout="constrained", gridspec_kw={"height_ratios": (2.4, 1)}
    )
    top.imshow(
        np.where(scene.grid.blocked, 2, seen.astype(int)),
        cmap=ListedColormap(["#d9d9d6", "#fdf3c7", "#2b2d33"]),
        interpolation="nearest",
    )
    dots = top.scatter(*course.xy.T, c=made.v, s=7, cmap="viridis", vmin=0.0, vmax=1.0)
    top.plot(x, y, "o", color="#c1121f", ms=6)
    top.set(xticks=[], yticks=[], title="what the robot sees at the red place; its way by speed")
    figure.colorbar(dots, ax=top, label="m/s", shrink=0.8)
    low.plot(course.s, np.minimum(cap, 1.0), color="#b9b9b5", lw=1, label="cap of blind areas")
    low.plot(course.s, made.v, color="#2c5f8a", lw=1.2, label="profile")
    low.axvline(float(course.s[slow[0]]), color="#c1121f", lw=0.8)
    low.set(xlabel="m along the way", ylabel="m/s", ylim=(0, 1.1))
    low.legend(loc="upper right", fontsize=8)
    save(figure, "speed-blind.png")


def three() -> None:
    """A straight way and one obstacle that stops in it, then goes on: belief and choice over time."""
    scene = Scene(Grid(np.zeros((41, 101), dtype=bool), resolution=0.2), (0, 20), (100, 20), robot=Robot(0.2))
    x = np.arange(101.0)
    xy = np.stack((x, np.full(101, 20.0)), axis=1)
    zero = np.zeros(101)
    control, settings = ThreeSpeedControl(ThreeSpeed()), ThreeSpeed()
    s, rows, place = 0.0, [], np.array([40.0, 4.0])
    for k in range(22):
        k0 = min(int(s / 0.2), 99)
        left = SampledPath(
            x[k0:] * 0.2 - k0 * 0.2, xy[k0:], np.tile((1.0, 0.0), (101 - k0, 1)), zero[k0:],
            zero[k0:].astype(bool), 0.2,
        )  # fmt: skip
        stands = 4 <= k < 10
        movers = ObstacleStates(place[None], [0.3], [1.0], [[0.0, 0.8]])
        control.update(movers, 1.0, left)
        cap = control.cap(left, scene, Around(obstacle_states=movers))[0].v[0]
        rows.append((k, min(float(cap), 1.0), *control.belief[0], float(place[1] - 20) * 0.2, s))
        s += min(float(cap), 1.0)
        place = place + np.array((0.0, 0.0 if stands else 4.0))
        if s >= 19.8:
            break
    t, v, keeps, stops, comes, off, _ = np.array(rows).T
    figure, (top, middle, low) = plt.subplots(3, 1, figsize=(7.2, 5.4), sharex=True, layout="constrained")
    top.plot(t, off, "o-", ms=3, color="#8e5ea2")
    top.axhspan(-0.6, 0.6, color="#d9d9d6")
    top.set(ylabel="m from the way", title="an obstacle that stops in the way for six seconds")
    for line, name, colour in (
        (keeps, "keeps", "#1f7a5c"),
        (stops, "stops", "#c0392b"),
        (comes, "comes", "#b9770e"),
    ):
        middle.plot(t, line, color=colour, label=name)
    middle.set(ylabel="belief", ylim=(0, 1.05))
    middle.legend(fontsize=8)
    low.step(t, v, where="post", color="#2c5f8a")
    low.set(xlabel="s", ylabel="speed chosen, m/s", yticks=settings_speeds(settings), ylim=(0, 1.1))
    save(figure, "speed-three.png")


def settings_speeds(settings: ThreeSpeed) -> list[float]:
    """Slow, normal, fast for a top speed of 1 m/s."""
    return [pace / settings.paces[2] for pace in settings.paces]


def cloud() -> None:
    """Drops of the cloud of time to contact, its expected membership, and the degree that the law uses."""
    shape = Cloud(0.0, 2.0, 0.2)
    x, mu = drops(shape, 1500, np.random.default_rng(1))
    line = np.linspace(-7, 7, 281)
    figure, axis = plt.subplots(figsize=(7.2, 3.4), layout="constrained")
    axis.plot(x, mu, ".", ms=1.5, color="#8fb3d1", label="drops")
    axis.plot(line, membership(shape, line), color="#2c5f8a", lw=1.2, label="expected membership")
    axis.plot(line, degree(shape, line), "--", color="#c1121f", lw=1.2, label="degree of danger")
    axis.set(xlabel="seconds to contact", xlim=(-7, 7), ylim=(0, 1.05))
    axis.legend(fontsize=8)
    save(figure, "speed-cloud.png")


if __name__ == "__main__":
    OUT.mkdir(parents=True, exist_ok=True)
    blind()
    three()
    cloud()

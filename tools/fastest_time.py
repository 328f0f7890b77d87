"""Travel time of the fastest path beside that of the shortest, on bundled maps: a Markdown table.

    python tools/fastest_time.py --law physical --widest 1024
    python tools/fastest_time.py --law blind --widest 256
    python tools/fastest_time.py --picture docs/img/fastest-time.png

Both paths are profiled under the same law on their cells, with limits of acceleration; so is the path of
``fastest-time`` with ``slowing=true``. Every stored query counts alike. ``bound`` is the fastest path's time over the
least travel time under the static caps, which no path of the lattice undercuts.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from typing import Any

import numpy as np

import lampyris
from lampyris.io.maps import library
from lampyris.io.maps.load import load_map
from lampyris.model.plan import Plan
from lampyris.model.profile import Profile

ROBOT = lampyris.Robot(radius=0.3)
NOTE = "least travel time under the static caps: "


def bound_of(plan: Plan) -> float:
    """The least travel time that a plan of ``fastest-time`` states, seconds."""
    text = next(note for note in plan.notes if note.startswith(NOTE))
    return float(text.removeprefix(NOTE).split()[0])


def driven(scene: lampyris.Scene, planner: str, law: str, **settings: Any) -> tuple[Plan, Profile | None, float]:
    """A plan, its profile and the CPU seconds of planning."""
    began = time.process_time()
    plan = lampyris.plan(scene, planner, record=False, **settings)
    took = time.process_time() - began
    return plan, None if plan.path is None else lampyris.speed_profile(scene, plan, law), took


def row(name: str, law: str, most: int) -> str | None:
    """The row of a map; None if nothing was found."""
    document = load_map(name)
    queries = document.queries[:most] or ([document] if document.start is not None else [])
    blind = {"blind": True} if law == "blind" else {}
    rows = []
    for query in queries:
        scene = lampyris.Scene(document.grid, query.start, query.goal, robot=ROBOT)
        short = driven(scene, "astar", law)
        if short[1] is None:
            continue
        fast = driven(scene, "fastest-time", law, **blind)
        slow = driven(scene, "fastest-time", law, slowing=True, **blind)
        assert fast[1] is not None and slow[1] is not None
        times = [one[1].duration for one in (short, fast, slow)]
        assert bound_of(fast[0]) <= min(times) * (1 + 1e-9), name
        lengths = [one[1].s[-1] for one in (short, fast, slow)]
        rows.append((*times, *lengths, fast[1].duration / bound_of(fast[0]), short[2], fast[2]))
    if not rows:
        return None
    a = np.array(rows)
    t, length = a[:, :3].mean(axis=0), a[:, 3:6].mean(axis=0)
    faster = int((a[:, 1] < a[:, 0] - 1e-9).sum()), int((a[:, 2] < a[:, 0] - 1e-9).sum())
    return (
        f"| `{name}`, {len(rows)} | {t[0]:.2f} | {t[1]:.2f} | {t[1] / t[0] - 1:+.1%} | {faster[0]} of {len(rows)} | "
        f"{t[2]:.2f} | {t[2] / t[0] - 1:+.1%} | {faster[1]} of {len(rows)} | {length[1] / length[0] - 1:+.1%} | "
        f"{a[:, 6].mean():.3f} | {a[:, 7].mean():.2f} | {a[:, 8].mean():.2f} |"
    )


def table(law: str, widest: int, most: int) -> None:
    """Print the table of a law."""
    print(
        "| map, queries | shortest, s | fastest-time, s | | faster | slowing=true, s | | faster | longer by | "
        "time / bound | CPU s, shortest | CPU s, fastest-time |"
    )
    print("|" + "---|" * 12)
    for name in library.names():
        if max(load_map(name).grid.blocked.shape) > widest:
            continue
        line = row(name, law, most)
        if line is not None:
            print(line, flush=True)


def picture(out: Path, name: str, law: str) -> None:
    """Draw the two paths side by side, coloured by speed."""
    from lampyris.report.pictures.speed_paths import draw_speed_paths

    document = load_map(name)
    query = document.queries[0] if document.queries else document
    scene = lampyris.Scene(document.grid, query.start, query.goal, robot=ROBOT)
    short = driven(scene, "astar", law)
    fast = driven(scene, "fastest-time", law, **({"blind": True} if law == "blind" else {}))
    assert short[1] is not None and fast[1] is not None
    draw_speed_paths(
        scene.grid, [("shortest path", short[0].cells, short[1]), ("fastest path", fast[0].cells, fast[1])], out
    )


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--law", default="physical", choices=("physical", "blind"))
    parser.add_argument("--widest", type=int, default=1024, help="greatest side of a map, cells")
    parser.add_argument("--most", type=int, default=3, help="queries of a map")
    parser.add_argument("--picture", type=Path)
    parser.add_argument("--map", default="office-120")
    given = parser.parse_args()
    if given.picture is not None:
        picture(given.picture, given.map, given.law)
    else:
        table(given.law, given.widest, given.most)

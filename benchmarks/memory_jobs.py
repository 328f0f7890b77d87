"""Jobs whose memory is measured, each in a process of its own: ``python -m benchmarks.memory_jobs JOB SIZE``.

Linux tells a process what it holds in ``/proc``; nothing is measured elsewhere.

A job is two steps: what is there before it begins, and the job. What a small one leaves loaded (NumPy, numba,
machine code, a decoder) is there before as well; the map is made row by row, so that making it takes no more
than the map.
"""

from __future__ import annotations

import gc
import json
import resource
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

Job = Callable[[], Any]
SMALL = 96
"""Cells a side of the map that a job is done on beforehand."""
PLANNERS = (
    "ad-gso", "astar", "dijkstra", "jps", "fastest", "bidirectional-astar", "theta-star", "lpa-star",
    "dstar-lite", "dstar", "sipp", "space-time-astar", "pso", "gso", "mmas-dstar",
)  # fmt: skip
FILES = ("map", "npy", "png", "pgm", "csv", "text")


def blocked_map(size: int) -> np.ndarray:
    """A tenth of the cells blocked, the corners and the middle free."""
    rng = np.random.default_rng(size)
    blocked = np.empty((size, size), dtype=np.bool_)
    for row in blocked:
        row[:] = rng.random(size) < 0.1
    half = size // 2
    for at in (slice(0, 2), slice(half, half + 2), slice(size - 2, size)):
        blocked[at, at] = False
    return blocked


def _scene(size: int) -> Any:
    from lampyris.model.grid import Grid
    from lampyris.model.scene import Scene

    return Scene(Grid(blocked_map(size)), (0, 0), (size - 1, size - 1))


def _terrain(size: int) -> np.ndarray:
    values = np.empty((size, size), dtype=np.uint8)
    rng = np.random.default_rng(1)
    for row in values:
        row[:] = rng.integers(0, 200, size)
    values.setflags(write=False)
    return values


def field(size: int, kind: str, over: str = "") -> Job:
    """Free cells are there; a field is made of them."""
    from lampyris.model.moves import MOVES
    from lampyris.planning.field.solve import solve

    free = blocked_map(size)
    np.logical_not(free, out=free)
    free.setflags(write=False)
    terrain = _terrain(size) if over else None
    moves = MOVES[kind].weighed() if over else MOVES[kind]
    return lambda: solve(free, moves, (size // 2, size // 2), terrain=terrain)


def repairer(size: int, kind: str) -> Job:
    """A field that is kept, and repaired once."""
    from lampyris.model.moves import MOVES
    from lampyris.planning.field.repair import FieldRepairer

    free = blocked_map(size)
    np.logical_not(free, out=free)

    def run() -> Any:
        kept = FieldRepairer(free, MOVES[kind], (size // 2, size // 2))
        kept.repair(blocked=[(0, 0)])
        return kept

    return run


def layer(size: int, what: str) -> Job:
    """A map is there."""
    from lampyris.model.grid import Grid
    from lampyris.planning.field import gates, layers

    grid = Grid(blocked_map(size))
    calls = {
        "grid": lambda: Grid(grid.blocked),
        "inflate": lambda: layers.free_cells(grid, 1.2),
        "clearance": lambda: layers.clearance(grid),
        "gates": lambda: gates.find_gates(Grid(grid.blocked)),
    }
    return calls[what]


def plan(size: int, planner: str) -> Job:
    """A scene is there; a plan past the referee, with its gates and its optimum."""
    import lampyris

    scene = _scene(size)
    return lambda: lampyris.plan(scene, planner)


def simulation(size: int) -> Job:
    """A scene is there; forty ticks among a hundred walkers."""
    import lampyris
    from lampyris.model.traffic import RandomWalk

    scene = _scene(size)
    return lambda: lampyris.simulate(scene, "ad-gso", traffic=RandomWalk(min(100, size)), seed=1, ticks=40)


def drive(size: int) -> Job:
    """A scene is there; four seconds of continuous time among a hundred walkers."""
    import lampyris
    from lampyris.model.traffic import RandomWalk

    scene = _scene(size)
    return lambda: lampyris.drive(scene, "ad-gso", traffic=RandomWalk(min(100, size)), seed=1, time_limit=4.0)


def profile(size: int) -> Job:
    """A plan from corner to corner is there; its speeds."""
    import lampyris

    scene = _scene(size)
    found = lampyris.plan(scene, "jps")
    return lambda: lampyris.speed_profile(scene, found)


STUDY = """
version: 1
name: memory
preset: dissertation
maps:
  - {{file: m.npy, queries: [{{start: [0, 0], goal: [{last}, {last}]}}]}}
planners: [ad-gso]
traffic: [{{kind: random-walk, tracks: live, count: 20}}]
ticks: 40
seeds: 2
"""


def study(size: int) -> Job:
    """A study is there, its map read; two short runs of it, refereed and measured."""
    import lampyris

    folder = Path(tempfile.mkdtemp())
    np.save(folder / "m.npy", blocked_map(size))
    (folder / "study.yaml").write_text(STUDY.format(last=size - 1), encoding="utf-8")
    known = lampyris.load_study(folder / "study.yaml")
    return lambda: lampyris.run_study(known)


def picture(size: int) -> Job:
    """A plan and its field are there; the picture as PNG."""
    import lampyris
    from lampyris.planning.field.solve import solve_field
    from lampyris.report.pictures.plan_picture import draw_plan

    scene = _scene(size)
    found, landscape = lampyris.plan(scene, "jps"), solve_field(scene)
    into = Path(tempfile.mkdtemp()) / "plan.png"
    return lambda: draw_plan(scene.grid, found, field=landscape, out=into)


def loading(size: int, kind: str, folder: Path | None = None) -> Job:
    """A file is there; a map of it."""
    from lampyris.io.maps.load import load_map

    path = write_map(kind, size, Path(tempfile.mkdtemp()) if folder is None else folder)
    return lambda: load_map(path)


def write_map(kind: str, size: int, folder: Path) -> Path:
    """A map of the size as a file of the kind, written row by row."""
    path = folder / f"m{size}.{ {'text': 'txt'}.get(kind, kind) }"
    blocked = blocked_map(size)
    if kind == "npy":
        np.save(path, blocked)
    elif kind == "png":
        from PIL import Image

        Image.fromarray(np.where(blocked, np.uint8(0), np.uint8(255))).save(path)
    else:
        heads = {"map": b"type octile\nheight %d\nwidth %d\nmap\n", "pgm": b"P5 %d %d 255\n"}
        signs = {"map": b".@", "text": b".#", "csv": b"01", "pgm": b"\xff\0"}[kind]
        table = np.frombuffer(signs, dtype=np.uint8)
        with path.open("wb") as out:
            out.write(heads[kind] % (size, size) if kind in heads else b"")
            for row in blocked:
                told = table[row.view(np.uint8)].tobytes()
                out.write(b",".join(bytes((c,)) for c in told) if kind == "csv" else told)
                out.write(b"" if kind == "pgm" else b"\n")
    return path


def frames(size: int) -> Job:
    """A map of a value for every cell as the app's page takes it."""
    from lampyris.app.engine.frames import layer_frame
    from lampyris.planning.field.solve import solve_field

    values = solve_field(_scene(size)).luciferin
    return lambda: layer_frame("luciferin", values)


def rival(size: int, who: str) -> Job:
    """Free cells are there; costs, with all that must be made of the cells for it.

    scikit-image also keeps where each cell was reached from, whether one wants it or not.
    """
    from benchmarks import field_rivals

    from lampyris.model.moves import MOVES

    free = blocked_map(size)
    np.logical_not(free, out=free)
    goal = (size // 2, size // 2)

    def run() -> Any:
        if who == "scikit-image":
            from skimage.graph import MCP_Geometric

            prices = np.where(free, 1.0, -1.0)
            return MCP_Geometric(prices, fully_connected=True).find_costs([goal])
        if who == "tcod":
            import tcod.path

            out = np.full(free.shape, np.iinfo(np.int32).max, dtype=np.int32)
            out[goal[1], goal[0]] = 0
            return tcod.path.dijkstra2d(out.copy(), free.astype(np.int8), 10, 14, out=out)
        if who == "dijkstra3d":
            import dijkstra3d

            ground = np.asfortranarray(free[..., None])
            return dijkstra3d.euclidean_distance_field(ground, (goal[1], goal[0], 0))
        rows, cols, lengths, node = field_rivals.edges(free, MOVES["octile"])
        if who == "scipy":
            from scipy.sparse import csr_matrix
            from scipy.sparse.csgraph import dijkstra

            many = int(free.sum())
            matrix = csr_matrix((lengths, (rows, cols)), shape=(many, many))
            return dijkstra(matrix, directed=True, indices=int(node[goal[1], goal[0]]))
        import networkx as nx

        graph = nx.DiGraph()
        graph.add_weighted_edges_from(zip(rows.tolist(), cols.tolist(), lengths.tolist(), strict=True))
        return nx.single_source_dijkstra_path_length(graph, int(node[goal[1], goal[0]]))

    return run


MAKERS: dict[str, Callable[..., Job]] = {
    "field": field, "repairer": repairer, "layer": layer, "plan": plan, "simulation": simulation,
    "drive": drive, "profile": profile, "study": study, "picture": picture,
    "loading": loading, "frames": frames, "rival": rival,
}  # fmt: skip


def measure(job: str, size: int, *, fresh: bool = False) -> dict[str, int]:
    """Bytes in a process of its own: ``more``, what the job took at its highest beyond what was there before
    (a small one had been done, unless ``fresh``); ``whole``, the most the process ever held; ``own``, of
    that, without the files that it runs from, which the system shares and may drop; ``there``, what was held
    before.

    Raises
    ------
    CalledProcessError : the job failed.
    """
    command = [sys.executable, "-m", "benchmarks.memory_jobs", job, str(size), *(["fresh"] if fresh else [])]
    done = subprocess.run(command, check=True, stdout=subprocess.PIPE)
    told: dict[str, int] = json.loads(done.stdout)
    return told


def _now() -> dict[str, int]:
    with open("/proc/self/status", encoding="ascii") as status:
        rows = dict(line.split(":", 1) for line in status)
    return {name: int(rows[name].split()[0]) << 10 for name in ("VmRSS", "VmHWM", "RssFile")}


def main() -> int:
    """Do the job and print what it took; what lampyris refuses has its own exit code."""
    from lampyris.errors import LampyrisError

    try:
        return _do()
    except LampyrisError as fault:
        print(fault, file=sys.stderr)
        return fault.exit_code


def _do() -> int:
    from lampyris.kernels._jit import prefer_compiled

    (name, *words), size = sys.argv[1].split(":"), int(sys.argv[2])
    prefer_compiled()
    if "fresh" not in sys.argv[3:]:
        MAKERS[name](SMALL, *words)()
    job = MAKERS[name](size, *words)
    gc.collect()
    before = _now()
    result = job()
    after = _now()
    del result
    told = {
        "more": after["VmHWM"] - before["VmRSS"],
        "there": before["VmRSS"],
        "own": after["VmHWM"] - after["RssFile"],
        "whole": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss << 10,
    }
    print(json.dumps(told))
    return 0


if __name__ == "__main__":
    sys.exit(main())

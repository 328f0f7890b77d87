"""Random drives of fleets and random scenes of ORCA, each judged by the referee; prints what came of them.

    python tools/fleet_runs.py drives --count 1000      # plans driven with random delays, faults and obstacles
    python tools/fleet_runs.py orca --scenes 2000       # contacts are counted and told
    python tools/fleet_runs.py speed                    # CPU time of a step of ORCA

A drive is drawn from its number alone, so that one that fails can be repeated: --first N --count 1.
"""

from __future__ import annotations

import argparse
import time

import numpy as np

import lampyris
from lampyris.fleet_drives import simulate_fleet
from lampyris.kernels import _jit
from lampyris.model.settings.fleet_drive import FleetDriveSettings
from lampyris.planning.fleet.distance_tables import tables_of
from lampyris.sim.fleet.reactive import OrcaRun


def drawn_map(rng: np.random.Generator) -> lampyris.Grid:
    """A small map: open, with random walls, with shelves, or a bundled one."""
    kind = int(rng.integers(4))
    width, height = (int(side) for side in rng.integers(6, 25, 2))
    blocked = np.zeros((height, width), dtype=bool)
    if kind == 1:
        blocked = rng.random((height, width)) < 0.2
    elif kind == 2:
        blocked[2:-2:3, 2:-2] = True
        blocked[:, :: int(rng.integers(4, 8))] = False
    elif kind == 3:
        return lampyris.load_grid(str(rng.choice(["rooms-20", "guide"])))
    return lampyris.Grid(blocked, resolution=float(rng.choice([0.5, 1.0, 2.0])))


def drawn_fleet(rng: np.random.Generator, seed: int, most: float) -> lampyris.Fleet:
    """Random robots in the largest region of a map."""
    while True:
        grid = drawn_map(rng)
        share = float(rng.uniform(0.02, most))
        robots = max(2, min(60, int(share * np.count_nonzero(~grid.blocked))))
        try:
            return lampyris.random_fleet(grid, robots, seed=seed)
        except lampyris.SettingError:
            continue


def drive(number: int) -> tuple[lampyris.FleetTrace | None, bool]:
    """One random drive, and whether a robot failed in it; None: the fleet has no plan within the limit."""
    rng = np.random.default_rng(np.random.SeedSequence(0, spawn_key=(number,)))
    fleet = drawn_fleet(rng, number, 0.3)
    plan = lampyris.plan_fleet(fleet, seed=number, budget=lampyris.Budget(expansions=2000))
    if not plan:
        return None, False
    size = fleet.grid.resolution
    robot = lampyris.Robot(
        radius=float(rng.choice([0.1, 0.3, 0.35, 0.3535])) * size, v_max=float(rng.uniform(0.3, 3.0)),
        a_max=float(rng.uniform(0.2, 3.0)), d_max=float(rng.uniform(0.2, 3.0)),
        drive=str(rng.choice(["differential", "omnidirectional"])),
    )  # fmt: skip
    delays = lampyris.Delays(float(rng.choice([0.02, 0.1, 0.4])), float(rng.uniform(0.2, 8.0)))
    faulty = rng.random() < 0.15
    faults = [(int(rng.integers(len(fleet.robots))), float(rng.uniform(0.0, 30.0)))] if faulty else []
    obstacles = int(rng.integers(1, 5)) if rng.random() < 0.2 else 0
    info = str(rng.choice(["speed", "track"]))
    trace = simulate_fleet(
        fleet, plan, robot=robot, delays=delays, faults=faults, seed=number, obstacles=obstacles,
        obstacle_speed=float(rng.uniform(0.1, 1.0)), obstacle_info=info, drive_limit=3000.0,
    )  # fmt: skip
    return trace, faulty


def drives(first: int, count: int) -> int:
    """Drive many fleets; how many broke a promise."""
    began = time.process_time()
    totals = dict.fromkeys(
        ("driven", "no plan", "robots", "delayed", "rotations", "faults", "obstacle drives", "obstacle contacts",
         "moving contacts", "contacts", "late"), 0,
    )  # fmt: skip
    bad = []
    for number in range(first, first + count):
        try:
            trace, faulty = drive(number)
        except lampyris.LampyrisError as error:
            print(f"{number}: {error}")
            bad.append(number)
            continue
        if trace is None:
            totals["no plan"] += 1
            continue
        totals["driven"] += 1
        totals["robots"] += len(trace.robots)
        totals["delayed"] += trace.delayed
        totals["rotations"] += trace.rotations
        totals["faults"] += len(trace.faults)
        totals["obstacle drives"] += bool(trace.obstacles)
        totals["obstacle contacts"] += trace.obstacle_contacts
        totals["moving contacts"] += trace.moving_contacts
        totals["contacts"] += trace.contacts + trace.wall_contacts
        waiting = len(trace.robots) - trace.arrived - len(trace.faults)
        # Obstacles may stand where a robot has to go, robots that failed too.
        if trace.contacts or trace.moving_contacts or (waiting and not faulty and not trace.obstacles):
            bad.append(number)
        totals["late"] += bool(waiting)
    print(", ".join(f"{name} {value:,}" for name, value in totals.items()))
    print(f"promises broken: {len(bad)} {bad[:10]}; {time.process_time() - began:.1f} s of CPU")
    return len(bad)


def orca(first: int, scenes: int) -> int:
    """Drive many scenes by ORCA and print how often robots touch."""
    began = time.process_time()
    arrived = robots = contacts = walls = touched = whole = 0
    for number in range(first, first + scenes):
        rng = np.random.default_rng(np.random.SeedSequence(1, spawn_key=(number,)))
        fleet = drawn_fleet(rng, number, 0.15)
        radius = float(rng.choice([0.15, 0.25, 0.35])) * fleet.grid.resolution
        trace = simulate_fleet(
            fleet, robot=lampyris.Robot(radius=radius), policy="orca", seed=number,
            drive_limit=60.0 * max(1.0, fleet.grid.resolution),
        )  # fmt: skip
        robots += len(trace.robots)
        arrived += trace.arrived
        whole += bool(trace)
        contacts += trace.contacts
        walls += trace.wall_contacts
        touched += trace.contacts > 0
        if (number - first + 1) % 100 == 0:
            print(number - first + 1, arrived, robots, contacts, touched, walls, flush=True)
    print(
        f"{scenes:,} scenes, {robots:,} robots: {arrived:,} arrived, all of them in {whole:,} scenes; "
        f"{contacts:,} pairs touched, in {touched:,} scenes; {walls:,} robots touched walls; "
        f"{time.process_time() - began:.1f} s of CPU"
    )
    return 0


def speed() -> int:
    """CPU milliseconds of a step of 100 and of 1,000 discs, in the open and in a warehouse."""
    for name, robots in (("open", 100), ("open", 1000), ("warehouse-200", 1000)):
        grid = lampyris.Grid(np.zeros((100, 100), dtype=bool)) if name == "open" else lampyris.load_grid(name)
        fleet = lampyris.random_fleet(grid, robots, seed=1)
        tables = tables_of(fleet)
        settings = FleetDriveSettings(policy="orca")
        own = [lampyris.Robot(radius=0.3 * grid.resolution)] * robots
        best = np.inf
        with _jit.compiled_only():
            for _ in range(3):
                run = OrcaRun(fleet, own, settings, tables, 200)
                began = time.process_time()
                run.go_on(200)
                best = min(best, (time.process_time() - began) / run.done)
        print(f"{name}, {robots:,} discs: {1000 * best:.3f} ms a step")
    return 0


def main() -> int:
    """Command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("what", choices=("drives", "orca", "speed"))
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--scenes", type=int, default=100)
    parser.add_argument("--first", type=int, default=0)
    given = parser.parse_args()
    if given.what == "speed":
        return speed()
    return drives(given.first, given.count) if given.what == "drives" else orca(given.first, given.scenes)


if __name__ == "__main__":
    raise SystemExit(1 if main() else 0)

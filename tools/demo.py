"""The main job on bundled maps: plan, time, simulate, draw. Leaves pictures and a film in a folder.

Run by ``make demo``; ``python tools/demo.py FOLDER`` does the same.
"""

from __future__ import annotations

import json
import subprocess
import sys
import time
from pathlib import Path

RUNS: tuple[tuple[str, tuple[str, ...], str], ...] = (
    (
        "guide.png",
        ("plan", "guide", "--preset", "dissertation", "--picture", "guide.png", "--json"),
        "the dissertation's 10 x 10 example: 4 jumps (rings), cost 12.4, over its luciferin",
    ),
    (
        "env-1.png",
        ("plan", "env-1", "--picture", "env-1.png", "--csv", "env-1.csv", "--json"),
        "a dense 50 x 50 map: the path coloured by speed, the gates it passes, its optimality gap",
    ),
    (
        "env-1.csv",
        (),
        "the same plan for a robot: x, y, yaw, speed and time at every node, and why each speed",
    ),
    (
        "env-3.webp",
        (
            "simulate",
            "env-3",
            "--obstacles",
            "24",
            "--mobility",
            "mixed",
            "--seed",
            "2",
            "--film",
            "env-3.webp",
            "--json",
        ),
        "a film: the robot replans among 24 moving obstacles of three kinds",
    ),
    (
        "speed.png",
        (
            "speed",
            "env-3",
            "--resolution",
            "0.25",
            "--radius",
            "0.15",
            "--smooth",
            "straight",
            "--chart",
            "speed.png",
            "--json",
        ),
        "five speed laws on one path, the caps of our law as faint lines, and what limits it",
    ),
    (
        "drive.webp",
        (
            "drive",
            "env-3",
            "--resolution",
            "0.25",
            "--radius",
            "0.1",
            "--seed",
            "2",
            "--film",
            "drive.webp",
            "--json",
        ),
        "the same in continuous time: real accelerations, obstacles as discs",
    ),
)


def main(folder: Path) -> int:
    folder.mkdir(parents=True, exist_ok=True)
    lampyris = Path(sys.executable).with_name("lampyris")
    began = time.perf_counter()
    for name, words, look in RUNS:
        if words:
            done = subprocess.run(
                [str(lampyris), *words, "--force"], cwd=folder, capture_output=True, text=True, check=False
            )
            if done.returncode != 0:
                print(
                    f"lampyris {' '.join(words)} failed ({done.returncode}):\n{done.stderr}", file=sys.stderr
                )
                return 1
            (folder / f"{Path(name).stem}.json").write_text(done.stdout, encoding="utf-8")
            print(f"{folder / name}: {look}\n    {told(json.loads(done.stdout))}")
        else:
            print(f"{folder / name}: {look}")
    print(f"done in {time.perf_counter() - began:.0f} s; the .json files next to them contain all numbers")
    return 0


def told(record: dict) -> str:  # type: ignore[type-arg]
    """The result in a few words."""
    if "laws" in record:
        times = ", ".join(f"{law['law']} {law['duration_s']:.4g} s" for law in record["laws"])
        return f"{record['path']['length_m']:.4g} m: {times}"
    if "curves" in record:
        held = ", ".join(f"{h['cause']} {h['time']:.0%}" for h in record["limited_by"][:3])
        return f"{record['outcome']} after {record['duration']:.4g} s; limited by {held}"
    if "outcome" in record:
        return (
            f"{record['outcome']} after {record['ticks']} ticks, cost {record['cost']:.6g}, "
            f"{record['replans']} replans, {record['collisions']} collisions"
        )
    return (
        f"{record['status']}, cost {record['cost']:.6g} (best {record['optimal_cost']:.6g}, gap "
        f"{record['gap']:.2%}), {record['iterations']} iterations, mean speed "
        f"{record['speed']['mean']:.3g} {record['speed']['units']}"
    )


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1] if len(sys.argv) > 1 else "demo")))

"""Scenes whose walls come and go, and who judges what became of them."""

from __future__ import annotations

import math
from dataclasses import replace

from sim_planners import grid_of

from lampyris import referee
from lampyris.model.edit import Edit
from lampyris.model.traffic import Recorded
from lampyris.report.plain import trace_record
from lampyris.selfcheck.twins.edit_twin import EditMonitor

LANE = grid_of("......", "......", "......")


def story(trace):
    return [(e.tick, e.word, e.cell) for e in trace.events]


def judged(trace):
    assert referee.check_trace(trace) is None, referee.check_trace(trace)
    assert EditMonitor(trace).faults() == []
    return trace


def record(trace):
    return trace_record(trace) | {"timing": {}}


def with_edits(scene, rng, many=3):
    """The same with random edits that leave recorded lanes alone."""
    grid, height, width = scene.grid, scene.grid.height, scene.grid.width
    lanes = set()
    for one in scene.traffic:
        if isinstance(one, Recorded):
            r = math.ceil(one.radius) + 1
            lanes |= {
                (x + dx, y + dy) for x, y in one.track for dx in range(-r, r + 1) for dy in range(-r, r + 1)
            }
    edits, tick = [], 0
    for _ in range(int(rng.integers(1, many + 1))):
        tick += int(rng.integers(1, 8))
        if rng.random() < 0.5:
            # A wall across, with a gap or without.
            x, gap = int(rng.integers(1, width - 1)), int(rng.integers(-4, height))
            line = [(x, y) for y in range(height) if y != gap]
        else:
            line = [(int(rng.integers(width)), int(rng.integers(height))) for _ in range(12)]
        line = [c for c in dict.fromkeys(line) if c not in lanes]
        freed = [(x, y) for y in range(height) for x in range(width) if grid.blocked[y, x]]
        freed = [c for c in freed if rng.random() < 0.2 and c not in line]
        edits.append(Edit(tick, tuple(line), tuple(freed)))
    again = Edit(tick + 3, (), tuple(dict.fromkeys(c for e in edits for c in e.blocked)))
    return replace(scene, edits=(*edits, again))

"""Scenes whose walls come and go, and who judges what became of them."""

from __future__ import annotations

import numpy as np
from sim_planners import grid_of

from lampyris import referee
from lampyris.report.data.serialize import trace_record
from lampyris_selfcheck.checks.traffic.sim_scenes import KINDS, drawn_scene
from lampyris_selfcheck.reference.motion.sim_monitor import Monitor

LANE = grid_of("......", "......", "......")


def story(trace):
    return [(e.tick, e.word, e.cell) for e in trace.events]


def judged(trace):
    assert referee.check_trace(trace) is None, referee.check_trace(trace)
    assert Monitor(trace).faults() == []
    return trace


def record(trace):
    return trace_record(trace) | {"timing": {}}


def seeded_scene(seed, kind, robot_radius=0.0, body_radius=0.0, moves="octile"):
    """A random map with its ends free, and traffic of one kind."""
    rng = np.random.default_rng((seed, KINDS.index(kind)))
    return drawn_scene(rng, kind, robot_radius, body_radius, moves)

"""Every fault that is put into a trace, with the rule it breaks in each judge's words."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType
from typing import NamedTuple, TypeAlias

import numpy as np

from lampyris.model.trace import Trace
from lampyris_selfcheck.checks.traffic import monitor_reports as told
from lampyris_selfcheck.checks.traffic import monitor_traces as moves
from lampyris_selfcheck.checks.traffic.monitor_places import is_small

Put: TypeAlias = Callable[[Trace, np.random.Generator], Trace | None]


class Fault(NamedTuple):
    """A fault and who must see it, in which words; empty: the judge has no such rule.

    Parameters
    ----------
    put : puts it into a sound trace; None where the trace gives no occasion.
    quick, slow : what a sentence of the monitor must hold, a regular expression.
    referee : the rule, by the word of its violation.
    """

    put: Put
    quick: str
    slow: str
    referee: str


_MEETING = ("together", "swap", "cross", "through")


def said(pattern: str, sentences: Iterable[str]) -> bool:
    """Whether one of the sentences is of the rule, or there is none to be said."""
    return not pattern or any(re.search(pattern, one) for one in sentences)


def ruled(fault: Fault, trace: Trace, rule: str | None) -> bool:
    """Whether the referee's first rule is the one that was broken.

    Who is larger than a cell covers another's before it can swap or cross, or be driven over by a long step:
    any of the four comes first. Its corners are judged by what the disc really sweeps, which a wall beside
    the diagonal may be clear of; and it sweeps a wall ahead before it stands there.
    """
    if fault.referee == "corner" and not is_small(trace):
        return rule in (None, "corner", "sweep")
    if fault.referee == "wall" and not is_small(trace):
        return rule in ("wall", "sweep")
    if fault.referee in _MEETING and not is_small(trace):
        return rule in _MEETING
    return not fault.referee or rule == fault.referee


def _table(*faults: Fault) -> Mapping[str, Fault]:
    return MappingProxyType({one.put.__name__.replace("_", " "): one for one in faults})


_STEP = "the robot makes a step it does not have"
_WAY = "the path is not what was driven"
_ARRIVED = "arrived and standing on the goal are not the same"
_WAITING = "waiting and not moving are not the same"
_LARGER = " are in one cell"

FAULTS = _table(
    Fault(moves.teleport, _STEP, _STEP, "step"),
    Fault(moves.off_by_one, _WAY, _WAY, "path"),
    Fault(moves.begins_elsewhere, "begin at the start", "begin at the start", "start"),
    Fault(moves.into_a_body, r"robot and body \d+ are in one cell", r": -1 and \d+ are in one", "together"),
    Fault(
        moves.two_in_one_cell, r"body \d+ and body \d+ are in one", r": \d+ and \d+ are in one", "together"
    ),
    Fault(moves.swap, "swap", r": -1 and \d+ swap", "swap"),
    Fault(moves.two_swap, "swap", r": \d+ and \d+ swap", "swap"),
    Fault(moves.cross, "cross", r": -1 and \d+ cross", "cross"),
    Fault(moves.two_cross, "cross", r": \d+ and \d+ cross", "cross"),
    Fault(moves.robot_in_a_wall, "the robot is in a wall", "-1 is in a wall", "wall"),
    Fault(moves.body_in_a_wall, r"body \d+ is in a wall", r": \d+ is in a wall", "body wall"),
    Fault(moves.corner_cut, "the robot cuts a corner", "-1 cuts a corner", "corner"),
    Fault(moves.body_corner_cut, r"body \d+ cuts a corner", r": \d+ cuts a corner", ""),
    Fault(moves.body_jumps, r"body \d+ jumps", r": \d+ jumps", "body step"),
    Fault(moves.off_the_map, r"body \d+ is off the map", r": \d+ is off the map", "body outside"),
    Fault(moves.robot_radius_forgotten, _LARGER, _LARGER, "together"),
    Fault(moves.body_radius_forgotten, _LARGER, _LARGER, "together"),
    Fault(moves.track_left, "leaves its track", "leaves its track", ""),
    Fault(moves.onto_the_robot, "comes onto the robot", "moves onto the robot", ""),
    Fault(moves.on_the_goal, "on the start or the goal", "stands on start or goal", ""),
    Fault(moves.in_a_lane, "", "stands in a recorded lane", ""),
    Fault(told.wrong_arrival, _ARRIVED, _ARRIVED, "outcome"),
    Fault(told.untold_arrival, _ARRIVED, _ARRIVED, "outcome"),
    Fault(told.waits_miscounted, _WAITING, "waits told", "waits"),
    Fault(told.waiting_mistold, _WAITING, _WAITING, ""),
    Fault(told.impossible_speed, "a speed that cannot be", "a speed that cannot be", "speed"),
    Fault(told.drives_on_at_the_goal, "arrives and does not stand", "not at rest at start and goal", ""),
    Fault(told.another_way_told, _WAY, _WAY, "path"),
    Fault(told.body_forgotten, "does not last until the end", r"track \d+ has \d+ cells", "lengths"),
    Fault(told.a_cause_too_many, "are not one a tick", "are not one a tick", "lengths"),
    Fault(told.own_collision, "", "a collision of the robot's own making", "outcome"),
    Fault(told.out_of_order, "", "not in order of appearance", "appear"),
    Fault(told.not_asked_for, "", "at most 0 were asked for", ""),
    Fault(told.edit_untold, "", "turned .* told", "edits"),
)
"""Every fault by name."""

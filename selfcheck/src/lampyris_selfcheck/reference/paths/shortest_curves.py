"""Shortest curves of bounded curvature by brute force: the equations of every word's end, solved numerically.

No formula of a word is used. For every pattern of left arcs, right arcs and straight lines the position and the
yaw at the end are functions of three unknown lengths; Newton's method looks for lengths that reach the goal, from many
guesses. The least length found over all patterns is the answer.
"""

from __future__ import annotations

import itertools
import math

import numpy as np

DUBINS = ("LSL", "LSR", "RSL", "RSR", "LRL", "RLR")
QUARTER = math.pi / 2


def _reeds_shepp_patterns():
    """Each pattern: kinds of the segments, and for each segment (which unknown, factor, constant)."""
    free = [(0, 1.0, 0.0), (1, 1.0, 0.0), (2, 1.0, 0.0)]
    for a, b in (("L", "R"), ("R", "L")):
        yield a + b + a, free
        yield a + "S" + a, free
        yield a + "S" + b, free
        for factor in (1.0, -1.0):
            yield a + b + a + b, [(0, 1.0, 0.0), (1, 1.0, 0.0), (1, factor, 0.0), (2, 1.0, 0.0)]
        for sign in (QUARTER, -QUARTER):
            fixed = (0, 0.0, sign)
            for last in (a, b):
                yield a + b + "S" + last, [free[0], fixed, free[1], free[2]]
                yield last + "S" + b + a, [free[0], free[1], fixed, free[2]]
            yield a + b + "S" + a + b, [free[0], fixed, free[1], fixed, free[2]]


def _ends(kinds, rules, unknown):
    """Position (complex) and yaw at the end, and their derivatives, for guesses (n, 3)."""
    place = np.zeros(len(unknown), dtype=complex)
    yaw = np.zeros(len(unknown))
    d_place = np.zeros((len(unknown), 3), dtype=complex)
    d_yaw = np.zeros((len(unknown), 3))
    for kind, (k, factor, constant) in zip(kinds, rules, strict=True):
        length = unknown[:, k] * factor + constant
        bend = {"L": 1.0, "S": 0.0, "R": -1.0}[kind]
        before = np.exp(1j * yaw)
        after = np.exp(1j * (yaw + bend * length))
        step = length * before if bend == 0 else (after - before) / (1j * bend)
        place = place + step
        d_place = d_place + (1j * step)[:, None] * d_yaw
        d_place[:, k] += factor * after
        d_yaw[:, k] += factor * bend
        yaw = yaw + bend * length
    return place, yaw, d_place, d_yaw


def _solutions(kinds, rules, goal, guesses):
    """Unknowns (n, 3) whose curves end at the goal."""
    x, y, turn = goal
    unknown = guesses.copy()
    for _ in range(18):
        place, yaw, d_place, d_yaw = _ends(kinds, rules, unknown)
        off = place - complex(x, y)
        swing = np.remainder(yaw - turn + math.pi, 2 * math.pi) - math.pi
        residual = np.stack((off.real, off.imag, swing), axis=1)
        jacobian = np.stack((d_place.real, d_place.imag, d_yaw), axis=1)
        damped = np.einsum("nij,nik->njk", jacobian, jacobian) + 1e-13 * np.eye(3)
        step = np.linalg.solve(damped, np.einsum("nij,ni->nj", jacobian, residual)[:, :, None])[:, :, 0]
        unknown = unknown - np.clip(step, -2.0, 2.0)
    place, yaw, _, _ = _ends(kinds, rules, unknown)
    error = abs(place - complex(x, y)) + abs(np.remainder(yaw - turn + math.pi, 2 * math.pi) - math.pi)
    return unknown[error < 1e-10]


def _wrapped(kinds, rules, unknown):
    """The same curves with every arc in [-pi, pi] whose unknown no other segment shares."""
    shared = [k for k, _, _ in rules]
    for kind, (k, factor, _) in zip(kinds, rules, strict=True):
        if kind != "S" and factor != 0.0 and shared.count(k) == 1:
            unknown[:, k] = np.remainder(unknown[:, k] + math.pi, 2 * math.pi) - math.pi
    return unknown


def _guesses(arcs, straights):
    return np.array(list(itertools.product(arcs, (*arcs, *straights), arcs)))


def reeds_shepp_length(goal):
    """Length of the shortest curve from (0, 0, 0) to a goal (x, y, yaw) in turning radii, ahead and in reverse."""
    best = math.inf
    distance = math.hypot(goal[0], goal[1])
    guesses = _guesses((-1.6, 0.3, 1.6), (distance, -distance))
    for kinds, rules in _reeds_shepp_patterns():
        found = _wrapped(kinds, rules, _solutions(kinds, rules, goal, guesses))
        if len(found):
            # Any segment with a constant length that shares unknown 0 has factor 0.
            lengths = sum(abs(found[:, k] * factor + constant) for k, factor, constant in rules)
            best = min(best, float(lengths.min()))
    return best


def dubins_length(goal):
    """Length of the shortest curve from (0, 0, 0) to a goal (x, y, yaw) in turning radii, ahead alone."""
    best = math.inf
    rules = [(0, 1.0, 0.0), (1, 1.0, 0.0), (2, 1.0, 0.0)]
    guesses = _guesses((0.5, 2.1, 3.7, 5.3), (math.hypot(goal[0], goal[1]),))
    for kinds in DUBINS:
        found = _solutions(kinds, rules, goal, guesses)
        for k, kind in enumerate(kinds):
            if kind != "S":
                arcs = np.remainder(found[:, k], 2 * math.pi)
                found[:, k] = np.where(arcs > 2 * math.pi - 1e-9, 0.0, arcs)
        found = found[(found >= -1e-9).all(axis=1)]
        if len(found):
            best = min(best, float(found.sum(axis=1).min()))
    return best

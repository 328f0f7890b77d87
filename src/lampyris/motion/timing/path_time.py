"""The fastest path through moving obstacles whose tracks are known: slow down, wait, or pass first.

Method, proofs and measurements: docs/speed/moving_obstacles.md.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lampyris._core import elementary
from lampyris._core.scalars import in_range
from lampyris.errors import SettingError, shown
from lampyris.model.obstacles import Track
from lampyris.model.profile import Profile
from lampyris.model.robot import Robot
from lampyris.motion.geometry.sampled_path import SampledPath
from lampyris.motion.profile import Feasible, feasible_profile, start_speed
from lampyris.motion.timing.obstacle_tracks import CappedPath, Discs, TimedNodes, discs_of, first_contact
from lampyris.motion.timing.reachability import Blocked, Walk, walk
from lampyris.motion.timing.spacetime_lattice import Lattice, best_lattice
from lampyris.typing import Floats, Points

_CLOSE = 1e-9
"""Metres: a node this near is the same place."""


def through_tracks(
    samples: SampledPath,
    v_cap: Floats,
    robot: Robot,
    tracks: Sequence[Track],
    *,
    radius: float | None = None,
    margin: float = 0.0,
    t0: float = 0.0,
    v0: float = 0.0,
    step: float | None = None,
    horizon: float | None = None,
    law: str = "physical",
) -> Profile:
    """The fastest profile along a sampled path on which the robot meets nobody until it is at the goal.

    Parameters
    ----------
    samples : the path, n nodes.
    v_cap : float64 (n,), m/s: what the map and the robot allow; 0 at the ends only.
    robot : its limits.
    tracks : where the obstacles are over time; each is not there before its first time, and stays at its last
        place.
    radius : the robot's, metres; None: as the robot says.
    margin : metres to be left between the robot and any obstacle.
    t0 : the tracks' time at which the robot is at the first node.
    v0 : its speed there, m/s.
    step : seconds of a step of the lattice; None: chosen from the robot and the path.
    horizon : seconds after which the robot must have arrived; None: as long as the tracks last, and twice the
        fastest time after that.

    Returns
    -------
    A profile whose t begins at 0. If the fastest profile without obstacles meets nobody, that, node by node.
    Otherwise nodes where the acceleration changes, and after the last obstacle those of the sampled path. Causes:
    ``wait`` (two nodes at one place) and ``moving obstacle`` with the number of the track that the robot
    would meet if it drove on as fast as it can; ``limit``, ``acceleration``, ``braking``, ``turn`` as always.

    Raises
    ------
    SettingError : ``PROFILE_BLOCKED``: no path through before the horizon, and which track is in the way;
        ``PROFILE_INFEASIBLE``, ``START_SPEED``, ``STEP``, ``HORIZON``, ``TRACK``.
    LimitError : ``PATH_TIME``: the lattice would be larger than 256 MB, or cannot drive the path.
    """
    v0 = start_speed(v0)
    _check_numbers(margin=margin, t0=t0, horizon=1.0 if horizon is None else horizon)
    plain = _feasible(samples.s, v_cap, robot, v0, samples.stop)
    fastest = Profile(
        law, samples.s, plain.v, plain.a, plain.t, plain.cause, "m/s", plain.cause_index,
        (("limit", np.asarray(v_cap, dtype=np.float64)),), samples.xy,
    )  # fmt: skip
    if len(samples) < 2:
        return fastest
    size = robot.radius if radius is None else float(radius)
    discs = discs_of(tracks, size + margin + _slack(samples), t0, samples.resolution)
    search = _Search(samples, np.asarray(v_cap, dtype=np.float64), robot, discs, v0)
    _, who = first_contact(search.path, search.fastest, discs)
    if who < 0:
        return fastest
    try:
        found = search.run(step, horizon)
    except Blocked as blocked:
        raise _blocked(blocked, who) from None
    return search.profile(found, law)


def _check_numbers(**given: float) -> None:
    for where, value in given.items():
        least = -math.inf if where == "t0" else 0.0
        if not in_range(value, least, math.inf):
            allowed = "a finite number of metres or seconds" + ("" if where == "t0" else ", >= 0")
            raise SettingError("TRACK", shown(value), where=where, allowed=allowed)


def _blocked(blocked: Blocked, fastest_meets: int) -> SettingError:
    who = fastest_meets if blocked.who < 0 else blocked.who
    return SettingError(
        "PROFILE_BLOCKED",
        f"no path past obstacle {who}: the robot gets no farther than {blocked.s:.6g} m in {blocked.t:.6g} s",
        where=f"tracks[{who}]",
        allowed="tracks that leave the path free for long enough, somewhere to wait, a start without contact",
        todo="plan another path, start at another time, or look farther ahead (horizon)",
    )


def _feasible(s: Floats, cap: Floats, robot: Robot, v0: float, stop: NDArray[np.bool_]) -> Feasible:
    return feasible_profile(s, [("limit", cap)], a_max=robot.a_max, d_max=robot.d_max, v0=v0, stop=stop)


def _slack(samples: SampledPath) -> float:
    """Metres by which the path leaves the straight lines between its nodes at most."""
    ds = samples.s[1:] - samples.s[:-1]
    return 0.125 * float((np.minimum(samples.curvature[1:], samples.curvature[:-1]) * ds * ds).max())


def capped_path(samples: SampledPath, v_cap: Floats, v0: float, robot: Robot) -> CappedPath:
    """The sampled path in metres. An edge from rest to rest gets a node where the robot is fastest on it."""
    stop = samples.stop.copy()
    stop[[0, -1]] = False
    still = samples.stop.copy()
    still[0], still[-1] = v0 == 0.0, True
    both = np.flatnonzero(still[:-1] & still[1:])
    points = samples.xy * samples.resolution
    s, x, y, cap = samples.s, points[:, 0], points[:, 1], v_cap
    if len(both):
        share = robot.d_max / (robot.a_max + robot.d_max)
        low, high = np.minimum(cap[both], cap[both + 1]), np.maximum(cap[both], cap[both + 1])
        mid = [a[both] + share * (a[both + 1] - a[both]) for a in (s, x, y)]
        s, x, y = (np.insert(a, both + 1, m) for a, m in zip((s, x, y), mid, strict=True))
        cap = np.insert(cap, both + 1, np.where(low > 0.0, low, high))
        stop = np.insert(stop, both + 1, False)
    return CappedPath(s.copy(), x.copy(), y.copy(), cap, stop)


@dataclass
class _Part:
    """Nodes of a motion with their causes; ``cause_index`` numbers nodes of this part for ``braking``."""

    t: Floats
    s: Floats
    v: Floats
    a: Floats
    cause: list[str]
    cause_index: list[int]


class _Search:
    """One question to :func:`through_tracks`."""

    def __init__(self, samples: SampledPath, v_cap: Floats, robot: Robot, discs: Discs, v0: float) -> None:
        self.samples, self.robot, self.discs, self.v0 = samples, robot, discs, v0
        self.path = capped_path(samples, v_cap, v0, robot)
        self.still = _feasible(self.path.s, self.path.cap, robot, v0, self.path.stop)
        self.fastest = TimedNodes(self.still.t, self.path.s, self.still.v, self.still.a)
        self.x = self.still.v * self.still.v

    def run(self, step: float | None, horizon: float | None) -> TimedNodes:
        """The motion, as nodes: a first part, the walk on the lattice, without what comes after it."""
        path, begin, v, t = self.path, 0.0, self.v0, 0.0
        head: list[tuple[float, float, float, float]] = []
        stops = np.append(path.s[path.stop], path.s[-1])
        while True:
            fastest = float(self.still.t[-1]) - t
            ahead = stops[stops > begin]
            if len(ahead) == 0:
                raise Blocked(-1, begin, t)
            made = best_lattice(path.s, self.x, ahead, self.robot, v, fastest, step, begin)
            if made is not None:
                break
            # The robot cannot but brake to the first stop: as fast as may be.
            k = int(np.searchsorted(path.s, ahead[0]))
            rows = np.stack(self.fastest)[:, int(np.searchsorted(path.s, begin)) : k]
            head += [(a, b, c, d) for a, b, c, d in rows.T.tolist()]
            begin, v, t = float(ahead[0]), 0.0, float(self.still.t[k])
        lattice, start = made
        if start.t > 0.0:
            head.append((t, begin, v, -self.robot.d_max))
        t += start.t
        if head:
            last = (t, float(lattice.legs[0]), lattice.speed * float(lattice.unit[0]), 0.0)
            first = TimedNodes(*np.array([*head, last]).T.copy())
            at, who = first_contact(path, first, self.discs)
            if who >= 0:
                raise Blocked(who, float(lattice.legs[0]), at)
        done = walk(path, lattice, self.discs, t, horizon)
        return _joined(head, lattice, done, t)

    def tail(self, t: float, s: float, v: float) -> tuple[_Part, bool] | None:
        """The rest of the path as fast as may be, from a state, and whether it meets nobody; None: no path."""
        path = self.path
        later = np.flatnonzero(path.s > s + _CLOSE)
        if len(later) == 0:
            return None
        at, cap, stop = path.s[later], path.cap[later], path.stop[later]
        if v == 0.0 and (stop[0] or len(later) == 1):
            share = self.robot.d_max / (self.robot.a_max + self.robot.d_max)
            here, there = cap[0], float(path.cap[max(int(later[0]) - 1, 0)])
            low = min(here, there) if min(here, there) > 0.0 else max(here, there)
            at, cap, stop = (
                np.insert(at, 0, s + share * (at[0] - s)),
                np.insert(cap, 0, low),
                np.insert(stop, 0, False),
            )
        nodes = np.insert(at, 0, s)
        try:
            made = _feasible(nodes, np.insert(cap, 0, np.inf), self.robot, v, np.insert(stop, 0, False))
        except SettingError:
            return None
        part = _Part(made.t + t, nodes, made.v, made.a, list(made.cause), made.cause_index.tolist())
        return part, first_contact(path, TimedNodes(part.t, part.s, part.v, part.a), self.discs)[1] < 0

    def blame(self, t: float, s: float, v: float) -> int:
        """Whom the robot would meet if it drove on from a state as fast as it can; -1: nobody."""
        found = self.tail(t, s, v)
        if found is None:
            return -1
        part = found[0]
        return first_contact(self.path, TimedNodes(part.t, part.s, part.v, part.a), self.discs)[1]

    def profile(self, found: TimedNodes, law: str) -> Profile:
        """The motion with the fastest end that is free, its causes, and where it is."""
        count = len(found.t)
        low, high, end = -1, count - 1, None
        while high - low > 1:
            k = (low + high) // 2
            rest = self.tail(float(found.t[k]), float(found.s[k]), float(found.v[k]))
            if rest is not None and rest[1]:
                high, end = k, rest[0]
            else:
                low = k
        kept = _merged(TimedNodes(*(a[: high + 1] for a in found)))
        # The last state from which driving on as fast as can be would have met an obstacle: which.
        before = max(high - 1, 0)
        culprit = self.blame(float(found.t[before]), float(found.s[before]), float(found.v[before]))
        cause, cause_index = self._causes(kept, culprit)
        t, s, v, a = kept
        if end is not None:
            n = len(t) - 1
            t, s, v, a = (
                np.concatenate((x[:n], y)) for x, y in zip(kept, (end.t, end.s, end.v, end.a), strict=True)
            )
            cause += end.cause[1:]
            cause_index += [
                k + n if w == "braking" and k >= 0 else k
                for w, k in zip(end.cause[1:], end.cause_index[1:], strict=True)
            ]
        _name_braking(cause, cause_index)
        ceiling = np.sqrt(elementary.interp(s, self.path.s, self.x))
        return Profile(
            law, s, v, a, t, tuple(cause), "m/s", np.array(cause_index), (("limit", ceiling),), self._xy(s)
        )

    def _causes(self, kept: TimedNodes, culprit: int) -> tuple[list[str], list[int]]:
        """What binds each node of the walk; braking is named later. ``culprit`` binds the last one."""
        t, s, v, a = kept
        top = np.sqrt(elementary.interp(s, self.path.s, self.x))
        cause, cause_index = ["start"], [-1]
        tight = 1e-6 * self.robot.v_max
        for k in range(1, len(t)):
            word, who = "limit", -1
            last = k == len(t) - 1
            if last and s[k] >= self.path.s[-1]:
                word = "goal"
            elif v[k] == 0.0 and top[k] == 0.0 and not (s[k] == s[k - 1] or (not last and s[k + 1] == s[k])):
                word = "turn"
            elif v[k] == 0.0:
                word, who = "wait", culprit if last else self.blame(float(t[k]), float(s[k]), 0.0)
                if who < 0 and cause[-1] == "wait":
                    who = cause_index[-1]
            elif not last and a[k] < 0.0:
                word = "braking"
            elif v[k] >= top[k] - tight:
                node = min(int(np.searchsorted(self.path.s, s[k])), len(self.path.s) - 1)
                word = "acceleration" if self.still.cause[node] == "acceleration" else "limit"
            else:
                who = culprit if last else self.blame(float(t[k]), float(s[k]), float(v[k]))
                word = "moving obstacle" if who >= 0 else "acceleration" if a[k - 1] > 0.0 else "limit"
            cause.append(word)
            cause_index.append(who)
        return cause, cause_index

    def _xy(self, s: Floats) -> Points:
        if self.samples.curve is not None:
            return self.samples.curve.at(s)[0]
        return np.stack(
            [elementary.interp(s, self.samples.s, self.samples.xy[:, k]) for k in (0, 1)], axis=-1
        )


def _joined(
    head: list[tuple[float, float, float, float]], lattice: Lattice, done: Walk, t: float
) -> TimedNodes:
    """The first part and the walk as nodes in metres and seconds."""
    place, speed = done
    steps = len(place) - 1
    unit = lattice.unit[lattice.leg_of(place)]
    # A step's units are those of the leg that it is on; it arrives at a border with speed 0.
    gain = np.append(np.diff(speed), 0) * unit / lattice.dt
    walked = TimedNodes(
        t + np.arange(steps + 1, dtype=np.float64) * lattice.dt, lattice.s_of(place), speed * unit, gain
    )
    if not head:
        return walked
    first = np.array(head).T
    return TimedNodes(*(np.concatenate((a, b)) for a, b in zip(first, walked, strict=True)))


def _merged(found: TimedNodes) -> TimedNodes:
    """Neighbouring stretches of one acceleration as one."""
    t, s, v, a = found
    keep = np.ones(len(t), dtype=np.bool_)
    keep[1:-1] = a[1:-1] != a[:-2]
    return TimedNodes(*(np.ascontiguousarray(x[keep]) for x in (t, s, v, np.append(a[:-1], 0.0))))


def _name_braking(cause: list[str], cause_index: list[int]) -> None:
    """Each braking node of the walk is braking for the next node that is not."""
    ahead = -1
    for k in range(len(cause) - 1, -1, -1):
        if cause[k] != "braking":
            ahead = k
        elif cause_index[k] < 0:
            cause_index[k] = ahead

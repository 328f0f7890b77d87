"""An independent monitor of simulations in ticks: every rule at every tick, by sets of cells.

It shares nothing with the simulator or the referee but the trace it reads: footprints come from exact fractions,
and the map of each tick is worked out from the edits that the scene asks for.
"""

from __future__ import annotations

from fractions import Fraction
from functools import cache

from lampyris.model.trace import Outcome, Trace
from lampyris.model.traffic import Crossing, Patrol, RandomWalk, Recorded

ROBOT = -1
"""Number of the robot among the obstacles."""


@cache
def disc(radius, resolution):
    """Offsets of the cells whose square comes strictly nearer than radius to the centre of cell (0, 0)."""
    r = Fraction(str(radius)) / Fraction(str(resolution))
    far = int(r) + 2
    out = {(0, 0)}
    for dx in range(-far, far + 1):
        for dy in range(-far, far + 1):
            gx = max(abs(dx) - Fraction(1, 2), Fraction(0))
            gy = max(abs(dy) - Fraction(1, 2), Fraction(0))
            if gx * gx + gy * gy < r * r:
                out.add((dx, dy))
    return frozenset(out)


class Monitor:
    """All that a trace must obey. :meth:`faults` lists every breach, in words."""

    def __init__(self, trace: Trace) -> None:
        self.trace, scene = trace, trace.scene
        self.height, self.width = scene.grid.blocked.shape
        self.cutting = scene.moves.corner_cutting
        resolution = scene.grid.resolution
        self.names = range(ROBOT, len(trace.obstacle_specs))
        self.offsets = [disc(b.radius, resolution) for b in trace.obstacle_specs]
        self.offsets.append(disc(scene.robot.radius, resolution))  # number -1
        self.places = [trace.robot.tolist(), *(track.tolist() for track in trace.tracks)]
        self.found: list[str] = []
        self.turned: dict = {}
        self.kept: dict = {}
        ys, xs = scene.grid.blocked.nonzero()
        self.maps = [frozenset(zip(xs.tolist(), ys.tolist(), strict=True))]
        edits = {edit.tick: edit for edit in scene.edits}
        for t in range(1, trace.ticks + 1):
            self.maps.append(self.next_map(t, edits.get(t)))

    def faults(self) -> list[str]:
        """Every breach; empty when the trace is clean."""
        self.report()
        self.reported_edits()
        before = self.meetings(0)
        for t in range(1, self.trace.ticks + 1):
            now = self.meetings(t)
            self.steps(t, before)
            before = now
        self.kinds()
        return self.found

    # ---- reading ----

    def on_map(self, cell):
        return 0 <= cell[0] < self.width and 0 <= cell[1] < self.height

    def at(self, name, t):
        """Where the robot or an obstacle is at a tick; None before it appears."""
        since = 0 if name == ROBOT else self.trace.appears[name]
        track = self.places[name + 1]
        # A track that ends early is reported; the rest is judged as if the obstacle stayed.
        return None if t < since else tuple(track[min(t - since, len(track) - 1)])

    def cover(self, name, cell):
        """Cells of the map that it covers there."""
        x, y = cell
        return {c for dx, dy in self.offsets[name] if self.on_map(c := (x + dx, y + dy))}

    def fault(self, t, what):
        self.found.append(f"tick {t}: {what}")

    # ---- walls that come and go ----

    def next_map(self, t, edit):
        before = self.maps[-1]
        if edit is None:
            return before
        covered = {self.trace.scene.goal}
        for name in self.names:
            if (cell := self.at(name, t - 1)) is not None:
                covered |= self.cover(name, cell)
        walls = set(edit.blocked) - before
        kept, walls, freed = walls & covered, walls - covered, set(edit.freed) & before
        if walls or freed:
            self.turned[t] = walls, freed
        if kept:
            self.kept[t] = kept
        return (before | walls) - freed

    def reported_edits(self):
        trace = self.trace
        reported = {e.tick: (set(e.blocked), set(e.freed)) for e in trace.edits}
        if reported != self.turned or [e.tick for e in trace.edits] != sorted(reported):
            self.fault(0, f"turned {self.turned}, reported {reported}")
        for word, which in (("wall", 0), ("opened", 1)):
            ticks = {t for t, turned in self.turned.items() if turned[which]}
            ticks |= set(self.kept) if word == "wall" else set()
            events = [e for e in trace.events if e.word == word]
            if [e.tick for e in events] != sorted(ticks):
                self.fault(0, f"{word} at {sorted(ticks)}, reported at {[e.tick for e in events]}")
            for e in events:
                count = len(self.turned.get(e.tick, (set(), set()))[which])
                if not e.sentence.startswith(f"{count} cell"):
                    self.fault(e.tick, f"{e.sentence!r} of {count}")

    # ---- what is reported of the run ----

    def report(self):
        tr = self.trace
        n = tr.ticks + 1
        if not (len(tr.speed) == len(tr.cause) == n):
            self.fault(0, "speeds and causes are not one a tick")
        if list(tr.appears) != sorted(tr.appears):
            self.fault(0, "bodies are not in order of appearance")
        for k, (track, t0) in enumerate(zip(tr.tracks, tr.appears, strict=True)):
            if len(track) != n - t0:
                self.fault(t0, f"track {k} has {len(track)} cells for {n - t0} ticks")
        robot = [self.at(ROBOT, t) for t in range(n)]
        if robot[0] != tr.scene.start:
            self.fault(0, "the robot does not begin at the start")
        if tr.arrived != (robot[-1] == tr.scene.goal and tr.path is not None):
            self.fault(tr.ticks, "arrived and standing on the goal are not the same")
        if tr.collisions:
            self.fault(tr.ticks, "a collision of the robot's own making")
        still = [t for t in range(1, n) if robot[t] == robot[t - 1]]
        waiting = [t for t in range(1, n) if tr.cause[t] == "waiting"]
        if len(still) != tr.waits or still != waiting:
            self.fault(tr.ticks, f"waiting and not moving are not the same, {tr.waits} waits reported")
        if any(tr.speed[t] < 0 for t in range(n)) or any(tr.speed[t] for t in waiting):
            self.fault(0, "a speed that cannot be")
        if tr.speed[0] != 0 or (tr.arrived and tr.speed[-1] != 0):
            self.fault(0, "not at rest at start and goal")
        driven = [robot[0], *(robot[t] for t in range(1, n) if t not in set(still))]
        if tr.path is not None and [tuple(c) for c in tr.path.cells.tolist()] != driven:
            self.fault(tr.ticks, "the path is not what was driven")

    # ---- places and steps ----

    def meetings(self, t):
        """Walls, and never two in one cell but for a hit at the last tick; who covers which cell."""
        owner: dict = {}
        for name in self.names:
            cell = self.at(name, t)
            if cell is None:
                continue
            if not self.on_map(cell):
                self.fault(t, f"{name} is off the map")
            covered = self.cover(name, cell)
            blocked_start = name == ROBOT and self.trace.outcome is Outcome.START_OCCUPIED
            if not blocked_start and covered & self.maps[t]:
                self.fault(t, f"{name} is in a wall")
            for other in sorted({owner[c] for c in covered if c in owner}):
                if other != ROBOT or not self.is_hit(name, t):
                    self.fault(t, f"{other} and {name} are in one cell")
                elif self.at(ROBOT, t) != self.at(ROBOT, t - 1):
                    self.fault(t, "a hit, but the robot moved")
            owner |= dict.fromkeys(covered, name)
        return owner

    def is_hit(self, name, t):
        """Whether an obstacle that does not yield may be on the robot."""
        last = t == self.trace.ticks and self.trace.outcome is Outcome.HIT
        return last and not self.trace.obstacle_specs[name].yields

    def steps(self, t, before):
        """Single steps by the corner rule; no swap and no crossing for any pair."""
        middles: dict = {}
        for name in self.names:
            old, new = self.at(name, t - 1), self.at(name, t)
            if old is None:
                continue
            self.single(t, name, old, new)
            covered = self.cover(name, old)
            if old != new:
                for other in {before.get(c, name) for c in self.cover(name, new)} - {name}:
                    self.swap(t, name, other, covered)
            dx, dy = new[0] - old[0], new[1] - old[1]
            if abs(dx * dy) == 1:
                mine = {(2 * x + dx, 2 * y + dy) for x, y in covered}
                for other, slope in sorted({middles[m] for m in mine if m in middles}):
                    if slope != dx * dy:
                        self.fault(t, f"{other} and {name} cross")
                middles |= dict.fromkeys(mine, (name, dx * dy))

    def swap(self, t, name, other, covered):
        """Whether the other one, who was where this one is now, is now where this one was."""
        if self.at(other, t) == self.at(other, t - 1):
            return  # it stands: who comes onto it is in one cell with it
        if self.cover(other, self.at(other, t)) & covered and name < other:
            self.fault(t, f"{name} and {other} swap")

    def single(self, t, name, old, new):
        step = dx, dy = new[0] - old[0], new[1] - old[1]
        robot = name == ROBOT
        if robot and step != (0, 0) and step not in self.trace.scene.moves.offsets:
            self.fault(t, "the robot makes a step it does not have")
        if max(abs(dx), abs(dy)) > 1:
            if not (robot and self.trace.scene.moves.name == "sixteen-connected" and abs(dx * dy) == 2):
                self.fault(t, f"{name} jumps")
            return
        if not robot and self.trace.obstacle_specs[name].kind == "recorded":
            return
        if dx and dy and not (self.cutting and len(self.offsets[name]) == 1):
            for side in ((new[0], old[1]), (old[0], new[1])):
                if self.cover(name, side) & self.maps[t]:
                    self.fault(t, f"{name} cuts a corner")

    def kinds(self):
        """What each kind promises: start and goal kept clear, lanes kept clear, yielding, tracks replayed."""
        tr, scene = self.trace, self.trace.scene
        ends = self.cover(ROBOT, scene.start) | self.cover(ROBOT, scene.goal)
        recorded = [s for s in scene.traffic if isinstance(s, Recorded)]
        lanes = {
            (x + dx, y + dy)
            for s in recorded
            for x, y in s.track
            for dx, dy in disc(s.radius, scene.grid.resolution)
        }
        replayed = iter(recorded)
        robot = [self.cover(ROBOT, self.at(ROBOT, max(t - 1, 0))) for t in range(tr.ticks + 1)]
        for k, body in enumerate(tr.obstacle_specs):
            if body.kind == "recorded":
                track = next(replayed).track
                for t in range(tr.ticks + 1):
                    if self.at(k, t) != track[min(t, len(track) - 1)]:
                        self.fault(t, f"{k} leaves its track")
                continue
            for t in range(tr.appears[k], tr.ticks + 1):
                cover = self.cover(k, self.at(k, t))
                if cover & ends:
                    self.fault(t, f"{k}, {body.kind}, stands on start or goal")
                if cover & lanes:
                    self.fault(t, f"{k}, {body.kind}, stands in a recorded lane")
                if body.yields and cover & robot[t]:
                    self.fault(t, f"{k}, {body.kind}, moves onto the robot")
        counts = [
            s.count if isinstance(s, RandomWalk | Crossing) else 1
            for s in scene.traffic
            if isinstance(s, RandomWalk | Crossing | Patrol | Recorded)
        ]
        if len(tr.obstacle_specs) > sum(counts):
            self.fault(0, f"{len(tr.obstacle_specs)} bodies, at most {sum(counts)} were asked for")

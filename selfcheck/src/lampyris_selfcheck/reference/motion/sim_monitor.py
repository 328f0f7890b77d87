"""A slow monitor of simulations: every rule for every pair at every tick, by plain loops over coordinate
pairs.

It shares nothing with the simulator: footprints come from exact fractions, bodies are compared each with
each, and nothing is remembered from one tick to the next.
"""

from __future__ import annotations

from fractions import Fraction
from itertools import combinations

from lampyris.model.trace import Outcome, Trace
from lampyris.model.traffic import Crossing, Patrol, RandomWalk, Recorded


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
    return out


class Monitor:
    """All that a trace must obey. :meth:`faults` lists every breach, in words."""

    def __init__(self, trace: Trace) -> None:
        self.trace = trace
        scene = trace.scene
        self.blocked = scene.grid.blocked.tolist()
        self.height, self.width = len(self.blocked), len(self.blocked[0])
        self.cutting = scene.moves.corner_cutting
        resolution = scene.grid.resolution
        self.robot_disc = disc(scene.robot.radius, resolution)
        self.discs = [disc(b.radius, resolution) for b in trace.obstacle_specs]
        self.found: list[str] = []

    def faults(self) -> list[str]:
        """Every breach; empty when the trace is clean."""
        self.story()
        for t in range(self.trace.ticks + 1):
            self.places(t)
            if t:
                self.steps(t)
        self.kinds()
        return self.found

    # ---- reading ----

    def on_map(self, cell):
        return 0 <= cell[0] < self.width and 0 <= cell[1] < self.height

    def wall(self, cell):
        return self.on_map(cell) and self.blocked[cell[1]][cell[0]]

    def cover(self, cell, offsets):
        cells = {(cell[0] + dx, cell[1] + dy) for dx, dy in offsets}
        return {c for c in cells if self.on_map(c)}

    def robot(self, t):
        return tuple(int(v) for v in self.trace.robot[t])

    def body(self, k, t):
        """Where body k is at tick t, None before it appeared."""
        t0 = self.trace.appears[k]
        track = self.trace.tracks[k]
        # A track that ends early is reported in the story; the rest is judged as if the body stayed.
        return None if t < t0 else tuple(int(v) for v in track[min(t - t0, len(track) - 1)])

    def mover(self, name, t):
        """(cell, offsets) of the robot (-1) or a body at a tick."""
        if name < 0:
            return self.robot(t), self.robot_disc
        return self.body(name, t), self.discs[name]

    def fault(self, t, what):
        self.found.append(f"tick {t}: {what}")

    # ---- rules ----

    def story(self):
        tr = self.trace
        n = tr.ticks + 1
        if not (len(tr.speed) == len(tr.cause) == n):
            self.fault(0, "speeds and causes are not one a tick")
        if list(tr.appears) != sorted(tr.appears):
            self.fault(0, "bodies are not in order of appearance")
        for k, (track, t0) in enumerate(zip(tr.tracks, tr.appears, strict=True)):
            if len(track) != n - t0:
                self.fault(t0, f"track {k} has {len(track)} cells for {n - t0} ticks")
        if self.robot(0) != tr.scene.start:
            self.fault(0, "the robot does not begin at the start")
        if tr.arrived != (self.robot(tr.ticks) == tr.scene.goal and tr.path is not None):
            self.fault(tr.ticks, "arrived and standing on the goal are not the same")
        if tr.collisions:
            self.fault(tr.ticks, "a collision of the robot's own making")
        still = sum(self.robot(t) == self.robot(t - 1) for t in range(1, n))
        if still != tr.waits or tr.cause.count("waiting") != still:
            self.fault(tr.ticks, f"{tr.waits} waits told, {still} seen")
        for t in range(1, n):
            if (tr.cause[t] == "waiting") != (self.robot(t) == self.robot(t - 1)):
                self.fault(t, "waiting and not moving are not the same")
            if tr.speed[t] < 0 or (tr.cause[t] == "waiting" and tr.speed[t] != 0):
                self.fault(t, "a speed that cannot be")
        if tr.speed[0] != 0 or (tr.arrived and tr.speed[-1] != 0):
            self.fault(0, "not at rest at start and goal")
        driven = [self.robot(0)] + [self.robot(t) for t in range(1, n) if self.robot(t) != self.robot(t - 1)]
        if tr.path is not None and [tuple(c) for c in tr.path.cells.tolist()] != driven:
            self.fault(tr.ticks, "the path is not what was driven")

    def places(self, t):
        """Walls, and never two in one cell; the one thing allowed is a hit at the last tick."""
        names = [-1, *range(len(self.trace.obstacle_specs))]
        covers = {}
        for name in names:
            cell, offsets = self.mover(name, t)
            if cell is None:
                continue
            if not self.on_map(cell):
                self.fault(t, f"{name} is off the map")
            covers[name] = self.cover(cell, offsets)
            blocked_start = name == -1 and self.trace.outcome is Outcome.START_OCCUPIED
            if not blocked_start and any(self.wall(c) for c in covers[name]):
                self.fault(t, f"{name} is in a wall")
        for a, b in combinations(covers, 2):
            if covers[a] & covers[b]:
                hit = (
                    a == -1
                    and not self.trace.obstacle_specs[b].yields
                    and t == self.trace.ticks
                    and self.trace.outcome is Outcome.HIT
                )
                if not hit:
                    self.fault(t, f"{a} and {b} are in one cell")
                elif self.robot(t) != self.robot(t - 1):
                    self.fault(t, "a hit, but the robot moved")

    def steps(self, t):
        """Single steps by the corner rule; no swap and no crossing for any pair."""
        moves = {}
        for name in [-1, *range(len(self.trace.obstacle_specs))]:
            old, offsets = self.mover(name, t - 1)
            if old is None:
                continue
            new, _ = self.mover(name, t)
            moves[name] = (old, new, offsets)
            self.single(t, name, old, new, offsets)
        for a, b in combinations(moves, 2):
            (a0, a1, fa), (b0, b1, fb) = moves[a], moves[b]
            if (a0 == a1) and (b0 == b1):
                continue
            apart = max(abs(a0[0] - b0[0]), abs(a0[1] - b0[1]))
            if apart > 2 + max(x for x, _ in fa) + max(x for x, _ in fb):
                continue  # one step each cannot bring their cells together
            swap = self.cover(a1, fa) & self.cover(b0, fb) and self.cover(b1, fb) & self.cover(a0, fa)
            if swap and not (a0 == a1 and self.trace.outcome is Outcome.HIT and t == self.trace.ticks):
                self.fault(t, f"{a} and {b} swap")
            if self.cross(a0, a1, fa, b0, b1, fb):
                self.fault(t, f"{a} and {b} cross")

    def single(self, t, name, old, new, offsets):
        dx, dy = new[0] - old[0], new[1] - old[1]
        if name == -1 and self.trace.scene.moves.name == "sixteen-connected" and abs(dx * dy) == 2:
            return
        if max(abs(dx), abs(dy)) > 1:
            self.fault(t, f"{name} jumps")
        if name >= 0 and self.trace.obstacle_specs[name].kind == "recorded":
            return
        if dx and dy and not (self.cutting and offsets == {(0, 0)}):
            for side in ((new[0], old[1]), (old[0], new[1])):
                if any(self.wall(c) for c in self.cover(side, offsets)):
                    self.fault(t, f"{name} cuts a corner")
        if name == -1 and (dx, dy) != (0, 0) and (dx, dy) not in self.trace.scene.moves.offsets:
            self.fault(t, "the robot makes a step it does not have")

    def cross(self, a0, a1, fa, b0, b1, fb):
        da = (a1[0] - a0[0], a1[1] - a0[1])
        db = (b1[0] - b0[0], b1[1] - b0[1])
        if abs(da[0] * da[1]) != 1 or abs(db[0] * db[1]) != 1 or da[0] * db[0] + da[1] * db[1] != 0:
            return False
        middles = {(2 * x + da[0], 2 * y + da[1]) for x, y in self.cover(a0, fa)}
        return any((2 * x + db[0], 2 * y + db[1]) in middles for x, y in self.cover(b0, fb))

    def kinds(self):
        """What each kind promises: start and goal kept clear, lanes kept clear, yielding, tracks replayed."""
        tr = self.trace
        ends = self.cover(tr.scene.start, self.robot_disc) | self.cover(tr.scene.goal, self.robot_disc)
        specs = tr.scene.traffic
        tracks = [s for s in specs if isinstance(s, Recorded)]
        lanes = set()
        for s in tracks:
            for cell in s.track:
                lanes |= self.cover(cell, disc(s.radius, tr.scene.grid.resolution))
        replayed = iter(tracks)
        for k, body in enumerate(tr.obstacle_specs):
            t0 = tr.appears[k]
            if body.kind == "recorded":
                track = next(replayed).track
                for t in range(tr.ticks + 1):
                    if self.body(k, t) != track[min(t, len(track) - 1)]:
                        self.fault(t, f"{k} leaves its track")
                continue
            for t in range(t0, tr.ticks + 1):
                cover = self.cover(self.body(k, t), self.discs[k])
                if cover & ends:
                    self.fault(t, f"{k}, {body.kind}, stands on start or goal")
                if cover & lanes:
                    self.fault(t, f"{k}, {body.kind}, stands in a recorded lane")
                robot = self.cover(self.robot(max(t - 1, 0)), self.robot_disc)
                if body.yields and cover & robot:
                    self.fault(t, f"{k}, {body.kind}, moves onto the robot")
        most = sum(
            s.count if isinstance(s, RandomWalk | Crossing) else 1
            for s in specs
            if isinstance(s, RandomWalk | Crossing | Patrol | Recorded)
        )
        if len(tr.obstacle_specs) > most:
            self.fault(0, f"{len(tr.obstacle_specs)} bodies, at most {most} were asked for")

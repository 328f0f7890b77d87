"""A slow reference of walls that come and go: the map of every tick by plain sets, and what must follow from it.

It shares nothing with the simulator or the referee but the trace it reads: footprints come from exact
fractions (:mod:`reference.sim_monitor`), maps are lists, and every tick is worked out from the ones before.
"""

from __future__ import annotations

from lampyris.model.trace import Trace
from lampyris_selfcheck.reference.motion.sim_monitor import Monitor


class EditMonitor(Monitor):
    """All that a trace must obey, by the map of each tick; and what it tells of the edits."""

    def __init__(self, trace: Trace) -> None:
        super().__init__(trace)
        self.maps = [self.blocked]
        self.turned: dict = {}
        self.held: dict = {}
        edits = {edit.tick: edit for edit in trace.scene.edits}
        for t in range(1, trace.ticks + 1):
            self.maps.append(self.next_map(t, edits.get(t)))

    def next_map(self, t, edit):
        before = self.maps[-1]
        if edit is None:
            return before
        kept = {self.trace.scene.goal}
        for name in (-1, *range(len(self.trace.obstacle_specs))):
            cell, offsets = self.mover(name, t - 1)
            if cell is not None:
                kept |= self.cover(cell, offsets)
        now = [list(row) for row in before]
        walls, freed, held = set(), set(), set()
        for x, y in edit.blocked:
            if not before[y][x]:
                (held if (x, y) in kept else walls).add((x, y))
        for x, y in edit.freed:
            if before[y][x]:
                freed.add((x, y))
        for x, y in walls:
            now[y][x] = True
        for x, y in freed:
            now[y][x] = False
        if walls or freed:
            self.turned[t] = walls, freed
        if held:
            self.held[t] = held
        return now

    def story(self):
        super().story()
        told = {e.tick: (set(e.blocked), set(e.freed)) for e in self.trace.edits}
        if told != self.turned or [e.tick for e in self.trace.edits] != sorted(told):
            self.fault(0, f"turned {self.turned}, told {told}")
        for word, mine in (
            ("wall", {t for t, (walls, _) in self.turned.items() if walls} | set(self.held)),
            ("opened", {t for t, (_, freed) in self.turned.items() if freed}),
        ):
            events = [e for e in self.trace.events if e.word == word]
            if [e.tick for e in events] != sorted(mine):
                self.fault(0, f"{word} at {sorted(mine)}, told at {[e.tick for e in events]}")
            for e in events:
                walls, freed = self.turned.get(e.tick, (set(), set()))
                some = freed if word == "opened" else walls
                if not e.sentence.startswith(f"{len(some)} cell"):
                    self.fault(e.tick, f"{e.sentence!r} of {len(some)}")

    def places(self, t):
        self.blocked = self.maps[t]
        super().places(t)


def reach_of(blocked, start, offsets, cutting):
    """Every cell that single steps reach over free cells, by its least cost; a diagonal is the root of 2.

    Costs are pairs (straights, diagonals), compared exactly.
    """
    height, width = len(blocked), len(blocked[0])

    def free(x, y):
        return 0 <= x < width and 0 <= y < height and not blocked[y][x]

    best, todo = {start: (0, 0)}, [start]
    while todo:
        later = []
        for x, y in todo:
            n, m = best[x, y]
            for dx, dy in offsets:
                to = (x + dx, y + dy)
                if not free(*to):
                    continue
                if dx and dy and not cutting and not (free(x + dx, y) and free(x, y + dy)):
                    continue
                cost = (n, m + 1) if dx and dy else (n + 1, m)
                if to not in best or less(cost, best[to]):
                    best[to] = cost
                    later.append(to)
        todo = later
    return best


def less(a, b):
    """Whether a straights and diagonals cost less than b, exactly."""
    n, m = a[0] - b[0], a[1] - b[1]
    if n <= 0 and m <= 0:
        return (n, m) != (0, 0)
    if n >= 0 and m >= 0:
        return False
    return n * n > 2 * m * m if n < 0 else 2 * m * m > n * n

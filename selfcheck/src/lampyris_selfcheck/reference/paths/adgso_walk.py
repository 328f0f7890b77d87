"""A slow, plain AD-GSO walk over a finished field, to judge the kernel by.

Sets, dictionaries and fixpoints only. It takes the field's cost, luciferin and parents as given (the field
has its own reference) and shares no code with the walk it judges.
"""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass
class TwinJump:
    at: tuple
    accepted: list
    chosen: tuple
    subpath: list
    by_parents: bool
    rings: int


@dataclass
class TwinWalk:
    """The world as the reference sees it: dictionaries by cell. ``cost`` and ``luc`` hold reachable cells only."""

    free: set
    cost: dict
    luc: dict
    parent: dict
    goal: tuple
    offsets: tuple
    prices: tuple
    cutting: bool
    nt: int = 10
    mvr: int = 3
    choice: str = "greedy"
    draws: list = field(default_factory=list)

    def legal(self, a, b, closed):
        """Whether one step leads from a to b with no closed cell in its way."""
        dx, dy = b[0] - a[0], b[1] - a[1]
        if (dx, dy) not in self.offsets:
            return False
        needed = {b}
        if abs(dx) == 2:
            needed |= {(a[0] + dx // 2, a[1]), (a[0] + dx // 2, b[1])}
        elif abs(dy) == 2:
            needed |= {(a[0], a[1] + dy // 2), (b[0], a[1] + dy // 2)}
        elif dx and dy and not self.cutting:
            needed |= {(a[0], b[1]), (b[0], a[1])}
        return all(c in self.free and c not in closed for c in needed)

    def accepted(self, at, closed):
        """Cells accepted around ``at``, sorted by ring, row, column; and how many rings were opened."""
        reach = max(max(abs(dx), abs(dy)) for dx, dy in self.offsets)
        joined = set()
        for ring in range(1, max(self.mvr, reach) + 1):
            window = {
                (at[0] + dx, at[1] + dy)
                for dx in range(-ring, ring + 1)
                for dy in range(-ring, ring + 1)
                if (dx, dy) != (0, 0)
            }
            lower = {
                c
                for c in window
                if c in self.free and c not in closed and c in self.luc and self.luc[c] < self.luc[at]
            }
            joined = {at}
            grown = True
            while grown:
                more = {c for c in lower - joined if any(self.legal(j, c, closed) for j in joined)}
                joined |= more
                grown = bool(more)
            joined.discard(at)
            if ring >= reach and len(joined) >= self.nt:
                break
        return sorted(joined, key=lambda c: (max(abs(c[0] - at[0]), abs(c[1] - at[1])), c[1], c[0])), ring

    def ways(self, at, accepted, closed):
        """Cost of the cheapest way inside the accepted set to each of its cells."""
        inside = [at, *accepted]
        known = {at: 0}
        changed = True
        while changed:
            changed = False
            for a in inside:
                for b in inside:
                    if a in known and self.legal(a, b, closed):
                        price = self.prices[self.offsets.index((b[0] - a[0], b[1] - a[1]))]
                        if known[a] + price < known.get(b, 10**30):
                            known[b] = known[a] + price
                            changed = True
        return known

    def chain(self, at, to, closed):
        """X's parents as far as ``to``, or None when they miss it or are obstructed."""
        cells = [at]
        while cells[-1] != to:
            here = cells[-1]
            if here == self.goal or not self.legal(here, self.parent[here], closed):
                return None
            cells.append(self.parent[here])
        return cells

    def choose(self, at, accepted, closed):
        if self.choice == "roulette":
            shares = [self.luc[c] - self.luc[at] for c in accepted]
            mark = self.draws.pop(0) * sum(shares)
            total = 0.0
            for cell, share in zip(accepted, shares, strict=True):
                total += share
                if total < mark:
                    return cell
            return accepted[-1]
        if self.choice == "exact":
            way = self.ways(at, accepted, closed)
            return min(accepted, key=lambda c: (way[c] + self.cost[c], self.luc[c], c[1], c[0]))
        return min(accepted, key=lambda c: (self.luc[c], self.cost[c], c[1], c[0]))

    def jump(self, at, closed):
        """One iteration, or None when nothing is accepted."""
        accepted, rings = self.accepted(at, closed)
        if not accepted:
            return None
        to = self.choose(at, accepted, closed)
        cells = self.chain(at, to, closed)
        if cells is not None:
            return TwinJump(at, accepted, to, cells, True, rings)
        way = self.ways(at, accepted, closed)
        cells = [to]
        while cells[-1] != at:
            here = cells[-1]
            for (dx, dy), price in zip(self.offsets, self.prices, strict=True):
                back = (here[0] + dx, here[1] + dy)
                if back in way and self.legal(back, here, closed) and way[back] + price == way[here]:
                    cells.append(back)
                    break
        return TwinJump(at, accepted, to, cells[::-1], False, rings)

    def walk(self, start, bodies):
        """Every jump to the goal; None when hemmed in at the start."""
        jumps = []
        at = start
        while at != self.goal:
            jump = self.jump(at, bodies)
            if jump is None and not jumps:
                return None
            jumps.append(jump if jump is not None else self.jump(at, set()))
            at = jumps[-1].chosen
        return jumps


def twin_of(solved, **settings):
    """A reference over a solved field (its arrays, read cell by cell)."""
    exact, luc, parent = solved.exact, solved.luciferin, solved.parent
    height, width = exact.shape
    cells = [(x, y) for y in range(height) for x in range(width)]
    known = [c for c in cells if exact[c[1], c[0]] >= 0]
    return TwinWalk(
        free={c for c in cells if solved.free[c[1], c[0]]},
        cost={(x, y): int(exact[y, x]) for x, y in known},
        luc={(x, y): float(luc[y, x]) for x, y in known},
        parent={(x, y): (int(parent[y, x]) % width, int(parent[y, x]) // width) for x, y in known},
        goal=solved.goal,
        offsets=solved.moves.offsets,
        prices=solved.moves.costs,
        cutting=solved.moves.corner_cutting,
        **settings,
    )

"""A lower bound of paths between two places: costs without walls in squares around both, and a field in between."""

from __future__ import annotations

from lampyris.kernels._jit import kernel, stopped, u64


@kernel(out=("bounds",), of="row", each=60_000)
def least_over_rim(
    heuristic, stride, rows, cells, facing, row, column, half, least, cost, headings, table, goal_half, goal, entry,
    bounds, halt,
):  # fmt: skip
    """For each start state the least cost of a path by way of a cell on the rim of the square around it.

    From a cell of the rim a path costs no less than the heuristic there, nor than the table in the square around the goal, nor
    elsewhere than the heuristic and what the entry into that square costs more.

    Parameters
    ----------
    heuristic : int64 (cells,): consistent cost to the goal; negative: the base must not be there.
    stride, rows : cells of a row, and rows of the map.
    cells, facing : int64 (n,): cell and heading of each start state.
    row, column : int64 (m,): the cells of the rim, counted from the corner of the square.
    half : the square has ``2 * half + 1`` cells a side.
    least : int64 (headings * side * side,): costs without walls from a heading in the middle to each row and column.
    cost : int64 (headings * side * side * headings,): the same to each heading there.
    table : int64 (goal_side * goal_side * headings,): costs to the goal without walls, from the square around it.
    goal_half, goal : that square has ``2 * goal_half + 1`` cells a side, and this cell in its middle.
    entry : what a path from outside of it costs more than the heuristic says, at least; may be negative.
    bounds : int64 (n,): the result; 1 << 40 where the base can be nowhere on the rim.
    """
    side = 2 * half + 1
    goal_side = 2 * goal_half + 1
    goal_y = goal // stride - goal_half
    goal_x = goal - goal // stride * stride - goal_half
    more = max(entry, 0)
    for n in range(len(cells)):
        if stopped(halt):
            return
        from_y = cells[u64(n)] // stride
        from_x = cells[u64(n)] - from_y * stride - half
        from_y -= half
        base = facing[u64(n)] * side
        best = 1 << 40
        for k in range(len(row)):
            y = from_y + row[u64(k)]
            x = from_x + column[u64(k)]
            if y < 0 or y >= rows or x < 0 or x >= stride:
                continue
            known = heuristic[u64(y * stride + x)]
            if known < 0:
                continue
            place = (base + row[u64(k)]) * side + column[u64(k)]
            through = least[u64(place)] + known
            if through >= best:
                continue
            y -= goal_y
            x -= goal_x
            if y < 0 or y >= goal_side or x < 0 or x >= goal_side:
                best = min(best, through + more)
                continue
            inside = (y * goal_side + x) * headings
            beyond = known + entry
            for h in range(headings):
                rest = max(known, min(beyond, table[u64(inside + h)]))
                best = min(best, cost[u64(place * headings + h)] + rest)
        bounds[u64(n)] = best


@kernel(out=("table",), of="table", each=5_000)
def least_of_goals(back, half, headings, facing, row, column, price, table_half, table, halt):
    """The least cost to any of some goal states from the states of a square around them.

    Parameters
    ----------
    back : int64 (headings * side * side * headings,): costs without walls to a heading in the middle of a square, from each row,
        column and heading of it.
    half : that square has ``2 * half + 1`` cells a side.
    facing, row, column, price : int64 (n,): heading of each goal, where it is from the middle of the table, what it costs from
        there on.
    table_half : the table has ``2 * table_half + 1`` cells a side; all its cells are within the square around each goal.
    table : int64 (table_side * table_side * headings,): the result, to begin with greater than any cost.
    """
    side = 2 * half + 1
    far = half - table_half
    width = (2 * table_half + 1) * headings
    for k in range(len(facing)):
        if stopped(halt):
            return
        more = price[u64(k)]
        source = (facing[u64(k)] * side + far - row[u64(k)]) * side + far - column[u64(k)]
        for y in range(2 * table_half + 1):
            read = (source + y * side) * headings
            write = y * width
            for i in range(width):
                whole = back[u64(read + i)] + more
                if whole < table[u64(write + i)]:
                    table[u64(write + i)] = whole

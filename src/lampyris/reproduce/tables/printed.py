"""Every printed table with a verdict on every figure: what needs no runs."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from functools import partial
from types import MappingProxyType

from lampyris.errors import InternalFault
from lampyris.reproduce.tables import claims, comparison, field, printed_data, settings, sweep, velocity, walk
from lampyris.reproduce.tables.verdict import Verdict

CHECKS: Mapping[str, Callable[[], Iterable[Verdict]]] = MappingProxyType(
    {
        "3.1": settings.robot,
        "4.1": settings.arc_costs,
        "4.2": field.field,
        **{t: partial(walk.walk, t) for t in walk.TABLES},
        "4.7": settings.parameters,
        "4.8": sweep.sweep,
        "4.9": sweep.means,
        "4.10": comparison.part_one,
        "4.11": comparison.part_two,
        **{t: partial(velocity.velocity, t) for t in printed_data.VELOCITY_TABLES},
        "4.18": claims.summary,
        "text": claims.text,
    }
)
"""Who judges each table, in the order of the dissertation."""


def verdicts(table: str) -> tuple[Verdict, ...]:
    """A verdict on each figure of a table.

    Raises
    ------
    InternalFault : ``VERDICT_MISSING``, a figure without one, or one without a figure.
    """
    return whole(table, CHECKS[table]())


def whole(table: str, found: Iterable[Verdict]) -> tuple[Verdict, ...]:
    """The same verdicts, if they are those of every figure of the table, one each, in its order."""
    out = tuple(found)
    given = [(v.table, v.where, v.printed) for v in out]
    wanted = [(f.table, f.where, f.printed) for f in printed_data.figures(table)]
    if given != wanted:
        odd = sorted(set(wanted) ^ set(given))[:1] or given[:1]
        raise InternalFault("VERDICT_MISSING", f"{odd[0] if odd else table}", where=f"Table {table}")
    return out

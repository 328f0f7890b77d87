"""Tables 3.1, 4.1 and 4.7: what the dissertation assumes, beside what is set here."""

from __future__ import annotations

from collections.abc import Iterator

from lampyris.model.moves import moves_named
from lampyris.motion.laws.dissertation import DissertationLaw
from lampyris.planning.adgso.ad_gso import AdGso
from lampyris.reproduce.tables import printed_data
from lampyris.reproduce.tables.verdict import EXACT, GIVEN, NOT_REPRODUCIBLE, Verdict, same, short

_LAW = {
    "Lowest velocity": ("v_min", "the floor of the velocity by obstacles; at both ends of a path it is 0"),
    "Maximum velocity": ("v_max", "the law's upper limit"),
    "Maximum velocity at angle 90": ("v_90", "interior angle of 90 degrees or sharper"),
    "Maximum velocity at angle 45": ("v_135", "a turn of 45 degrees, which Tables 4.12 to 4.17 call 135"),
    "Maximum velocity at angle 180": ("v_180", "straight on"),
    "Maximum deceleration": ("braking", "a node, backward from the goal; its tables need it"),
}
_ACCELERATION = {
    "Acceleration value in horizontal and vertical direction": ("a_straight", 1.0),
    "Acceleration value in horizontal and diagonal direction": ("a_diagonal", 1.4),
}
_PARAMETERS = {"rho": "rho", "gamma": "gamma", "nt": "nt", "MVR": "mvr"}


def robot() -> Iterator[Verdict]:
    """Table 3.1 against the defaults of our law."""
    law = DissertationLaw()
    for f in printed_data.figures("3.1"):
        attribute = f.row["attribute"]
        if attribute in _ACCELERATION:
            name, step = _ACCELERATION[attribute]
            ours: float = getattr(law, name)
            half = 0.5 * 40 * step
            why = f"half of the acceleration 40 of Algorithm 3.10 times {step:g}, the arc, is {half:g}"
            right = same(f.printed, ours) and same(f.printed, half)
            yield Verdict("3.1", f.where, f.printed, short(ours), EXACT if right else NOT_REPRODUCIBLE, why)
            continue
        name, why = _LAW[attribute]
        yield _setting("3.1", f.where, f.printed, getattr(law, name), f"an assumption: {why}")


def arc_costs() -> Iterator[Verdict]:
    """Table 4.1 against the costs of our ``dissertation`` moves."""
    steps = moves_named("dissertation")
    for f in printed_data.figures("4.1"):
        straight = f.column == "horizontal_vertical"
        if f.row["cell"] == "obstacle":
            why = "a mark rather than a cost: blocked cells are never entered"
            yield Verdict("4.1", f.where, f.printed, "never entered", GIVEN, why)
            continue
        ours = (steps.straight if straight else steps.diagonal) / steps.unit
        yield _setting("4.1", f.where, f.printed, ours, "an assumption: the cost of a step")


def parameters() -> Iterator[Verdict]:
    """Table 4.7 against the defaults of our AD-GSO."""
    ours = AdGso()
    for f in printed_data.figures("4.7"):
        name = _PARAMETERS[f.row["parameter"]]
        why = f"a setting: the default of {name} here; whether nt = 10 is best is asked under Table 4.8"
        if name != "nt":
            why = f"a setting: the default of {name} here"
        yield _setting("4.7", f.where, f.printed, float(getattr(ours, name)), why)


def _setting(table: str, where: str, printed: str, ours: float, why: str) -> Verdict:
    """``given`` where ours is set to the same figure."""
    if not same(printed, ours):
        return Verdict(table, where, printed, short(ours), NOT_REPRODUCIBLE, f"{why}; ours differs")
    return Verdict(table, where, printed, short(ours), GIVEN, why)

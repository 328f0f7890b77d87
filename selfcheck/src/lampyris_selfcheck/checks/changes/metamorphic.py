"""Eleven relations between the answers to two questions: a map turned, a wall more, a quicker robot.

What a cheapest path costs is compared with another search by the check ``random``, cell by cell of the field.
"""

from __future__ import annotations

from lampyris_selfcheck.check import Ask, Check, Kind, Outcome, Part, Tally
from lampyris_selfcheck.checks.changes import metamorphic_maps as maps
from lampyris_selfcheck.checks.changes import metamorphic_motion as motion
from lampyris_selfcheck.checks.changes.metamorphic_draw import Relation

RELATIONS: dict[str, Relation] = {
    "rotate": maps.rotate,
    "reflect": maps.reflect,
    "swap": maps.swap,
    "pad blocked": maps.pad_blocked,
    "wall more": maps.wall_more,
    "wall less": maps.wall_less,
    "mover more": motion.mover_more,
    "off the way": motion.off_the_way,
    "scale": maps.scale,
    "quicker": motion.quicker,
    "relabel": motion.relabel,
}


SAYS: dict[str, str | tuple[str, ...]] = {
    "off the way": "added",
    "quicker": tuple(f"{name}: " for name in motion.LIMITS),
}
"""How the word of a case begins in which something was compared; there a case without is drawn anew."""

_TRIES = 6
"""Draws of a case, at most."""


def _kind(name: str, relation: Relation) -> Kind:
    what = " ".join((relation.__doc__ or "").split("\n\n")[0].split())
    least = {"compared": 0.9} if name in SAYS else {}
    return Kind(what, commit=200, nightly=100_000, release=100_000, chunk=500, least=least)


KINDS = {name: _kind(name, relation) for name, relation in RELATIONS.items()}


def run(ask: Ask, part: Part) -> Outcome:
    """Judge some cases of one relation."""
    tally = Tally(part)
    relation, says = RELATIONS[part.kind], SAYS.get(part.kind, "")
    for number in part.numbers:
        rng = ask.rng("metamorphic", part.kind, number)
        try:
            told = relation(rng, number)
            for _ in range(_TRIES - 1):
                if told.wrong or told.word.startswith(says):
                    break
                told = relation(rng, number)
        except Exception as error:
            tally.case("raised")
            tally.fail(number, f"{type(error).__name__}: {error}")
            continue
        tally.case(told.word)
        if says and told.word.startswith(says):
            tally.count("compared")
        if told.wrong:
            tally.fail(number, told.wrong, **told.data)
    return tally.outcome()


CHECK = Check(
    "metamorphic",
    ("G7",),
    "eleven relations hold between the answers to two questions",
    KINDS,
    run,
)

"""What the referee says: nothing, or the first rule that was broken."""

from __future__ import annotations

from dataclasses import dataclass

from lampyris.errors import InternalFault


@dataclass(frozen=True, slots=True)
class Violation:
    """The first broken rule.

    Parameters
    ----------
    rule : one word or two, the same in every release; the tests and the tables use it.
    where : node, tick or obstacle, as far as it is known.
    sentence : what is wrong, with the values that were found.
    """

    rule: str
    where: str
    sentence: str

    def __str__(self) -> str:
        return f"{self.rule}: {self.where}: {self.sentence}"


def demand(violation: Violation | None) -> None:
    """Stop everything if a rule was broken.

    Raises
    ------
    InternalFault : names the rule, the place and the values. Our own result is wrong; it must not leave the
        package.
    """
    if violation is not None:
        raise InternalFault(
            "REFEREE",
            f"{violation.rule}: {violation.sentence}",
            where=violation.where,
            todo="this is a fault of lampyris; please report it with the map and the seed",
        )

"""Rejection of the result that a worker claims."""

from __future__ import annotations

from typing import NoReturn

from lampyris.referee.verdict import Violation


class RejectedResult(Exception):
    """What is wrong with a claimed result."""


def demand(broken: Violation | None) -> None:
    """Reject what breaks a rule of the referee."""
    if broken is not None:
        raise RejectedResult(f"{broken.rule} at {broken.where}: {broken.sentence}")


def refuse(what: str) -> NoReturn:
    """Reject a result."""
    raise RejectedResult(what)

"""What scenario files take from pydantic's core: see the package ``pydantic`` beside this one."""

from __future__ import annotations

from typing import Any

ErrorDetails = dict[str, Any]


class PydanticCustomError(ValueError):
    """A mistake that a function found: its kind, and what its message is made of."""

    def __init__(self, type: str, template: str, context: dict[str, Any] | None = None) -> None:
        super().__init__(template.format(**(context or {})))
        self.type, self.context = type, context or {}

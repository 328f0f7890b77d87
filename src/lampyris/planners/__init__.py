"""Planners: from a Scene to a Plan.

``lampyris.planners()`` is also the call that lists them. The name is both a room of the house and a public
function, and Python binds a sub-module to its parent's attribute when it is imported; so the module itself
is callable (docs/decisions/0002).
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from types import ModuleType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from lampyris.planners.registry import PlannerInfo


class _CallableModule(ModuleType):
    def __call__(self) -> Mapping[str, PlannerInfo]:
        """Every planner with its traits, settings and source, by name."""
        from lampyris.planners.registry import table

        return table()


sys.modules[__name__].__class__ = _CallableModule

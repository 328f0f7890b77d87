"""The checks there are, by name; each is imported when it is asked for."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from types import MappingProxyType

from lampyris.errors import UsageError, did_you_mean
from lampyris_selfcheck.check import Check

MODULES: Mapping[str, str] = MappingProxyType(
    {
        "grids": "checks.paths.grids",
        "random": "checks.paths.random",
        "moving": "checks.traffic.moving",
        "profile": "checks.speed.profile",
        "pose-drives": "checks.traffic.pose_drives",
        "steered-drives": "checks.traffic.steered_drives",
        "unknown-maps": "checks.traffic.unknown_maps",
        "sim": "checks.traffic.sim",
        "monitor": "checks.traffic.monitor",
        "faults": "checks.traffic.faults",
        "fuzz": "checks.files.fuzz",
        "repair": "checks.changes.repair",
        "reuse": "checks.changes.reuse",
        "metamorphic": "checks.changes.metamorphic",
        "store": "checks.studies.store",
        "kill": "checks.studies.kill",
        "oserrors": "checks.studies.oserrors",
        "mutants": "checks.process.mutants",
        "swarm": "checks.paths.swarm",
        "fleets": "checks.fleets.fleets",
        "determinism": "checks.process.determinism",
        "sampling": "checks.plans.sampling",
        "map-models": "checks.plans.map_models",
        "photos": "checks.plans.photos",
        "uncertain": "checks.plans.uncertain",
        "sensing": "checks.plans.sensing",
        "scen": "checks.paths.scen",
        "referee": "checks.paths.referee",
        "deadline": "checks.process.deadline",
        "maps": "checks.files.maps",
        "flake": "checks.process.flake",
    }
)
"""Module of this package that holds ``CHECK``, by the check's name; in the order in which they are run."""

NAMES: tuple[str, ...] = tuple(MODULES)
"""Names of the checks."""


def check(name: str) -> Check:
    """The check of that name.

    Raises
    ------
    UsageError : there is none.
    """
    if name not in NAMES:
        raise UsageError(
            "CHECK",
            f"no check is called {name!r}",
            allowed=", ".join(NAMES),
            todo=did_you_mean(name, NAMES),
        )
    found: Check = import_module(f"lampyris_selfcheck.{MODULES[name]}").CHECK
    return found

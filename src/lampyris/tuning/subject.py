"""What is tuned: a planner of a study, or one of its speed laws behind one of its planners."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from lampyris._core.settings import Setting, settings_of
from lampyris.errors import UsageError, did_you_mean
from lampyris.motion.laws import registry as laws
from lampyris.motion.laws.physical import RULES, PhysicalLaw
from lampyris.planning import registry
from lampyris.study.design.config import law_config, planner_config
from lampyris.study.design.study import Config, Study, World


@dataclass(frozen=True, slots=True)
class Subject:
    """What is tuned.

    Parameters
    ----------
    kind : ``planner`` or ``law``.
    config : its settings in the study.
    planner : whose paths are driven; of a planner that is tuned itself None.
    """

    kind: str
    config: Config
    planner: Config | None = None

    @property
    def declared(self) -> dict[str, Setting]:
        """Declarations of its settings; those of a law's rules by dotted names."""
        if self.kind == "planner":
            return dict(settings_of(registry.planner_class(self.config.name)))
        row = laws.named(self.config.name)
        made = dict(settings_of(type(row.settings)))
        if isinstance(row.settings, PhysicalLaw):
            for rule, kind in RULES.items():
                made |= {f"{rule}.{name}": one for name, one in settings_of(kind).items()}
        return made

    @property
    def free(self) -> dict[str, Setting]:
        """Those that vary if no range is stated: not ``seeded`` of a planner, nor flags of a law, which switch caps off."""
        if self.kind == "planner":
            return {name: one for name, one in self.declared.items() if name != "seeded"}
        return {name: one for name, one in self.declared.items() if one.kind != "flag"}

    def changed(self, settings: Mapping[str, Any]) -> Config:
        """The same planner or law with some settings changed."""
        full = {**self.config.settings, **settings}
        if self.kind == "planner":
            return replace(
                planner_config(self.config.name, full, ""), label="tuned", sensor=self.config.sensor
            )
        on = {name.partition(".")[0] for name in settings if "." in name}
        full = {name: value for name, value in full.items() if name not in on}  # a rule with settings is on
        return replace(law_config(self.config.name, full, ""), label="tuned")

    def study_on(self, study: Study, worlds: Sequence[World], config: Config) -> Study:
        """The same study with ``config`` in place of this, on some of its queries."""
        if self.planner is None:
            return replace(study, worlds=tuple(worlds), planners=(config,), memory=False)
        return replace(study, worlds=tuple(worlds), planners=(self.planner,), laws=(config,), memory=False)


def subject_of(study: Study, planner: str | None = None, law: str | None = None) -> Subject:
    """What is tuned of a study.

    Parameters
    ----------
    study : of one robot.
    planner : what the study calls it; None: its only one.
    law : what the study calls it; None: the planner is tuned.

    Raises
    ------
    UsageError : ``PLANNER``, ``LAW``: the study has none of that name, or several and none is named.
    """
    chosen = _called(study.planners, planner, "planner")
    if law is None:
        return Subject("planner", chosen)
    return Subject("law", _called(study.laws, law, "law"), chosen)


def _called(configs: Sequence[Config], called: str | None, kind: str) -> Config:
    if called is None and len(configs) == 1:
        return configs[0]
    known = {one.called: one for one in configs}
    if called is None or called not in known:
        what = f"{len(known)} {kind}s" if called is None else f"no {kind} {called!r}"
        raise UsageError(
            kind.upper(), f"the study has {what}", where=kind, allowed=f"one of {', '.join(known)}",
            todo=did_you_mean(called, known),
        )  # fmt: skip
    return known[called]

"""What uncertain settings of the robot, the planner and the speed law do to a planned drive."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from lampyris import api
from lampyris._core import defaults
from lampyris._core.defaults import OUTCOME, OUTCOMES, PLANNER, PROFILE_SMOOTH, Smooth
from lampyris._core.scalars import is_word
from lampyris.errors import InputError, SettingError, UsageError, of_kind, shown
from lampyris.model.plan import Plan
from lampyris.model.scene import Scene
from lampyris.model.traffic import ObstacleSpec
from lampyris.motion.laws import registry as laws
from lampyris.uncertainty import expansion
from lampyris.uncertainty.energy import EnergyModel, energy_of, energy_of_drive, length_of_drive
from lampyris.uncertainty.inputs import Input, Normal, Uniform, parse_input
from lampyris.uncertainty.outcome import UncertainOutcome
from lampyris.uncertainty.varied import Run, full_names

STEPS = ("arrived", "ticks", "collisions", "replans")


@dataclass(frozen=True, slots=True)
class Propagation:
    """The outcome of uncertain settings beside that of the settings as they are.

    Parameters
    ----------
    nominal : the outcome at the settings as they are.
    outcome : its distribution; None: there is no path at the settings as they are.
    plan : the plan at the settings as they are.
    vary : the distributions, by name as given.
    """

    nominal: float | None
    outcome: UncertainOutcome | None
    plan: Plan
    vary: Mapping[str, Input]


def propagate_uncertainty(
    scene: Scene,
    vary: Mapping[str, Input | str | tuple[float, float]],
    *,
    of: str = OUTCOME,
    planner: str = PLANNER,
    planner_settings: Mapping[str, Any] | None = None,
    law: str = "physical",
    law_settings: Mapping[str, Any] | None = None,
    smooth: Smooth = PROFILE_SMOOTH,
    energy: EnergyModel | None = None,
    traffic: ObstacleSpec | Sequence[ObstacleSpec] | None = None,
    obstacle_speed: float | None = None,
    tolerance: float = defaults.UNCERTAINTY_TOLERANCE,
    runs: int = defaults.EXPANSION_RUNS,
    method: str = defaults.UNCERTAINTY_METHOD,
    monte_carlo_runs: int = defaults.MONTE_CARLO_RUNS,
    held_out: int = defaults.HELD_OUT_RUNS,
    seed: int = 0,
    progress: Callable[[int, int], None] | None = None,
    workers: int = 1,
) -> UncertainOutcome:
    """The distribution of a planned drive's duration, length or energy under uncertain settings.

    Each run plans a path again and computes its speed profile, with the values that the settings have in that run;
    nothing moves but the robot. With ``traffic`` each run is a drive among moving obstacles instead, the same in all runs
    (as drawn from ``seed``). docs/uncertainty.md has the method.

    Parameters
    ----------
    scene : what to plan in.
    vary : by name a :class:`lampyris.uncertainty.Uniform` or :class:`lampyris.uncertainty.Normal`, a pair (low, high), or
        text such as ``0.8:1.2`` or ``normal(0.15,0.02)``. Names are settings of the robot (``v_max``), the planner, the
        law (``creep``, ``blind.reach``) or the energy model (``rolling``); ``robot.``, ``planner.``, ``law.`` or ``energy.``
        before a name says whose it is.
    of : ``duration`` (s), ``length`` (m) or ``energy`` (J/kg, see :class:`lampyris.uncertainty.energy.EnergyModel`).
    planner, planner_settings : how the path is planned.
    law, law_settings, smooth : how fast it is driven, as for :func:`lampyris.speed_profile`; a law in SI units.
    energy : the energy model.
    traffic : what moves, as for :func:`lampyris.drive`; None: nothing does. ``smooth`` is then the drive's own.
    obstacle_speed : m/s of their steps; None: the robot's top speed as it is set, also where that varies.
    tolerance, runs, method, monte_carlo_runs, held_out, seed, progress, workers : as for
        :func:`lampyris.uncertainty.expand`; ``seed`` is the planner's, too.

    Raises
    ------
    UsageError : ``VARY``: no such setting; ``OF``: an outcome that changes in steps; ``LAW``.
    SettingError : ``VARY``: a range that leaves what the setting may be; ``UNCERTAIN_OUTCOME``: no path in a run, or a drive
        that does not arrive; and as
        :func:`lampyris.uncertainty.expand`.

    Examples
    --------
    >>> import lampyris
    >>> scene = lampyris.Scene(lampyris.load_grid("env-3"), (1, 1), (47, 47), robot=lampyris.Robot(radius=0.15))
    >>> made = lampyris.propagate_uncertainty(scene, {"v_max": "0.8:1.2", "radius": "normal(0.15,0.02)"}, planner="astar")
    >>> made.method, max(made.sobol, key=lambda name: made.sobol[name].total)
    ('polynomial-chaos', 'v_max')
    """
    made = propagate(
        scene, vary, of=of, planner=planner, planner_settings=planner_settings, law=law, law_settings=law_settings,
        smooth=smooth, energy=energy, traffic=traffic, obstacle_speed=obstacle_speed, tolerance=tolerance, runs=runs,
        method=method, monte_carlo_runs=monte_carlo_runs, held_out=held_out, seed=seed, progress=progress,
        workers=workers,
    )  # fmt: skip
    if made.outcome is None:
        raise SettingError(
            "UNCERTAIN_OUTCOME", made.plan.sentence, where="scene", allowed="a scene with a path"
        )
    return made.outcome


def propagate(
    scene: Scene,
    vary: Mapping[str, Any],
    *,
    of: str,
    planner: str,
    planner_settings: Mapping[str, Any] | None,
    law: str,
    law_settings: Mapping[str, Any] | None,
    smooth: Smooth,
    energy: EnergyModel | None,
    seed: int,
    traffic: ObstacleSpec | Sequence[ObstacleSpec] | None = None,
    obstacle_speed: float | None = None,
    **how: Any,
) -> Propagation:
    """The same, with the outcome at the settings as they are; see :func:`propagate_uncertainty`."""
    of_kind("scene", scene, Scene)
    of_kind("vary", vary, Mapping)
    of_kind("planner", planner, str)
    of_kind("planner_settings", planner_settings, Mapping, none=True)
    of_kind("law_settings", law_settings, Mapping, none=True)
    of_kind("law", law, str)
    if not is_word(of, tuple(OUTCOMES)):
        todo = "an outcome that changes in steps has no expansion" if is_word(of, STEPS) else ""
        raise UsageError("OF", shown(of), where="of", allowed=", ".join(OUTCOMES), todo=todo)
    model = EnergyModel() if energy is None else energy
    of_kind("energy", model, EnergyModel)
    moving = None if traffic is None else (traffic,) if not isinstance(traffic, Sequence) else tuple(traffic)
    run = Run(
        scene, planner, dict(planner_settings or {}), law, dict(law_settings or {}), model, moving,
        scene.robot.v_max if obstacle_speed is None else obstacle_speed,
    )  # fmt: skip
    if laws.named(law).units != "m/s":
        known = ", ".join(name for name in laws.names() if laws.named(name).units == "m/s")
        raise UsageError("LAW", f"the law {law} has no metres and seconds", where="law", allowed=known)
    inputs = {str(name): _input(str(name), one) for name, one in vary.items()}
    names = full_names(run, inputs)
    plan, nominal = _evaluated(run, of, smooth, seed)
    if nominal is None:
        return Propagation(None, None, plan, inputs)

    outcome = _Outcome(run, names, of, smooth, seed)
    made = expansion.expand(outcome, inputs, of=of, unit=OUTCOMES[of], seed=seed, **how)
    return Propagation(nominal, made, plan, inputs)


@dataclass(frozen=True)
class _Outcome:
    """The outcome of a run as a function of the values that vary; it can be sent to other processes."""

    run: Run
    names: Mapping[str, str]
    of: str
    smooth: Smooth
    seed: int

    def __call__(self, values: dict[str, float]) -> float:
        full = {self.names[name]: value for name, value in values.items()}
        at = ", ".join(f"{name}={value:.6g}" for name, value in values.items())
        try:
            found, value = _evaluated(self.run.with_values(full), self.of, self.smooth, self.seed)
        except InputError as problem:
            problem.add_note(f"in the run with {at}")
            raise
        if value is None:
            raise SettingError(
                "UNCERTAIN_OUTCOME",
                f"no path in the run with {at}: {found.sentence.rstrip('.')}",
                where="vary",
                allowed="ranges in which there is always a path",
            )
        return value


def _input(name: str, given: Any) -> Input:
    if isinstance(given, Uniform | Normal):
        return given
    if isinstance(given, str):
        return parse_input(given, name)
    if isinstance(given, tuple | list) and len(given) == 2:
        return Uniform(*given)
    raise SettingError(
        "UNCERTAIN_INPUT",
        shown(given),
        where=f"vary.{name}",
        allowed="a distribution, a pair (low, high) or text",
    )


def _evaluated(run: Run, of: str, smooth: Smooth, seed: int) -> tuple[Plan, float | None]:
    """The plan, and the outcome of driving it; None: there is no path."""
    settings = dict(run.planner_settings)
    plan = api.plan(run.scene, run.planner, seed=seed, record=False, planner_settings=settings)
    if plan.path is None:
        return plan, None
    if run.traffic is not None:
        return plan, _driven(run, of, seed)
    profile = api.speed_profile(
        run.scene, plan, run.law, smooth=smooth, law_settings=run.law_settings or None
    )
    if of == "duration":
        return plan, float(profile.duration)
    if of == "length":
        return plan, float(profile.s[-1])
    return plan, energy_of(profile, run.scene.robot, run.energy)


def _driven(run: Run, of: str, seed: int) -> float:
    """The outcome of a drive among moving obstacles."""
    drive = api.drive(
        run.scene, run.planner, traffic=run.traffic, seed=seed, law=laws.with_settings(run.law, run.law_settings),
        planner_settings=dict(run.planner_settings), obstacle_speed=run.obstacle_speed,
    )  # fmt: skip
    if not drive.arrived:
        raise SettingError(
            "UNCERTAIN_OUTCOME", drive.sentence.rstrip("."), where="traffic", allowed="drives that arrive"
        )
    if of == "duration":
        return drive.duration
    return length_of_drive(drive) if of == "length" else energy_of_drive(drive, run.energy)

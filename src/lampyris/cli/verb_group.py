"""The group of all verbs: each is imported and built when it is asked for.

A call needs one verb. Importing and building the others took a fifth of the time of a small plan; importing all
for the table of ``--help``, a sixth of its time.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping
from pkgutil import resolve_name
from typing import Any

import typer
import typer.main
from typer.core import TyperCommand, TyperGroup
from typer.models import CommandInfo, TyperInfo

from lampyris.cli import installed_verbs
from lampyris.cli.option_errors import Command
from lampyris.errors import InputError

VERBS: Mapping[str, tuple[str, str]] = {
    "plan": ("plan:plan", "Plan a path with a speed at each cell."),
    "simulate": (
        "simulate:simulate",
        "Simulate a run among moving obstacles, cell by cell and tick by tick.",
    ),
    "run": ("run:run", "Plan, simulate or drive the scenario in a file, of one robot or of a fleet."),
    "schema": ("schema:schema", "Print the JSON Schema of scenario files."),
    "planners": (
        "planners:planners",
        "List the planners: what each does and guarantees, and its source. With NAME: its settings and their meaning.",
    ),
    "primitives": (
        "primitives:primitives",
        "Write the motion primitives of the planner `lattice` for a robot; or show, check and convert a file of them.",
    ),
    "movingai": (
        "movingai:movingai",
        "Run every query of a MovingAI .scen file and compare with the published lengths.",
    ),
    "fleet": ("fleet:fleet", "Plan paths for many robots that never collide."),
    "swarm": (
        "swarm.command:swarm",
        "Simulate robots that search for sources of a signal (glowworm swarm optimisation).",
    ),
    "chain": (
        "chain.command:chain",
        "Plan the joints of a planar chain of links, such as a robot arm seen from above, among obstacles.",
    ),
    "speed": ("speed:speed", "Compute how fast to drive a path, and why; compare speed laws on it."),
    "laws": ("laws:laws", "List the speed laws: what each does, and its source. With NAME: its settings."),
    "uncertain": (
        "uncertain.command:uncertain",
        "Compute the distribution of the time, length or energy of a drive under uncertain settings, and the share of each.",
    ),
    "drive": (
        "drive.command:drive",
        "Simulate a run among moving obstacles in continuous time, with bounded accelerations.",
    ),
    "compare": (
        "compare.command:compare",
        "Compare planners and speed laws in the same world: one table, one picture.",
    ),
    "reproduce": (
        "reproduce:reproduce",
        "Recompute the dissertation's printed figures and report which ones reproduce.",
    ),
    "app": ("app:app", "Open the app: draw, plan, watch and compare in the browser."),
    "warm": (
        "warm:warm",
        "Compile the kernels that large maps need, once per machine, and print where they are cached.",
    ),
    "maps": (
        "maps.command:app",
        "List the bundled maps, show a map, make new ones, convert files, make maps from photographs.",
    ),
    "bag": (
        "ros.bag:bag",
        "List the topics of a ROS 2 bag, or extract a map, a path, tracks of obstacles and poses of the robot.",
    ),
    "ros": (
        "ros.node:ros",
        "Run a ROS 2 node: /map, /odom and /goal_pose in; /plan, /cmd_vel and the speed profile with its causes out.",
    ),
    "study": (
        "study.commands:app",
        (
            "Run a study: maps x queries x planners x speed laws x traffic x seeds, in one store; "
            "an interrupted study can be resumed."
        ),
    ),
    "tune": (
        "tune:tune",
        "Tune a planner or a speed law on the queries of a study by Optuna, and report on queries that were held out.",
    ),
}
"""Module of ``lampyris.cli.verbs`` with the function or the Typer in it, and what the verb does, by verb, in the order of
``--help``. The help of a verb is its function's own, which begins with these words."""


class VerbGroup(TyperGroup):
    """The verbs of this package, and those of other packages after them."""

    def __init__(self, **settings: Any) -> None:
        super().__init__(**settings)
        self.commands: Any = _Verbs(self.rich_markup_mode)

    def list_commands(self, ctx: Any) -> list[str]:
        """Names in the order of ``--help``; of a verb that cannot be used a note says why."""
        usable = []
        for name in installed_verbs.names():
            try:
                if name not in VERBS and installed_verbs.command(name):
                    usable.append(name)
            except InputError as problem:
                print(f"note: {problem}", file=sys.stderr)
        return [*VERBS, *usable]

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """The verb of that name; None if there is none.

        Raises
        ------
        UsageError : ``VERB_MISSING``: it is in a package that is not installed.
        InputError : ``VERB_BROKEN``: its package cannot be imported.
        """
        return self.commands.get(cmd_name) or installed_verbs.command(cmd_name)

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write names and summaries; the options of the verbs are not built for that."""
        names = self.list_commands(ctx)
        commands = {
            name: TyperCommand(name, help=VERBS[name][1]) if name in VERBS else self.get_command(ctx, name)
            for name in names
        }
        TyperGroup(name=self.name, commands=commands).format_commands(ctx, formatter)


class _Verbs(Mapping[str, Any]):
    """The verbs of this package by name, built when they are read."""

    def __init__(self, rich_markup_mode: Any) -> None:
        self._markup = rich_markup_mode
        self._built: dict[str, Any] = {}

    def __getitem__(self, name: str) -> Any:
        if name not in self._built:
            self._built[name] = self._build(name)
        return self._built[name]

    def __iter__(self) -> Iterator[str]:
        return iter(VERBS)

    def __len__(self) -> int:
        return len(VERBS)

    def __contains__(self, name: object) -> bool:
        return name in VERBS

    def _build(self, name: str) -> Any:
        verb = _verb(name)  # what is no verb of this package ends here
        # Settings and their groups, which the table of --help does without.
        from lampyris.cli.option_groups import with_groups

        if isinstance(verb, typer.Typer):
            return typer.main.get_group_from_info(
                TyperInfo(verb, name=name),
                pretty_exceptions_short=True,
                suggest_commands=True,
                rich_markup_mode=self._markup,
            )
        info = CommandInfo(name=name, cls=Command, callback=with_groups(verb))
        return typer.main.get_command_from_info(
            info, pretty_exceptions_short=True, rich_markup_mode=self._markup
        )


def _verb(name: str) -> Any:
    """The function of a verb, or its Typer."""
    return resolve_name(f"lampyris.cli.verbs.{VERBS[name][0]}")

"""Several robots on one map, all at once: PettingZoo's parallel form."""

from __future__ import annotations

from importlib.util import find_spec
from typing import Any

from lampyris._core.scalars import is_whole
from lampyris.errors import SettingError, UsageError, shown

MAX_ROBOTS = 1000
"""Most robots of the parallel form."""


def parallel_env(robots: int = 4, **settings: Any) -> Any:
    """Several robots from cell to cell on one map, as a ``pettingzoo.ParallelEnv``.

    Each robot has the actions, observations and rewards of :class:`lampyris.rl.GridNavEnv`, and sees the others in its patch
    as blocked cells. All move at once. A robot stays where it is if its step is not legal, if another robot wants the same
    cell, stays there, or wants to change places with it; on the way it keeps from diagonals that cross another's. Who
    has arrived leaves the map. The regret is against the robot's own optimum, as if it were alone.

    Parameters
    ----------
    robots : how many.
    settings : as for :class:`lampyris.rl.GridNavEnv`; ``max_episode_steps`` is 500 unless given.

    Raises
    ------
    UsageError : ``RL``: pettingzoo is not installed.
    LampyrisError : a wrong argument.
    """
    if find_spec("pettingzoo") is None:
        raise UsageError("RL", "pettingzoo is not installed", todo="pip install 'lampyris[rl]'")
    if not is_whole(robots) or not 1 <= robots <= MAX_ROBOTS:
        allowed = f"a whole number from 1 to {MAX_ROBOTS:,}"
        raise SettingError("EPISODE_SETTING", shown(robots), where="robots", allowed=allowed)
    from lampyris.rl.parallel import ParallelGridNav

    return ParallelGridNav(int(robots), **settings)

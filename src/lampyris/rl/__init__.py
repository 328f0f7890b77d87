"""Environments for reinforcement learning: gymnasium's single and vector form, PettingZoo's parallel form.

Importing it registers ``lampyris/GridNav-v0`` and ``lampyris/Drive-v0``; so does
``gymnasium.make("lampyris.rl:lampyris/GridNav-v0")``. It needs ``pip install 'lampyris[rl]'``; see docs/rl.md.
"""

from __future__ import annotations

from importlib.util import find_spec

from lampyris.errors import UsageError

if find_spec("gymnasium") is None:
    raise UsageError("RL", "gymnasium is not installed", todo="pip install 'lampyris[rl]'")

import gymnasium

from lampyris.rl.baselines import PlannerPolicy as PlannerPolicy
from lampyris.rl.drives import DriveEnv as DriveEnv
from lampyris.rl.drives import DriveVectorEnv as DriveVectorEnv
from lampyris.rl.grid_nav import GridNavEnv as GridNavEnv
from lampyris.rl.grid_nav import GridNavVectorEnv as GridNavVectorEnv
from lampyris.rl.robots import parallel_env as parallel_env

__all__ = [
    "DriveEnv",
    "DriveVectorEnv",
    "GridNavEnv",
    "GridNavVectorEnv",
    "PlannerPolicy",
    "parallel_env",
]

_ENVIRONMENTS = (("GridNav", "grid_nav", 500), ("Drive", "drives", 1500))
"""Name, module, and steps of an episode."""


def _register() -> None:
    for name, module, steps in _ENVIRONMENTS:
        if f"lampyris/{name}-v0" not in gymnasium.registry:
            gymnasium.register(
                f"lampyris/{name}-v0",
                entry_point=f"lampyris.rl.{module}:{name}Env",
                vector_entry_point=f"lampyris.rl.{module}:{name}VectorEnv",
                max_episode_steps=steps,
            )


_register()

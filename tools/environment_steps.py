"""Measure steps a second of the environments for reinforcement learning on one core, beside gymnax where installed.

    taskset -c 0 python tools/environment_steps.py [--environments 1024]

Random actions, drawn beforehand; CPU time of this process; episodes begin again by themselves. FourRooms of
gymnax runs as its documentation vectorises it: ``jax.vmap`` of the step within one ``jax.lax.scan``, compiled beforehand; its
actions are drawn within the scan.
"""

from __future__ import annotations

import argparse
import importlib.util
import os
import time
from collections.abc import Callable

os.environ.setdefault("XLA_FLAGS", "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1")

import numpy as np

STEPS = 64


def measured(name: str, count: int, run: Callable[[], None]) -> None:
    """Print the best of five turns of half a second or so; ``run`` makes ``STEPS`` steps of each environment."""
    run()
    best = 0.0
    for _ in range(5):
        began, turns = time.process_time(), 0
        while time.process_time() - began < 0.5:
            run()
            turns += 1
        best = max(best, turns * STEPS * count / (time.process_time() - began))
    print(f"{name:44} {best / 1e6:7.2f} million steps/s", flush=True)


def ours(count: int) -> None:
    """The two environments in vector form, through gymnasium's interface."""
    import gymnasium

    import lampyris.rl  # noqa: F401

    for name in ("lampyris/GridNav-v0", "lampyris/Drive-v0"):
        for patch in (5, 7):
            envs = gymnasium.make_vec(name, num_envs=count, map="env-1", patch=patch)
            envs.reset(seed=0)
            rng = np.random.default_rng(0)
            if name.startswith("lampyris/Grid"):
                actions = list(rng.integers(0, 8, (STEPS, count)))
            else:
                actions = list(rng.uniform(-1, 1, (STEPS, count, 2)))

            def run(envs: gymnasium.vector.VectorEnv = envs, actions: list[np.ndarray] = actions) -> None:
                for action in actions:
                    envs.step(action)

            measured(f"{name}, {patch} x {patch} cells, {count}", count, run)


def gymnax_four_rooms(count: int) -> None:
    """FourRooms of gymnax."""
    import gymnax
    import jax

    env, params = gymnax.make("FourRooms-misc")
    keys = jax.random.split(jax.random.PRNGKey(0), count)
    _, state = jax.vmap(env.reset, in_axes=(0, None))(keys, params)

    @jax.jit
    def turn(state: object, key: object) -> tuple[object, object]:
        def step(carry: tuple, _: object) -> tuple:
            state, key = carry
            key, own, drawn = jax.random.split(key, 3)
            action = jax.random.randint(drawn, (count,), 0, 4)
            answer = jax.vmap(env.step, in_axes=(0, 0, 0, None))(
                jax.random.split(own, count), state, action, params
            )
            return (answer[1], key), answer[2].sum()

        (state, key), total = jax.lax.scan(step, (state, key), None, STEPS)
        return state, key, total

    held = [state, jax.random.PRNGKey(1)]

    def run() -> None:
        *held[:], total = turn(*held)
        total.block_until_ready()

    measured(f"gymnax FourRooms-misc, {count}", count, run)


def main() -> None:
    """Measure what is installed."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--environments", type=int, default=1024)
    count = parser.parse_args().environments
    ours(count)
    if importlib.util.find_spec("gymnax") is None:
        print("gymnax is not installed")
    else:
        gymnax_four_rooms(count)


if __name__ == "__main__":
    main()

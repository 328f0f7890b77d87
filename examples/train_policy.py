"""Train a small policy in lampyris/GridNav-v0 with NumPy alone, and hold it against a baseline on goals it never saw.

    pip install 'lampyris[rl]'
    python examples/train_policy.py

The shaped reward of an action is minus the regret that it adds, so a policy that takes the action of the greatest
expected reward needs no returns: one hidden layer is fitted to the rewards of random actions (a contextual bandit). It sees
7 x 7 cells and the direction of the goal. The baseline goes straight for the goal: of the steps that the patch allows, the
one whose direction is nearest. Both take a random action one time in ten, so that neither is caught in a dead end for good.
"""

from __future__ import annotations

from collections.abc import Callable

import gymnasium
import numpy as np

import lampyris.rl  # noqa: F401  registers the environments
from lampyris.model.moves import MOVES

PATCH, HIDDEN, ACTIONS = 7, 128, 8
OFFSETS = np.array(MOVES["octile"].offsets)
EAST_NORTH = OFFSETS * [1, -1] / np.sqrt((OFFSETS**2).sum(axis=1))[:, None]


def environments(count: int, task_seed: int, steps: int = 300) -> gymnasium.vector.VectorEnv:
    """So many episodes on env-1, to 64 goals that are drawn with the seed."""
    return gymnasium.make_vec(
        "lampyris/GridNav-v0",
        num_envs=count,
        map="env-1",
        goals=64,
        task_seed=task_seed,
        patch=PATCH,
        max_episode_steps=steps,
    )


def features(seen: np.ndarray) -> np.ndarray:
    """The patch, and the direction of the goal in 16 sectors, soft."""
    angle = np.arctan2(seen[:, -3], seen[:, -4])[:, None]
    sectors = np.exp(4.0 * (np.cos(angle - np.arange(16) * np.pi / 8) - 1.0))
    return np.hstack((seen[:, :-4], sectors, np.ones((len(seen), 1)))).astype(np.float32)


class Network:
    """Expected reward of each action: one hidden layer, fitted by Adam."""

    def __init__(self, inputs: int, rng: np.random.Generator) -> None:
        self.weights = [
            rng.normal(0, 1 / np.sqrt(n), (n, m)).astype(np.float32)
            for n, m in ((inputs, HIDDEN), (HIDDEN, ACTIONS))
        ]
        self.first = [np.zeros_like(w) for w in self.weights]
        self.second = [np.zeros_like(w) for w in self.weights]
        self.count = 0

    def __call__(self, x: np.ndarray) -> np.ndarray:
        """Expected rewards, (n, 8)."""
        return np.maximum(x @ self.weights[0], 0) @ self.weights[1]

    def fit(self, x: np.ndarray, action: np.ndarray, reward: np.ndarray, rate: float) -> None:
        """One step down the squared error of the actions taken."""
        hidden = np.maximum(x @ self.weights[0], 0)
        rows = np.arange(len(x))
        error = np.zeros((len(x), ACTIONS), dtype=np.float32)
        error[rows, action] = ((hidden @ self.weights[1])[rows, action] - reward) / len(x)
        slopes = [x.T @ ((error @ self.weights[1].T) * (hidden > 0)), hidden.T @ error]
        self.count += 1
        for w, slope, first, second in zip(self.weights, slopes, self.first, self.second, strict=True):
            first += 0.1 * (slope - first)
            second += 0.001 * (slope * slope - second)
            scale = np.sqrt(1 - 0.999**self.count) / (1 - 0.9**self.count)
            w -= rate * scale * first / (np.sqrt(second) + 1e-8)


def straight(seen: np.ndarray) -> np.ndarray:
    """The baseline: the step nearest to the direction of the goal that the patch allows."""
    patch = seen[:, :-4].reshape(-1, PATCH, PATCH) == 0
    middle = PATCH // 2
    scores = seen[:, -4:-2] @ EAST_NORTH.T
    for k, (dx, dy) in enumerate(OFFSETS):
        free = (
            patch[:, middle + dy, middle + dx] & patch[:, middle, middle + dx] & patch[:, middle + dy, middle]
        )
        scores[~free, k] = -9.0
    best: np.ndarray = scores.argmax(axis=1)
    return best


def trial(act: Callable[[np.ndarray], np.ndarray], rng: np.random.Generator) -> tuple[float, float]:
    """Share of 2,000 episodes to new goals that arrive within 300 steps, and their mean regret in cells."""
    envs = environments(2000, task_seed=1)
    seen, _ = envs.reset(seed=7)
    arrived, regret = np.zeros(2000, dtype=bool), np.full(2000, np.nan)
    for _ in range(300):
        action = np.where(rng.random(2000) < 0.1, rng.integers(ACTIONS, size=2000), act(seen))
        seen, _, ended, late, info = envs.step(action)
        new = np.isnan(regret) & (ended | late)
        arrived |= new & ended
        regret[new] = info["regret"][new] if new.any() else 0.0
    return float(arrived.mean()), float(regret.mean())


def main(updates: int = 6000) -> tuple[tuple[float, float], tuple[float, float]]:
    """Train, and try both."""
    rng = np.random.default_rng(0)
    envs = environments(512, task_seed=0, steps=20)
    seen, _ = envs.reset(seed=0)
    x = features(seen)
    network = Network(x.shape[1], rng)
    over = np.zeros(512, dtype=bool)
    for update in range(updates):
        action = np.where(rng.random(512) < 0.5, rng.integers(ACTIONS, size=512), network(x).argmax(axis=1))
        seen, reward, ended, late, _ = envs.step(action)
        network.fit(x[~over], action[~over], reward[~over].astype(np.float32), 2e-3 * (1 - update / updates))
        x, over = features(seen), ended | late
    policy = trial(lambda seen: network(features(seen)).argmax(axis=1), np.random.default_rng(1))
    baseline = trial(straight, np.random.default_rng(1))
    for name, (share, regret) in (("policy", policy), ("straight to the goal", baseline)):
        print(f"{name}: {share:.1%} of 2000 episodes arrive, mean regret {regret:.1f} cells")
    return policy, baseline


if __name__ == "__main__":
    main()

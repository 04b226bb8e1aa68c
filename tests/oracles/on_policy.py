"""Episodes of unequal length, and what is made of them in plain NumPy, from the definitions."""

import jax
import jax.numpy as jnp
import numpy as np

from skillcrew.learners.on_policy.experience import Experience
from skillcrew.learners.on_policy.networks import Players
from skillcrew.policies.stochastic import Options

TIME, WORLDS, AGENTS, OBSERVATION, CHOICES = 7, 6, 3, 5, 4
LENGTHS = (7, 3, 1, 6, 7, 4)
TERMINATED = (True, False, True, False, False, True)
"""The others are cut off by time, one of them at the last step."""
PADDING = 1000.0
"""What stands everywhere after an episode's end."""

CHOOSERS = Players(AGENTS, OBSERVATION, Options(CHOICES))
MOVERS = Players(AGENTS, OBSERVATION, Options(2, continuous=True))


def lived(seed: int, players: Players = CHOOSERS, padding: float = PADDING) -> Experience:
    """Random episodes; some agents are bound to an earlier choice now and then."""
    draw = np.random.default_rng(seed)
    mask = np.arange(TIME)[:, None] < np.array(LENGTHS)[None]
    observation = draw.normal(size=(TIME + 1, WORLDS, AGENTS, OBSERVATION)).astype(np.float32)
    reward = draw.normal(size=(TIME, WORLDS, AGENTS)).astype(np.float32)
    ends = np.array(TERMINATED)[None] & (np.arange(TIME)[:, None] == np.array(LENGTHS)[None] - 1)
    decides = draw.random((TIME, WORLDS, AGENTS)) < 0.7
    if players.options.continuous:
        taken = np.tanh(draw.normal(size=(TIME, WORLDS, AGENTS, players.options.size))).astype(np.float32)
    else:
        taken = draw.integers(players.options.size, size=(TIME, WORLDS, AGENTS)).astype(np.int32)
    after = ~mask
    following = observation[1:].copy()
    for values in (observation[:-1], following, reward):
        values[after] = padding
    return created(observation[:-1], following, taken, reward, ends | after, mask, decides | after[..., None])


created = jax.jit(Experience.create)
"""As one program: each operation by itself would be another, in every file of tests."""


def values(seed: int) -> np.ndarray:
    """Of every step and the one after the last, padding too."""
    return np.random.default_rng(seed).normal(size=(TIME + 1, WORLDS, AGENTS)).astype(np.float32)


def advantages(experience: Experience, value: np.ndarray, discount: float, trace: float) -> np.ndarray:
    """The sum over l of (γ λ)^l δ_{t+l}, to the end of each episode."""
    reward, result = np.asarray(experience.reward), np.zeros((TIME, WORLDS, AGENTS))
    for world, length in enumerate(LENGTHS):
        for agent in range(AGENTS):
            deltas = [
                reward[t, world, agent] + discount * _after(value, world, agent, t) - value[t, world, agent]
                for t in range(length)
            ]
            for t in range(length):
                weights = (discount * trace) ** np.arange(length - t)
                result[t, world, agent] = (weights * deltas[t:]).sum()
    return result


def lambda_returns(experience: Experience, value: np.ndarray, discount: float, trace: float) -> np.ndarray:
    """(1 - λ) Σ λ^(n-1) G^(n), the last n with all the weight that is left."""
    reward, result = np.asarray(experience.reward), np.zeros((TIME, WORLDS, AGENTS))
    for world, length in enumerate(LENGTHS):
        for agent in range(AGENTS):
            for t in range(length):
                left = length - t
                for n in range(1, left + 1):
                    paid = sum(discount**k * reward[t + k, world, agent] for k in range(n))
                    paid += discount**n * _after(value, world, agent, t + n - 1)
                    share = trace ** (left - 1) if n == left else (1 - trace) * trace ** (n - 1)
                    result[t, world, agent] += share * paid
    return result


def _after(value: np.ndarray, world: int, agent: int, t: int) -> float:
    """What is expected after a step: nothing after the end of the task, something after a time limit."""
    if t == LENGTHS[world] - 1 and TERMINATED[world]:
        return 0.0
    return value[t + 1, world, agent]


def largest(tree) -> float:
    """The largest number of a tree of arrays."""
    return max(float(jnp.abs(leaf).max()) for leaf in jax.tree.leaves(tree))

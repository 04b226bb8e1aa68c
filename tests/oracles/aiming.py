"""A task whose best actions are known: each agent has a target that its observation does not tell."""

import jax.numpy as jnp

from skillcrew.envs.environment import Environment, TimeStep

TARGETS = (-0.6, 0.1, 0.7)
COMMON = 0.4
AGENTS = len(TARGETS)


class Aiming(Environment):
    """Rewards are minus the square of how far an action is from its target; two steps and it is over."""

    name = "aiming"
    n_agents, observation_size, action_size, episode_length = AGENTS, 4, 1, 2
    skills = ("own", "common")

    def reset(self, key):
        del key
        state = jnp.full((AGENTS, 4), 0.5)
        return state, state

    def step(self, state, action, key):
        del key
        own = -((action[:, 0] - jnp.array(TARGETS)) ** 2)
        common = -((action[:, 0] - COMMON) ** 2)
        # The state is the first observation; the second tells that the episode is over.
        done = (state[0, 0] < 0).astype(bool)
        after = -jnp.ones_like(state)
        step = TimeStep(after, jnp.stack([own, common], axis=1), own.mean(), done, ~done & False)
        return after, step

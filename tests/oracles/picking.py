"""Agents that are alike and pick one of several actions; which is right, each sees."""

import jax
import jax.numpy as jnp

from skillcrew.envs.environment import Environment, TimeStep

AGENTS, CHOICES, LENGTH = 3, 4, 12


class Picking(Environment):
    """The team reward, at each step: the share of agents that picked what they were shown."""

    n_agents, observation_size, action_size, episode_length = AGENTS, CHOICES, CHOICES, LENGTH
    actions = "discrete"
    skills = ("follow", "next")

    def reset(self, key):
        wanted = jax.random.randint(key, (AGENTS,), 0, CHOICES)
        return {"wanted": wanted, "time": jnp.zeros((), jnp.int32)}, jax.nn.one_hot(wanted, CHOICES)

    def step(self, state, action, key):
        followed = (action == state["wanted"]).astype(jnp.float32)
        following = (action == (state["wanted"] + 1) % CHOICES).astype(jnp.float32)
        wanted = jax.random.randint(key, (AGENTS,), 0, CHOICES)
        time = state["time"] + 1
        step = TimeStep(
            observation=jax.nn.one_hot(wanted, CHOICES),
            local_rewards=jnp.stack([followed, following], axis=1),
            team_reward=followed.mean() / LENGTH,
            terminated=jnp.zeros((), bool),
            truncated=time >= LENGTH,
        )
        return {"wanted": wanted, "time": time}, step

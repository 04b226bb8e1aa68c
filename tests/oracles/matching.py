"""Two agents that must agree: one is shown a number; what is right for it depends on what the other does."""

import jax
import jax.numpy as jnp
import numpy as np

from skillcrew.envs.environment import Environment, TimeStep

CHOICES = 3
WORTH = (0.6, 0.5, 1.0)
"""What the team is paid if both match, by what the blind agent picked."""


class Matching(Environment):
    """One step: the seeing agent is to pick what the other picked, less what it is shown, modulo 3."""

    n_agents, observation_size, action_size, episode_length = 2, CHOICES, CHOICES, 1
    actions = "discrete"
    skills = ()

    def reset(self, key):
        shown = jax.random.randint(key, (), 0, CHOICES)
        return {"shown": shown}, self._seen(shown)

    def step(self, state, action, key):
        del key
        matched = action[0] == (action[1] - state["shown"]) % CHOICES
        reward = jnp.where(matched, jnp.array(WORTH)[action[1]], 0.0)
        end = jnp.ones((), bool)
        return state, TimeStep(self._seen(state["shown"]), jnp.zeros((2, 0)), reward, end, ~end)

    def _seen(self, shown):
        return jnp.stack([jax.nn.one_hot(shown, CHOICES), jnp.zeros(CHOICES)])


BLIND = int(np.argmax(WORTH))
BEST = [[(BLIND - shown) % CHOICES, BLIND] for shown in range(CHOICES)]
"""Both agents' best actions, by what is shown."""

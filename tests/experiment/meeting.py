"""A world for tests of runs, of which the world is the least part."""

import jax
import jax.numpy as jnp

from skillcrew.envs.environment import Environment, TimeStep


class Meeting(Environment):
    """Two agents that now and then are at A together within six steps; a fraction of a rover's program."""

    name = "meeting"
    n_agents, observation_size, action_size, episode_length = 2, 2, 2, 6
    skills = ("go_to_a", "go_to_b")
    success = "terminated"

    def reset(self, key):
        position = jax.random.uniform(key, (2, 2), minval=-2.0, maxval=2.0)
        return {"position": position, "time": jnp.zeros((), jnp.int32)}, position

    def step(self, state, action, key):
        del key
        position, time = state["position"] + action, state["time"] + 1
        far = jnp.abs(position).sum(axis=1)
        done = (far < 1.5).all()
        rewards = -jnp.stack([far, jnp.abs(position - 1).sum(axis=1)], axis=1)
        late = (time == self.episode_length) & ~done
        step = TimeStep(position, rewards, done.astype(jnp.float32), done, late)
        return {"position": position, "time": time}, step

"""A task whose best timetables are known, and that nothing but the time tells how to do.

Everybody is to go up for the first steps and down for the last; in between there is one step for turning.
What agents see never changes: who decides by it does the same throughout, and half of the task at most.
"""

import jax.numpy as jnp

from skillcrew.envs.environment import Environment, TimeStep

AGENTS, LENGTH, TURN = 2, 9, 4
UP, DOWN, WAIT = range(3)


class TwoPhases(Environment):
    """The team reward, at the end: the share of the agents' steps that were right."""

    name = "two-phases"
    n_agents, observation_size, action_size, episode_length = AGENTS, 5, 1, LENGTH
    skills = ("up", "down", "wait")

    def reset(self, key):
        del key
        state = {"time": jnp.zeros((), jnp.int32), "right": jnp.zeros(())}
        return state, self._seen()

    def step(self, state, action, key):
        del key
        time, move = state["time"], action[:, 0]
        wanted = jnp.where(time < TURN, move, -move) > 0.5
        right = state["right"] + jnp.where(time == TURN, 0.0, wanted.mean())
        done = time == LENGTH - 1
        local = jnp.stack([move, -move, -jnp.abs(move)], axis=1)
        reward = jnp.where(done, right / (LENGTH - 1), 0.0)
        step = TimeStep(self._seen(), local, reward, done, jnp.zeros((), bool))
        return {"time": time + 1, "right": right}, step

    def _seen(self):
        return jnp.ones((AGENTS, 5))

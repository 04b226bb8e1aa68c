"""Agents that differ in everything, and a task whose best choices are known.

Two scouts and a hauler. In the first half of an episode scouts are to go left and the hauler to lift, in the
second half scouts to go right and the hauler to drop; only the hauler has a third skill, which is never
right. What makes a hauler lift is the *second* number of its action, which scouts have not got.
"""

import jax
import jax.numpy as jnp

from skillcrew.envs.agent_type import AgentType
from skillcrew.envs.environment import Environment, TimeStepByType

SCOUTS, HAULERS, LENGTH = 2, 1, 12
SCOUT = AgentType("scout", SCOUTS, observation_size=3, action_size=1, skills=("left", "right"))
HAULER = AgentType("hauler", HAULERS, observation_size=5, action_size=2, skills=("lift", "wait", "drop"))
SKILLS = ("scout/left", "scout/right", "hauler/lift", "hauler/wait", "hauler/drop")


class Mixed(Environment):
    """The team reward, at the end: the share of the agents' steps that were right."""

    types = (SCOUT, HAULER)
    episode_length = LENGTH

    def reset(self, key):
        return {"time": jnp.zeros((), jnp.int32), "right": jnp.zeros(())}, self._seen(key)

    def step(self, state, action, key):
        along, up = self._moves(action)
        first = state["time"] < LENGTH // 2
        right = jnp.concatenate([jnp.where(first, -along, along), jnp.where(first, up, -up)]) > 0.5
        total = state["right"] + right.astype(jnp.float32).mean()
        done = state["time"] == LENGTH - 1
        step = TimeStepByType(
            observation=self._seen(key),
            local_rewards={
                "scout": jnp.stack([-along, along], axis=1),
                "hauler": jnp.stack([up, -jnp.abs(up), -up], axis=1),
            },
            team_reward=jnp.where(done, total / LENGTH, 0.0),
            terminated=done,
            truncated=jnp.zeros((), bool),
        )
        return {"time": state["time"] + 1, "right": total}, step

    def _moves(self, action):
        return action["scout"][:, 0], action["hauler"][:, 1]

    def _seen(self, key):
        draw = jax.random.uniform(key, (SCOUTS + HAULERS, 5))
        return {"scout": 1 + draw[:SCOUTS, :3], "hauler": 2 + draw[SCOUTS:]}


class MixedDiscrete(Mixed):
    """The same, by picking: scouts one of 2 actions, haulers one of 3."""

    actions = "discrete"
    types = (
        AgentType("scout", SCOUTS, observation_size=3, action_size=2, skills=SCOUT.skills),
        AgentType("hauler", HAULERS, observation_size=5, action_size=3, skills=HAULER.skills),
    )

    def _moves(self, action):
        return jnp.array([-1.0, 1.0])[action["scout"]], jnp.array([1.0, 0.0, -1.0])[action["hauler"]]

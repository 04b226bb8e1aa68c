"""Algorithm 2: all teams, all episodes and all agents of a generation in one scan over time."""

from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int, Key, PyTree

from skillcrew.envs.environment import Environment
from skillcrew.policies.team import Team

Policy = Callable[[Array, PyTree, Array], tuple[Array, PyTree, Array]]


class Trajectories(eqx.Module):
    """What was lived in a batch of worlds, one episode each. Steps after an episode's end are padding."""

    observation: Float[Array, "*time worlds agents obs"]
    """Before the action."""
    action: Float[Array, "*time worlds agents act"]
    next_observation: Float[Array, "*time worlds agents obs"]
    """After the action, of the same episode."""
    local_rewards: Float[Array, "*time worlds agents skills"]
    team_reward: Float[Array, "*time worlds"]
    terminated: Bool[Array, "*time worlds"]
    choice: Int[Array, "*time worlds agents"]
    lived: Bool[Array, "*time worlds"]
    """False for padding."""

    def team_return(self, discount: float = 1.0) -> Float[Array, " worlds"]:
        """The sum of the team reward over each episode, that of step t (from 0) times discount^t."""
        weight = jnp.power(discount, jnp.arange(self.lived.shape[0], dtype=jnp.float32))
        return (jnp.where(self.lived, self.team_reward, 0.0) * weight[:, None]).sum(0)

    def worlds(self, part: slice) -> "Trajectories":
        """Those of some of the worlds."""
        return jax.tree.map(lambda leaf: leaf[:, part], self)

    def steps_lived(self) -> Int[Array, ""]:
        """Environment steps of all worlds, padding not counted."""
        return self.lived.sum(dtype=jnp.int32)


class Start(eqx.Module):
    """Freshly reset worlds, the world axis last."""

    state: Any
    observation: Float[Array, "agents obs worlds"]

    @classmethod
    def draw(cls, env: Environment, key: Key[Array, ""], worlds: int) -> "Start":
        """New worlds, each from its own key."""
        return cls(*env.reset_worlds(jax.random.split(key, worlds)))

    def repeat(self, times: int) -> "Start":
        """The same worlds `times` over, so that every team meets the same start states."""
        return jax.tree.map(lambda leaf: jnp.concatenate([leaf] * times, axis=-1), self)

    def first(self, worlds: int) -> "Start":
        """The first few of the worlds."""
        return jax.tree.map(lambda leaf: leaf[..., :worlds], self)

    def join(self, other: "Start") -> "Start":
        """These worlds, then the others."""
        return jax.tree.map(lambda *leaves: jnp.concatenate(leaves, axis=-1), self, other)


def rollout(
    env: Environment,
    policy: Policy,
    memory: PyTree,
    start: Start,
    key: Key[Array, ""],
    noise: Float[Array, ""] | float = 0.0,
) -> Trajectories:
    """Lives one episode in each world.

    Args:
        policy: from observation [worlds agents obs], memory and one key per world to action
            [worlds agents act], memory and choice [worlds agents].
        memory: the policy's memory at the start, of all worlds.
        start: the worlds.
        noise: standard deviation of Gaussian noise on the primitive action, which is then
            clipped to [-1, 1]. A literal 0 spares drawing it.
    """
    is_noisy = not (isinstance(noise, float) and noise == 0)
    worlds = start.observation.shape[-1]

    def live_one_step(carry, keys):
        state, observation, memory, running = carry
        key_policy, key_noise, key_env = keys
        seen = jnp.moveaxis(observation, -1, 0)
        action, memory, choice = policy(seen, memory, jax.random.split(key_policy, worlds))
        if is_noisy:
            action = jnp.clip(action + noise * jax.random.normal(key_noise, action.shape), -1.0, 1.0)
        state, step = env.step_worlds(state, jnp.moveaxis(action, 0, -1), jax.random.split(key_env, worlds))
        lived = Trajectories(
            observation=seen,
            action=action,
            next_observation=jnp.moveaxis(step.observation, -1, 0),
            local_rewards=jnp.moveaxis(step.local_rewards, -1, 0),
            team_reward=step.team_reward,
            terminated=step.terminated,
            choice=choice,
            lived=running,
        )
        running = running & ~step.terminated & ~step.truncated
        return (state, step.observation, memory, running), lived

    carry = (start.state, start.observation, memory, jnp.ones(worlds, bool))
    return jax.lax.scan(live_one_step, carry, jax.random.split(key, (env.episode_length, 3)))[1]


def stacked_policy(make_team: Callable[[Any], Team], stacked: PyTree, n_teams: int) -> Policy:
    """One policy for the worlds of many teams, which are ordered team by team, equally many each.

    Args:
        make_team: makes a team of one slice of `stacked`; what it closes over is shared by all.
        stacked: what differs between teams; leaves have a leading team axis.
    """

    def act_for_team(part, observation, memory, keys):
        return jax.vmap(make_team(part).act)(observation, memory, keys)

    def policy(observation, memory, keys):
        inputs = (observation, memory, keys)
        by_team = jax.tree.map(lambda leaf: leaf.reshape(n_teams, -1, *leaf.shape[1:]), inputs)
        results = jax.vmap(act_for_team)(stacked, *by_team)
        return jax.tree.map(lambda leaf: leaf.reshape(-1, *leaf.shape[2:]), results)

    return policy


def side_by_side(first: Policy, second: Policy, split: int) -> Policy:
    """One policy for two groups of worlds, the first `split` of them and the rest; memory is a pair."""

    def policy(observation, memory, keys):
        action, left, choice = first(observation[:split], memory[0], keys[:split])
        more_action, right, more_choice = second(observation[split:], memory[1], keys[split:])
        return jnp.concatenate([action, more_action]), (left, right), jnp.concatenate([choice, more_choice])

    return policy


def single_policy(team: Team) -> Policy:
    """The policy of one team in every world."""
    return jax.vmap(team.act)

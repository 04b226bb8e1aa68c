"""Algorithm 2: all teams, all episodes and all agents of a generation in one scan over time."""

import dataclasses
from collections.abc import Callable
from typing import Any, TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int, Key, PyTree

from skillcrew.conditional import run_unless
from skillcrew.envs.environment import Environment
from skillcrew.envs.padded import uniform
from skillcrew.policies.exploration import with_random_ones
from skillcrew.policies.team import Team

Policy = Callable[[Array, PyTree, Array], tuple[Array, PyTree, Array]]


MOST_COUNTED = 2**31 - 1
"""Environment steps that a count of 32 bits holds."""

AnyEpisodes = TypeVar("AnyEpisodes", bound="Episodes")


class Episodes(eqx.Module):
    """How the episodes of a batch of worlds went, one a world. Steps after an episode's end are padding."""

    team_reward: Float[Array, "*time worlds"]
    """NaN from the step on at which an agent has seen a number that is not finite."""
    terminated: Bool[Array, "*time worlds"]
    mask: Bool[Array, "*time worlds"]
    """True for the steps that count: up to an episode's end, and padding after it."""

    def team_return(self, discount: float = 1.0) -> Float[Array, " worlds"]:
        """The sum of the team reward over each episode, that of step t (from 0) times discount^t."""
        weight = jnp.power(discount, jnp.arange(self.mask.shape[0], dtype=jnp.float32))
        return (jnp.where(self.mask, self.team_reward, 0.0) * weight[:, None]).sum(0)

    def completed(self) -> Bool[Array, " worlds"]:
        """Whether each episode ended with the task done, and not for lack of time."""
        return (self.terminated & self.mask).any(0)

    def steps(self) -> Int[Array, ""]:
        """Environment steps of all worlds, padding not counted."""
        return self.mask.sum(dtype=jnp.int32)

    def worlds(self: AnyEpisodes, part: Any) -> AnyEpisodes:
        """Those of some of the worlds: a slice, or their indices."""
        return jax.tree.map(lambda leaf: leaf[:, part], self)


def count_steps(before: Int[Array, ""], *lived: Int[Array, ""] | int) -> Int[Array, ""]:
    """Environment steps counted so far, and those lived since. A count that is full stays full.

    Seeds are one program, in which the fast ones go on until the slowest has lived its budget: beyond 32 bits
    their count would begin again below 0, and be within the budget once more. `MOST_COUNTED` is in no budget.
    """
    for steps in lived:
        before = before + jnp.minimum(steps, MOST_COUNTED - before)
    return before


class Trajectories(Episodes):
    """Episodes with all that each agent saw, did and was paid."""

    observation: Float[Array, "*time worlds agents obs"]
    """Before the action."""
    action: Float[Array, "*time worlds agents act"]
    """Where actions are discrete, a 1 at the place of the one that was taken and 0 elsewhere."""
    next_observation: Float[Array, "*time worlds agents obs"]
    """After the action, of the same episode."""
    local_rewards: Float[Array, "*time worlds agents skills"]
    choice: Int[Array, "*time worlds agents"]

    def local_return(self, skill: int) -> Float[Array, "worlds agents"]:
        """The sum of each agent's local reward of one skill over each episode."""
        return jnp.where(self.mask[..., None], self.local_rewards[..., skill], 0.0).sum(0)


class Start(eqx.Module):
    """Freshly reset worlds, the world axis last."""

    state: Any
    observation: Float[Array, "agents obs worlds"]

    @classmethod
    def draw(cls, env: Environment, key: Key[Array, ""], worlds: int) -> "Start":
        """New worlds, each from its own key."""
        return cls(*uniform(env).reset_worlds(jax.random.split(key, worlds)))

    @property
    def worlds(self) -> int:
        """How many there are."""
        return self.observation.shape[-1]

    def repeat(self, times: int) -> "Start":
        """The same worlds `times` over, so that every team meets the same start states."""
        return jax.tree.map(lambda leaf: jnp.concatenate([leaf] * times, axis=-1), self)

    def first(self, worlds: int) -> "Start":
        """The first few of the worlds."""
        return jax.tree.map(lambda leaf: leaf[..., :worlds], self)

    def join(self, other: "Start") -> "Start":
        """These worlds, then the others."""
        return jax.tree.map(lambda *leaves: jnp.concatenate(leaves, axis=-1), self, other)


@dataclasses.dataclass(frozen=True)
class Lineup:
    """Who plays where: a policy, its memory at the start, and the worlds that it plays in."""

    policy: Policy
    memory: PyTree
    """Leaves have a leading world axis."""
    start: Start

    @classmethod
    def of_team(cls, team: Team, start: Start) -> "Lineup":
        """One team in every world."""
        return cls.of_teams(lambda _: team, (), 1, start)

    @classmethod
    def of_teams(
        cls, make_team: Callable[[Any], Team], stacked: PyTree, n_teams: int, start: Start
    ) -> "Lineup":
        """Many teams, each in its own copy of every world; worlds are ordered team by team.

        Args:
            make_team: makes a team of one slice of `stacked`; what it closes over is shared by all.
            stacked: what differs between teams; leaves have a leading team axis.
        """

        def act_for_team(part, observation, memory, keys):
            return jax.vmap(make_team(part).act)(observation, memory, keys)

        def policy(observation, memory, keys):
            inputs = (observation, memory, keys)
            by_team = jax.tree.map(lambda leaf: leaf.reshape(n_teams, start.worlds, *leaf.shape[1:]), inputs)
            results = jax.vmap(act_for_team, axis_size=n_teams)(stacked, *by_team)
            return jax.tree.map(lambda leaf: leaf.reshape(n_teams * start.worlds, *leaf.shape[2:]), results)

        memory = jax.vmap(lambda part: make_team(part).initial_memory(), axis_size=n_teams)(stacked)
        memory = jax.tree.map(lambda leaf: jnp.repeat(leaf, start.worlds, axis=0), memory)
        return cls(policy, memory, start.repeat(n_teams))

    @classmethod
    def of_pairs(cls, make_team: Callable[[Any], Team], stacked: PyTree, start: Start) -> "Lineup":
        """A team for each world: the first in the first one, and so on.

        Args:
            make_team, stacked: as for `of_teams`, with as many teams as there are worlds.
        """

        def policy(observation, memory, keys):
            return jax.vmap(lambda part, *inputs: make_team(part).act(*inputs))(
                stacked, observation, memory, keys
            )

        memory = jax.vmap(lambda part: make_team(part).initial_memory())(stacked)
        return cls(policy, memory, start)

    def beside(self, other: "Lineup") -> "Lineup":
        """Both at once, the other one's worlds after these."""
        split = self.start.worlds

        def policy(observation, memory, keys):
            action, left, choice = self.policy(observation[:split], memory[0], keys[:split])
            more_action, right, more_choice = other.policy(observation[split:], memory[1], keys[split:])
            return (
                jnp.concatenate([action, more_action]),
                (left, right),
                jnp.concatenate([choice, more_choice]),
            )

        return Lineup(policy, (self.memory, other.memory), self.start.join(other.start))


def rollout(
    env: Environment,
    lineup: Lineup,
    key: Key[Array, ""],
    noise: Float[Array, ""] | float = 0.0,
    recorded: slice | np.ndarray = slice(None),
    lived: Bool[Array, " worlds"] | None = None,
) -> tuple[Episodes, Trajectories]:
    """Lives one episode in each world.

    Args:
        lineup: who plays where.
        noise: standard deviation of Gaussian noise on the primitive action, which is then
            clipped to [-1, 1]; of discrete actions, how likely each is a random one. A literal 0 spares
            drawing it.
        recorded: which of the worlds to keep the whole story of; it takes some twenty times the memory.
        lived: in which of the worlds there is an episode at all, None for all of them; no step of the others
            counts.

    Returns:
        The episodes of all worlds, and the trajectories of the recorded ones.
    """
    is_noisy = not (isinstance(noise, float) and noise == 0)
    start, worlds = lineup.start, lineup.start.worlds
    world = uniform(env)

    def live_one_step(carry, keys):
        state, observation, memory, running, sound = carry
        key_policy, key_noise, key_env = keys
        seen = jnp.moveaxis(observation, -1, 0)
        action, memory, choice = lineup.policy(seen, memory, jax.random.split(key_policy, worlds))
        if is_noisy:
            action = _explored(key_noise, action, jnp.asarray(noise), env.choices)
        keys_env = jax.random.split(key_env, worlds)
        state, step = world.step_worlds(state, jnp.moveaxis(action, 0, -1), keys_env)
        # What agents see is recorded of some worlds only; what the team is paid is looked at in all.
        sound = sound & jnp.isfinite(observation).all((0, 1))
        team_reward = jnp.where(sound, step.team_reward, jnp.nan)
        episodes = Episodes(team_reward, step.terminated, running)
        trajectories = Trajectories(
            observation=seen,
            action=_rows(action, env),
            next_observation=jnp.moveaxis(step.observation, -1, 0),
            local_rewards=jnp.moveaxis(step.local_rewards, -1, 0),
            team_reward=team_reward,
            terminated=step.terminated,
            choice=choice,
            mask=running,
        )
        kept = jax.tree.map(lambda leaf: leaf[recorded], trajectories)
        running = running & ~step.terminated & ~step.truncated
        return (state, step.observation, memory, running, sound), (episodes, kept)

    yes = jnp.ones(worlds, bool)
    carry = (start.state, start.observation, lineup.memory, yes if lived is None else lived, yes)
    return jax.lax.scan(live_one_step, carry, jax.random.split(key, (env.episode_length, 3)))[1]


def _explored(key: Key[Array, ""], action: Array, noise: Float[Array, ""], choices: int) -> Array:
    """Actions with noise; none is drawn where it is 0.

    Drawing it would take a third of a rollout whose noise is 0 because nobody learns any more.
    """
    if choices:
        return run_unless(noise == 0, lambda taken: with_random_ones(key, taken, noise, choices), action)
    draw = run_unless(noise == 0, lambda _: jax.random.normal(key, action.shape), action * 0.0)
    return jnp.clip(action + noise * draw, -1.0, 1.0)


def _rows(action: Array, env: Environment) -> Float[Array, "worlds agents act"]:
    """Actions as rows of numbers, whatever they are."""
    if not env.choices:
        return action
    taken = jax.nn.one_hot(action, env.choices)
    return taken.reshape(len(action), env.n_agents, env.action_size)

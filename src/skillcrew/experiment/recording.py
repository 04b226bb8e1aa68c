"""Episodes of champions with what there is to draw of them, and which of them are worth showing."""

import math
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int, Key

from skillcrew.envs.checks.interface import traced
from skillcrew.envs.environment import Environment
from skillcrew.envs.offers import OffersScene, offers, require
from skillcrew.envs.padded import uniform
from skillcrew.envs.scene import Scene
from skillcrew.envs.scene_shapes import scene_mistake
from skillcrew.errors import UserError
from skillcrew.experiment import generation
from skillcrew.experiment.run import Run
from skillcrew.policies.team import Team
from skillcrew.rollout import Lineup, Start

PLAYED = 100
"""Episodes of each seed, of which those that are shown are chosen."""

SHOWN = 20
"""Of each seed, on the page of a run."""

MOST_NUMBERS = 2**26
"""That a seed's episodes are recorded in; fewer of them are played where worlds are large."""


class Recording(eqx.Module):
    """Whole episodes, one a row. An episode of n steps has n + 1 moments: the last is what it ended in."""

    scene: Scene | None
    """Of each moment, leaves [episodes, moments, ...]; None where the environment draws nothing."""
    observation: Float[Array, "episodes time agents obs"]
    """Before each step."""
    choice: Int[Array, "episodes time agents"]
    team_reward: Float[Array, "episodes time"]
    terminated: Bool[Array, "episodes time"]
    mask: Bool[Array, "episodes time"]
    """Which steps count; those after an episode's end are padding."""

    def episodes(self, which: np.ndarray) -> "Recording":
        """Some of them, by index, in NumPy."""
        return jax.tree.map(lambda leaf: np.asarray(leaf)[which], self)


class Shown(NamedTuple):
    """One seed's episodes: all that were played, or those that are worth showing."""

    seed: int
    played: int
    """Episodes among which they were chosen."""
    number: Int[np.ndarray, " episodes"]
    """Of each among those played, counted from 0."""
    returns: Float[np.ndarray, " episodes"]
    solved: Bool[np.ndarray, " episodes"] | None
    """None where the environment does not say what success is."""
    steps: Int[np.ndarray, " episodes"]
    """How long each lasted."""
    recording: Recording


def record(env: Environment, lineup: Lineup, key: Key[Array, ""]) -> Recording:
    """Lives one episode in each world to be looked at, as `rollout` does without noise from the same key."""
    worlds, world = lineup.start.worlds, uniform(env)
    draw = None
    if offers(env, OffersScene):
        draw = jax.vmap(require(env, OffersScene, "a replay").scene, in_axes=-1)

    def live_one_step(carry: Any, keys: Array) -> Any:
        state, observation, memory, running = carry
        key_policy, _, key_env = keys
        seen = jnp.moveaxis(observation, -1, 0)
        action, memory, choice = lineup.policy(seen, memory, jax.random.split(key_policy, worlds))
        keys_env = jax.random.split(key_env, worlds)
        after, step = world.step_worlds(state, jnp.moveaxis(action, 0, -1), keys_env)
        scene = None if draw is None else draw(state)
        kept = (scene, seen, choice, step.team_reward, step.terminated, running)
        running = running & ~step.terminated & ~step.truncated
        return (after, step.observation, memory, running), kept

    carry = (lineup.start.state, lineup.start.observation, lineup.memory, jnp.ones(worlds, bool))
    carry, kept = jax.lax.scan(live_one_step, carry, jax.random.split(key, (env.episode_length, 3)))
    scene, *others = jax.tree.map(lambda leaf: jnp.moveaxis(leaf, 1, 0), kept)
    if draw is not None:
        scene = jax.tree.map(
            lambda leaf, end: jnp.concatenate([leaf, end[:, None]], axis=1), scene, draw(carry[0])
        )
    return Recording(scene, *others)


def shown_episodes(run: Run, count: int = SHOWN) -> list[Shown]:
    """Plays every seed's champion, and keeps the episodes that `worth_showing` names.

    The same run gives the same episodes, in worlds that neither training nor scores ever saw.

    Raises:
        UserError: the environment's scene cannot be drawn; the line says why.
    """
    return [_most_worth(played, count) for played in _played_episodes(run, run.config.seeds, count)]


def episodes_of(run: Run, seed: int) -> Shown:
    """All episodes of one seed's champion among which those on the page of the run are chosen.

    Raises:
        UserError: as for `shown_episodes`; the run has no such seed.
    """
    return next(_played_episodes(run, (seed,), SHOWN))


def _played_episodes(run: Run, seeds: Sequence[int], least: int) -> Iterator[Shown]:
    """Of each of some seeds all episodes, at least so many."""
    env = run.algorithm.env
    check_scene(env)
    played = min(PLAYED, max(least, MOST_NUMBERS // (env.episode_length * _numbers_per_step(env))))

    def play(team: Team, seed: Array) -> Recording:
        key_start, key_rollout = jax.random.split(generation.stream(seed, generation.REPLAY))
        start = Start.draw(env, key_start, played)
        return record(env, Lineup.of_team(team, start), key_rollout)

    indices = [run.index_of(seed) for seed in seeds]
    champions, of_all = run.champions(), generation.seeds_of(run.config)
    # One seed after the other: together they would take as many times the memory.
    inputs = [(jax.tree.map(lambda leaf, i=index: leaf[i], champions), of_all[index]) for index in indices]
    program = generation.compiled(play, *inputs[0])
    for given, seed in zip(inputs, seeds, strict=True):
        yield _played(env, program(*given), seed)


def check_scene(env: Environment) -> None:
    """Raises `UserError` if what the environment offers as its scene cannot be drawn."""
    if not offers(env, OffersScene):
        return
    draw = require(env, OffersScene, "a replay").scene
    state = jax.eval_shape(lambda key: env.reset(key)[0], jax.random.key(0))
    scene, failed = traced("scene", draw, state)
    mistake = failed.said if failed is not None else scene_mistake(scene, env.n_agents)
    if mistake is not None:
        raise UserError(f"scene of {env.name}: {mistake}")


def worth_showing(
    solved: Bool[np.ndarray, " episodes"] | None,
    returns: Float[np.ndarray, " episodes"],
    steps: Int[np.ndarray, " episodes"],
    count: int,
) -> Int[np.ndarray, " shown"]:
    """Which of many episodes to show, in their order.

    Solved and failed ones as often as they happened, each at least a quarter of the places if there are as
    many, and the fastest; where nothing says what success is, those of the highest and the lowest return. The
    rest are the first that come.
    """
    everything = np.arange(len(returns))
    if solved is None:
        extremes = dict.fromkeys([int(np.argmax(returns)), int(np.argmin(returns))])
        first = [index for index in everything if index not in extremes]
        return np.sort(np.array([*extremes, *first][:count], int))
    won, lost = np.flatnonzero(solved), np.flatnonzero(~solved)
    won = won[np.argsort(won != (won[np.argmin(steps[won])] if len(won) else -1), kind="stable")]
    count, least = min(count, len(everything)), math.ceil(count / 4)
    n_lost = round(count * len(lost) / len(everything))
    n_lost = min(max(n_lost, min(least, len(lost))), count - min(least, len(won)))
    n_lost = min(max(n_lost, count - len(won)), len(lost))
    return np.sort(np.concatenate([won[: count - n_lost], lost[:n_lost]]))


def _played(env: Environment, recording: Recording, seed: int) -> Shown:
    mask = np.asarray(recording.mask)
    returns = np.where(mask, np.asarray(recording.team_reward), 0.0).sum(1).astype(float)
    solved = None if env.success is None else (np.asarray(recording.terminated) & mask).any(1)
    return Shown(seed, len(mask), np.arange(len(mask)), returns, solved, mask.sum(1), recording)


def _most_worth(played: Shown, count: int) -> Shown:
    which = worth_showing(played.solved, played.returns, played.steps, count)
    return played._replace(
        number=played.number[which],
        returns=played.returns[which],
        solved=None if played.solved is None else played.solved[which],
        steps=played.steps[which],
        recording=played.recording.episodes(which),
    )


def _numbers_per_step(env: Environment) -> int:
    drawn = 0
    if offers(env, OffersScene):
        state = jax.eval_shape(lambda key: env.reset(key)[0], jax.random.key(0))
        scene = jax.eval_shape(require(env, OffersScene, "a replay").scene, state)
        drawn = sum(math.prod(leaf.shape) for leaf in jax.tree.leaves(scene))
    return env.n_agents * (env.observation_size + 1) + drawn + 3

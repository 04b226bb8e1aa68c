"""Agents that live episodes of the Rover Domain through JaxMARL's interface. Used by `jaxmarl_ippo.py`."""

import functools
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp

Act = Callable[[Any, dict[str, jax.Array], jax.Array], dict[str, jax.Array]]
"""Of the state, what each agent sees and a key: what each agent does."""


def at_random(state: Any, seen: dict[str, jax.Array], key: jax.Array) -> dict[str, jax.Array]:
    del state
    return {agent: jax.random.uniform(key, (2,), minval=-1.0, maxval=1.0) for agent in seen}


def straight(goes_on: bool, state: Any, seen: dict[str, jax.Array], key: jax.Array) -> dict[str, jax.Array]:
    """To A, there to stay or, once A is observed, to go on to B."""
    del key
    world = state.world
    x, y = world.poi_position[jnp.where(goes_on & world.observed[0], 1, 0)] - world.position[0]
    turn = (jnp.arctan2(y, x) - world.heading[0] + jnp.pi) % (2 * jnp.pi) - jnp.pi
    drive = jnp.minimum(jnp.hypot(x, y), 1.0)
    return {agent: jnp.stack([turn / jnp.pi, 2 * drive - 1]) for agent in seen}


TOLD = {
    "acts at random": at_random,
    "straight to A, and stays": functools.partial(straight, False),
    "straight to A, then to B": functools.partial(straight, True),
}


def policy(baseline: Any, config: dict[str, Any], params: Any) -> Act:
    """What was learned; actions are drawn as in training."""
    network = baseline.ActorCritic(2, activation=config["ACTIVATION"])

    def act(state: Any, seen: dict[str, jax.Array], key: jax.Array) -> dict[str, jax.Array]:
        del state
        return {agent: network.apply(params, own)[0].sample(seed=key) for agent, own in seen.items()}

    return act


@functools.partial(jax.jit, static_argnums=(0, 1, 3))
def score(env: Any, act: Act, key: jax.Array, episodes: int) -> tuple[jax.Array, jax.Array]:
    """The mean return of one agent, and the share of episodes that it finishes."""

    def advance(carry: Any, key: jax.Array) -> tuple[Any, Any]:
        (seen, state), over = carry
        key_act, key_step = jax.random.split(key)
        seen, state, reward, done, info = env.step_env(key_step, state, act(state, seen, key_act))
        (paid,) = reward.values()
        now = (seen, state), over | done["__all__"]
        return now, (jnp.where(over, 0.0, paid), info["terminated"][0] & ~over)

    def episode(key: jax.Array) -> tuple[jax.Array, jax.Array]:
        key_reset, key_steps = jax.random.split(key)
        start = env.reset(key_reset), jnp.zeros((), bool)
        _, (paid, finished) = jax.lax.scan(advance, start, jax.random.split(key_steps, env.max_steps))
        return paid.sum(), finished.any()

    returns, finished = jax.vmap(episode)(jax.random.split(key, episodes))
    return returns.mean(), finished.mean()

"""What the bridge to JaxMARL costs, in both directions.

Run as `python -m benchmarks.bridges`. Random actions are done in as many worlds, through the bridge and
without it, in turn; seconds are the processor's. A line for each case: the median and the range, over the
rounds, of the time with the bridge over the time without it. JaxMARL's environments are stepped by
`jax.vmap(env.step_env)`, beside our `step_worlds`. Ours are stepped by `jax.vmap(env.step)`, and by
`step_worlds`, beside `jax.vmap` of what JaxMARL calls `step_env`.
"""

import argparse
import functools
import statistics
import time
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
from benchmarks.stepping_sides import one_thread

import skillcrew as sc

IN = {
    "spread, discrete": ("MPE_simple_spread_v3", {}, 1024),
    "spread, continuous": ("MPE_simple_spread_v3", {"action_type": "Continuous"}, 1024),
    "speaker and listener": ("MPE_simple_speaker_listener_v4", {}, 1024),
    "riddle": ("switch_riddle", {}, 4096),
    "overcooked": ("overcooked", {}, 128),
    "SMAX, 3 against heuristics": ("HeuristicEnemySMAX", {"scenario": "3m"}, 64),
}
OUT = {"rover-t2-c1": 1024, "rover-t2-c2": 1024, "rover-t3-c3": 256}

Play = Callable[[jax.Array], Any]
"""A whole episode in many worlds, from a key to totals of all that was returned."""


def main() -> None:
    """Prints a line for each case."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=15)
    rounds = parser.parse_args().rounds
    for name, (env_id, options, worlds) in IN.items():
        report(f"in:  {name}", *jaxmarl_in(env_id, options, worlds), rounds)
    for name, worlds in OUT.items():
        bridged, stepped, batched = jaxmarl_out(name, worlds)
        report(f"out: {name} beside vmap(step)", bridged, stepped, rounds)
        report(f"out: {name} beside step_worlds", bridged, batched, rounds)


def report(name: str, bridged: Play, direct: Play, rounds: int) -> None:
    """Times both in turn, and prints the ratio."""
    for play in (bridged, direct):
        seconds(play, 0)
    ratios = [seconds(bridged, index) / seconds(direct, index) for index in range(rounds)]
    middle = statistics.median(ratios)
    print(f"{name:<48} {middle:.2f} ({min(ratios):.2f} to {max(ratios):.2f})", flush=True)


def seconds(play: Play, seed: int) -> float:
    """Of the processor."""
    start = time.process_time()
    jax.block_until_ready(play(jax.random.key(seed)))
    return time.process_time() - start


def jaxmarl_in(env_id: str, options: dict[str, Any], worlds: int) -> tuple[Play, Play]:
    """One of JaxMARL's environments through our interface, and by itself."""
    env = sc.make(f"jaxmarl:{env_id}", options=options)
    world = env.world

    def drawn(key: jax.Array) -> dict[str, jax.Array]:
        keys = zip(world.agents, jax.random.split(key, world.num_agents), strict=True)
        return {
            agent: jax.vmap(world.action_space(agent).sample)(jax.random.split(own, worlds))
            for agent, own in keys
        }

    def ours(key: jax.Array) -> Any:
        """The same actions as arrays, the world axis last; boxes of MPE are from 0 to 1."""
        action = {agent: jnp.moveaxis(acted, 0, -1) for agent, acted in drawn(key).items()}
        if env.actions == "continuous":
            action = {agent: 2 * acted - 1 for agent, acted in action.items()}
        if not env.types:
            return jnp.stack([action[agent] for agent in world.agents])
        return {
            kind.name: jnp.stack([action[f"{kind.name}_{index}"] for index in range(kind.agents)])
            for kind in env.types
        }

    def reset(keys: jax.Array) -> Any:
        return jax.vmap(world.reset)(keys)[1]

    def step(state: Any, key: jax.Array, keys: jax.Array) -> tuple[Any, Any]:
        seen, state, rewards, done, _ = jax.vmap(world.step_env)(keys, state, drawn(key))
        return state, (seen, rewards, done)

    bridged = episode(
        lambda keys: env.reset_worlds(keys)[0],
        lambda state, key, keys: env.step_worlds(state, ours(key), keys),
        worlds,
        env.episode_length,
    )
    return bridged, episode(reset, step, worlds, env.episode_length)


def jaxmarl_out(name: str, worlds: int) -> tuple[Play, Play, Play]:
    """One of ours through JaxMARL's interface, by `jax.vmap(env.step)`, and by `step_worlds`."""
    env = sc.make(name)
    bridge = sc.jaxmarl_env(env)

    def drawn(key: jax.Array) -> jax.Array:
        return jax.random.uniform(key, (worlds, env.n_agents, env.action_size), minval=-1.0, maxval=1.0)

    def through(state: Any, key: jax.Array, keys: jax.Array) -> tuple[Any, Any]:
        action = drawn(key)
        actions = {agent: action[:, index] for index, agent in enumerate(bridge.agents)}
        seen, state, rewards, done, info = jax.vmap(bridge.step_env)(keys, state, actions)
        return state, (seen, rewards, done, info)

    play = functools.partial(episode, worlds=worlds, length=env.episode_length)
    return (
        play(lambda keys: jax.vmap(bridge.reset)(keys)[1], through),
        play(
            lambda keys: jax.vmap(env.reset)(keys)[0],
            lambda state, key, keys: jax.vmap(env.step)(state, drawn(key), keys),
        ),
        play(
            lambda keys: env.reset_worlds(keys)[0],
            lambda state, key, keys: env.step_worlds(state, jnp.moveaxis(drawn(key), 0, -1), keys),
        ),
    )


def episode(reset: Callable, step: Callable, worlds: int, length: int) -> Play:
    """A compiled episode. All that steps return is added up, so that the compiler can drop none of it."""

    def added(total: Any, more: Any) -> Any:
        return jax.tree.map(lambda one, other: one + other.astype(jnp.float32), total, more)

    @jax.jit
    def play(key: jax.Array) -> Any:
        key_reset, key_steps = jax.random.split(key)
        state = reset(jax.random.split(key_reset, worlds))

        def advance(carry: Any, key: jax.Array) -> tuple[Any, None]:
            state, total = carry
            key_action, key_step = jax.random.split(key)
            state, returned = step(state, key_action, jax.random.split(key_step, worlds))
            return (state, added(total, returned)), None

        shapes = jax.eval_shape(lambda: step(state, key, jax.random.split(key, worlds))[1])
        total = jax.tree.map(lambda leaf: jnp.zeros(leaf.shape, jnp.float32), shapes)
        return jax.lax.scan(advance, (state, total), jax.random.split(key_steps, length))[0][1]

    return play


if __name__ == "__main__":
    one_thread()
    main()

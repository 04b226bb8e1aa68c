"""Teams whose skills are written by hand: told ones, random ones and timetables, on the same skills.

    python -m benchmarks.by_hand rescue-v1-c2 rescue-v2-c2 ...

What told teams lack to 1 is the time limit's fault; what timetables finish needs no looking. Skills act by
the agent's observation alone, as trained ones have to.
"""

import functools
import sys
from collections.abc import Callable, Sequence
from typing import Any

import jax
import jax.numpy as jnp
from benchmarks import hand_rescue, hand_warehouse
from jaxtyping import Array, Float, Int, Key

import skillcrew as sc
from skillcrew.policies.timetable import Timetable

EPISODES = 1000
TIMETABLES, TRIALS, PHASES = 200, 100, 12
"""Random timetables; episodes in which each is tried; phases of each."""
DOMAINS: dict[str, Any] = {"rescue": hand_rescue, "warehouse": hand_warehouse}
Choose = Callable[[Any, Array, Array], Array]
"""Of a state, the step from 0 and a key: which skill each agent follows, [agents, worlds]."""


def finished(env: Any, choose: Choose, key: Key[Array, ""], worlds: int) -> Float[Array, " worlds"]:
    """Which episodes a team finishes whose choices are these and whose skills are written by hand."""
    hand = DOMAINS[type(env).name]

    def live(carry, now):
        state, observation = carry
        time, key = now
        key_choice, key_step = jax.random.split(key)
        choice = choose(state, time, key_choice)
        action = chosen(hand.actions(env, observation), choice)
        state, step = env.step_worlds(state, action, jax.random.split(key_step, worlds))
        return (state, step.observation), (step.terminated, step.terminated | step.truncated)

    key_reset, key_steps = jax.random.split(key)
    start = env.reset_worlds(jax.random.split(key_reset, worlds))
    times = jnp.arange(env.episode_length), jax.random.split(key_steps, env.episode_length)
    return jax.lax.scan(live, start, times)[1][0].any(0).astype(jnp.float32)


def chosen(
    actions: Float[Array, "skills agents 2 worlds"], choice: Int[Array, "agents worlds"]
) -> Float[Array, "agents 2 worlds"]:
    """Each agent's action by the skill that it chose."""
    return jnp.take_along_axis(actions, choice[None, :, None], axis=0)[0]


@functools.partial(jax.jit, static_argnums=(0, 2))
def told(env: Any, key: Key[Array, ""], episodes: int = EPISODES) -> Float[Array, ""]:
    """The share of episodes that a told team finishes."""
    hand = DOMAINS[type(env).name]
    return finished(env, lambda state, *_: hand.told(env, state), key, episodes).mean()


@functools.partial(jax.jit, static_argnums=(0, 2))
def at_random(env: Any, key: Key[Array, ""], episodes: int = EPISODES) -> Float[Array, ""]:
    """The share that a team finishes in which each agent draws a skill at every step."""
    shape = (env.n_agents, episodes)
    return finished(
        env, lambda _s, _t, key: jax.random.randint(key, shape, 0, len(env.skills)), key, episodes
    ).mean()


@functools.partial(jax.jit, static_argnums=(0, 2, 3, 4))
def best_timetable(
    env: Any, key: Key[Array, ""], shared: bool, tables: int = TIMETABLES, trials: int = TRIALS
) -> Float[Array, ""]:
    """The share that the best of many random timetables finishes, chosen on other episodes.

    Args:
        shared: one timetable for all agents, or one for each.
        trials: episodes in which each of them is tried.
    """
    key_tables, key_trial, key_score = jax.random.split(key, 3)
    drawn = _tables(env, key_tables, shared, tables)
    trial = _follow(env, drawn, key_trial, trials).mean(1)
    best = drawn[:, :, trial.argmax()]
    return _follow(env, best[:, :, None], key_score, EPISODES).mean()


def _tables(env: Any, key: Key[Array, ""], shared: bool, count: int) -> Int[Array, "time agents tables"]:
    """Which skill each timetable has at each step."""

    def one(key):
        table = Timetable.create(key, PHASES, len(env.skills))
        key_lengths = jax.random.fold_in(key, 0)
        lengths = jax.random.exponential(key_lengths, (PHASES,))
        ends = jnp.round(jnp.cumsum(lengths / lengths.sum()) * env.episode_length).at[-1].set(jnp.inf)
        phase = (jnp.arange(env.episode_length, dtype=jnp.float32)[:, None] >= ends[None]).sum(1)
        return table.skills()[phase]

    agents = 1 if shared else env.n_agents
    keys = jax.random.split(key, (count, agents))
    tables = jax.vmap(jax.vmap(one))(keys).transpose(2, 1, 0)
    return jnp.broadcast_to(tables, (env.episode_length, env.n_agents, count))


def _follow(
    env: Any, tables: Int[Array, "time agents tables"], key: Key[Array, ""], episodes: int
) -> Float[Array, "tables episodes"]:
    every = jnp.repeat(tables, episodes, axis=2)
    return finished(env, lambda _s, time, _k: every[time], key, every.shape[2]).reshape(-1, episodes)


def row(name: str) -> str:
    """One line of the table."""
    env, keys = sc.make(name), jax.random.split(jax.random.key(7), 4)
    shares = [
        told(env, keys[0]),
        best_timetable(env, keys[1], True),
        best_timetable(env, keys[2], False),
        at_random(env, keys[3]),
    ]
    return f"| `{name}` | " + " | ".join(f"{float(share):.3f}" for share in shares) + " |"


def main(names: Sequence[str]) -> int:
    if not names:
        print(__doc__, file=sys.stderr)
        return 2
    print(f"| preset | told | best of {TIMETABLES} timetables, shared | one each | random choices |")
    print("|---|---|---|---|---|")
    for name in names:
        print(row(name), flush=True)
    return 0


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))

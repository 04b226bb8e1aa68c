"""Teams that are told the state of the world: what they finish is the ceiling that their skills set.

A hand-written selector sends each rover by true positions to the type that is to be observed next, and
skills do the rest. A trained selector, which has to look, is measured against it: what it lacks to this
ceiling is the selector's fault, and what the ceiling lacks to 1 is the skills' or the time limit's.
"""

import functools
import itertools

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int, Key

from skillcrew.envs.padded import uniform
from skillcrew.envs.rover.config import RoverConfig
from skillcrew.envs.rover.coupling import types_observed
from skillcrew.envs.rover.crew import Ranks, ranks
from skillcrew.envs.rover.state import RoverState
from skillcrew.envs.rover.world import RoverDomain
from skillcrew.policies.actor import Actor
from skillcrew.policies.dispatch import apply_skills

TOGETHER, SPLIT, GUESSING = "together", "split", "guessing"
LAST = 1_000_000
"""Beyond every stage, and in metres beyond every distance."""


def variants(config: RoverConfig) -> tuple[str, ...]:
    """The variants that differ in this domain: to split takes rovers for two stages in a row."""
    # Of a drawn order each stage is one type, as here, where there are no groups.
    sizes = [len(group) for group in config.group_indices]
    fits = [
        all(sum(pair) * kind.coupling <= kind.rovers for kind in config.crew)
        for pair in itertools.pairwise(sizes)
    ]
    if not any(fits):
        return (TOGETHER,)
    return (TOGETHER, SPLIT, GUESSING) if config.order == "drawn" else (TOGETHER, SPLIT)


def told_shares(env: RoverDomain, skills: Actor, key: Key[Array, ""], episodes: int) -> dict[str, float]:
    """The share of the same episodes that each variant finishes; the best of them is the ceiling.

    Args:
        skills: see `told_rollout`.
    """
    return {
        variant: float(told_rollout(env, skills, key, episodes, variant)) for variant in variants(env.config)
    }


@functools.partial(jax.jit, static_argnames=("env", "episodes", "variant", "names"))
def told_rollout(
    env: RoverDomain,
    skills: Actor,
    key: Key[Array, ""],
    episodes: int,
    variant: str = TOGETHER,
    names: tuple[str, ...] | None = None,
) -> Float[Array, ""]:
    """The share of episodes that a told team finishes.

    Args:
        skills: leaves have a leading skill axis.
        variant: TOGETHER sends all rovers to the types of the next stage; SPLIT sends those who are not
            needed there ahead to the stage after it, where there are enough for both; GUESSING sends them to
            the first of the other types, for no sensor tells which of a drawn order comes after the next.
        names: which skills these are, in their order; by default all of the environment's.
    """
    skill_names = names or env.skills
    owners = [f"{kind.name}/" if env.types else "" for kind, _ in env.crew for _ in range(kind.rovers)]
    go_to = jnp.array(
        [[skill_names.index(f"{of}go_to_poi_{name}") for name in env.config.type_names] for of in owners]
    )
    arrays = uniform(env)

    def live_one_step(carry, key):
        state, observation = carry
        choice = jnp.take_along_axis(go_to, targets(env.config, state, variant), axis=1)
        act = jax.vmap(apply_skills, in_axes=(None, -1, -1), out_axes=-1)
        action = act(skills, observation, choice)
        state, step = arrays.step_worlds(state, action, jax.random.split(key, episodes))
        return (state, step.observation), step.terminated

    key_reset, key_steps = jax.random.split(key)
    start = arrays.reset_worlds(jax.random.split(key_reset, episodes))
    _, terminated = jax.lax.scan(live_one_step, start, jax.random.split(key_steps, env.episode_length))
    return terminated.any(0).mean()


def targets(config: RoverConfig, state: RoverState, variant: str) -> Int[Array, "agents worlds"]:
    """The type that each rover is sent to, as an index."""
    offsets = state.position[:, None] - state.poi_position[None]
    to_poi = jnp.sqrt((offsets**2).sum(2))
    if config.observed_pois == "vanish":
        to_poi = jnp.where(state.observed[None], LAST, to_poi)
    shape = (config.n_agents, config.n_poi_types, config.pois_per_type, -1)
    distance = to_poi.reshape(shape).min(2)
    working = state.working()
    working = jnp.ones(distance[:, 0].shape, bool) if working is None else working
    done = types_observed(state.observed, config.pois_per_type)
    crew = ranks(config.crew)
    heading_for = wanted(stages(config, state), done, working, crew, variant)
    parts = [
        jax.vmap(functools.partial(assigned, coupling=kind.coupling), in_axes=-1, out_axes=-1)(
            distance[rows], heading_for, working[rows]
        )
        for kind, rows in crew
    ]
    return jnp.concatenate(parts)


def stages(config: RoverConfig, state: RoverState) -> Int[Array, "types worlds"]:
    """When each type's turn is: its place in the drawn order, or its group's in the given one."""
    if state.order is not None:
        return state.order
    place = {kind: stage for stage, group in enumerate(config.group_indices) for kind in group}
    fixed = jnp.array([place[kind] for kind in range(config.n_poi_types)], jnp.int32)
    return jnp.broadcast_to(fixed[:, None], (len(fixed), *state.time.shape))


def wanted(
    stage: Int[Array, "types worlds"],
    done: Bool[Array, "types worlds"],
    working: Bool[Array, "agents worlds"],
    crew: Ranks,
    variant: str,
) -> Bool[Array, "types worlds"]:
    """The types to head for: those of the next stage and, if split and enough, of another one after it."""
    left = jnp.where(done, LAST, stage)
    now = left == left.min(0)[None]
    if variant == TOGETHER:
        return now
    if variant == GUESSING:
        left = jnp.where(done, LAST, jnp.arange(len(stage), dtype=stage.dtype)[:, None])
    later = jnp.where(now, LAST, left)
    both = now | ((later == later.min(0)[None]) & (later < LAST))
    types = both.sum(0, dtype=jnp.int32)
    enough = [working[rows].sum(0, dtype=jnp.int32) >= kind.coupling * types for kind, rows in crew]
    return jnp.where(jnp.stack(enough).all(0)[None], both, now)


def assigned(
    distance: Float[Array, "agents types"],
    heading_for: Bool[Array, " types"],
    working: Bool[Array, " agents"],
    coupling: int,
) -> Int[Array, " agents"]:
    """Shares out rovers that are alike over types in one world: as many to each as it takes, then evenly.

    Greedy: next is always the rover whose second choice is worst beside its first; so two types get
    those rovers for which all together have least far to go. Rovers that do not work get any type.
    """

    def settle_one(_, carry):
        target, count = carry
        short = heading_for & (count < coupling)
        fewest = heading_for & (count == jnp.where(heading_for, count, LAST).min())
        cost = jnp.where(jnp.where(short.any(), short, fewest)[None], distance, LAST)
        choice, best = cost.argmin(1).astype(jnp.int32), cost.min(1)
        is_choice = jnp.arange(cost.shape[1], dtype=jnp.int32)[None] == choice[:, None]
        loss = jnp.where(is_choice, LAST, cost).min(1) - best
        free = working & (target < 0)
        who = jnp.where(free, loss, -1.0).argmax()
        settled = target.at[who].set(jnp.where(free[who], choice[who], target[who]))
        return settled, count.at[choice[who]].add(free[who].astype(jnp.int32))

    nobody = jnp.full(len(working), -1, jnp.int32), jnp.zeros(len(heading_for), jnp.int32)
    target, _ = jax.lax.fori_loop(0, len(working), settle_one, nobody)
    return jnp.where(target < 0, heading_for.argmax().astype(jnp.int32), target)

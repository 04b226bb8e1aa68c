"""Episodes of random actions: how they end, what they pay, and how fast worlds are stepped."""

import time
from collections.abc import Iterator

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Key, PyTree

from skillcrew.envs.checks.purity import TOLERANCE
from skillcrew.envs.checks.report import Finding
from skillcrew.envs.checks.subject import Subject, alike
from skillcrew.envs.environment import TimeStep

EPISODES = 64
WORLDS = 1024
"""Worlds that are stepped side by side to measure speed."""
MEASURED_SECONDS = 0.2


def check_episodes(subject: Subject) -> Iterator[Finding]:
    """Everything is finite, episodes end in one way, and skills have something to learn."""
    steps = jax.tree.map(np.asarray, _played(subject))
    alive = _alive(steps)
    for name in ("observation", "local_rewards", "team_reward"):
        values = getattr(steps, name)
        bad = alive & ~np.isfinite(values).reshape(*alive.shape, -1).all(axis=-1)
        if bad.any():
            at = int(np.nonzero(bad)[1].min()) + 1
            yield Finding(
                "wrong",
                name,
                f"is not finite at step {at} of some episodes; is there a division by a distance of 0, or "
                "the logarithm of one?",
            )
    yield from _endings(subject, steps, alive)
    yield from _rewards(subject, steps, alive)


def check_worlds(subject: Subject) -> Iterator[Finding]:
    """Many worlds at once are stepped as each of them, compiled once, and fast."""
    env = subject.world
    keys = jax.random.split(subject.draw(3), WORLDS)
    state, _ = env.reset_worlds(keys)
    still = subject.still()
    action = jnp.broadcast_to(still[..., None], (*still.shape, WORLDS))
    few = (jax.tree.map(lambda leaf: leaf[..., :3], state), action[..., :3])
    alone = jax.vmap(env.step, in_axes=(-1, -1, 0), out_axes=-1)(*few, keys[:3])
    if not alike(env.step_worlds(*few, keys[:3]), alone, TOLERANCE):
        yield Finding("wrong", "step_worlds", "gives other results than step; leave it out, and step is used")
    speed, traces = _speed(subject, state, action, keys)
    if traces > 1:
        yield Finding(
            "note",
            "compiling",
            f"step is compiled {traces} times for the same shapes, for it gives back other types than it "
            "takes; make numbers in the state by jnp.zeros((), jnp.int32) and the like",
        )
    yield Finding("fine", "speed", f"{speed:,.0f} environment steps per second, {WORLDS} worlds at once")


def _endings(
    subject: Subject, steps: TimeStep, alive: Bool[np.ndarray, "episodes time"]
) -> Iterator[Finding]:
    terminated, truncated = steps.terminated & alive, steps.truncated & alive
    if (terminated & truncated).any():
        yield Finding(
            "wrong",
            "endings",
            "an episode is both terminated and truncated; truncated is for the time limit alone: "
            "`truncated = (time >= limit) & ~terminated`",
        )
    if not (terminated | truncated).any(axis=1).all():
        yield Finding(
            "note",
            "endings",
            f"some episodes are neither terminated nor truncated after {subject.env.episode_length} steps, "
            "and are left there; set truncated at the last one",
        )
    ended, cut = int(terminated.any(axis=1).sum()), int(truncated.any(axis=1).sum())
    yield Finding(
        "fine", "endings", f"of {EPISODES} episodes of random actions {ended} terminated, {cut} truncated"
    )


def _rewards(
    subject: Subject, steps: TimeStep, alive: Bool[np.ndarray, "episodes time"]
) -> Iterator[Finding]:
    returns = np.where(alive, steps.team_reward, 0.0).sum(axis=1)
    yield Finding(
        "fine",
        "team reward",
        f"returns of random actions: {returns.min():.3g} to {returns.max():.3g}, mean {returns.mean():.3g}",
    )
    skills = subject.env.skills
    learners = _learners(subject)
    for index, name in enumerate(skills):
        paid = steps.local_rewards[alive][:, learners[index]]
        if np.ptp(paid[..., index]) == 0:
            yield Finding(
                "note",
                "skills",
                f"{name} is always paid {paid[0, 0, index] + 0.0:.3g}: there is nothing to learn; pay more "
                "the better it does, or leave it out",
            )
            continue
        twins = [
            other
            for before, other in enumerate(skills[:index])
            if (paid[..., before] == paid[..., index]).all()
        ]
        if twins:
            yield Finding("note", "skills", f"{name} is paid what {twins[0]} is paid; leave one of them out")


def _learners(subject: Subject) -> list[slice]:
    """For each skill the agents that can learn it."""
    env, found, first = subject.env, [], 0
    for kind in env.types:
        found += [slice(first, first + kind.agents)] * len(kind.skills)
        first += kind.agents
    return found or [slice(None)] * len(env.skills)


def _played(subject: Subject) -> TimeStep:
    """Episodes of random actions, [episodes, time, …]."""
    env = subject.world

    def step(state: PyTree, key: Key[Array, ""]) -> tuple[PyTree, TimeStep]:
        key_action, key_step = jax.random.split(key)
        return env.step(state, subject.random(key_action), key_step)

    def episode(key: Key[Array, ""]) -> TimeStep:
        key_reset, key_steps = jax.random.split(key)
        keys = jax.random.split(key_steps, env.episode_length)
        return jax.lax.scan(step, env.reset(key_reset)[0], keys)[1]

    return jax.jit(jax.vmap(episode))(jax.random.split(subject.draw(4), EPISODES))


def _alive(steps: TimeStep) -> Bool[np.ndarray, "episodes time"]:
    """Which steps belong to an episode, its last one included."""
    over = steps.terminated | steps.truncated
    ended_before = np.cumsum(over, axis=1) - over
    return np.asarray(ended_before == 0)


def _speed(subject: Subject, state: PyTree, action: Array, keys: Array) -> tuple[float, int]:
    """Environment steps per second, and how often a step was compiled for it."""
    traces = 0

    @jax.jit
    def step(state: PyTree) -> PyTree:
        nonlocal traces
        traces += 1
        return subject.world.step_worlds(state, action, keys)[0]

    state = jax.block_until_ready(step(step(state)))
    begun, rounds = time.perf_counter(), 0
    while time.perf_counter() - begun < MEASURED_SECONDS:
        state, rounds = jax.block_until_ready(step(state)), rounds + 1
    return rounds * WORLDS / (time.perf_counter() - begun), traces

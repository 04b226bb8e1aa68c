"""The sides of `stepping.py`: each a process of its own that steps its environments on command.

Run as `python -m benchmarks.stepping_sides SIDE SECONDS WORLDS...`. It builds every case of the side, picks
the number of worlds at which each case is fastest, says so, and then measures one repetition for each case
that it is asked for.
"""

import functools
import importlib
import os
import sys
import time
from collections.abc import Callable
from typing import Any

from benchmarks import machine
from benchmarks.talking import Started, serve

EPISODE = 50
"""Steps from one reset to the next, on every side; worlds that finish early are stepped on."""
CALIBRATION_SECONDS = 0.3
"""Shortest processor time in which one number of worlds is judged."""

Run = Callable[[int], None]
"""Steps all worlds through so many episodes, resets included, and waits for the result."""
Build = Callable[[int], Run]
"""Makes the environments of so many worlds, compiled and warm."""


def one_thread() -> None:
    """Keeps this process on one core, and XLA and PyTorch on one thread. Call before their import."""
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    os.environ["XLA_FLAGS"] = "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1"
    os.environ["JAX_PLATFORMS"] = "cpu"
    os.environ["OMP_NUM_THREADS"] = os.environ["MKL_NUM_THREADS"] = "1"


def jax_run(reset: Callable, step: Callable) -> Run:
    """A jitted loop over episodes, each a reset and a scan over its steps.

    Every number that an environment returns is added to a running total of the same shape, so
    that XLA can drop none of them. Sums within a step would favour one memory layout.

    Args:
        reset: from a key to the state and the observation.
        step: from state and key to the new state and a tuple of outputs, the observation first.
    """
    import jax
    import jax.numpy as jnp

    def add(total: Any, outputs: Any) -> Any:
        return jax.tree.map(lambda t, x: t + x.astype(jnp.float32), total, outputs)

    def advance(carry: Any, key: Any) -> tuple[Any, None]:
        state, total = carry
        state, outputs = step(state, key)
        return (state, add(total, outputs)), None

    def episode(_: Any, carry: Any) -> Any:
        key, (observations, *rest) = carry
        key, key_reset, key_steps = jax.random.split(key, 3)
        state, observation = reset(key_reset)
        total = (add(observations, observation), *rest)
        (_, total), _ = jax.lax.scan(advance, (state, total), jax.random.split(key_steps, EPISODE))
        return key, total

    @jax.jit
    def episodes(key: Any, count: Any) -> Any:
        shapes = jax.eval_shape(lambda k: step(reset(k)[0], k)[1], key)
        total = jax.tree.map(lambda x: jnp.zeros(x.shape, jnp.float32), shapes)
        return jax.lax.fori_loop(0, count, episode, (key, total))

    def run(count: int) -> None:
        jax.block_until_ready(episodes(jax.random.key(count), count))

    run(1)
    return run


def rover_batched(worlds: int, preset: str) -> Run:
    """Ours: `step_worlds`, the world axis last."""
    import jax

    from skillcrew.envs.registry import make

    env = make(preset)
    shape = (env.n_agents, env.action_size, worlds)

    def reset(key: Any) -> tuple[Any, Any]:
        return env.reset_worlds(jax.random.split(key, worlds))

    def step(state: Any, key: Any) -> tuple[Any, Any]:
        action = jax.random.uniform(key, shape, minval=-1.0, maxval=1.0)
        state, out = env.step_worlds(state, action, None)  # Rovers move without noise: no keys.
        return state, (out.observation, out.local_rewards, out.team_reward, out.terminated, out.truncated)

    return jax_run(reset, step)


def rover_vmapped(worlds: int, preset: str) -> Run:
    """Ours through plain `jax.vmap(env.step)`, the world axis first."""
    import jax

    from skillcrew.envs.registry import make

    env = make(preset)
    shape = (worlds, env.n_agents, env.action_size)

    def reset(key: Any) -> tuple[Any, Any]:
        return jax.vmap(env.reset)(jax.random.split(key, worlds))

    def step(state: Any, key: Any) -> tuple[Any, Any]:
        action = jax.random.uniform(key, shape, minval=-1.0, maxval=1.0)
        state, out = jax.vmap(env.step, in_axes=(0, 0, None))(state, action, key)
        return state, (out.observation, out.local_rewards, out.team_reward, out.terminated, out.truncated)

    return jax_run(reset, step)


def jaxmarl_spread(worlds: int, agents: int, landmarks: int) -> Run:
    """JaxMARL's `simple_spread` through `step_env`.

    Its `step` would compute a reset at every step, to restart finished worlds on the spot.
    """
    import jax
    import jaxmarl

    env = jaxmarl.make(
        "MPE_simple_spread_v3",
        num_agents=agents,
        num_landmarks=landmarks,
        action_type="Continuous",
        max_steps=EPISODE,
    )
    size = env.action_space(env.agents[0]).shape[0]

    def reset(key: Any) -> tuple[Any, Any]:
        observation, state = jax.vmap(env.reset)(jax.random.split(key, worlds))
        return state, observation

    def step(state: Any, key: Any) -> tuple[Any, Any]:
        key_action, key_step = jax.random.split(key)
        actions = jax.random.uniform(key_action, (agents, worlds, size))
        action = dict(zip(env.agents, actions, strict=True))
        keys = jax.random.split(key_step, worlds)
        observation, state, reward, done, _ = jax.vmap(env.step_env)(keys, state, action)
        return state, (observation, reward, done)

    return jax_run(reset, step)


def vmas_discovery(worlds: int, agents: int, targets: int, coupling: int) -> Run:
    """VMAS's `discovery`; PyTorch runs eagerly, so nothing it computes can be dropped."""
    import torch
    import vmas

    torch.set_num_threads(1)
    env = vmas.make_env(
        "discovery",
        num_envs=worlds,
        device="cpu",
        continuous_actions=True,
        n_agents=agents,
        n_targets=targets,
        agents_per_target=coupling,
        targets_respawn=False,
    )

    def steps(count: int) -> None:
        env.reset()
        for _ in range(count):
            env.step([torch.rand(worlds, 2) * 2 - 1 for _ in range(agents)])

    def run(count: int) -> None:
        with torch.inference_mode():
            for _ in range(count):
                steps(EPISODE)

    with torch.inference_mode():
        steps(2)
    return run


# Each side has as many agents as ours in the case of the same number, and as many landmarks or
# targets as ours has POIs; the targets of `discovery` need as many agents as our POIs do.
SIDES: dict[str, dict[str, Build]] = {
    "skillcrew": {
        "1 agent": functools.partial(rover_batched, preset="rover-t2-c1"),
        "2 agents": functools.partial(rover_batched, preset="rover-t2-c2"),
        "6 agents": functools.partial(rover_batched, preset="rover-t3-c3"),
        "2 agents, vmap": functools.partial(rover_vmapped, preset="rover-t2-c2"),
        "6 agents, vmap": functools.partial(rover_vmapped, preset="rover-t3-c3"),
    },
    "jaxmarl": {
        "2 agents": functools.partial(jaxmarl_spread, agents=2, landmarks=2),
        "6 agents": functools.partial(jaxmarl_spread, agents=6, landmarks=3),
    },
    "vmas": {
        "2 agents": functools.partial(vmas_discovery, agents=2, targets=2, coupling=2),
        "6 agents": functools.partial(vmas_discovery, agents=6, targets=3, coupling=3),
    },
}
"""What each side measures; one with the same name as ours is compared with it."""

PACKAGES = {
    "skillcrew": ("skillcrew", "jax", "jaxlib"),
    "jaxmarl": ("jaxmarl",),
    "vmas": ("vmas", "torch"),
}
"""Packages whose versions each side reports; the first is the one it cannot do without."""


def rate(run: Run, worlds: int) -> float:
    """Environment steps per second, over enough episodes to tell."""
    count = 1
    while True:
        start = time.process_time()
        run(count)
        elapsed = time.process_time() - start
        if elapsed >= CALIBRATION_SECONDS:
            return count * EPISODE * worlds / elapsed
        # The clock may not have moved at all; more than tenfold is not trusted to so short a time.
        count = 1 + int(count * min(10.0, 1.2 * CALIBRATION_SECONDS / max(elapsed, 1e-6)))


def fastest(build: Build, candidates: list[int]) -> tuple[int, float, Run]:
    """The number of worlds with the highest rate, that rate, and its runner."""
    best: tuple[int, float, Run] | None = None
    for worlds in candidates:
        run = build(worlds)
        measured = rate(run, worlds)
        if best is None or measured > best[1]:
            best = (worlds, measured, run)
    assert best is not None
    return best


def measure(run: Run, episodes: int, worlds: int) -> dict[str, float]:
    """One repetition: steps per second, and the share of the core that this process got.

    The seconds are processor time, of all threads: with one core and nothing to wait for that is
    the elapsed time, less what other programs took of the core.
    """
    start, start_cpu = time.perf_counter(), time.process_time()
    run(episodes)
    elapsed, cpu = time.perf_counter() - start, time.process_time() - start_cpu
    return {"rate": episodes * EPISODE * worlds / cpu, "share": cpu / elapsed}


def start(side: str, seconds: float, candidates: list[int]) -> Started:
    """Makes the cases of a side ready; names the module that it lacks, if any."""
    one_thread()
    package = PACKAGES[side][0]
    try:
        importlib.import_module(package)
    except ModuleNotFoundError as error:
        return {"missing": error.name or package}, lambda _: {}
    cases = {name: fastest(build, candidates) for name, build in SIDES[side].items()}

    def answer(command: dict[str, Any]) -> dict[str, Any]:
        worlds, measured, run = cases[command["case"]]
        episodes = max(1, round(seconds * measured / (EPISODE * worlds)))
        return measure(run, episodes, worlds)

    ready = {
        "worlds": {name: worlds for name, (worlds, _, _) in cases.items()},
        "versions": machine.versions(PACKAGES[side]),
    }
    return ready, answer


if __name__ == "__main__":
    own, length, *numbers = sys.argv[1:]
    serve(lambda: start(own, float(length), [int(worlds) for worlds in numbers]))

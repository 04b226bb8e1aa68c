"""The whole training loop of MADyS on one core: how fast, where the time goes, and what it holds.

`python -m benchmarks.training` prints a page and writes `benchmarks/results/training.md`. The
process pins itself to one core and one thread before JAX starts. "At first" is the first chunk
of a run, when nearly every episode lasts to its time limit; "over the run" is all of it, and
episodes get shorter as teams get better while the learners' work stays the same.
"""

import argparse
import os
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

if __name__ == "__main__":
    os.environ["XLA_FLAGS"] = "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1"
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})

import jax
import jax.numpy as jnp
from benchmarks.machine import cpu_model, software, versions

from skillcrew.algorithms.madys import MADyS
from skillcrew.algorithms.skill_teams import SkillTeamsState
from skillcrew.algorithms.skill_training import train_skills
from skillcrew.envs.registry import make
from skillcrew.experiment import generation
from skillcrew.experiment.config import RunConfig
from skillcrew.policies.selector import SelectorConfig
from skillcrew.policies.team import SkillTeam
from skillcrew.replay import transitions_of
from skillcrew.rollout import Trajectories, rollout

PAGE = Path(__file__).parent / "results" / "training.md"


def seconds_per_call(function: Callable, *arguments: Any, repeats: int = 5) -> float:
    """Least processor time of one call of a compiled function, after one that is not counted."""
    jax.block_until_ready(function(*arguments))
    times = []
    for _ in range(repeats):
        began = time.process_time()
        jax.block_until_ready(function(*arguments))
        times.append(time.process_time() - began)
    return min(times)


def matrix_product_rate(size: int = 1024) -> float:
    """This core's floating point operations per second in a large single-precision matrix product."""
    matrix = jax.random.normal(jax.random.key(0), (size, size))
    return 2 * size**3 / seconds_per_call(jax.jit(jnp.matmul), matrix, matrix)


def update_operations(algorithm: MADyS) -> float:
    """Floating point operations of one generation's learning, matrix products alone.

    Per sample: target actor and target critics forward, critics forward and backward; every
    `policy_delay` updates also actor and one critic forward, the critic's input gradient, and
    the actor backward. A backward pass is two forward ones, less the first layer's input
    gradient where nothing asks for it.
    """
    env, config = algorithm.env, algorithm.config.learner
    inner = sum(a * b for a, b in zip(config.network.hidden, config.network.hidden[1:], strict=False))
    first, last = config.network.hidden[0], config.network.hidden[-1]
    actor = env.observation_size * first + inner + last * env.action_size
    critic_first = (env.observation_size + env.action_size) * first
    critic = critic_first + inner + last
    of_critics = actor + 4 * config.critics * critic - config.critics * critic_first
    of_actor = actor + 2 * critic + 2 * actor - env.observation_size * first
    per_sample = of_critics + of_actor / config.policy_delay
    return 2 * per_sample * config.batch_size * algorithm.config.updates * len(algorithm.choices())


def rollout_program(algorithm: MADyS) -> Callable[[SkillTeamsState, Any], Trajectories]:
    """The first part of a generation, lines 6 to 9 of Algorithm 1, as a program of its own."""
    search, learning, env = algorithm._search, algorithm._skills, algorithm.env

    def live(state: SkillTeamsState, key: Any) -> Trajectories:
        skills = state.skills.in_use()
        start = search.start(key)
        teams = search.lineup(state.search, start, lambda own: SkillTeam(own, skills, env.n_agents))
        lineup = teams.beside(learning.probes(state.skills, start))
        noise = learning.noise(~state.skills.plateau.stopped.all())
        return rollout(env, lineup, key, noise, algorithm._recorded())[1]

    return jax.jit(live)


def parts(algorithm: MADyS, state: SkillTeamsState) -> dict[str, float]:
    """Processor seconds that each part of a generation takes on its own."""
    key = jax.random.key(1)
    config, learning = algorithm.config, algorithm._skills
    live = rollout_program(algorithm)
    lived = live(state, key)
    evolver, ones = algorithm._search._evolver, jnp.ones(config.population)
    evolve = jax.jit(lambda k, s: evolver.next_generation(k, s, ones, ones))

    def train(key, state):
        return train_skills(
            key,
            learning._learner,
            state.learners,
            state.plateau.stopped,
            learning._buffer,
            state.experience,
            config.updates,
            config.task_ends_skills,
        )

    return {
        "rollout": seconds_per_call(live, state, key),
        "update": seconds_per_call(jax.jit(train), key, state.skills),
        "evolution": seconds_per_call(evolve, key, state.search),
        "buffer": buffer_seconds(algorithm, lived)[0],
    }


def buffer_seconds(algorithm: MADyS, lived: Any) -> tuple[float, float, bool]:
    """Seconds of an add in place and of one that copies; whether the donated buffer stayed in place."""
    buffer = algorithm._skills._buffer
    items, mask = transitions_of(lived)
    copying = jax.jit(buffer.add)
    in_place = jax.jit(buffer.add, donate_argnums=0)
    state = jax.tree.map(jnp.array, buffer.init())
    copied = seconds_per_call(copying, state, items, mask)
    place = state.experience.unsafe_buffer_pointer()
    times = []
    for _ in range(6):
        began = time.process_time()
        state = jax.block_until_ready(in_place(state, items, mask))
        times.append(time.process_time() - began)
    return min(times), copied, state.experience.unsafe_buffer_pointer() == place


def train(algorithm: MADyS, steps: int) -> tuple[float, list[tuple[int, float]], Any]:
    """Compile seconds (wall), steps and processor seconds of each chunk, and the last state."""
    config = RunConfig(seeds=(2000,), steps=steps)
    runs = jax.jit(jax.vmap(lambda seed: generation.initial_state(algorithm, seed)))(
        generation.seeds_of(config)
    )
    began = time.perf_counter()
    chunk = generation.CompiledChunk(algorithm, config, runs)
    compiled = time.perf_counter() - began
    rates, lived = [], 0
    while lived < steps:
        began = time.process_time()
        runs, metrics = jax.block_until_ready(chunk(runs))
        now = int(metrics["environment_steps"][0, -1])
        rates.append((now - lived, time.process_time() - began))
        lived = now
    return compiled, rates, jax.tree.map(lambda leaf: leaf[0], runs).algorithm


def peak_memory(steps: str = "1e5") -> float:
    """GiB that the default run holds at its peak; its buffer is there from the start."""
    words = ["train", "madys", "rover-t2-c1", "--steps", steps, "--report-episodes", "100"]
    code = (
        "import resource, sys, tempfile\n"
        "from skillcrew.cli.main import run_command\n"
        "with tempfile.TemporaryDirectory() as folder:\n"
        f"    run_command({words!r} + ['--out', folder + '/run'])\n"
        "print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)\n"
    )
    output = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    return int(output.split()[-1]) / 2**20


def page(steps: int) -> str:
    """Measures everything, as Markdown."""
    sizes = {"population": 40, "episodes": 10, "updates": 100, "selector": SelectorConfig(hidden=(64,))}
    algorithm = MADyS(make("rover-t2-c1"), **sizes)
    rate = matrix_product_rate()
    compiled, chunks, state = train(algorithm, steps)
    seconds = parts(algorithm, state)
    lived = rollout_program(algorithm)(state, jax.random.key(2))
    in_place, copied, stayed = buffer_seconds(algorithm, lived)
    learned = update_operations(algorithm) / seconds["update"]
    total = sum(seconds.values())
    over_run = sum(lived for lived, _ in chunks) / sum(spent for _, spent in chunks)
    rows = [
        ("environment steps per second and core, at first", f"{chunks[1][0] / chunks[1][1]:,.0f}", "60,000"),
        (f"environment steps per second and core, over a run of {steps:,}", f"{over_run:,.0f}", ""),
        ("matrix products, GFLOP/s of one core", f"{rate / 1e9:.0f}", ""),
        ("update, GFLOP/s of matrix products", f"{learned / 1e9:.0f}", ""),
        ("update, share of the core's matrix-product rate", f"{learned / rate:.0%}", "40 %"),
        *((f"share of time in {name}", f"{part / total:.1%}", "") for name, part in seconds.items()),
        ("compiling the training program, seconds", f"{compiled:.1f}", "below 15"),
        ("peak memory of the default run, GiB", f"{peak_memory():.2f}", "below 1.5"),
        ("adding a generation to the buffer in place, ms", f"{in_place * 1e3:.2f}", ""),
        ("the same with a copy of the buffer, ms", f"{copied * 1e3:.2f}", ""),
        ("the donated buffer stayed at its address", "yes" if stayed else "NO", "yes"),
    ]
    lines = [
        "# The training loop on one core",
        "",
        cpu_model() + ". " + software(versions(["jax", "jaxlib"])) + ".",
    ]
    lines += [
        "",
        "MADyS on rover-t2-c1: hidden 64, population 40, 10 episodes, 100 updates per skill and generation.",
    ]
    lines += ["", "| what | measured | bar |", "|---|---|---|"]
    return "\n".join([*lines, *(f"| {' | '.join(row)} |" for row in rows)]) + "\n"


def main() -> None:
    """Prints the page and writes it beside the others."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--steps", type=float, default=2e6, help="environment steps of the run (default: 2e6)"
    )
    text = page(round(parser.parse_args().steps))
    print(text)
    PAGE.parent.mkdir(exist_ok=True)
    PAGE.write_text(text)


if __name__ == "__main__":
    main()

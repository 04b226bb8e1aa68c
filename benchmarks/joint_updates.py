"""Updates of MADDPG and MATD3 on one core, beside the rate of a plain matrix product.

`python -m benchmarks.joint_updates` prints a table and writes `benchmarks/results/joint_updates.md`. The
process pins itself to one core and one thread before JAX starts; figures are processor time.
"""

import os
import statistics
from collections.abc import Callable
from pathlib import Path
from typing import Any

if __name__ == "__main__":
    os.environ["XLA_FLAGS"] = "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1"
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})

import jax
from benchmarks.machine import cpu_model, software, versions
from benchmarks.training import matrix_product_rate, seconds_per_call

import skillcrew as sc
from skillcrew.learners.training import train_learners

PAGE = Path(__file__).parent / "results" / "joint_updates.md"
ENVIRONMENTS = ("rover-t2-c2", "rover-t3-c3")
UPDATES, ROUNDS = 20, 5

HEADER = """\
# Updates with critics that see the whole team

{machine}, one core; {software}.
{updates} updates at default sizes, drawing their batches from the buffer included; medians of {rounds}
rounds, in each of which the plain product of two matrices of 1024 is measured, too. Operations are those of
matrix products that an update cannot do without.

| algorithm | critics | environment | agents | an update | its matrix products | the plain one | share |
|---|---|---|---|---|---|---|---|"""


def operations(algorithm: Any) -> float:
    """Floating point operations of one update of the critics, matrix products alone.

    Per step of the team: target actors and target critics forward, critics forward and backward; every
    `policy_delay` updates also actors forward and backward, and of the first critic of each agent forward and
    the gradient of its input, of which the agent's own action is needed. A backward pass is two forward ones,
    less the first layer's input gradient where nothing asks for it.
    """
    env, config = algorithm.env, algorithm.config.learner
    first, *_, last = config.network.hidden
    inner = sum(a * b for a, b in zip(config.network.hidden, config.network.hidden[1:], strict=False))
    actor = env.observation_size * first + inner + last * env.action_size
    one_each = algorithm.config.critic_sharing == "agent"
    critic_first = env.n_agents * (env.observation_size + env.action_size) * first
    critic = critic_first + inner + last * (1 if one_each else env.n_agents)
    critics = config.critics * (env.n_agents if one_each else 1)
    of_critics = env.n_agents * actor + critics * (4 * critic - critic_first)
    judged = 2 * critic - critic_first + env.action_size * first
    of_actors = env.n_agents * (3 * actor - env.observation_size * first + judged)
    return 2 * config.batch_size * (of_critics + of_actors / config.policy_delay)


def updates(algorithm: Any) -> Callable[[], Any]:
    """A compiled program of updates from a buffer that one generation has filled."""
    state, _ = jax.jit(algorithm.step)(jax.jit(algorithm.init)(jax.random.key(0)))
    learning = algorithm._actors

    @jax.jit
    def train(learners: Any, experience: Any, key: Any) -> Any:
        return train_learners(
            key, learning._learner, learners, lambda k: learning._draw(k, experience), UPDATES
        )

    return lambda: train(state.actors.learners, state.actors.experience, jax.random.key(1))


def row(kind: Any, sharing: str, environment: str) -> str:
    """Of one algorithm in one environment."""
    algorithm = kind(sc.make(environment), critic_sharing=sharing, updates=UPDATES)
    train, ops = updates(algorithm), operations(algorithm)
    spent, shares, plain = [], [], []
    for _ in range(ROUNDS):
        plain.append(matrix_product_rate())
        spent.append(seconds_per_call(train, repeats=1) / UPDATES)
        shares.append(ops / spent[-1] / plain[-1])
    took, rate = statistics.median(spent), statistics.median(plain)
    cells = (
        algorithm.name,
        "one for each agent" if sharing == "agent" else "one for all",
        f"`{environment}`",
        str(algorithm.env.n_agents),
        f"{took * 1e3:.1f} ms",
        f"{ops / took / 1e9:.0f} GFLOP/s",
        f"{rate / 1e9:.0f} GFLOP/s",
        f"{statistics.median(shares):.0%}",
    )
    return f"| {' | '.join(cells)} |"


def main() -> None:
    """Measures every case, prints the table and writes the page."""
    found = software(versions(("jax",)))
    lines = [HEADER.format(machine=cpu_model(), software=found, updates=UPDATES, rounds=ROUNDS)]
    print(lines[0], flush=True)
    for environment in ENVIRONMENTS:
        for kind in (sc.MADDPG, sc.MATD3):
            for sharing in ("agent", "team"):
                lines.append(row(kind, sharing, environment))
                print(lines[-1], flush=True)
    PAGE.write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()

"""Our IPPO and MAPPO beside JaxMARL's own on its `simple_spread`, its files unchanged, in one run.

    python -m benchmarks.jaxmarl_ppo CHECKOUT            # a checkout of FLAIROx/JaxMARL

Theirs have the settings of their own YAML files, but for the number of steps and the seed; ours our
defaults, or as many units of memory as theirs have. Both are paid each agent's own reward. Prints a page and
writes it to `results/jaxmarl_ppo.md`.
"""

import argparse
import dataclasses
import statistics
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from benchmarks.machine import cpu_model, software, versions
from benchmarks.stepping_sides import one_thread

if __name__ == "__main__":
    one_thread()

import jax
import numpy as np
from benchmarks import jaxmarl_baseline

import skillcrew as sc
from skillcrew.intervals import seed_interval

PAGE = Path(__file__).parent / "results" / "jaxmarl_ppo.md"
PACKAGES = ("jax", "jaxmarl", "flax", "distrax", "optax")
TASK = "MPE_simple_spread_v3"
RECURRENT = sc.PolicyConfig(hidden=(128,), memory=128, sharing="team")
HEAD = """# PPO beside JaxMARL's

{machine}; {software}; JaxMARL's repository at {commit}, unchanged. One thread.

`{task}` with three agents and discrete actions, {steps:g} M environment steps. Returns are sums
over agents, of episodes lived while it learns: the mean over the last tenth of the updates, for seeds 0 to
{last}, then their mean and 95 % interval. Seconds are one seed's on the processor, without compiling.

| method | return, first tenth | last tenth, each seed | mean | seconds | steps per second | compiling |
|---|---|---|---|---|---|---|"""


@dataclasses.dataclass(frozen=True)
class Outcome:
    """One seed's training."""

    returns: np.ndarray
    """Of each update."""
    compiling: float
    seconds: float


def theirs(checkout: Path, file: str, settings: str) -> Callable[[int, float], Outcome]:
    """JaxMARL's own training of a seed for so many steps."""
    place = Path(file)
    baseline = jaxmarl_baseline.load(checkout, place)
    own = jaxmarl_baseline.settings(checkout, place.parent / "config" / settings)
    baseline.wandb.init(mode="disabled")

    def train(seed: int, steps: float) -> Outcome:
        config = own | {"ENV_NAME": TASK, "TOTAL_TIMESTEPS": int(steps)}
        found, compiling, seconds = timed(baseline.make_train(config), jax.random.PRNGKey(seed))
        returns = np.asarray(found["metrics"]["returned_episode_returns"])
        return Outcome(returns.reshape(len(returns), -1).mean(1), compiling, seconds)

    return train


def ours(name: str, **fields: Any) -> Callable[[int, float], Outcome]:
    """Our training of a seed for so many steps."""
    env = sc.make(f"jaxmarl:{TASK}", team_reward="sum")
    kind: Any = {"ippo": sc.IPPO, "mappo": sc.MAPPO}[name]
    algorithm = kind(env, reward="own_reward", **fields)

    def train(seed: int, steps: float) -> Outcome:
        generations = int(steps) // (algorithm.config.episodes * env.episode_length)

        def run(key: jax.Array) -> Any:
            start = algorithm.init(key)
            return jax.lax.scan(lambda state, _: algorithm.step(state), start, length=generations)[1]

        metrics, compiling, seconds = timed(run, jax.random.key(seed))
        return Outcome(np.asarray(metrics["fitness_mean"]), compiling, seconds)

    return train


def timed(run: Callable[[jax.Array], Any], key: jax.Array) -> tuple[Any, float, float]:
    """What it gives, and the seconds of the processor that compiling and running took."""
    began = time.process_time()
    compiled = jax.jit(run).lower(key).compile()
    between = time.process_time()
    found = jax.block_until_ready(compiled(key))
    return found, between - began, time.process_time() - between


def sides(checkout: Path) -> Iterator[tuple[str, Callable[[], Callable[[int, float], Outcome]]]]:
    """Each row's title, and what makes its training."""
    recurrent = {"policy": RECURRENT, "critic": RECURRENT}
    ff = "baselines/IPPO/ippo_ff_mpe.py", "ippo_ff_mpe.yaml"
    rnn = "baselines/MAPPO/mappo_rnn_mpe.py", "mappo_homogenous_rnn_mpe.yaml"
    yield "JaxMARL's IPPO, feed-forward", lambda: theirs(checkout, *ff)
    yield "our IPPO", lambda: ours("ippo")
    yield "our MAPPO", lambda: ours("mappo")
    yield "JaxMARL's MAPPO, GRU of 128", lambda: theirs(checkout, *rnn)
    yield "our MAPPO, GRU of 128", lambda: ours("mappo", **recurrent)


def row(outcomes: list[Outcome], steps: float) -> str:
    """Cells of a row."""
    tenth = max(1, len(outcomes[0].returns) // 10)
    last = [float(outcome.returns[-tenth:].mean()) for outcome in outcomes]
    first = statistics.mean(float(outcome.returns[:tenth].mean()) for outcome in outcomes)
    over_seeds = seed_interval(np.array(last), -np.inf, np.inf)
    seconds = statistics.mean(outcome.seconds for outcome in outcomes)
    compiling = statistics.mean(outcome.compiling for outcome in outcomes)
    cells = [
        f"{first:.2f}",
        " ".join(f"{value:.2f}" for value in last),
        f"{over_seeds.mean:.2f} [{over_seeds.low:.2f}, {over_seeds.high:.2f}]",
        f"{seconds:.0f}",
        f"{steps / seconds:,.0f}",
        f"{compiling:.0f} s",
    ]
    return " | ".join(cells)


def main() -> None:
    """Trains every side, prints the page and writes it."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("checkout", type=Path, help="a checkout of FLAIROx/JaxMARL")
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--steps", type=float, default=2e6)
    parser.add_argument("--only", default="", help="rows whose title contains this")
    arguments = parser.parse_args()
    page: list[str] = []

    def say(text: str) -> None:
        print(text, flush=True)
        page.append(text)

    says = {"task": TASK, "steps": arguments.steps / 1e6, "last": arguments.seeds - 1}
    commit = jaxmarl_baseline.commit(arguments.checkout)
    installed = software(versions(PACKAGES))
    say(HEAD.format(**says, machine=cpu_model(), software=installed, commit=commit))
    for title, make in sides(arguments.checkout):
        if arguments.only in title:
            train = make()
            outcomes = [train(seed, arguments.steps) for seed in range(arguments.seeds)]
            say(f"| {title} | {row(outcomes, arguments.steps)} |")
    if not arguments.only:
        PAGE.write_text("\n".join(page) + "\n")


if __name__ == "__main__":
    main()

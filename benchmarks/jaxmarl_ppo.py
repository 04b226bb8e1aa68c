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
from collections.abc import Callable
from pathlib import Path
from typing import Any

from benchmarks.machine import cpu_model, software, versions
from benchmarks.stepping_sides import one_thread

if __name__ == "__main__":
    one_thread()

import jax
import numpy as np
from benchmarks import jaxmarl_baseline
from benchmarks.checkout import commit

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
class Side:
    """One method, made ready to train seeds for so many steps."""

    train: Callable[[jax.Array], Any]
    """Of a seed's key."""
    key: Callable[[int], jax.Array]
    returns: Callable[[Any], np.ndarray]
    """Of each update, of what training gives."""


@dataclasses.dataclass(frozen=True)
class Outcomes:
    """What came out."""

    returns: list[np.ndarray]
    """Each seed's, of each update."""
    compiling: float
    seconds: list[float]


def theirs(checkout: Path, steps: float, file: str, settings: str) -> Side:
    """JaxMARL's own."""
    place = Path(file)
    baseline = jaxmarl_baseline.load(checkout, place)
    own = jaxmarl_baseline.settings(checkout, place.parent / "config" / settings)
    baseline.wandb.init(mode="disabled")
    train = baseline.make_train(own | {"ENV_NAME": TASK, "TOTAL_TIMESTEPS": int(steps)})

    def returns(found: Any) -> np.ndarray:
        of_updates = np.asarray(found["metrics"]["returned_episode_returns"])
        return of_updates.reshape(len(of_updates), -1).mean(1)

    return Side(train, jax.random.PRNGKey, returns)


def ours(steps: float, kind: Any, **fields: Any) -> Side:
    """Ours, each agent paid its own reward as theirs are."""
    algorithm = kind(sc.make(f"jaxmarl:{TASK}", team_reward="sum"), reward="own_reward", **fields)
    generations = int(steps) // (algorithm.config.episodes * algorithm.env.episode_length)

    def train(key: jax.Array) -> Any:
        start = algorithm.init(key)
        return jax.lax.scan(lambda state, _: algorithm.step(state), start, length=generations)[1]

    return Side(train, jax.random.key, lambda metrics: np.asarray(metrics["fitness_mean"]))


def sides(checkout: Path, steps: float) -> dict[str, Callable[[], Side]]:
    """Each row's title, and what makes it ready."""
    ff = "baselines/IPPO/ippo_ff_mpe.py", "ippo_ff_mpe.yaml"
    rnn = "baselines/MAPPO/mappo_rnn_mpe.py", "mappo_homogenous_rnn_mpe.yaml"
    recurrent = {"policy": RECURRENT, "critic": RECURRENT}
    return {
        "JaxMARL's IPPO, feed-forward": lambda: theirs(checkout, steps, *ff),
        "our IPPO": lambda: ours(steps, sc.IPPO),
        "our MAPPO": lambda: ours(steps, sc.MAPPO),
        "JaxMARL's MAPPO, GRU of 128": lambda: theirs(checkout, steps, *rnn),
        "our MAPPO, GRU of 128": lambda: ours(steps, sc.MAPPO, **recurrent),
    }


def trained(side: Side, seeds: int) -> Outcomes:
    """Trains one seed after the other; seconds are the processor's."""
    began = time.process_time()
    compiled = jax.jit(side.train).lower(side.key(0)).compile()
    compiling, returns, seconds = time.process_time() - began, [], []
    for seed in range(seeds):
        began = time.process_time()
        found = jax.block_until_ready(compiled(side.key(seed)))
        seconds.append(time.process_time() - began)
        returns.append(side.returns(found))
    return Outcomes(returns, compiling, seconds)


def row(outcomes: Outcomes, steps: float) -> str:
    """Cells of a row."""
    tenth = max(1, len(outcomes.returns[0]) // 10)
    last = [float(returns[-tenth:].mean()) for returns in outcomes.returns]
    first = statistics.mean(float(returns[:tenth].mean()) for returns in outcomes.returns)
    over_seeds = seed_interval(np.array(last), -np.inf, np.inf)
    seconds = statistics.mean(outcomes.seconds)
    cells = [
        f"{first:.2f}",
        " ".join(f"{value:.2f}" for value in last),
        f"{over_seeds.mean:.2f} [{over_seeds.low:.2f}, {over_seeds.high:.2f}]",
        f"{seconds:.0f}",
        f"{steps / seconds:,.0f}",
        f"{outcomes.compiling:.0f} s",
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
    at = commit(arguments.checkout, jaxmarl_baseline.FOLDER)
    installed = software(versions(PACKAGES))
    say(HEAD.format(**says, machine=cpu_model(), software=installed, commit=at))
    for title, make in sides(arguments.checkout, arguments.steps).items():
        if arguments.only in title:
            say(f"| {title} | {row(trained(make(), arguments.seeds), arguments.steps)} |")
    if not arguments.only:
        PAGE.write_text("\n".join(page) + "\n")


if __name__ == "__main__":
    main()

"""Who learns as coupling grows: the team's reward, D, D++ and a local reward, on one type of POI.

    python -m benchmarks.coupling            # prints a page and writes results/coupling.md, about two hours

Six rovers, four POIs of one type, dense team reward (the share of POIs observed). A POI takes 1, 2, 3, 4 or
all 6 of them at once. Two learners that could hardly be less alike: gradients (`ippo`) and coevolution
(`ccea`, whose individuals are bred for their own agent's credit); all options at their defaults. Local
rewards are for gradients only.
"""

import argparse
import itertools
from pathlib import Path
from typing import Any

import jax
import numpy as np
from benchmarks.machine import cpu_model, software, versions

import skillcrew as sc
from skillcrew.intervals import seed_interval
from skillcrew.rollout import Lineup, Start, rollout

PAGE = Path(__file__).parent / "results" / "coupling.md"
TASK = "rover-p4-c1-value"
COUPLINGS = (1, 2, 3, 4, 6)
REWARDS = {"the team's": "team", "D": "D", "D++": "D++", "go_to_poi_A": "go_to_poi_A"}
METHODS: dict[str, tuple[Any, float, tuple[str, ...]]] = {
    "ippo": (sc.IPPO, 4e5, tuple(REWARDS)),
    "ccea": (sc.CCEA, 2e6, ("the team's", "D", "D++")),
}
"""What learns, for how many environment steps, on which rewards."""
EPISODES = 500
HEAD = """# Difference rewards as coupling grows

{machine}; {software}.

`{task}`: six rovers, four POIs, 50 steps; the team is paid a quarter for each POI that `coupling` rovers
observe at once. Share of POIs observed in {episodes} fresh episodes after so many environment steps: mean
over seeds 0 to {last}, its 95 % interval, and in brackets the lowest and the highest seed.

| learner | steps | reward | {couplings} |
|---|---|---|{rules}|"""


def cell(kind: Any, reward: str, steps: float, coupling: int, seeds: int) -> str:
    """What was learned from one reward at one coupling."""
    env = sc.make(TASK, spatial_coupling=coupling)
    scores = trained(kind(env, reward=reward), steps, seeds)
    over = seed_interval(scores)
    return f"{over.mean:.3f} [{over.low:.3f}, {over.high:.3f}] ({scores.min():.2f} to {scores.max():.2f})"


def trained(algorithm: Any, steps: float, seeds: int) -> np.ndarray:
    """Each seed's mean return on fresh episodes, once all have lived so many steps."""
    keys = jax.vmap(jax.random.key)(np.arange(seeds))
    state = jax.jit(jax.vmap(algorithm.init))(keys)
    step = jax.jit(jax.vmap(algorithm.step), donate_argnums=0)
    metrics: dict[str, Any] = {"environment_steps": np.zeros(1)}
    while np.asarray(metrics["environment_steps"]).min() < steps:
        state, metrics = step(state)

    def score(state: Any, key: jax.Array) -> jax.Array:
        key_start, key_rollout = jax.random.split(key)
        start = Start.draw(algorithm.env, key_start, EPISODES)
        lineup = Lineup.of_team(algorithm.team(state), start)
        return rollout(algorithm.env, lineup, key_rollout)[0].team_return().mean()

    fresh = jax.random.split(jax.random.key(10_000), seeds)
    return np.asarray(jax.jit(jax.vmap(score))(state, fresh))


def main() -> None:
    """Trains every cell, prints the page and writes it."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--share", type=float, default=1.0, help="of the steps; less for a quick look")
    parser.add_argument("--only", default="", help="rows of this learner")
    arguments = parser.parse_args()
    page: list[str] = []

    def say(text: str) -> None:
        print(text, flush=True)
        page.append(text)

    say(
        HEAD.format(
            machine=cpu_model(),
            software=software(versions(["jax", "skillcrew"])),
            task=TASK,
            episodes=EPISODES,
            last=arguments.seeds - 1,
            couplings=" | ".join(f"coupling {coupling}" for coupling in COUPLINGS),
            rules="|".join("---" for _ in COUPLINGS),
        )
    )
    for name, title in itertools.product(METHODS, REWARDS):
        kind, steps, learned = METHODS[name]
        if title not in learned or arguments.only not in name:
            continue
        budget = steps * arguments.share
        cells = (cell(kind, REWARDS[title], budget, coupling, arguments.seeds) for coupling in COUPLINGS)
        say(f"| `{name}` | {budget / 1e6:g} M | {title} | {' | '.join(cells)} |")
    if not arguments.only:
        PAGE.write_text("\n".join(page) + "\n")


if __name__ == "__main__":
    main()

"""JaxMARL's own IPPO, its file unchanged, on `rover-t2-c1` behind `sc.jaxmarl_env`.

    python -m benchmarks.jaxmarl_ippo CHECKOUT           # a checkout of FLAIROx/JaxMARL

The baseline is JaxMARL's for continuous actions, `baselines/IPPO/ippo_ff_mabrax.py`, with the settings of
its own YAML file but for the environment, the number of steps and the seed. Rows differ in what it is paid
for. Its policies, an agent that acts at random and two that are told where everything is then live fresh
episodes. Prints a page and writes it to `results/jaxmarl_ippo.md`.
"""

import argparse
import statistics
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from benchmarks.machine import cpu_model, software, versions
from benchmarks.stepping_sides import one_thread

if __name__ == "__main__":
    one_thread()

import jax
from benchmarks import jaxmarl_baseline
from benchmarks.checkout import commit
from benchmarks.jaxmarl_agents import TOLD, policy, score
from benchmarks.jaxmarl_baseline import make

PAGE = Path(__file__).parent / "results" / "jaxmarl_ippo.md"
PACKAGES = ("jax", "jaxmarl", "flax", "distrax", "tfp-nightly", "optax", "wandb")
TASK = "rover-t2-c1"
REWARDS: dict[str, dict[str, Any]] = {
    "closeness to A": {"skills": ("go_to_poi_A",)},
    "closeness to A plus that to B": {"skills": ("go_to_poi_A", "go_to_poi_B")},
    "the team's reward, sparse": {},
}
STRONG = {"poi_values": (100.0, 100.0)}
"""POIs that reflect a hundred times as strongly: a reading is 100/δ² and no longer 1/δ²."""
STEPS = 3e6
"""Of a row; one has as many as the baseline's own file says."""
EPISODES = 2000
HEAD = """# JaxMARL's IPPO on `{task}`

{machine}; {software}; JaxMARL's repository at {commit}, `{file}` unchanged.

Return of an episode, and the share of finished ones; a figure for each of seeds 0 to {last}. Returns in
training are means over the updates' steps of the last episode that was over, 0 before the first. What was
learned then lives {episodes} fresh episodes, acting as in training. Seconds are those of a seed's training,
elapsed; in brackets those of the processor, and those for compiling, which come on top.

| paid for | steps | return, first tenth of updates | last tenth | fresh episodes | finished | seconds \
| steps per second of the processor |
|---|---|---|---|---|---|---|---|"""
TAIL = """
What others score on the same fresh episodes: return, share of finished ones.

| paid for | {names} |
|---|---|---|---|"""


def cases(own_steps: float) -> list[tuple[str, dict[str, Any], float]]:
    """What each row says, the environment's options, environment steps."""
    first, plain = next(iter(REWARDS.items()))
    strong = [(f"{title}; readings times 100", options | STRONG, STEPS) for title, options in REWARDS.items()]
    return [(first, plain, STEPS), (f"{first}, longer", plain, own_steps), *strong]


def trained(baseline: Any, config: dict[str, Any], seeds: int) -> str:
    """Cells of a row: steps, returns at both ends of training, fresh episodes, seconds."""
    env, key = make(TASK, **config["ENV_KWARGS"]), jax.random.key(7)
    runs = [jaxmarl_baseline.train(baseline, config, seed) for seed in range(seeds)]
    tenth = max(1, len(runs[0]["returns"]) // 10)
    scores = [score(env, policy(baseline, config, run["params"]), key, EPISODES) for run in runs]
    steps = config["TOTAL_TIMESTEPS"]
    elapsed, processor, compiling = (
        statistics.mean(run[name] for run in runs) for name in ("elapsed", "processor", "compiling")
    )
    cells = [
        f"{steps / 1e6:g} M",
        listed(run["returns"][:tenth].mean() for run in runs),
        listed(run["returns"][-tenth:].mean() for run in runs),
        listed(mean for mean, _ in scores),
        listed((finished for _, finished in scores), ".3f"),
        f"{elapsed:.0f} ({processor:.0f} + {compiling:.0f})",
        f"{steps / processor:,.0f}",
    ]
    return " | ".join(cells)


def told(options: dict[str, Any]) -> str:
    """Cells of a row: what those score who do not learn."""
    scores = [score(make(TASK, **options), act, jax.random.key(7), EPISODES) for act in TOLD.values()]
    return " | ".join(f"{mean:.2f}, {finished:.3f}" for mean, finished in scores)


def listed(values: Iterable[Any], style: str = ".2f") -> str:
    return " ".join(format(float(value), style) for value in values)


def main() -> None:
    """Trains on every reward, prints the page and writes it."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("checkout", type=Path, help="a checkout of FLAIROx/JaxMARL")
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--share", type=float, default=1.0, help="of the steps; less for a quick look")
    arguments = parser.parse_args()
    at = commit(arguments.checkout, jaxmarl_baseline.FOLDER)
    baseline = jaxmarl_baseline.load_on_ours(arguments.checkout)
    file = jaxmarl_baseline.IPPO
    own = jaxmarl_baseline.settings(arguments.checkout, file.parent / "config" / f"{file.stem}.yaml")
    baseline.wandb.init(mode=own["WANDB_MODE"])
    page: list[str] = []

    def say(text: str) -> None:
        print(text, flush=True)
        page.append(text)

    installed = software(versions(PACKAGES))
    says = {"task": TASK, "commit": at, "file": jaxmarl_baseline.IPPO, "last": arguments.seeds - 1}
    say(HEAD.format(**says, machine=cpu_model(), software=installed, episodes=EPISODES))
    for title, options, steps in cases(own["TOTAL_TIMESTEPS"]):
        budget = {"TOTAL_TIMESTEPS": int(steps * arguments.share)}
        config = own | {"ENV_NAME": TASK, "ENV_KWARGS": options} | budget
        say(f"| {title} | {trained(baseline, config, arguments.seeds)} |")
    say(TAIL.format(names=" | ".join(TOLD)))
    for title, options in REWARDS.items():
        say(f"| {title} | {told(options)} |")
    PAGE.write_text("\n".join(page) + "\n")


if __name__ == "__main__":
    main()

"""Hybrids beside their parts on a pendulum: ERL, TD3 and EA; CERL and each of its learners on its own.

`python -m benchmarks.hybrids erl` and `python -m benchmarks.hybrids cerl` print a table of returns, and write
it with a figure into `results/family/pendulum-erl` and `…-cerl`. All have the same environment steps, the
same networks, and every learner the same updates for each step that anybody lived.
"""

import argparse
import dataclasses
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from benchmarks.machine import cpu_model, software, versions
from benchmarks.pendulum import Pendulum
from matplotlib.figure import Figure

import skillcrew as sc
from skillcrew.analysis.canvas import STYLE, layout, save
from skillcrew.analysis.curves import CURVE_COLOURS
from skillcrew.analysis.statistics import mean_band
from skillcrew.intervals import Interval, seed_interval

RESULTS = Path(__file__).parent.parent / "results" / "family"
SEEDS = (0, 1, 2, 3, 4)
UPDATES_PER_EPISODE = 40
DISCOUNTS = (0.9, 0.99, 0.997, 0.9995)
LEARNER = sc.TD3Config(discount=0.99, network=sc.NetworkConfig(input_scaling="none"))
EVOLUTION: dict[str, Any] = {
    "population": 10,
    "episodes": 3,
    "fitness_discount": 1.0,
    "evolution": sc.EvolutionConfig(elites=2, lineage_prior=0.0, champion_prior=0.0),
}


def alone(discount: float) -> sc.IndependentTD3:
    """A single learner, all of whose episodes are noisy."""
    learner = dataclasses.replace(LEARNER, discount=discount)
    return sc.IndependentTD3(Pendulum(), episodes=5, updates=5 * UPDATES_PER_EPISODE, learner=learner)


def erl_and_parts() -> dict[str, Any]:
    """ERL; its learner without evolution, its evolution without a learner."""
    lived = (EVOLUTION["population"] + 1) * EVOLUTION["episodes"] + 1
    actor = sc.PolicyConfig(hidden=LEARNER.network.hidden, input_scaling="none")
    return {
        "ERL": sc.ERL(Pendulum(), **EVOLUTION, updates=lived * UPDATES_PER_EPISODE, learner=LEARNER),
        "TD3 alone": alone(LEARNER.discount),
        "EA alone": sc.EA(Pendulum(), **EVOLUTION, actor=actor),
    }


def cerl_and_parts() -> dict[str, Any]:
    """CERL, and each of its learners without the others."""
    lived = (EVOLUTION["population"] + len(DISCOUNTS)) * EVOLUTION["episodes"] + len(DISCOUNTS)
    cerl = sc.CERL(
        Pendulum(),
        **EVOLUTION,
        discounts=DISCOUNTS,
        learner_episodes=len(DISCOUNTS),
        updates=lived * UPDATES_PER_EPISODE,
        learner=LEARNER,
    )
    return {"CERL": cerl, **{f"TD3 alone, discount {one}": alone(one) for one in DISCOUNTS}}


def train(algorithm: Any, steps: int, episodes: int) -> tuple[list[Any], np.ndarray]:
    """Each seed's environment steps and returns of its champion, and the last champions' mean returns."""
    with tempfile.TemporaryDirectory() as folder:
        run = sc.train(algorithm, seeds=SEEDS, steps=steps, out=Path(folder) / "run")
        rows = run.metrics()
        final = run.evaluate(episodes).returns.mean(1)
    curves = []
    for seed in SEEDS:
        # A run goes on to the end of its report; what it lived beyond the budget is nobody's.
        own = (rows["seed"] == seed) & (rows["environment_steps"] <= steps)
        curves.append((rows["environment_steps"][own], rows["team_return"][own]))
    return curves, final


def figure_of(curves: Mapping[str, list[Any]], title: str) -> Figure:
    """Mean returns with their intervals over environment steps."""
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(6.4, 4.6), layout=layout())
        axes = figure.subplots()
        for colour, (name, per_seed) in zip(CURVE_COLOURS, curves.items(), strict=False):
            steps, values = zip(*per_seed, strict=True)
            band = mean_band(steps, values, window=3, lower=-np.inf, upper=0.0)
            axes.plot(band.steps, band.mean, color=colour, linewidth=2, label=name)
            axes.fill_between(band.steps, band.low, band.high, color=colour, alpha=0.2, linewidth=0)
        axes.set_xlabel("Environment steps")
        axes.set_ylabel("Champion's return on fresh episodes")
        axes.set_title(title, fontsize=11)
        figure.legend(loc="outside lower center", ncols=2)
    return figure


def measure(title: str, algorithms: Mapping[str, Any], steps: int, folder: Path) -> None:
    """Trains all, prints the table, writes it and the figure."""
    curves: dict[str, list[Any]] = {}
    lines = [
        "| method | final return | mean return over the run | each seed's final return |",
        "|---|---|---|---|",
    ]
    for name, algorithm in algorithms.items():
        curves[name], final = train(algorithm, steps, episodes=500)
        grid = np.linspace(0, steps, 200)
        over_run = np.array([np.interp(grid, *rows).mean() for rows in curves[name]])
        each = " ".join(f"{value:.0f}" for value in final)
        lines.append(f"| {name} | {_said(final)} | {_said(over_run)} | {each} |")
        print(lines[-1], flush=True)
    used = software(versions(("jax", "equinox")))
    lines += [
        "",
        f"Pendulum-v1, {steps:,} environment steps for each of seeds {', '.join(map(str, SEEDS))}. Means",
        "over seeds with 95 % intervals; final returns are over 500 fresh episodes. About -150 is the best",
        f"that can be done from random starts. {UPDATES_PER_EPISODE} updates of each learner an episode",
        f"of 200 steps, networks of {LEARNER.network.hidden} units, {EVOLUTION['population']} individuals of",
        f"{EVOLUTION['episodes']} episodes. Standings lean on nothing but an individual's own lineage",
        "(evolution.lineage_prior and champion_prior 0): the population's mean, with its many mutants that",
        "cannot swing at all, would say little about anybody.",
        "",
        f"{cpu_model()}. {used}. Written by `python -m benchmarks.hybrids`.",
    ]
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "table.md").write_text("\n".join(lines) + "\n")
    save(figure_of(curves, title), folder / "pendulum")


def _said(values: np.ndarray) -> str:
    interval: Interval = seed_interval(values, lower=-np.inf, upper=0.0)
    return f"{interval.mean:.0f} [{interval.low:.0f}, {interval.high:.0f}]"


def main() -> None:
    """Measures what is asked for."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("hybrid", choices=["erl", "cerl"])
    parser.add_argument("--steps", type=float, default=1.2e5, help="environment steps (default: 1.2e5)")
    parser.add_argument("--out", type=Path, help="folder for table and figure")
    options = parser.parse_args()
    algorithms = erl_and_parts() if options.hybrid == "erl" else cerl_and_parts()
    folder = options.out or RESULTS / f"pendulum-{options.hybrid}"
    title = f"Pendulum: {options.hybrid.upper()} and its parts"
    measure(title, algorithms, round(options.steps), folder)


if __name__ == "__main__":
    main()

"""The search alone, on the skills that a run ended with: what each part of MADyS+ is worth.

    python -m benchmarks.search_alone runs/plus [STEPS [VARIANTS [SEEDS]]] > search_alone.md

`runs/plus` is a run of MADyS+. The skills are those of its first seed; they do not learn any more, so that
variants differ in nothing but how they search. Seeds 1 to SEEDS (3), which no published run uses. VARIANTS is
how many of them, by default all; the first three are MADyS+ and timetables, the next four are about rules.
Three seeds tell 0.9 from 0.5; a difference of 0.1 takes eight or more.
"""

import dataclasses
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import jax
import numpy as np
from benchmarks.frozen import frozen
from benchmarks.machine import cpu_model

import skillcrew as sc
from skillcrew.algorithms.skill_teams import SkillTeams
from skillcrew.analysis.levels import Windows, reaching
from skillcrew.experiment.generation import compiled, play

GENERATIONS, EPISODES = 5, 200
"""Between two scores; of a score."""


class WithoutPhases(sc.MADySPlus):
    """Timetables that are bred as if they were any network's weights."""

    _vary = None  # type: ignore[assignment]


def variants() -> Mapping[str, Callable[[Any], SkillTeams]]:
    """By what is changed of MADyS+."""
    plus = sc.MADySPlusConfig()

    def of_selector(**changes: Any) -> Callable[[Any], SkillTeams]:
        return lambda env: sc.MADySPlus(env, selector=dataclasses.replace(plus.selector, **changes))

    def of_evolution(**changes: Any) -> Callable[[Any], SkillTeams]:
        return lambda env: sc.MADySPlus(env, evolution=dataclasses.replace(plus.evolution, **changes))

    def of_phases(**changes: Any) -> Callable[[Any], SkillTeams]:
        return of_evolution(phases=dataclasses.replace(plus.evolution.phases, **changes))

    longer = dataclasses.replace(plus.evolution.restart, patience=60)
    return {
        "MADyS+": sc.MADySPlus,
        "without eyes (open loop)": of_selector(reactive=False),
        "without eyes, one timetable for all": of_selector(reactive=False, sharing="team"),
        "rules beside small changes": of_phases(rule=0.5, network=0.25),
        "rules in 0.7 of the children": of_phases(rule=0.7),
        "small changes alone": of_phases(rule=0.0, network=0.5),
        "a patience of 60": of_evolution(restart=longer),
        "eyes with a hidden layer of 16": of_selector(hidden=(16,)),
        "6 phases": of_selector(phases=6),
        "plain mutation and crossover": WithoutPhases,
        "nobody begins alike": of_selector(alike=0.0),
        "all begin alike": of_selector(alike=1.0),
        "changes of random parts of the team alone": of_phases(together=0.0, group=0.0),
        "no challengers": of_evolution(challengers=0),
        "no veterans, the level of one generation": of_evolution(veterans=0, level_memory=1.0),
        "4 episodes": lambda env: sc.MADySPlus(env, episodes=4),
        "1 episode": lambda env: sc.MADySPlus(env, episodes=1, probe_episodes=1),
        "fitness discounted by 0.98": lambda env: sc.MADySPlus(env, fitness_discount=0.98),
        "a GRU and an evolution strategy (MADyS-ES)": sc.MADySES,
        "a network that decides at every step (MADyS)": sc.MADyS,
    }


def search(algorithm: SkillTeams, skills: Any, steps: int, seeds: range) -> list[tuple[float, float, float]]:
    """For each seed the steps to 0.5 and 0.9 (NaN: not held), and the champion's success in the end."""

    def begin(seed: Any) -> Any:
        key_init, key_score = jax.random.split(jax.random.key(seed))
        return frozen(algorithm.init(key_init), skills), key_score

    def go_on(begun: Any) -> Any:
        state, key = begun
        key, key_score = jax.random.split(key)
        state, measured = jax.lax.scan(lambda carry, _: algorithm.step(carry), state, length=GENERATIONS)
        score = play(algorithm, algorithm.team(state), key_score, EPISODES)
        return (state, key), measured["environment_steps"][-1], score.team_return().mean()

    state = jax.jit(begin)(seeds[0])
    program = compiled(go_on, state, donate_argnums=0)
    reached = []
    for seed in seeds:
        state, lived, scores = jax.jit(begin)(seed), [0], [0.0]
        while lived[-1] < steps:
            state, now, score = program(state)
            lived.append(int(now))
            scores.append(float(score))
        curve, windows = (np.array(lived), np.array(scores)), Windows.of(steps)
        levels = [reaching(*curve, level, windows, lived[-1]) for level in (0.5, 0.9)]
        half, most = (level.steps if level.held else np.nan for level in levels)
        reached.append((half, most, float(np.mean(scores[-5:]))))
    return reached


def main() -> int:
    if not 2 <= len(sys.argv) <= 5:
        print(__doc__, file=sys.stderr)
        return 2
    run = sc.Run(Path(sys.argv[1]))
    steps = round(float(sys.argv[2])) if len(sys.argv) > 2 else 4_000_000
    count = int(sys.argv[3]) if len(sys.argv) > 3 else None
    seeds = range(1, 1 + (int(sys.argv[4]) if len(sys.argv) > 4 else 3))
    env = run.algorithm.env
    skills = run.champion(run.config.seeds[0]).skills
    print(f"# The search alone, on trained skills of `{env.name}`\n\n{cpu_model()}\n")
    print(f"{steps / 1e6:g} M steps; seeds {seeds[0]} to {seeds[-1]}. The last column: mean of the last")
    print(f"five scores, each on {EPISODES} fresh episodes.\n")
    print("| | million steps to 0.5 | to 0.9 | success in the end |\n|---|---|---|---|")
    for name, make in list(variants().items())[:count]:
        columns = zip(*search(make(env), skills, steps, seeds), strict=True)
        half, most, final = (list(column) for column in columns)
        success = " ".join(f"{share:.3f}" for share in final)
        print(f"| {name} | {_millions(half)} | {_millions(most)} | {success} |", flush=True)
    return 0


def _millions(steps: list[float]) -> str:
    return " ".join("–" if np.isnan(one) else f"{one / 1e6:.2f}" for one in steps)


if __name__ == "__main__":
    raise SystemExit(main())

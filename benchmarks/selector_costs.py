"""What a generation costs by kind of selector, at the same population and episodes, once skills have learned.

`python -m benchmarks.selector_costs` prints a page and writes `benchmarks/results/selector_costs.md`. The
process pins itself to one core; figures are processor time.
"""

import dataclasses
import os
import sys
from collections.abc import Mapping
from pathlib import Path

if __name__ == "__main__":
    os.environ["XLA_FLAGS"] = "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1"
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})

import jax
from benchmarks.frozen import frozen
from benchmarks.machine import cpu_model
from benchmarks.training import seconds_per_call

import skillcrew as sc

PAGE = Path(__file__).parent / "results" / "selector_costs.md"
ENVIRONMENTS = ("rover-t2-c1", "rover-t3-c3")
PLUS = sc.MADySPlusConfig().selector
SELECTORS: Mapping[str, sc.SelectorConfig] = {
    "GRU of 16, one for each agent": sc.SelectorConfig(memory=16),
    "GRU of 16, one for the team": sc.SelectorConfig(memory=16, sharing="team"),
    "hidden layer of 16, one for each agent": sc.SelectorConfig(),
    "timetable, one for each agent": dataclasses.replace(PLUS, reactive=False),
    "the same, reactive (MADyS+)": PLUS,
    "the same, reactive, with a GRU of 16": dataclasses.replace(PLUS, memory=16),
}


def seconds(environment: str, selector: sc.SelectorConfig) -> float:
    """Of one generation in which nothing learns but teams."""
    madys = sc.MADySPlus(sc.make(environment), selector=selector)
    state = frozen(jax.jit(madys.init)(jax.random.key(0)))
    return seconds_per_call(jax.jit(madys.step), state)


def main() -> int:
    lines = [
        f"# A generation by kind of selector\n\n{cpu_model()}, one core. MADyS+'s population and episodes.\n"
    ]
    lines.append("| selector | " + " | ".join(f"`{name}`" for name in ENVIRONMENTS) + " |")
    lines.append("|---|" + "---|" * len(ENVIRONMENTS))
    reference = None
    for name, selector in SELECTORS.items():
        took = [seconds(environment, selector) for environment in ENVIRONMENTS]
        reference = reference or took
        cells = [f"{one:.3f} s ({one / first:.2f})" for one, first in zip(took, reference, strict=True)]
        lines.append(f"| {name} | " + " | ".join(cells) + " |")
        print(lines[-1], file=sys.stderr, flush=True)
    PAGE.write_text("\n".join([*lines, "", "In brackets: the share of the first row.", ""]))
    print(PAGE.read_text())
    return 0


if __name__ == "__main__":
    raise SystemExit(main())

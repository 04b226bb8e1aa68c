"""How fast runs of many seeds are on this machine's device: a GPU if JAX finds one, else the CPU.

`python -m benchmarks.devices` trains MADyS+, all seeds in one program, and prints a table: a generation at
the start, while all skills learn, and one whose skills have stopped, where only the search is left. `--out`
says which page to write. What a device is worth is read off two pages, one of each machine.
"""

import argparse
import time
from pathlib import Path
from typing import Any

import jax
from benchmarks.frozen import frozen
from benchmarks.machine import cpu_model, software, versions

import skillcrew as sc
from skillcrew.experiment.generation import compiled

HEADER = """\
# Runs of many seeds on {device}

{machine}; {software}.

| environment | seeds | while skills learn | | skills done | | compiling |
|---|---|---|---|---|---|---|"""

FOOTER = """
MADyS+ with its defaults. Milliseconds that a generation of all seeds takes, and thousand environment steps
a second, all seeds together; the faster of two chunks of {generations} generations, after one that is not
counted."""


def measure(environment: str, seeds: int, generations: int) -> str:
    """A row of the table."""
    algorithm = sc.MADySPlus(sc.make(environment))
    first = jax.jit(jax.vmap(lambda seed: algorithm.init(jax.random.key(seed))))

    def chunk(states: Any) -> Any:
        return jax.vmap(lambda s: jax.lax.scan(lambda s, _: algorithm.step(s), s, length=generations))(states)

    state = first(jax.numpy.arange(seeds))
    began = time.perf_counter()
    program = compiled(chunk, state, donate_argnums=0)
    seconds = time.perf_counter() - began
    learning = fastest(program, state, generations)
    done = fastest(program, jax.vmap(frozen)(first(jax.numpy.arange(seeds))), generations)
    return f"| `{environment}` | {seeds} | {learning} | {done} | {seconds:.0f} s |"


def fastest(program: Any, state: Any, generations: int) -> str:
    """Milliseconds of a generation and thousand steps a second, as two cells."""
    best, rate, before = float("inf"), 0.0, 0
    for _ in range(3):
        began = time.perf_counter()
        state, measured = program(state)
        lived = int(jax.device_get(measured["environment_steps"])[:, -1].astype("int64").sum())
        seconds = time.perf_counter() - began
        # The first chunk warms up.
        if before and seconds < best:
            best, rate = seconds, (lived - before) / seconds
        before = lived
    return f"{1e3 * best / generations:,.0f} ms | {rate / 1e3:,.0f}"


def main() -> None:
    """Measures every case, prints the table and writes the page."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--environment", default="rescue-v1-c2")
    parser.add_argument("--seeds", type=int, nargs="+", default=[5, 32], help="how many, a row each")
    parser.add_argument("--generations", type=int, default=10, help="of a chunk")
    parser.add_argument("--out", type=Path, help="the page to write")
    options = parser.parse_args()
    found = software(versions(("jax", "equinox")))
    lines = [HEADER.format(device=jax.devices()[0].device_kind, machine=cpu_model(), software=found)]
    print(lines[0], flush=True)
    for seeds in options.seeds:
        lines.append(measure(options.environment, seeds, options.generations))
        print(lines[-1], flush=True)
    lines.append(FOOTER.format(generations=options.generations))
    if options.out:
        options.out.parent.mkdir(parents=True, exist_ok=True)
        options.out.write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()

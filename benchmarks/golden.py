"""What other versions change: small runs against the figures of a golden one, number by number.

    python -m benchmarks.golden            # compares with results/golden.json
    python -m benchmarks.golden --write    # puts the present figures in its place

A run by the same seed, machine and versions ends in the same bits. By other versions of JAX, or on another
machine, the first difference is a rounding in one of the figures; here is said which, and when.
"""

import dataclasses
import json
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import jax
import numpy as np
from benchmarks.machine import cpu_model, software, versions

import skillcrew as sc
from skillcrew.algorithms.registry import make_algorithm

FILE = Path(__file__).parent / "results" / "golden.json"
CASES = (
    ("madys-plus", "rover-t2-c2"),
    ("madys", "rescue-v1-c2"),
    ("merl", "rover-t1-c3"),
    ("ea", "rover-t2-c1"),
)
STEPS = 60_000
PACKAGES = ("jax", "jaxlib", "equinox", "optax", "flashbax", "numpy")

Columns = Mapping[str, list[float]]


@dataclasses.dataclass(frozen=True)
class Difference:
    """Where a figure first differs from the golden one."""

    figure: str
    row: int
    golden: float
    found: float

    def __str__(self) -> str:
        relative = abs(self.found - self.golden) / max(abs(self.golden), 1e-30)
        return (
            f"{self.figure}: the same in {self.row} rows, then {self.found!r} and not {self.golden!r} "
            f"({relative:.1e} of it)"
        )


def differences(golden: Columns, found: Columns) -> list[Difference]:
    """The first difference in each figure that has one, the earliest first.

    Args:
        golden, found: one value per seed and generation, by figure; what only one of them has is left out.
    """
    of_all = []
    for figure in golden.keys() & found.keys():
        pairs = zip(golden[figure], found[figure], strict=False)
        # What is NaN in both is no difference.
        unlike = (
            row for row, (one, other) in enumerate(pairs) if one != other and (one == one or other == other)
        )
        row = next(unlike, None)
        if row is not None:
            of_all.append(Difference(figure, row, golden[figure][row], found[figure][row]))
    return sorted(of_all, key=lambda difference: (difference.row, difference.figure))


def lived(method: str, environment: str) -> Columns:
    """The metrics of a small run of two seeds."""
    algorithm = make_algorithm(method, sc.make(environment))
    with tempfile.TemporaryDirectory() as folder:
        run = sc.train(algorithm, seeds=(7, 8), steps=STEPS, out=Path(folder) / "run")
        return {name: np.asarray(column, float).tolist() for name, column in run.metrics().items()}


def present() -> dict[str, Any]:
    """All runs, and what they were made by."""
    device = jax.devices()[0].device_kind
    made_by = f"{software(versions(PACKAGES))}; {device}, {cpu_model()}"
    return {"made by": made_by, "runs": {f"{m} on {e}": lived(m, e) for m, e in CASES}}


def main() -> int:
    found = present()
    if sys.argv[1:] == ["--write"]:
        FILE.write_text(json.dumps(found) + "\n")
        return 0
    golden = json.loads(FILE.read_text())
    print(f"golden: {golden['made by']}\nhere:   {found['made by']}")
    for name, columns in golden["runs"].items():
        first, *others = differences(columns, found["runs"][name]) or [None]
        if first is None:
            print(f"{name}: the same bits in all {len(columns)} figures")
            continue
        print(f"{name}: {1 + len(others)} of {len(columns)} figures differ. The first: {first}")
    return 0


if __name__ == "__main__":
    sys.exit(main())

"""Kills training at random moments, resumes it, and compares every bit with a run left in peace.

    python benchmarks/kill_and_resume.py                    # 20 kills of a small run
    python benchmarks/kill_and_resume.py --kills 3 --steps 3000

First a reference run is trained to its end. Then, again and again, the same run is started in a new
folder and killed with SIGKILL at a moment drawn uniformly from the reference's duration: while Python
starts, between checkpoints or in the midst of writing one (checkpoints are written as often as can
be, see --checkpoint-seconds). `skillcrew resume` then takes it to the end. A run before the reference
fills a cache of compiled programs, or most kills would hit XLA; --compile-anew is for those.
The metrics, column by column, and all arrays of the final checkpoint (weights, optimisers, keys,
buffer, populations) must equal the reference's bit for bit; NaN equals NaN.

Prints a row per kill: the moment, what the run was doing, the generation of its latest finished
checkpoint, and the verdict. Exits with 1 on any difference. A kill before the run folder exists leaves
nothing to resume: the run is then started again, and counts all the same.
"""

import argparse
import os
import random
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

os.environ.setdefault("JAX_PLATFORMS", "cpu")

SIZES = {
    "algorithm.population": 8,
    "algorithm.episodes": 2,
    "algorithm.probe-episodes": 1,
    "algorithm.updates": 4,
    "algorithm.buffer-capacity": 3000,
    "algorithm.learner.batch-size": 32,
    "environment.episode-length": 10,
    "environment.activation-distance": 8,
    "score-episodes": 5,
    "report-episodes": 20,
    "generations-per-report": 2,
}
"""Options of the run, so small that compiling and checkpoints take most of its time."""


def main() -> int:
    arguments = parse_arguments()
    draw = random.Random(arguments.random_seed)
    with tempfile.TemporaryDirectory(prefix="kill-and-resume-") as name:
        place = Path(name)
        words = train_words(arguments)
        os.environ.pop("JAX_COMPILATION_CACHE_DIR", None)
        if not arguments.compile_anew:
            os.environ["JAX_COMPILATION_CACHE_DIR"] = str(place / "compiled")
            os.environ["JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS"] = "0"
            finish(start(*words, "--out", str(place / "first")))
        began = time.monotonic()
        finish(start(*words, "--out", str(place / "reference")))
        duration = time.monotonic() - began
        expected = ending(place / "reference")
        print(
            f"reference: {duration:.1f} s, {len(expected)} arrays and columns "
            f"(random seed {arguments.random_seed})"
        )
        print(f"{'kill':>4}  {'at':>7}  {'during':<22} {'from':>10}  verdict", flush=True)
        verdicts = [
            one_kill(number, draw.uniform(0, duration), words, place / str(number), expected)
            for number in range(1, arguments.kills + 1)
        ]
    different = len(verdicts) - sum(verdicts)
    print(f"{len(verdicts)} kills, {different} with a difference")
    return 1 if different else 0


def one_kill(number: int, moment: float, words: list[str], folder: Path, expected: dict) -> bool:
    """Kills a run, resumes it, prints a row; returns whether it ended like the reference."""
    process = start(*words, "--out", str(folder))
    try:
        process.communicate(timeout=moment)
        during = "nothing, it was done"
    except subprocess.TimeoutExpired:
        process.kill()
        process.communicate()
        during = activity(folder)
    finished = [int(path.name) for path in folder.glob("checkpoints/*") if path.name.isdecimal()]
    reached = f"gen. {max(finished)}" if finished else "the start"
    again = ["resume", str(folder)] if folder.exists() else [*words, "--out", str(folder)]
    code, errors = outcome(start(*again))
    problems = [errors.strip().splitlines()[-1]] if code else differences(ending(folder), expected)
    verdict = "same bits" if not problems else f"DIFFERENT: {problems[0]} (and {len(problems) - 1} more)"
    print(f"{number:>4}  {moment:6.1f}s  {during:<22} {reached:>10}  {verdict}", flush=True)
    return not problems


def activity(folder: Path) -> str:
    """What a killed run was doing, as its folder tells."""
    if not folder.exists():
        return "start of Python"
    if any(folder.glob("checkpoints/*tmp*")):
        return "writing a checkpoint"
    if any(folder.glob(".*")):
        return "writing a file"
    if not (folder / "timing.json").exists():
        return "compilation"
    return "the report" if (folder / "report").exists() else "generations"


def ending(folder: Path) -> dict[str, np.ndarray]:
    """All columns of the metrics and all arrays of the last checkpoint, by name."""
    import skillcrew as sc
    from skillcrew.experiment.checkpoints import Checkpoints
    from skillcrew.experiment.generation import shapes

    run = sc.Run(folder)
    arrays, _ = Checkpoints(run.folder.checkpoints).read(shapes(run.algorithm, run.config))
    columns = {f"metrics: {name}": values for name, values in run.metrics().items()}
    return columns | {name: np.asarray(array) for name, array in arrays.items()}


def differences(found: dict[str, np.ndarray], expected: dict[str, np.ndarray]) -> list[str]:
    """The names of what differs in so much as one bit (payloads of NaN aside)."""
    if list(found) != list(expected):
        return ["other arrays altogether"]
    return [name for name, values in found.items() if not same(values, expected[name])]


def same(one: np.ndarray, other: np.ndarray) -> bool:
    floats = one.dtype.kind == "f"
    return one.dtype == other.dtype and np.array_equal(one, other, equal_nan=floats)


def start(*words: str) -> subprocess.Popen:
    """One command line in a process of its own."""
    program = "from skillcrew.cli.main import main; main()"
    return subprocess.Popen(
        [sys.executable, "-c", program, *words],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    )


def outcome(process: subprocess.Popen) -> tuple[int, str]:
    """Exit code and errors, once it has ended."""
    _, errors = process.communicate()
    return process.returncode, errors or "no message"


def finish(process: subprocess.Popen) -> None:
    code, errors = outcome(process)
    if code:
        raise SystemExit(f"the reference run failed:\n{errors}")


def train_words(arguments: argparse.Namespace) -> list[str]:
    sizes = {**SIZES, "steps": arguments.steps, "seeds": arguments.seeds}
    sizes["checkpoint-seconds"] = arguments.checkpoint_seconds
    options = [word for name, value in sizes.items() for word in (f"--{name}", str(value))]
    layers = ["--algorithm.selector.hidden", "8", "--algorithm.learner.network.hidden", "8"]
    return ["train", arguments.algorithm, arguments.environment, *options, *layers, *arguments.options]


def parse_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter, allow_abbrev=False
    )
    parser.add_argument("--kills", type=int, default=20, help="how many runs to kill (default: 20)")
    parser.add_argument(
        "--steps", type=int, default=60_000, help="environment steps per seed (default: 60000)"
    )
    parser.add_argument("--seeds", default="2", help="as skillcrew takes them (default: 2)")
    parser.add_argument("--algorithm", default="madys", help="which algorithm (default: madys)")
    parser.add_argument("--environment", default="rover-t2-c2", help="which preset (default: rover-t2-c2)")
    parser.add_argument(
        "--checkpoint-seconds", type=float, default=0.0, help="time between checkpoints (default: 0)"
    )
    parser.add_argument(
        "--random-seed", type=int, default=random.randrange(10**6), help="of the moments (default: random)"
    )
    parser.add_argument("--compile-anew", action="store_true", help="share no compiled programs")
    parser.add_argument("options", nargs="*", help="more options of skillcrew train, after --")
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())

"""`skillcrew list`."""

import dataclasses
import json

from skillcrew.algorithms.registry import ALGORITHMS
from skillcrew.cli.options import parse_options
from skillcrew.envs.presets import PRESETS, make, preset
from skillcrew.envs.rover.config import RoverConfig

USAGE = "usage: skillcrew list [--json]\n\nAlgorithms, environment presets and the skills of each."


@dataclasses.dataclass(frozen=True)
class ListOptions:
    """Options of `skillcrew list`."""

    json: bool = False
    """Print one JSON object and nothing else."""


def run(words: list[str]) -> int:
    """Prints what there is to train, and where."""
    options = parse_options(ListOptions, words, ListOptions(), "skillcrew list", USAGE)
    algorithms = {name: (kind.__doc__ or "").splitlines()[0] for name, kind in ALGORITHMS.items()}
    environments = {name: (make(name), preset(name)) for name in PRESETS}
    if options.json:
        presets = {name: {**env.describe(), "skills": env.skills} for name, (env, _) in environments.items()}
        print(json.dumps({"algorithms": algorithms, "environments": presets}, indent=1))
        return 0
    width = max(map(len, [*algorithms, *environments]))
    print("Algorithms")
    for name, about in algorithms.items():
        print(f"  {name:<{width}} {about}")
    print("\nEnvironments")
    for name, (env, config) in environments.items():
        print(
            f"  {name:<{width}} {config.n_agents} rover(s), {config.n_poi_types} POI types, spatial coupling "
            f"{config.spatial_coupling}, {config.episode_length} steps{_particulars(config)}"
        )
        print(f"  {'':<{width}} skills: {', '.join(env.skills)}")
    print("\nEvery field of both is an option: `skillcrew train madys rover-t2-c1 --help` explains them.")
    return 0


def _particulars(config: RoverConfig) -> str:
    """What a preset has beyond sizes."""
    groups = " then ".join("+".join(group) for group in config.simultaneous or ())
    said = {
        f"{groups} at once": config.simultaneous,
        "order drawn": config.order == "drawn",
        "POIs move": config.poi_speed,
        f"{config.breakdowns} breaks down": config.breakdowns,
    }
    return "".join(f", {what}" for what, holds in said.items() if holds)

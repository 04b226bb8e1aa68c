"""`skillcrew list`."""

import dataclasses
import json
from collections.abc import Iterator
from typing import Any

from skillcrew.algorithms.registry import ALGORITHMS
from skillcrew.envs.bridges.names import BRIDGES
from skillcrew.envs.registry import Domain, domains
from skillcrew.errors import UserError

USAGE = (
    "usage: skillcrew list [--json]\n\n"
    "Algorithms, environments and the skills of each: those that skillcrew ships, and those that installed\n"
    "packages offer by the entry point `skillcrew.environments`.\n\n"
    "--json  print one JSON object and nothing else"
)


def run(words: list[str]) -> int:
    """Prints what there is to train, and where."""
    if any(word in ("-h", "--help") for word in words):
        print(USAGE)
        return 0
    if unknown := [word for word in words if word != "--json"]:
        raise UserError(f"list: unknown option {unknown[0]}; it has --json")
    offered, broken = domains()
    if words:
        print(json.dumps(_as_dict(offered, broken), indent=1))
        return 0
    environments = [line for domain in offered for line in _lines(domain)]
    bridges = {f"{prefix}:NAME": bridge.about for prefix, bridge in BRIDGES.items()}
    width = max(map(len, [*ALGORITHMS, *(name for name, _ in environments), *bridges, *broken]))
    print("Algorithms")
    for name, listed in ALGORITHMS.items():
        print(f"  {name:<{width}} {listed.about}")
    print("\nEnvironments")
    for name, about in [*environments, *bridges.items()]:
        print(f"  {name:<{width}} {about}")
    for name, why in broken.items():
        print(f"  {name:<{width}} fails to load: {why}")
    print(
        "\nYour own is called by its import path, such as mylab.rescue:Rescue. Every field of an algorithm\n"
        "and an environment is an option: `skillcrew train madys rover-t2-c1 --help` explains them."
    )
    return 0


def _configurations(domain: Domain) -> dict[str, Any]:
    """Its named configurations; of a package also the one that stands behind the environment's own name."""
    presets = dict(domain.presets())
    if domain.shipped:
        return presets
    return {domain.name: domain.config_class() if domain.config_class else None, **presets}


def _lines(domain: Domain) -> Iterator[tuple[str, str]]:
    for name, config in _configurations(domain).items():
        yield name, config.summary() if hasattr(config, "summary") else f"({domain.place})"
        if skills := getattr(config, "skills", None):
            yield "", f"skills: {', '.join(skills)}"


def _as_dict(offered: list[Domain], broken: dict[str, str]) -> dict[str, Any]:
    environments = {
        name: {
            "class": domain.place,
            **({} if config is None else dataclasses.asdict(config)),
            **({"skills": config.skills} if hasattr(config, "skills") else {}),
        }
        for domain in offered
        for name, config in _configurations(domain).items()
    }
    algorithms = {name: listed.about for name, listed in ALGORITHMS.items()}
    return {"algorithms": algorithms, "environments": environments, "broken": broken}

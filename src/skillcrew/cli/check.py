"""`skillcrew check ENVIRONMENT`."""

import dataclasses
import json

from skillcrew.cli.environments import configured, environment_names, with_environment
from skillcrew.cli.options import parse_options
from skillcrew.cli.present import take_places
from skillcrew.envs.checks.check import check_environment
from skillcrew.envs.registry import find

WRONG = 2


@dataclasses.dataclass(frozen=True)
class CheckOptions:
    """Options of `skillcrew check`."""

    json: bool = False
    """Print one JSON object and nothing else."""


def run(words: list[str]) -> int:
    """Prints what is wrong with an environment and what is fine; 2 if anything is wrong."""
    places = take_places(words, ("ENVIRONMENT",), usage())
    if places is None:
        print(usage())
        return 0
    entry = find(places[0])
    options_class, default = with_environment(CheckOptions, entry)
    options = parse_options(options_class, words[1:], default, ("check", places[0]), usage())
    report = check_environment(configured(entry, options).make())
    if options.json:
        print(json.dumps({**dataclasses.asdict(report), "ok": report.ok}, indent=1))
    else:
        print(report)
    return 0 if report.ok else WRONG


def usage() -> str:
    """What `skillcrew check --help` prints."""
    return (
        "usage: skillcrew check ENVIRONMENT [OPTIONS]\n\n"
        "ENVIRONMENT  the import path of your own, such as mylab.rescue:Rescue or rescue.py:Rescue;\n"
        f"             or one of {environment_names()}\n\n"
        "Plays in it and says in words what is wrong, how to mend it, and what is fine: shapes and types,\n"
        "purity, keys, endings, rewards, skills, speed. Exits with 2 if anything is wrong.\n\n"
        "--json                  print one JSON object and nothing else\n"
        "--environment.FIELD     any field of the environment's configuration"
    )

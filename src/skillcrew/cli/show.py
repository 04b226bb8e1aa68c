"""`skillcrew show RUN`."""

import dataclasses
import json
import math
from typing import Any

import yaml

from skillcrew.cli.options import parse_options
from skillcrew.cli.present import take_places
from skillcrew.errors import UserError
from skillcrew.experiment.config import RunConfig, parse
from skillcrew.experiment.folder import RunFolder
from skillcrew.experiment.integrity import check_known
from skillcrew.experiment.metrics import read_metrics
from skillcrew.experiment.overview import final_scores, progress
from skillcrew.experiment.progress import human
from skillcrew.experiment.score import score_among
from skillcrew.experiment.yaml_files import read_yaml
from skillcrew.intervals import Interval

USAGE = (
    "usage: skillcrew show RUN [OPTIONS]\n\n"
    "RUN  the folder of a run, also of one that is still training\n\n"
    "Prints how far each seed has come, what its champion reached, and every option of the run. Nothing is\n"
    "computed, and no code of the environment is imported."
)


@dataclasses.dataclass(frozen=True)
class ShowOptions:
    """Options of `skillcrew show`."""

    json: bool = False
    """Print one JSON object and nothing else."""


def run(words: list[str]) -> int:
    """Prints what a run folder holds."""
    places = take_places(words, ("RUN",), USAGE)
    if places is None:
        parse_options(ShowOptions, ["--help"], ShowOptions(), ("show", "RUN"), USAGE)
        return 0
    options = parse_options(ShowOptions, words[1:], ShowOptions(), ("show", words[0]), USAGE)
    folder = RunFolder(places[0])
    found = shown(folder)
    print(json.dumps(found, indent=1) if options.json else as_lines(found))
    return 0


def shown(folder: RunFolder) -> dict[str, Any]:
    """What a run folder says of itself, as plain values; what it does not hold yet is None.

    Raises:
        UserError: no run folder, or one whose files are damaged.
    """
    folder.check_is_run()
    check_known(folder.config, "restore it")
    configuration = read_yaml(folder.config)
    if not isinstance(configuration, dict):
        raise UserError(f"{folder.config}: damaged; restore it")
    reached = progress(read_metrics(folder.metrics)) if folder.metrics.is_file() else None
    return {
        "run": str(folder.path),
        "progress": reached,
        "scores": final_scores(folder.scores),
        "began_with": _origins(folder, configuration.get("run")),
        "configuration": configuration,
    }


def _origins(folder: RunFolder, section: Any) -> list[str]:
    """What the run began with, a line for each; nothing else of the section has to be valid."""
    known = section if isinstance(section, dict) else {}
    begun = {name: known[name] for name in ("skills_from", "skills_frozen", "team_from") if name in known}
    return parse(RunConfig, begun, f"{folder.config}: run").origins()


def as_lines(found: dict[str, Any]) -> str:
    """The same for people: a heading, a line for each seed, and the options as YAML."""
    lines = [found["run"]]
    for seed in found["progress"] or []:
        score = score_among(seed)
        lines.append(
            f"  seed {seed['seed']:<6} generation {seed['generation']:<6} "
            f"{human(seed['environment_steps']):>7} steps  {score.word} {score.number(seed[score.key])}"
        )
    if found["progress"] is None:
        lines.append("  no generation is over yet")
    lines += [f"  {line}" for line in found["began_with"]]
    if found["scores"]:
        score = score_among(found["scores"])
        reached, episodes = found["scores"][score.key], found["scores"]["episodes"]
        ends = [math.nan if reached[end] is None else reached[end] for end in ("low", "high")]
        interval = score.range(Interval(reached["mean"], *ends))
        lines.append(f"  final {score.word} {interval} on {episodes} fresh episodes per seed")
    options = yaml.safe_dump(found["configuration"], sort_keys=False, width=100, default_flow_style=None)
    return "\n".join([*lines, "", options.rstrip()])

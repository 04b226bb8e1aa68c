"""What a run's configuration says of it, read as data: no name in it is imported."""

import dataclasses
from typing import Any

from skillcrew.errors import UserError
from skillcrew.experiment.config import RunConfig, parse
from skillcrew.experiment.folder import RunFolder
from skillcrew.experiment.yaml_files import read_yaml


@dataclasses.dataclass(frozen=True)
class About:
    """Of one run."""

    algorithm: str
    environment: str
    config: RunConfig


def read_about(folder: RunFolder) -> About:
    """What its configuration says.

    Raises:
        UserError: it is damaged, or of something else than a run.
    """
    sections = read_yaml(folder.config)
    if not isinstance(sections, dict):
        raise UserError(f"{folder.config}: not the configuration of a run")
    named = (_name(folder, sections, section) for section in ("algorithm", "environment"))
    return About(*named, parse(RunConfig, sections.get("run"), f"{folder.config}: run"))


def _name(folder: RunFolder, sections: dict[Any, Any], section: str) -> str:
    fields = sections.get(section)
    if not isinstance(fields, dict) or not isinstance(fields.get("name"), str):
        raise UserError(f"{folder.config}: not the configuration of a run (it names no {section})")
    return fields["name"]

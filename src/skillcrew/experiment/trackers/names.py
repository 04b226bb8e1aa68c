"""Which trackers there are."""

from collections.abc import Mapping, Sequence

from skillcrew.errors import UserError, unknown_name

TRACKERS: Mapping[str, str] = {
    "tensorboard": "skillcrew.experiment.trackers.tensorboard:TensorBoard",
    "wandb": "skillcrew.experiment.trackers.wandb:WandB",
}
"""Where each is, by its name, which is that of the package that it needs, too."""


def check_names(names: Sequence[str]) -> None:
    """Raises `UserError` for a name that is none of a tracker, or is there twice."""
    for name in names:
        if name not in TRACKERS:
            raise unknown_name("tracker", name, TRACKERS)
    if len(set(names)) < len(names):
        raise UserError(f"trackers = {','.join(names)}: give each once")

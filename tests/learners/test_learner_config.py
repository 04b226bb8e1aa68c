"""Options of learners that cannot be meant are refused in one line."""

from typing import Any

import pytest

from oracles.refusals import refusal, unhooked
from skillcrew.learners import plateau, td3

TD3Config = unhooked(td3).TD3Config
PlateauConfig = unhooked(plateau).PlateauConfig


@pytest.mark.parametrize(
    ("config", "field", "value"),
    [
        (TD3Config, "batch_size", 0),
        (TD3Config, "critics", 0),
        (TD3Config, "policy_delay", -1),
        (TD3Config, "actor_learning_rate", 0.0),
        (TD3Config, "critic_learning_rate", -0.5),
        (TD3Config, "discount", 1.0),
        (TD3Config, "discount", -0.5),
        (TD3Config, "discount", float("nan")),
        (TD3Config, "soft_update", 0.0),
        (TD3Config, "soft_update", 1.5),
        (TD3Config, "target_noise", -0.25),
        (TD3Config, "target_noise_clip", -2.0),
        (TD3Config, "saturation_penalty", -1.0),
        (PlateauConfig, "window", 0),
        (PlateauConfig, "earliest", -1),
        (PlateauConfig, "latest", 0),
        (PlateauConfig, "tolerance", -0.5),
        (PlateauConfig, "smoothing", 1.0),
        (PlateauConfig, "smoothing", -0.1),
    ],
)
def test_refuses_a_value_and_names_field_and_value(config: Any, field: str, value: Any) -> None:
    assert f"{field} = {value}" in refusal(config, **{field: value})


@pytest.mark.parametrize("fields", [{"soft_update": 1.0}, {"discount": 0.0}, {"target_noise": 0.0}])
def test_the_ends_of_a_range_are_allowed(fields: dict[str, float]) -> None:
    TD3Config(**fields)

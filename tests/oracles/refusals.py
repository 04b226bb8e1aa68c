"""What the library says of an option that cannot be meant."""

import functools
import importlib.util
from types import ModuleType
from typing import Any

import pytest

from skillcrew.errors import UserError


@functools.cache
def unhooked(module: ModuleType) -> Any:
    """The module as users load it.

    The import hook of the tests checks types before a configuration itself can, and would answer for it.
    """
    spec = importlib.util.spec_from_file_location("unhooked." + module.__name__, module.__file__)
    assert spec is not None and spec.loader is not None
    loaded = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(loaded)
    return loaded


def refusal(config: Any, **fields: Any) -> str:
    """The one line with which a configuration refuses these fields."""
    with pytest.raises(UserError) as refused:
        config(**fields)
    message = str(refused.value)
    assert message
    assert "\n" not in message
    return message

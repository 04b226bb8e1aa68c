"""Packages that only the bridges need, imported when one is crossed."""

import importlib
import importlib.util
from types import ModuleType

from skillcrew.errors import UserError


def needed(module: str) -> ModuleType:
    """Imports a module of an optional package.

    Raises:
        UserError: the package is not installed.
    """
    package = module.partition(".")[0]
    if importlib.util.find_spec(package) is None:
        raise UserError(f"{package} is not installed; `pip install 'skillcrew[interop]'` brings it")
    return importlib.import_module(module)

"""Objects by import path: what a user or an installed package names, with errors that say what is wrong."""

import importlib
import importlib.util
import inspect
import os
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

from skillcrew.errors import UserError, place_of_failure, unknown_name

BY_PATH = "__imported_by_path__"
"""What a module that was imported by its file's path keeps that path as."""


def import_object(place: str, here: bool = True) -> Any:
    """Imports `package.module:Name` or `folder/file.py:Name`.

    Args:
        here: whether to look for modules in the current folder, and there first. Not for what an installed
            package offers: a folder that lies around must not stand in for it.

    Raises:
        UserError: no such module, file or name, or importing it fails; the line says which and where.
    """
    module_name, _, name = place.partition(":")
    if not module_name or not name:
        raise UserError(f"{place}: give module:Name, such as mylab.rescue:Rescue, or file.py:Name")
    module = (
        _from_file(Path(module_name), place)
        if module_name.endswith(".py")
        else import_module(module_name, place, here)
    )
    found: Any = module
    for part in name.split("."):
        if not hasattr(found, part):
            own = [
                other
                for other, kind in vars(found).items()
                if inspect.isclass(kind) and kind.__module__ == getattr(module, "__name__", None)
            ]
            raise (
                unknown_name(f"name in {module_name}", part, own)
                if own
                else UserError(f"{place}: {module_name} has no {part}, and no class at all")
            )
        found = getattr(found, part)
    return found


def import_path(kind: Any) -> str:
    """What `import_object` finds a class or function by: its module, or the file it came from by path.

    What has no name of its own, such as a partial function, has `<locals>` in its path.
    """
    module = sys.modules.get(kind.__module__)
    return f"{getattr(module, BY_PATH, kind.__module__)}:{getattr(kind, '__qualname__', '<locals>')}"


def import_module(name: str, place: str, here: bool) -> ModuleType:
    """Imports a module.

    Args:
        place: what was asked for, for messages.
        here: as for `import_object`.

    Raises:
        UserError: no such module, or importing it fails.
    """
    folder = str(Path.cwd())
    if here and folder not in sys.path and "" not in sys.path:
        # As `python -m` does: a script installed in bin/ does not look where it is called.
        sys.path.insert(0, folder)
    try:
        return importlib.import_module(name)
    except ModuleNotFoundError as error:
        if error.name is not None and f"{name}.".startswith(f"{error.name}."):
            raise UserError(
                f"{place}: no module {error.name} here or among the installed packages; install the package "
                "that has it, or call skillcrew in the folder that it lies in"
            ) from error
        raise _failed(place, error) from error
    except Exception as error:
        raise _failed(place, error) from error


def _from_file(path: Path, place: str) -> ModuleType:
    try:
        path = path.expanduser().resolve()
    except (OSError, RuntimeError) as error:
        raise UserError(f"{place}: no file {path} ({error})") from error
    if not os.path.isfile(path):
        raise UserError(f"{place}: no file {path}")
    for name in (path.stem, str(path)):
        known = sys.modules.get(name)
        if known is None or getattr(known, "__file__", None) == str(path):
            break
    if known is not None:
        return known
    # By its path, where another module has that name already.
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise UserError(f"{place}: {path} cannot be imported")
    module = importlib.util.module_from_spec(spec)
    setattr(module, BY_PATH, str(path))
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except Exception as error:
        del sys.modules[name]
        raise _failed(place, error) from error
    return module


def _failed(place: str, error: Exception) -> UserError:
    said = str(error).splitlines()[0] if str(error) else ""
    return UserError(
        f"{place}: importing it fails: {type(error).__name__}: {said} ({place_of_failure(error)})"
    )

"""How large the whole numbers of a configuration may be."""

import dataclasses
from typing import Any

from skillcrew.errors import UserError

LARGEST = 2**31 - 1
"""What a compiled program counts to; sizes and numbers of rounds end up in one."""


def check_whole_numbers(config: Any, where: str = "") -> None:
    """Looks through a configuration dataclass and those inside it.

    Raises:
        UserError: the first field whose number is larger than `LARGEST`, either way; names it.
    """
    for field in dataclasses.fields(config):
        value, name = getattr(config, field.name), where + field.name
        if dataclasses.is_dataclass(value):
            check_whole_numbers(value, f"{name}.")
            continue
        for number in value if isinstance(value, tuple | list) else (value,):
            if isinstance(number, int) and abs(number) > LARGEST:
                raise UserError(f"{name} = {value}: give numbers of at most {LARGEST}")

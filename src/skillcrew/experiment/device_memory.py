"""What memory there still is, and the refusal of what would take more."""

import jax
import psutil

from skillcrew.errors import LESS_MEMORY, UserError


def available() -> int:
    """Bytes that the device can still give."""
    device = jax.devices()[0]
    if device.platform == "cpu":
        return psutil.virtual_memory().available
    stats = device.memory_stats() or {}
    return stats.get("bytes_limit", 2**63) - stats.get("bytes_in_use", 0)


def check(needed: int) -> None:
    """Raises `UserError` if the machine has less than `needed` bytes."""
    has = available()
    if needed > has:
        raise UserError(
            f"this run needs about {in_gib(needed)} and the machine has {in_gib(has)} free; {LESS_MEMORY}"
        )


def in_gib(size: int) -> str:
    """A size as people read it."""
    return f"{size / 2**30:.1f} GiB"

"""What a rover senses: reflections of other rovers and of POIs, per sector and channel.

Offsets are rotated into the rover's own frame and assigned to a sector by the signs of cross
products with the sector borders, which needs no arctangent. Every array has its world axes
last, and the few rovers and POIs in front are unrolled, so that the arithmetic runs along the
longest axis.
"""

import functools
import math
from collections.abc import Callable, Iterable

import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

PerRover = Float[Array, "agents *worlds"]
Reflector = tuple[PerRover, PerRover, float, Bool[Array, "..."] | None]
"""Its offset from every rover along x and y, its value V, and a mask of where it is sensed at all (None:
everywhere)."""


def sector_borders(n_sectors: int) -> list[tuple[float, float]]:
    """Cosine and sine of the bearing at which each sector begins, exact on the axes."""
    borders = []
    for sector in range(n_sectors):
        angle = 2 * math.pi * sector / n_sectors
        # sin(pi) is 1e-16 in floats, and a reflector dead ahead would then lie in two sectors.
        cosine, sine = (0.0 if abs(x) < 1e-12 else x for x in (math.cos(angle), math.sin(angle)))
        borders.append((cosine, sine))
    return borders


def sector_masks(forward: PerRover, left: PerRover, n_sectors: int) -> list[Bool[Array, "agents *worlds"]]:
    """In which sector an offset lies: exactly one mask is true at each place.

    Sector q holds the bearings from q·360/n up to, and without, (q+1)·360/n degrees,
    counter-clockwise from the heading. A reflector at the rover's own place is in sector 0.

    Args:
        forward, left: the offset in the rover's frame, in metres.
        n_sectors: at least 1.
    """
    here = (forward == 0) & (left == 0)
    if n_sectors == 1:
        return [jnp.ones_like(here)]
    if n_sectors == 2:
        first = (left > 0) | ((left == 0) & (forward >= 0))
        return [first, ~first]
    past = [_cross(*border, forward, left) >= 0 for border in sector_borders(n_sectors)]
    masks = [past[q] & ~past[(q + 1) % n_sectors] for q in range(n_sectors)]
    masks[0] |= here
    return masks


def _cross(cosine: float, sine: float, forward: PerRover, left: PerRover) -> PerRover:
    """Cross product of a border's direction with an offset; on the axes just a sign, not a product."""
    terms = {(1.0, 0.0): left, (0.0, 1.0): -forward, (-1.0, 0.0): -left, (0.0, -1.0): forward}
    return terms.get((cosine, sine), cosine * left - sine * forward)


class Reflections:
    """Gathers the reflections of one channel, for all rovers and sectors at once.

    Args:
        direction: cosine and sine of each rover's heading.
        n_sectors: 360° over the sensor's resolution.
        min_distance: metres; nearer reflectors count as this near (the bounded δ of eq. 4.1).
        radius: metres beyond which nothing is sensed, or None.
        closest: keep the strongest reflector of a sector (the others are occluded) rather than
            the sum over all.
    """

    def __init__(
        self,
        direction: tuple[PerRover, PerRover],
        n_sectors: int,
        min_distance: float,
        radius: float | None,
        closest: bool,
    ):
        self._cosine, self._sine = direction
        self._n_sectors = n_sectors
        self._min_squared = min_distance**2
        self._radius_squared = None if radius is None else radius**2
        self._combine: Callable[[Array, Array], Array] = jnp.maximum if closest else jnp.add

    def channel(self, reflectors: Iterable[Reflector]) -> list[PerRover]:
        """The channel's reading in each sector: Σ V/δ², or max V/δ² if occluded (eq. 4.1, 4.2)."""
        silence = jnp.zeros_like(self._cosine)
        per_reflector = [self._per_sector(*reflector) for reflector in reflectors]
        return [
            functools.reduce(self._combine, (sectors[q] for sectors in per_reflector), silence)
            for q in range(self._n_sectors)
        ]

    def _per_sector(
        self, dx: PerRover, dy: PerRover, value: float, visible: Bool[Array, "..."] | None
    ) -> list[PerRover]:
        squared = dx * dx + dy * dy
        strength = value / jnp.maximum(squared, self._min_squared)
        if visible is not None:
            strength = jnp.where(visible, strength, 0.0)
        if self._radius_squared is not None:
            strength = jnp.where(squared <= self._radius_squared, strength, 0.0)
        forward = self._cosine * dx + self._sine * dy
        left = self._cosine * dy - self._sine * dx
        masks = sector_masks(forward, left, self._n_sectors)
        return [jnp.where(mask, strength, 0.0) for mask in masks]

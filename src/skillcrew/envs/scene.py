"""What there is to draw of a world at one moment, whatever the world is."""

import equinox as eqx
from jaxtyping import Array, Float, Int


class Points(eqx.Module):
    """Things of one kind, such as agents: each a mark, with a heading where it has one."""

    name: str = eqx.field(static=True)
    """Of the kind, for a legend. "agents" are the agents in their order, and get the colours of what they
    choose."""
    position: Float[Array, "things 2"]
    """In the scene's unit of length."""
    heading: Float[Array, " things"] | None = None
    """Radians, counter-clockwise from the first axis."""
    state: Int[Array, " things"] | None = None
    """Which of `states` each is in; negative for one that is not to be drawn."""
    states: tuple[str, ...] = eqx.field(static=True, default=())
    kinds: tuple[str, ...] = eqx.field(static=True, default=())
    """Of each thing the kind that it is of, if they are of several: each kind gets a colour of its own, that
    of the skills whose names end in it where there are such."""


class Discs(eqx.Module):
    """Circles and areas, such as the range within which something counts."""

    name: str = eqx.field(static=True)
    """Of all of them, for a legend. "sensors", one for each agent, are shown of the agent pointed at."""
    position: Float[Array, "things 2"]
    radius: Float[Array, " things"]
    state: Int[Array, " things"] | None = None
    """Which of `states` each is in; negative for one that is not to be drawn."""
    states: tuple[str, ...] = eqx.field(static=True, default=())
    kinds: tuple[str, ...] = eqx.field(static=True, default=())
    """As of `Points`."""


class Lines(eqx.Module):
    """Straight pieces, such as walls, or who holds what."""

    name: str = eqx.field(static=True)
    start: Float[Array, "things 2"]
    end: Float[Array, "things 2"]
    state: Int[Array, " things"] | None = None
    """Which of `states` each is in; negative for one that is not to be drawn."""
    states: tuple[str, ...] = eqx.field(static=True, default=())


class Labels(eqx.Module):
    """Words that stand somewhere."""

    position: Float[Array, "things 2"]
    texts: tuple[str, ...] = eqx.field(static=True)


class Scene(eqx.Module):
    """One moment. Names and texts are the same throughout an episode, so that scenes stack over time."""

    low: tuple[float, float] = eqx.field(static=True)
    """Corner of the part of the plane to show, in metres or whatever the world measures in."""
    high: tuple[float, float] = eqx.field(static=True)
    """The opposite corner."""
    points: tuple[Points, ...] = ()
    discs: tuple[Discs, ...] = ()
    """Drawn below everything else."""
    lines: tuple[Lines, ...] = ()
    labels: tuple[Labels, ...] = ()

"""The page's and the films' colours: those of the figures, and what they are on a dark ground."""

import re
from collections.abc import Sequence

from skillcrew.analysis.page.assemble import asset
from skillcrew.analysis.skill_figures import AGENT_COLOURS, POI_COLOURS, skill_colours

LIGHTEN = 0.22
"""Share of white that a dark colour is mixed with to be seen on a dark ground."""

GROUND = 0.35
"""Relative luminance above which a colour is seen there as it is."""


def both_grounds(colour: str) -> list[str]:
    """A colour, `#rrggbb`, for light and for dark pages."""
    return [colour, on_dark(colour)]


def on_dark(colour: str) -> str:
    """A colour as light as it has to be on a dark page."""
    channels = [int(colour[at : at + 2], 16) for at in (1, 3, 5)]
    red, green, blue = (channel / 255 for channel in channels)
    if 0.2126 * red + 0.7152 * green + 0.0722 * blue > GROUND:
        return colour
    mixed = (round(channel + LIGHTEN * (255 - channel)) for channel in channels)
    return "#" + "".join(f"{channel:02x}" for channel in mixed)


def light_ground() -> dict[str, str]:
    """The colours of paper, text and lines on a light page, by the names that its style sheet gives them."""
    first = asset("look.css").partition("}")[0]
    return dict(re.findall(r"--([a-z]+): (#[0-9a-f]{6})", first))


def colours_of_choices(skills: Sequence[str]) -> list[str]:
    """A colour for each skill that agents choose among; grey where there is nothing to choose."""
    return skill_colours(skills) if len(skills) > 1 else [AGENT_COLOURS[0]]


def colours_of_kinds(kinds: Sequence[str], skills: Sequence[str]) -> dict[str, str]:
    """A colour for each kind of thing: that of the skill that leads there, else one that no skill has.

    `go_to_poi_A` leads to the kinds "A" and "poi_A", `go_to_victim` to things called "victims". Where nothing
    is chosen, all colours are free.
    """
    skills = skills if len(skills) > 1 else ()
    taken, chosen = skill_colours(skills), {}
    for kind in dict.fromkeys(kinds):
        there = [
            colour
            for skill, colour in zip(skills, taken, strict=True)
            if skill.endswith((f"_{kind}", f"_{kind.removesuffix('s')}")) and "away_from" not in skill
        ]
        if there:
            chosen[kind] = there[0]
    return chosen | _others([kind for kind in kinds if kind not in chosen], [*taken, *chosen.values()])


def _others(kinds: Sequence[str], taken: Sequence[str]) -> dict[str, str]:
    """Colours for the rest, those that nothing has yet first."""
    dark = [pair[0] for pair in POI_COLOURS]
    order = [*[colour for colour in dark if colour not in taken], *[one for one in dark if one in taken]]
    return {kind: order[index % len(order)] for index, kind in enumerate(dict.fromkeys(kinds))}

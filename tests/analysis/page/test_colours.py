"""The page's colours on both grounds."""

import numpy as np

from oracles.colours import lightness_and_hue
from skillcrew.analysis.page.colours import both_grounds, colours_of_kinds, on_dark
from skillcrew.analysis.skill_figures import AGENT_COLOURS, POI_COLOURS


def luminance(colour):
    parts = [int(colour[at : at + 2], 16) / 255 for at in (1, 3, 5)]
    linear = [part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def contrast(one, other):
    darker, lighter = sorted((luminance(one), luminance(other)))
    return (lighter + 0.05) / (darker + 0.05)


def test_all_are_seen_on_dark_ground():
    for pair in (*POI_COLOURS, AGENT_COLOURS):
        dark, light = map(on_dark, pair)
        assert contrast(dark, "#171b21") >= 2.7, pair
        assert contrast(dark, light) >= 1.4, pair
    seen = [
        lightness_and_hue(on_dark(colour)) for pair in (*POI_COLOURS[:3], AGENT_COLOURS) for colour in pair
    ]
    gaps = [np.linalg.norm(one - other) for i, one in enumerate(seen) for other in seen[:i]]
    assert min(gaps) > 15, "colour-blind readers confuse two"
    assert both_grounds("#86C5FF") == ["#86C5FF", "#86C5FF"]


def test_things_have_the_colour_of_the_skill_that_leads_there():
    skills = ("go_to_poi_A", "go_away_from_poi_A", "go_to_poi_B", "go_to_victim", "go_away_from_base")
    colours = colours_of_kinds(["B", "poi_A", "victims", "base", "else"], skills)
    assert colours["B"] == POI_COLOURS[1][0]
    assert colours["poi_A"] == POI_COLOURS[0][0]
    assert colours["victims"] == POI_COLOURS[2][0]
    others = {colours["base"], colours["else"]}
    assert len(others) == 2 and not others & {pair[0] for pair in POI_COLOURS[:3]}

"""What is where in a picture, and in which colour."""

import dataclasses
import io
import itertools
import re

import equinox as eqx
import numpy as np
import pytest
from matplotlib.colors import to_rgb
from matplotlib.image import imread

from analysis.film import filmed
from skillcrew.analysis.film import world
from skillcrew.analysis.film.marks import SHAPES, fitting, width_of
from skillcrew.analysis.film.picture import Picture
from skillcrew.analysis.page.assemble import asset


@pytest.fixture(scope="module")
def picture():
    return Picture(filmed.failed(), 481)


def colour_at(picture, frame, place, right=0.0):
    x, y = picture.view.place(place) + np.array([right, 0.0])
    return frame[round(y), round(x)] / 255


def test_sizes_are_even_and_what_is_wide_is_the_same_larger(picture):
    assert picture.size == (480, picture.frame(0).shape[0]) and picture.size[1] % 2 == 0
    assert picture.frame(0).shape == (picture.size[1], 480, 3)
    normal, large = (Picture(filmed.failed(), width).size for width in (720, 1440))
    assert large == (2 * normal[0], 2 * normal[1])


@pytest.mark.parametrize("moment", [0, 3, 4.5])
def test_agents_are_where_they_are_in_the_colour_of_what_they_follow(picture, moment):
    episode = filmed.failed()
    frame, agents = picture.frame(moment), episode.at(moment).points[0]
    place = np.minimum(agents.position, picture.view.high)
    for agent, skill in enumerate(episode.followed(moment)):
        found = colour_at(picture, frame, place[agent], right=-0.72 * picture.mark)
        np.testing.assert_allclose(found, to_rgb(episode.skill_colours[skill]), atol=0.02)


def test_things_are_fuller_in_later_states_and_missing_ones_are_not_drawn(picture):
    episode, herd = filmed.failed(), filmed.failed().at(0).points[1].position
    before, after = picture.frame(0).copy(), picture.frame(6).copy()
    sheep = to_rgb(episode.colours["sheep"])
    assert not np.allclose(colour_at(picture, before, herd[0]), sheep, atol=0.1), "a hungry one is full"
    np.testing.assert_allclose(colour_at(picture, after, herd[0]), sheep, atol=0.02)
    np.testing.assert_allclose(colour_at(picture, after, herd[2]), sheep, atol=0.02)
    shown = np.abs(colour_at(picture, before, herd[2]) - 1).max()
    assert shown < 0.2, "what is not there yet is drawn"


def test_a_frame_is_the_figure(picture):
    frame, buffer = picture.frame(2.5).copy(), io.BytesIO()
    picture.show(2.5).savefig(buffer, format="png", dpi=picture.figure.dpi)
    buffer.seek(0)
    np.testing.assert_allclose(imread(buffer)[..., :3], frame / 255, atol=0.02)


def test_frames_do_not_depend_on_those_before(picture):
    first = picture.frame(1).copy()
    picture.frame(5)
    np.testing.assert_array_equal(picture.frame(1), first)


def test_places_that_are_none_are_left_out():
    episode = filmed.failed()
    position = np.array(episode.scene.points[0].position)
    position[2:, 0] = [[np.nan, 1.0], [np.inf, 1.0], [-np.inf, np.inf], [1e30, -1e30], [1.0, 1.0]]
    radius = np.full_like(episode.scene.discs[1].radius, 1e30)
    scene = eqx.tree_at(
        lambda one: (one.points[0].position, one.discs[1].radius), episode.scene, (position, radius)
    )
    picture = Picture(dataclasses.replace(episode, scene=scene), 480)
    frames = [picture.frame(moment).copy() for moment in np.arange(0, 6.5, 0.5)]
    assert all((one != two).any() for one, two in itertools.pairwise(frames))
    found = colour_at(picture, frames[-1], [1.0, 1.0], right=-0.72 * picture.mark)
    np.testing.assert_allclose(found, to_rgb(episode.skill_colours[episode.followed(6)[0]]), atol=0.02)


def test_rows_of_many_agents_are_low():
    many = dataclasses.replace(filmed.failed(), choice=np.zeros((6, 500), int))
    assert Picture(many, 480).size[1] < Picture(filmed.failed(), 480).size[1] + 200


def test_it_is_drawn_as_on_the_page():
    script = asset("picture.js") + asset("marks.js")
    assert f"const TRAIL = {world.TRAIL};" in script
    shapes = re.search(r"const SHAPES = (\[.*\]);", script)
    assert shapes and shapes[1] == str(list(SHAPES)).replace("'", '"')
    assert world.GROUND["plot"] == "#ffffff" and world.GROUND["text"] == "#1b1f24"


def test_words_are_no_formulas_and_fit():
    assert width_of("$x$", 12) > 2 * width_of("x", 12) and width_of("", 12) == 0
    assert fitting("short", 12, 100) == "short"
    cut = fitting("a line\nof many words", 12, 60)
    assert cut.endswith("…") and width_of(cut, 12) <= 60

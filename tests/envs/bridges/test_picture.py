"""Scenes as pixels: things are where they should be, and what is not to be drawn is not."""

import jax.numpy as jnp
import numpy as np

from skillcrew.envs.bridges.picture import picture
from skillcrew.envs.scene import Discs, Labels, Lines, Points, Scene


def drawn(**things):
    """Which pixels of a scene of 8 × 4 are drawn on: [height, width], the second axis upwards."""
    pixels = picture(Scene((0.0, 0.0), (8.0, 4.0), **things), side=160)
    assert pixels.shape == (80, 160, 3)
    return (pixels != 255).any(axis=-1)[::-1]


def where(marked):
    """Corners of what is drawn, in the scene's unit."""
    rows, columns = np.nonzero(marked)
    return np.array([[columns.min(), rows.min()], [columns.max() + 1, rows.max() + 1]]) / 20


def test_points_discs_lines_and_labels_are_where_they_are():
    place = jnp.array([[6.0, 1.0]])
    assert not drawn().any()
    point = drawn(points=(Points("agents", place),))
    np.testing.assert_allclose(where(point).mean(axis=0), [6, 1], atol=0.1)
    disc = drawn(discs=(Discs("range", place, jnp.array([0.8])),))
    np.testing.assert_allclose(where(disc), [[5.2, 0.2], [6.8, 1.8]], atol=0.11)
    line = drawn(lines=(Lines("walls", place, jnp.array([[2.0, 3.0]])),))
    np.testing.assert_allclose(where(line), [[2, 1], [6, 3]], atol=0.11)
    label = drawn(labels=(Labels(place, ("here",)),))
    np.testing.assert_allclose(where(label).mean(axis=0), [6, 1], atol=0.2)


def test_a_heading_points_where_it_says():
    place = jnp.array([[4.0, 2.0]])
    bare = drawn(points=(Points("agents", place),))
    upwards = drawn(points=(Points("agents", place, heading=jnp.array([np.pi / 2])),))
    more = np.argwhere(upwards & ~bare)
    assert len(more) and (more[:, 0] > 40).all() and abs(more[:, 1].mean() / 20 - 4) < 0.1


def test_states_have_colours_and_negative_ones_are_not_drawn():
    places = jnp.array([[1.0, 1.0], [4.0, 2.0], [7.0, 3.0]])

    def colours(states):
        of = Points("poi", places, state=jnp.array(states), states=("open", "done"))
        pixels = picture(Scene((0.0, 0.0), (8.0, 4.0), points=(of,)), side=160)
        return [tuple(pixels[79 - int(y * 20), int(x * 20)]) for x, y in np.asarray(places)]

    open_, done, gone = colours([0, 1, -1])
    assert gone == (255, 255, 255) and len({open_, done, gone}) == 3
    assert colours([1, -1, 0]) == [done, gone, open_]
    one = Discs("range", places, jnp.ones(3), jnp.array([-1, -1, 0]), ("open",))
    assert where(drawn(discs=(one,)))[0, 0] > 5.5
    walls = Lines("walls", places, places + 0.5, jnp.array([-1, 0, -1]), ("up",))
    np.testing.assert_allclose(where(drawn(lines=(walls,))), [[4, 2], [4.5, 2.5]], atol=0.15)

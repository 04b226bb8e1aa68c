"""What is wrong with a scene: field, value, and how to mend it."""

import equinox as eqx
import jax.numpy as jnp
import pytest

from skillcrew.envs.scene import Discs, Labels, Lines, Points, Scene
from skillcrew.envs.scene_shapes import scene_mistake

TWO = jnp.zeros((2, 2))
GOOD = Scene(
    (0.0, 0.0),
    (4.0, 4.0),
    points=(
        Points("agents", TWO, jnp.zeros(2), jnp.zeros(2, int), ("fine",)),
        Points("POIs", jnp.zeros((3, 2))),
    ),
    discs=(Discs("reach", TWO, jnp.ones(2), kinds=("A", "B")),),
    lines=(Lines("wall", TWO, TWO),),
    labels=(Labels(TWO, ("a", "b")),),
)


def test_what_can_be_drawn_is_fine():
    assert scene_mistake(GOOD, 2) is None
    assert scene_mistake(Scene((0.0, -1.0), (1.0, 0.0)), 5) is None


def with_arrays(where, value):
    return eqx.tree_at(where, GOOD, value, is_leaf=lambda leaf: leaf is None)


def with_word(part, field, value):
    """Past the checks that tests do of what is annotated, which users' worlds do not have."""
    group = getattr(GOOD, part)[0]
    changed = object.__new__(type(group))
    for name in group.__dataclass_fields__:
        object.__setattr__(changed, name, value if name == field else getattr(group, name))
    return eqx.tree_at(lambda scene: getattr(scene, part)[0], GOOD, changed, is_leaf=lambda one: one is group)


def with_field(field, value):
    changed = object.__new__(Scene)
    for name in GOOD.__dataclass_fields__:
        object.__setattr__(changed, name, value if name == field else getattr(GOOD, name))
    return changed


@pytest.mark.parametrize(
    ("scene", "said"),
    [
        (3, "returns int; return a skillcrew.Scene"),
        (with_field("low", (0.0,)), "has low = (0.0,); give a tuple of two numbers, (x, y)"),
        (with_field("high", (4.0, float("nan"))), "has high = (4.0, nan); give a tuple of two numbers"),
        (with_field("high", (0.0, 4.0)), "has high = (0.0, 4.0) and low = (0.0, 0.0); make high the greater"),
        (with_field("discs", GOOD.discs[0]), "; give a tuple of skillcrew.Discs"),
        (with_field("discs", GOOD.lines), "; give a skillcrew.Discs"),
        (with_word("points", "name", 7), "has points[0].name = 7; give a word"),
        (with_word("points", "states", "ab"), "has points[0].states = 'ab'; give a tuple of words"),
        (with_word("discs", "kinds", ("A",)), "discs[0] ('reach') with 1 kinds, for 2 things; give"),
        (with_word("labels", "texts", ("a",)), "position of the shape (2, 2); make it of the shape (1, 2)"),
        (
            with_arrays(lambda one: one.points[0].heading, jnp.zeros(3)),
            "points[0] ('agents') with heading of the shape (3,); make it of the shape (2,)",
        ),
        (
            with_arrays(lambda one: one.points[1].position, jnp.zeros((3, 3))),
            "points[1] ('POIs') with position of the shape (3, 3); make it of the shape (3, 2)",
        ),
        (
            with_arrays(lambda one: one.points[0].state, jnp.zeros(2)),
            "points[0] ('agents') with state of float32; make it whole numbers",
        ),
        (
            with_arrays(lambda one: one.lines[0].end, jnp.zeros((1, 2))),
            "lines[0] ('wall') with end of the shape (1, 2); make it of the shape (2, 2)",
        ),
    ],
)  # fmt: skip
def test_what_is_wrong_is_named(scene, said):
    assert said in scene_mistake(scene, 2)


def test_there_is_one_of_each_agent():
    assert "with 2 things, for 3 agents; give one for each" in scene_mistake(GOOD, 3)

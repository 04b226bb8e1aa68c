"""Recorded episodes on the page: what is where when."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import skillcrew as sc
from analysis.page import meadow
from skillcrew.analysis.page.packing import STEPS_ACROSS, unpack
from skillcrew.analysis.page.scenery import describe_scene, pack_episodes, scene_arrays


@pytest.fixture(scope="module")
def shown():
    return meadow.contents().shown[0]


def test_the_scene_is_where_it_was(shown):
    packed = pack_episodes(shown)
    arrays = unpack(packed)
    index = int(np.argmax(shown.steps))
    for moment in range(shown.steps[index] + 1):
        state = {"left": jnp.int32(0), "time": jnp.int32(moment)}
        scene = jax.tree.map(np.asarray, meadow.Meadow().scene(state))
        # In its corner's steps, of the longer side.
        x, y = arrays["points0.x"][index, :, moment], arrays["points0.y"][index, :, moment]
        position = np.stack([x, y], 1) / STEPS_ACROSS * 8.0
        np.testing.assert_allclose(position, scene.points[0].position, atol=8.0 / STEPS_ACROSS)
        np.testing.assert_array_equal(arrays["points1.state"][index, :, moment], scene.points[1].state)
        radius = arrays["discs1.radius"][index, :, moment] / STEPS_ACROSS * 8.0
        np.testing.assert_allclose(radius, scene.discs[1].radius, atol=8.0 / STEPS_ACROSS)
    assert packed["episodes"][index] == [
        shown.number[index],
        bool(shown.solved[index]),
        shown.returns[index],
        shown.steps[index],
    ]


def test_choices_end_with_the_episode_and_the_rest_stands_still(shown):
    arrays = unpack(pack_episodes(shown))
    for index, steps in enumerate(shown.steps):
        assert (arrays["choice"][index, :, :steps] >= 0).all() and (
            arrays["choice"][index, :, steps:] == -1
        ).all()
        after = arrays["points0.x"][index, :, steps:]
        assert (after == after[:, :1]).all()


def test_names_and_colours(shown):
    about = describe_scene(shown.recording.scene, meadow.Meadow.skills)
    groups = {group["arrays"]: group for group in about["groups"]}
    assert list(groups) == ["discs0", "discs1", "lines0", "points0", "points1", "labels0"]
    assert groups["points1"]["kinds"] == ["sheep", meadow.EVIL, "sheep"]
    assert set(groups["points1"]["ofKinds"]) == {"sheep", meadow.EVIL}
    assert groups["points0"]["colour"] is groups["lines0"]["colour"] is groups["discs0"]["colour"] is None
    assert groups["discs1"]["colour"] is not None and groups["labels0"]["texts"][1] == meadow.EVIL


def test_a_state_without_a_name_is_refused(shown):
    scene = shown.recording.scene
    beyond = eqx.tree_at(lambda one: one.points[1].state, scene, np.full_like(scene.points[1].state, 2))
    with pytest.raises(sc.UserError, match=r"points\[1\] \('herd'\) has state 2, and 2 names of states"):
        scene_arrays(beyond, shown.steps)


def test_episodes_without_a_scene_have_the_rest():
    shown = meadow.contents(meadow.Bare).shown[0]
    packed = pack_episodes(shown)
    assert [name for name, _ in packed["arrays"]] == ["choice", "seen"]
    assert {about[1] for about in packed["episodes"]} == {None}

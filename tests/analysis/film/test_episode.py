"""What there is to see of an episode at any moment."""

import dataclasses

import equinox as eqx
import numpy as np
import pytest

import skillcrew as sc
from analysis.film import filmed
from analysis.page import meadow
from skillcrew.analysis.film.episode import episode_of
from skillcrew.analysis.page.colours import colours_of_choices


def test_it_is_the_episode_that_was_asked_for():
    episode = filmed.failed()
    assert (episode.seed, episode.steps, episode.outcome) == (11, meadow.LENGTH, "failed, 6 steps")
    assert episode.title == f"Walkers {meadow.EVIL} on meadow {meadow.EVIL}"
    assert list(episode.skill_colours) == colours_of_choices(meadow.Meadow.skills)
    assert episode.colours["sheep"] != episode.colours[meadow.EVIL]


def test_between_two_steps_things_are_on_the_way():
    episode = filmed.failed()
    agents, later, between = (episode.at(moment).points[0] for moment in (2, 3, 2.25))
    np.testing.assert_allclose(between.position, 0.75 * agents.position + 0.25 * later.position, rtol=1e-6)
    np.testing.assert_array_equal(episode.at(2.9).points[1].state, episode.at(2).points[1].state)
    np.testing.assert_array_equal(episode.at(6).points[0].position[:, 0], [4.0, 17.0])


def test_headings_turn_the_short_way():
    scene = filmed.failed().scene
    heading = np.array([[3.0, -3.0]] + [[-3.0, 3.0]] * meadow.LENGTH, np.float32)
    turned = dataclasses.replace(
        filmed.failed(), scene=eqx.tree_at(lambda one: one.points[0].heading, scene, heading)
    )
    np.testing.assert_allclose(np.cos(turned.at(0.5).points[0].heading), -1.0)


def test_events_are_changes_of_things():
    events = [(event.step, event.thing, event.state) for event in filmed.failed().events()]
    assert events == [(2, 0, 1), (2, 2, 0), (4, 2, 1)]


def test_at_the_end_agents_follow_what_they_followed_last():
    episode = filmed.failed()
    np.testing.assert_array_equal(episode.followed(6), episode.choice[5])
    np.testing.assert_array_equal(episode.followed(2.9), episode.choice[2])


def test_a_world_that_draws_nothing_has_no_film():
    with pytest.raises(sc.UserError, match=r"^a film needs scene\(state\), which bare does not offer"):
        episode_of(meadow.a_run(meadow.Bare()))

"""What the Rover Domain offers beyond `reset` and `step`."""

import jax
import numpy as np

import skillcrew
from oracles.rover_cases import NEVER
from oracles.rover_scene import Scene
from skillcrew.envs.offers import OffersCentralState, OffersScene, OffersSkillTexts, offers
from skillcrew.envs.rover.motion import direction_of

PLAIN = Scene(n_agents=2, n_poi_types=3)
ROVERS, POIS = [(5.0, 6.0), (7.0, 8.0)], [(1.0, 2.0), (3.0, 4.0), (9.0, 5.0)]


def test_it_offers_a_scene_a_central_state_and_words() -> None:
    for offer in (OffersCentralState, OffersScene, OffersSkillTexts):
        assert offers(PLAIN.env, offer)
    texts = PLAIN.env.skill_texts
    assert tuple(texts) == PLAIN.env.skills
    assert texts["go_to_poi_B"] == "Goes to the nearest POI of type B."
    assert texts["go_away_from_agent"] == "Goes away from the nearest other rover."


def test_the_central_state_tells_all() -> None:
    state = PLAIN.state(ROVERS, POIS, headings=[0.0, np.pi / 2], observed=[True, False, False], time=10)
    seen = jax.jit(PLAIN.env.central_state)(state)
    headings = [1, 0, 0, 1]  # Cosines, then sines.
    expected = [5, 6, 7, 8, *headings, 1, 2, 3, 4, 9, 5, 1, 0, 0, 10 / 50]
    np.testing.assert_allclose(seen, expected, atol=1e-6)


def test_the_central_state_tells_what_options_add() -> None:
    options = dict(order="drawn", poi_speed=0.5, breakdowns=1, team_reward="closest")
    scene, drawn = Scene(n_agents=2, n_poi_types=3, **options), dict(order=[2, 0, 1], breaks_at=[3, NEVER])
    state = scene.state(ROVERS, POIS, courses=[0, 90, 180], closest=[0, 0.5, 1], time=3, **drawn)
    seen = jax.jit(scene.env.central_state)(state)
    np.testing.assert_allclose(seen[-14:], [1, 0, 0, 1, -1, 0, 2, 0, 1, 0, 1, 0, 0.5, 1], atol=1e-6)
    assert len(seen) == 18 + 14


def test_the_scene_shows_where_everything_is_and_how_it_is() -> None:
    scene = Scene(
        n_agents=3, n_poi_types=2, pois_per_type=2, breakdowns=1, world_size=9.0, activation_distance=1.5
    )
    rovers, pois = [*ROVERS, (2.0, 2.0)], [(1.0, 2.0), (3.0, 4.0), (9.0, 5.0), (0.0, 6.0)]
    state = scene.state(
        rovers,
        pois,
        headings=[0.0, 0.5, -1.0],
        observed=[False, False, True, False],
        breaks_at=[NEVER, 3, NEVER],
        time=3,
    )
    shown = jax.jit(scene.env.scene)(state)
    agents, places = shown.points
    assert (shown.low, shown.high, agents.name) == ((0.0, 0.0), (9.0, 9.0), "agents")
    np.testing.assert_allclose(agents.position, rovers)
    np.testing.assert_allclose(agents.heading, [0.0, 0.5, -1.0])
    assert [agents.states[state] for state in agents.state] == ["working", "broken down", "working"]
    np.testing.assert_allclose(places.position, pois)
    assert [places.states[state] for state in places.state] == [
        "not observed",
        "not observed",
        "observed",
        "not observed",
    ]
    np.testing.assert_allclose(shown.discs[0].radius, 1.5)
    assert shown.labels[0].texts == ("A", "A", "B", "B")


def test_without_breakdowns_all_work() -> None:
    (agents, _) = jax.jit(PLAIN.env.scene)(PLAIN.state(ROVERS, POIS)).points
    assert [agents.states[state] for state in agents.state] == ["working", "working"]


def test_numbers_of_an_observation_have_names_that_another_task_has_too() -> None:
    two, three = (Scene(n_agents=2, n_poi_types=types).env.observation_names for types in (2, 3))
    assert len(three) == len(set(three)) == 16 and set(two) < set(three)
    assert three[:5] == (
        "rovers at 0 to 90 degrees",
        *(f"POIs of type {name} at 0 to 90 degrees" for name in "ABC"),
        "rovers at 90 to 180 degrees",
    )
    drawn = Scene(n_agents=2, n_poi_types=2, order="drawn").env.observation_names
    assert drawn == (*two, "call for type A", "call for type B")


def test_what_a_name_says_is_what_is_sensed() -> None:
    state = PLAIN.state([(5.0, 5.0), (5.0, 9.0)], [(7.0, 6.0), (4.0, 8.0), (5.5, 1.0)], headings=[0.0, 0.0])
    seen = jax.jit(PLAIN.env._observe)(state, direction_of(state.heading))[0]
    sensed = {PLAIN.env.observation_names[place] for place in np.flatnonzero(np.asarray(seen))}
    assert sensed == {
        "POIs of type A at 0 to 90 degrees",
        "POIs of type B at 90 to 180 degrees",
        "rovers at 90 to 180 degrees",
        "POIs of type C at 270 to 360 degrees",
    }


def test_each_type_of_rovers_has_names_of_its_own() -> None:
    env = skillcrew.make("rover-t2-crew")
    assert {kind.name: kind.observation_size for kind in env.types} == {
        name: len(set(names)) for name, names in env.observation_names.items()
    }
    assert env.observation_names["scout"][:2] == ("scout at 0 to 45 degrees", "hauler at 0 to 45 degrees")

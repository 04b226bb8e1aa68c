"""What is taken over of another run: skills that find their inputs again, and a team to search around."""

import dataclasses
import functools
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import skillcrew as sc
from oracles.picking import Picking
from skillcrew.algorithms.warm_start import SkillTransfer, team_between
from skillcrew.evolution.evolver import Evolver

SMALL: dict[str, Any] = {
    "population": 8,
    "episodes": 2,
    "probe_episodes": 1,
    "updates": 2,
    "buffer_capacity": 2000,
    "learner": sc.TD3Config(batch_size=8, network=sc.NetworkConfig(hidden=(8, 4))),
    "selector": sc.SelectorConfig(hidden=(4,), sharing="team"),
}
SHORT = {"episode_length": 6}


def madys(env: Any = "rover-t2-c2", kind: Any = sc.MADyS, **changes: Any) -> Any:
    env = sc.make(env, **SHORT) if isinstance(env, str) else env
    return kind(env, **{**SMALL, **changes})


@functools.cache
def skills_of(algorithm: Any, seed: int) -> Any:
    return jax.jit(algorithm._skills.init)(jax.random.key(seed))


def begin(transfer: SkillTransfer, fresh: Any, theirs: Any, frozen: bool = False) -> Any:
    return jax.jit(lambda state, learners: transfer.begin(state, learners, frozen))(fresh, theirs.learners)


@functools.cache
def begun(frozen: bool = False) -> tuple[Any, Any, Any, SkillTransfer]:
    """Skills of two types, and of three, at random and begun with the former."""
    two, three = madys(), madys("rover-t3-c3")
    transfer = SkillTransfer.between(three, two)
    theirs, fresh = skills_of(two, 1), skills_of(three, 2)
    return theirs, fresh, begin(transfer, fresh, theirs, frozen), transfer


def of_skill(networks: Any, skill: Any) -> Any:
    return jax.tree.map(lambda leaf: leaf[skill], networks)


@jax.jit
def said(networks: Any, skill: Any, *given: Any) -> Any:
    """What one skill's network, or all its critics, say to what is given."""
    own = of_skill(networks, skill)
    several = own.network.biases[0].ndim > 1
    return jax.vmap(lambda one: one(*given))(own) if several else own(*given)


def seen(seed: int, new: float) -> tuple[jax.Array, jax.Array]:
    """What one agent sees of three types and of the two first; the third's numbers are `new`."""
    rng = np.random.default_rng(seed)
    sectors = rng.uniform(0, 1, (4, 4)).astype(np.float32)
    sectors[:, 3] = new
    return jnp.asarray(sectors.ravel()), jnp.asarray(sectors[:, :3].ravel())


@pytest.mark.parametrize("network", ["actor", "target_actor"])
def test_a_widened_skill_does_what_it_did_whatever_new_inputs_say(network: str) -> None:
    theirs, _, after, _ = begun()
    ours, before = (getattr(state.learners, network) for state in (after, theirs))
    for skill in (0, 1, 2, 3):
        for new in (0.0, 0.25, 1.0):
            wide, narrow = seen(skill, new)
            np.testing.assert_allclose(said(ours, skill, wide), said(before, skill, narrow), rtol=1e-5)


@pytest.mark.parametrize("network", ["critics", "target_critics"])
def test_its_critics_expect_what_they_did(network: str) -> None:
    theirs, _, after, _ = begun()
    action, (wide, narrow) = jnp.array([0.3, -0.8]), seen(9, 0.7)
    ours, before = (getattr(state.learners, network) for state in (after, theirs))
    expected = said(before, 2, narrow, action)
    assert expected.shape == (2,)
    np.testing.assert_allclose(said(ours, 2, wide, action), expected, rtol=1e-5)


def test_skills_are_found_by_name_and_others_begin_at_random() -> None:
    theirs, fresh, after, transfer = begun()
    # Skills of agents stand behind those of the third type here.
    assert transfer.names[-2:] == ("go_to_agent", "go_away_from_agent")
    assert transfer.places == {0: 0, 1: 1, 2: 2, 3: 3, 6: 4, 7: 5}
    ours, before, random = (
        np.asarray(one.learners.actor.network.weights[1]) for one in (after, theirs, fresh)
    )
    np.testing.assert_array_equal(ours, np.concatenate([before[:4], random[4:6], before[4:]]))


def test_optimisers_buffer_and_plateau_begin_anew() -> None:
    _, fresh, after, _ = begun()
    rest = ("actor_optimiser", "critic_optimiser")
    for name in rest:
        jax.tree.map(
            np.testing.assert_array_equal, getattr(after.learners, name), getattr(fresh.learners, name)
        )
    assert not after.plateau.stopped.any()
    assert jax.tree.structure(after) == jax.tree.structure(fresh)


def test_frozen_skills_learn_no_more_and_new_ones_do() -> None:
    _, _, after, _ = begun(frozen=True)
    np.testing.assert_array_equal(np.flatnonzero(~after.plateau.stopped), [4, 5])


def test_what_is_gone_counts_as_nothing() -> None:
    two, three = madys(), madys("rover-t3-c3")
    transfer = SkillTransfer.between(two, three)
    assert len(transfer.lost) == 4 and all("type C" in name for name in transfer.lost)
    theirs, fresh = skills_of(three, 1), skills_of(two, 2)
    after = begin(transfer, fresh, theirs)
    wide, narrow = seen(5, 0.0)
    before = said(theirs.learners.actor, 0, wide)
    np.testing.assert_allclose(said(after.learners.actor, 0, narrow), before, rtol=1e-5)


def test_agents_of_types_find_their_inputs_by_type() -> None:
    two, three = madys("rover-t2-crew"), madys("rover-t3-crew")
    transfer = SkillTransfer.between(three, two)
    hauler = three.choices().index("hauler/go_to_poi_A")
    # A hauler has half of a scout's sectors, and its numbers end in padding.
    places = transfer.inputs[hauler]
    assert len(places) == three.env.observation_size == 40
    assert places[:6] == (0, 1, 2, 3, None, 4)
    assert set(places[20:]) == {None}
    scout = three.choices().index("scout/go_to_poi_A")
    assert max(place for place in transfer.inputs[scout] if place is not None) == 31


def test_values_of_discrete_actions_are_taken_over_too() -> None:
    algorithm = madys(Picking(), selector=sc.SelectorConfig())
    transfer = SkillTransfer.between(algorithm, algorithm)
    theirs, fresh = skills_of(algorithm, 1), skills_of(algorithm, 2)
    after = begin(transfer, fresh, theirs)
    for name in ("actor", "target_actor"):
        jax.tree.map(
            np.testing.assert_array_equal, getattr(after.learners, name), getattr(theirs.learners, name)
        )


def wider(env: Any) -> Any:
    """The same world, in which one more number is seen, and nobody says which."""

    class Wider(type(env)):
        observation_size = env.observation_size + 1

    return Wider()


A, B = "go_to_poi_A", "go_to_poi_B"
REFUSED = [
    (madys, lambda: sc.EA(sc.make("rover-t2-c2")), "ea on rover-t2-c2 has no skills"),
    (madys, lambda: sc.IPPO(sc.make("rover-t2-c2")), "ippo on rover-t2-c2 has no skills"),
    (lambda: sc.EA(sc.make("rover-t2-c2")), madys, "ea has no skills that could begin"),
    (lambda: madys(skills=(A,)), lambda: madys(skills=(B,)), f"its skills are {B}, and here {A}; none"),
    (
        madys,
        lambda: madys(learner=sc.TD3Config(network=sc.NetworkConfig(hidden=(9,)))),
        "its algorithm.learner.network.hidden is (9,), and here (8, 4); set it to the same",
    ),
    (
        madys,
        lambda: madys(learner=dataclasses.replace(SMALL["learner"], critics=1)),
        "its algorithm.learner.critics is 1, and here 2",
    ),
    (
        madys,
        lambda: madys(sc.make("rover-t2-c2", sensor_resolution=45, **SHORT)),
        "nothing that go_to_poi_A sees there, such as 'rovers at 0 to 45 degrees', is seen here",
    ),
    (
        lambda: madys(wider(Picking())),
        lambda: madys(Picking()),
        "which is which only environments say that offer observation_names, as wider does not",
    ),
]


@pytest.mark.parametrize(("here", "there", "said"), REFUSED, ids=[said[:30] for *_, said in REFUSED])
def test_skills_that_do_not_fit_are_refused(here: Any, there: Any, said: str) -> None:
    with pytest.raises(sc.UserError) as refused:
        SkillTransfer.between(here(), there())
    assert said in str(refused.value)


def test_skills_over_actions_choose_too() -> None:
    assert SkillTransfer.between(sc.IPPO(sc.make("rover-t2-c2"), choose="skills"), sc.MFL(madys().env)).names


TEAMS = [
    (madys, lambda: sc.EA(sc.make("rover-t2-c2")), "ea has no selectors; madys, madys-plus"),
    (lambda: sc.EA(sc.make("rover-t2-c2")), madys, "ea has no selectors"),
    (madys, lambda: madys("rover-t3-c3"), "its selectors choose among go_to_poi_A,"),
    (lambda: madys(skills=(A, B)), lambda: madys(skills=(B, A)), f"among {B}, {A}, and here among {A}, {B}"),
    (
        madys,
        lambda: madys(selector=sc.SelectorConfig(hidden=(5,), sharing="team")),
        "its algorithm.selector.hidden is (5,), and here (4,)",
    ),
    (
        lambda: madys("rover-t3-c6", selector=sc.SelectorConfig()),
        lambda: madys("rover-t3-c3", selector=sc.SelectorConfig()),
        "its teams have a selector for each of 6 agents, and here there are 12",
    ),
    (
        lambda: madys(sc.make("rover-t2-c2", order="drawn", parents=None, **SHORT)),
        madys,
        "its selectors see 12 numbers, and here there are 14",
    ),
]


@pytest.mark.parametrize(("here", "there", "said"), TEAMS, ids=[said[:30] for *_, said in TEAMS])
def test_teams_that_do_not_fit_are_refused(here: Any, there: Any, said: str) -> None:
    with pytest.raises(sc.UserError) as refused:
        team_between(here(), there())
    assert said in str(refused.value)


def test_selectors_that_see_something_else_in_the_same_place_are_refused() -> None:
    plain, other = madys(), madys()
    names = plain.env.observation_names
    other.env.observation_names = (names[1], names[0], *names[2:])
    with pytest.raises(sc.UserError, match="see 'rovers at 0 to 90 degrees' where there is 'POIs of type A"):
        team_between(other, plain)


def searches(evolver: Any) -> tuple[Any, Any]:
    """Of six agents and of twelve that share a selector; where each has its own, of two."""
    if evolver == "coevolution":
        evolution, own = sc.EvolutionConfig(elites=2), sc.SelectorConfig(hidden=(4,))
        two = madys(population=12, evolution=evolution, evolver=evolver, selector=own)
        return two, two
    return madys("rover-t3-c3", evolver=evolver), madys("rover-t3-c6", evolver=evolver)


@pytest.mark.parametrize("evolver", ["genetic", "strategy", "coevolution", "snes"])
def test_the_search_begins_around_a_shared_selector_of_six_for_twelve(evolver: Any) -> None:
    six, twelve = searches(evolver)

    @jax.jit
    def begin(key: Any) -> Any:
        team_between(twelve, six)
        founder = six._search.champion(six._search.init(key))
        other = jax.random.fold_in(key, 1)
        return founder, twelve._search.init(other), twelve._search.init(other, founder)

    founder, fresh, begun = begin(jax.random.key(1))
    assert jax.tree.map(jnp.shape, begun) == jax.tree.map(jnp.shape, fresh)
    jax.tree.map(np.testing.assert_array_equal, twelve._search.champion(begun), founder)
    search: Evolver = twelve._search._evolver
    genome = np.asarray(twelve._search.encode(founder))
    near, far = (np.abs(np.asarray(search.genomes(one)) - genome).mean() for one in (begun, fresh))
    assert 0 < near < 0.5 * far

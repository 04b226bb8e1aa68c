"""Genomes and the networks that they stand for."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy import stats

from skillcrew.policies.memory import PolicyConfig
from skillcrew.policies.population import GenomeCodec, groups
from skillcrew.policies.selector import Selector

AGENTS, POPULATION, OBSERVATION, SKILLS = 3, 5, 4, 2
HIDDEN = 6
GENES_PER_AGENT = OBSERVATION * HIDDEN + HIDDEN + HIDDEN * SKILLS + SKILLS


def create(key) -> Selector:
    return Selector.create(key, OBSERVATION, SKILLS, PolicyConfig(hidden=(HIDDEN,)))


@pytest.fixture(scope="module")
def codec() -> GenomeCodec:
    return GenomeCodec(create, AGENTS)


@pytest.fixture(scope="module")
def genomes(codec):
    return codec.create(jax.random.key(0), POPULATION)


def test_a_genome_has_every_agents_weights_and_biases(codec, genomes) -> None:
    assert codec.genes_per_network == GENES_PER_AGENT
    assert codec.n_genes == AGENTS * GENES_PER_AGENT
    assert genomes.shape == (POPULATION, AGENTS * GENES_PER_AGENT)


def test_to_know_how_genomes_are_laid_out_compiles_nothing(caplog) -> None:
    with jax.log_compiles():
        # No other test has this size.
        assert GenomeCodec(lambda key: jax.random.normal(key, (3, 47)), 2).n_genes == 2 * 3 * 47
    assert not [record for record in caplog.records if "Compiling" in record.message]


def test_no_two_agents_or_individuals_start_alike(genomes) -> None:
    weights = np.asarray(genomes).reshape(POPULATION * AGENTS, GENES_PER_AGENT)
    assert len(np.unique(weights, axis=0)) == POPULATION * AGENTS


def test_networks_start_as_they_are_created(codec, genomes) -> None:
    network = codec.decode(genomes[0]).network.network
    assert not any(bias.any() for bias in network.biases)
    assert float(jnp.std(network.weights[0])) == pytest.approx((2 / OBSERVATION) ** 0.5, rel=0.3)


def test_decoding_loses_and_moves_nothing(codec) -> None:
    genome = jnp.arange(float(codec.n_genes))
    decoded = codec.decode(genome)
    for agent in range(AGENTS):
        one = jax.tree.map(lambda leaf, agent=agent: leaf[agent], decoded)
        genes = np.concatenate([np.asarray(leaf).ravel() for leaf in jax.tree.leaves(one)])
        # Agent by agent: one block of the genome each, all of it.
        block = np.arange(agent * GENES_PER_AGENT, (agent + 1) * GENES_PER_AGENT)
        np.testing.assert_array_equal(np.sort(genes), block)


# Teams that begin in groups


CASES, MEMBERS = 3000, 5


@pytest.fixture(scope="module")
def dealt_out() -> np.ndarray:
    """[0.3, 1.0 or 0.0 alike; cases; members]: the group of each member of many teams."""
    deal = jax.vmap(groups, in_axes=(0, None, None))
    keys = jax.random.split(jax.random.key(1), CASES)
    return np.asarray(jax.jit(lambda keys: [deal(keys, MEMBERS, one) for one in (0.3, 1.0, 0.0)])(keys))


def test_one_group_more_with_the_same_probability_again(dealt_out) -> None:
    numbers = dealt_out[0].max(1) + 1
    stops = 0.7 ** np.arange(MEMBERS) * np.append(np.full(MEMBERS - 1, 0.3), 1.0)
    counts = np.bincount(numbers, minlength=MEMBERS + 1)[1:]
    assert stats.chisquare(counts, CASES * stops).pvalue > 1e-3


def test_members_are_dealt_out_evenly_and_at_random(dealt_out) -> None:
    sizes = np.stack([(dealt_out[0] == group).sum(1) for group in range(MEMBERS)], axis=1)
    present = sizes > 0
    assert (present[:, :-1] >= present[:, 1:]).all(), "groups are numbered without gaps"
    smallest = np.where(present, sizes, MEMBERS).min(1)
    assert (sizes.max(1) - smallest <= 1).all()
    # Who is with whom is anybody's luck: of two groups of 3 and 2, each pair is one in 0.4 of all cases.
    two = dealt_out[0][dealt_out[0].max(1) == 1]
    for one in range(MEMBERS):
        for other in range(one):
            assert (two[:, one] == two[:, other]).mean() == pytest.approx(0.4, abs=0.08)


def test_all_alike_is_one_group_and_none_alike_everybody_another(dealt_out) -> None:
    assert (dealt_out[1] == 0).all()
    assert (np.sort(dealt_out[2], axis=1) == np.arange(MEMBERS)).all()
    assert groups(jax.random.key(0), 1, 0.5).tolist() == [0]


def test_a_random_team_begins_in_groups() -> None:
    key = jax.random.key(3)
    codecs = {
        "some": GenomeCodec(create, AGENTS, 0.5),
        "one": GenomeCodec(create, AGENTS, 1.0),
        "none": GenomeCodec(create, AGENTS, 0.0),
        "default": GenomeCodec(create, AGENTS),
    }
    # Groups are dealt by a key of their own.
    keys = {"some": key, "one": key, "none": jax.random.split(key)[0], "default": jax.random.split(key)[0]}
    genomes = jax.jit(lambda keys: {name: codecs[name].create(keys[name], 40) for name in codecs})(keys)
    drawn = {name: np.asarray(rows).reshape(40, AGENTS, -1) for name, rows in genomes.items()}
    np.testing.assert_array_equal(drawn["none"], drawn["default"])
    assert (drawn["one"] == drawn["one"][:, :1]).all()
    # Individuals remain different, and every network is one that would have been drawn anyway.
    assert len(np.unique(drawn["one"][:, 0], axis=0)) == 40
    for rows in (drawn["some"], drawn["one"]):
        assert (rows[:, :, None] == drawn["none"][:, None]).all(3).any(2).all()
    different = [len(np.unique(team, axis=0)) for team in drawn["some"]]
    assert set(different) == {1, 2, 3}
    # A half, a quarter, and a quarter of the 40.
    assert 10 <= different.count(1) <= 30

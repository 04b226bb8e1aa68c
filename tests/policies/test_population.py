"""Genomes and the networks that they stand for."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from skillcrew.policies.memory import PolicyConfig
from skillcrew.policies.population import GenomeCodec
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

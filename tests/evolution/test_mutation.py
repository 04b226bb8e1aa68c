"""How genomes change when they mutate."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from skillcrew.evolution.mutation import MutationConfig, gaussian, mutate, substructured

SHAPE = (120, 500)
"""Children and genes: 60,000 weights, so that shares are known to a fraction of a percent."""


def share(of: np.ndarray) -> float:
    return float(np.asarray(of).mean())


def changed_by(config: MutationConfig, size: float) -> np.ndarray:
    """The weights that changed, of genomes whose weights are all of one size."""
    genomes = jnp.full(SHAPE, size)
    after = np.asarray(substructured(jax.random.key(5), genomes, config))
    return after[after != np.float32(size)]


def test_substructured_changes_the_wanted_share_of_weights() -> None:
    # Ordinary changes multiply by 1 (strength 0), large ones by noise, and resets set to 0.
    config = MutationConfig(
        fraction=0.4,
        smallest_fraction=0.4,
        strength=0.0,
        large_probability=0.3,
        large_strength=0.5,
        reset_probability=0.2,
        reset_deviation=0.0,
    )
    after = np.asarray(substructured(jax.random.key(0), jnp.full(SHAPE, 3.0), config))
    assert share(after == 0) == pytest.approx(0.4 * 0.2, abs=0.005)
    assert share((after != 0) & (after != 3)) == pytest.approx(0.4 * 0.3, abs=0.005)


@pytest.mark.parametrize("size", [0.01, 7.0])
def test_ordinary_and_large_noise_are_relative_to_the_weight(size: float) -> None:
    ordinary = MutationConfig(
        fraction=0.3, smallest_fraction=0.3, strength=0.2, large_probability=0.0, reset_probability=0.0
    )
    changed = changed_by(ordinary, size)
    assert changed.size == pytest.approx(0.3 * np.prod(SHAPE), rel=0.03)
    assert changed.mean() == pytest.approx(size, rel=0.01)
    assert changed.std() == pytest.approx(0.2 * size, rel=0.03)
    large = MutationConfig(
        fraction=0.3, smallest_fraction=0.3, large_strength=5.0, large_probability=1.0, reset_probability=0.0
    )
    assert changed_by(large, size).std() == pytest.approx(5 * size, rel=0.03)


def test_reset_weights_forget_their_size() -> None:
    config = MutationConfig(
        fraction=0.3, smallest_fraction=0.3, large_probability=0.0, reset_probability=1.0, reset_deviation=0.6
    )
    changed = changed_by(config, 50.0)
    assert changed.mean() == pytest.approx(0.0, abs=0.02)
    assert changed.std() == pytest.approx(0.6, rel=0.03)


def test_each_child_changes_in_places_of_its_own() -> None:
    config = MutationConfig(fraction=0.5, smallest_fraction=0.5)
    changed = np.asarray(substructured(jax.random.key(1), jnp.ones(SHAPE), config)) != 1
    assert share(changed[0] == changed[1]) == pytest.approx(0.5, abs=0.1)
    assert share(changed[:, 0] == changed[:, 1]) == pytest.approx(0.5, abs=0.2)


@pytest.mark.parametrize("size", [0.0, 9.0])
def test_gaussian_noise_is_the_same_whatever_the_weight(size: float) -> None:
    config = MutationConfig(kind="gaussian", gaussian_deviation=0.3)
    noise = np.asarray(gaussian(jax.random.key(2), jnp.full(SHAPE, size), config)) - size
    assert noise.mean() == pytest.approx(0.0, abs=0.01)
    assert noise.std() == pytest.approx(0.3, rel=0.02)
    assert share(noise != 0) > 0.999


@pytest.mark.parametrize("kind", ["substructured", "gaussian"])
def test_mask_tells_which_children_changed_and_the_others_are_untouched(kind) -> None:
    genomes = jax.random.normal(jax.random.key(3), SHAPE)
    config = MutationConfig(kind=kind, probability=0.6, fraction=0.1, smallest_fraction=0.1)
    after, mutates = mutate(jax.random.key(4), genomes, config)
    changed = np.asarray(after != genomes)
    assert (changed.any(1) == np.asarray(mutates)).all()
    assert share(mutates) == pytest.approx(0.6, abs=0.12)
    # Which of the two kinds it was.
    assert share(changed[np.asarray(mutates)]) == pytest.approx(
        0.1 if kind == "substructured" else 1, abs=0.01
    )


def test_each_child_draws_its_own_share_of_changed_weights() -> None:
    config = MutationConfig(probability=1.0, fraction=0.4, smallest_fraction=0.01)
    genomes = jnp.ones((400, 2000))
    changed, _ = mutate(jax.random.key(5), genomes, config)
    share = (np.asarray(changed) != 1).mean(1)
    assert share.min() < 0.015 and share.max() > 0.35
    # Uniform in the logarithm: the median is the geometric mean of the two ends.
    assert np.median(share) == pytest.approx((0.4 * 0.01) ** 0.5, rel=0.15)


@pytest.mark.parametrize(
    "config",
    [
        MutationConfig(fraction=1.0, smallest_fraction=1.0, large_probability=0.9, limit=6.0),
        MutationConfig(kind="gaussian", gaussian_deviation=9.0, limit=6.0),
    ],
    ids=lambda config: config.kind,
)
def test_no_change_makes_a_weight_larger_than_the_limit(config: MutationConfig) -> None:
    before = jnp.full((40, 50), 5.0).at[0].set(70.0)
    after = np.asarray(mutate(jax.random.key(6), before, config)[0])
    changed = after != np.asarray(before)
    assert np.abs(after[changed]).max() == 6.0
    # What a learner that migrated brought along stays as it is where nothing changes it.
    assert (after[0][~changed[0]] == 70.0).all()


def test_weights_stay_small_over_a_long_line_of_mutations() -> None:
    """By the default, and not by its limit; large relative noise lets them grow without one."""

    def after_many(config: MutationConfig) -> float:
        genomes = jax.random.normal(jax.random.key(7), (20, 100))

        def once(genomes, key):
            return mutate(key, genomes, config)[0], None

        keys = jax.random.split(jax.random.key(8), 2000)
        return float(jnp.abs(jax.jit(lambda: jax.lax.scan(once, genomes, keys))()[0]).max())

    assert after_many(MutationConfig(limit=float("inf"))) < 30
    assert after_many(MutationConfig(large_probability=0.1, limit=float("inf"))) > 1e4

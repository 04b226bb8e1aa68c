"""Episodes as learners get them: padding is harmless, minibatches are fair."""

import jax
import jax.numpy as jnp
import numpy as np

from oracles import on_policy as oracle
from skillcrew.learners.on_policy.experience import Experience, each_minibatch, mean_where


def test_padding_is_replaced_by_zeros_and_the_observation_after_the_end_is_kept() -> None:
    experience = oracle.lived(3, padding=float("nan"))
    for leaf in jax.tree.leaves(experience):
        assert not jnp.isnan(leaf.astype(jnp.float32)).any()
    for world, length in enumerate(oracle.LENGTHS):
        assert experience.observation[: length + 1, world].all()
        assert not experience.observation[length + 1 :, world].any()
        assert not experience.decides[length:, world].any()
        ends = experience.terminated[:, world].tolist()
        assert ends == [t == length - 1 and oracle.TERMINATED[world] for t in range(oracle.TIME)]


def test_the_observation_after_a_step_is_that_of_the_same_episode() -> None:
    """Where worlds begin anew after an end, what is bootstrapped from is still the end."""
    one = jnp.ones((2, 1, 1, 1))
    experience = Experience.create(
        observation=jnp.array([1.0, 50.0]).reshape(2, 1, 1, 1),
        next_observation=jnp.array([2.0, 60.0]).reshape(2, 1, 1, 1),
        taken=jnp.zeros((2, 1, 1), jnp.int32),
        reward=one[..., 0],
        terminated=jnp.zeros((2, 1), bool),
        mask=jnp.array([[True], [False]]),
        decides=jnp.ones((2, 1, 1), bool),
    )
    assert experience.observation.ravel().tolist() == [1.0, 2.0, 0.0]


def test_a_mean_is_of_what_counts() -> None:
    assert mean_where(jnp.array([1.0, jnp.inf, 5.0]), jnp.array([True, False, True])) == 3
    assert mean_where(jnp.array([1.0, 2.0]), jnp.zeros(2, bool)) == 0


def test_each_epoch_deals_all_worlds_out_anew() -> None:
    worlds, minibatches, epochs = 6, 3, 4

    def note(state, dealt):
        count, seen = state
        return (count + 1, seen.at[count].set(dealt)), {"size": jnp.asarray(len(dealt), jnp.float32)}

    seen = jnp.zeros((minibatches * epochs, worlds // minibatches), jnp.int32)
    (_, seen), metrics = each_minibatch(jax.random.key(1), worlds, minibatches, epochs, note, (0, seen))
    by_epoch = np.asarray(seen).reshape(epochs, -1)
    assert metrics["size"] == 2
    np.testing.assert_array_equal(np.sort(by_epoch, axis=1), np.tile(np.arange(worlds), (epochs, 1)))
    assert len({tuple(dealt) for dealt in by_epoch}) == epochs

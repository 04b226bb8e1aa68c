"""What `Environment` gives to whoever writes `reset` and `step` for one world."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from skillcrew.envs.environment import Environment, TimeStep

WORLDS = 5


class Drift(Environment):
    """Three agents on a line; their places, the noise and the clock differ between worlds."""

    name = "drift"
    n_agents = 3
    observation_size = 2
    action_size = 1
    episode_length = 4
    skills = ("stay", "go", "turn", "wait")

    def reset(self, key):
        state = {"place": jax.random.normal(key, (3,)), "time": jnp.zeros((), jnp.int32)}
        return state, self._observe(state)

    def step(self, state, action, key):
        place = state["place"] + action[:, 0] + jax.random.normal(key, (3,))
        after = {"place": place, "time": state["time"] + 1}
        done = place.sum() > 0
        return after, TimeStep(
            observation=self._observe(after),
            local_rewards=place[:, None] * jnp.arange(1.0, 5.0)[None],
            team_reward=place.max(),
            terminated=done,
            truncated=(after["time"] >= 4) & ~done,
        )

    def _observe(self, state):
        return jnp.stack([state["place"], -2 * state["place"]], axis=1)


@pytest.fixture(scope="module")
def worlds():
    env, keys = Drift(), jax.random.split(jax.random.key(0), WORLDS)
    states, observation = env.reset_worlds(keys)
    states = {**states, "time": jnp.arange(WORLDS, dtype=jnp.int32)}
    actions = jax.random.normal(jax.random.key(1), (3, 1, WORLDS))
    return env, keys, states, observation, actions


def assert_world_is(together, w: int, alone) -> None:
    assert jax.tree.structure(together) == jax.tree.structure(alone)
    for many, one in zip(jax.tree.leaves(together), jax.tree.leaves(alone), strict=True):
        assert many.shape == (*one.shape, WORLDS)
        np.testing.assert_allclose(np.asarray(many)[..., w], np.asarray(one), rtol=1e-6)


@pytest.mark.parametrize("w", range(WORLDS))
def test_resetting_many_worlds_is_resetting_each(worlds, w: int) -> None:
    env, keys, states, observation, _ = worlds
    place, observed = env.reset(keys[w])
    assert_world_is(({"place": states["place"]}, observation), w, ({"place": place["place"]}, observed))


@pytest.mark.parametrize("w", range(WORLDS))
def test_stepping_many_worlds_is_stepping_each_with_its_own_key(worlds, w: int) -> None:
    env, keys, states, _, actions = worlds
    together = env.step_worlds(states, actions, keys)
    alone = env.step(jax.tree.map(lambda leaf: leaf[..., w], states), actions[..., w], keys[w])
    assert_world_is(together, w, alone)


def test_the_default_description_is_the_name() -> None:
    assert Drift().describe() == {"name": "drift"}


def test_an_environment_without_reset_and_step_cannot_be_made() -> None:
    with pytest.raises(TypeError, match=r"reset.*step"):
        Environment()

"""A pendulum of our own, for benchmarks beside single-agent libraries."""

import equinox as eqx
import jax
import jax.numpy as jnp
from benchmarks.evorl_race import TIME_LIMIT
from jaxtyping import Array, Float, Int, Key

import skillcrew as sc


class PendulumState(eqx.Module):
    """Where a pendulum is."""

    angle: Float[Array, ""]
    """From upright, in radians, not wrapped."""
    speed: Float[Array, ""]
    time: Int[Array, ""]


class Pendulum(sc.Environment):
    """Pendulum-v1: swing a rod up by a motor that is too weak to lift it, and hold it there.

    A uniform rod of length and mass 1 under gravity 10 turns about its end: its angular acceleration is
    15 sin(angle) + 3 torque. Time goes by 0.05 s a step, the speed first. A step costs the squares of
    angle, speed and torque, weighted by 1, 0.1 and 0.001, as they are before it.
    """

    name = "pendulum"
    n_agents = 1
    observation_size = 3
    action_size = 1
    episode_length = TIME_LIMIT
    skills = ("upright",)

    def reset(self, key: Key[Array, ""]) -> tuple[PendulumState, Float[Array, "agents obs"]]:
        bounds = jnp.array([jnp.pi, 1.0])
        angle, speed = jax.random.uniform(key, (2,), minval=-bounds, maxval=bounds)
        state = PendulumState(angle, speed, jnp.zeros((), jnp.int32))
        return state, _observe(state)

    def step(
        self, state: PendulumState, action: Float[Array, "agents act"], key: Key[Array, ""]
    ) -> tuple[PendulumState, sc.TimeStep]:
        torque = 2.0 * jnp.clip(action[0, 0], -1.0, 1.0)
        wrapped = (state.angle + jnp.pi) % (2 * jnp.pi) - jnp.pi
        reward = -(wrapped**2 + 0.1 * state.speed**2 + 0.001 * torque**2)
        acceleration = 15.0 * jnp.sin(state.angle) + 3.0 * torque
        speed = jnp.clip(state.speed + 0.05 * acceleration, -8.0, 8.0)
        state = PendulumState(state.angle + 0.05 * speed, speed, state.time + 1)
        return state, sc.TimeStep(
            observation=_observe(state),
            local_rewards=reward[None, None],
            team_reward=reward,
            # As on the other side, whose environment calls its time limit an end.
            terminated=state.time >= TIME_LIMIT,
            truncated=jnp.zeros((), bool),
        )


def _observe(state: PendulumState) -> Float[Array, "agents obs"]:
    return jnp.stack([jnp.cos(state.angle), jnp.sin(state.angle), state.speed])[None]

"""Our side of `evorl.py`: skillcrew's ERL on a pendulum of our own. Started by that program."""

import sys
from typing import Any

from benchmarks import machine
from benchmarks.evorl_race import Settings, serve, settings_of
from benchmarks.stepping_sides import one_thread

if __name__ == "__main__":
    one_thread()

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from benchmarks.pendulum import Pendulum, PendulumState

import skillcrew as sc
from skillcrew.experiment.generation import compiled, play
from skillcrew.learners.td3 import TD3State
from skillcrew.policies.actor import Actor


class LearnerTeam(eqx.Module):
    """The learner's actor as a team of one."""

    actor: Actor

    def initial_memory(self) -> Any:
        return ()

    def act(self, observation: Any, memory: Any, key: Any) -> tuple[Any, Any, Any]:
        del key
        return jax.vmap(self.actor)(observation), memory, jnp.zeros(1, jnp.int32)


def _learner(state: Any) -> Actor:
    """The learner's actor, found by its kind: where a state keeps it is the algorithm's own affair."""
    leaves = jax.tree.leaves(state, is_leaf=lambda leaf: isinstance(leaf, TD3State))
    (learners,) = (leaf for leaf in leaves if isinstance(leaf, TD3State))
    return jax.tree.map(lambda leaf: leaf[0], learners.actor)


def make_erl(s: Settings) -> sc.ERL:
    """Our ERL with the common settings; what they leave open stays as it is by default."""
    lived = s.population * s.episodes + s.episodes + s.learner_episodes
    return sc.ERL(
        Pendulum(),
        population=s.population,
        episodes=s.episodes,
        learner_episodes=s.learner_episodes,
        migration_period=s.migration_period,
        fitness_discount=1.0,
        updates=s.updates_per_episode * lived,
        exploration_noise=s.exploration_noise,
        buffer_capacity=s.buffer_capacity,
        learner=learner_config(s),
        evolution=sc.EvolutionConfig(
            elites=s.elites,
            tournament_size=s.tournament_size,
            crossover_share=0.0,
            mutation=mutation_config(s),
        ),
    )


def learner_config(s: Settings) -> sc.TD3Config:
    return sc.TD3Config(
        discount=s.discount,
        soft_update=s.soft_update,
        actor_learning_rate=s.learning_rate,
        critic_learning_rate=s.learning_rate,
        batch_size=s.batch_size,
        policy_delay=s.policy_delay,
        target_noise=s.target_noise,
        target_noise_clip=s.target_noise_clip,
        network=sc.NetworkConfig(hidden=s.hidden, input_scaling="none"),
    )


def mutation_config(s: Settings) -> sc.MutationConfig:
    return sc.MutationConfig(
        fraction=s.mutated_share,
        smallest_fraction=s.mutated_share,
        strength=s.strength,
        large_probability=s.large_probability,
        large_strength=s.large_strength,
        reset_probability=s.reset_probability,
        reset_deviation=1.0,
    )


class Ours:
    """A `Side`."""

    def __init__(self, settings: Settings):
        self._erl = make_erl(settings)
        self._init = jax.jit(lambda seed: self._erl.init(jax.random.key(seed)))
        self._evaluate = jax.jit(
            lambda team, key: play(self._erl, team, key, settings.evaluation_episodes).team_return().mean()
        )

    def compile(self) -> None:
        # As `skillcrew train` does: compiled by its options, the buffer updated in place.
        self._step = compiled(lambda state: self._erl.step(state)[0], self.start(0), donate_argnums=0)

    def start(self, seed: int) -> Any:
        return jax.block_until_ready(self._init(seed))

    def step(self, state: Any) -> Any:
        return jax.block_until_ready(self._step(state))

    def steps(self, state: Any) -> int:
        return int(state.environment_steps)

    def evaluate(self, state: Any, seed: int) -> dict[str, float]:
        key = jax.random.fold_in(jax.random.key(seed), state.environment_steps)
        learner = LearnerTeam(_learner(state))
        return {
            "population": float(self._evaluate(self._erl.team(state), key)),
            "learner": float(self._evaluate(learner, key)),
        }

    def parity(self, record: dict[str, Any] | None) -> dict[str, Any]:
        """Replays a record; returns the largest differences, and steps that end an episode on one side."""
        assert record is not None
        theirs = {name: jnp.asarray(rows, jnp.float32) for name, rows in record.items()}
        env = self._erl.env

        def replay(start: Any, actions: Any) -> Any:
            state = PendulumState(start[0], start[1], jnp.zeros((), jnp.int32))
            key = jax.random.key(0)
            _, seen = jax.lax.scan(lambda s, a: env.step(s, a[None], key), state, actions)
            return seen

        seen = jax.jit(jax.vmap(replay))(theirs["start"], theirs["actions"])
        apart = np.asarray(seen.terminated) != (np.asarray(theirs["terminations"]) > 0)
        return {
            "steps": int(theirs["rewards"].size),
            "observation": float(jnp.abs(seen.observation[:, :, 0] - theirs["observations"]).max()),
            "reward": float(jnp.abs(seen.team_reward - theirs["rewards"]).max()),
            "ends": int(apart.sum()),
        }

    def versions(self) -> dict[str, str]:
        return machine.versions(("skillcrew", "jax", "jaxlib"))


if __name__ == "__main__":
    serve(Ours, settings_of(sys.argv[1]))

"""Our side of `benchmarl.py`: MADDPG and MATD3 in JaxMARL's particle worlds. Started by that program."""

import time
from typing import Any

from benchmarks import machine
from benchmarks.benchmarl_settings import TASKS, Settings, serve
from benchmarks.stepping_sides import one_thread

if __name__ == "__main__":
    one_thread()

import dataclasses
import functools

import jax
import jax.numpy as jnp
import numpy as np

import skillcrew as sc
from skillcrew.experiment.generation import compiled, play


def make(kind: Any, s: Settings) -> Any:
    """MADDPG or MATD3 with the common settings; what they leave open stays as it is by default."""
    learner = dataclasses.replace(
        kind.config_class().learner,
        batch_size=s.batch_size,
        actor_learning_rate=s.learning_rate,
        critic_learning_rate=s.learning_rate,
        discount=s.discount,
        soft_update=s.soft_update,
        network=sc.NetworkConfig(hidden=s.hidden, input_scaling="none"),
    )
    env = sc.make(f"jaxmarl:{TASKS[s.task]}", options={"action_type": "Continuous"})
    return kind(env, reward="local", episodes=s.episodes, updates=s.updates, learner=learner)


def score(algorithm: Any, episodes: int, state: Any, key: Any) -> Any:
    """Mean return of what has been learned."""
    return play(algorithm, algorithm.team(state), key, episodes).team_return().mean()


class Ours:
    """Both algorithms, compiled."""

    def __init__(self, settings: Settings):
        self._settings = settings
        began = time.process_time()
        self._algorithms = {kind.name: make(kind, settings) for kind in (sc.MADDPG, sc.MATD3)}
        self._steps, self._scores = {}, {}
        for name, algorithm in self._algorithms.items():
            start = jax.jit(algorithm.init)(jax.random.key(0))
            # As `skillcrew train` does: compiled by its options, the buffer updated in place.
            self._steps[name] = compiled(lambda state, a=algorithm: a.step(state)[0], start, donate_argnums=0)
            self._scores[name] = jax.jit(functools.partial(score, algorithm, settings.scored))
        self.ready = {
            "compiling": time.process_time() - began,
            "versions": machine.versions(("skillcrew", "jax", "jaxmarl")),
        }

    def answer(self, command: dict[str, Any]) -> dict[str, Any]:
        """To `run`, an algorithm and a seed, or to `parity`, a record of their episodes."""
        if command["do"] == "parity":
            return self._parity(command["record"])
        return self._run(command["algorithm"], command["seed"])

    def _run(self, name: str, seed: int) -> dict[str, Any]:
        key, score_key = jax.random.split(jax.random.key(seed))
        state = jax.block_until_ready(jax.jit(self._algorithms[name].init)(key))
        began = time.process_time()
        while int(state.environment_steps) < self._settings.steps:
            state = jax.block_until_ready(self._steps[name](state))
        seconds = time.process_time() - began
        return {"return": float(self._scores[name](state, score_key)), "seconds": seconds}

    def _parity(self, record: list[dict[str, Any]]) -> dict[str, float]:
        """Largest differences when their recorded episodes are lived here, step by step."""
        world = self._algorithms["maddpg"].env.world
        step = jax.jit(world.step_env)
        observed, paid = 0.0, 0.0
        for episode in record:
            _, state = world.reset(jax.random.key(0))
            state = state.replace(
                p_pos=jnp.asarray(episode["position"]),
                p_vel=jnp.zeros_like(state.p_vel),
                goal=None if episode["goal"] is None else jnp.asarray(episode["goal"]),
            )
            for lived in episode["steps"]:
                action = {agent: jnp.asarray(row) for agent, row in lived["action"].items()}
                observation, state, reward, _, _ = step(jax.random.key(0), state, action)
                for agent in world.agents:
                    apart = np.asarray(observation[agent]) - np.asarray(lived["observation"][agent])
                    observed = max(observed, float(np.abs(apart).max()))
                    paid = max(paid, abs(float(reward[agent]) - lived["reward"][agent]))
        return {"observation": observed, "reward": paid}


if __name__ == "__main__":
    serve(Ours)

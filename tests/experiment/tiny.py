"""Runs small enough for tests: one of MADyS, made once, and a counting algorithm for the runner alone."""

import atexit
import dataclasses
import functools
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

import skillcrew as sc
from experiment.meeting import Meeting
from skillcrew.algorithms.ea import EA
from skillcrew.algorithms.mfl import MFL
from skillcrew.envs.environment import Environment, TimeStep
from skillcrew.experiment.checkpoints import Checkpoints
from skillcrew.experiment.generation import shapes
from skillcrew.experiment.metrics import read_metrics
from skillcrew.policies.memory import PolicyConfig
from skillcrew.policies.selector import SelectorConfig

SEEDS = (3, 11)
STEPS = 900
OPTIONS = {"score_episodes": 3, "generations_per_report": 2, "checkpoint_seconds": 0.0}


READ_ONLY = {"JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS": "1e9"}
"""For processes that may be killed while they write a compiled program: they read others' alone."""


def scratch() -> Path:
    """A folder for the whole session."""
    folder = Path(tempfile.mkdtemp(prefix="skillcrew-tests-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return folder


def tiny_madys(**overrides) -> sc.MADyS:
    """Two rovers that now and then succeed within six steps, so that episodes differ in length."""
    env = sc.make("rover-t2-c2", episode_length=6, activation_distance=9.0)
    fields = {
        "population": 7,
        "episodes": 2,
        "probe_episodes": 1,
        "updates": 2,
        "buffer_capacity": 400,
        "skills": ("go_to_poi_A", "go_to_poi_B"),
        "selector": SelectorConfig(hidden=(8,)),
        "learner": sc.TD3Config(batch_size=8, network=sc.NetworkConfig(hidden=(8,))),
    }
    return sc.MADyS(env, **{**fields, **overrides})


def tiny_ea(**overrides) -> EA:
    """Actors with memory, moved by a strategy."""
    fields = {
        "population": 8,
        "episodes": 2,
        "actor": PolicyConfig(hidden=(8,), memory=3),
        "evolver": "strategy",
    }
    return EA(Meeting(), **{**fields, **overrides})


def tiny_mfl(**overrides) -> MFL:
    """Reactive timetables that breed once skills are trained for a while, and begin anew again and again."""
    like = tiny_madys()
    same = ("episodes", "probe_episodes", "updates", "buffer_capacity", "learner")
    fields = {
        **{field: getattr(like.config, field) for field in same},
        "population": 8,
        "selector": SelectorConfig(hidden=(8,), memory=3, phases=4, reactive=True, alike=0.5, hold=2),
        "evolution": sc.EvolutionConfig(
            elites=2, challengers=2, restart=sc.RestartConfig(patience=2, below=2.0)
        ),
        "recorded_episodes": 1,
        "pretraining_steps": 250,
    }
    return MFL(Meeting(), **{**fields, **overrides})


def tiny_merl(**overrides) -> sc.MERL:
    """A network for each rover, learned and bred in subpopulations with a hall of fame."""
    like = tiny_madys()
    fields = {
        "population": 12,
        "episodes": 2,
        "learner_episodes": 3,
        "migration_period": 2,
        "updates": 2,
        "buffer_capacity": 400,
        "sharing": "agent",
        "evolver": "coevolution",
        "evolution": sc.EvolutionConfig(elites=2),
        "coevolution": sc.CoevolutionConfig(teams=2, hall_of_fame=sc.HallOfFameConfig(size=3)),
        "learner": like.config.learner,
    }
    return sc.MERL(Meeting(), **{**fields, **overrides})


def tiny_cerl(**overrides) -> sc.CERL:
    """Two learners for whose episodes a resource manager draws lots."""
    like = tiny_madys()
    fields = {
        "population": 7,
        "episodes": 2,
        "discounts": (0.5, 0.9),
        "learner_episodes": 3,
        "migration_period": 2,
        "updates": 2,
        "buffer_capacity": 400,
        "learner": like.config.learner,
    }
    return sc.CERL(Meeting(), **{**fields, **overrides})


def tiny_matd3(**overrides) -> sc.MATD3:
    """Two policies for each rover, of which one is drawn for each episode."""
    fields = {
        "ensemble": 2,
        "episodes": 8,
        "updates": 2,
        "buffer_capacity": 400,
        "learner": sc.MADDPGLearnerConfig.matd3(batch_size=8, network=sc.NetworkConfig(hidden=(8,))),
    }
    return sc.MATD3(Meeting(), **{**fields, **overrides})


@functools.cache
def finished_run() -> Path:
    """A run to the end of its budget, uninterrupted. Copy it before changing anything."""
    folder = scratch() / "finished"
    sc.train(tiny_madys(), SEEDS, float(STEPS), folder, **OPTIONS)
    return folder


def start_command(*words: str) -> subprocess.Popen:
    """Starts the command line in a process of its own."""
    return subprocess.Popen(
        [sys.executable, "-c", "from skillcrew.cli.main import main; main()", *words],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, **READ_ONLY, "COLUMNS": "200"},
    )


def last_arrays(*folders: Path, algorithm=None) -> list[dict[str, np.ndarray]]:
    """All arrays of the last checkpoint of each of some runs of one algorithm, by name."""
    run = sc.Run(folders[0], getattr(algorithm, "env", None))
    like = shapes(algorithm or run.algorithm, run.config)
    read = [Checkpoints(folder / "checkpoints").read(like)[0] for folder in folders]
    return [{name: np.asarray(array) for name, array in arrays.items()} for arrays in read]


def assert_same_arrays(these: dict[str, np.ndarray], those: dict[str, np.ndarray]) -> None:
    """Equal to the bit, NaN equal to NaN."""
    assert sorted(these) == sorted(those)
    for name, array in these.items():
        assert array.dtype == those[name].dtype, name
        np.testing.assert_array_equal(array, those[name], err_msg=name)


def assert_same_ending(folder: Path, reference: Path, algorithm=None) -> None:
    """Two runs have the same metrics, and all that their last checkpoints hold is the same."""
    assert_same_arrays(read_metrics(folder / "metrics.parquet"), read_metrics(reference / "metrics.parquet"))
    assert_same_arrays(*last_arrays(folder, reference, algorithm=algorithm))


def contents(folder: Path) -> dict[str, bytes]:
    """Every file below a folder, to see whether anything changed."""
    files = (path for path in sorted(folder.rglob("*")) if path.is_file())
    return {str(path.relative_to(folder)): path.read_bytes() for path in files}


class InterruptAfter:
    """A reporter that calls `act` after so many chunks of generations."""

    def __init__(self, chunks: int, act):
        self._left = chunks
        self._act = act
        self.notes: list[str] = []

    def note(self, line):
        self.notes.append(line)

    def update(self, metrics, steps_per_second):
        self._left -= 1
        if self._left == 0:
            self._act()

    def close(self): ...


class Countdown(Environment):
    """Worlds that end after 1 to 5 of 6 steps; agents see how many steps are left after this one."""

    name = "countdown"
    n_agents = 2
    observation_size = 1
    action_size = 1
    episode_length = 6
    skills = ("wait",)

    def reset(self, key):
        left = jax.random.randint(key, (), 0, 5)
        return left, self._seen(left)

    def step(self, state, action, key):
        del action, key
        done = state == 0
        nothing = jnp.zeros((self.n_agents, 1))
        left = state - 1
        step = TimeStep(self._seen(left), nothing, done.astype(jnp.float32), done, jnp.zeros((), bool))
        return left, step

    def _seen(self, left):
        return jnp.full((self.n_agents, 1), left, jnp.float32)


class Toll(Countdown):
    """Each step costs; worlds last 1 to 5 steps."""

    name = "toll"

    def step(self, state, action, key):
        left, step = super().step(state, action, key)
        return left, TimeStep(
            step.observation, step.local_rewards, jnp.float32(-3.35), step.terminated, step.truncated
        )


class CountdownTeam(eqx.Module):
    """Its choice is what it sees; it carries the generation that it is the champion of."""

    generation: jax.Array

    def initial_memory(self):
        return ()

    def act(self, observation, memory, key):
        del key
        return jnp.zeros_like(observation), memory, observation[:, 0].astype(jnp.int32)


@dataclasses.dataclass(frozen=True)
class CountingConfig:
    least: int = 10
    """Environment steps per generation: these, and up to 4 more, drawn from the seed."""


class Counting:
    """Counts generations: shows what the runner does with an algorithm, and compiles at once."""

    name = "counting"
    label = "Counting"
    config_class = CountingConfig

    def __init__(self, env, config=None):
        self.env = env
        self.config = config or CountingConfig()
        self.traces = 0

    def choices(self):
        return ("wait",)

    def init(self, key):
        stride = jax.random.randint(key, (), 0, 5) + self.config.least
        return {"key": key, "generation": jnp.zeros((), jnp.int32), "stride": stride}

    def step(self, state):
        self.traces += 1
        key, draw = jax.random.split(state["key"])
        generation = state["generation"] + 1
        metrics = {
            "environment_steps": generation * state["stride"],
            "fitness_best": jax.random.uniform(draw),
            "fitness_mean": jnp.full((), 0.25),
        }
        return {"key": key, "generation": generation, "stride": state["stride"]}, metrics

    def team(self, state):
        return CountdownTeam(state["generation"])

    def transient_bytes(self):
        return 0


def tiny_mappo(**overrides) -> sc.MAPPO:
    """A policy with memory that chooses among skills, and keeps its choices for a while."""
    like = tiny_madys()
    same = ("probe_episodes", "updates", "buffer_capacity", "learner")
    network = PolicyConfig(hidden=(8,), memory=3, sharing="team")
    fields = {
        **{field: getattr(like.config, field) for field in same},
        "choose": "skills",
        "hold": 2,
        "episodes": 4,
        "policy": network,
        "critic": network,
        "ppo": sc.PPOConfig(epochs=2, minibatches=2),
    }
    return sc.MAPPO(Meeting(), **{**fields, **overrides})

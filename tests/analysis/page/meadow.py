"""A made-up world that draws one of everything and calls it names that would be script, and runs in it."""

import functools
import types
from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from experiment import tiny
from skillcrew.analysis.curves import Curve
from skillcrew.analysis.page.contents import RunContents
from skillcrew.analysis.page.panels import Curves
from skillcrew.analysis.statistics import mean_band
from skillcrew.envs.environment import Environment, TimeStep
from skillcrew.envs.scene import Discs, Labels, Lines, Points, Scene
from skillcrew.experiment.config import RunConfig
from skillcrew.experiment.evaluation import Evaluation
from skillcrew.experiment.folder import RunFolder
from skillcrew.experiment.recording import shown_episodes
from skillcrew.experiment.run import Run
from skillcrew.experiment.score import RETURN, SUCCESS

EVIL = "</script><img src=x onerror=alert(1)>&<!--\u2028{{DATA}}"
LENGTH = 6
SEEDS = (3, 11)


class Meadow(Environment):
    """Worlds that are done after 1 to 5 steps, if at all; agents walk to the right, and the herd grows."""

    name = f"meadow {EVIL}"
    n_agents = 2
    observation_size = 3
    action_size = 1
    episode_length = LENGTH
    skills = ("go_to_herd", f"go_away_from_{EVIL}")
    success = "terminated"

    def reset(self, key):
        left = jax.random.randint(key, (), 0, 9)
        return {"left": left, "time": jnp.zeros((), jnp.int32)}, self._seen(left)

    def step(self, state, action, key):
        del action, key
        left, time = state["left"] - 1, state["time"] + 1
        done = state["left"] == 0
        late = (time >= LENGTH) & ~done
        step = TimeStep(self._seen(left), jnp.zeros((2, 2)), done.astype(jnp.float32), done, late)
        return {"left": left, "time": time}, step

    def _seen(self, left):
        return jnp.stack([jnp.full(3, left, jnp.float32), jnp.array([0.5, -2.0, 0.0])])

    def scene(self, state):
        time = state["time"]
        moved = jnp.array([[1.0, 1.0], [2.0, 3.0]]) + time.astype(float) * jnp.array([[0.5, 0.0], [2.5, 0.0]])
        herd = jnp.array([[6.0, 2.0], [7.0, 3.0], [1.0, 3.0]])
        state_of_herd = jnp.clip(jnp.array([0, 1, -1]) + time // 2, -1, 1)
        return Scene(
            (0.0, 0.0),
            (8.0, 4.0),
            points=(
                Points("agents", moved, jnp.array([0.0, 1.0]) * time.astype(float)),
                Points(
                    "herd", herd, None, state_of_herd, (f"hungry {EVIL}", "fed"), ("sheep", EVIL, "sheep")
                ),
            ),
            discs=(
                Discs("sensors", moved, jnp.full(2, 1.5)),
                Discs("fence", jnp.array([[4.0, 2.0]]), 1.0 + 0.1 * time[None].astype(float)),
            ),
            lines=(Lines("wall", jnp.zeros((1, 2)), jnp.array([[8.0, 4.0]])),),
            labels=(Labels(herd, ("a", EVIL, "c")),),
        )


class Bare(Meadow):
    """Draws nothing, and says nothing of success."""

    name = "bare"
    success = None
    scene = None


class Walkers(eqx.Module):
    """What they choose is how many steps are left, even or odd; one array makes it a pytree."""

    weight: jax.Array

    def initial_memory(self):
        return ()

    def act(self, observation, memory, key):
        del key
        return observation[:, :1] * self.weight, memory, observation[:, 0].astype(jnp.int32) % 2


def a_run(env: Environment, folder: Path | None = None) -> Run:
    """A run of it that nobody trained."""
    run = object.__new__(Run)
    run.algorithm = types.SimpleNamespace(
        env=env, label=f"Walkers {EVIL}", name="walkers", choices=lambda: env.skills
    )
    run.config = RunConfig(seeds=SEEDS, steps=1000)
    run.folder = RunFolder(folder or tiny.scratch() / "no such run")
    run._champions = Walkers(jnp.zeros(len(SEEDS)))
    return run


def a_curve(score=SUCCESS) -> Curve:
    steps = [np.arange(1.0, 11.0) * 100, np.arange(1.0, 11.0) * 110]
    values = [np.linspace(0, 1, 10), np.linspace(0, 0.5, 10)]
    band = mean_band(steps, values)
    return Curve("Walkers", band, list(zip(steps, values, strict=True)), score=score)


@functools.cache
def contents(env_class=Meadow) -> RunContents:
    """Everything of a run that a page shows."""
    folder = tiny.scratch() / f"run-{env_class.__name__}"
    folder.mkdir()
    (folder / "environment.txt").write_text(f"command {EVIL}\n")
    run = a_run(env_class(), folder)
    rng = np.random.default_rng(0)
    choices = rng.integers(0, 2, (2, 30, LENGTH, 2))
    choices[:, :10, 3:] = -1
    completed = None if run.algorithm.env.success is None else rng.random((2, 30)) < 0.5
    evaluation = Evaluation(SEEDS, 30, rng.random((2, 30)), choices, completed)
    curve = a_curve(RETURN if completed is None else SUCCESS)
    return RunContents(run, f"Walkers {EVIL}", evaluation, Curves(curve, curve), shown_episodes(run))

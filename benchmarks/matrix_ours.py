"""The matrix games as our algorithms live them."""

import json
import tempfile
from pathlib import Path

import jax.numpy as jnp
from benchmarks.matrix_games import GAMES, LENGTH
from jaxtyping import Array, Float, Int, Key

import skillcrew as sc
from skillcrew.algorithms.registry import algorithm_class


class MatrixGame(sc.Environment):
    """Two agents choose, and the team is paid; each is told which of the two it is, and nothing else."""

    n_agents = 2
    observation_size = 2
    episode_length = LENGTH
    actions = "discrete"
    skills = ()

    def __init__(self, game: str):
        self.name = game
        self.payoff = jnp.asarray(GAMES[game], jnp.float32)
        self.action_size = len(self.payoff)

    def reset(self, key: Key[Array, ""]) -> tuple[Int[Array, ""], Float[Array, "agents obs"]]:
        return jnp.zeros((), jnp.int32), jnp.eye(2)

    def step(
        self, state: Int[Array, ""], action: Int[Array, " agents"], key: Key[Array, ""]
    ) -> tuple[Int[Array, ""], sc.TimeStep]:
        paid = self.payoff[action[0], action[1]]
        over = state + 1 >= LENGTH
        return state + 1, sc.TimeStep(jnp.eye(2), jnp.zeros((2, 0)), paid, jnp.zeros((), bool), over)


def train(
    algorithm: str, game: str, seeds: int, steps: int, episodes: int
) -> tuple[list[float], float, float]:
    """What each seed's team returns in fresh episodes; seconds for all seeds, and those for compiling."""
    team = algorithm_class(algorithm)(MatrixGame(game), choose="actions")
    with tempfile.TemporaryDirectory() as folder:
        run = sc.train(team, seeds=seeds, steps=steps, out=Path(folder) / "run")
        timing: dict[str, float] = {}
        for entry in json.loads(run.folder.timing.read_text()):
            timing |= entry
        returns = [interval.mean for interval in run.evaluate(episodes).per_seed]
    return returns, timing["seconds"], timing["compile_seconds"]

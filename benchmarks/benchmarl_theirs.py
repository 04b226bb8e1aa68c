"""BenchMARL's side of `benchmarl.py`: its MADDPG in PettingZoo's particle worlds.

Started by that program, in BenchMARL's Python.
"""

import importlib
import tempfile
import time
from typing import Any

from benchmarks import machine
from benchmarks.benchmarl_settings import EPISODE, Settings, serve
from benchmarks.stepping_sides import one_thread

if __name__ == "__main__":
    one_thread()

import numpy as np
import torch
from benchmarl.algorithms import MaddpgConfig
from benchmarl.environments import PettingZooTask
from benchmarl.experiment import Experiment, ExperimentConfig
from benchmarl.models.mlp import MlpConfig
from torchrl.envs.utils import ExplorationType, set_exploration_type

RECORDED = 20
"""Episodes of random actions that ours lives again."""


class Theirs:
    """Experiments of one task; what the settings leave open stays as in BenchMARL's own files."""

    def __init__(self, settings: Settings):
        torch.set_num_threads(1)
        self._settings = settings
        self._task = PettingZooTask[settings.task.upper()].get_from_yaml()
        self._task.config["max_cycles"] = EPISODE
        self.ready = {
            "compiling": 0.0,
            "versions": machine.versions(("benchmarl", "torchrl", "torch", "pettingzoo")),
            "random": self._random(),
        }

    def answer(self, command: dict[str, Any]) -> dict[str, Any]:
        """To `run`, an algorithm and a seed, or to `parity`."""
        if command["do"] == "parity":
            return {"record": [self._recorded(seed) for seed in range(RECORDED)]}
        return self._run(command["seed"])

    def _config(self, folder: str) -> ExperimentConfig:
        s, config = self._settings, ExperimentConfig.get_from_yaml()
        config.loggers, config.create_json, config.render, config.evaluation = [], False, False, False
        config.save_folder = folder
        config.share_policy_params = False
        config.max_n_frames = s.steps
        config.off_policy_n_envs_per_worker = s.episodes
        config.off_policy_collected_frames_per_batch = s.episodes * EPISODE
        config.off_policy_n_optimizer_steps = s.updates
        config.off_policy_train_batch_size = s.batch_size
        config.gamma, config.lr, config.polyak_tau = s.discount, s.learning_rate, s.soft_update
        return config

    def _run(self, seed: int) -> dict[str, Any]:
        layers = MlpConfig(
            num_cells=list(self._settings.hidden), layer_class=torch.nn.Linear, activation_class=torch.nn.ReLU
        )
        algorithm = MaddpgConfig.get_from_yaml()
        algorithm.share_param_critic = False
        with tempfile.TemporaryDirectory() as folder:
            experiment = Experiment(
                task=self._task,
                algorithm_config=algorithm,
                model_config=layers,
                critic_model_config=layers,
                seed=seed,
                config=self._config(folder),
            )
            began = time.process_time()
            experiment.run()
            seconds = time.process_time() - began
            return {"return": self._score(experiment, seed), "seconds": seconds}

    def _score(self, experiment: Experiment, seed: int) -> float:
        """Mean over fresh episodes of the mean of the agents' returns."""
        env = experiment.test_env
        env.set_seed(10_000 + seed)
        returns = []
        with torch.no_grad(), set_exploration_type(ExplorationType.DETERMINISTIC):
            for _ in range(self._settings.scored):
                lived = env.rollout(EPISODE, policy=experiment.policy, auto_cast_to_device=True)
                of_agents = [
                    lived["next", group, "reward"].sum(0).flatten() for group in experiment.group_map
                ]
                returns.append(float(torch.cat(of_agents).mean()))
        return float(np.mean(returns))

    def _world(self) -> Any:
        """PettingZoo's own, without TorchRL around it."""
        versions = {"simple_spread": "v3", "simple_speaker_listener": "v4"}
        name = f"pettingzoo.mpe.{self._settings.task}_{versions[self._settings.task]}"
        return importlib.import_module(name).parallel_env(max_cycles=EPISODE, continuous_actions=True)

    def _recorded(self, seed: int) -> dict[str, Any]:
        """An episode of random actions: where everything was, what each agent did, saw and was paid."""
        world, rng = self._world(), np.random.default_rng(seed)
        world.reset(seed=seed)
        inside = world.unwrapped.world
        aims = [agent.goal_b for agent in inside.agents if getattr(agent, "goal_b", None) is not None]
        goal = next(
            (index for index, place in enumerate(inside.landmarks) for aim in aims if place is aim), None
        )
        entities = [*inside.agents, *inside.landmarks]
        position = [entity.state.p_pos.tolist() for entity in entities]
        steps = []
        for _ in range(EPISODE):
            action = {name: rng.random(world.action_space(name).shape).astype("f4") for name in world.agents}
            observation, reward, *_ = world.step(action)
            steps.append(
                {
                    "action": {name: row.tolist() for name, row in action.items()},
                    "observation": {name: row.tolist() for name, row in observation.items()},
                    "reward": {name: float(value) for name, value in reward.items()},
                }
            )
        return {"position": position, "goal": goal, "steps": steps}

    def _random(self) -> float:
        """The mean return of random actions."""
        episodes = [self._recorded(seed) for seed in range(200)]
        return float(np.mean([[list(s["reward"].values()) for s in e["steps"]] for e in episodes]) * EPISODE)


if __name__ == "__main__":
    serve(Theirs)

"""EvoRL's side of `evorl.py`: its ERL on gymnax's pendulum. Started by that program, in EvoRL's Python.

Its second argument is a checkout of EMI-Group/evorl, which is neither installed nor changed.
"""

import sys
from pathlib import Path
from typing import Any

from benchmarks import machine
from benchmarks.evorl_race import TIME_LIMIT, Settings, serve, settings_of
from benchmarks.stepping_sides import one_thread

PARITY_EPISODES = 20
"""Episodes that ours replays."""


def overrides(s: Settings) -> list[str]:
    """The common settings in EvoRL's words; what they leave open stays as in its `erl/erl-ga`."""
    lived = s.population * s.episodes + s.learner_episodes
    hidden = "[" + ",".join(map(str, s.hidden)) + "]"
    return [
        "agent=erl/erl-ga",
        "env=gymnax/Pendulum-v1",
        f"env.max_episode_steps={TIME_LIMIT}",
        f"pop_size={s.population}",
        f"episodes_for_fitness={s.episodes}",
        f"rollout_episodes={s.learner_episodes}",
        f"num_elites={s.elites}",
        f"tournament_size={s.tournament_size}",
        f"num_mutation_frac={s.mutated_share}",
        f"mut_strength={s.strength}",
        f"super_mut_strength={s.large_strength}",
        f"super_mut_prob={s.large_probability}",
        f"reset_prob={s.reset_probability}",
        "enable_crossover=false",
        f"rl_injection_interval={s.migration_period}",
        "warmup_iters=0",
        "random_timesteps=0",
        # One of its updates is `actor_update_interval` updates of the critics.
        f"num_rl_updates_per_iter={s.updates_per_episode * lived // s.policy_delay}",
        f"actor_update_interval={s.policy_delay}",
        f"agent_network.actor_hidden_layer_sizes={hidden}",
        f"agent_network.critic_hidden_layer_sizes={hidden}",
        "agent_network.norm_layer_type=none",
        "agent_network.num_critics=2",
        f"optimizer.lr={s.learning_rate}",
        f"discount={s.discount}",
        f"tau={s.soft_update}",
        f"batch_size={s.batch_size}",
        f"policy_noise={s.target_noise}",
        f"clip_policy_noise={s.target_noise_clip}",
        f"exploration_epsilon={s.exploration_noise}",
        f"replay_buffer_capacity={s.buffer_capacity}",
        f"num_eval_envs={s.evaluation_episodes}",
        f"eval_episodes={s.evaluation_episodes}",
    ]


def make_workflow(settings: Settings, source: Path) -> Any:
    """Their workflow, built the way their training script builds it, without what records a run."""
    import hydra

    with hydra.initialize_config_dir(str(source / "configs"), version_base=None):
        config = hydra.compose("config", overrides(settings))
    workflow_class = hydra.utils.get_class(config.workflow_cls)
    # Jitting is done on the class: a subclass keeps the original as it was.
    workflow_class = type(workflow_class.__name__, (workflow_class,), {})
    return workflow_class.build_from_config(config, enable_jit=True)


class Theirs:
    """A `Side`."""

    def __init__(self, settings: Settings, source: Path):
        import jax

        sys.path.insert(0, str(source))
        self._jax = jax
        self._workflow = workflow = make_workflow(settings, source)
        self._evaluate = jax.jit(
            lambda agent, key: workflow.evaluator.evaluate(
                agent, key, settings.evaluation_episodes
            ).episode_returns.mean()
        )

    def compile(self) -> None:
        state = self.start(0)
        self._step = type(self._workflow).step.lower(self._workflow, state).compile()

    def start(self, seed: int) -> Any:
        return self._jax.block_until_ready(self._workflow.init(self._jax.random.PRNGKey(seed)))

    def step(self, state: Any) -> Any:
        return self._jax.block_until_ready(self._step(state))[1]

    def steps(self, state: Any) -> int:
        return int(state.metrics.sampled_timesteps)

    def evaluate(self, state: Any, seed: int) -> dict[str, float]:
        jax = self._jax
        key = jax.random.fold_in(jax.random.PRNGKey(seed), self.steps(state))
        params = state.agent_state.params
        # Its elites come first, the best of the last evaluation before the others.
        best = jax.tree.map(lambda leaf: leaf[0], state.ec_opt_state.pop)
        learner = jax.tree.map(lambda leaf: leaf[0], params.actor_params)
        agents = {"population": best, "learner": learner}
        return {name: float(self._evaluate(self._agent(state, own), key)) for name, own in agents.items()}

    def _agent(self, state: Any, actor: Any) -> Any:
        """An agent that acts by this actor."""
        params = state.agent_state.params
        single = self._jax.tree.map(lambda leaf: leaf[0], params)
        return state.agent_state.replace(params=single.replace(actor_params=actor))

    def parity(self, record: dict[str, Any] | None) -> dict[str, Any]:
        """Episodes of random actions, seen through all of its wrappers."""
        assert record is None
        jax = self._jax
        env = self._workflow.evaluator.env
        key_start, key_actions = jax.random.split(jax.random.PRNGKey(0))
        start = env.reset(key_start)
        shape = (TIME_LIMIT, env.num_envs, 1)
        actions = jax.random.uniform(key_actions, shape, minval=-1.0, maxval=1.0)

        def advance(state: Any, action: Any) -> Any:
            state = env.step(state, action)
            return state, (state.obs, state.reward, state.info.termination)

        _, (observations, rewards, terminations) = jax.lax.scan(advance, start, actions)
        angles = jax.numpy.stack([start.env_state.theta, start.env_state.theta_dot], axis=-1)
        by_episode = {
            "actions": actions,
            "observations": observations,
            "rewards": rewards,
            "terminations": terminations,
        }
        columns = {name: jax.numpy.swapaxes(rows, 0, 1) for name, rows in by_episode.items()}
        recorded = {"start": angles, **columns}
        return {name: rows[:PARITY_EPISODES].tolist() for name, rows in recorded.items()}

    def versions(self) -> dict[str, str]:
        return machine.versions(("jax", "jaxlib", "gymnax", "flax", "brax"))


if __name__ == "__main__":
    one_thread()
    serve(lambda settings: Theirs(settings, Path(sys.argv[2])), settings_of(sys.argv[1]))

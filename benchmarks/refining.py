"""Evolution finds, gradients refine: MADyS+'s champions handed to MAPPO.

    python -m benchmarks.refining runs/plus [--steps 2e6] [--sharing team] [--hold 3] > refining.md

`runs/plus` is a run of MADyS+, whose skills learn no more. A recurrent policy watches a champion and comes to
choose what it chooses, but for a share of hesitation, without which there would be nothing left to refine;
critics learn what that returns. Then MAPPO goes on from there by itself. Beside it a MAPPO that watched
nobody, on the same skills and for as many steps in all.
"""

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from benchmarks.machine import cpu_model
from jaxtyping import Array

import skillcrew as sc
from skillcrew.experiment.generation import play
from skillcrew.intervals import seed_interval
from skillcrew.learners.on_policy.experience import Experience, mean_where
from skillcrew.learners.on_policy.networks import Players
from skillcrew.learners.ppo import PPO, PPOConfig, PPOState
from skillcrew.policies.holding import decided
from skillcrew.policies.memory import PolicyConfig
from skillcrew.policies.stochastic import Options, StochasticPolicy, StochasticTeam
from skillcrew.policies.team import Team
from skillcrew.rollout import Lineup, Start, Trajectories, rollout

EPISODES, LESSONS, SCORED = 256, 20, 1000
"""In a generation; generations that the policy watches; of a score."""
CONFIG = PPOConfig(learning_rate=5e-4, entropy=0.03)


class Pupil(PPO):
    """Learns to choose what it sees chosen, and critics as they always do.

    Args:
        hesitation: share of the choices that it leaves open.
    """

    def __init__(self, hesitation: float, *arguments: Any):
        super().__init__(*arguments)
        self._hesitation = hesitation

    def _policy_loss(self, policies: StochasticPolicy, lived: Any) -> tuple[Array, Array]:
        seen = lived.experience
        said = self._policies.distributions(policies, seen.observation[:-1])
        same = said.log_probability(seen.taken)
        any_other = jax.nn.log_softmax(said.logits).mean(-1)
        wanted = (1 - self._hesitation) * same + self._hesitation * any_other
        return -mean_where(wanted, seen.decides), mean_where(said.entropy(), seen.decides)


class Refinement:
    """What is done with one champion.

    Args:
        sharing: whose a policy is, "agent" or "team".
        hold: least number of steps for which MAPPO keeps a choice.
        hesitation: see `Pupil`.
    """

    def __init__(self, env: sc.Environment, skills: Any, sharing: Any, hold: int, hesitation: float):
        self.env, self._skills, self._hold = env, skills, hold
        network = PolicyConfig(hidden=(64,), memory=32, sharing=sharing)
        self._options = Options(len(env.skills))
        players = Players(env.n_agents, env.observation_size, self._options)
        arguments = (CONFIG, players, network, network, "joint")
        self.pupil, self.learner = Pupil(hesitation, *arguments), PPO(*arguments)

    def team(self, state: PPOState) -> StochasticTeam:
        """The policies' team."""
        return StochasticTeam(
            state.policies, self._skills, jnp.zeros(()), self._options, self.env.n_agents, self._hold
        )

    def lesson(self, champion: Team) -> Callable[[PPOState, Array], Any]:
        """A generation of watching."""
        return lambda state, key: self._generation(self.pupil, champion, 1, state, key)

    def refine(self, state: PPOState, key: Array) -> tuple[PPOState, Array, Array]:
        """A generation of MAPPO."""
        return self._generation(self.learner, self.team(state), self._hold, state, key)

    def _generation(
        self, learner: PPO, team: Team, hold: int, state: PPOState, key: Array
    ) -> tuple[PPOState, Array, Array]:
        """The state after it, its environment steps and mean team return."""
        key_start, key_rollout, key_learn = jax.random.split(key, 3)
        lineup = Lineup.of_team(team, Start.draw(self.env, key_start, EPISODES))
        episodes, lived = rollout(self.env, lineup, key_rollout)
        state, _ = learner.update(state, experience(lived, hold), key_learn)
        return state, episodes.steps(), episodes.team_return().mean()


def experience(lived: Trajectories, hold: int) -> Experience:
    """What was chosen and what the team got, for every agent."""
    paid = jnp.broadcast_to(lived.team_reward[..., None], lived.choice.shape)
    seen = (lived.observation, lived.next_observation)
    free = decided(lived.choice, hold)
    return Experience.create(*seen, lived.choice, paid, lived.terminated, lived.mask, free)


def refined(of: Refinement, champion: Team, seed: int, steps: float) -> tuple[float, float, float, float]:
    """Success of the champion, of its pupil after lessons and in the end, and of a policy without lessons."""
    key_init, key_lessons, key_refine, key_score = jax.random.split(jax.random.key(seed), 4)
    score = jax.jit(lambda team: play(of, team, key_score, SCORED).team_return().mean())
    lesson, refine = jax.jit(of.lesson(champion)), jax.jit(of.refine)
    begun = of.learner.init(key_init)
    taught, lived = begun, 0
    for key in jax.random.split(key_lessons, LESSONS):
        taught, steps_taken, _ = lesson(taught, key)
        lived += int(steps_taken)
    ends = []
    for state, spent in ((taught, lived), (begun, 0)):
        key = key_refine
        while spent < steps:
            key, key_generation = jax.random.split(key)
            state, steps_taken, _ = refine(state, key_generation)
            spent += int(steps_taken)
        ends.append(float(score(of.team(state))))
    return float(score(champion)), float(score(of.team(taught))), ends[0], ends[1]


def main() -> None:
    """Refines the champions of a run's seeds and prints a table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("run", type=Path)
    parser.add_argument("--steps", type=float, default=2e6, help="of a policy, lessons included")
    parser.add_argument("--sharing", choices=("agent", "team"), default="team")
    parser.add_argument("--hold", type=int, default=3)
    parser.add_argument("--hesitation", type=float, default=0.2)
    arguments = parser.parse_args()
    run = sc.Run(arguments.run)
    print(f"# Champions of MADyS+, refined: `{run.algorithm.env.name}`\n\n{cpu_model()}\n")
    print("| seed | MADyS+ | after lessons | refined | MAPPO without lessons |\n|---|---|---|---|---|")
    rows = []
    for seed in run.config.seeds:
        champion = run.champion(seed)
        how = (arguments.sharing, arguments.hold, arguments.hesitation)
        of = Refinement(run.algorithm.env, champion.skills, *how)
        rows.append(refined(of, champion, seed, arguments.steps))
        print(f"| {seed} | " + " | ".join(f"{share:.3f}" for share in rows[-1]) + " |", flush=True)
    over = (seed_interval(np.array(column)) for column in zip(*rows, strict=True))
    means = (f"{each.mean:.3f} [{each.low:.3f}, {each.high:.3f}]" for each in over)
    print(f"| mean | {' | '.join(means)} |")


if __name__ == "__main__":
    main()

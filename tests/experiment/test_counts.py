"""Seeds that live on while the slowest lives its budget: nobody counts beyond 32 bits."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import skillcrew as sc
from experiment import tiny
from experiment.meeting import Meeting
from experiment.tiny import Counting, CountingConfig
from skillcrew.experiment.config import MOST_STEPS
from skillcrew.experiment.metrics import read_metrics
from skillcrew.rollout import MOST_COUNTED, count_steps

OPTIONS = {"score_episodes": 3, "generations_per_report": 2, "checkpoint_seconds": 1e9}


def tiny_td3():
    like = tiny.tiny_madys()
    return sc.IndependentTD3(
        Meeting(), episodes=4, updates=2, buffer_capacity=400, learner=like.config.learner
    )


ALGORITHMS = {
    "madys": tiny.tiny_madys,
    "mfl": tiny.tiny_mfl,
    "ea": tiny.tiny_ea,
    "merl": tiny.tiny_merl,
    "mappo": tiny.tiny_mappo,
    "td3": tiny_td3,
}
"""One of each file that counts steps."""


@pytest.mark.parametrize("name", ALGORITHMS)
def test_no_algorithm_counts_beyond_32_bits(name):
    algorithm = ALGORITHMS[name]()

    # Only what is counted is compiled, without what learns.
    @jax.jit
    def step_after(before):
        state = algorithm.init(jax.random.key(0))
        then, metrics = algorithm.step(dataclasses.replace(state, environment_steps=before))
        return then.environment_steps, metrics["environment_steps"]

    lived = int(step_after(jnp.int32(0))[1])
    assert lived > 1
    for before in (MOST_COUNTED - 1, MOST_COUNTED - lived):
        held, told = step_after(jnp.int32(before))
        # MFL has no pre-training left, and one with a race lives a few more.
        assert before <= int(told) <= MOST_COUNTED
        assert int(held) == int(told) > MOST_STEPS


class Careful(Counting):
    """Adds up its steps as ours do."""

    def init(self, key):
        return {**super().init(key), "steps": jnp.zeros((), jnp.int32)}

    def step(self, state):
        steps = count_steps(state["steps"], state["stride"])
        after, metrics = super().step({name: state[name] for name in ("key", "generation", "stride")})
        return {**after, "steps": steps}, {**metrics, "environment_steps": steps}


class Rushing(Careful):
    """One seed lives a hundred times as many steps in a generation."""

    def init(self, key):
        state = super().init(key)
        return {
            **state,
            "stride": jnp.where(state["stride"] == self.config.least, 100, 1) * self.config.least,
        }


@pytest.mark.usefixtures("counting")
def test_a_fast_seed_that_lives_on_keeps_its_champion(tmp_path):
    algorithm = Rushing(tiny.Countdown(), CountingConfig(20_000_000))
    run = sc.train(algorithm, 10, 1e9, tmp_path / "run", **OPTIONS)
    columns = read_metrics(run.folder.metrics)
    fast = [s for s in run.config.seeds if columns["environment_steps"][columns["seed"] == s][0] == 2e9]
    slow = [s for s in run.config.seeds if s not in fast]
    assert fast and slow
    for seed in run.config.seeds:
        steps = columns["environment_steps"][columns["seed"] == seed]
        assert (np.diff(steps.astype(np.int64)) >= 0).all() and steps[-1] >= 1e9
    generations = dict(zip(run.config.seeds, np.asarray(run.champions().generation).tolist(), strict=True))
    assert {generations[seed] for seed in slow} == {50}
    # Its first generation was beyond the budget already.
    assert {generations[seed] for seed in fast} == {0}


def test_a_count_that_begins_again_is_no_silent_one(tmp_path):
    algorithm = Counting(tiny.Countdown(), CountingConfig(600_000_000))
    with pytest.raises(
        sc.UserError, match=r"environment_steps of seed 0 = -\d+ in generation 4.*count_steps"
    ) as caught:
        sc.train(algorithm, 1, 2e9, tmp_path / "run", **OPTIONS)
    assert "\n" not in str(caught.value)

"""A number that is none ends a run within a report, and is named."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import skillcrew as sc
from experiment.tiny import Countdown, contents
from skillcrew.envs.environment import TimeStep
from skillcrew.experiment.generation import is_sound, with_other_keys
from skillcrew.experiment.metrics import read_metrics

OPTIONS = {"score_episodes": 3, "generations_per_report": 2, "checkpoint_seconds": 0.0}
EA = {"population": 6, "episodes": 8, "actor": sc.PolicyConfig(hidden=(3,))}


@dataclasses.dataclass(frozen=True)
class Fault:
    """One of the numbers that agents see or are paid is not one, in the third step of some worlds."""

    quantity: str
    agent: int = 1
    number: float = float("nan")
    chance: float = 0.05


class Faulty(Countdown):
    """Worlds of 4 steps for 3 agents with 2 skills, one of whose numbers now and then is none."""

    name = "faulty"
    n_agents = 3
    observation_size = 2
    skills = ("wait", "see")
    episode_length = 4

    def __init__(self, fault):
        self.fault = fault

    def reset(self, key):
        return jnp.zeros((), jnp.int32), jnp.zeros((3, 2))

    def step(self, state, action, key):
        time = state + 1
        bad = (time == 3) & (jax.random.uniform(key) < self.fault.chance)
        number = jnp.where(bad, self.fault.number, 0.5)
        observation, rewards, paid = jnp.zeros((3, 2)) + action, jnp.ones((3, 2)) * action, action[0, 0]
        match self.fault.quantity:
            case "observation":
                observation = observation.at[self.fault.agent, 1].set(number)
            case "local reward":
                rewards = rewards.at[self.fault.agent, 0].set(number)
            case "team reward":
                paid = jnp.where(bad, number, paid)
        over = time == 4
        return time, TimeStep(observation, rewards, paid, jnp.zeros((), bool), over)


def train(algorithm, out, seeds=(3, 5), **options):
    return sc.train(algorithm, seeds, 5000, out, **{**OPTIONS, **options})


@pytest.mark.parametrize(
    ("fault", "said"),
    [
        (Fault("observation"), r"observation\[1\] is NaN for agent 1, after step 3 of an episode"),
        (Fault("observation", 2, -np.inf), r"observation\[1\] is infinite for agent 2, after step 3"),
        (Fault("team reward"), "team reward is NaN, after step 3 of an episode"),
    ],
)
def test_where_nobody_learns_it_is_found_all_the_same(fault, said, tmp_path):
    with pytest.raises(sc.UserError, match=said) as caught:
        train(sc.EA(Faulty(fault), **EA), tmp_path / "run")
    message = str(caught.value)
    assert "\n" not in message and str(tmp_path / "run") in message
    assert "generation 1, seed " in message and "generation 0 is kept" in message
    assert "--on-bad-numbers roll-back" in message


def test_a_local_reward_is_named_by_its_skill_and_the_last_good_state_is_kept(tmp_path):
    fault = Fault("local reward", 2, chance=0.001)
    learner = sc.TD3Config(batch_size=8, network=sc.NetworkConfig(hidden=(4,)))
    small = {"population": 6, "episodes": 2, "probe_episodes": 1, "updates": 2, "buffer_capacity": 900}
    algorithm = sc.MADyS(Faulty(fault), learner=learner, **small)
    with pytest.raises(
        sc.UserError, match=r"local reward of wait is NaN for agent 2, after step 3"
    ) as caught:
        train(algorithm, tmp_path / "run", seeds=(4, 6))
    kept = max(int(place.name) for place in (tmp_path / "run" / "checkpoints").iterdir())
    assert f"generation {kept + 1}, seed 4: " in str(caught.value)
    assert f"generation {kept} is kept" in str(caught.value)
    assert read_metrics(tmp_path / "run" / "metrics.parquet")["generation"].max() == kept
    before = without_timing(tmp_path / "run")
    with pytest.raises(sc.UserError, match="local reward of wait is NaN for agent 2"):
        sc.Run(tmp_path / "run", algorithm.env).resume()
    assert without_timing(tmp_path / "run") == before


def without_timing(folder):
    return {name: data for name, data in contents(folder).items() if name != "timing.json"}


def test_it_rolls_back_and_goes_on_where_that_is_asked_for(tmp_path):
    rare = sc.EA(Faulty(Fault("team reward", chance=0.0004)), **EA)
    with pytest.raises(sc.UserError, match="team reward is NaN"):
        train(rare, tmp_path / "stopped")
    reached = read_metrics(tmp_path / "stopped" / "metrics.parquet")["generation"].max()
    run = sc.Run(tmp_path / "stopped", rare.env)
    steps = int(run.metrics()["environment_steps"].max()) + 400
    run.resume(steps=max(steps, 5000), on_bad_numbers="roll-back")
    assert run.metrics()["generation"].max() > reached
    assert np.isfinite(run.metrics()["fitness_mean"]).all()


def test_who_rolls_back_again_and_again_stops(tmp_path):
    always = sc.EA(Faulty(Fault("team reward", chance=1.0)), **EA)
    with pytest.raises(sc.UserError, match="team reward is NaN"):
        train(always, tmp_path / "run", on_bad_numbers="roll-back")


AS_USERS_COMPILE = {"xla_backend_optimization_level": "1", "xla_cpu_use_fusion_emitters": True}


@pytest.mark.parametrize("options", [None, AS_USERS_COMPILE])
def test_sound_is_whatever_holds_no_nan(options):
    # As users compile, XLA's maximum of many numbers and a NaN is a number.
    program = jax.jit(is_sound).lower({"a": jnp.ones((1, 3000, 47)), "b": jnp.ones(3), "c": jnp.ones(())})
    sound = program.compile(options)
    numbers = {"a": jnp.ones((1, 3000, 47)), "b": jnp.asarray([0.0, jnp.inf, 1.0]), "c": jnp.ones(())}
    assert sound(numbers)
    assert not sound({**numbers, "a": numbers["a"].at[0, 33, 4].set(jnp.nan)})
    assert not sound({**numbers, "b": numbers["b"].at[2].set(jnp.nan)})
    assert not sound({**numbers, "c": jnp.asarray(jnp.nan)})


def test_what_is_no_float_is_sound():
    assert is_sound({"int": jnp.arange(3), "key": jax.random.key(0), "none": jnp.zeros((0, 3))})


def test_other_keys_are_the_only_thing_that_a_roll_back_changes():
    state = {"keys": jax.random.split(jax.random.key(0), 3), "numbers": jnp.arange(3.0)}
    other, another = with_other_keys(state, 1), with_other_keys(state, 2)
    np.testing.assert_array_equal(other["numbers"], state["numbers"])
    drawn = [jax.random.key_data(keys).tolist() for keys in (state["keys"], other["keys"], another["keys"])]
    assert len({str(key) for keys in drawn for key in keys}) == 9

"""Runs as the library's users hold them."""

import json

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import skillcrew as sc
from experiment.tiny import OPTIONS, SEEDS, STEPS, Countdown, Counting, InterruptAfter, contents, tiny_madys
from skillcrew.experiment import generation
from skillcrew.experiment.run import free_folder
from skillcrew.intervals import proportion_interval, seed_interval

# Where checkpoints on the way do not matter: writing one takes longer than the generations between.
AT_THE_END = {**OPTIONS, "checkpoint_seconds": 1e9}


def test_train_returns_a_run_whose_champions_are_those_on_disk(counting, tmp_path):
    run = sc.train(counting, seeds=3, steps=100.0, out=tmp_path / "run", **AT_THE_END)
    assert run.config.seeds == (0, 1, 2)
    read = sc.Run(str(tmp_path / "run"), counting.env)
    np.testing.assert_array_equal(run.champions().generation, read.champions().generation)
    assert read.config == run.config and read.algorithm.config == counting.config


@pytest.mark.parametrize("budget", [35, 44, 100])
def test_a_champion_is_of_the_last_generation_within_the_budget(budget, counting, tmp_path):
    run = sc.train(counting, 5, float(budget), tmp_path / "run", **AT_THE_END)
    columns = run.metrics()
    for seed in run.config.seeds:
        mine = columns["seed"] == seed
        within = mine & (columns["environment_steps"] <= budget)
        assert int(run.champion(seed).generation) == columns["generation"][within].max()
        assert columns["environment_steps"][mine].max() >= budget
    paces = {int(columns["environment_steps"][columns["seed"] == seed][0]) for seed in run.config.seeds}
    assert len(paces) > 1, "all seeds are equally fast, which shows little"


def test_a_seed_ends_the_same_alone_and_among_others(counting, tmp_path):
    together = sc.train(counting, (4, 9), 60.0, tmp_path / "both", **AT_THE_END).metrics()
    alone = sc.train(counting, (9,), 60.0, tmp_path / "one", **AT_THE_END).metrics()
    rows = together["seed"] == 9
    for name, values in alone.items():
        np.testing.assert_array_equal(together[name][rows][: len(values)], values, err_msg=name)


def test_a_budget_below_one_generation_leaves_the_untrained_champion(counting, tmp_path):
    run = sc.train(counting, 2, 5.0, tmp_path / "run", **AT_THE_END)
    assert run.champions().generation.tolist() == [0, 0]
    assert run.evaluate(4).returns.shape == (2, 4)


def test_the_chunk_program_is_traced_and_compiled_once(counting, tmp_path):
    few, many = Counting(Countdown()), Counting(Countdown())
    reporter = InterruptAfter(0, None)
    sc.train(few, 2, 10.0, tmp_path / "few", **AT_THE_END)
    sc.train(many, 2, 200.0, tmp_path / "many", reporter, **AT_THE_END)
    assert few.traces == many.traces == 1
    assert sum("Compiled" in note for note in reporter.notes) == 1


def test_a_whole_run_of_madys_compiles_its_chunk_once(finished):
    entries = (finished / "timing.json").read_text()
    assert entries.count("compile_seconds") == 1


def test_evaluations_are_reproducible_and_have_one_row_per_seed(finished):
    run = sc.Run(finished)
    first, again = run.evaluate(20), sc.Run(finished).evaluate(20)
    assert first.seeds == SEEDS and first.episodes == 20
    assert first.returns.shape == (2, 20)
    assert first.choices.shape == (2, 20, 6, 2)
    assert set(np.unique(first.returns)) <= {0.0, 1.0}
    np.testing.assert_array_equal(first.returns, again.returns)
    np.testing.assert_array_equal(first.choices, again.choices)


def test_choices_end_where_episodes_end(finished):
    evaluation = sc.Run(finished).evaluate(20)
    lived = evaluation.choices >= 0
    assert (evaluation.choices[lived] < 2).all() and (evaluation.choices[~lived] == -1).all()
    assert (lived[..., 0] == lived[..., 1]).all(), "agents of a team live equally long"
    length = lived[..., 0].sum(-1)
    assert (lived[..., 0] == (np.arange(6) < length[..., None])).all(), "a gap within an episode"
    assert (length[evaluation.returns == 0] == 6).all(), "a failed episode lives to the time limit"


def test_choices_are_minus_one_exactly_after_the_end(counting, tmp_path):
    evaluation = sc.train(counting, 2, 20.0, tmp_path / "run", **AT_THE_END).evaluate(50)
    # Each agent chooses the number of steps left after this one, and the world ends at 0.
    left = evaluation.choices[:, :, 0, 0]
    expected = np.maximum(left[..., None] - np.arange(6), -1)
    assert (evaluation.choices == expected[..., None]).all()
    assert set(np.unique(left)) == {0, 1, 2, 3, 4}
    assert (evaluation.returns == 1).all()


def test_every_seed_is_scored_in_worlds_of_its_own(counting, tmp_path):
    one = sc.train(counting, (0, 1), 20.0, tmp_path / "one", **AT_THE_END).evaluate(50)
    other = sc.train(counting, (77, 1), 20.0, tmp_path / "other", **AT_THE_END).evaluate(50)
    worlds = [tuple(row) for row in np.concatenate([one.choices, other.choices])[:, :, 0, 0].tolist()]
    assert worlds[1] == worlds[3], "methods are compared seed by seed in the same worlds"
    assert len(set(worlds)) == 3 and len(set(worlds[0])) > 1


def test_no_seed_trains_and_is_scored_by_the_same_random_numbers():
    # The seed 24301 is where that once happened: the number of the evaluation's stream.
    seeds = jnp.asarray([0, 1, 2, 3, 2000, 24301, 24302, 2**32 - 1], jnp.uint32)
    streams = (generation.TRAINING, generation.SCORING, generation.EVALUATION)
    roots = [jax.vmap(lambda seed, n=n: generation.stream(seed, n))(seeds) for n in streams]
    # What an algorithm or a rollout does with its root first.
    derived = [jax.vmap(lambda root: jax.random.split(root, 4))(root) for root in roots]
    keys = np.concatenate([jax.random.key_data(key).reshape(-1, 2) for key in (*roots, *derived)])
    assert len({tuple(key) for key in keys.tolist()}) == len(keys)


def test_a_run_trains_and_is_scored_by_the_streams_of_its_seed(counting, monkeypatch, tmp_path):
    drawn = []

    def noted(seed, number, stream=generation.stream):
        drawn.append(number)
        return stream(seed, number)

    monkeypatch.setattr(generation, "stream", noted)
    run = sc.train(counting, (24301,), 20.0, tmp_path / "run", **AT_THE_END)
    assert set(drawn) == {generation.TRAINING, generation.SCORING}
    drawn.clear()
    run.evaluate(5)
    assert set(drawn) == {generation.EVALUATION}


def test_training_scores_champions_on_worlds_of_its_own(counting):
    # Worlds of one seed's scores differ between generations and from those of evaluations.
    drawn = []
    score_key = generation.initial_state(counting, jnp.uint32(3)).score_key
    keys = [generation.stream(jnp.uint32(3), generation.EVALUATION)]
    for key in (*keys, *(jax.random.fold_in(score_key, number) for number in (1, 2))):
        lived = generation.play(counting, counting.team(counting.init(key)), key, 30)
        drawn.append(tuple(np.asarray(lived.mask.sum(0)).tolist()))
    assert len(set(drawn)) == 3


def test_a_champion_acts(finished):
    run = sc.Run(finished)
    env = run.algorithm.env
    _, observation = env.reset(jax.random.key(0))
    team = run.champion(seed=SEEDS[0])
    assert isinstance(team, sc.Team)
    action, memory, choice = team.act(observation, team.initial_memory(), jax.random.key(1))
    assert action.shape == (2, 2) and bool((jnp.abs(action) <= 1).all())
    assert choice.shape == (2,) and set(np.asarray(choice)) <= {0, 1}
    assert memory.shape == team.initial_memory().shape == (2, 0)


def test_an_earlier_checkpoint_has_its_own_champions(counting, tmp_path):
    sc.train(counting, 1, 60.0, tmp_path / "run", **OPTIONS)
    older = sc.Run(tmp_path / "run", counting.env, checkpoint=4)
    assert older.champions().generation.tolist() == [4]
    with pytest.raises(sc.UserError, match=r"no checkpoint 5; there are"):
        sc.Run(tmp_path / "run", counting.env, checkpoint=5).champions()


def test_what_does_not_exist_is_refused(finished):
    run = sc.Run(finished)
    with pytest.raises(sc.UserError, match="seed 0: not of this run, which has 3, 11"):
        run.champion(0)
    for episodes in (0, -3):
        with pytest.raises(sc.UserError, match=f"episodes = {episodes}"):
            run.evaluate(episodes)


def test_bad_values_leave_no_folder_behind(counting, tmp_path):
    for options in ({"seeds": ()}, {"seeds": (1, 1)}, {"seeds": 0}, {"steps": 0.0}, {"keep": 0}):
        with pytest.raises(sc.UserError):
            sc.train(counting, out=tmp_path / "run", **options)
    assert contents(tmp_path) == {} and not (tmp_path / "run").exists()


def test_default_folders_are_numbered(monkeypatch, tmp_path, counting):
    monkeypatch.chdir(tmp_path)
    assert str(free_folder(tiny_madys())) == "runs/madys-rover-t2-c2"
    names = [str(sc.train(counting, steps=5.0, **AT_THE_END).folder.path) for _ in range(3)]
    assert names == ["runs/counting-countdown", "runs/counting-countdown-2", "runs/counting-countdown-3"]


def test_success_is_over_seeds_where_there_are_several():
    returns = np.asarray([[1.0, 1, 0, 0], [1, 1, 1, 0], [1, 1, 1, 1]])
    choices = np.zeros((3, 4, 1, 1), int)
    several = sc.Evaluation((5, 6, 7), 4, returns, choices, returns == 1)
    assert several.per_seed == [proportion_interval(wins, 4) for wins in (2, 3, 4)]
    assert several.success_rate == seed_interval(np.asarray([0.5, 0.75, 1.0]))
    assert several.success_rate.mean == 0.75
    alone = sc.Evaluation((5,), 4, returns[:1], choices[:1], returns[:1] == 1)
    assert alone.success_rate == proportion_interval(2, 4)


def test_the_budget_is_a_round_number(finished):
    assert sc.Run(finished).config.steps == STEPS


def test_a_champion_that_is_exported_comes_back(finished, tmp_path):
    run, folder = sc.Run(finished), tmp_path / "deep" / "team"
    written = sc.export_team(run, folder, seed=SEEDS[1], formats=["safetensors"])
    assert sorted(folder.iterdir()) == sorted(written)
    champion, back = run.champion(SEEDS[1]), sc.load_team(folder)
    assert jax.tree.structure(back) == jax.tree.structure(champion)
    for ours, theirs in zip(jax.tree.leaves(back), jax.tree.leaves(champion), strict=True):
        assert ours.dtype == theirs.dtype
        np.testing.assert_array_equal(ours, theirs)
    told = json.loads((folder / "team.json").read_text())
    assert (told["environment"]["name"], told["environment"]["episode_length"]) == ("rover-t2-c2", 6)
    assert told["skills"] == ["go_to_poi_A", "go_to_poi_B"]
    assert [told[name] for name in ("algorithm", "seed", "agents", "actions")] == [
        "madys",
        11,
        2,
        "continuous",
    ]

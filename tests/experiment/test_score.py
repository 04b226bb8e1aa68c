"""Success is said where an environment says what it is; elsewhere there is the return, on its own scale."""

import dataclasses
import json
import math

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from scipy import stats

import skillcrew as sc
from experiment.tiny import OPTIONS, Counting, Toll
from oracles.refusals import refusal
from skillcrew.analysis.learning import learning_curve
from skillcrew.analysis.report import write_report
from skillcrew.cli.present import describe_evaluation
from skillcrew.envs.identified import Identified
from skillcrew.experiment.metrics import read_metrics
from skillcrew.experiment.score import RETURN, SUCCESS, score_of
from skillcrew.intervals import proportion_interval

AT_THE_END = {**OPTIONS, "checkpoint_seconds": 1e9}


class Hurried(Toll):
    """Worlds of 5 steps are cut off at the fourth, in which the task is not done."""

    name = "hurried"
    success = "terminated"
    episode_length = 4


@pytest.fixture
def toll(counting, tmp_path):
    return sc.train(Counting(Toll()), (4, 9), 100.0, tmp_path / "toll", **AT_THE_END)


@pytest.fixture
def hurried(counting, tmp_path):
    return sc.train(Counting(Hurried()), (4, 9), 100.0, tmp_path / "hurried", **AT_THE_END)


def lengths(evaluation):
    return (evaluation.choices[..., 0] >= 0).sum(-1)


def test_a_return_has_its_own_scale_and_students_interval(toll):
    evaluation = toll.evaluate(40)
    assert evaluation.completed is None and evaluation.score is RETURN
    lived = lengths(evaluation)
    np.testing.assert_allclose(evaluation.returns, -3.35 * lived, rtol=1e-6)
    for row, interval in zip(evaluation.returns, evaluation.per_seed, strict=True):
        low, high = stats.t.interval(0.95, 39, row.mean(), stats.sem(row))
        assert (interval.mean, interval.low, interval.high) == pytest.approx((row.mean(), low, high))
        assert low < -3.35
    assert evaluation.overall == evaluation.team_return
    # Both seeds meet the same worlds, in which nothing that they do changes anything.
    assert evaluation.team_return.mean == pytest.approx(evaluation.returns.mean())
    assert "Environment.success" in refusal(lambda: evaluation.success_rate)
    assert set(evaluation.as_dict()) == {"team_return", "episodes"}


def test_success_is_what_terminates_whatever_the_reward(hurried):
    evaluation = hurried.evaluate(40)
    assert evaluation.score is SUCCESS
    lived = lengths(evaluation)
    # The fifth step is never lived; a world that would have needed it is cut off.
    finished = evaluation.choices[np.arange(2)[:, None], np.arange(40), lived - 1, 0] == 0
    np.testing.assert_array_equal(evaluation.completed, finished)
    assert 0 < finished.mean() < 1
    assert evaluation.per_seed == [proportion_interval(int(row.sum()), 40) for row in finished]
    numbers = evaluation.as_dict()
    assert list(numbers) == ["success_rate", "team_return", "episodes"]
    assert numbers["success_rate"]["mean"] == evaluation.success_rate.mean == pytest.approx(finished.mean())
    assert numbers["team_return"]["mean"] == pytest.approx(evaluation.returns.mean())
    assert [one["seed"] for one in numbers["team_return"]["per_seed"]] == [4, 9]


def test_seeds_are_the_units_where_there_are_several():
    returns = np.array([[-1.5, -2.5], [20.0, 30.0], [7.0, 9.0]])
    choices = np.zeros((3, 2, 1, 1), int)
    several = sc.Evaluation((1, 2, 3), 2, returns, choices)
    means = returns.mean(1)
    low, high = stats.t.interval(0.95, 2, means.mean(), stats.sem(means))
    assert low < 0, "no longer clipped"
    assert (several.overall.low, several.overall.high) == pytest.approx((low, high))
    # One seed alone: over its episodes; of a single one, nothing is known of the spread.
    assert sc.Evaluation((2,), 2, returns[1:2], choices[:1]).overall == several.per_seed[1]
    single = sc.Evaluation((2,), 1, returns[:1, :1], choices[:1, :1])
    assert math.isnan(single.overall.low)
    numbers = json.loads(json.dumps(single.as_dict(), allow_nan=False))
    assert numbers["team_return"]["mean"] == -1.5 and numbers["team_return"]["low"] is None


def test_what_is_printed():
    choices = np.zeros((2, 4, 1, 1), int)
    won = np.array([[1, 0, 1, 1], [0, 0, 0, 1]], bool)
    binary = describe_evaluation(sc.Evaluation((0, 12), 4, won.astype(float), choices, won)).splitlines()
    assert binary == [
        "seed 0      0.750 [0.301, 0.954]",
        "seed 12     0.250 [0.046, 0.699]",
        "success     0.500 [0.000, 1.000] on 4 fresh episodes per seed",
    ]
    # What else the reward says is said too.
    *same, more = describe_evaluation(sc.Evaluation((0, 12), 4, 40.0 * won, choices, won)).splitlines()
    assert same == binary and more.startswith("return      20 [") and more.endswith("per seed")
    free = describe_evaluation(sc.Evaluation((0, 12), 4, -12.345 - won, choices)).splitlines()
    assert free[0].startswith("seed 0      -13.1 [") and free[2].startswith("return      -12.85 [")
    assert "success" not in "".join(free)


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.35, "0.35"), (-15.0, "-15"), (0.0, "0"), (123456.7, "123457"), (-2.34567, "-2.346"), (1e-7, "1e-07")],
)
def test_numbers_of_any_size(value, text):
    assert RETURN.number(value) == text
    assert SUCCESS.number(0.5) == "0.500" and SUCCESS.number(0.5, 2) == "0.50"


def test_metrics_have_a_column_for_each(toll, hurried):
    columns = toll.metrics()
    assert "success_rate" not in columns
    # What 3 episodes of 1 to 5 steps cost.
    assert ((columns["team_return"] >= -5 * 3.36) & (columns["team_return"] <= -3.35)).all()
    columns = hurried.metrics()
    assert {"success_rate", "team_return"} <= set(columns)
    assert set(np.round(3 * columns["success_rate"], 5)) <= {0, 1, 2, 3} and columns["success_rate"].min() < 1
    assert (columns["team_return"] < 0).all()


def test_a_report_is_on_the_scale_of_the_data(toll, tmp_path, monkeypatch):
    figures = {}

    def keep(figure, stem):
        figures[stem.name] = figure
        return [stem]

    monkeypatch.setattr("skillcrew.analysis.report.save", keep)
    evaluation = toll.evaluate(20)
    one_skill = dataclasses.replace(evaluation, choices=np.minimum(evaluation.choices, 0))
    *_, scores = write_report(toll, one_skill, tmp_path)
    (axes,) = figures["learning_curve"].axes
    assert axes.get_ylabel() == "Champion's team return on fresh episodes"
    low, high = axes.get_ylim()
    band = learning_curve(toll).band
    assert low <= band.low.min() < -5 and band.high.max() <= high
    assert band.low.min() - low < 0.1 * (high - low), "the data fill the axis"
    heading = figures["chosen_skills_seed_4"].get_suptitle()
    assert "solved" not in heading and "mean return -" in heading and "in 20 episodes" in heading
    assert "team_return" in json.loads(scores.read_text())


def test_an_older_folder_is_read_and_gone_on_with(counting, toll, tmp_path):
    """Its one column was the mean return, by the name of success."""
    before = toll.metrics()
    path = toll.folder.metrics
    old = {{"team_return": "success_rate"}.get(name, name): values for name, values in before.items()}
    pq.write_table(pa.table(old), path)
    (path.parent / "digests.json").unlink()  # Older folders had none.
    np.testing.assert_array_equal(read_metrics(path)["team_return"], before["team_return"])
    run = sc.Run(toll.folder.path, Toll())
    np.testing.assert_array_equal(learning_curve(run).per_seed[1][1], learning_curve(toll).per_seed[1][1])
    # Checkpoints called their score the same.
    for about in toll.folder.checkpoints.rglob("metrics/metrics"):
        about.write_text(about.read_text().replace('"score"', '"success_rate"'))
        assert "success_rate" in about.read_text()
    run.resume(300.0)
    columns = run.metrics()
    assert "success_rate" not in columns and columns["generation"].max() > before["generation"].max()
    np.testing.assert_array_equal(
        columns["team_return"][: len(before["team_return"]) // 2],
        before["team_return"][: len(before["team_return"]) // 2],
    )


def test_a_world_that_says_what_success_is_only_now_has_a_curve_of_returns(toll):
    class Now(Toll):
        success = "terminated"

    run = sc.Run(toll.folder.path, Now())
    assert learning_curve(run).score is RETURN
    assert run.evaluate(5).score is SUCCESS


def test_wrappers_know_what_success_is():
    assert score_of(Identified(Hurried())) is SUCCESS and score_of(Identified(Toll())) is RETURN
    for name in ("rover-t2-c2", "rover-t3-c1"):
        assert score_of(sc.make(name)) is SUCCESS
        assert score_of(sc.make(name, team_reward="fraction")) is SUCCESS
        assert score_of(sc.make(name, team_reward="value")) is SUCCESS
        assert score_of(sc.make(name, team_reward="closest")) is RETURN

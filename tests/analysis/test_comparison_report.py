"""What a comparison ends in, from runs whose curves and scores are made up, and from a real one."""

import csv
import dataclasses
import json
import shutil

import numpy as np
import pytest
import yaml

import skillcrew as sc
from experiment import made_up, tiny
from skillcrew.algorithms import registry
from skillcrew.analysis import comparison_report
from skillcrew.analysis.comparison_report import write_results
from skillcrew.analysis.report import write_figures
from skillcrew.experiment.comparison import ComparedFigure, Comparison, ComparisonFolder, PlannedRun
from skillcrew.experiment.config import RunConfig
from skillcrew.experiment.reproduction import plan, reproduction

SEEDS = (7, 3, 20, 5)
# The two in the middle are seeds 20 and 7, and the upper one of them is 7.
WINS = {7: 12, 3: 20, 20: 9, 5: 0}
SHARE = np.arange(1, made_up.GENERATIONS + 1) / made_up.GENERATIONS
"""Of the budget, at the end of each generation within it."""


@pytest.fixture
def folder(monkeypatch, tmp_path):
    made_up.shrink(monkeypatch)
    folder = ComparisonFolder(tmp_path / "reproduction")
    folder.open("This folder is for a test.")
    return folder


def heights(index):
    """How high each seed's curve climbs, other for each run."""
    return {seed: (40 - 4 * number + index) / 40 for number, seed in enumerate(SEEDS)}


@pytest.fixture
def planned(folder):
    """Three methods in two environments, trained and scored by hand."""
    planned = plan(("fig-4.2",), SEEDS)
    for index, one in enumerate(planned):
        made_up.write_run(folder.run(one), one, heights(-index))
        made_up.write_report(folder.run(one), {seed: abs(won - index) for seed, won in WINS.items()})
    return planned


def results(folder, figures, planned):
    seeds = planned[0].config.seeds
    return write_results(folder, Comparison("", planned, reproduction(figures, seeds).figures))


@pytest.fixture
def not_drawn(monkeypatch):
    """Spares what takes longest; the paths are the same."""

    def paths(figure, stem):
        return [stem.with_name(f"{stem.name}.{kind}") for kind in ("png", "pdf")]

    monkeypatch.setattr(comparison_report, "save", paths)


@pytest.fixture
def drawn(monkeypatch, not_drawn):
    """The panels that are drawn, and what they are called."""
    caught = []
    draw = comparison_report.panels_of_curves
    monkeypatch.setattr(
        comparison_report, "panels_of_curves", lambda *given: caught.append(given) or draw(*given)
    )
    return caught


def table(folder):
    with (folder.path / "table.csv").open(newline="") as file:
        return list(csv.DictReader(file))


def test_everything_is_written_and_named(folder, planned):
    written = results(folder, ["fig-4.2"], planned)
    names = [str(path.relative_to(folder.path)) for path in written]
    skills = [f"{one.name}.{kind}" for one in planned if one.method != "ea" for kind in ("png", "pdf")]
    assert names == [
        *["figures/fig-4.2.png", "figures/fig-4.2.pdf", "table.md", "table.csv"],
        *[f"figures/skills-{name}" for name in skills],
        *["configurations", "environment.txt"],
    ]
    assert all(path.exists() for path in written)
    for path, start in zip(written, (b"\x89PNG", b"%PDF"), strict=False):
        assert path.read_bytes().startswith(start)
    assert sorted(path.stem for path in folder.configurations.iterdir()) == sorted(o.name for o in planned)
    for one in planned:
        text = (folder.configurations / f"{one.name}.yaml").read_text()
        assert text == folder.run(one).config.read_text()
        assert yaml.safe_load(text)["run"]["seeds"] == list(SEEDS)
    assert "\njax " in (folder.path / "environment.txt").read_text()


def test_curves_stand_in_the_panel_of_their_environment(folder, planned, drawn):
    results(folder, ["fig-4.2"], planned)
    ((panels, title),) = drawn
    assert title == f"Figure 4.2 of the thesis, again: mean of {len(SEEDS)} seeds, 95 % intervals"
    assert list(panels) == ["rover-t2-c1", "rover-t2-c2"]
    curves = [curve for panel in panels.values() for curve in panel]
    for index, (one, curve) in enumerate(zip(planned, curves, strict=True)):
        assert curve.label == {"madys": "MADyS", "mfl": "MFL", "ea": "EA"}[one.method]
        # All seeds end with the budget, and the generation beyond it is left out.
        expected = np.outer(list(heights(-index).values()), SHARE)
        assert len(curve.per_seed) == len(SEEDS)
        for (steps, values), row in zip(curve.per_seed, expected, strict=True):
            np.testing.assert_array_equal(steps, np.rint(one.config.steps * SHARE))
            np.testing.assert_allclose(values, row, rtol=1e-6)
        # As many points in the first decade of a logarithmic axis as in any other.
        ratios = curve.band.steps[1:] / curve.band.steps[:-1]
        np.testing.assert_allclose(ratios, ratios[0])
        trained_first = one.algorithm.config.pretraining_steps if one.method == "mfl" else None
        assert curve.pretrained_at == trained_first


def test_an_environment_alone_has_a_panel_and_no_figure_of_the_thesis(folder, planned, drawn):
    alone = [one for one in planned if one.environment == "rover-t2-c2"]
    written = results(folder, ["rover-t2-c2"], alone)
    ((panels, title),) = drawn
    assert title == f"mean of {len(SEEDS)} seeds, 95 % intervals"
    assert list(panels) == ["rover-t2-c2"]
    assert written[0] == folder.figures / "rover-t2-c2.png"
    assert {row["environment"] for row in table(folder)} == {"rover-t2-c2"}


def test_several_figures_share_their_tables(folder, drawn):
    planned = plan(("fig-4.2", "fig-4.3"), (1,))
    for one in planned:
        made_up.write_run(folder.run(one), one, {1: 0.5})
        made_up.write_report(folder.run(one), {1: 10})
    written = results(folder, ["fig-4.2", "fig-4.3"], planned)
    assert [path.name for path in written[:6]] == [
        *["fig-4.2.png", "fig-4.2.pdf", "fig-4.3.png", "fig-4.3.pdf"],
        *["table.md", "table.csv"],
    ]
    assert [list(panels) for panels, _ in drawn] == [["rover-t2-c1", "rover-t2-c2"], ["rover-t3-c1"]]
    assert [(row["environment"], row["method"]) for row in table(folder)] == [
        (environment, method)
        for environment in ("rover-t2-c1", "rover-t2-c2", "rover-t3-c1")
        for method in ("MADyS", "MFL", "EA")
    ]


def test_the_table_has_what_each_seed_reached(folder, planned, not_drawn):
    results(folder, ["fig-4.2"], planned)
    rows = iter(table(folder))
    for index, one in enumerate(planned):
        for seed, height in heights(-index).items():
            row = next(rows)
            assert (row["environment"], int(row["seed"])) == (one.environment, seed)
            assert int(row["steps"]) == one.config.steps
            assert float(row["success"]) == abs(WINS[seed] - index) / made_up.EPISODES
            # A straight line from 0 to its height at the end of the budget.
            assert float(row["area"]) == pytest.approx(height / 2, rel=1e-5)
            # The windows are one row and ten of forty: it climbs to its height, and holds what it passes.
            for name, level in (("steps_to_half", 0.5), ("steps_to_nine_tenths", 0.9)):
                passed = [now for now in SHARE if height * now >= level - 1e-6 and now <= 0.75]
                expected = np.rint(one.config.steps * passed[0]) if passed else float("nan")
                np.testing.assert_equal(float(row[name]), expected)
    assert next(rows, None) is None
    assert len({row["steps_to_half"] for row in table(folder)}) > 2, "all reach it together"


def test_areas_are_compared_over_the_steps_that_all_methods_had(folder, not_drawn):
    planned = [one for one in plan(("fig-4.2",), SEEDS) if one.environment == "rover-t2-c1"]
    short = dataclasses.replace(planned[2].config, steps=2000)
    planned[2] = dataclasses.replace(planned[2], config=short)
    for one in planned:
        made_up.write_run(folder.run(one), one, heights(0))
        made_up.write_report(folder.run(one), WINS)
    results(folder, ["rover-t2-c1"], planned)
    rows = table(folder)
    assert [int(row["steps"]) for row in rows] == [8000] * 8 + [2000] * 4
    for row, height in zip(rows, 3 * list(heights(0).values()), strict=True):
        # Lines that climb to their height within 8000 steps have climbed a quarter of it within 2000.
        reached = height if row["steps"] == "2000" else height / 4
        assert float(row["area"]) == pytest.approx(reached / 2, rel=1e-5)
    assert "0.008 M in rover-t2-c1 (0.002 M for EA)" in (folder.path / "table.md").read_text()


def test_the_skills_are_those_of_the_seed_with_the_median_success(folder, planned, not_drawn):
    results(folder, ["fig-4.2"], planned)
    first = planned[0]
    for kind in ("png", "pdf"):
        copy = (folder.figures / f"skills-{first.name}.{kind}").read_text()
        assert copy == f"{folder.run(first).path} 7 {kind}"
    assert not list(folder.figures.glob("*-ea.*")), "there is nothing to choose for actors"


def test_among_an_odd_number_of_seeds_the_median_is_in_the_middle(folder, not_drawn):
    planned = plan(("fig-4.3",), (1, 2, 3, 4, 5))
    for one in planned:
        made_up.write_run(folder.run(one), one, dict.fromkeys(one.config.seeds, 0.5))
        made_up.write_report(folder.run(one), {1: 20, 2: 0, 3: 1, 4: 6, 5: 3})
    results(folder, ["fig-4.3"], planned)
    assert " 5 png" in (folder.figures / f"skills-{planned[0].name}.png").read_text()


def test_damaged_scores_name_the_command_that_mends_them(folder, planned, not_drawn):
    scores, place = folder.run(planned[-1]).scores, folder.run(planned[-1]).path
    for damage in ("", "{}", '{"success_rate": 3}', "[1", None):
        scores.unlink()
        if damage is not None:
            scores.write_text(damage)
        with pytest.raises(sc.UserError) as caught:
            results(folder, ["fig-4.2"], planned)
        assert str(caught.value).startswith(f"{scores}: missing or damaged; `skillcrew resume {place}`")
        assert "\n" not in str(caught.value)
        scores.touch()


def test_a_missing_picture_is_named(folder, planned, not_drawn):
    picture = folder.run(planned[0]).report / "chosen_skills_seed_7.png"
    picture.unlink()
    with pytest.raises(sc.UserError) as caught:
        results(folder, ["fig-4.2"], planned)
    assert str(picture) in str(caught.value) and "\n" not in str(caught.value)


def test_scores_are_those_of_the_report(folder, planned, monkeypatch):
    run = sc.Run(folder.run(planned[0]).path)
    monkeypatch.setattr("skillcrew.analysis.report.save", lambda figure, stem: [stem])
    returns = np.array([[1.0, 0, 1, 1, 1], [0, 0, 0, 0, 0], [1, 1, 1, 1, 1], [1, 0, 0, 0, 1]])
    evaluation = sc.Evaluation(SEEDS, 5, returns, np.zeros((4, 5, 2, 1), int), returns == 1)
    write_figures(run, evaluation, run.folder.report)
    assert run.folder.scores == run.folder.path / "report" / "scores.json"
    scores = json.loads(run.folder.scores.read_text())
    assert scores["episodes"] == 5
    per_seed = scores["success_rate"]["per_seed"]
    assert [(entry["seed"], entry["mean"]) for entry in per_seed] == [(7, 0.8), (3, 0), (20, 1), (5, 0.4)]
    assert scores["success_rate"]["mean"] == pytest.approx(2.2 / 4)
    for entry in per_seed:
        assert 0 <= entry["low"] <= entry["mean"] <= entry["high"] <= 1


def test_a_run_that_was_really_trained(folder, finished):
    trained = sc.Run(finished)
    planned = [
        PlannedRun("rover-t2-c2", label.lower(), label, trained.algorithm, trained.config)
        for label in ("MADyS", "MFL")
    ]
    evaluation = trained.evaluate(20)
    first, second = (folder.run(one).path for one in planned)
    copy = sc.Run(shutil.copytree(finished, first))
    write_figures(copy, evaluation, copy.folder.report)
    shutil.copytree(first, second)
    assert all(folder.is_done(one) for one in planned)
    written = results(folder, ["rover-t2-c2"], planned)
    assert all(path.exists() for path in written)
    rates = evaluation.returns.mean(1)
    median = tiny.SEEDS[int(np.argmax(rates))] if rates[0] != rates[1] else max(tiny.SEEDS)
    for one in planned:
        source = folder.run(one).report / f"chosen_skills_seed_{median}.png"
        assert (folder.figures / f"skills-{one.name}.png").read_bytes() == source.read_bytes()
    rows = table(folder)
    assert [(row["method"], int(row["seed"])) for row in rows] == [
        (method, seed) for method in ("MADyS", "MFL") for seed in tiny.SEEDS
    ]
    assert [float(row["success"]) for row in rows] == [*rates, *rates]


def test_methods_are_compared_by_returns_where_nothing_says_what_success_is(tmp_path, drawn, monkeypatch):
    monkeypatch.setitem(registry.ALGORITHMS, "counting", registry.Listed("experiment.tiny:Counting", ""))
    folder = ComparisonFolder(tmp_path / "returns")
    planned = []
    for method, least in (("slow", 20), ("quick", 10)):
        algorithm = tiny.Counting(tiny.Toll(), tiny.CountingConfig(least))
        config = RunConfig((7, 3), 100, score_episodes=3, generations_per_report=2)
        planned.append(PlannedRun("toll", method, method, algorithm, config))
    comparison = Comparison("", planned, [ComparedFigure("toll", "", ("toll",))])
    folder.open("This folder is for a test.", comparison.score)
    reached = []
    for one in planned:
        run = sc.train(one.algorithm, (7, 3), 100, folder.run(one).path, score_episodes=3)
        evaluation = run.evaluate(10)
        reached += list(evaluation.returns.mean(1))
        run.folder.report.mkdir()
        run.folder.scores.write_text(json.dumps(evaluation.as_dict()))
    write_results(folder, comparison)
    assert [float(row["return"]) for row in table(folder)] == reached
    assert all(-5 * 3.36 < float(row["area"]) < -3.3 for row in table(folder))
    text = (folder.path / "table.md").read_text()
    assert "| final return |" in text and "steps to" not in text and "success" not in text
    ((panels, _),) = drawn
    assert all(curve.band.high.max() > curve.band.mean.max() for curve in panels["toll"])

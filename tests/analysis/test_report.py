"""The report: which files, and that they show what the run recorded."""

import json
import shutil

import numpy as np
import pytest

import skillcrew as sc
from experiment import tiny
from skillcrew.analysis import report
from skillcrew.analysis.report import learning_curve, write_report


@pytest.fixture
def run(tmp_path):
    return sc.Run(shutil.copytree(tiny.finished_run(), tmp_path / "run"))


def test_files_are_written_into_the_run_or_elsewhere(run, tmp_path):
    evaluation = run.evaluate(20)
    *written, scores = write_report(run, evaluation)
    assert scores == run.folder.scores and json.loads(scores.read_text()) == evaluation.as_dict()
    stems = ["learning_curve", *(f"chosen_skills_seed_{seed}" for seed in tiny.SEEDS)]
    assert {path.stem for path in written} == set(stems)
    assert sorted({path.suffix for path in written}) == [".pdf", ".png"]
    assert written[0].stem == "learning_curve"
    assert {path.parent for path in written} == {run.folder.path / "report"}
    for path in written:
        start = b"\x89PNG" if path.suffix == ".png" else b"%PDF"
        assert path.read_bytes().startswith(start) and path.stat().st_size > 2000
    elsewhere = write_report(run, evaluation, tmp_path / "deep" / "figures")
    assert [path.name for path in elsewhere] == [path.name for path in (*written, scores)]


def test_the_curve_is_the_score_within_the_budget(run):
    curve = learning_curve(run)
    columns = run.metrics()
    for seed, (steps, values) in zip(run.config.seeds, curve.per_seed, strict=True):
        rows = (columns["seed"] == seed) & (columns["environment_steps"] <= tiny.STEPS)
        np.testing.assert_array_equal(steps, columns["environment_steps"][rows])
        np.testing.assert_array_equal(values, columns["success_rate"][rows])
    assert columns["environment_steps"].max() > tiny.STEPS, "nothing was beyond the budget"
    assert curve.label == "MADyS"
    assert learning_curve(run, "ours").label == "ours"


def test_the_skill_figures_show_the_recorded_choices(run, monkeypatch, tmp_path):
    shown = []

    def draw(choices, names, heading):
        shown.append((choices, names, heading))
        return report.learning_curves([learning_curve(run)], "any figure will do")

    monkeypatch.setattr(report, "skill_distribution", draw)
    monkeypatch.setattr(report, "save", lambda figure, stem: [stem])
    evaluation = run.evaluate(20)
    write_report(run, evaluation, tmp_path)
    assert len(shown) == 2
    for index, (choices, names, heading) in enumerate(shown):
        np.testing.assert_array_equal(choices, evaluation.choices[index])
        assert names == ("go_to_poi_A", "go_to_poi_B")
        rate = evaluation.returns[index].mean()
        assert f"seed {tiny.SEEDS[index]}" in heading and f"{rate:.1%} of 20 episodes" in heading


def test_a_run_without_a_generation_in_its_budget_has_no_curve(run):
    text = run.folder.config.read_text().replace(f"steps: {tiny.STEPS}", "steps: 10")
    run.folder.config.write_text(text)
    (run.folder.path / "digests.json").unlink()
    with pytest.raises(sc.UserError, match="no generation yet"):
        learning_curve(sc.Run(run.folder.path))

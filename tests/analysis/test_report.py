"""The report: which files, and that they show what the run recorded."""

import json
import shutil

import numpy as np
import pytest

import skillcrew as sc
from experiment import tiny
from skillcrew.analysis import report
from skillcrew.analysis.learning import learning_curve
from skillcrew.analysis.page.contents import describe
from skillcrew.analysis.report import write_figures, write_report, write_reports
from skillcrew.errors import Notice


@pytest.fixture
def run(tmp_path):
    return sc.Run(shutil.copytree(tiny.finished_run(), tmp_path / "run"))


def test_files_are_written_into_the_run_or_elsewhere(run, tmp_path):
    evaluation = run.evaluate(20)
    page, *written, scores = write_report(run, evaluation)
    assert page == run.folder.path / "report" / "report.html"
    assert page.read_text().startswith("<!doctype html>") and "rover-t2-c2" in page.read_text()
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
    assert [path.name for path in elsewhere] == [path.name for path in (page, *written, scores)]
    assert elsewhere[0].read_bytes() == page.read_bytes(), "the same run gives other episodes"


def test_several_runs_are_on_one_page(run, tmp_path, monkeypatch):
    shown = report.shown_episodes(run)
    monkeypatch.setattr(report, "shown_episodes", lambda run: shown)
    monkeypatch.setattr(report, "save", lambda figure, stem: [stem])
    caught = []
    monkeypatch.setattr(report, "write_page", lambda *given: caught.append(given) or given[-1])
    # A folder of each one's name, that need not be there yet.
    for name in ("run", "run-2", "other"):
        (tmp_path / "out" / name).mkdir(parents=True)
    other = sc.Run(shutil.copytree(run.folder.path, tmp_path / "other"))
    runs, evaluation = [run, run, other], run.evaluate(20)
    page, *figures = write_reports(runs, [evaluation] * 3, tmp_path / "out")
    assert page == tmp_path / "out" / "report.html"
    assert {path.parent.name for path in figures} == {"run", "run-2", "other"}
    (contents, pooled, title, _) = caught[0]
    assert [one.name for one in contents] == ["MADyS (run)", "MADyS (run-2)", "MADyS (other)"]
    assert title == "3 runs on rover-t2-c2" and len(pooled) == 1
    assert pooled[0].runs == (0, 1, 2) and len(pooled[0].curves.even.per_seed) == 6
    np.testing.assert_allclose(pooled[0].curves.even.band.mean, contents[0].curves.even.band.mean)


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
    write_figures(run, evaluation, tmp_path)
    assert len(shown) == 2
    for index, (choices, names, heading) in enumerate(shown):
        np.testing.assert_array_equal(choices, evaluation.choices[index])
        assert names == ("go_to_poi_A", "go_to_poi_B")
        rate = evaluation.returns[index].mean()
        assert f"seed {tiny.SEEDS[index]}" in heading and f"{rate:.1%} of 20 episodes" in heading


def test_where_metrics_are_lost_a_report_has_all_else(run, monkeypatch, tmp_path):
    run.folder.metrics.unlink()
    figures, pages = [], []
    monkeypatch.setattr(report, "save", lambda figure, stem: figures.append(stem.name) or [stem])
    monkeypatch.setattr(report, "skill_distribution", lambda *_: None)
    monkeypatch.setattr(report, "shown_episodes", lambda _: [])
    monkeypatch.setattr(report, "write_page", lambda *given: pages.append(given) or given[-1])
    with pytest.warns(Notice, match=r"without a learning curve: .*metrics\.parquet: is not there"):
        report.write_report(run, run.evaluate(20), tmp_path)
    assert figures == [f"chosen_skills_seed_{seed}" for seed in tiny.SEEDS]
    (contents, _, title, _) = pages[0]
    described = describe(contents, [], title)
    assert described["panels"] == [] and len(described["runs"][0]["scores"]["rows"]) == 3
    assert report._pooled(2 * contents) == []


def test_a_run_without_a_generation_in_its_budget_has_no_curve(run):
    text = run.folder.config.read_text().replace(f"steps: {tiny.STEPS}", "steps: 10")
    run.folder.config.write_text(text)
    (run.folder.path / "digests.json").unlink()
    with pytest.raises(sc.UserError, match="no generation yet"):
        learning_curve(sc.Run(run.folder.path))

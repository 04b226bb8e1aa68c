"""The runs of a reproduction."""

import dataclasses
import re
from pathlib import Path

import pytest
import yaml

import skillcrew as sc
from skillcrew.algorithms.registry import algorithm_class
from skillcrew.envs.registry import names
from skillcrew.envs.rover.presets import PRESETS
from skillcrew.experiment import reproduction
from skillcrew.experiment.config import RunConfig, algorithm_from_yaml, from_yaml
from skillcrew.experiment.figures import (
    FIGURES,
    OF_THE_THESIS,
    SETS,
    environments,
    figures_of,
    methods_of,
    panels_of,
)
from skillcrew.experiment.reproduction import SEEDS, plan

METHODS = ("madys", "mfl", "ea", "madys-es", "madys-plus", "open-loop")


@pytest.fixture(scope="module")
def everything():
    return plan(figures_of("all"))


def test_the_six_configurations_of_the_thesis_with_every_method(everything):
    pairs = [(one.environment, one.method) for one in everything]
    environments = [f"rover-t{types}-c{coupling}" for types in (2, 3) for coupling in (1, 2, 3)]
    assert pairs == [(name, method) for name in environments for method in METHODS]
    assert len({one.name for one in everything}) == len(everything) == 36
    for one in everything:
        assert one.algorithm.name == one.method
        assert one.algorithm.env.name == one.environment
        assert one.algorithm.env.config == PRESETS[one.environment]
        steps = methods_of(figures_of("all"))[one.environment, one.method]
        assert one.config == RunConfig(seeds=(2000, 2001, 2002, 2003, 2004), steps=steps)
        # Nothing but the length of a pre-training ever differs from the defaults.
        assert one.algorithm.config == algorithm_class(one.method)(one.algorithm.env).config


def test_a_figure_has_its_environments(everything):
    assert figures_of("all") == ("fig-4.2", "fig-4.3")
    names = [[one.name for one in plan(figures_of(figure))] for figure in figures_of("all")]
    assert [len(part) for part in names] == [18, 18]
    assert names[0] + names[1] == [one.name for one in everything]
    assert all(name.startswith("rover-t2") for name in names[0])


def test_every_figure_is_in_one_set_and_every_preset_in_one_figure_and_beside_rivals():
    assert sorted(figure for figures in SETS.values() for figure in figures) == sorted(FIGURES)
    shown = [name for figure, panels in FIGURES.items() for name in panels if figure not in SETS["rivals"]]
    # Without an order of types there is nothing to commit to; crews of unlike rovers are not compared yet.
    others = {"rover-t1-c3", "rover-t2-crew", "rover-t3-crew"}
    others |= {f"rover-p4-{coupling}-{paid}" for coupling in ("c1", "c3") for paid in ("value", "closest")}
    assert sorted(shown) == sorted(set(names()) - others)
    dense = {f"{name}-dense" for figure in SETS["all"] for name in FIGURES[figure]}
    assert set(environments()) == {*shown, *dense}


def test_beyond_the_thesis_timetables_stand_alone_and_shared_beside_our_best_form():
    runs = plan(figures_of("frontier"))
    for one in runs:
        expected = {"madys-plus": (True, "agent"), "open-loop": (False, "agent")}
        expected["open-loop-team"] = (False, "team")
        selector = one.algorithm.config.selector
        assert (selector.reactive, selector.sharing) == expected[one.method], one.name
    # A timetable is given as long as a team that looks.
    assert len({(one.environment, one.config.steps) for one in runs}) == len(runs) / 3
    budgets = {one.config.steps for one in plan(["looking", "splitting"])}
    assert budgets == {10_000_000, 15_000_000, 30_000_000}
    assert len({one.label for one in runs}) == 3, "legends must tell them apart"


def test_in_other_domains_every_method_lives_as_long():
    runs = plan(figures_of("domains"))
    methods = ["madys-plus", "open-loop", "madys", "mfl", "ea", "ccea", "merl"]
    for environment in ("rescue-v1-c2", "warehouse-o3-c3"):
        own = [one for one in runs if one.environment == environment]
        assert [one.method for one in own] == methods
        assert len({one.config.steps for one in own}) == 1
    assert len(runs) == 6 * len(methods)


@pytest.fixture(scope="module")
def rivals():
    return plan(figures_of("rivals"))


def test_rivals_choose_among_the_same_skills_by_the_files_of_their_page(rivals):
    forms = Path(__file__).parents[2] / "results" / "rivals" / "methods"
    files = {path.stem for path in forms.glob("*.yaml")}
    assert files == {"mappo-skills", "ippo-skills", "coma-skills", "liir-skills", "mappo-actions"}
    for one in rivals:
        env = one.algorithm.env
        if one.method in files:
            assert one.algorithm.config == algorithm_from_yaml(forms / f"{one.method}.yaml", env).config
        else:
            assert one.algorithm.config == algorithm_class(one.method)(env).config
        if one.method.endswith("-skills"):
            assert one.algorithm.choices() == env.skills and one.label.endswith(" over skills")
    assert len({one.label for one in rivals}) == len({one.method for one in rivals}) == 9


def test_ours_beside_rivals_are_the_runs_of_other_figures(rivals):
    others = {one.name: one for one in plan(figures_of("all")) + plan(figures_of("frontier"))}
    ours = [one for one in rivals if one.method in ("madys-plus", "madys") and "dense" not in one.environment]
    assert len(ours) == 2 * 6 + 8
    assert all(one.to_yaml() == others[one.name].to_yaml() for one in ours)


def test_dense_pays_for_each_type_and_nothing_else_changes(rivals):
    dense = {one.environment: one.algorithm.env for one in rivals if one.environment.endswith("-dense")}
    assert len(dense) == 6
    for name, env in dense.items():
        sparse = PRESETS[name.removesuffix("-dense")]
        assert sparse.team_reward == "binary"
        assert env.config == dataclasses.replace(sparse, team_reward="fraction")


def test_what_two_figures_show_is_trained_once():
    both = plan(("fig-4.2", "rivals-thesis"))
    names = [one.name for one in both]
    assert len(names) == len(set(names))
    assert set(names) == {one.name for figure in ("fig-4.2", "rivals-thesis") for one in plan([figure])}


def test_the_thesis_form_has_a_feed_forward_network_for_each_agent(everything):
    for one in everything:
        if one.method in OF_THE_THESIS:
            policy = getattr(one.algorithm.config, "selector", None) or one.algorithm.config.actor
            assert (policy.memory, policy.sharing) == (0, "agent"), one.name


def test_an_unknown_figure_lists_what_there_is():
    with pytest.raises(sc.UserError) as caught:
        figures_of("fig-4.4")
    line = str(caught.value)
    assert line.startswith("unknown figure 'fig-4.4'; valid, nearest first: fig-4.2, fig-4.3, ")
    assert all(name in line for name in (*environments(), *FIGURES, *SETS))


@pytest.mark.parametrize("environment", [name for figure in SETS["all"] for name in FIGURES[figure]])
def test_an_environment_is_a_figure_of_its_own(environment, everything):
    """With the very runs that the thesis's figure has there."""
    alone = plan(figures_of(environment))
    assert list(panels_of(environment)) == [environment]
    assert [one.method for one in alone] == list(METHODS)
    among_all = [one for one in everything if one.environment == environment]
    assert [one.to_yaml() for one in alone] == [one.to_yaml() for one in among_all]


def test_the_budget_scales_steps_and_the_time_that_skills_learn():
    full, half = plan(["fig-4.3"]), plan(["fig-4.3"], budget=0.5)
    for whole, part in zip(full, half, strict=True):
        assert part.config == dataclasses.replace(whole.config, steps=whole.config.steps // 2)
        before = yaml.safe_load(whole.to_yaml())["algorithm"]
        after = yaml.safe_load(part.to_yaml())["algorithm"]
        if whole.method != "ea":
            rule = before["plateau"]
            assert rule.pop("latest") is None
            assert after["plateau"].pop("latest") == (rule["earliest"] + rule["window"]) / 2 + 1
        if whole.method == "mfl":
            assert after.pop("pretraining_steps") == before.pop("pretraining_steps") / 2 > 0
        assert before == after, "the budget changes nothing else"


def test_a_tiny_budget_still_lets_every_method_live():
    for one in plan(["fig-4.2"], budget=1e-9):
        assert one.config.steps == reproduction.LEAST_STEPS == 200_000
        assert getattr(one.algorithm.config, "pretraining_steps", 1) == 1
        if one.method != "ea":
            assert one.algorithm.config.plateau.latest == 2
    # The floor is for the small ones alone.
    steps = {one.name: one.config.steps for one in plan(["rover-t3-c3"], budget=0.03)}
    assert steps["rover-t3-c3-madys"] == 300_000 and steps["rover-t3-c3-madys-es"] == 720_000
    assert steps["rover-t3-c3-madys-plus"] == 200_000


def test_seeds_are_passed_on():
    assert SEEDS == (2000, 2001, 2002, 2003, 2004)
    assert {one.config.seeds for one in plan(["fig-4.2"], seeds=(9, 4, 1))} == {(9, 4, 1)}
    with pytest.raises(sc.UserError, match=r"seeds = \[1, 1\].*each once"):
        plan(["fig-4.2"], seeds=(1, 1))


@pytest.mark.parametrize("budget", [0.0, -0.5, 1.01, float("nan"), float("inf")])
def test_what_is_no_share_is_refused_with_the_mend(budget):
    with pytest.raises(sc.UserError) as caught:
        plan(["fig-4.2"], budget=budget)
    assert str(caught.value) == f"--budget {budget}: give a share above 0 and up to 1, such as 0.02"


def test_a_configuration_file_makes_the_same_run_again(everything, tmp_path):
    for one in everything[:4]:
        path = tmp_path / "config.yaml"
        path.write_text(one.to_yaml())
        algorithm, config = from_yaml(path)
        assert (algorithm.name, algorithm.config, config) == (one.method, one.algorithm.config, one.config)
        assert algorithm.env.config == one.algorithm.env.config


def test_every_planned_name_is_a_plain_file_name(everything):
    assert all(re.fullmatch(r"[a-z0-9-]+", one.name) for one in everything)

"""What stands in a figure of chosen skills is what was recorded: the drawn shapes are read back."""

import itertools

import numpy as np
import pytest

from oracles.colours import lightness_and_hue
from skillcrew.analysis import skill_figures as figures
from skillcrew.analysis.skill_figures import readable_skill, skill_distribution
from skillcrew.envs.registry import make
from skillcrew.errors import UserError

SKILLS = ("go_to_poi_A", "go_away_from_poi_A", "go_to_poi_B", "go_away_from_poi_B", "go_to_agent")


def made_up_choices(n_agents=2, n_episodes=300, length=12, seed=0):
    """Choices of skills whose episodes end at different times, the last steps in few episodes."""
    rng = np.random.default_rng(seed)
    choices = rng.choice(len(SKILLS), (n_episodes, length, n_agents), p=[0.4, 0.1, 0.3, 0.05, 0.15])
    ends = rng.integers(3, length - 2, n_episodes)
    ends[0] = length - 1
    choices[np.arange(length) >= ends[:, None]] = -1
    return choices


def counted_shares(choices):
    """The shares and the running episodes, counted one at a time."""
    episodes, length, n_agents = choices.shape
    shares, running = np.zeros((length, n_agents, len(SKILLS))), np.zeros(length)
    for time in range(length):
        alive = [e for e in range(episodes) if choices[e, time, 0] != -1]
        running[time] = len(alive)
        for episode in alive:
            for agent in range(n_agents):
                shares[time, agent, choices[episode, time, agent]] += 1 / len(alive)
    return shares, running


def panels(figure):
    return [axes for axes in figure.axes if axes.get_title("left").startswith("Agent")]


def strip(figure):
    return next(axes for axes in figure.axes if axes.get_title("left") == "Episodes still running")


def read_shares(figure, axes):
    """Shares by time and skill as a reader takes them: height of the legend's colour; and opacity."""
    (legend,) = figure.legends
    keys = zip(legend.get_texts(), legend.get_patches(), strict=True)
    colour_of = {text.get_text(): patch.get_facecolor()[:3] for text, patch in keys}
    length = len(axes.patches[0].get_data().values)
    shares, opacity = np.zeros((length, len(SKILLS))), np.zeros(length)
    for skill, name in enumerate(SKILLS):
        for area in axes.patches:
            if area.get_facecolor()[:3] != colour_of[readable_skill(name)]:
                continue
            top, edges, base = area.get_data()
            assert np.array_equal(edges, np.arange(length + 1) + 0.5)
            shares[:, skill] += np.nan_to_num(top - base)
            opacity = np.where(np.isnan(top), opacity, area.get_alpha())
    return shares, opacity


@pytest.mark.parametrize("n_agents", [1, 2, 5, 6])
def test_each_panel_shows_the_shares_of_its_own_agent(n_agents):
    choices = made_up_choices(n_agents)
    figure = skill_distribution(choices, SKILLS, "title")
    expected, _ = counted_shares(choices)
    drawn = panels(figure) if n_agents > 1 else figure.axes[:1]
    assert len(drawn) == n_agents
    for agent, axes in enumerate(drawn):
        shares, _ = read_shares(figure, axes)
        np.testing.assert_allclose(shares, expected[:, agent], atol=1e-12)
    assert len({axes.get_position().x0 for axes in drawn}) == (1 if n_agents <= 3 else 2)


def test_areas_are_stacked_without_gaps_or_overlaps():
    figure = skill_distribution(made_up_choices(), SKILLS, "title")
    for axes in panels(figure):
        for time in range(11):
            spans = [(p.get_data().baseline[time], p.get_data().values[time]) for p in axes.patches]
            spans = [span for span in spans if not np.isnan(span[1])]
            assert spans[0][0] == 0 and spans[-1][1] == pytest.approx(1)
            assert all(below[1] == above[0] for below, above in itertools.pairwise(spans))


def test_time_steps_that_few_episodes_reach_are_pale():
    choices = made_up_choices()  # 300 episodes: 3 are 1 %
    figure = skill_distribution(choices, SKILLS, "title")
    _, running = counted_shares(choices)
    _, opacity = read_shares(figure, panels(figure)[0])
    assert np.array_equal(opacity == 1, running >= 3)
    assert 0 < opacity[-2] < 0.5 and running[-2] == 1
    few = skill_distribution(choices[:20], SKILLS, "title")
    _, opacity = read_shares(few, panels(few)[0])
    assert opacity[-2] == 1.0  # one of 20 episodes is 5 %


def test_the_strip_shows_the_episodes_still_running():
    choices = made_up_choices()
    axes = strip(skill_distribution(choices, SKILLS, "title"))
    top, edges, base = axes.patches[0].get_data()
    np.testing.assert_array_equal(top, counted_shares(choices)[1])
    assert base == 0 and edges[0] == 0.5 and edges[-1] == 12.5
    assert axes.get_ylim() == (0, 300) and axes.get_xlabel() == "Time step"


def test_skills_read_as_words_in_the_order_of_the_stack():
    figure = skill_distribution(made_up_choices(), SKILLS, "MADyS on a preset")
    (legend,) = figure.legends
    assert [text.get_text() for text in legend.get_texts()] == [
        "go to agent",
        "go away from POI B",
        "go to POI B",
        "go away from POI A",
        "go to POI A",
    ]
    assert figure.get_suptitle() == "MADyS on a preset"
    assert figure.get_supylabel() == "Share of episodes still running"


def test_colours_pair_the_skills_of_a_target_and_are_told_apart_by_the_colour_blind():
    names = [
        f"{verb}_{target}"
        for target in ("poi_A", "poi_B", "poi_C", "agent")
        for verb in ("go_to", "go_away_from")
    ]
    seen = [lightness_and_hue(colour) for colour in figures.skill_colours(names)]
    for to, away in zip(seen[::2], seen[1::2], strict=True):
        assert away[0] - to[0] > 20  # the same hue, much lighter
    gaps = [np.linalg.norm(one - other) for i, one in enumerate(seen) for other in seen[:i]]
    assert min(gaps) > 15
    # The skills about agents and about A look the same whether or not there is a C between them.
    assert figures.skill_colours([*names[:4], *names[6:]]) == [
        colour for i, colour in enumerate(figures.skill_colours(names)) if i not in (4, 5)
    ]
    assert figures.skill_colours(["hover", "land"])[0] != figures.skill_colours(["hover", "land"])[1]


def test_skills_of_unlike_agents_look_alike():
    names = [f"{kind}/{skill}" for kind in ("scout", "hauler") for skill in ("go_to_poi_A", "go_to_agent")]
    assert figures.skill_colours(names) == 2 * figures.skill_colours(["go_to_poi_A", "go_to_agent"])


def test_every_skill_of_the_largest_preset_has_a_colour_of_its_own():
    names = make("rover-t6-c3").skills
    assert len(set(figures.skill_colours(names))) == len(names) == 14


def test_nothing_to_draw_is_the_users_to_mend():
    for empty in (np.full((3, 4, 2), -1), made_up_choices()[:0]):
        with pytest.raises(UserError, match="no episodes"):
            skill_distribution(empty, SKILLS, "")

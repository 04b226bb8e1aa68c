"""What stands in the figures is what was recorded: the drawn shapes are read back."""

import itertools
import os
import subprocess
import sys

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure

from skillcrew.analysis import figures
from skillcrew.analysis.figures import Curve, learning_curves, readable_skill, save, skill_distribution
from skillcrew.analysis.statistics import Band, mean_band
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


def made_up_curve(label="MADyS", n_seeds=3, **extra):
    rng = np.random.default_rng(n_seeds)
    steps = [np.cumsum(rng.integers(5_000, 30_000, 60)) for _ in range(n_seeds)]
    values = [rng.uniform(0, 1, 60) for _ in range(n_seeds)]
    for row in values:
        row[3:60:7] = np.nan
    return Curve(label, mean_band(steps, values), list(zip(steps, values, strict=True)), **extra)


def test_nothing_to_draw_is_the_users_to_mend():
    for empty in (np.full((3, 4, 2), -1), made_up_choices()[:0]):
        with pytest.raises(UserError, match="no episodes"):
            skill_distribution(empty, SKILLS, "")
    with pytest.raises(UserError, match="no learning curves"):
        learning_curves([], "")


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


def lightness_and_hue(colour):
    """CIELAB of a colour as a reader with deuteranopia sees it (Machado et al. 2009)."""
    rgb = np.array(to_rgb(colour))
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    seen = [
        [0.367322, 0.860646, -0.227968],
        [0.280085, 0.672501, 0.047413],
        [-0.01182, 0.04294, 0.968881],
    ]
    to_xyz = [[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]]
    xyz = np.array(to_xyz) @ np.clip(np.array(seen) @ linear, 0, 1) / [0.95047, 1, 1.08883]
    x, y, z = np.where(xyz > 0.008856, np.cbrt(xyz), 7.787 * xyz + 16 / 116)
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])


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


def lines(figure, gid):
    return [line for line in figure.axes[0].lines if line.get_gid() == gid]


def test_learning_curves_draw_what_was_recorded():
    curves = [made_up_curve("MADyS", 3), made_up_curve("EA", 2)]
    figure = learning_curves(curves, "rover-t2-c2")
    axes = figure.axes[0]
    bands = [area for area in axes.collections if area.get_gid() == "band"]
    for curve, mean, band in zip(curves, lines(figure, "mean"), bands, strict=True):
        np.testing.assert_array_equal(
            mean.get_xydata(), np.stack([curve.band.steps, curve.band.mean], axis=1)
        )
        (outline,) = band.get_paths()
        corners = set(map(tuple, outline.vertices))
        assert corners >= set(zip(curve.band.steps, curve.band.low, strict=True))
        assert corners >= set(zip(curve.band.steps, curve.band.high, strict=True))
        assert to_rgb(band.get_facecolor()[0][:3]) == to_rgb(mean.get_color())
    for seed in range(3):
        drawn = lines(figure, f"seed {seed}")
        recorded = [curve.per_seed[seed] for curve in curves if seed < len(curve.per_seed)]
        for line, (steps, values) in zip(drawn, recorded, strict=True):
            kept = ~np.isnan(values)
            np.testing.assert_array_equal(line.get_xydata(), np.stack([steps[kept], values[kept]], axis=1))
            assert line.get_linewidth() < 1 and line.get_alpha() < 0.5
    assert axes.get_title() == "rover-t2-c2" and axes.get_xlabel() == "Environment steps"
    assert axes.get_ylabel() == "Champion's success rate on fresh episodes"


def test_the_legend_says_what_the_band_is():
    curves = [made_up_curve("MADyS", 5), made_up_curve("MFL", 2, pretrained_at=2e5), made_up_curve("EA", 1)]
    figure = learning_curves(curves, "")
    assert [text.get_text() for text in figure.legends[0].get_texts()] == [
        "MADyS (mean of 5 seeds, 95 % interval)",
        "MFL (mean of 2 seeds, 95 % interval; dotted: end of pre-training)",
        "EA (1 seed, no interval)",
    ]
    (dotted,) = lines(figure, "pre-training")
    assert list(dotted.get_xdata()) == [2e5, 2e5]
    assert len([area for area in figure.axes[0].collections if area.get_gid() == "band"]) == 2


def one_point(steps):
    one = np.array([0.5])
    at = np.array([float(steps)])
    return Curve("EA", Band(at, one, one * np.nan, one * np.nan), [(at, one)])


@pytest.mark.parametrize(
    ("last", "tick", "label"),
    [(4e6, 5e5, "0.5 M"), (6e5, 2e5, "0.2 M"), (3e5, 5e4, "50 k"), (2e9, 5e8, "0.5 G"), (90, 20, "20")],
)
def test_steps_are_in_human_units(last, tick, label):
    formatter = learning_curves([one_point(last)], "").axes[0].xaxis.get_major_formatter()
    assert formatter(tick, 0) == label and formatter(0, 0) == "0"


def test_a_single_measurement_is_visible():
    (mean,) = lines(learning_curves([one_point(1e5)], ""), "mean")
    assert mean.get_marker() == "o"


def test_saved_files_are_a_png_and_a_pdf_of_the_same_bytes_every_time(tmp_path):
    choices = made_up_choices()
    written = []
    for folder in ("one", "two"):
        stem = tmp_path / folder / "fig-4.2"
        written.append(save(skill_distribution(choices, SKILLS, "title"), stem))
        assert [path.name for path in written[-1]] == ["fig-4.2.png", "fig-4.2.pdf"]
        assert sorted(path.name for path in stem.parent.iterdir()) == ["fig-4.2.pdf", "fig-4.2.png"]
    png, pdf = (path.read_bytes() for path in written[0])
    assert png.startswith(b"\x89PNG") and pdf.startswith(b"%PDF") and pdf.rstrip().endswith(b"%%EOF")
    assert b"Date" not in pdf and b"atplotlib" not in png
    assert (png, pdf) == tuple(path.read_bytes() for path in written[1])
    # Pixels per metre, as PNG counts them, of 150 dots per inch.
    assert int.from_bytes(png[png.index(b"pHYs") + 4 :][:4], "big") == round(150 / 0.0254)


def test_a_failed_save_leaves_the_old_file_and_nothing_else(tmp_path, monkeypatch):
    figure = learning_curves([made_up_curve()], "")
    png, pdf = save(figure, tmp_path / "curves")
    old = png.read_bytes()

    def full_disk(_, path, **__):
        assert path.parent == tmp_path and path not in (png, pdf)
        path.write_bytes(b"half a fi")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Figure, "savefig", full_disk)
    with pytest.raises(UserError, match=r"curves\.png: No space left"):
        save(figure, tmp_path / "curves")
    assert png.read_bytes() == old
    assert sorted(os.listdir(tmp_path)) == ["curves.pdf", "curves.png"]


def test_a_folder_that_cannot_be_is_the_users_to_mend(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(UserError, match="cannot write"):
        save(Figure(), tmp_path / "file" / "figure")


def test_pyplot_is_never_loaded():
    code = "import sys, skillcrew.analysis.figures; sys.exit('matplotlib.pyplot' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0

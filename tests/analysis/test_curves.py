"""What stands in a figure of learning curves is what was recorded: the drawn lines are read back."""

import numpy as np
import pytest
from matplotlib.colors import to_hex, to_rgb

from skillcrew.analysis.curves import CURVE_COLOURS, Curve, learning_curves, panels_of_curves
from skillcrew.analysis.statistics import Band, mean_band
from skillcrew.errors import UserError
from skillcrew.experiment.score import RETURN


def made_up_curve(label="MADyS", n_seeds=3, **extra):
    rng = np.random.default_rng(n_seeds)
    steps = [np.cumsum(rng.integers(5_000, 30_000, 60)) for _ in range(n_seeds)]
    values = [rng.uniform(0, 1, 60) for _ in range(n_seeds)]
    for row in values:
        row[3:60:7] = np.nan
    return Curve(label, mean_band(steps, values), list(zip(steps, values, strict=True)), **extra)


def lines(figure, gid, panel=0):
    return [line for line in figure.axes[panel].lines if line.get_gid() == gid]


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
    assert axes.get_xscale() == "linear" and axes.get_xlim()[0] == 0
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


def test_nothing_to_draw_is_the_users_to_mend():
    with pytest.raises(UserError, match="no learning curves"):
        learning_curves([], "")


def three_panels(**extra):
    """Two methods in three environments, all with other numbers."""
    return {
        f"rover-{index}": [made_up_curve("MADyS", index + 2), made_up_curve("MFL", index + 5, **extra)]
        for index in range(3)
    }


def test_panels_draw_each_environment_in_its_own():
    panels = three_panels()
    figure = panels_of_curves(panels, "Figure 4.2, again")
    assert figure.get_suptitle() == "Figure 4.2, again"
    assert [axes.get_title() for axes in figure.axes] == list(panels)
    for panel, curves in enumerate(panels.values()):
        axes = figure.axes[panel]
        assert {line.get_gid() for line in axes.lines} == {"mean"}, "single seeds would hide the means"
        bands = [area for area in axes.collections if area.get_gid() == "band"]
        drawn = zip(curves, lines(figure, "mean", panel), bands, CURVE_COLOURS, strict=False)
        for curve, mean, band, colour in drawn:
            np.testing.assert_array_equal(
                mean.get_xydata(), np.stack([curve.band.steps, curve.band.mean], axis=1)
            )
            (outline,) = band.get_paths()
            corners = set(map(tuple, outline.vertices))
            assert corners >= set(zip(curve.band.steps, curve.band.low, strict=True))
            assert corners >= set(zip(curve.band.steps, curve.band.high, strict=True))
            assert mean.get_color() == colour
            assert to_rgb(band.get_facecolor()[0][:3]) == to_rgb(colour)
        assert len(lines(figure, "mean", panel)) == len(bands) == 2
        first = min(curve.band.steps[0] for curve in curves)
        last = max(curve.band.steps[-1] for curve in curves)
        left, right = axes.get_xlim()
        assert left < first and last < right, "the border would hide half of a line"
        assert first / left < 1.2 and right / last < 1.2


def test_a_method_has_one_colour_in_all_panels_and_the_legend_names_each_once():
    panels = {
        "one": [made_up_curve("MFL", 2)],
        "two": [made_up_curve("MADyS", 3), made_up_curve("MFL", 4)],
        "three": [made_up_curve("EA", 5), made_up_curve("MADyS", 6)],
    }
    figure = panels_of_curves(panels, "")
    colours = dict(zip(("MFL", "MADyS", "EA"), CURVE_COLOURS, strict=False))
    for panel, curves in enumerate(panels.values()):
        drawn = [line.get_color() for line in lines(figure, "mean", panel)]
        assert drawn == [colours[curve.label] for curve in curves]
    (legend,) = figure.legends
    named = zip(legend.get_texts(), legend.get_patches(), strict=True)
    assert {text.get_text(): to_hex(patch.get_facecolor()) for text, patch in named} == {
        label: to_hex(colour) for label, colour in colours.items()
    }


def between(first, last, pretrained_at=None):
    """A panel of one method that was measured over a range of steps."""
    steps = np.geomspace(first, last, 5)
    half = np.full(5, 0.5)
    return [Curve("MADyS", Band(steps, half, half, half), [], pretrained_at=pretrained_at)]


def across(axes, steps):
    """Where along the axis some steps stand, 0 at its left end and 1 at its right one."""
    place = axes.transData.transform([(steps, 0.0)])
    return float(axes.transAxes.inverted().transform(place)[0, 0])


def test_a_factor_of_twenty_is_as_wide_wherever_it_is():
    axes = panels_of_curves({"rover-t3-c3": between(5e4, 4e7)}, "").axes[0]
    widths = [across(axes, 20 * steps) - across(axes, steps) for steps in (6e4, 3e5, 2e6)]
    np.testing.assert_allclose(widths, widths[0], rtol=1e-6)
    assert widths[0] > 0.4
    assert axes.get_xlabel() == "Environment steps (logarithmic)"


@pytest.mark.parametrize(
    ("first", "last", "labels"),
    [
        (4e4, 9e7, ["100 k", "1 M", "10 M"]),
        (6e4, 4e7, ["100 k", "300 k", "1 M", "3 M", "10 M", "30 M"]),
        (9e5, 2e9, ["1 M", "10 M", "100 M", "1 G"]),
        (4e4, 2e5, ["20 k", "50 k", "100 k", "200 k"]),
        (40, 700, ["50", "100", "200", "500"]),
    ],
)
def test_ticks_of_panels_are_round_and_each_in_its_own_unit(first, last, labels):
    axes = panels_of_curves({"": between(first, last)}, "").axes[0]
    ticks = axes.xaxis.get_majorticklocs()
    assert list(axes.xaxis.get_major_formatter().format_ticks(ticks)) == labels
    left, right = axes.get_xlim()
    assert all(left <= tick <= right for tick in ticks)
    minor = axes.xaxis.get_minorticklocs()
    assert len(minor) and not any(axes.xaxis.get_minor_formatter().format_ticks(minor))


@pytest.mark.parametrize("pretrained_at", [2e4, 3e6])
def test_the_end_of_pretraining_is_in_the_panel_and_where_it_was(pretrained_at):
    figure = panels_of_curves({"": between(1e5, 1e7, pretrained_at)}, "")
    (dotted,) = lines(figure, "pre-training")
    assert list(dotted.get_xdata()) == [pretrained_at] * 2
    first = min(1e5, pretrained_at)
    expected = np.log(pretrained_at / first) / np.log(1e7 / first)
    assert across(figure.axes[0], pretrained_at) == pytest.approx(expected, abs=0.03)


def test_panels_share_their_y_axis_and_name_it_once():
    figure = panels_of_curves(three_panels(), "")
    first, *others = figure.axes
    assert len(others) == 2
    assert all(first.get_shared_y_axes().joined(first, axes) for axes in others)
    assert [axes.get_ylabel() for axes in figure.axes] == [
        "Champion's success rate on fresh episodes",
        "",
        "",
    ]
    assert {axes.get_xlabel() for axes in figure.axes} == {"Environment steps (logarithmic)"}


def test_panels_have_one_legend_with_each_label_once():
    (legend,) = panels_of_curves(three_panels(), "").legends
    assert [text.get_text() for text in legend.get_texts()] == ["MADyS", "MFL"]


def test_panels_say_once_what_the_dotted_lines_are():
    panels = three_panels(pretrained_at=2e5)
    figure = panels_of_curves(panels, "")
    (legend,) = figure.legends
    assert [text.get_text() for text in legend.get_texts()] == [
        "MADyS",
        "MFL",
        "end of pre-training (MFL)",
    ]
    assert legend.legend_handles[-1].get_linestyle() == ":"
    for panel in range(3):
        (dotted,) = lines(figure, "pre-training", panel)
        assert list(dotted.get_xdata()) == [2e5, 2e5] and dotted.get_linestyle() == ":"


def test_a_single_panel_of_single_seeds():
    figure = panels_of_curves({"rover-t2-c1": [one_point(1e5)]}, "")
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["EA"]
    assert not [area for area in figure.axes[0].collections if area.get_gid() == "band"]
    left, right = figure.axes[0].get_xlim()
    assert left < 1e5 < right and right / left > 10


# Returns, on a scale of their own


def returns(times, plus, label="ERL"):
    rng = np.random.default_rng(1)
    steps = [np.arange(1, 41) * 1000.0] * 12
    values = [times * rng.uniform(0, 1, 40) + plus for _ in range(12)]
    band = mean_band(steps, values, lower=RETURN.lower, upper=RETURN.upper)
    return Curve(label, band, list(zip(steps, values, strict=True)), score=RETURN)


@pytest.mark.parametrize(("times", "plus"), [(30.0, -50.0), (2000.0, 100.0), (0.01, 0.0)])
def test_an_axis_of_returns_is_scaled_to_the_data(times, plus):
    curve = returns(times, plus)
    (axes,) = learning_curves([curve], "").axes
    assert axes.get_ylabel() == "Champion's team return on fresh episodes"
    low, high = axes.get_ylim()
    drawn = np.concatenate([curve.band.low, curve.band.high, *(values for _, values in curve.per_seed)])
    assert low <= drawn.min() and drawn.max() <= high
    assert high - low < 1.3 * (drawn.max() - drawn.min())


def test_panels_of_returns_share_no_axis():
    figure = panels_of_curves({"pendulum": [returns(30, -50)], "cheetah": [returns(2000, 100)]}, "")
    first, second = figure.axes
    assert not first.get_shared_y_axes().joined(first, second)
    assert first.get_ylim()[1] < 0 < second.get_ylim()[0]

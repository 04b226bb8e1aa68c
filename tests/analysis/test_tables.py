"""Tables of a comparison: every cell against SciPy, counted pairs and the numbers that went in."""

import csv
import re

import numpy as np
import pytest
from scipy import stats

from skillcrew.analysis import comparison
from skillcrew.analysis.levels import Reaching
from skillcrew.analysis.tables import Entry, markdown_table, write_tables
from skillcrew.experiment.score import RETURN

SEEDS = (2000, 2001, 2002)
ENVIRONMENTS = {"rover-t2-c1": 3_000_000, "rover-t3-c1": 20_000_000}
METHODS = ("MADyS", "MFL", "EA", "MADyS+")
NAN = float("nan")
EPISODES = 100


@pytest.fixture(autouse=True)
def few_resamples(monkeypatch):
    monkeypatch.setattr(comparison, "RESAMPLES", 60)


def entry(method="MADyS", environment="rover-t2-c1", seeds=SEEDS, steps=None, **measured):
    """A method whose seeds all do the same, but for what is given."""
    same = {"final": 0.5, "area": 0.25, "half": 1e6, "nine_tenths": 2e6}
    numbers = {name: np.broadcast_to(np.array(value, float), len(seeds)) for name, value in same.items()}
    numbers |= {name: np.array(value, float) for name, value in measured.items()}
    budget = steps or ENVIRONMENTS[environment]
    reached = {
        level: [Reaching(budget if np.isnan(at) else float(at), not np.isnan(at)) for at in numbers.pop(name)]
        for level, name in ((0.5, "half"), (0.9, "nine_tenths"))
    }
    return Entry(environment, method, seeds, budget, episodes=EPISODES, steps_to=reached, **numbers)


@pytest.fixture
def entries():
    """All methods in both environments, with three seeds of made-up numbers each."""
    rng = np.random.default_rng(7)
    return [
        entry(
            method,
            environment,
            final=rng.integers(0, 1001, 3) / 1000,
            area=rng.random(3),
            half=rng.integers(1, 10**7, 3),
            nine_tenths=[*rng.integers(1, 10**7, 2), NAN],
        )
        for environment in ENVIRONMENTS
        for method in METHODS
    ]


def tables(entries):
    """Each table of the Markdown as rows of cells, its heading first and without the rule below that."""
    found = []
    for block in markdown_table(entries).split("\n\n"):
        if block.startswith("|"):
            rows = [[cell.strip() for cell in line.split("|")[1:-1]] for line in block.strip().split("\n")]
            assert {len(row) for row in rows} == {len(rows[0])}
            assert set("".join(rows[1])) == {"-"}
            found.append([rows[0], *rows[2:]])
    return found


def numbers(cell):
    """`0.500 [0.400, 0.600]` as three numbers."""
    match = re.fullmatch(r"(\d\.\d{3}) \[(\d\.\d{3}), (\d\.\d{3})\]", cell)
    assert match, cell
    return [float(number) for number in match.groups()]


def student(values):
    """SciPy's interval of the mean, within 0 and 1."""
    low, high = stats.t.interval(0.95, len(values) - 1, np.mean(values), stats.sem(values))
    return f"{np.mean(values):.3f} [{max(low, 0):.3f}, {min(high, 1):.3f}]"


def ahead(ours, theirs):
    """The share of pairs of runs in which ours wins."""
    return np.mean([(one > other) + (one == other) / 2 for one in ours for other in theirs])


def test_each_cell_of_each_method(entries):
    heading, *rows = tables(entries)[0]
    assert heading == [
        *["environment", "method", "final success", "interquartile mean", "area under curve"],
        *["steps to 0.5", "steps to 0.9", "better than MADyS"],
    ]
    assert len(rows) == len(entries) == 8
    for row, entry in zip(rows, entries, strict=True):
        reference = next(
            other for other in entries if (other.environment, other.method) == (entry.environment, "MADyS")
        )
        assert row[:2] == [entry.environment, entry.method]
        assert row[2] == student(entry.final)
        middle, low, high = numbers(row[3])
        assert middle == pytest.approx(stats.trim_mean(entry.final, 0.25), abs=6e-4)
        assert low <= middle <= high
        assert row[4] == student(entry.area)
        half, nine_tenths = (np.mean([one.steps for one in reached]) for reached in entry.steps_to.values())
        assert row[5] == f"{half / 1e6:.2f} M"
        assert re.fullmatch(r"> \d+\.\d\d M \(2 of 3 seeds\)", row[6])
        assert 0 <= nine_tenths / 1e6 - float(row[6].split()[1]) < 0.01, (
            "what is bounded below is rounded down"
        )
        if entry is reference:
            assert row[7] == ""
        else:
            better, low, high = numbers(row[7])
            assert better == pytest.approx(ahead(entry.final, reference.final), abs=6e-4)
            assert low <= better <= high


def test_all_environments_together(entries):
    heading, *rows = tables(entries)[2]
    assert heading == [
        "all environments",
        "interquartile mean of final success",
        "better than MADyS",
    ]
    assert [row[0] for row in rows] == list(METHODS)
    for row in rows:
        mine = [entry.final for entry in entries if entry.method == row[0]]
        reference = [entry.final for entry in entries if entry.method == "MADyS"]
        assert numbers(row[1])[0] == pytest.approx(stats.trim_mean(np.concatenate(mine), 0.25), abs=6e-4)
        if row[0] == "MADyS":
            assert row[2] == ""
        else:
            per_task = [ahead(*pair) for pair in zip(mine, reference, strict=True)]
            assert numbers(row[2])[0] == pytest.approx(np.mean(per_task), abs=6e-4)


def test_one_that_is_not_everywhere_is_compared_where_it_is():
    first, second = ENVIRONMENTS
    low, high, between = (np.array(final) for final in ([0.1, 0.1, 0.1], [0.9, 0.9, 0.9], [0.5, 0.5, 0.5]))
    some = [
        entry("MADyS", first, final=low),
        entry("MADyS", second, final=high),
        entry("EA", second, final=between),
    ]
    rows = {row[0]: row for row in tables(some)[2][1:]}
    assert list(rows) == ["MADyS", "EA (in 1 of 2)"]
    # In the first environment it would have been ahead.
    assert numbers(rows["EA (in 1 of 2)"][2])[0] == 0.0


def test_where_the_first_method_is_missing_nothing_is_compared_with_it():
    first, second = ENVIRONMENTS
    low, high = np.array([0.1, 0.1, 0.1]), np.array([0.9, 0.9, 0.9])
    some = [
        entry("MADyS", first, final=high),
        entry("EA", first, final=low),
        entry("EA", second, final=high),
        entry("MFL", second, final=high),
    ]
    each, differences, together = tables(some)
    assert [row[-1] == "" for row in each[1:]] == [True, False, True, True]
    assert [row[:2] for row in differences[1:]] == [[first, "EA"]]
    rows = {row[0]: row for row in together[1:]}
    assert numbers(rows["EA"][2])[0] == 0.0 and rows["MFL (in 1 of 2)"][2] == ""


@pytest.mark.parametrize(
    ("steps", "cell"),
    [
        ([NAN, NAN, NAN], "> 3.00 M (0 of 3 seeds)"),
        ([1e6, NAN, NAN], "> 2.33 M (1 of 3 seeds)"),
        ([2e6, NAN, 3e6], "> 2.66 M (2 of 3 seeds)"),
        ([1e6, 2e6, 4.5e6], "2.50 M"),
    ],
)
def test_steps_say_how_many_seeds_got_there(steps, cell):
    assert tables([entry(half=steps)])[0][1][5:7] == [cell, "2.00 M"]
    assert tables([entry(nine_tenths=steps)])[0][1][5:7] == ["1.00 M", cell]


def between(cell):
    """`+0.500 [+0.400, +0.600]` as three numbers."""
    match = re.fullmatch(r"([+-]\d\.\d{3}) \[([+-]\d\.\d{3}), ([+-]\d\.\d{3})\]", cell)
    assert match, cell
    return [float(number) for number in match.groups()]


@pytest.mark.parametrize("theirs", [[0.10, 0.11, 0.12], [0.90, 0.93, 0.92], [0.10, 0.50, 0.90]])
def test_differences_are_of_pairs_of_seeds(theirs):
    ours = [0.50, 0.51, 0.55]
    heading, row = tables([entry(area=ours), entry("EA", area=theirs)])[1]
    assert heading == ["environment", "MADyS against", "difference of final success", "difference of area"]
    expected = stats.ttest_rel(ours, theirs).confidence_interval()
    mean, low, high = between(row[3])
    assert mean == pytest.approx(np.mean(ours) - np.mean(theirs), abs=6e-4)
    assert (low, high) == pytest.approx((expected.low, expected.high), abs=6e-4)
    assert row[:2] == ["rover-t2-c1", "EA"]


def test_seeds_are_paired_by_name_and_not_by_place():
    ours, theirs = entry(area=[0.1, 0.5, 0.9]), entry("EA", seeds=SEEDS[::-1], area=[0.8, 0.4, 0.0])
    assert tables([ours, theirs])[1][1][3] == "+0.100 [+0.100, +0.100]"


def test_other_seeds_cannot_be_paired():
    ours, theirs = entry(area=[0.1, 0.5, 0.9]), entry("EA", seeds=(1, 2, 3), area=[0.0, 0.4, 0.85])
    expected = stats.ttest_ind(ours.area, theirs.area, equal_var=False).confidence_interval()
    low, high = between(tables([ours, theirs])[1][1][3])[1:]
    assert (low, high) == pytest.approx((expected.low, expected.high), abs=6e-4)


def test_two_that_always_succeed_need_not_be_equal():
    perfect = [entry(final=[1, 1, 1]), entry("EA", final=[1, 1, 1])]
    of_episodes, differences = tables(perfect)[0][1], tables(perfect)[1][1]
    assert numbers(of_episodes[2]) == numbers(of_episodes[3]) == [1.0, 0.987, 1.0]
    assert between(differences[2]) == [0.0, -0.013, 0.013]
    assert numbers(tables(perfect)[0][2][7])[1] < 0.2, "three ties"


def test_each_method_is_compared_with_the_first_in_its_own_environment():
    table = [
        entry("MFL", area=[0.10, 0.11, 0.12]),
        entry("EA", area=[0.30, 0.31, 0.32]),
        entry("MFL", "rover-t3-c1", area=[0.50, 0.51, 0.52]),
        entry("EA", "rover-t3-c1", area=[0.50, 0.51, 0.52]),
    ]
    heading, *rows = tables(table)[1]
    assert heading[1] == "MFL against"
    assert [row[:2] for row in rows] == [["rover-t2-c1", "EA"], ["rover-t3-c1", "EA"]]
    assert [between(row[3])[0] for row in rows] == [-0.2, 0.0]


def test_a_single_seed_has_no_interval_over_seeds():
    one = [entry("MADyS", seeds=(4,), area=[0.9]), entry("EA", seeds=(4,), area=[0.1], final=[0.125])]
    methods, differences, _ = tables(one)
    assert [row[2] for row in methods[1:]] == ["0.500", "0.125"]
    assert [row[4] for row in methods[1:]] == ["0.900", "0.100"]
    assert differences[1] == ["rover-t2-c1", "EA", "+0.375", "+0.800"]
    assert "nan" not in markdown_table(one)


def test_what_stands_below_says_seeds_and_budgets(entries):
    text = markdown_table(entries)
    assert (
        "Seeds 2000, 2001, 2002; environment steps per seed: 3 M in rover-t2-c1, 20 M in rover-t3-c1." in text
    )
    assert text.endswith("|\n") and "\n\n\n" not in text


def below(entries):
    """The sentences below the first table."""
    return next(block for block in markdown_table(entries).split("\n\n") if block.startswith("Seeds"))


@pytest.mark.parametrize(
    ("steps", "given"),
    [
        ({"MADyS": 20, "MFL": 20, "MADyS+": 5}, "20 M in rover-t3-c1 (5 M for MADyS+)"),
        ({"MADyS+": 5, "MADyS": 20, "MFL": 20}, "20 M in rover-t3-c1 (5 M for MADyS+)"),
        ({"MADyS": 20, "MADyS+": 5}, "20 M in rover-t3-c1 (5 M for MADyS+)"),
        (
            {"MADyS": 2.5, "MFL": 20, "EA": 40, "MADyS+": 2.5},
            "2.5 M in rover-t3-c1 (20 M for MFL, 40 M for EA)",
        ),
        (
            {"MADyS": 5, "MFL": 20, "EA": 20, "CCEA": 20, "MADyS+": 5},
            "20 M in rover-t3-c1 (5 M for MADyS and MADyS+)",
        ),
    ],
)
def test_budgets_that_differ_are_said_where_they_do(steps, given):
    equal = [entry(method) for method in steps]
    text = below([*equal, *(entry(method, "rover-t3-c1", steps=int(n * 1e6)) for method, n in steps.items())])
    assert f"environment steps per seed: 3 M in rover-t2-c1, {given}. Brackets" in text
    smallest = min(steps.values())
    assert (
        f"The area is the mean height of the learning curve up to the smallest budget where budgets differ "
        f"({smallest:g} M in rover-t3-c1); final success is at the end of a method's own budget. Steps to"
        in text
    )


def test_nothing_is_said_of_budgets_that_do_not_differ(entries):
    assert "The area is the mean height of the learning curve. Steps to" in below(entries)


def test_the_csv_file_has_the_exact_numbers_of_every_seed(entries, tmp_path):
    markdown, plain = write_tables(tmp_path, entries)
    assert sorted(tmp_path.iterdir()) == [tmp_path / "table.csv", tmp_path / "table.md"] == [plain, markdown]
    assert markdown.read_text() == markdown_table(entries)
    with plain.open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 3 * 8
    measured = ("success", "area", "steps_to_half", "steps_to_nine_tenths")
    assert list(rows[0]) == ["environment", "method", "seed", "steps", *measured]
    expected = [(entry, index) for entry in entries for index in range(3)]
    for row, (entry, index) in zip(rows, expected, strict=True):
        assert (row["environment"], row["method"]) == (entry.environment, entry.method)
        assert (int(row["seed"]), int(row["steps"])) == (SEEDS[index], ENVIRONMENTS[entry.environment])
        reached = ([one.steps if one.held else NAN for one in seeds] for seeds in entry.steps_to.values())
        numbers = (entry.final, entry.area, *reached)
        for name, of_seeds in zip(measured, numbers, strict=True):
            np.testing.assert_equal(float(row[name]), of_seeds[index])


# Returns, on a scale of their own


def returns(method, environment="pendulum", **measured):
    return Entry(
        environment, method, SEEDS, 200_000, episodes=EPISODES, steps_to={}, score=RETURN, **measured
    )


@pytest.fixture
def pendulum():
    return [
        returns("ERL", final=np.array([-151.5, -160.0, -148.25]), area=np.array([-400.0, -410, -405])),
        returns("TD3", final=np.array([-150.0, -900.0, -155.0]), area=np.array([-700.5, -720, -690])),
    ]


def test_returns_have_no_thresholds_and_no_bounds(pendulum):
    heading, first, second = tables(pendulum)[0]
    assert heading == [
        *[
            "environment",
            "method",
            "final return",
            "interquartile mean",
            "area under curve",
            "better than ERL",
        ],
    ]
    values = pendulum[1].final
    low, high = stats.t.interval(0.95, 2, values.mean(), stats.sem(values))
    assert high > 0, "no longer clipped"
    assert second[2] == f"{values.mean():.4g} [{low:.4g}, {high:.4g}]"
    assert first[4].startswith("-405 [-") and first[5] == ""
    better = float(second[5].split()[0])
    assert better == pytest.approx(ahead(values, pendulum[0].final), abs=6e-4)
    expected = stats.ttest_rel(pendulum[0].area, pendulum[1].area).confidence_interval()
    assert tables(pendulum)[1][1][3] == f"+298.5 [+{expected.low:.4g}, +{expected.high:.4g}]"
    text = markdown_table(pendulum)
    assert "success" not in text and "0.9" not in text and "ends with more return than" in text


def test_returns_of_several_environments_have_no_mean_in_common(pendulum):
    cheetah = [returns(one.method, "cheetah", final=-one.final, area=-one.area) for one in pendulum]
    heading, *rows = tables([*pendulum, *cheetah])[2]
    assert heading == ["all environments", "better than ERL"]
    assert [row[0] for row in rows] == ["ERL", "TD3"]
    # Who is ahead here by as much is behind there.
    assert float(rows[1][1].split()[0]) == pytest.approx(0.5, abs=1e-3)


def test_the_csv_file_of_returns(pendulum, tmp_path):
    _, plain = write_tables(tmp_path, pendulum)
    with plain.open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0]) == ["environment", "method", "seed", "steps", "return", "area"]
    assert [float(row["return"]) for row in rows] == [*pendulum[0].final, *pendulum[1].final]

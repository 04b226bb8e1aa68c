"""Whole numbers that no program counts to are refused by name, wherever they stand."""

import dataclasses

import pytest

import skillcrew as sc
from skillcrew.cli.main import run_command
from skillcrew.whole_numbers import LARGEST, check_whole_numbers


@dataclasses.dataclass(frozen=True)
class Inner:
    layers: tuple[int, ...] = (8, LARGEST)
    share: float = 1e30
    on: bool = True


@dataclasses.dataclass(frozen=True)
class Outer:
    count: int | None = None
    inner: Inner = Inner()


def test_numbers_are_looked_at_on_every_level():
    check_whole_numbers(Outer())
    check_whole_numbers(Outer(count=-LARGEST))
    with pytest.raises(sc.UserError, match=rf"^count = {LARGEST + 1}: give numbers of at most {LARGEST}$"):
        check_whole_numbers(Outer(count=LARGEST + 1))
    with pytest.raises(sc.UserError, match=r"^inner\.layers = \(8, -3000000000\): give"):
        check_whole_numbers(Outer(inner=Inner(layers=(8, -3_000_000_000))))


@pytest.mark.parametrize(
    "option",
    [
        "--algorithm.updates",
        "--algorithm.learner.batch-size",
        "--environment.episode-length",
    ],
)
def test_train_refuses_them_before_anything_is_made(option, tmp_path, capsys):
    words = ["train", "madys", "rover-t2-c1", "--out", str(tmp_path / "run"), option, str(2 * 10**18)]
    assert run_command(words) == 2
    said = capsys.readouterr().err
    assert f"{option.split('.')[-1].replace('-', '_')} = 2000000000000000000: give" in said
    assert not (tmp_path / "run").exists()

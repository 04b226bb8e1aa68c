"""A user's mistake is one line, whatever was mistaken."""

import pytest

import skillcrew as sc
from skillcrew.errors import LONGEST_LINE, one_line


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("runs/é 漢字: no such folder", "runs/é 漢字: no such folder"),
        ("a\nb\r\tc", "a\\nb\\r\\tc"),
        ("\x1b[31mred\x00", "\\x1b[31mred\\x00"),
        ("\udcff\u202e", "\\udcff\\u202e"),
    ],
)
def test_what_a_terminal_cannot_show_is_written_out(text, line):
    assert one_line(text) == line
    assert str(sc.UserError(text)) == line


def test_of_a_long_text_the_middle_is_left_out():
    line = str(sc.UserError(f"name = {'x' * 10**6}: mend it"))
    assert len(line) < LONGEST_LINE + 10
    assert line.startswith("name = xxx") and line.endswith("xxx: mend it") and " … " in line

"""Lists of dataclasses as a single word on the command line."""

import dataclasses

import pytest

from skillcrew.cli.things import format_things, parse_things
from skillcrew.errors import UserError


@dataclasses.dataclass(frozen=True)
class Thing:
    name: str
    count: int
    size: float = 1.0
    most: float | None = None
    colour: str = "red"


@pytest.mark.parametrize(
    ("text", "things"),
    [
        ("none", ()),
        ("ant:count=2", (Thing("ant", 2),)),
        (
            "ant:count=2:size=0.5:colour=blue,bee:count=1:most=3.0",
            (Thing("ant", 2, 0.5, None, "blue"), Thing("bee", 1, most=3.0)),
        ),
    ],
)
def test_things_there_and_back(text, things):
    assert parse_things(text, Thing) == things
    assert format_things(things) == text


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("ant", "'ant': give count too, such as ant:count=2"),
        ("ant:2", "'2' in ant:2: write FIELD=VALUE, such as count=2"),
        ("ant:count=2:sise=3", "unknown field of ant 'sise'; valid, nearest first: size,"),
        ("ant:count=2.5", "'2.5': give a whole number"),
        ("ant:count=2:size=big", "ant: size = big: give a number"),
        ("ant:count=2:size=none", "ant: size = none: give a number"),
        ("ant:count=2,", "'': give count too"),
    ],
)
def test_what_are_no_things(text, said):
    with pytest.raises(UserError, match=f"^{said}"):
        parse_things(text, Thing)


def test_a_field_that_may_be_missing_takes_none():
    assert parse_things("ant:count=2:most=none", Thing) == (Thing("ant", 2),)

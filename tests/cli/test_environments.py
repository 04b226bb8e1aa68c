"""Options of a command beside the fields of an environment."""

from skillcrew.cli.check import CheckOptions
from skillcrew.cli.compare import CompareOptions
from skillcrew.cli.environments import with_environment
from skillcrew.envs.registry import find


def test_the_same_options_are_one_class_for_all_commands():
    entry, other = find("rover-t2-c1"), find("rover-t3-c3")
    kind, default = with_environment(CheckOptions, entry)
    again, of_other = with_environment(CheckOptions, other)
    assert kind is again
    assert (default.environment, of_other.environment) == (entry.config, other.config)
    assert with_environment(CompareOptions, entry)[0] is not kind
    assert with_environment(CheckOptions, find("rescue-v1-c2"))[0] is not kind

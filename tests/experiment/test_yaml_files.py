"""Whatever is in a YAML file, reading it ends soon, in plain values or in one line."""

import os

import pytest

import skillcrew as sc
from skillcrew.experiment.yaml_files import read_yaml

NINE = "a0: &a0 [x, x, x, x, x, x, x, x, x]\n"
BOMB = NINE + "".join(f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 9)}]\n" for n in range(1, 12))
MERGED = "a0: &a0 {x: 1}\n" + "".join(
    f"a{n}: &a{n} {{<<: [{', '.join([f'*a{n - 1}'] * 9)}]}}\n" for n in range(1, 12)
)


REFUSED = {
    "lists in lists": "[" * 20_000,
    "mappings in mappings": "{" * 20_000,
    "a list of lists": "- " * 20_000,
    "too many levels": "[" * 99 + "]" * 99,
    "in itself": "a: &a [*a]",
    "all in itself": "&a {b: *a}",
    "a bomb": BOMB,
    "a bomb of mappings": MERGED,
    "no whole number": "!!int x",
    "a long number": "a: " + "9" * 5000,
    "no truth": "!!bool x",
    "no time": "!!timestamp x",
    "no date": "a: 2001-99-99",
    "no bytes": "!!binary é",
    "a name that is a list": "? [a]\n: 1",
    "a program": "!!python/object/apply:os.system [touch x]",
    "an alias of nothing": "*nothing",
    "no mapping": "a: b: c",
    "two documents": "--- 1\n--- 2",
    "a zero": "\0",
}


@pytest.mark.parametrize("text", REFUSED.values(), ids=REFUSED)
def test_it_is_refused_in_one_line(text, tmp_path):
    path = tmp_path / "config.yaml"
    path.write_text(text)
    with pytest.raises(sc.UserError, match=r"config\.yaml: cannot be read as YAML \(.+\)$") as caught:
        read_yaml(path)
    assert "\n" not in str(caught.value)


def test_bytes_that_are_no_text_pipes_and_what_is_not_there_are_refused(tmp_path):
    (tmp_path / "latin.yaml").write_bytes("é".encode("latin-1"))
    os.mkfifo(tmp_path / "pipe.yaml")
    (tmp_path / "zero.yaml").symlink_to("/dev/zero")
    for name in ("latin", "pipe", "zero", "absent"):
        with pytest.raises(sc.UserError, match=f"{name}.yaml: cannot be read"):
            read_yaml(tmp_path / f"{name}.yaml")


def test_aliases_that_repeat_a_little_are_read(tmp_path):
    path = tmp_path / "config.yaml"
    path.write_text("a: &a {b: [1, 2]}\nc: *a\nd: {<<: *a, e: null}")
    assert read_yaml(path) == {"a": {"b": [1, 2]}, "c": {"b": [1, 2]}, "d": {"b": [1, 2], "e": None}}
    path.write_text("")
    assert read_yaml(path) is None

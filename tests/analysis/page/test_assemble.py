"""The page as one file: nothing in a run folder becomes script, and nothing is asked of anybody."""

import dataclasses
import json
import re
from html.parser import HTMLParser

import numpy as np
import pytest

from analysis.page import meadow
from skillcrew.analysis import report
from skillcrew.analysis.page import contents
from skillcrew.analysis.page.assemble import as_data, assemble
from skillcrew.analysis.page.contents import describe
from skillcrew.analysis.page.packing import unpack
from skillcrew.errors import one_line
from skillcrew.experiment.origin import Origin


@pytest.fixture(scope="module")
def described():
    return describe([meadow.contents(), meadow.contents(meadow.Bare)], [], f"title {meadow.EVIL}")


@pytest.fixture(scope="module")
def page(described):
    return assemble(described, described["title"])


class Tags(HTMLParser):
    """All start tags, and the text of each script."""

    def __init__(self, page):
        super().__init__()
        self.tags, self.scripts = [("", {})], []
        self.feed(page)

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        if tag == "script":
            self.scripts.append("")

    def handle_data(self, data):
        if self.lasttag == "script" and self.tags[-1][0] == "script":
            self.scripts[-1] += data


def test_what_users_wrote_is_data(page, described):
    parsed = Tags(page)
    assert not [tag for tag, _ in parsed.tags if tag == "img"]
    assert [about.get("type") for tag, about in parsed.tags if tag == "script"] == ["application/json", None]
    assert json.loads(parsed.scripts[0]) == described
    assert meadow.EVIL in described["runs"][0]["environment"]
    assert "\u2028" not in parsed.scripts[0] and "onerror=alert(1)>" not in page


def test_the_page_says_that_it_loads_nothing(page):
    policy = next(about["content"] for _, about in Tags(page).tags if "http-equiv" in about)
    assert policy.startswith("default-src 'none'") and policy.count("'sha256-") == 2
    assert "unsafe" not in policy
    for word in ("src", "href", "style", "onclick"):
        values = [about[word] for _, about in Tags(page).tags if word in about]
        assert all(value.startswith("#") for value in values), (word, values)
    outside = page.partition('id="data">')[0] + page.rpartition("<script>")[2]
    assert re.findall(r"https?:[^\"']*", outside) == ["http://www.w3.org/2000/svg"]
    assert "@import" not in page and "url(" not in page


def test_data_has_no_end_in_it():
    text = as_data({"a": "</script><!-- \u2028 & ]]>"})
    assert not set(text) & set("<>&\u2028") and json.loads(text) == {"a": "</script><!-- \u2028 & ]]>"}
    with pytest.raises(ValueError):
        as_data({"a": float("nan")})


def test_what_is_said_of_a_run(described):
    run, bare = described["runs"]
    assert run["skills"][0]["name"] == "go to herd"
    assert [row["seed"] for row in run["scores"]["rows"]] == [3, 11, None]
    assert run["about"] == [["environment.txt", f"command {meadow.EVIL}\n"]]
    assert bare["scenery"] is None and run["scenery"]["high"] == [8.0, 4.0]
    assert [panel["score"]["word"] for panel in described["panels"]] == ["success", "return"]
    assert len(described["panels"][0]["curves"][0]["seeds"]) == 2


def test_what_a_run_began_with_stands_first():
    run = meadow.a_run(meadow.Meadow())
    run.config = dataclasses.replace(run.config, skills_from=Origin(meadow.EVIL, 3, "ab", 2000))
    (heading, text), *_ = contents._about(run)
    cost = "which had cost 2 k steps per seed that are not counted here"
    evil = one_line(meadow.EVIL)
    assert (heading, text) == ("beginning", f"began with skills of {evil} (generation 3), {cost}")
    # The figure of the curve says it too, in its title.
    run.algorithm.label = "Walkers"
    title, *below = report._title_of_curve(run).split("\n")
    assert title == f"Walkers on {run.algorithm.env.name}" and " ".join(below) == text and len(below) > 1


def test_shares_are_those_of_the_evaluation(described):
    choices = meadow.contents().evaluation.choices[0]
    arrays = unpack(described["runs"][0]["shares"][0])
    running = choices[:, 3, 1] >= 0
    assert arrays["shares"][1, 0, 3] == round(1000 * (choices[running, 3, 1] == 0).mean())
    np.testing.assert_array_equal(arrays["running"], [1000, 1000, 1000, 667, 667, 667])

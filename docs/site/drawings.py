"""Draws the pictures of the concepts page: `python docs/site/drawings.py` writes them into docs/images."""

from pathlib import Path

IMAGES = Path(__file__).parents[1] / "images"

# An image knows the system's scheme but not the page's, so that it brings its own ground.
STYLE = """
  .ground { fill: #ffffff; stroke: #d0d4dc; } .panel { fill: #f5f6f8; }
  text { font: 15px system-ui, sans-serif; fill: #1f2430; }
  .small { font-size: 13px; } .quiet { fill: #5a6170; }
  .head { font-weight: 700; } .middle { text-anchor: middle; }
  .box { fill: #ffffff; stroke-width: 2; } .evolved { stroke: #b35900; } .learns { stroke: #0b6fb8; }
  .world { stroke: #4d5566; } .none { stroke: #aab0bb; stroke-dasharray: 5 4; }
  .team { fill: #b35900; } .local { fill: #0b6fb8; }
  .flow { stroke: #4d5566; stroke-width: 2; fill: none; } .tip { fill: #4d5566; }
  .paid-team { stroke: #b35900; stroke-width: 2; fill: none; }
  .paid-local { stroke: #0b6fb8; stroke-width: 2; fill: none; }
  @media (prefers-color-scheme: dark) {
    .ground { fill: #1e2129; stroke: #3a404d; } .panel { fill: #272b35; } .box { fill: #1e2129; }
    text { fill: #e6e9ef; } .quiet { fill: #aab2c0; }
    .evolved, .paid-team { stroke: #f0a04b; } .learns, .paid-local { stroke: #5db5f5; }
    .team { fill: #f0a04b; } .local { fill: #5db5f5; }
    .world, .flow { stroke: #b6bdc9; } .tip { fill: #b6bdc9; } .none { stroke: #6b7280; }
  }
"""


def svg(width, height, title, parts):
    """A whole picture on its ground."""
    tips = "".join(
        f'<marker id="{name}" viewBox="0 0 10 10" refX="9" refY="5" markerWidth="6" markerHeight="6" '
        f'orient="auto-start-reverse"><path class="{fill}" d="M0 0L10 5L0 10z"/></marker>'
        for name, fill in (("tip", "tip"), ("tip-team", "team"), ("tip-local", "local"))
    )
    ground = f'<rect class="ground" x="1" y="1" width="{width - 2}" height="{height - 2}" rx="10"/>'
    body = "\n".join([f"<style>{STYLE}</style>", f"<defs>{tips}</defs>", ground, *parts])
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" '
        f'viewBox="0 0 {width} {height}" role="img">\n<title>{title}</title>\n{body}\n</svg>\n'
    )


def text(x, y, words, kind=""):
    """One line of words."""
    return f'<text class="{kind}" x="{x}" y="{y}">{words}</text>'


def box(x, y, width, height, kind, *lines):
    """A box with lines in its middle, the first of them bold."""
    first = y + height / 2 - 9 * (len(lines) - 1) + 5
    rows = [
        text(x + width / 2, first + 18 * n, line, "middle " + ("head" if n == 0 else "small"))
        for n, line in enumerate(lines)
    ]
    return "\n".join(
        [f'<rect class="box {kind}" x="{x}" y="{y}" width="{width}" height="{height}" rx="8"/>', *rows]
    )


def arrow(path, kind="flow", tip="tip"):
    """A line with a tip at its end."""
    return f'<path class="{kind}" d="{path}" marker-end="url(#{tip})"/>'


def panel(x, y, name, evolved, learns, rewards, flows):
    """One algorithm: who evolves, who learns, what each is paid, what flows there and back."""
    team, local = rewards
    parts = [
        f'<rect class="panel" x="{x}" y="{y}" width="430" height="200" rx="8"/>',
        text(x + 16, y + 26, name, "head"),
        box(x + 16, y + 88, 150, 62, "evolved" if evolved else "none", *(evolved or ("nobody", "evolves"))),
        box(
            x + 264,
            y + 88,
            150,
            62,
            "learns" if learns else "none",
            *(learns or ("nobody", "learns by gradient")),
        ),
    ]
    if team:
        parts += [
            text(x + 91, y + 56, team, "small middle team"),
            arrow(f"M{x + 91} {y + 62}V{y + 84}", "paid-team", "tip-team"),
        ]
    if local:
        kind = "team" if local.startswith("team") else "local"
        parts += [
            text(x + 339, y + 56, local, f"small middle {kind}"),
            arrow(f"M{x + 339} {y + 62}V{y + 84}", f"paid-{kind}", f"tip-{kind}"),
        ]
    there, back, said = flows
    if there:
        parts += [arrow(f"M{x + 170} {y + 108}H{x + 260}"), text(x + 215, y + 100, there, "small middle")]
    if back:
        parts += [arrow(f"M{x + 260} {y + 132}H{x + 170}"), text(x + 215, y + 149, back, "small middle")]
    return "\n".join([*parts, text(x + 215, y + 184, said, "small middle quiet")])


def four_choices():
    """Six algorithms, told apart by the four choices."""
    selectors, skills, actors = (
        ("selectors", "in teams"),
        ("skills", "shared by all (TD3)"),
        ("actors", "in teams"),
    )
    rows = [
        (
            "MADyS, MADyS+",
            selectors,
            skills,
            ("team reward", "local reward of each"),
            ("experience", "skills", "both at the same time"),
        ),
        (
            "MFL",
            selectors,
            skills,
            ("team reward", "local reward of each"),
            ("", "skills, once", "skills first, then the teams"),
        ),
        ("EA, CCEA", actors, None, ("team reward", ""), ("", "", "primitive actions, no skills")),
        (
            "MERL",
            actors,
            ("an actor", "for each agent (TD3)"),
            ("team reward", "one local reward"),
            ("experience", "actors", "learners migrate into the population"),
        ),
        (
            "ERL, CERL",
            ("actors", "of the whole team"),
            ("such actors", "one (ERL) or several"),
            ("team reward", "team reward"),
            ("experience", "actors", "learners migrate into the population"),
        ),
        (
            "MADDPG, IPPO, MAPPO, …",
            None,
            ("policies", "of all agents"),
            ("", "team or local reward"),
            ("", "", "over actions; IPPO and MAPPO also over skills"),
        ),
    ]
    parts = [
        text(20, 34, "Four choices make an algorithm", "head"),
        text(
            20,
            56,
            "Left: who evolves. Right: who learns by gradient. Above: on which reward. Between: what flows.",
        ),
    ]
    parts += [panel(20 + 445 * (n % 2), 74 + 212 * (n // 2), *row) for n, row in enumerate(rows)]
    return svg(915, 74 + 212 * 3 + 8, "Six groups of algorithms, told apart by the four choices", parts)


def which_reward():
    """Who sees which reward in MADyS, and how a step is made of it."""
    parts = [
        text(24, 38, "Who sees which reward, in MADyS", "head"),
        box(30, 80, 210, 84, "evolved", "evolution", "M teams of selectors,", "one for each agent"),
        box(30, 290, 210, 84, "learns", "TD3", "K skills, one for each", "local reward"),
        box(380, 180, 180, 94, "world", "an agent's step", "selector picks a skill,", "the skill acts"),
        box(690, 180, 190, 94, "world", "the world", "N agents,", "observations"),
        arrow("M240 130C320 130 310 206 376 206"),
        text(300, 150, "selectors", "small"),
        arrow("M240 318C320 318 310 250 376 250"),
        text(306, 306, "skills", "small"),
        arrow("M560 214H688"),
        text(624, 204, "action", "small middle"),
        arrow("M688 244H562"),
        text(624, 264, "observation", "small middle"),
        arrow("M785 178V104H246", "paid-team", "tip-team"),
        text(470, 92, "team reward g: 1 once the whole task is done, else 0", "middle small team"),
        arrow("M785 276V352H562", "paid-local", "tip-local"),
        box(400, 322, 160, 62, "learns", "replay buffer", "all teams, all agents"),
        text(672, 374, "K local rewards at every step,", "middle small local"),
        text(672, 392, "such as: how close is A?", "middle small local"),
        arrow("M400 360H244", "paid-local", "tip-local"),
        text(
            24, 424, "The two never mix: no gradient sees g, and no selection sees a local reward.", "quiet"
        ),
    ]
    return svg(915, 446, "The team reward goes to evolution alone, local rewards to the skills alone", parts)


if __name__ == "__main__":
    (IMAGES / "four-choices.svg").write_text(four_choices())
    (IMAGES / "which-reward.svg").write_text(which_reward())

"""What the page shows, as plain values: learning curves, scores, chosen skills, episodes, configuration."""

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Int

from skillcrew.analysis.page.colours import both_grounds, colours_of_choices
from skillcrew.analysis.page.packing import pack
from skillcrew.analysis.page.panels import Curves, Line, describe_score, panels
from skillcrew.analysis.page.scenery import describe_scene, pack_episodes
from skillcrew.analysis.skill_figures import readable_skill
from skillcrew.analysis.statistics import skill_shares
from skillcrew.envs.offers import OffersSkillTexts, offers, unwrapped
from skillcrew.envs.padded import types_of_agents
from skillcrew.experiment.evaluation import Evaluation
from skillcrew.experiment.files import read_plain
from skillcrew.experiment.recording import Shown
from skillcrew.experiment.run import Run

SHARE_STEPS = 1000
"""Of a share of episodes, from 0 to 1."""


BEGINNING = "beginning"
"""Heads what a run began with, where it began with a part of another; stands open, as the script knows."""


@dataclasses.dataclass(frozen=True)
class RunContents:
    """What is known of one run."""

    run: Run
    name: str
    """Tells it from the others on the page."""
    evaluation: Evaluation
    curves: Curves | None
    """None where its metrics are lost."""
    shown: Sequence[Shown]


@dataclasses.dataclass(frozen=True)
class Pooled:
    """The curve of several runs of one algorithm in one environment, over the seeds of all of them."""

    runs: tuple[int, ...]
    """Their places among the runs of the page."""
    curves: Curves


def describe(runs: Sequence[RunContents], pooled: Sequence[Pooled], title: str) -> dict[str, Any]:
    """Everything on the page, ready for JSON."""
    return {
        "title": title,
        "panels": _panels(runs, pooled),
        "runs": [_run(one) for one in runs],
    }


def _panels(runs: Sequence[RunContents], pooled: Sequence[Pooled]) -> list[dict[str, Any]]:
    lines = {
        index: Line(one.run.algorithm.env.name, one.name, one.curves)
        for index, one in enumerate(runs)
        if one.curves is not None
    }
    together = []
    for many in pooled:
        label = f"{many.curves.even.label}, {len(many.runs)} runs"
        environment = runs[many.runs[0]].run.algorithm.env.name
        together.append((many.runs, Line(environment, label, many.curves)))
    return panels(lines, together)


def _run(one: RunContents) -> dict[str, Any]:
    algorithm, evaluation = one.run.algorithm, one.evaluation
    env, skills = algorithm.env, algorithm.choices()
    types = types_of_agents(env)
    scenes = [shown.recording.scene for shown in one.shown]
    scene = scenes[0] if scenes else None
    return {
        "name": one.name,
        "algorithm": algorithm.label,
        "environment": env.name,
        "agents": [
            {"type": env.types[types[index]].name if types else None} for index in range(env.n_agents)
        ],
        "skills": _skills(env, skills),
        "score": describe_score(evaluation.score),
        "scores": _scores(evaluation),
        "shares": [
            {"seed": seed, **_shares(choices, len(skills))}
            for seed, choices in zip(evaluation.seeds, evaluation.choices, strict=True)
        ],
        "scenery": None if scene is None else describe_scene(scene, skills),
        "replays": [pack_episodes(shown) for shown in one.shown],
        "steps": one.run.config.steps,
        "about": _about(one.run),
    }


def _skills(env: Any, skills: Sequence[str]) -> list[dict[str, Any]]:
    texts = unwrapped(env).skill_texts if offers(env, OffersSkillTexts) else {}
    colours = colours_of_choices(skills)
    return [
        {"name": readable_skill(name), "text": str(texts.get(name, "")), "colour": both_grounds(colour)}
        for name, colour in zip(skills, colours, strict=True)
    ]


def _scores(evaluation: Evaluation) -> dict[str, Any]:
    """Each seed's score, and that of all of them where there are several."""
    score = evaluation.score
    reached = [*zip(evaluation.seeds, evaluation.per_seed, strict=True)]
    if len(reached) > 1:
        reached.append((None, evaluation.overall))
    rows = [{"seed": seed, "text": score.range(interval)} for seed, interval in reached]
    return {"episodes": evaluation.episodes, "rows": rows}


def _shares(choices: Int[np.ndarray, "episodes time agents"], n_skills: int) -> dict[str, Any]:
    """How often each skill was chosen, [agents, skills, time], and in how many episodes, [time]."""
    shares, running = skill_shares(choices, n_skills)
    lived = int(np.flatnonzero(running)[-1]) + 1
    steps = np.rint(np.nan_to_num(shares[:lived]) * SHARE_STEPS).astype(int)
    of = np.rint(running[:lived] / len(choices) * SHARE_STEPS).astype(int)
    return pack({"shares": steps.transpose(1, 2, 0), "running": of})


def _about(run: Run) -> list[list[str]]:
    """What the run folder says of itself: what it began with, and each file's name and text."""
    files = (run.folder.config, run.folder.path / "environment.txt", run.folder.timing)
    texts = [[path.name, text] for path in files if (text := _text(path)) is not None]
    began = "\n".join(run.config.origins())
    return [[BEGINNING, began], *texts] if began else texts


def _text(path: Path) -> str | None:
    try:
        return read_plain(path)
    except (OSError, UnicodeDecodeError):
        return None

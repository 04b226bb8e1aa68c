"""Runs that begin with the skills or the team of another: what is read of that, and what it is made into."""

import contextlib
import dataclasses
from collections.abc import Callable, Generator
from pathlib import Path
from typing import Any

import jax
import numpy as np
from jaxtyping import Int, PyTree

from skillcrew.algorithms.algorithm import Algorithm
from skillcrew.algorithms.warm_start import SkillTransfer, team_between
from skillcrew.errors import UserError
from skillcrew.experiment import generation
from skillcrew.experiment.checkpoints import Checkpoints, instead
from skillcrew.experiment.config import RunConfig, from_yaml
from skillcrew.experiment.folder import RunFolder
from skillcrew.experiment.generation import RunState
from skillcrew.experiment.integrity import check_known, fingerprint
from skillcrew.experiment.metrics import read_metrics
from skillcrew.experiment.origin import Origin
from skillcrew.experiment.score import score_among

Begin = Callable[[RunState], RunState]
"""From all seeds' states before the first generation to those that they begin with."""

SKILLS, TEAM, STEPS = ".algorithm.skills.learners", ".team", ".environment_steps"
"""Parts of a run's state."""


class Source:
    """Another run, as one that begins with a part of it sees it.

    Args:
        origin: which, and which of its checkpoints.
        trust: whether to import its environment's class from wherever its folder says.
        note: is told what is used in the place of something damaged.

    Raises:
        UserError: no run, no checkpoint, another one than the origin knows, or one that cannot be read.
    """

    def __init__(self, origin: Origin, trust: bool, note: Callable[[str], None]):
        self._folder = RunFolder(Path(origin.run))
        self._folder.check_is_run()
        check_known(self._folder.config, "restore it")
        self.algorithm, self.config = from_yaml(self._folder.config, trust=trust)
        checkpoints = Checkpoints(self._folder.checkpoints)
        if not checkpoints.generations():
            raise UserError("it has no finished checkpoint yet; wait for the first, or resume it")
        self._checkpoint, damaged = checkpoints.choose(origin.checkpoint)
        for line in damaged:
            note(instead(line, self._checkpoint))
        digest = fingerprint(self._folder.checkpoints / str(self._checkpoint))
        if origin.digest not in (None, digest):
            raise UserError(
                f"its checkpoint {self._checkpoint} is another one than this configuration knows; leave "
                "digest and checkpoint out to take what is there"
            )
        self._like = generation.shapes(self.algorithm, self.config)
        self._arrays, _ = checkpoints.read(self._like, self._checkpoint)
        self.origin = Origin(origin.run, self._checkpoint, digest, self._cost())

    def part(self, name: str, seeds: int) -> PyTree:
        """A part of its state for so many seeds.

        Each of ours has its own of theirs if there are as many, else all have the one with the best champion.
        """
        which = self._which(seeds)
        whole = generation.from_flat_arrays(self._arrays, self._like, name)
        return jax.tree.map(lambda leaf: leaf[which], whole)

    def _which(self, seeds: int) -> Int[np.ndarray, " seeds"]:
        theirs = self.config.seeds
        if seeds == len(theirs):
            return np.arange(seeds)
        if len(theirs) == 1:
            return np.zeros(seeds, int)
        columns = read_metrics(self._folder.metrics)
        scores = columns[score_among(columns).key]
        now = columns["generation"] == self._checkpoint
        reached = [scores[now & (columns["seed"] == seed)] for seed in theirs]
        if not all(len(rows) for rows in reached):
            raise UserError(f"{self._folder.metrics}: has no rows of generation {self._checkpoint}")
        return np.full(seeds, int(np.argmax([rows[0] for rows in reached])))

    def _cost(self) -> int:
        lived = generation.from_flat_arrays(self._arrays, self._like, STEPS)
        before = {origin for origin in (self.config.skills_from, self.config.team_from) if origin}
        return int(np.asarray(lived).max()) + sum(origin.steps or 0 for origin in before)


def prepare(
    algorithm: Algorithm, config: RunConfig, trust: bool, note: Callable[[str], None]
) -> tuple[RunConfig, Begin | None]:
    """Reads the runs that a configuration begins with.

    Args:
        trust: whether to import classes of their environments from wherever their folders say.
        note: is told what is taken over.

    Returns:
        The configuration with the checkpoints that were read, and what makes the states of its beginning;
        None if it begins with nothing.

    Raises:
        UserError: one of them cannot be read, or does not fit.
    """
    sources: dict[Origin, Source] = {}

    def source_of(origin: Origin) -> Source:
        if origin not in sources:
            sources[origin] = Source(origin, trust, note)
        return sources[origin]

    seeds, known = len(config.seeds), {}
    transfer, learners, selectors = None, None, None
    if origin := config.skills_from:
        with _said_of("skills_from", origin):
            source = source_of(origin)
            transfer = SkillTransfer.between(algorithm, source.algorithm)
            learners = source.part(SKILLS, seeds)
        known["skills_from"] = source.origin
        note(_taken(algorithm, transfer, origin))
    if origin := config.team_from:
        with _said_of("team_from", origin):
            source = source_of(origin)
            theirs = team_between(algorithm, source.algorithm)
            selectors = jax.vmap(theirs.selectors)(source.part(TEAM, seeds))
        known["team_from"] = source.origin
        if transfer is None:
            note("The team begins with random skills; skills_from gives it those that it was evolved with.")
    if not known:
        return config, None
    begin = _beginning(algorithm, transfer, config.skills_frozen, learners, selectors)
    return dataclasses.replace(config, **known), begin


def _beginning(
    algorithm: Any, transfer: SkillTransfer | None, frozen: bool, learners: PyTree, selectors: PyTree
) -> Begin:
    """What puts another run's learners and selectors, of each seed, into the place of fresh ones."""

    def of_seed(run: RunState, learners: PyTree, selectors: PyTree) -> RunState:
        state = run.algorithm
        if transfer is not None:
            skills = transfer.begin(state.skills, learners, frozen)
            state = dataclasses.replace(state, skills=skills)
        if selectors is not None:
            state = algorithm.begin_around(state, selectors)
        begun = dataclasses.replace(run, algorithm=state, team=algorithm.team(state))
        return generation.as_restored(begun)

    def begin(runs: RunState) -> RunState:
        given = runs, learners, selectors
        return generation.compiled(jax.vmap(of_seed), *given)(*given)

    return begin


@contextlib.contextmanager
def _said_of(field: str, origin: Origin) -> Generator[None]:
    """Says in every line on a mistake which option and run it is about."""
    try:
        yield
    except UserError as error:
        raise UserError(f"{field} = {origin.run}: {error}") from error


def _taken(algorithm: Algorithm, transfer: SkillTransfer, origin: Origin) -> str:
    """A line on which skills are taken over."""
    new = [name for name in algorithm.choices() if name not in transfer.names]
    fresh = f"; at random: {', '.join(new)}" if new else ""
    lost = f"; {len(transfer.lost)} numbers that they saw there count as 0" if transfer.lost else ""
    return f"From {origin.run}: {', '.join(transfer.names)}{fresh}{lost}."

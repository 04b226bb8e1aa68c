"""A run as users hold it: train, go on, score, and take its champions."""

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, UInt32

from skillcrew.algorithms.algorithm import Algorithm
from skillcrew.envs.environment import Environment
from skillcrew.errors import UserError
from skillcrew.experiment import device_memory, generation, memory, warm_start
from skillcrew.experiment.config import MOST_AT_ONCE, RunConfig, from_yaml, to_yaml
from skillcrew.experiment.evaluation import Evaluation
from skillcrew.experiment.folder import RunFolder
from skillcrew.experiment.generation import RunState
from skillcrew.experiment.integrity import check_known, write_known
from skillcrew.experiment.metrics import Columns, read_metrics
from skillcrew.experiment.origin import Origin
from skillcrew.experiment.ownership import owned
from skillcrew.experiment.progress import Reporter, SilentReporter
from skillcrew.experiment.runner import Runner
from skillcrew.experiment.trackers.tracking import Tracking, lent
from skillcrew.experiment.warm_start import Begin
from skillcrew.policies.team import Team
from skillcrew.policies.team_by_type import TeamByType


class Run:
    """A trained (or half-trained) run, read from its folder.

    Args:
        folder: of a run.
        env: the environment, if it is at hand.
        trust: whether to import the class of its environment from wherever the folder says. That runs its
            code: without, only classes that skillcrew or an installed package's entry point offers are
            imported.
        checkpoint: generation to read champions from and to go on from; by default the latest.
        champions: spares reading them, where they are at hand.

    Raises:
        UserError: no run folder, or its configuration is not valid.
    """

    def __init__(
        self,
        folder: Path | str,
        env: Environment | None = None,
        checkpoint: int | None = None,
        champions: Team | None = None,
        trust: bool = False,
    ):
        self.folder = RunFolder(folder)
        self.folder.check_is_run()
        check_known(self.folder.config, "restore it")
        self.algorithm, self.config = from_yaml(self.folder.config, env, trust)
        self._checkpoint = checkpoint
        self._trust = trust
        self._champions = champions

    def metrics(self) -> Columns:
        """One row per seed and generation, as named columns."""
        return read_metrics(self.folder.metrics)

    def champion(self, seed: int) -> Team | TeamByType:
        """The champion of one seed, at its last generation within the budget of steps.

        Where agents differ, it takes and gives dictionaries, as the environment does.

        Raises:
            UserError: the run has no such seed, or no checkpoint.
        """
        index = self.index_of(seed)
        team = jax.tree.map(lambda leaf: leaf[index], self.champions())
        types = self.algorithm.env.types
        return TeamByType(team, types, self.algorithm.env.choices) if types else team

    def index_of(self, seed: int) -> int:
        """The place of a seed among those of the run.

        Raises:
            UserError: the run has no such seed.
        """
        if seed not in self.config.seeds:
            raise UserError(
                f"seed {seed}: not of this run, which has {', '.join(map(str, self.config.seeds))}"
            )
        return self.config.seeds.index(seed)

    def evaluate(self, episodes: int = 1000) -> Evaluation:
        """Plays every seed's champion on fresh episodes, without exploration noise.

        No selection ever saw the episodes. Each seed has worlds of its own, so that an interval over
        seeds includes what the choice of worlds leaves open; the same seed has the same ones in all runs
        of an environment, so that methods can be compared seed by seed.
        """
        if not 1 <= episodes <= MOST_AT_ONCE:
            raise UserError(f"episodes = {episodes}: give a number from 1 to {MOST_AT_ONCE}")

        def play(team: Team, seed: UInt32[Array, ""]) -> Any:
            key = generation.stream(seed, generation.EVALUATION)
            played = generation.play(self.algorithm, team, key, episodes)
            choices = jnp.where(played.mask[..., None], played.choice, -1)
            return played.team_return(), choices, played.completed()

        of_all = self.champions(), generation.seeds_of(self.config)
        returns, choices, completed = generation.compiled(jax.vmap(play), *of_all)(*of_all)
        return Evaluation(
            self.config.seeds,
            episodes,
            np.asarray(returns, float),
            np.moveaxis(np.asarray(choices), 1, 2),
            None if self.algorithm.env.success is None else np.asarray(completed),
        )

    def resume(
        self,
        steps: float | int | None = None,
        reporter: Reporter | None = None,
        tracking: Tracking | None = None,
        **session: Any,
    ) -> "Run":
        """Goes on from the latest checkpoint, to the same bits as if never interrupted.

        Args:
            steps: a larger budget than the run had, to train on. What a seed lived beyond its old
                budget kept no champion of its own: if the new budget ends within that, the old
                budget's champion stays.
            tracking: what goes on with its records and stays open; by default that of its trackers, of which
                those that are not installed here are left out.
            session: another `max_seconds`, `warning_signal`, `on_bad_numbers` or `trackers` than it has had.

        Raises:
            UserError: no or damaged checkpoints, another process trains in the folder, or it cannot be
                written.
            Interrupted: on Ctrl-C, after saving.
        """
        self.folder.check_own()
        config = dataclasses.replace(self.config, **session)
        if steps is not None:
            config = dataclasses.replace(config, steps=round(steps))
            if config.steps < self.config.steps:
                raise UserError(f"steps = {config.steps}: less than the run's budget of {self.config.steps}")
        device_memory.check(memory.estimate(self.algorithm, config))
        reporter = reporter or SilentReporter()
        required, begin = "trackers" in session, self._begin(config, reporter)
        with (
            lent(tracking, config.trackers, reporter.note, required) as tracking,
            owned(self.folder.path),
        ):
            runner = Runner(self.algorithm, config, self.folder, reporter, tracking, begin)
            state = runner.restore(self._checkpoint)
            text = to_yaml(self.algorithm, config)
            if config != self.config:
                write_known(self.folder.config, lambda path: path.write_text(text))
            self.config = config
            tracking.open(self.folder.path, text, config.seeds)
            self._champions = runner.run(state).team
        return self

    def _begin(self, config: RunConfig, reporter: Reporter) -> Begin | None:
        """What a run begins with that was stopped before its first checkpoint: read when it is needed."""
        if config.skills_from is None and config.team_from is None:
            return None

        def begin(fresh: RunState) -> RunState:
            _, begin = warm_start.prepare(self.algorithm, config, self._trust, reporter.note)
            return begin(fresh) if begin else fresh

        return begin

    def champions(self) -> Team:
        """Every seed's champion; leaves have a leading seed axis."""
        if self._champions is None:
            runner = Runner(self.algorithm, self.config, self.folder, SilentReporter())
            self._champions = runner.champions(self._checkpoint)
        return self._champions


def train(
    algorithm: Algorithm,
    seeds: int | Sequence[int] = 1,
    steps: float | int = 2e6,
    out: Path | str | None = None,
    reporter: Reporter | None = None,
    tracking: Tracking | None = None,
    skills_from: Path | str | Origin | None = None,
    team_from: Path | str | Origin | None = None,
    trust: bool = False,
    **options: Any,
) -> Run:
    """Trains one run per seed, all in one program, into a new folder.

    Args:
        algorithm: such as `MADyS(env, population=60)`.
        seeds: how many (0, 1, …), or which.
        steps: environment steps per seed.
        out: the run's folder; by default `runs/<algorithm>-<environment>`, numbered if it exists.
        tracking: what keeps records and stays open; by default that of `trackers`, one of the options.
        skills_from: folder of a run whose skills are taken over, those of the same names.
        team_from: folder of a run whose champions the search begins around.
        trust: whether to import the environments' classes of these two from wherever they say. That runs
            their code.
        options: other fields of `RunConfig`.

    Raises:
        UserError: a value out of range, a run to begin with that does not fit, an existing folder, too little
            memory, a tracker that is not installed, a disk that cannot be written.
        Interrupted: on Ctrl-C, after saving.
    """
    chosen = tuple(range(seeds)) if isinstance(seeds, int) else tuple(seeds)
    options = {**options, "skills_from": Origin.of(skills_from), "team_from": Origin.of(team_from)}
    config = RunConfig(seeds=chosen, steps=round(steps), **options)
    reporter = reporter or SilentReporter()
    needed = memory.estimate(algorithm, config)
    free = device_memory.available()
    reporter.note(
        f"Needs about {device_memory.in_gib(needed)} of memory, of {device_memory.in_gib(free)} free."
    )
    device_memory.check(needed)
    config, begin = warm_start.prepare(algorithm, config, trust, reporter.note)
    folder, text = RunFolder(out if out is not None else free_folder(algorithm)), to_yaml(algorithm, config)
    with lent(tracking, config.trackers, reporter.note) as tracking:
        folder.create(text)
        runner = Runner(algorithm, config, folder, reporter, tracking, begin)
        with owned(folder.path):
            tracking.open(folder.path, text, config.seeds)
            champions = runner.run(runner.start()).team
    return Run(folder.path, algorithm.env, champions=champions)


def free_folder(algorithm: Algorithm, parent: Path = Path("runs")) -> Path:
    """A folder name that is not taken yet."""
    name = f"{algorithm.name}-{algorithm.env.name}"
    number = 1
    while (path := parent / (name if number == 1 else f"{name}-{number}")).exists():
        number += 1
    return path

"""Runs chunks of jitted generations, and sees to progress, metrics, checkpoints and Ctrl-C."""

import dataclasses
import json
import math
import time
import warnings
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from skillcrew.algorithms.algorithm import Algorithm
from skillcrew.errors import Notice, UserError
from skillcrew.experiment import generation
from skillcrew.experiment.checkpoints import Checkpoints, instead
from skillcrew.experiment.config import RunConfig
from skillcrew.experiment.files import read_plain, write_whole
from skillcrew.experiment.folder import RunFolder
from skillcrew.experiment.generation import RunState
from skillcrew.experiment.health import check_counts, first_bad
from skillcrew.experiment.interrupts import Interrupts, watch_interrupts
from skillcrew.experiment.metrics import MetricsLog, read_metrics
from skillcrew.experiment.progress import Reporter
from skillcrew.experiment.score import score_of
from skillcrew.experiment.session import Session
from skillcrew.experiment.trackers.tracking import Tracking
from skillcrew.experiment.warm_start import Begin
from skillcrew.policies.team import Team

MOST_ROLL_BACKS = 3
"""To the same checkpoint: who never gets any further has another trouble than bad luck."""


class Interrupted(Exception):
    """The run was stopped on request, after everything was saved."""


class Runner:
    """Drives one run from where its state is to the end of its budget.

    Args:
        algorithm: made for its environment.
        config: of the run; `steps` may be more than it was before.
        folder: exists already.
        reporter: told about progress.
        tracking: told what is saved; by default nobody is.
        begin: what makes the states of its beginning, where it begins with a part of another run.
    """

    def __init__(
        self,
        algorithm: Algorithm,
        config: RunConfig,
        folder: RunFolder,
        reporter: Reporter,
        tracking: Tracking | None = None,
        begin: Begin | None = None,
    ):
        self.algorithm = algorithm
        self.config = config
        self.folder = folder
        self.reporter = reporter
        self._tracking = tracking or Tracking((), reporter.note)
        self._begin = begin
        self._log = MetricsLog(config.seeds)
        self._rolled_back = 0
        self._checkpoints = Checkpoints(folder.checkpoints, config.keep)

    def start(self) -> RunState:
        """The state before the first generation.

        Where it begins with a part of another run, it is saved at once: that run is not asked for again.
        """
        fresh = self._fresh()
        if self._begin is None:
            return fresh
        state = self._begin(fresh)
        self._checkpoints.save(0, state, -math.inf, self.config.save_buffer)
        return state

    def _fresh(self) -> RunState:
        seeds = generation.seeds_of(self.config)
        begin = jax.vmap(lambda seed: generation.initial_state(self.algorithm, seed))
        return generation.compiled(begin, seeds)(seeds)

    def restore(self, checkpoint: int | None = None) -> RunState:
        """The state of a checkpoint, by default the latest, with the metrics up to it."""
        if not self._checkpoints.generations():
            self.reporter.note("No checkpoint was finished yet: starts from the beginning.")
            return self.start()
        like = generation.shapes(self.algorithm, self.config)
        checkpoint, damaged = self._checkpoints.choose(checkpoint)
        for line in damaged:
            self.reporter.note(instead(line, checkpoint))
        arrays, has_buffer = self._checkpoints.read(like, checkpoint)
        if not has_buffer:
            self.reporter.note(
                "This checkpoint holds no replay buffer: the run goes on with an empty one, and ends "
                "otherwise than an uninterrupted run would have."
            )
            arrays = {**generation.flat_arrays(self._fresh()), **arrays}
        state = generation.from_flat_arrays(arrays, like)
        reached = int(np.asarray(state.generation)[0])
        if self.folder.metrics.exists():
            self._log.restore(read_metrics(self.folder.metrics), reached)
        elif reached:
            self.reporter.note(
                f"{self.folder.metrics} is gone, and with it all rows up to generation {reached}."
            )
        self._checkpoints.discard_after(reached)
        self.reporter.note(f"Goes on from generation {reached}.")
        return self._with_champions_of_budget(state)

    def _with_champions_of_budget(self, state: RunState) -> RunState:
        """Where the budget has been raised, champions that it had kept back catch up."""
        within = state.environment_steps <= self.config.steps
        teams = jax.vmap(self.algorithm.team)(state.algorithm)

        def newest(new, old):
            return jnp.where(within.reshape(-1, *(1,) * (new.ndim - 1)), new, old)

        return dataclasses.replace(state, team=jax.tree.map(newest, teams, state.team))

    def champions(self, checkpoint: int | None = None) -> Team:
        """Every seed's champion of a checkpoint; leaves have a leading seed axis."""
        like = generation.shapes(self.algorithm, self.config)
        checkpoint, damaged = self._checkpoints.choose(checkpoint)
        for line in damaged:
            warnings.warn(instead(line, checkpoint), Notice, stacklevel=2)
        arrays, _ = self._checkpoints.read(like, checkpoint)
        return generation.from_flat_arrays(arrays, like, ".team")

    def run(self, state: RunState) -> RunState:
        """Steps until every seed has lived its budget, then saves.

        Raises:
            Interrupted: on a signal to stop or after `max_seconds`, once everything is saved.
            UserError: the disk has no room for a checkpoint, said before anything is compiled, or filled up;
                or a number is not finite.
        """
        # What a record has not: it is new, or what was to go there failed.
        self._tracking.record(self._log)
        if self._done(state):
            self.reporter.note("Nothing to do: every seed has lived its budget of steps.")
            return state
        self._checkpoints.check_room(state, self.config.save_buffer)
        compiled = self._compile(state)
        with watch_interrupts(self.config.warning_signal) as interrupts:
            session = Session(self._steps_lived(state), self.config.max_seconds)
            while not self._done(state):
                state, metrics, sound = self._up_to_report(compiled, state, session, interrupts)
                if not sound.all():
                    state = self._after_bad_numbers(compiled)
                    continue
                check_counts(self.algorithm, self.config, metrics)
                self._log.add(metrics)
                # Where its hanging up is the reason to stop, there is no terminal to report to.
                if not interrupts.requested:
                    self.reporter.update(metrics, session.recent_rate(self._steps_lived(state)))
                stops = interrupts.requested or session.is_over()
                if stops or self._done(state) or session.save_is_due(self.config.checkpoint_seconds):
                    self._save(state, metrics)
                    session.saved()
                elif session.rows_are_due():
                    with session.writing_rows():
                        self._log.write(self.folder.metrics)
                if stops and not self._done(state):
                    raise Interrupted
        self._note_timing(
            {"seconds": session.seconds(), "steps_per_second": session.rate(self._steps_lived(state))}
        )
        return state

    def _up_to_report(
        self, compiled: Callable[..., Any], state: RunState, session: Session, interrupts: Interrupts
    ) -> tuple[RunState, dict[str, np.ndarray], np.ndarray]:
        """The generations up to the next report, or up to a request to stop.

        Returns:
            The state after them, their metrics, and for each seed whether no number is NaN.
        """
        every = self.config.generations_per_report
        # Where a stop cut a report short, the next ones still come when they would have come.
        left = every - int(np.asarray(state.generation)[0]) % every
        parts: list[dict[str, np.ndarray]] = []
        sound = np.ones(len(self.config.seeds), bool)
        while left and sound.all() and not (parts and (interrupts.requested or session.is_over())):
            count = session.generations(left)
            state, metrics, is_sound = compiled(state, count)
            sound = np.asarray(is_sound)
            parts.append({name: np.asarray(values)[:, :count] for name, values in metrics.items()})
            session.lived(count)
            left -= count
        metrics = {name: np.concatenate([part[name] for part in parts], axis=1) for name in parts[0]}
        return state, metrics, sound

    def _after_bad_numbers(self, compiled: Callable[..., Any]) -> RunState:
        """The last good state, to go on from by other random numbers.

        Raises:
            UserError: that is not asked for, or was done often enough; says where the bad number came from.
        """
        # Rows that no checkpoint has yet are lived again.
        self._log = MetricsLog(self.config.seeds)
        self._rolled_back += 1
        if self.config.on_bad_numbers == "roll-back" and self._rolled_back <= MOST_ROLL_BACKS:
            self.reporter.note("A number is not finite: rolls back, and goes on by other random numbers.")
            return generation.with_other_keys(self.restore(), self._rolled_back)
        self.reporter.note("A number is not finite: lives again up to it, to find where it comes from.")
        raise self._bad_numbers(compiled, self.restore())

    def _bad_numbers(self, compiled: Callable[..., Any], state: RunState) -> UserError:
        """Lives again up to a bad number, saves the generation before it, and says what it is."""
        sound, metrics = np.ones(1, bool), None
        while sound.all() and not self._done(state):
            before, lived = jax.tree.map(jnp.copy, state), metrics
            state, measured, is_sound = compiled(state, 1)
            metrics = {name: np.asarray(values)[:, :1] for name, values in measured.items()}
            sound = np.asarray(is_sound)
            if sound.all():
                self._log.add(metrics)
        if lived is not None:
            self._save(before, lived)
        seed = int(np.argmin(sound))
        said = first_bad(self.algorithm, self.config, jax.tree.map(lambda leaf: leaf[seed], before))
        reached = int(np.asarray(before.generation)[0])
        return UserError(
            f"{self.folder.path}: generation {reached + 1}, seed {self.config.seeds[seed]}: {said}; "
            f"generation {reached} is kept: mend it and resume, or resume with --on-bad-numbers roll-back"
        )

    def _save(self, state: RunState, metrics: dict[str, np.ndarray]) -> None:
        # Metrics first: a resumed run drops rows after its checkpoint, but cannot make up missing ones.
        self._log.write(self.folder.metrics)
        reached = int(np.asarray(state.generation)[0])
        score = float(metrics[score_of(self.algorithm.env).key].mean())
        self._checkpoints.save(reached, state, score, self.config.save_buffer)
        # Records last: what they have is never lived again.
        self._tracking.record(self._log)
        self._rolled_back = 0

    def _done(self, state: RunState) -> bool:
        lived = np.asarray(state.environment_steps) >= self.config.steps
        # It ends with a report, so that one that was stopped on its way there ends where others do.
        reported = int(np.asarray(state.generation)[0]) % self.config.generations_per_report == 0
        return bool(lived.all()) and reported

    def _steps_lived(self, state: RunState) -> int:
        return int(np.asarray(state.environment_steps).astype(np.int64).sum())

    def _compile(self, state: RunState) -> generation.CompiledChunk:
        """The program of a chunk, and a note of how long it took to compile.

        Raises:
            UserError: it would take more memory than there is.
        """
        began = time.monotonic()
        compiled = generation.CompiledChunk(self.algorithm, self.config, state)
        seconds = time.monotonic() - began
        self.reporter.note(f"Compiled in {seconds:.1f} s.")
        self._note_timing({"compile_seconds": seconds})
        return compiled

    def _note_timing(self, entry: dict[str, float]) -> None:
        """Adds to the list of what took how long; each session of a resumed run has its own entries."""
        try:
            entries = json.loads(read_plain(self.folder.timing))
        except (OSError, ValueError, RecursionError):
            entries = []
        if not isinstance(entries, list):
            entries = []
        text = json.dumps([*entries, {name: round(value, 3) for name, value in entry.items()}], indent=1)
        write_whole(self.folder.timing, lambda path: path.write_text(text + "\n"))

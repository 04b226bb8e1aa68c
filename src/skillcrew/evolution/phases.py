"""Mutation and crossover that know what a timetable is: phases of a skill and a length each."""

import dataclasses
from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int, Key

from skillcrew.errors import UserError
from skillcrew.evolution.rules import nudge, set_rules


class Timetables(eqx.Module):
    """The timetables of a team; see `policies.timetable.Timetable`."""

    scores: Float[Array, "networks phases skills"]
    lengths: Float[Array, "networks phases"]


@dataclasses.dataclass(frozen=True)
class PhaseMutationConfig:
    """How a team's timetables change; each operator is applied with its own probability."""

    skill: float = 0.4
    """Probability that one phase, or two, get another skill."""
    copy: float = 0.2
    """Probability that a phase takes over the skill of a neighbour."""
    block: float = 0.2
    """Probability that several phases in a row get one skill."""
    shift: float = 0.2
    """Probability that all phases move up or down by one place or two."""
    length: float = 0.3
    """Probability that the border between two phases moves, and nothing else."""
    stretch: float = 0.2
    """Probability that a phase becomes longer or shorter, so that all later ones move."""
    teammate: float = 0.1
    """Probability that agents take over a teammate's timetable."""
    together: float = 0.75
    """Probability that a change is the whole team's, where each agent has a timetable of its own."""
    group: float = 0.15
    """Probability that it is that of all agents that follow the same; else it is that of a random part."""
    deviation: float = 0.4
    """Standard deviation of a change of length, in equal phases."""
    network: float = 0.0
    """Probability that weights of a reactive selector's network change, many of them by a little."""
    network_deviation: float = 1.0
    """Standard deviation of a change of one of its weights."""
    network_share: float = 0.1
    """Largest share of its weights that change, or one weight where that is less; each change draws its own
    share below it. 0: none."""
    rule: float = 1.0
    """Probability that a few weights of the network get another value, or none: a rule, say for a flag."""
    rule_deviation: float = 3.0
    """Standard deviation of such a value. It must outweigh a timetable, whose skill has a score of 1."""
    rule_share: float = 0.02
    """Largest share of its weights that get one, drawn as for `network_share`."""

    def __post_init__(self) -> None:
        for field in dataclasses.fields(self):
            value = getattr(self, field.name)
            if field.name.endswith("deviation"):
                if not 0 <= value < float("inf"):
                    raise UserError(f"phases.{field.name} = {value}: give a number of at least 0")
            elif not 0 <= value <= 1:
                raise UserError(f"phases.{field.name} = {value}: give a probability between 0 and 1")
        if self.together + self.group > 1:
            raise UserError(
                f"phases.together = {self.together} and phases.group = {self.group}: their sum is above 1; "
                "lower one of them"
            )


class PhaseVariation:
    """Varies genomes that consist of timetables, each with a network's weights behind it.

    Args:
        config: see there.
        networks: timetables in a genome.
        phases, skills: of each timetable.
    """

    def __init__(self, config: PhaseMutationConfig, networks: int, phases: int, skills: int):
        self.config = config
        self.networks, self.phases, self.skills = networks, phases, skills

    def crossover(
        self,
        key: Key[Array, ""],
        first: Float[Array, "children genes"],
        second: Float[Array, "children genes"],
    ) -> Float[Array, "children genes"]:
        """The first parent's phases up to a cut in time, the second's after it, at the times they had there.

        The cut leaves at least one phase of each; the networks are those of one of the two.
        """

        def of_child(key, first, second):
            key_cut, key_network = jax.random.split(key)
            (one, weights), (other, other_weights) = self._split(first), self._split(second)
            crossed = cut_in_time(jax.random.randint(key_cut, (), 1, max(self.phases, 2)), one, other)
            weights = jnp.where(jax.random.bernoulli(key_network), weights, other_weights)
            return self._join(crossed, weights)

        return jax.vmap(of_child)(jax.random.split(key, len(first)), first, second)

    def mutate(
        self, key: Key[Array, ""], genomes: Float[Array, "children genes"], judged: Bool[Array, ""]
    ) -> tuple[Float[Array, "children genes"], Bool[Array, " children"]]:
        """The children, and which of them changed.

        Args:
            judged: whether anybody was better than another. Where nobody is, no rules are given: they would
                pile up, and a search that is yet to begin would have left timetables behind.
        """
        keys = jax.random.split(key, len(genomes))
        children = jax.vmap(self._mutate, in_axes=(0, 0, None))(keys, genomes, judged)
        return children, (children != genomes).any(1)

    def _mutate(
        self, key: Key[Array, ""], genome: Float[Array, " genes"], judged: Bool[Array, ""]
    ) -> Float[Array, " genes"]:
        config = self.config
        timetables, weights = self._split(genome)
        rows = genome.reshape(self.networks, -1)
        kin = (rows[:, None] == rows[None]).all(2)
        operators: list[tuple[float, Callable]] = [
            (config.skill, lambda key, old: change_skills(key, old)),
            (config.copy, copy_neighbour),
            (config.block, set_block),
            (config.shift, shift),
            (config.length, lambda key, old: move_border(key, old, config.deviation)),
            (config.stretch, lambda key, old: stretch(key, old, config.deviation)),
        ]
        for probability, operator in operators:
            key, key_operator, key_who = jax.random.split(key, 3)
            changed = operator(key_operator, timetables)
            who = self._who(key_who, probability, kin)
            timetables = _where(who, changed, timetables)
        key_who, key_mate, key_network, key_rule = jax.random.split(key, 4)
        mate = jax.random.randint(key_mate, (), 0, self.networks)
        who = self._who(key_who, config.teammate, kin)
        timetables = _where(who, jax.tree.map(lambda leaf: leaf[mate][None], timetables), timetables)
        weights = jnp.where(who[:, None], weights[mate][None], weights)
        if weights.shape[1]:
            small = (config.network_share, config.network_deviation)
            weights = self._change_network(key_network, weights, kin, config.network, nudge, small)
            large = (config.rule_share, config.rule_deviation)
            ruled = self._change_network(key_rule, weights, kin, config.rule, set_rules, large)
            weights = jnp.where(judged, ruled, weights)
        return self._join(timetables, weights)

    def _who(
        self, key: Key[Array, ""], probability: float, kin: Bool[Array, "networks networks"]
    ) -> Bool[Array, " networks"]:
        """Whose timetables a change is: nobody's, everybody's, a group's, or a random part of the team's.

        Args:
            kin: who began with the same timetable as whom.
        """
        # One draw for all: each random operation of its own takes XLA long to compile.
        draw = jax.random.uniform(key, (4 + self.networks,))
        whether, scope, member, share = draw[:4]
        together, group = self.config.together, self.config.together + self.config.group
        some = (draw[4:] < share) | (draw[4:] == draw[4:].min())
        of_group = kin[jnp.floor(member * self.networks).astype(jnp.int32)]
        who = jnp.where(scope < together, True, jnp.where(scope < group, of_group, some))
        return who & (whether < probability)

    def _change_network(
        self,
        key: Key[Array, ""],
        weights: Float[Array, "networks weights"],
        kin: Bool[Array, "networks networks"],
        probability: float,
        change: Callable,
        size: tuple[float, float],
    ) -> Float[Array, "networks weights"]:
        """A change of weights, of a share and a deviation as `size` says, of whomever it is."""
        key_who, *keys = jax.random.split(key, 4)
        who = self._who(key_who, probability, kin)
        return jnp.where(who[:, None], change(keys, weights, *size), weights)

    def _split(self, genome: Float[Array, " genes"]) -> tuple[Timetables, Float[Array, "networks weights"]]:
        rows = genome.reshape(self.networks, -1)
        scores = self.phases * self.skills
        return (
            Timetables(
                rows[:, :scores].reshape(self.networks, self.phases, self.skills),
                rows[:, scores : scores + self.phases],
            ),
            rows[:, scores + self.phases :],
        )

    def _join(
        self, timetables: Timetables, weights: Float[Array, "networks weights"]
    ) -> Float[Array, " genes"]:
        scores = timetables.scores.reshape(self.networks, -1)
        return jnp.concatenate([scores, timetables.lengths, weights], axis=1).reshape(-1)


def cut_in_time(cut: Int[Array, ""], first: Timetables, second: Timetables) -> Timetables:
    """The first `cut` phases of one and the others of the other, which keep the times at which they end."""
    early = jnp.arange(first.lengths.shape[1])[None] < cut
    ends, later = (jnp.cumsum(jnp.maximum(each.lengths, 0.0), axis=1) for each in (first, second))
    ends = jax.lax.cummax(jnp.where(early, ends, later), axis=1)
    lengths = jnp.diff(ends, axis=1, prepend=0.0)
    return Timetables(jnp.where(early[:, :, None], first.scores, second.scores), lengths)


def change_skills(key: Key[Array, ""], old: Timetables) -> Timetables:
    """Another skill in one phase, or in two."""
    key_phase, key_skill = jax.random.split(key)
    _, phases, skills = old.scores.shape
    changed = jax.random.randint(key_phase, (2,), 0, phases)
    to = jax.random.randint(key_skill, (2,), 0, skills)
    scores = old.scores
    for phase, skill in zip(changed, to, strict=True):
        scores = _choose(scores, jnp.arange(phases) == phase, skill)
    return Timetables(scores, old.lengths)


def copy_neighbour(key: Key[Array, ""], old: Timetables) -> Timetables:
    """One phase takes over the skill of the phase before or after it."""
    key_phase, key_side = jax.random.split(key)
    phases = old.lengths.shape[1]
    phase = jax.random.randint(key_phase, (), 0, phases)
    side = jnp.where(jax.random.bernoulli(key_side), 1, -1)
    neighbour = jnp.clip(phase + side, 0, phases - 1)
    return Timetables(old.scores.at[:, phase].set(old.scores[:, neighbour]), old.lengths)


def set_block(key: Key[Array, ""], old: Timetables) -> Timetables:
    """One skill in all phases from one to another."""
    key_ends, key_skill = jax.random.split(key)
    _, phases, skills = old.scores.shape
    ends = jax.random.randint(key_ends, (2,), 0, phases)
    place = jnp.arange(phases)
    inside = (place >= ends.min()) & (place <= ends.max())
    return Timetables(_choose(old.scores, inside, jax.random.randint(key_skill, (), 0, skills)), old.lengths)


def shift(key: Key[Array, ""], old: Timetables) -> Timetables:
    """All phases one place or two earlier or later; the phase at the end that they leave is doubled."""
    key_by, key_side = jax.random.split(key)
    phases = old.lengths.shape[1]
    by = jax.random.randint(key_by, (), 1, 3) * jnp.where(jax.random.bernoulli(key_side), 1, -1)
    source = jnp.clip(jnp.arange(phases) - by, 0, phases - 1)
    return Timetables(old.scores[:, source], old.lengths[:, source])


def move_border(key: Key[Array, ""], old: Timetables, deviation: float) -> Timetables:
    """One phase longer and the next shorter by as much, or the other way round; a lone one stays as it is."""
    key_phase, key_by = jax.random.split(key)
    phases = old.lengths.shape[1]
    if phases == 1:
        return old
    phase = jax.random.randint(key_phase, (), 0, phases - 1)
    by = deviation * jax.random.normal(key_by)
    lengths = old.lengths
    # Neither becomes shorter than nothing.
    by = jnp.clip(by, -lengths[:, phase], lengths[:, phase + 1])
    place = jnp.arange(phases)
    moves = jnp.where(place == phase, 1.0, jnp.where(place == phase + 1, -1.0, 0.0))
    return Timetables(old.scores, lengths + by[:, None] * moves[None])


def stretch(key: Key[Array, ""], old: Timetables, deviation: float) -> Timetables:
    """One phase longer or shorter, and all after it later or earlier."""
    key_phase, key_by = jax.random.split(key)
    phases = old.lengths.shape[1]
    changed = jnp.arange(phases)[None] == jax.random.randint(key_phase, (), 0, phases)
    by = deviation * jax.random.normal(key_by)
    return Timetables(old.scores, jnp.where(changed, jnp.maximum(old.lengths + by, 0.0), old.lengths))


def _choose(
    scores: Float[Array, "networks phases skills"], where: Bool[Array, " phases"], skill: Int[Array, ""]
) -> Float[Array, "networks phases skills"]:
    chosen = (jnp.arange(scores.shape[-1]) == skill).astype(scores.dtype)
    return jnp.where(where[None, :, None], chosen[None, None], scores)


def _where(who: Bool[Array, " networks"], new: Timetables, old: Timetables) -> Timetables:
    return Timetables(
        jnp.where(who[:, None, None], new.scores, old.scores),
        jnp.where(who[:, None], new.lengths, old.lengths),
    )

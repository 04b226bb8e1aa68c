"""Search and rescue: a team that has to find victims, lift them together and bring them to a base."""

import dataclasses
from collections.abc import Mapping
from typing import ClassVar

import jax.numpy as jnp
from jaxtyping import Array, Float, Int, Key

from skillcrew.envs import carrying
from skillcrew.envs.environment import Environment, TimeStep
from skillcrew.envs.plane import Nearest, closeness, driven, either, offset
from skillcrew.envs.rescue.config import SKILL_TEXTS, RescueConfig
from skillcrew.envs.rescue.presets import PRESETS
from skillcrew.envs.rescue.scene import scene
from skillcrew.envs.rescue.search import next_cells, searched_from, to_cell
from skillcrew.envs.rescue.sensing import OBSERVATION_SIZE, Sensed, observation, sense
from skillcrew.envs.rescue.state import RescueState, draw_state
from skillcrew.envs.scene import Scene


class RescueDomain(Environment):
    """Agents that see a few metres far, victims that it takes several of them to carry, and a base.

    Everything is drawn anew at every reset. An action drives along its direction, at full speed if it is of
    length 1 or more; entries beyond [-1, 1] are clipped.
    """

    name = "rescue"
    success = "terminated"
    input_scaling = "symlog"
    config_class = RescueConfig
    presets = PRESETS
    skill_texts: ClassVar[Mapping[str, str]] = SKILL_TEXTS
    observation_size = OBSERVATION_SIZE
    action_size = 2

    def __init__(self, config: RescueConfig):
        self.config = config
        self.n_agents = config.n_agents
        self.episode_length = config.episode_length
        self.skills = config.skills

    def reset(self, key: Key[Array, ""]) -> tuple[RescueState, Float[Array, "agents obs"]]:
        state = draw_state(self.config, key)
        state = self._marked(state)
        return state, observation(sense(self.config, state))

    def step(
        self, state: RescueState, action: Float[Array, "agents 2"], key: Key[Array, ""]
    ) -> tuple[RescueState, TimeStep]:
        del key  # The domain is deterministic once drawn.
        return self._advance(state, action)

    def step_worlds(
        self, state: RescueState, action: Float[Array, "agents 2 worlds"], keys: Key[Array, " worlds"]
    ) -> tuple[RescueState, TimeStep]:
        del keys
        return self._advance(state, action)

    def counterfactual(self, state: RescueState) -> RescueState:
        """All of it: who bears a victim is slow."""
        return state

    def counterfactual_step(
        self,
        state: RescueState,
        other: RescueState,
        action: Float[Array, "agents 2"],
        key: Key[Array, ""],
        copies: Int[Array, " agents"],
    ) -> tuple[RescueState, Float[Array, ""]]:
        """See `OffersCounterfactuals`: copies of an agent hold what it holds, as additional hands.

        What is searched is left as it was, for nobody is paid for that.
        """
        del state, key
        after = self._moved(other, action, copies.astype(jnp.float32))
        return after, self._team_reward(other, after)

    def central_state(self, state: RescueState) -> Float[Array, " features"]:
        """Where all are as seen from the base, who holds whom, who is saved, what is searched, the time."""
        away = [
            jnp.ravel(place - jnp.broadcast_to(state.base[None], place.shape))
            for place in (state.position, state.victim)
        ]
        flags = [flag.ravel().astype(jnp.float32) for flag in (state.held, state.saved, state.searched)]
        return jnp.concatenate([state.base, *away, *flags, state.time[None] / self.episode_length])

    def scene(self, state: RescueState) -> Scene:
        """Agents, victims, the base, and what has been searched."""
        return scene(self.config, state)

    def _advance(
        self, state: RescueState, action: Float[Array, "agents 2 *worlds"]
    ) -> tuple[RescueState, TimeStep]:
        config = self.config
        after = self._marked(self._moved(state, action, jnp.ones(self.n_agents)))
        sensed = sense(config, after)
        terminated = after.saved.all(0)
        return after, TimeStep(
            observation=observation(sensed),
            local_rewards=self._local_rewards(sensed, self._progress(state, after)),
            team_reward=self._team_reward(state, after),
            terminated=terminated,
            truncated=(after.time >= config.episode_length) & ~terminated,
        )

    def _marked(self, state: RescueState) -> RescueState:
        """With what agents search where they are, and what is next for them."""
        searched = searched_from(self.config, state.position, state.searched)
        next_cell = next_cells(self.config, state.position, searched)
        return dataclasses.replace(state, searched=searched, next_cell=next_cell)

    def _moved(
        self, state: RescueState, action: Float[Array, "agents 2 *worlds"], copies: carrying.Copies
    ) -> RescueState:
        """After everybody has moved, carried, let go, saved and lifted."""
        config = self.config
        speed = jnp.where(either(state.held), config.carry_speed, config.max_speed)
        position = jnp.clip(state.position + driven(action, speed), 0.0, config.world_size)
        moved, team = position - state.position, (copies, config.coupling)
        victim = carrying.carried(state.victim, state.held, moved, *team)
        squared = jnp.stack([offset(position, one).squared for one in victim])
        held = carrying.kept(state.held, squared, config.reach, *team)
        to_base = victim - state.base[None]
        home = (to_base * to_base).sum(1) <= config.base_radius**2
        saved = state.saved | home
        held = carrying.taken(held & ~saved[:, None], squared, ~saved, config.reach, *team)
        return dataclasses.replace(
            state, position=position, victim=victim, held=held, saved=saved, time=state.time + 1
        )

    def _team_reward(self, before: RescueState, after: RescueState) -> Float[Array, "*worlds"]:
        """1 in the step that saves the last victim."""
        return (after.saved.all(0) & ~before.saved.all(0)).astype(jnp.float32)

    def _progress(self, before: RescueState, after: RescueState) -> Float[Array, "agents *worlds"]:
        """How much nearer agents have come to the cell that was next for them, as a share of the most."""
        was, now = (
            jnp.sqrt(to_cell(self.config, one.position, before.next_cell).squared) for one in (before, after)
        )
        return (was - now) / self.config.max_speed

    def _local_rewards(
        self, sensed: Sensed, progress: Float[Array, "agents *worlds"]
    ) -> Float[Array, "agents skills *worlds"]:
        """In the order of the skills' names."""
        config = self.config
        to_agent = closeness(sensed.agent.offset.squared, config.reach)
        rewards = [
            _if_any(sensed.victim, config.reach),
            _if_any(sensed.call, config.reach),
            closeness(sensed.base.squared, config.base_radius),
            progress,
            to_agent,
            -to_agent,
        ]
        return jnp.stack(rewards, axis=1)


def _if_any(target: Nearest, full: float) -> Float[Array, "agents *worlds"]:
    """Closeness to a target, or 0 without one."""
    return jnp.where(target.there, closeness(target.offset.squared, full), 0.0)

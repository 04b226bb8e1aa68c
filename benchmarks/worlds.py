"""Worlds as a stranger writes them, in metres and unlike the Rover Domain, and a check that each is solvable.

Whatever is tuned on rovers alone may lean on their observations (1/distance², by type), their bounded
rewards and their drive. Nothing here has these. No observation says what has been done: what comes next is
for a selector to find out.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int, Key

import skillcrew as sc

EPISODES = 500
ENOUGH = 0.97
"""Share of episodes that a timetable on hand-written skills must finish, or the world is no fair test."""


class Handover(sc.Environment):
    """Two robots in a room of 10 m: both onto the pickup plate, then one holds a lever for the other.

    A robot drives up to 0.6 m a step along each axis, and a plate counts within 0.5 m. The goal counts only
    while somebody holds the lever, so the two have to part: unless lever and goal happen to be close
    together, the same skill for both does not finish.
    """

    name = "handover"
    n_agents = 2
    observation_size = 8
    action_size = 2
    episode_length = 40
    skills = ("go_to_pickup", "go_to_lever", "go_to_goal")
    speed, reach, room = 0.6, 0.5, 10.0

    def reset(self, key: Key[Array, ""]) -> tuple[Any, Float[Array, "agents obs"]]:
        key_robots, key_places = jax.random.split(key)
        state = {
            "robots": jax.random.uniform(key_robots, (2, 2), maxval=self.room),
            "places": jax.random.uniform(key_places, (3, 2), maxval=self.room),
            "stage": jnp.zeros((), jnp.int32),
            "time": jnp.zeros((), jnp.int32),
        }
        return state, self._observe(state)

    def step(
        self, state: Any, action: Float[Array, "agents act"], key: Key[Array, ""]
    ) -> tuple[Any, sc.TimeStep]:
        robots = jnp.clip(state["robots"] + self.speed * action, 0.0, self.room)
        distance = _lengths(state["places"] - robots[:, None])
        pickup, lever, goal = (distance < self.reach).T
        parted = (lever[0] & goal[1]) | (lever[1] & goal[0])
        state = {**state, "robots": robots, **_advanced(state, jnp.stack([pickup.all(), parted]))}
        return state, _time_step(self, state, self._observe(state), -distance, 2)

    def _observe(self, state: Any) -> Float[Array, "agents obs"]:
        """Offsets to pickup, lever and goal, and to the other robot, in metres."""
        robots = state["robots"]
        offsets = (state["places"] - robots[:, None]).reshape(2, 6)
        return jnp.concatenate([offsets, robots[::-1] - robots], axis=1)


class Relay(sc.Environment):
    """Three carts on a rail of 10 m: any two at rest at the first station, then all three at the second.

    The action is acceleration, up to 3 m/s²; friction takes 0.3 of the speed a second; a step lasts 0.2 s.
    At a station is within 0.4 m of it, at rest below 0.3 m/s. Skills that travel are paid the metres that
    they came closer.
    """

    name = "relay"
    n_agents = 3
    observation_size = 6
    action_size = 1
    episode_length = 50
    skills = ("go_to_first", "go_to_second", "brake", "spread_out")
    tick, push, friction, rail, reach, rest = 0.2, 3.0, 0.3, 10.0, 0.4, 0.3

    def reset(self, key: Key[Array, ""]) -> tuple[Any, Float[Array, "agents obs"]]:
        key_carts, key_first, key_gap = jax.random.split(key, 3)
        first = jax.random.uniform(key_first, maxval=8.0)
        # On a ring of 8 m, so that the two are at least 3 m apart wherever the first is.
        second = (first + jax.random.uniform(key_gap, minval=3.0, maxval=5.0)) % 8.0
        state = {
            "place": jax.random.uniform(key_carts, (3,), maxval=self.rail),
            "speed": jnp.zeros(3),
            "stations": 1.0 + jnp.stack([first, second]),
            "stage": jnp.zeros((), jnp.int32),
            "time": jnp.zeros((), jnp.int32),
        }
        return state, self._observe(state)

    def step(
        self, state: Any, action: Float[Array, "agents act"], key: Key[Array, ""]
    ) -> tuple[Any, sc.TimeStep]:
        acceleration = self.push * action[:, 0] - self.friction * state["speed"]
        wanted = state["place"] + self.tick * (state["speed"] + self.tick * acceleration)
        place = jnp.clip(wanted, 0.0, self.rail)
        # A buffer at the end of the rail takes all speed.
        speed = (place - state["place"]) / self.tick
        distance = jnp.abs(state["stations"] - place[:, None])
        closer = jnp.abs(state["stations"] - state["place"][:, None]) - distance
        at_first, at_second = (distance < self.reach).T
        ready = (at_first & (jnp.abs(speed) < self.rest)).sum() >= 2
        room = jnp.abs(place[:, None] - place)[_OTHERS].reshape(3, 2).min(axis=1)
        local = jnp.stack([*closer.T, -jnp.abs(speed), jnp.minimum(room, 3.0)], axis=1)
        done = _advanced(state, jnp.stack([ready, at_second.all()]))
        state = {**state, "place": place, "speed": speed, **done}
        return state, _time_step(self, state, self._observe(state), local, 2)

    def _observe(self, state: Any) -> Float[Array, "agents obs"]:
        """Own place and speed, then offsets to both stations and to both other carts, in metres."""
        place = state["place"]
        others = (place - place[:, None])[_OTHERS].reshape(3, 2)
        own = jnp.stack([place, state["speed"]], axis=1)
        return jnp.concatenate([own, state["stations"] - place[:, None], others], axis=1)


_OTHERS = ~jnp.eye(3, dtype=bool)


class Harvest(sc.Environment):
    """Four drones over 12 m of land: two at the well; two at the field while one holds the gate; all home.

    A drone asks for a speed of up to 0.8 m a step along each axis, and gets half of what it lacks at every
    step; gusts of 0.05 m push it about. A place counts within 0.7 m, home within 1 m.
    """

    name = "harvest"
    n_agents = 4
    observation_size = 10
    action_size = 2
    episode_length = 60
    skills = ("go_to_well", "go_to_field", "go_to_gate", "go_home")
    speed, gust, land = 0.8, 0.05, 12.0
    reach = (0.7, 0.7, 0.7, 1.0)

    def reset(self, key: Key[Array, ""]) -> tuple[Any, Float[Array, "agents obs"]]:
        key_drones, key_places = jax.random.split(key)
        state = {
            "drones": jax.random.uniform(key_drones, (4, 2), maxval=self.land),
            "speed": jnp.zeros((4, 2)),
            "places": jax.random.uniform(key_places, (4, 2), maxval=self.land),
            "stage": jnp.zeros((), jnp.int32),
            "time": jnp.zeros((), jnp.int32),
        }
        return state, self._observe(state)

    def step(
        self, state: Any, action: Float[Array, "agents act"], key: Key[Array, ""]
    ) -> tuple[Any, sc.TimeStep]:
        speed = 0.5 * state["speed"] + 0.5 * self.speed * action
        drones = state["drones"] + speed + self.gust * jax.random.normal(key, (4, 2))
        distance = _lengths(state["places"] - drones[:, None])
        well, field, gate, home = (distance < jnp.array(self.reach)).T
        # Whoever holds the gate cannot be one of the two at the field, even where both are close together.
        harvested = (field.sum() >= 2) & gate.any() & ((field | gate).sum() >= 3)
        done = _advanced(state, jnp.stack([well.sum() >= 2, harvested, home.all()]))
        state = {**state, "drones": drones, "speed": speed, **done}
        return state, _time_step(self, state, self._observe(state), -distance, 3)

    def _observe(self, state: Any) -> Float[Array, "agents obs"]:
        """Own speed in metres a step, then offsets to well, field, gate and home in metres."""
        offsets = (state["places"] - state["drones"][:, None]).reshape(4, 8)
        return jnp.concatenate([state["speed"], offsets], axis=1)


def _lengths(offsets: Float[Array, "*n xy"]) -> Float[Array, "*n"]:
    return jnp.sqrt((offsets**2).sum(axis=-1))


def _advanced(state: Any, met: Bool[Array, " stages"]) -> dict[str, Array]:
    """Stage and time after a step: one stage at most, and only if its own condition is met."""
    going_on = state["stage"] < len(met)
    met_now = going_on & met[jnp.minimum(state["stage"], len(met) - 1)]
    return {"stage": state["stage"] + met_now, "time": state["time"] + 1}


def _time_step(
    env: sc.Environment, state: Any, observation: Array, local_rewards: Array, stages: int
) -> sc.TimeStep:
    done = state["stage"] >= stages
    return sc.TimeStep(
        observation=observation,
        local_rewards=local_rewards,
        team_reward=done.astype(jnp.float32),
        terminated=done,
        truncated=(state["time"] >= env.episode_length) & ~done,
    )


WORLDS: Mapping[str, type[sc.Environment]] = {world.name: world for world in (Handover, Relay, Harvest)}


def handover_skills(observation: Float[Array, "agents obs"]) -> Float[Array, "agents skills act"]:
    """The best action of each skill, by hand: straight at its place, and not beyond it."""
    return jnp.clip(observation[:, :6].reshape(-1, 3, 2) / Handover.speed, -1.0, 1.0)


def relay_skills(observation: Float[Array, "agents obs"]) -> Float[Array, "agents skills act"]:
    """A spring with its damper towards each station; brakes; away from the closest other cart."""
    speed, stations, others = observation[:, 1:2], observation[:, 2:4], observation[:, 4:]
    closest = jnp.take_along_axis(others, jnp.abs(others).argmin(axis=1)[:, None], axis=1)
    wanted = jnp.concatenate([2.0 * stations - 2.5 * speed, -4.0 * speed, -jnp.sign(closest)], axis=1)
    return jnp.clip(wanted / Relay.push, -1.0, 1.0)[..., None]


def harvest_skills(observation: Float[Array, "agents obs"]) -> Float[Array, "agents skills act"]:
    """Straight at each place, more slowly the closer it is, for a drone goes on for a while."""
    return jnp.clip(0.5 * observation[:, 2:].reshape(-1, 4, 2) / Harvest.speed, -1.0, 1.0)


@dataclass(frozen=True)
class Solution:
    """A world solved by hand."""

    actions: Callable[[Array], Array]
    """Each agent's action of each skill, from the observation."""
    timetable: tuple[tuple[tuple[str, int], ...], ...]
    """For each agent its phases: a skill, and the step before which it ends."""

    def choices(self, env: sc.Environment) -> Int[Array, "time agents"]:
        def of_agent(phases: tuple[tuple[str, int], ...]) -> list[int]:
            return [
                next(env.skills.index(skill) for skill, end in phases if time < end)
                for time in range(env.episode_length)
            ]

        return jnp.array([of_agent(phases) for phases in self.timetable]).T


SOLUTIONS: Mapping[str, Solution] = {
    "handover": Solution(
        handover_skills,
        ((("go_to_pickup", 20), ("go_to_lever", 40)), (("go_to_pickup", 20), ("go_to_goal", 40))),
    ),
    "relay": Solution(relay_skills, ((("go_to_first", 25), ("go_to_second", 50)),) * 3),
    "harvest": Solution(
        harvest_skills,
        (
            *((("go_to_well", 20), ("go_to_field", 40), ("go_home", 60)),) * 2,
            *((("go_to_gate", 40), ("go_home", 60)),) * 2,
        ),
    ),
}


def finished(
    env: sc.Environment,
    actions: Callable[[Array], Array],
    choices: Int[Array, "episodes time agents"],
    key: Key[Array, ""],
) -> float:
    """Share of episodes that a team finishes which chooses these skills, whatever it sees."""

    def episode(chosen: Int[Array, "time agents"], key: Key[Array, ""]) -> Array:
        key_reset, key_steps = jax.random.split(key)

        def step(now: Any, given: Any) -> Any:
            state, observation = now
            choice, key_step = given
            action = jnp.take_along_axis(actions(observation), choice[:, None, None], axis=1)[:, 0]
            state, step = env.step(state, action, key_step)
            return (state, step.observation), step.terminated

        keys = jax.random.split(key_steps, env.episode_length)
        return jax.lax.scan(step, env.reset(key_reset), (chosen, keys))[1].any()

    return float(jax.jit(jax.vmap(episode))(choices, jax.random.split(key, len(choices))).mean())


def random_choices(
    env: sc.Environment, held: int, key: Key[Array, ""], episodes: int = EPISODES
) -> Int[Array, "episodes time agents"]:
    """Skills by chance, each held for so many steps."""
    phases = -(-env.episode_length // held)
    drawn = jax.random.randint(key, (episodes, phases, env.n_agents), 0, len(env.skills))
    return jnp.repeat(drawn, held, axis=1)[:, : env.episode_length]


def main() -> int:
    print(f"share of {EPISODES} episodes finished, on hand-written skills, by")
    print(f"{'world':10}{'timetable':>10}{'random':>10}{'random, held 10 steps':>25}")
    solvable = True
    for index, (name, make) in enumerate(WORLDS.items()):
        env, solution = make(), SOLUTIONS[name]
        key_draw, key_live = jax.random.split(jax.random.key(index))
        timetable = jnp.broadcast_to(choices := solution.choices(env), (EPISODES, *choices.shape))
        teams = (timetable, *(random_choices(env, held, key_draw) for held in (1, 10)))
        shares = [finished(env, solution.actions, team, key_live) for team in teams]
        print(f"{name:10}{shares[0]:10.3f}{shares[1]:10.3f}{shares[2]:25.3f}")
        solvable &= shares[0] >= ENOUGH
    return 0 if solvable else 1


if __name__ == "__main__":
    raise SystemExit(main())

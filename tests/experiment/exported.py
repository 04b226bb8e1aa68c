"""Teams of all kinds with weights that nobody trained, and what they and their exported forms do."""

import functools
import importlib.util

import jax
import jax.numpy as jnp
import numpy as np

from skillcrew.envs.agent_type import AgentType
from skillcrew.experiment.export.interface import Interface
from skillcrew.experiment.export.writing import FORMATS, files_of
from skillcrew.policies.action_values import ActionValues
from skillcrew.policies.actor import Actor
from skillcrew.policies.memory import MemoryNetwork, PolicyConfig
from skillcrew.policies.network import NetworkConfig
from skillcrew.policies.selector import SelectorConfig, create_selector
from skillcrew.policies.stochastic import Options, StochasticPolicy, StochasticTeam
from skillcrew.policies.team import ActorTeam, IdentifiedTeam, JointTeam, SkillTeam
from skillcrew.policies.team_by_type import TeamByType

EPISODES, STEPS = 20, 50
"""Of all kinds but forty agents, who see as much in fewer."""

AGENTS, SEEN, ACTS, SKILLS = 3, 5, 2, 4

POLICY = PolicyConfig(hidden=(6,), memory=3, input_scaling="sqrt")
TYPES = (AgentType("scout", 2, SEEN - 2, ACTS), AgentType("hauler", 1, SEEN, ACTS + 1))
REPERTOIRE = ((0, 1, 0), (0, 1, 0), (1, 2, 3))


def many(create, count):
    """Shapes of as many networks."""
    return jax.eval_shape(jax.vmap(create), jax.random.split(jax.random.key(0), count))


def selectors(count, choices=SKILLS, **fields):
    config = SelectorConfig(hidden=(6,), **fields)
    return many(lambda key: create_selector(key, SEEN, choices, STEPS, config), count)


def skills():
    return many(lambda key: Actor.create(key, SEEN, ACTS, NetworkConfig(hidden=(7,))), SKILLS)


def picking_skills():
    network = NetworkConfig(hidden=(7,), input_scaling="none")
    return many(lambda key: ActionValues.create(key, SEEN, 3, network, dueling=True), SKILLS)


def actors(count, seen=SEEN, acts=ACTS, config=POLICY):
    return many(lambda key: MemoryNetwork.create(key, seen, acts, config), count)


def trunk():
    network = NetworkConfig(hidden=(6,))
    actor = many(lambda key: Actor.create(key, SEEN + AGENTS, ACTS, network, heads=AGENTS), 1)
    return ActorTeam(MemoryNetwork.of_actor(actor), AGENTS)


def drawing(options, skills=None, **fields):
    policies = many(lambda key: StochasticPolicy.create(key, SEEN, options, POLICY), 1)
    return StochasticTeam(policies, skills, jnp.zeros(()), options, AGENTS, **fields)


REACTIVE = {"memory": 3, "phases": 5, "reactive": True, "hold": 3, "input_scaling": "sqrt"}

MANY = "timetables of forty agents"

TEAMS = {
    "one selector with memory for all": lambda: SkillTeam(selectors(1, memory=4), skills(), AGENTS),
    "reactive timetables that hold": lambda: SkillTeam(selectors(AGENTS, **REACTIVE), skills(), AGENTS),
    MANY: lambda: SkillTeam(selectors(40, phases=4), skills(), 40),
    "discrete skills of agents that differ": lambda: TeamByType(
        SkillTeam(selectors(AGENTS, choices=3), picking_skills(), AGENTS, REPERTOIRE), TYPES, ACTS + 1
    ),
    "actors with memory that differ": lambda: TeamByType(
        ActorTeam(actors(AGENTS, acts=ACTS + 1), AGENTS), TYPES, 0
    ),
    "a trunk with heads": lambda: IdentifiedTeam(trunk()),
    "one actor that picks for all": lambda: JointTeam(
        ActorTeam(actors(1, seen=AGENTS * SEEN, acts=AGENTS * ACTS), 1, ACTS), AGENTS
    ),
    "drawn actions": lambda: drawing(Options(ACTS, continuous=True)),
    "drawn skills": lambda: drawing(Options(SKILLS), skills(), hold=2),
}
"""By what is special about them; shapes alone."""


class Subject:
    """A team, and 1000 observations of it in episodes of 50 steps."""

    def __init__(self, kind):
        draw = np.random.default_rng(5)
        self.episodes = 2 if kind == MANY else EPISODES

        def weights(leaf):
            return jnp.asarray(draw.normal(0, 0.7, leaf.shape) if leaf.shape else 0.1, leaf.dtype)

        self.team = jax.tree.map(weights, TEAMS[kind]())
        own = self.team.types if isinstance(self.team, TeamByType) else ()
        shape = functools.partial(jax.ShapeDtypeStruct, dtype=jnp.float32)
        self.shapes = {one.name: shape((one.agents, one.observation_size)) for one in own} or shape(
            (40 if kind == MANY else AGENTS, SEEN)
        )
        self.interface = Interface.of(self.team, self.shapes)
        self.names = [port.name for port in self.interface.observation]
        seen = [
            draw.uniform(-1, 3, (STEPS, self.episodes, *port.shape)) for port in self.interface.observation
        ]
        self.seen = [np.asarray(values, np.float32) for values in seen]
        self.keys = jax.random.split(jax.random.key(7), (STEPS, self.episodes))

    @functools.cached_property
    def files(self):
        return files_of(self.team, self.shapes, {"format": 1}, FORMATS)

    @functools.cached_property
    def _play(self):
        structure = jax.tree.structure(self.shapes)

        def step(memory, inputs):
            key, *seen = inputs
            action, memory, choice = jax.vmap(self._one_step)(
                memory, jax.tree.unflatten(structure, seen), key
            )
            remembered = [leaf for leaf in jax.tree.leaves(memory) if leaf.size]
            return memory, [*jax.tree.leaves(action), *jax.tree.leaves(choice), *remembered]

        def play(team, seen, keys):
            self._acting = team
            start = jax.tree.map(lambda leaf: jnp.stack([leaf] * self.episodes), team.initial_memory())
            return jax.lax.scan(step, start, (keys, *seen))[1]

        return jax.jit(play)

    def _one_step(self, memory, observation, key):
        return self._acting.act(observation, memory, key)

    def played_by(self, team):
        """By name, all that comes out of `team.act` at each step of each episode."""
        names = [port.name.removeprefix("next/") for port in self.interface.results]
        return dict(zip(names, map(np.asarray, self._play(team, self.seen, self.keys)), strict=True))

    def uniform(self, shape):
        """What JAX draws with the keys, between 0 and 1."""
        return np.asarray(jax.vmap(jax.vmap(lambda key: jax.random.uniform(key, shape)))(self.keys))


def one_by_one(subject, act, draws):
    """What `act` of one world makes of all episodes, one after the other; as `Subject.played_by`."""
    given = dict(zip(subject.names, subject.seen, strict=True)) | draws
    episodes = []
    for episode in range(subject.episodes):
        before, steps = {}, []
        for step in range(STEPS):
            before = act({**before, **{name: values[step, episode] for name, values in given.items()}})
            steps.append(before)
        episodes.append(steps)
    return {
        name: np.array([[steps[step][name] for steps in episodes] for step in range(STEPS)])
        for name in episodes[0][0]
    }


def side_by_side(subject, act, draws):
    """The same of a program that acts in many worlds at once."""
    steps, before = [], {}
    for step in range(STEPS):
        keys = [subject.keys[step]] if draws else []
        seen = {name: values[step] for name, values in zip(subject.names, subject.seen, strict=True)}
        before = act({**before, **seen}, *keys)
        steps.append(before)
    return {name: np.array([values[name] for values in steps]) for name in before}


def write(files, folder):
    """A folder with these files."""
    folder.mkdir()
    for name, data in files.items():
        (folder / name).write_bytes(data)
    return folder


def program_in(folder, name):
    """The `act` of a program that lies in a folder."""
    about = importlib.util.spec_from_file_location(name, folder / f"{name}.py")
    module = importlib.util.module_from_spec(about)
    about.loader.exec_module(module)
    return module.act

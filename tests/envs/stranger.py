"""A package of somebody else's, written to disk: a world with options, and what may be wrong with one."""

WORLD = '''
"""Two probes on a line must both be at the beacon."""

import dataclasses

import jax
import jax.numpy as jnp

import skillcrew as sc


@dataclasses.dataclass(frozen=True)
class LineConfig:
    """A line."""

    probes: int = 2
    """Probes in the team."""
    reach: float = 0.5
    """How close is there, in metres."""

    def __post_init__(self):
        if self.probes < 1:
            raise sc.UserError(f"probes = {self.probes}: give at least 1")


class LineWorld(sc.Environment):
    """Probes on a line must be at the beacon."""

    observation_size = 1
    action_size = 1
    episode_length = 5
    skills = ("approach", "flee")
    config_class = LineConfig
    presets = {"narrow": LineConfig(reach=0.1), "line-world-of-three": LineConfig(probes=3)}

    def __init__(self, config):
        self.config = config
        self.n_agents = config.probes

    def reset(self, key):
        offset = jax.random.uniform(key, (self.n_agents,), minval=-2.0, maxval=2.0)
        state = {"offset": offset, "time": jnp.zeros((), jnp.int32)}
        return state, offset[:, None]

    def step(self, state, action, key):
        offset = state["offset"] + action[:, 0]
        time = state["time"] + 1
        near = jnp.abs(offset)
        done = (near < self.config.reach).all()
        step = sc.TimeStep(
            observation=offset[:, None],
            local_rewards=jnp.stack([-near, near], axis=1),
            team_reward=done.astype(jnp.float32),
            terminated=done,
            truncated=(time >= self.episode_length) & ~done,
        )
        return {"offset": offset, "time": time}, step


class Bare(LineWorld):
    """Has no options."""

    config_class = None
    presets = {}

    def __init__(self):
        self.config = LineConfig()
        self.n_agents = 2


class NotAWorld:
    pass


not_a_class = 3
'''

BROKEN = "import skillcrew\n\nraise RuntimeError('no licence for the simulator')\n"


def write_package(folder, entry_points=None):
    """`line_lab` in a folder, as an installed distribution where it offers entry points."""
    package = folder / "line_lab"
    package.mkdir(parents=True)
    (package / "__init__.py").write_text("")
    (package / "worlds.py").write_text(WORLD)
    (package / "broken.py").write_text(BROKEN)
    if entry_points is not None:
        about = folder / "line_lab-1.0.dist-info"
        about.mkdir()
        (about / "METADATA").write_text("Metadata-Version: 2.1\nName: line-lab\nVersion: 1.0\n")
        lines = "".join(f"{name} = {place}\n" for name, place in entry_points.items())
        (about / "entry_points.txt").write_text(f"[skillcrew.environments]\n{lines}")
    return folder

"""MADDPG (Lowe et al. 2017; thesis, section 2.2.2) and MATD3 (Ackermann et al. 2019).

Each agent's actor sees what the agent sees and learns by gradient from a critic that sees what everybody saw
and did, so that to the critic the world stands still while the others change. Nothing evolves.
"""

import dataclasses
from typing import Any

from skillcrew.algorithms.joint_learning import JointLearning, JointLearningConfig
from skillcrew.algorithms.learning_alone import LearningAlone, LearningAloneConfig
from skillcrew.learners.maddpg import MADDPGLearnerConfig


@dataclasses.dataclass(frozen=True)
class MADDPGConfig(LearningAloneConfig, JointLearningConfig):
    """Options of MADDPG."""

    def __post_init__(self) -> None:
        LearningAloneConfig.__post_init__(self)
        JointLearningConfig.__post_init__(self)


@dataclasses.dataclass(frozen=True)
class MATD3Config(MADDPGConfig):
    """Options of MADDPG, with MATD3's: two critics, delayed actors, noise on target actions."""

    learner: MADDPGLearnerConfig = dataclasses.field(default_factory=MADDPGLearnerConfig.matd3)
    """How they learn."""


class MADDPG(LearningAlone):
    """Each agent's actor learns from a critic that sees all agents; nothing evolves.

    `MADDPG(env, critic_sharing="team")` overrides fields of `MADDPGConfig`. In a generation the team lives a
    few episodes with noise, each agent by one of its policies; then come updates on steps of the whole team:

    - each critic, towards r_i + γ Q'_i(x', a'_1 … a'_N), the next actions being all target actors';
    - each actor, up Q_i(x, a_1 … μ_i(o_i) … a_N);
    - all targets, by the share τ.

    Raises:
        UserError: an unknown field or reward, or a value that a field refuses.
    """

    name = "maddpg"
    label = "MADDPG"
    config_class: Any = MADDPGConfig

    def _learning(self, n_actors: int) -> JointLearning:
        return JointLearning(self._lived_in, self.config, n_actors)


class MATD3(MADDPG):
    """MADDPG with twin critics, actors that wait for them, and noise on target actions; nothing evolves."""

    name = "matd3"
    label = "MATD3"
    config_class = MATD3Config

"""What users of the library take from it; `__init__.py` imports each of these when it is first used."""

from .algorithms.ccea import (
    CCEA as CCEA,
)
from .algorithms.ccea import (
    CCEAConfig as CCEAConfig,
)
from .algorithms.cerl import (
    CERL as CERL,
)
from .algorithms.cerl import (
    CERLConfig as CERLConfig,
)
from .algorithms.coma import (
    COMA as COMA,
)
from .algorithms.coma import (
    COMAConfig as COMAConfig,
)
from .algorithms.ea import (
    EA as EA,
)
from .algorithms.ea import (
    EAConfig as EAConfig,
)
from .algorithms.erl import (
    ERL as ERL,
)
from .algorithms.erl import (
    ERLConfig as ERLConfig,
)
from .algorithms.independent import (
    IndependentDDPG as IndependentDDPG,
)
from .algorithms.independent import (
    IndependentDDPGConfig as IndependentDDPGConfig,
)
from .algorithms.independent import (
    IndependentDQN as IndependentDQN,
)
from .algorithms.independent import (
    IndependentTD3 as IndependentTD3,
)
from .algorithms.independent import (
    IndependentTD3Config as IndependentTD3Config,
)
from .algorithms.liir import (
    LIIR as LIIR,
)
from .algorithms.liir import (
    LIIRConfig as LIIRConfig,
)
from .algorithms.maddpg import (
    MADDPG as MADDPG,
)
from .algorithms.maddpg import (
    MATD3 as MATD3,
)
from .algorithms.maddpg import (
    MADDPGConfig as MADDPGConfig,
)
from .algorithms.maddpg import (
    MATD3Config as MATD3Config,
)
from .algorithms.madys import (
    MADyS as MADyS,
)
from .algorithms.madys import (
    MADySConfig as MADySConfig,
)
from .algorithms.madys_es import (
    MADySES as MADySES,
)
from .algorithms.madys_es import (
    MADySESConfig as MADySESConfig,
)
from .algorithms.madys_plus import (
    MADySPlus as MADySPlus,
)
from .algorithms.madys_plus import (
    MADySPlusConfig as MADySPlusConfig,
)
from .algorithms.merl import (
    MERL as MERL,
)
from .algorithms.merl import (
    MERLConfig as MERLConfig,
)
from .algorithms.mfl import (
    MFL as MFL,
)
from .algorithms.mfl import (
    MFLConfig as MFLConfig,
)
from .algorithms.open_loop import (
    OpenLoop as OpenLoop,
)
from .algorithms.open_loop import (
    OpenLoopConfig as OpenLoopConfig,
)
from .algorithms.ppo import (
    IPPO as IPPO,
)
from .algorithms.ppo import (
    MAPPO as MAPPO,
)
from .algorithms.ppo import (
    MAPPOConfig as MAPPOConfig,
)
from .algorithms.registry import make_algorithm as make_algorithm
from .algorithms.team_search import RaceConfig as RaceConfig
from .envs.agent_type import AgentType as AgentType
from .envs.bridges.outward import gymnasium_env as gymnasium_env
from .envs.bridges.outward import pettingzoo_env as pettingzoo_env
from .envs.bridges.to_jaxmarl import jaxmarl_env as jaxmarl_env
from .envs.checks.check import check_environment as check_environment
from .envs.checks.report import CheckReport as CheckReport
from .envs.environment import (
    Environment as Environment,
)
from .envs.environment import (
    TimeStep as TimeStep,
)
from .envs.environment import (
    TimeStepByType as TimeStepByType,
)
from .envs.registry import make as make
from .envs.rover.config import RoverConfig as RoverConfig
from .envs.rover.crew import RoverType as RoverType
from .envs.scene import (
    Discs as Discs,
)
from .envs.scene import (
    Labels as Labels,
)
from .envs.scene import (
    Lines as Lines,
)
from .envs.scene import (
    Points as Points,
)
from .envs.scene import (
    Scene as Scene,
)
from .errors import UserError as UserError
from .evolution.coevolution import CoevolutionConfig as CoevolutionConfig
from .evolution.evosax_bridge import EvosaxConfig as EvosaxConfig
from .evolution.genetic import EvolutionConfig as EvolutionConfig
from .evolution.hall_of_fame import HallOfFameConfig as HallOfFameConfig
from .evolution.mutation import MutationConfig as MutationConfig
from .evolution.phases import PhaseMutationConfig as PhaseMutationConfig
from .evolution.restart import RestartConfig as RestartConfig
from .evolution.strategy import StrategyConfig as StrategyConfig
from .experiment.evaluation import (
    Evaluation as Evaluation,
)
from .experiment.export.loading import load_team as load_team
from .experiment.export.writing import export_team as export_team
from .experiment.run import (
    Run as Run,
)
from .experiment.run import (
    train as train,
)
from .experiment.runner import Interrupted as Interrupted
from .learners.coma import COMALearnerConfig as COMALearnerConfig
from .learners.dqn import DQNConfig as DQNConfig
from .learners.liir import LIIRLearnerConfig as LIIRLearnerConfig
from .learners.maddpg import MADDPGLearnerConfig as MADDPGLearnerConfig
from .learners.plateau import PlateauConfig as PlateauConfig
from .learners.ppo import PPOConfig as PPOConfig
from .learners.resource_manager import ResourceConfig as ResourceConfig
from .learners.td3 import (
    TD3 as TD3,
)
from .learners.td3 import (
    TD3Config as TD3Config,
)
from .policies.memory import PolicyConfig as PolicyConfig
from .policies.network import NetworkConfig as NetworkConfig
from .policies.selector import SelectorConfig as SelectorConfig
from .policies.team import Team as Team

"""skillcrew: team coordination under sparse rewards, by evolution, learned skills and credit assignment."""

from skillcrew.algorithms.ccea import CCEA, CCEAConfig
from skillcrew.algorithms.cerl import CERL, CERLConfig
from skillcrew.algorithms.ea import EA, EAConfig
from skillcrew.algorithms.erl import ERL, ERLConfig
from skillcrew.algorithms.independent import (
    IndependentDDPG,
    IndependentDDPGConfig,
    IndependentTD3,
    IndependentTD3Config,
)
from skillcrew.algorithms.madys import MADyS, MADySConfig
from skillcrew.algorithms.madys_es import MADySES, MADySESConfig
from skillcrew.algorithms.madys_plus import MADySPlus, MADySPlusConfig
from skillcrew.algorithms.merl import MERL, MERLConfig
from skillcrew.algorithms.mfl import MFL, MFLConfig
from skillcrew.algorithms.open_loop import OpenLoop, OpenLoopConfig
from skillcrew.algorithms.registry import make_algorithm
from skillcrew.algorithms.team_search import RaceConfig
from skillcrew.envs.environment import Environment, TimeStep
from skillcrew.envs.presets import make
from skillcrew.envs.rover.config import RoverConfig
from skillcrew.errors import UserError
from skillcrew.evolution.coevolution import CoevolutionConfig
from skillcrew.evolution.evosax_bridge import EvosaxConfig
from skillcrew.evolution.genetic import EvolutionConfig
from skillcrew.evolution.hall_of_fame import HallOfFameConfig
from skillcrew.evolution.mutation import MutationConfig
from skillcrew.evolution.phases import PhaseMutationConfig
from skillcrew.evolution.restart import RestartConfig
from skillcrew.evolution.strategy import StrategyConfig
from skillcrew.experiment.run import Evaluation, Run, train
from skillcrew.experiment.runner import Interrupted
from skillcrew.learners.plateau import PlateauConfig
from skillcrew.learners.resource_manager import ResourceConfig
from skillcrew.learners.td3 import TD3, TD3Config
from skillcrew.policies.memory import PolicyConfig
from skillcrew.policies.network import NetworkConfig
from skillcrew.policies.selector import SelectorConfig
from skillcrew.policies.team import Team

__all__ = [
    "CCEA",
    "CERL",
    "EA",
    "ERL",
    "MERL",
    "MFL",
    "TD3",
    "CCEAConfig",
    "CERLConfig",
    "CoevolutionConfig",
    "EAConfig",
    "ERLConfig",
    "Environment",
    "Evaluation",
    "EvolutionConfig",
    "EvosaxConfig",
    "HallOfFameConfig",
    "IndependentDDPG",
    "IndependentDDPGConfig",
    "IndependentTD3",
    "IndependentTD3Config",
    "Interrupted",
    "MADyS",
    "MADySConfig",
    "MADySES",
    "MADySESConfig",
    "MADySPlus",
    "MADySPlusConfig",
    "MERLConfig",
    "MFLConfig",
    "MutationConfig",
    "NetworkConfig",
    "OpenLoop",
    "OpenLoopConfig",
    "PhaseMutationConfig",
    "PlateauConfig",
    "PolicyConfig",
    "RaceConfig",
    "ResourceConfig",
    "RestartConfig",
    "RoverConfig",
    "Run",
    "SelectorConfig",
    "StrategyConfig",
    "TD3Config",
    "Team",
    "TimeStep",
    "UserError",
    "make",
    "make_algorithm",
    "train",
]

"""Gymnasium environments of compiled scenarios, single and vectorised."""

from socialai_dsl.envs.factory import make, make_parallel, make_vec
from socialai_dsl.envs.scenario_env import ScenarioEnv
from socialai_dsl.envs.vector_env import ScenarioVectorEnv

__all__ = ["ScenarioEnv", "ScenarioVectorEnv", "make", "make_parallel", "make_vec"]

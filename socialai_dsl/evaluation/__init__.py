"""Measures played episodes: the test set, coverage, random play, scripts, and reference levels of success.

The page `docs/evaluation.md` shows each of these at work:

* `evaluate_policy(policy, envs, episodes)`: the test set, for a policy and environments of one's own;
  `socialai_dsl.evaluate` plays it with every kind of agent, and returns an `Evaluation`.
* `coverage(scenarios)`: how often each rule, state, step and outcome occurred, and which never did.
* `baselines(scenario)`: reference levels of success; `play_script` and `play_at_random` measure more closely.

`socialai_dsl.episodes` has the players, the loop that plays and what watches it.
"""

from socialai_dsl.baselines import Baselines, Level
from socialai_dsl.evaluation.chance import Sample, play_at_random
from socialai_dsl.evaluation.coverage_report import Coverage, coverage
from socialai_dsl.evaluation.levels import baselines
from socialai_dsl.evaluation.scripts import ScriptReport, play_script
from socialai_dsl.evaluation.test_set import Evaluation, evaluate_policy

__all__ = [
    "Baselines",
    "Coverage",
    "Evaluation",
    "Level",
    "Sample",
    "ScriptReport",
    "baselines",
    "coverage",
    "evaluate_policy",
    "play_at_random",
    "play_script",
]

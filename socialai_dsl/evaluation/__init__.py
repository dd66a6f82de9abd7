"""Plays scenarios and says what came of it: agents, scripts, chance, people and language models, on the same episodes.

The page `docs/evaluation.md` shows each of these at work:

* `evaluate_agent(agent, scenario)`: the test set, as `socialai evaluate` plays it; `evaluate(policy, envs, episodes)`
  does so for a policy of one's own.
* `record(evaluation, folder)`: films, transcripts and a page that replays episodes.
* `trace(scenario)`: one episode, with the rules that fired in each step and why the others did not.
* `coverage(scenarios)`: how often each rule, state, step and outcome came about, and what never did.
* `baselines(scenario)`: what success is set beside; `play_script` and `play_at_random` measure more closely.
"""

from socialai_dsl.baselines import Baselines, Level
from socialai_dsl.evaluation.chance import Sample, play_at_random
from socialai_dsl.evaluation.coverage_report import Coverage, coverage
from socialai_dsl.evaluation.episode_trace import Trace, TraceStep, trace
from socialai_dsl.evaluation.episodes import (
    EvalResult,
    Observation,
    Policy,
    RandomPolicy,
    ScriptedPolicy,
    Streams,
    evaluate,
    wilson_interval,
)
from socialai_dsl.evaluation.levels import baselines
from socialai_dsl.evaluation.players import ModelOptions, Player
from socialai_dsl.evaluation.recordings import record
from socialai_dsl.evaluation.scripts import ScriptReport, play_script
from socialai_dsl.evaluation.testing import Evaluation, evaluate_agent

__all__ = [
    "Baselines",
    "Coverage",
    "EvalResult",
    "Evaluation",
    "Level",
    "ModelOptions",
    "Observation",
    "Player",
    "Policy",
    "RandomPolicy",
    "Sample",
    "ScriptReport",
    "ScriptedPolicy",
    "Streams",
    "Trace",
    "TraceStep",
    "baselines",
    "coverage",
    "evaluate",
    "evaluate_agent",
    "play_at_random",
    "play_script",
    "record",
    "trace",
    "wilson_interval",
]

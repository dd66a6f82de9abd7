"""Evaluation of any policy on the fixed test episodes of a scenario, without PyTorch."""

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

__all__ = [
    "EvalResult",
    "Observation",
    "Policy",
    "RandomPolicy",
    "ScriptedPolicy",
    "Streams",
    "evaluate",
    "wilson_interval",
]

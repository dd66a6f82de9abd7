"""Measuring what plays a scenario, on the same test episodes for all."""

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

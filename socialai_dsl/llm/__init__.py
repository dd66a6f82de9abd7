"""Scenarios for language models: rooms as text, replies as actions, episodes between the two."""

from socialai_dsl.llm.actions import Action, ActionLanguage, Parsed
from socialai_dsl.llm.episode import Decision, Episode, EpisodeResult, TextSeat, Turn
from socialai_dsl.llm.view import LastStep, TextView

__all__ = [
    "Action",
    "ActionLanguage",
    "Decision",
    "Episode",
    "EpisodeResult",
    "LastStep",
    "Parsed",
    "TextSeat",
    "TextView",
    "Turn",
]

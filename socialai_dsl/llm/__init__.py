"""Scenarios for language models: rooms as text, replies as actions, episodes between the two."""

from socialai_dsl.llm.actions import Action, ActionLanguage, Parsed
from socialai_dsl.llm.episode import Episode, EpisodeResult, Turn
from socialai_dsl.llm.view import LastStep, TextView

__all__ = ["Action", "ActionLanguage", "Episode", "EpisodeResult", "LastStep", "Parsed", "TextView", "Turn"]

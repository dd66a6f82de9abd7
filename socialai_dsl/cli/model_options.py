"""The options of `socialai evaluate llm:MODEL`, which `ModelOptions` declares."""

import argparse
from dataclasses import fields
from typing import Any, Final

from socialai_dsl.cli.arguments import add_declared, at_once, number_between, positive, seconds
from socialai_dsl.model_options import ModelOptions, meanings

_FIELDS: Final = {field.name: field for field in fields(ModelOptions)}
MODEL_OPTIONS: Final = tuple(_FIELDS)
_VALUES: Final[dict[str, tuple[str, Any]]] = {
    "base_url": ("URL", str),
    "key_from": ("NAME", str),
    "history": ("N", positive),
    "temperature": ("X", number_between(0, 100)),
    "max_tokens": ("N", positive),
    "concurrency": ("N", at_once),
    "timeout": ("SECONDS", seconds),
    "budget": ("N", str),
    "prices": ("IN,OUT|FILE", str),
}
"""Option -> what its value is called, and what reads it; the others are words to choose from, or switches."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Declare what counts for language models alone."""
    group = parser.add_argument_group("language models", "for the agent llm:MODEL")
    for name in MODEL_OPTIONS:
        add_option(group, name)


def add_option(parser: argparse._ActionsContainer, name: str) -> None:
    """Declare one of these options."""
    field = _FIELDS[name]
    metavar, kind = _VALUES.get(name, (None, None))
    value = {} if kind is None else {"metavar": metavar, "type": kind}
    add_declared(parser, name, field.type, meanings().get(name, ""), field.default, **value)

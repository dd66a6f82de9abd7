"""The options of `socialai evaluate llm:MODEL`."""

import argparse
from dataclasses import fields
from typing import Final

from socialai_dsl.cli.arguments import STYLE, at_once, number_between, positive, seconds
from socialai_dsl.model_options import ModelOptions

MODEL_OPTIONS: Final = tuple(field.name for field in fields(ModelOptions))


def add_options(parser: argparse.ArgumentParser) -> None:
    """Declare what counts for language models alone."""
    group = parser.add_argument_group("language models", "for the agent llm:MODEL")
    group.add_argument(
        "--base-url",
        metavar="URL",
        help="address of an OpenAI-compatible server, up to /v1 (default: OpenAI's)",
    )
    group.add_argument(
        "--key-from",
        metavar="NAME",
        help="environment variable that holds the key (default: OPENAI_API_KEY)",
    )
    group.add_argument("--style", **STYLE)
    group.add_argument(
        "--mode",
        choices=("text", "json", "tools"),
        help="how the model gives its actions (default: text)",
    )
    group.add_argument(
        "--history",
        type=positive,
        metavar="N",
        help="number of observations in a request (default: the whole episode)",
    )
    group.add_argument(
        "--temperature",
        type=number_between(0, 100),
        metavar="X",
        help="temperature (default: the server's)",
    )
    group.add_argument(
        "--max-tokens", type=positive, metavar="N", help="longest reply (default: the server's)"
    )
    group.add_argument(
        "--on-invalid",
        choices=("noop", "retry", "fail"),
        help="what a reply without an action does: pass the turn (default), ask again, or end the episode",
    )
    group.add_argument(
        "--grammar",
        action="store_true",
        default=None,
        help="constrain replies by a grammar (servers of llama.cpp)",
    )
    group.add_argument(
        "--probes",
        choices=("apart", "kept", "off"),
        help="ask the scenario's probes apart from play (default), keep them in later requests, or do not ask",
    )
    group.add_argument(
        "--concurrency",
        type=at_once,
        metavar="N",
        help="number of episodes played at once (default: 4)",
    )
    group.add_argument(
        "--timeout",
        type=seconds,
        metavar="SECONDS",
        help="time limit of one reply (default: 120)",
    )
    group.add_argument(
        "--budget",
        metavar="N",
        help="limit of what this command spends: 200000 tokens, or 2.50usd with --prices",
    )
    group.add_argument(
        "--prices",
        metavar="IN,OUT",
        help="US dollars for a million tokens of requests and a million of replies",
    )

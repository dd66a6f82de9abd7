"""How a language model is asked: options that play, evaluation and reports share."""

import re
from dataclasses import dataclass
from typing import Literal

from socialai_dsl.errors import OptionError


@dataclass(frozen=True)
class ModelOptions:
    """How a language model is asked.

    The command line shows these meanings as help.

    Attributes:
        base_url: address of an OpenAI-compatible server, up to /v1 (default: OpenAI's).
        key_from: environment variable that holds the key.
        style: style of the observations.
        mode: how the model gives its actions.
        history: number of observations in a request (default: the whole episode).
        temperature: temperature (default: the server's).
        max_tokens: longest reply (default: the server's).
        on_invalid: what a reply without an action does: pass the turn (default), ask again, or end the episode.
        grammar: constrain replies by a grammar (servers of llama.cpp).
        probes: ask the scenario's probes apart from play (default), keep them in later requests, or do not ask.
        concurrency: number of episodes played at once.
        timeout: time limit of one reply, seconds.
        budget: limit of what is spent: 200000 tokens, or 2.50usd where prices are given.
        prices: US dollars for a million tokens of requests and of replies, or a YAML file with MODEL: [IN, OUT].

    Raises:
        OptionError: replies are to be held to a grammar that have a form already.
    """

    base_url: str | None = None
    key_from: str = "OPENAI_API_KEY"
    style: Literal["prose", "grid", "json"] = "prose"
    mode: Literal["text", "json", "tools"] = "text"
    history: int | None = None
    temperature: float | None = None
    max_tokens: int | None = None
    on_invalid: Literal["noop", "retry", "fail"] = "noop"
    grammar: bool = False
    probes: Literal["apart", "kept", "off"] = "apart"
    concurrency: int = 4
    timeout: float = 120.0
    budget: str | None = None
    prices: str | None = None

    def __post_init__(self) -> None:
        if self.grammar and self.mode != "text":
            raise OptionError(
                "grammar", f"replies of the mode {self.mode} have a form already; expected text"
            )

    @property
    def manner(self) -> str:
        """How a model is shown the world and answers, in a phrase, with all else that can change what it does."""
        history = self.history
        shown = "the whole episode" if history is None else f"{history} observation{'s' * (history > 1)}"
        further = {
            "temperature": self.temperature,
            "max tokens": self.max_tokens,
            "on invalid": None if self.on_invalid == "noop" else self.on_invalid,
            "probes": "kept" if self.probes == "kept" else None,
            "held to": "a grammar" if self.grammar else None,
        }
        parts = [f"{name} {value}" for name, value in further.items() if value is not None]
        return ", ".join([f"{self.style} and {self.mode}", shown, *parts])


def meanings() -> dict[str, str]:
    """Option -> what `ModelOptions` says of it; nothing where Python keeps no docstrings."""
    return dict(re.findall(r"^ {8}([a-z_]+): (.*)\.$", ModelOptions.__doc__ or "", re.MULTILINE))

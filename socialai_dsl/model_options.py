"""How a language model is asked: options that play, evaluation and reports share."""

from dataclasses import dataclass
from typing import Literal

from socialai_dsl.errors import OptionError


@dataclass(frozen=True)
class ModelOptions:
    """How a language model is asked.

    Attributes:
        base_url: of an OpenAI-compatible interface, up to `/v1`; None: OpenAI's.
        key_from: the environment variable with the key.
        style: of observations. mode: how the model gives its actions.
        history: observations in a request; None: the whole episode.
        temperature, max_tokens: of replies; None: the server's.
        on_invalid: whether a reply without an action passes the turn, is asked for again, or ends the episode.
        grammar: whether replies are held to a grammar, which llama.cpp's server can.
        probes: whether the scenario's probes are asked apart from play, kept in later requests, or not asked.
        concurrency: episodes played at once.
        timeout: seconds for one reply.
        budget: what may be spent: `200000 tokens`, or `2.50usd` with prices.
        prices: US dollars for a million tokens of requests and of replies: `0.15,0.60`.

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

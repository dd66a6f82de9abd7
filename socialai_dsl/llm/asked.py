"""From options of language models to where a model is asked and what may be spent."""

from __future__ import annotations

import os
import re
from math import isfinite
from reprlib import repr as shortened
from typing import Final
from urllib.parse import urlsplit

from socialai_dsl.errors import UsageError
from socialai_dsl.llm.endpoint import OPENAI, Endpoint
from socialai_dsl.llm.players import Budget
from socialai_dsl.loader.prices import MOST_DOLLARS, prices_of
from socialai_dsl.model_options import ModelOptions
from socialai_dsl.trainer.config import MODEL_PREFIX

_LOCAL: Final = ("localhost", "127.0.0.1", "::1")
_BUDGET: Final = re.compile(r"(\d[\d_,]*(?:\.\d+)?) ?(tokens|usd)?", re.IGNORECASE)


def endpoint_of(agent: str, options: ModelOptions) -> Endpoint:
    """Where a model is asked, and how.

    Args:
        agent: `llm:MODEL`.
        options: of requests; the key is read from the environment.

    Raises:
        UsageError: an option is not what was expected, or there is no key.
    """
    for name, given in (("the model", agent), ("--base-url", options.base_url)):
        if not _is_unicode(given or ""):
            raise UsageError(f"{name}: got {given!r}, expected a text in Unicode")
    if options.temperature is not None and not isfinite(options.temperature):
        raise UsageError(f"--temperature: got {options.temperature}, expected a number such as 0.7")
    url = options.base_url or OPENAI
    try:
        parts = urlsplit(url)
        known = parts.scheme in ("http", "https") and bool(parts.hostname) and parts.port != 0
    except ValueError:
        known = False
    if not known:
        raise UsageError(f"--base-url: got {url!r}, expected one such as http://localhost:8080/v1")
    if parts.username is not None or parts.password is not None:
        raise UsageError("--base-url: expected one without a name and a password, which logs would show")
    key = os.environ.get(options.key_from, "")
    if not key and parts.hostname not in _LOCAL:
        raise UsageError(
            f"{parts.hostname} asks for a key, and the environment has none in {options.key_from}; "
            "export it, or name another variable with --key-from"
        )
    if not (key.strip().isascii() and key.strip().isprintable()):
        raise UsageError(
            f"--key-from: {options.key_from} holds more than the letters, digits and signs of a key"
        )
    model = agent.removeprefix(MODEL_PREFIX)
    if not model:
        raise UsageError(f"got the agent {agent!r}, expected the name of a model behind {MODEL_PREFIX}")
    asked = {"temperature": options.temperature, "max_tokens": options.max_tokens}
    prices = None if options.prices is None else prices_of(model, options.prices)
    return Endpoint(model, url, key.strip(), asked, options.timeout, prices)


def _is_unicode(text: str) -> bool:
    """Whether a text is one that can be sent: bytes of a command line that are none become halves of characters."""
    try:
        text.encode()
    except UnicodeEncodeError:
        return False
    return True


def budget_of(text: str | None, prices: tuple[float, float] | None) -> Budget:
    """What may be spent, such as `200000 tokens` or `2.50usd`.

    Raises:
        UsageError: the text is no amount, or one of money without prices.
    """
    if text is None:
        return Budget()
    match = _BUDGET.fullmatch(text.strip())
    amount = 0.0 if match is None else float(match[1].replace(",", "").replace("_", ""))
    if match is None or not 0 < amount <= MOST_DOLLARS:
        raise UsageError(
            f"--budget: got {shortened(text)}, expected an amount such as 200000 or 2.50usd, above 0 and at most "
            f"{MOST_DOLLARS:g}"
        )
    if (match[2] or "").lower() != "usd":
        return Budget(tokens=int(amount))
    if prices is None:
        raise UsageError("--budget: an amount of money needs --prices to be counted")
    return Budget(cost=amount)

"""What a plain (unquoted) YAML word means: text, number, true, false or nothing, or an ambiguity."""

from __future__ import annotations

import math
import re
from typing import Final, NamedTuple, TypeAlias

from socialai_dsl.loader.limits import MAX_FLOAT_LENGTH, MAX_INT_DIGITS

Scalar: TypeAlias = str | int | float | bool | None


class Plain(NamedTuple):
    """The value of a plain word and, if it is refused, the code, message and help line."""

    value: Scalar
    code: str | None = None
    message: str = ""
    hint: str | None = None


_INT: Final = re.compile(r"[-+]?(0|[1-9][0-9]*)")
_FLOAT: Final = re.compile(r"[-+]?((0|[1-9][0-9]*)\.[0-9]+([eE][-+][0-9]+)?|\.[0-9]+)")

_TRUE: Final = frozenset({"y", "yes", "true", "on"})
_FALSE: Final = frozenset({"n", "no", "false", "off"})
_NUMBER_LIKE: Final = re.compile(
    r"""[-+]?(?:
          0[0-9_]+                                          # octal for some
        | 0x[0-9a-fA-F_]+ | 0o[0-7_]+ | 0b[01_]+
        | [0-9][0-9_]*(?::[0-5]?[0-9])+(?:\.[0-9_]*)?       # base 60
        | (?:[0-9][0-9_]*(?:\.[0-9_]*)?|\.[0-9][0-9_]*)(?:[eE][-+]?[0-9]+)?
        | \.(?:inf|Inf|INF)
        ) | \.(?:nan|NaN|NAN)""",
    re.VERBOSE,
)
_DATE: Final = re.compile(r"[0-9]{4}-[0-9]{1,2}-[0-9]{1,2}(?:[Tt \t].*)?", re.DOTALL)
_MAY_BE_SPECIAL: Final = frozenset("-+.0123456789~=<ynotfYNOTF")


def read_plain(text: str) -> Plain:
    """The value of a plain word.

    Only the readings on which YAML 1.1 and YAML 1.2 tools agree are accepted; words that some tools take
    for something else (`yes`, `010`, `1:30`, `~`, dates) are refused with S003, so that a file means the
    same everywhere.
    """
    if text in ("", "null"):
        return Plain(None)
    if text == "true":
        return Plain(True)
    if text == "false":
        return Plain(False)
    if text[0] not in _MAY_BE_SPECIAL:
        return Plain(text)
    if _INT.fullmatch(text):
        return _int(text)
    if _FLOAT.fullmatch(text):
        return _float(text)
    return _ambiguous(text) or Plain(text)


def _int(text: str) -> Plain:
    if len(text.lstrip("+-")) > MAX_INT_DIGITS:
        return Plain(text, "S004", f"a whole number has at most {MAX_INT_DIGITS} digits")
    return Plain(int(text))


def _float(text: str) -> Plain:
    value = float(text) if len(text) <= MAX_FLOAT_LENGTH else math.inf
    if not math.isfinite(value):
        return Plain(text, "S004", f"a number is finite and has at most {MAX_FLOAT_LENGTH} characters")
    return Plain(value)


def _ambiguous(text: str) -> Plain | None:
    folded = text.lower()
    if folded in _TRUE | _FALSE and text in (folded, folded.capitalize(), folded.upper()):
        truth = "true" if folded in _TRUE else "false"
        return _refused(text, f"`{truth}` for some YAML tools and text for others", f"write `{truth}`")
    if text == "~" or folded == "null":
        return _refused(text, "nothing for some YAML tools and text for others", "leave the value out")
    if text in ("=", "<<"):
        return _refused(text, "a special word for some YAML tools")
    if _NUMBER_LIKE.fullmatch(text):
        return _refused(text, "not the same number for all YAML tools", "write a plain decimal number")
    if _DATE.fullmatch(text):
        return _refused(text, "a date for some YAML tools and text for others")
    return None


def _refused(text: str, reading: str, otherwise: str | None = None) -> Plain:
    hint = f'if you mean the text, quote it: "{text}"'
    hint = f"{otherwise}; {hint}" if otherwise else hint
    return Plain(text, "S003", f"`{text}` is {reading}", hint)

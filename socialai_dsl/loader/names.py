"""Names of scenarios: `NAME(+VARIANT)*(?parameter=value(&parameter=value)*)?`, and where shipped ones are."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from socialai_dsl.diagnostics import Diagnostic, DiagnosticBag
from socialai_dsl.loader.files import is_file
from socialai_dsl.loader.limits import MAX_NAME
from socialai_dsl.source import Source, Span

SUFFIXES: Final = (".yaml", ".yml")

_VARIANT: Final = re.compile(r"[A-Za-z0-9_-]{1,80}")
_PARAMETER: Final = re.compile(r"[A-Za-z_][A-Za-z0-9_]{0,79}")


@dataclass(frozen=True)
class Part:
    """A piece of a name and where it stands."""

    text: str
    span: Span


@dataclass(frozen=True)
class ScenarioName:
    """A scenario's name, taken apart.

    Attributes:
        base: a path or the name of a shipped scenario.
        variants: the variants to apply, in order.
        params: parameter -> value as written.
    """

    base: Part
    variants: tuple[Part, ...]
    params: dict[str, Part]


def shipped_folder() -> Path:
    """The folder of the scenarios that come with the product, in a checkout as well as installed."""
    package = Path(__file__).resolve().parent.parent
    installed = package / "scenarios"
    return installed if installed.is_dir() else package.parent / "scenarios"


def shipped_experiments() -> dict[str, Path]:
    """The files of the experiments that come with the product, by name."""
    package = Path(__file__).resolve().parent.parent
    installed = package / "experiments" / "shipped"
    folder = installed if installed.is_dir() else package.parent / "experiments"
    return {path.stem: path for path in sorted(folder.glob("*.yaml"))}


def looks_like_path(text: str) -> bool:
    """Whether a name is meant as a file rather than as a shipped scenario."""
    return "/" in text or "\\" in text or text.endswith(SUFFIXES)


def name_source(text: str) -> Source:
    """A name from outside any file (a command line, a call) as a source that findings can point into."""
    return Source("scenario name", text)


def parse_name(text: str, start: Span, found: DiagnosticBag, folder: Path | None = None) -> ScenarioName:
    """Take a name apart; what cannot be understood is added to `found` as S508.

    Args:
        text: the name.
        start: where its first character stands.
        found: takes the findings.
        folder: where relative paths start, if a file whose name holds `+` or `?` shall be recognised.
    """
    if not text.strip() or len(text) > MAX_NAME or not text.isprintable():
        found.add(Diagnostic("S508", "a scenario's name is one line of visible characters", start))
        return ScenarioName(Part("", start), (), {})

    question = len(text) if _is_file(text, folder) else _index(text, "?", 0)
    plus = question if _is_file(text[:question], folder) else _plus(text, question)
    variants = _pieces(text, "+", plus + 1, question, start)
    for variant in variants:
        if not _VARIANT.fullmatch(variant.text):
            found.add(Diagnostic("S508", "a variant's name is made of letters, digits and `_`", variant.span))
    params = {}
    for piece in _pieces(text, "&", question + 1, len(text), start):
        key, equals, value = piece.text.partition("=")
        if not equals or not _PARAMETER.fullmatch(key):
            found.add(Diagnostic("S508", f"`{piece.text}` is not of the form parameter=value", piece.span))
        elif key in params:
            found.add(Diagnostic("S508", f"the parameter `{key}` is given twice", piece.span))
        else:
            params[key] = Part(value, piece.span)
    return ScenarioName(_part(text, 0, plus, start), variants, params)


def _is_file(text: str, folder: Path | None) -> bool:
    return folder is not None and is_file(folder / text)


def _index(text: str, character: str, begin: int) -> int:
    found = text.find(character, begin)
    return len(text) if found < 0 else found


def _plus(text: str, question: int) -> int:
    """The first `+` of the last part of the path."""
    return min(question, _index(text, "+", text.rfind("/", 0, question) + 1))


def _pieces(text: str, separator: str, begin: int, end: int, start: Span) -> tuple[Part, ...]:
    """`text[begin:end]` split at the separator; nothing if `begin` lies behind `end`."""
    pieces = []
    while begin <= end:
        stop = min(end, _index(text, separator, begin))
        pieces.append(_part(text, begin, stop, start))
        begin = stop + 1
    return tuple(pieces)


def _part(text: str, begin: int, end: int, start: Span) -> Part:
    return Part(text[begin:end], start.shifted(begin, max(1, end - begin)))

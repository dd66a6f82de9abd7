"""Reporting mistakes at their place: parsing the strings of a file, and the words of messages."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any, Final

from socialai_dsl.diagnostics import DiagnosticBag, did_you_mean
from socialai_dsl.grammar import ast
from socialai_dsl.grammar.ast import rebuilt
from socialai_dsl.grammar.parser import ParseProblem, parse_expression, parse_text, unparse
from socialai_dsl.semantics.signatures import Signature
from socialai_dsl.semantics.terms import SIDE, TURN, Type
from socialai_dsl.source import DataPath, Positions, Span

Scalar = int | bool | float | str


_NO_TEXTS = frozenset({"cause", "do", "place"})
"""Keys whose values have no texts in them."""


class FailedError(Exception):
    """A value that means nothing; the reason has been reported."""


@dataclass(frozen=True)
class Findings:
    """Where findings go, and where the parts of the file stand.

    Attributes:
        bag: takes the findings.
        places: path -> place in the file.
        params: the file's parameters with their values, for `$name`.
        substituted: paths whose whole value was a parameter; places inside them mean nothing.
        data: the document, to tell one value from a list of one.
    """

    bag: DiagnosticBag
    places: Positions
    params: Mapping[str, Scalar] = field(default_factory=dict)
    substituted: frozenset[DataPath] = frozenset()
    data: object = None

    def part(self, path: DataPath) -> object:
        """What is written at `path`; None if nothing is."""
        part: Any = self.data
        for step in path:
            known = range(len(part)) if isinstance(part, list) else part if isinstance(part, dict) else ()
            if step not in known:
                return None
            part = part[step]
        return part

    def is_list(self, path: DataPath) -> bool:
        """Whether a list is written at `path`."""
        return isinstance(self.part(path), list)

    def at(self, path: DataPath, offset: int = 0, width: int = 1) -> Span:
        """The place of a character of the text at `path`."""
        return self.places.locate(path, 0 if path in self.substituted else offset, width)

    def node(self, path: DataPath, node: ast.Expr) -> Span:
        """The place of a part of the expression at `path`."""
        return self.at(path, *_extent(node))

    def error(self, code: str, message: str, span: Span, **more: str | None) -> None:
        """Report an error."""
        self.bag.error(code, message, span, **more)

    def warning(self, code: str, message: str, span: Span, **more: str | None) -> None:
        """Report a warning."""
        self.bag.warning(code, message, span, **more)

    def fail(self, code: str, message: str, span: Span, **more: str | None) -> FailedError:
        """Report an error; raising the result gives up the value it is in."""
        self.bag.error(code, message, span, **more)
        return FailedError()

    def expression(self, path: DataPath, raw: Scalar) -> ast.Expr:
        """The tree of the expression at `path`, its parameters replaced by their values."""
        if isinstance(raw, bool):
            return ast.Truth(raw)
        if isinstance(raw, float):
            raise self.fail("S204", f"`{raw:g}` is not a whole number", self.at(path))
        if isinstance(raw, int):
            return ast.Number(raw) if raw >= 0 else ast.Negative(ast.Number(-raw))
        try:
            return self._filled(parse_expression(raw), path)
        except ParseProblem as problem:
            raise self._problem(problem, path) from None

    def text(self, path: DataPath, raw: str) -> ast.Text:
        """The tree of the text at `path`, its parameters replaced by their values."""
        try:
            filled = self._filled(parse_text(raw), path)
        except ParseProblem as problem:
            raise self._problem(problem, path) from None
        assert isinstance(filled, ast.Text), "internal: a text became something else"
        return filled

    def _problem(self, problem: ParseProblem, path: DataPath) -> FailedError:
        code = "S212" if problem.code == "S004" else problem.code
        hint = problem.hint if problem.hint and problem.hint not in str(problem) else None
        if problem.words and not _NO_TEXTS & {*path}:
            hint = f"{hint}; a text is quoted: {as_text(problem.words, self.part(path))}"
        return self.fail(code, str(problem), self.at(path, problem.offset), hint=hint)

    def _filled(self, tree: ast.Expr, path: DataPath) -> ast.Expr:
        if not any(isinstance(node, ast.Parameter) for node in tree.walk()):
            return tree
        return self._replaced(tree, path)

    def _replaced(self, node: ast.Expr, path: DataPath) -> ast.Expr:
        if isinstance(node, ast.Parameter):
            return self._parameter(node, path)
        replaced: ast.Expr = rebuilt(node, lambda part: self._replaced(part, path))
        return replaced

    def _parameter(self, node: ast.Parameter, path: DataPath) -> ast.Expr:
        span = self.at(path, node.at, len(node.id) + 1)
        if node.id not in self.params:
            raise self.fail(
                "S206", f"unknown parameter `{node.id}`", span, suggestion=did_you_mean(node.id, self.params)
            )
        value = self.params[node.id]
        if isinstance(value, str):
            try:
                return ast.moved(parse_expression(value), lambda _: node.at)
            except ParseProblem as problem:
                message = f"the value `{value}` of `{node.id}` is not an expression: {problem}"
                raise self.fail("S206", message, span) from None
        if isinstance(value, float):
            raise self.fail("S204", f"the parameter `{node.id}` is {value:g}, not a whole number", span)
        return ast.moved(self.expression((), value), lambda _: node.at)


def _extent(node: ast.Expr) -> tuple[int, int]:
    """Offset and width of what a caret should mark."""
    match node:
        case ast.Name(id=word):
            return node.at, len(word)
        case ast.Attribute(name=word) | ast.Call(name=word):
            return node.name_at, len(word)
        case ast.Parameter(id=word):
            return node.at, len(word) + 1
        case ast.Number(value=value):
            return node.at, len(str(value))
        case _:
            return node.at, 1


def as_text(text: str, whole: object) -> str:
    """How a text is written in an expression: where that is the whole value, YAML takes the outer quotes away."""
    return f"""'"{text}"'""" if text == whole else f'"{text}"'


def surviving() -> suppress:
    """Go on after a value that failed; its reason has been reported."""
    return suppress(FailedError)


def dotted(path: DataPath) -> str:
    """`("outcome", 0, "success")` as `outcome[0].success`."""
    text = ""
    for part in path:
        text += f"[{part}]" if isinstance(part, int) else f".{part}" if text else part
    return text


# -- words of messages ---------------------------------------------------------------------------------------


_KINDS: Final = {
    "bool": "a condition",
    "int": "a number",
    "direction": "a direction",
    "color": "a colour",
    "action": "an action",
    "entity": "an object or a member of the cast",
    "text": "a text",
    "noun": "a noun",
    "status": "a status",
    "utterance": "an utterance",
    "cell": "a cell",
}


_PLACEHOLDERS: Final = {
    "entity": "x",
    "entities": "x",
    "int": "n",
    "direction": "up",
    "turn": "left",
    "utterance": '"..."',
    "state": "state",
    "status": "status",
    "action": "action",
    "side": "top",
    "group": "group",
    "actions": "a | b",
    "any": "x",
    "sequence": "dance",
}


def usage(signature: Signature) -> str:
    """How an instruction is written: `next_to(x)`."""
    if not signature.takes:
        return signature.name
    least = len(signature.takes) - signature.optional
    return f"{signature.name}({', '.join(_PLACEHOLDERS[kind] for kind in signature.takes[: least or None])})"


def wrong_count(signature: Signature, given: int) -> str:
    """What to say when an instruction has too few or too many values in brackets."""
    many, least = len(signature.takes), len(signature.takes) - signature.optional
    number = f"{least} or {many}" if least < many else f"{many}"
    takes = "nothing in brackets" if not many else f"{number} value{'s' if many > 1 else ''} in brackets"
    return f"`{signature.name}` takes {takes}: `{usage(signature)}`; {given} given"


def with_article(name: str) -> str:
    """What something is called, with its article: `an apple`, `a remote door`."""
    return f"{'an' if name[:1] in 'aeiou' else 'a'} {name.replace('_', ' ')}"


def described(type_: Type) -> str:
    """A type with its article: `a colour`, `a number`."""
    if type_.words == TURN.words and type_.kind == "int":
        return "a turn (left or right)"
    if type_.words == SIDE.words and type_.kind == "int":
        return "a wall (top, bottom, left or right)"
    return _KINDS[type_.kind]


def words_of(type_: Type) -> str:
    """The words of a type for a help line."""
    return ", ".join(type_.words)


def spoken(type_: Type, value: int) -> str:
    """A value as it is said in a text."""
    return type_.words[value - type_.low] if type_.words else str(value)


def quoted(node: ast.Expr) -> str:
    """An expression as an author would write it, with `...` for conditions of quantifiers and places."""
    return unparse(node, shortened=True)

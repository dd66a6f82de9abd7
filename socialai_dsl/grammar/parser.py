"""Text to syntax tree and back: one lark LALR grammar, and one message with an offset where it does not fit."""

from __future__ import annotations

import re
from functools import cache, lru_cache
from pathlib import Path
from typing import Any, Final

from lark import Lark, v_args
from lark.exceptions import UnexpectedCharacters, UnexpectedEOF, UnexpectedInput, UnexpectedToken, VisitError
from lark.visitors import Transformer_NonRecursive

from socialai_dsl.grammar import ast

MAX_LENGTH = 500
MAX_DEPTH = 24


class ParseProblem(Exception):  # noqa: N818 - a finding on its way to a diagnostic, not a failure
    """What is wrong with a string of the language: a code of the catalogue, a message and where.

    Attributes: code, message, offset (0-based, into the parsed string), hint (or None), words (several that stand
    side by side and may be a text; or None).
    """

    def __init__(
        self, code: str, message: str, offset: int, hint: str | None = None, words: str | None = None
    ) -> None:
        super().__init__(message)
        self.code, self.message, self.offset, self.hint, self.words = code, message, offset, hint, words


@lru_cache(maxsize=4096)
def parse_expression(text: str) -> ast.Expr:
    """The tree of an expression, place, activity or effect.

    Raises ParseProblem: S202 for brackets, S203 for a wrong symbol, S207 for chained comparisons,
    S210 for anything else, S004 when the text is too long or too deeply nested.
    """
    if len(text) > MAX_LENGTH:
        raise ParseProblem(
            "S004", f"an expression may have {MAX_LENGTH} characters, this one has {len(text)}", 0
        )
    _check_brackets(text)
    try:
        tree = _ToAst().transform(_parser().parse(text))
    except VisitError as error:
        if isinstance(error.orig_exc, ParseProblem):
            raise error.orig_exc from None
        raise
    except UnexpectedInput as error:
        raise _explain(text, error) from None
    assert isinstance(tree, ast.Node), "internal: lark gave no tree"
    return tree  # type: ignore[return-value]


@lru_cache(maxsize=4096)
def parse_text(text: str) -> ast.Text:
    """A text with `<...>` parts, each an expression; offsets inside count from the start of `text`."""
    parts: list[str | ast.Expr] = []
    rest = 0
    for match in re.finditer(r"<([^<>]*)>", text):
        if match.start() > rest:
            parts.append(text[rest : match.start()])
        parts.append(_parse_slot(match.group(1), match.start() + 1))
        rest = match.end()
    if rest < len(text):
        parts.append(text[rest:])
    for part in _plain_pieces(text):
        if "<" in part.group() or ">" in part.group():
            offset = part.start() + re.search("[<>]", part.group()).start()  # type: ignore[union-attr]
            raise ParseProblem("S202", "a `<` or `>` without its partner: a slot is written <name>", offset)
    return ast.Text(tuple(parts), at=0)


def _plain_pieces(text: str) -> list[re.Match[str]]:
    return list(re.finditer(r"[^<>]+|[<>]", re.sub(r"<[^<>]*>", lambda m: " " * len(m.group()), text)))


def _parse_slot(inner: str, offset: int) -> ast.Expr:
    if not inner.strip():
        raise ParseProblem("S202", "an empty slot `<>`", offset - 1)
    try:
        return ast.moved(parse_expression(inner), lambda at: at + offset)
    except ParseProblem as problem:
        raise ParseProblem(problem.code, problem.message, problem.offset + offset, problem.hint) from None


@cache
def _parser() -> Lark:
    grammar = Path(__file__).with_name("expression.lark").read_text(encoding="utf-8")
    return Lark(grammar, parser="lalr", lexer="contextual", propagate_positions=True)


@v_args(meta=True)
class _ToAst(Transformer_NonRecursive):  # type: ignore[type-arg]
    """Builds our nodes from lark's tree, bottom-up, so no recursion depends on the input."""

    def _made(self, node: Any) -> Any:
        depth = 1 + max((_depth_of(child) for child in node.children()), default=0)
        if depth > MAX_DEPTH:
            raise ParseProblem("S004", f"an expression may be nested {MAX_DEPTH} deep", node.at)
        return node

    def number(self, meta: Any, items: list[Any]) -> Any:
        if len(items[0]) > 9:
            raise ParseProblem("S004", f"the number {items[0][:12]}... is too large", meta.start_pos)
        return self._made(ast.Number(int(items[0]), at=meta.start_pos))

    def text(self, meta: Any, items: list[Any]) -> Any:
        inner = parse_text(str(items[0])[1:-1])
        return self._made(ast.moved(inner, lambda at: at + meta.start_pos + 1))

    def yes(self, meta: Any, items: list[Any]) -> Any:
        return self._made(ast.Truth(True, at=meta.start_pos))

    def no(self, meta: Any, items: list[Any]) -> Any:
        return self._made(ast.Truth(False, at=meta.start_pos))

    def parameter(self, meta: Any, items: list[Any]) -> Any:
        return self._made(ast.Parameter(str(items[0]), at=meta.start_pos))

    def name(self, meta: Any, items: list[Any]) -> Any:
        return self._made(ast.Name(str(items[0]), at=meta.start_pos))

    def binder(self, meta: Any, items: list[Any]) -> Any:
        return tuple(items)

    def args(self, meta: Any, items: list[Any]) -> Any:
        return tuple(items)

    def quantifier(self, meta: Any, items: list[Any]) -> Any:
        name, (var, group, where, to) = items
        return self._made(ast.Quantifier(str(name), str(var), group, where, to, at=meta.start_pos))

    def call(self, meta: Any, items: list[Any]) -> Any:
        name, args = items
        return self._made(ast.Call(str(name), args or (), None, name.start_pos, at=meta.start_pos))

    def verb(self, meta: Any, items: list[Any]) -> Any:
        subject, name, args = items
        return self._made(ast.Call(str(name), args or (), subject, name.start_pos, at=meta.start_pos))

    def attribute(self, meta: Any, items: list[Any]) -> Any:
        subject, name = items
        return self._made(ast.Attribute(subject, str(name), name.start_pos, at=meta.start_pos))

    def negative(self, meta: Any, items: list[Any]) -> Any:
        if items[0] != "-":
            raise ParseProblem("S203", "a leading `+` is not needed", meta.start_pos)
        return self._made(ast.Negative(items[1], at=meta.start_pos))

    def arithmetic(self, meta: Any, items: list[Any]) -> Any:
        return self._made(ast.Arithmetic(str(items[1]), items[0], items[2], at=meta.start_pos))

    def interval(self, meta: Any, items: list[Any]) -> Any:
        return self._made(ast.Interval(*items, at=meta.start_pos))

    def alternatives(self, meta: Any, items: list[Any]) -> Any:
        return self._made(ast.Alternatives(tuple(items), at=meta.start_pos))

    def comparison(self, meta: Any, items: list[Any]) -> Any:
        return self._made(ast.Compare(str(items[1]), items[0], items[2], at=meta.start_pos))

    def membership(self, meta: Any, items: list[Any]) -> Any:
        return self._made(ast.Member(items[0], items[1], at=meta.start_pos))

    def exclusion(self, meta: Any, items: list[Any]) -> Any:
        return self._made(ast.Member(items[0], items[1], True, at=meta.start_pos))

    def negation(self, meta: Any, items: list[Any]) -> Any:
        return self._made(ast.Not(items[0], at=meta.start_pos))

    def all_of(self, meta: Any, items: list[Any]) -> Any:
        return self._made(ast.Logic("and", tuple(items), at=meta.start_pos))

    def any_of(self, meta: Any, items: list[Any]) -> Any:
        return self._made(ast.Logic("or", tuple(items), at=meta.start_pos))

    def placed(self, meta: Any, items: list[Any]) -> Any:
        return self._made(ast.Placed(*items, at=meta.start_pos))


def _depth_of(node: ast.Expr) -> int:
    # Children were checked when they were made, so this recursion is bounded by MAX_DEPTH.
    return 1 + max((_depth_of(child) for child in node.children()), default=0)


_SYMBOLS = {
    "&&": "write `and`",
    "&": "write `and`",
    "||": "write `or`",
    "!": "write `not`",
    "=": "to compare write `==`",
    "/": "division is written `//`",
    "'": 'a text is quoted with "',
    "{": "a slot is written <name>",
    "[": "alternatives are written a | b",
    ";": "one expression at a time",
}


def _explain(text: str, error: UnexpectedInput) -> ParseProblem:
    """Lark's exception as one sentence of ours."""
    if isinstance(error, UnexpectedCharacters):
        offset = error.pos_in_stream
        return _wrong_symbol(text, offset or 0)
    if isinstance(error, UnexpectedEOF) or (
        isinstance(error, UnexpectedToken) and error.token.type == "$END"
    ):
        return ParseProblem(
            "S210", "the expression ends too early: something is missing at its end", len(text)
        )
    assert isinstance(error, UnexpectedToken), "internal: an unknown kind of lark error"
    token, offset = error.token, error.token.start_pos or 0
    if token.type == "CMP" and "CMP" not in error.expected:
        return ParseProblem("S207", f"comparisons do not chain: write `{_unchained(text, offset)}`", offset)
    if text.startswith("||", offset - 1):
        return _wrong_symbol(text, offset - 1)
    if token.type == "WHERE":
        return ParseProblem("S210", "`where` belongs in a place or inside pick(d in group where ...)", offset)
    if token.type == "RPAR":
        return ParseProblem("S202", "something is missing before this bracket", offset)
    hint = words = None
    if token.type == "NAME":
        words = next(found[0] for found in _SEVERAL.finditer(text) if found.start() <= offset < found.end())
        hint = "between two names stands a dot, an operator, or a word such as `and`: `agent.next_to(exit)`"
    return ParseProblem("S210", f"did not expect `{token}` here", offset, hint, words)


_SEVERAL = re.compile(
    r"\b(?!(?:and|or|not|in|where|to)\b)[\w']+(?: +(?!(?:and|or|not|in|where|to)\b)[\w']+)*"
)
"""Words with nothing but blanks between them."""

_WORDS = re.compile(r"\"[^\"]*\"|[<>=!]=|[<>()]|,|\b(?:and|or|not|where|to)\b|[^<>=!()\",\s]+|\s+|.")
"""The pieces of an expression, as far as they say where a comparison begins and ends."""

_COMPARES = frozenset({"==", "!=", "<=", ">=", "<", ">"})
_BOUNDS = frozenset({"and", "or", "not", "where", "to", ","})


def _unchained(text: str, offset: int) -> str:
    """`a < b and b < c` for the chain `a < b < c` whose second comparison stands at `offset`."""
    pieces = [(found.start(), found.group()) for found in _WORDS.finditer(text)]
    second = next(i for i, (start, _) in enumerate(pieces) if start == offset)
    first = _same_level(pieces, second, -1, _COMPARES)
    left = _same_level(pieces, first, -1, _BOUNDS)
    right = _same_level(pieces, second, 1, _BOUNDS | _COMPARES)

    def words(begin: int, end: int) -> str:
        return " ".join("".join(piece for _, piece in pieces[begin:end]).split())

    shared = words(first + 1, second)
    return f"{words(left + 1, second)} and {shared} {words(second, right)}"


def _same_level(pieces: list[tuple[int, str]], start: int, step: int, ends: frozenset[str]) -> int:
    """The first of `ends` on one side of `start` that is not in brackets; else the bracket around, or the end."""
    opening, closing = ("(", ")") if step > 0 else (")", "(")
    depth, i = 0, start + step
    while 0 <= i < len(pieces):
        piece = pieces[i][1]
        if depth == 0 and (piece in ends or piece == closing):
            return i
        depth += (piece == opening) - (piece == closing)
        i += step
    return i


_NUMBERED = re.compile(r"(?P<group>\w+)\[\s*(?P<index>[^\[\]]+?)\s*\]")
"""`doors[0]`, `doors[turn + 1]`"""


def _wrong_symbol(text: str, offset: int) -> ParseProblem:
    numbered = next((found for found in _NUMBERED.finditer(text) if found.end("group") == offset), None)
    if numbered is not None:
        letter = "o" if numbered["group"] == "d" else "d"
        found = f"first({letter} in {numbered['group']} where {letter}.index == {numbered['index']})"
        cure = f"one of a group is found by `{found}`"
        return ParseProblem("S203", f"`[` is not used here: {cure}", offset, cure)
    for symbol, cure in _SYMBOLS.items():
        if text.startswith(symbol, offset):
            return ParseProblem("S203", f"`{symbol}` is not used here: {cure}", offset, cure)
    return ParseProblem("S203", f"`{text[offset]}` means nothing here", offset)


def _check_brackets(text: str) -> None:
    """Unbalanced brackets are the commonest slip and lark reports them far from the cause."""
    opened: list[int] = []
    quote: int | None = None
    for offset, char in enumerate(text):
        if char == '"':
            quote = offset if quote is None else None
        elif quote is not None:
            continue
        elif char == "(":
            opened.append(offset)
            if len(opened) > MAX_DEPTH:
                raise ParseProblem("S004", f"an expression may be nested {MAX_DEPTH} deep", offset)
        elif char == ")":
            if not opened:
                raise ParseProblem("S202", "a bracket is closed that was not opened", offset)
            opened.pop()
    if quote is not None:
        raise ParseProblem("S202", 'a text is not closed: its second `"` is missing', quote)
    if opened:
        raise ParseProblem("S202", "a bracket is not closed", opened[-1])


_OR, _AND, _NOT, _COMPARED, _CHOICE, _RANGE, _SUM, _PRODUCT, _UNARY, _ATOM = range(10)
_ARITHMETIC: Final = {"+": _SUM, "-": _SUM, "*": _PRODUCT, "//": _PRODUCT, "%": _PRODUCT}


def unparse(node: ast.Expr, shortened: bool = False) -> str:
    """The expression in one line; parsing it gives the same tree again, but for the offsets.

    `shortened`, for messages: what is said about each of a group, or about a place, is `...`.
    """
    return _Writer(shortened).write(node)


class _Writer:
    """Writes expressions, whole or shortened."""

    def __init__(self, shortened: bool) -> None:
        self._shortened = shortened

    def write(self, node: ast.Expr) -> str:
        match node:
            case ast.Number(value=number):
                return str(number)
            case ast.Truth(value=truth):
                return "true" if truth else "false"
            case ast.Text(parts=parts):
                return '"' + "".join(p if isinstance(p, str) else f"<{self.write(p)}>" for p in parts) + '"'
            case ast.Name(id=word):
                return word
            case ast.Parameter(id=word):
                return f"${word}"
            case ast.Attribute(subject=subject, name=word):
                return f"{self._inside(subject, _ATOM)}.{word}"
            case ast.Call(name=word, args=arguments, subject=owner):
                head = f"{self._inside(owner, _ATOM)}.{word}" if owner is not None else word
                return f"{head}({', '.join(map(self.write, arguments))})"
            case ast.Quantifier(name=word, var=var, group=group) if self._shortened:
                return f"{word}({var} in {self._inside(group, _CHOICE)} ...)"
            case ast.Placed(region=region) if self._shortened:
                return f"{self.write(region)} where ..."
            case ast.Quantifier(name=word, var=var, group=group, where=where, to=to):
                tail = f" where {self.write(where)}" if where is not None else ""
                tail += f" to {self.write(to)}" if to is not None else ""
                return f"{word}({var} in {self._inside(group, _CHOICE)}{tail})"
            case ast.Placed(region=region, where=where):
                return f"{self.write(region)} where {self.write(where)}"
            case _:
                return self._operation(node)

    def _operation(self, node: ast.Expr) -> str:
        own = _strength(node)
        match node:
            case ast.Not(operand=operand):
                return f"not {self._inside(operand, own)}"
            case ast.Logic(op=op, operands=operands):
                return f" {op} ".join(self._inside(operand, own + 1) for operand in operands)
            case ast.Compare(op=op, left=left, right=right):
                return f"{self._inside(left, own + 1)} {op} {self._inside(right, own + 1)}"
            case ast.Member(left=left, right=right, negated=negated):
                return f"{self._inside(left, own + 1)} {'not in' if negated else 'in'} {self._inside(right, own + 1)}"
            case ast.Alternatives(options=options):
                return " | ".join(self._inside(option, own + 1) for option in options)
            case ast.Interval(low=low, high=high):
                return f"{self._inside(low, own + 1)}..{self._inside(high, own + 1)}"
            case ast.Arithmetic(op=op, left=left, right=right):
                return f"{self._inside(left, own)} {op} {self._inside(right, own + 1)}"
            case ast.Negative(operand=operand):
                return f"-{self._inside(operand, own)}"
        raise AssertionError(f"internal: no text for {type(node).__name__}")

    def _inside(self, node: ast.Expr, least: int) -> str:
        """A part of another expression, in brackets where it binds less than that needs."""
        text = self.write(node)
        return text if _strength(node) >= least else f"({text})"


def _strength(node: ast.Expr) -> int:
    match node:
        case ast.Logic(op=op):
            return _OR if op == "or" else _AND
        case ast.Not():
            return _NOT
        case ast.Compare() | ast.Member():
            return _COMPARED
        case ast.Alternatives():
            return _CHOICE
        case ast.Interval():
            return _RANGE
        case ast.Arithmetic(op=op):
            return _ARITHMETIC[op]
        case ast.Negative():
            return _UNARY
        case _:
            return _ATOM

"""This module writes a tree of an expression as text again, as an author would."""

from __future__ import annotations

from typing import Final

from socialai_dsl.grammar import ast

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

"""How messages call types, and how they quote expressions."""

from __future__ import annotations

from typing import Final

from socialai_dsl.grammar import ast
from socialai_dsl.semantics.signatures import Signature
from socialai_dsl.semantics.terms import SIDE, TURN, Type

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
    """An expression as an author would write it."""
    match node:
        case ast.Number(value=number):
            return str(number)
        case ast.Truth(value=truth):
            return "true" if truth else "false"
        case ast.Text(parts=parts):
            return '"' + "".join(p if isinstance(p, str) else f"<{quoted(p)}>" for p in parts) + '"'
        case ast.Name(id=word):
            return word
        case ast.Parameter(id=word):
            return f"${word}"
        case ast.Attribute(subject=subject, name=word):
            return f"{quoted(subject)}.{word}"
        case ast.Call(name=word, args=arguments, subject=owner):
            head = f"{quoted(owner)}.{word}" if owner is not None else word
            return f"{head}({', '.join(map(quoted, arguments))})"
        case ast.Quantifier(name=word, var=var, group=group):
            return f"{word}({var} in {quoted(group)} ...)"
        case ast.Not(operand=operand):
            return f"not {quoted(operand)}"
        case ast.Logic(op=op, operands=operands):
            return f" {op} ".join(map(quoted, operands))
        case ast.Compare(op=op, left=left, right=right) | ast.Arithmetic(op=op, left=left, right=right):
            return f"{quoted(left)} {op} {quoted(right)}"
        case ast.Member(left=left, right=right, negated=negated):
            return f"{quoted(left)} {'not in' if negated else 'in'} {quoted(right)}"
        case ast.Alternatives(options=options):
            return " | ".join(map(quoted, options))
        case ast.Interval(low=low, high=high):
            return f"{quoted(low)}..{quoted(high)}"
        case ast.Negative(operand=operand):
            return f"-{quoted(operand)}"
        case ast.Placed(region=region):
            return f"{quoted(region)} where ..."

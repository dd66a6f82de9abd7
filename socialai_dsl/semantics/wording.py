"""How messages call types, and how they quote expressions."""

from __future__ import annotations

from typing import Final

from socialai_dsl.grammar import ast
from socialai_dsl.grammar.unparse import unparse
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
    """An expression as an author would write it, with `...` for conditions of quantifiers and places."""
    return unparse(node, shortened=True)

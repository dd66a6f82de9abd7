"""Write docs/reference.md, every key and word of the language as the engine has them: `make reference`."""

import argparse
import re
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from types import NoneType
from typing import TYPE_CHECKING, Any, Final, get_args, get_origin

from socialai_dsl.cli.errors import Exit
from socialai_dsl.cli.main import run_alone

if TYPE_CHECKING:
    from pydantic.fields import FieldInfo

    from socialai_dsl.schema.holds import Holds
    from socialai_dsl.semantics.signatures import Signature

SUMMARY: Final = "print every key and word of the language as a page of Markdown"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of this command."""
    parser.add_argument("--out", type=Path, metavar="FILE", help="write the page to a file instead")


def execute(arguments: argparse.Namespace) -> Exit:
    """Print or write the page."""
    page = reference_page()
    if arguments.out is None:
        print(page, end="")
    else:
        arguments.out.write_text(page, encoding="utf-8")
    return Exit.GOOD


_INTRODUCTION: Final = """\
# Reference

Every key and every word of the language. `make reference` takes this page from the engine itself. [The scenario
language](language.md) explains how keys and words work together.

"""


def reference_page() -> str:
    """The page as Markdown."""
    parts = [*_keys(), *_words(), *_types(), *_grammars()]
    return _INTRODUCTION + "\n".join(parts).rstrip("\n") + "\n"


# -- keys --------------------------------------------------------------------------------------------------------------


def _keys() -> Iterator[str]:
    from socialai_dsl.schema.annotations import CALLED, keys_of

    yield "## Keys\n"
    for model, called in CALLED.items():
        yield f"### {_heading(called)}\n"
        yield _one_line(model.__doc__ or "") + "\n"
        yield "| key | value | default | meaning |\n|---|---|---|---|"
        yield from (_row(model, key) for key in keys_of(model))
        yield from _read_before(model)
        yield ""


def _read_before(model: type) -> Iterator[str]:
    """The keys that authors write and that are gone when the model is made."""
    from socialai_dsl.schema.annotations import CALLED, keys_of

    written_for: list[type] = model.__subclasses__()
    for written in written_for:
        for key in keys_of(written) if written not in CALLED else ():
            if key not in keys_of(model):
                yield _row(written, key).replace("| required |", "|  |")


def _row(model: type, key: str) -> str:
    from socialai_dsl.schema.annotations import fields_of

    field = next(field for name, field in _fields(model) if key in (field.alias, name))
    cells = (f"`{key}`", _value(fields_of(model)[key]), _default(field), _cell(field.description or ""))
    return f"| {' | '.join(cells)} |"


def _fields(model: type) -> list[tuple[str, "FieldInfo"]]:
    fields: dict[str, FieldInfo] = model.model_fields  # type: ignore[attr-defined]
    return list(fields.items())


def _heading(called: str) -> str:
    plain = re.sub(r"^(a|an|the) ", "", called).replace("`", "")
    return plain[0].upper() + plain[1:]


def _anchor(called: str) -> str:
    return re.sub(r"[^\w -]", "", _heading(called).lower()).replace(" ", "-")


def _default(field: "FieldInfo") -> str:
    from pydantic import BaseModel

    if field.is_required():
        return "required"
    default = field.default
    if (
        field.default_factory is not None
        or default is None
        or default == ()
        or isinstance(default, BaseModel)
    ):
        return ""
    if isinstance(default, bool):
        return f"`{str(default).lower()}`"
    return f"`[{', '.join(default)}]`" if isinstance(default, tuple) else f"`{default}`"


def _value(annotation: Any, around: Sequence[Any] = ()) -> str:
    """What may be written, in words; `around` is what annotations around it say."""
    from typing import Annotated, Literal

    from socialai_dsl.schema.annotations import CALLED
    from socialai_dsl.schema.holds import Holds

    origin, arguments = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        return _value(arguments[0], (*annotation.__metadata__, *around))
    held = next((word for word in reversed(around) if isinstance(word, Holds)), None)
    if origin in (list, tuple):
        item = _value(arguments[0], [held])
        return f"{item}, or a list" if _one_will_do(around) else f"a list, each {item}"
    if annotation in CALLED:
        model = f"[{CALLED[annotation]}](#{_anchor(CALLED[annotation])})"
        named = _named(held)
        return model if not named else named if held and held.kind == "file" else f"{model}, or {named}"
    if origin is Literal:
        words = [f"`{word}`" for word in arguments]
        return " or ".join(words) if len(words) < 3 else "one of " + ", ".join(words)
    if origin is dict:
        return f"names, each with {_value(arguments[1])}"
    parts = [part for part in arguments if part is not NoneType]
    scalars = {part for part in parts or [annotation] if part in _SCALARS}
    if named := _named(held) if scalars or not parts else "":
        others = [_value(part) for part in parts if part not in _SCALARS]
        return " or ".join([named, *others])
    if {int, bool, str} <= scalars:
        value = "a value" if float in scalars else "an expression"
        return " or ".join([value, *(_value(part) for part in parts if part not in scalars)])
    if annotation in _SCALARS:
        return _SCALARS[annotation] + _bounds(around)
    return " or ".join(dict.fromkeys(_value(part, around) for part in parts)) or "a value"


def _named(held: "Holds | None") -> str:
    """What is held, if that says more than the kind of the value."""
    if held is None or held.kind != "name":
        return _HELD.get(held.kind, "") if held is not None else ""
    if held.of == ("grammars",):
        return "the name of [a shared one](#shared-grammars)"
    if held.of == ("types",):
        return "the name of [a type](#object-types)"
    return f"the name of one of {' or '.join(f'`{section}`' for section in held.of)}"


_HELD: Final = {
    "activity": "[an activity](#activities)",
    "effect": "[an effect](#effects)",
    "place": "[a place](#places)",
    "state": "the name of a state",
    "new name": "a name",
    "file": "a file",
}
"""Kinds of values in words, where these say more than that they are texts or expressions."""


_SCALARS: Final = {
    int: "a whole number",
    float: "a number",
    bool: "`true` or `false`",
    str: "a text",
    Any: "anything",
}


def _one_will_do(around: Sequence[Any]) -> bool:
    """Whether one item may be written in place of the list of it."""
    from socialai_dsl.schema.holds import branches

    forms = [form for word in around if (form := getattr(word, "json_schema_input_type", None)) is not None]
    return any(
        get_origin(part) not in (list, tuple) for form in forms for part in branches(form) if part in _SCALARS
    )


def _bounds(around: Sequence[Any]) -> str:
    low = next((data.ge for data in around if hasattr(data, "ge")), None)
    high = next((data.le for data in around if hasattr(data, "le")), None)
    return f", {low} to {high}" if low is not None and high is not None else ""


def _one_line(text: str) -> str:
    return " ".join(text.split())


def _cell(text: str) -> str:
    return _one_line(text).replace("|", "\\|")


# -- words -------------------------------------------------------------------------------------------------------------

_SUBJECTS: Final = {
    "entity": "a.",
    "member": "n.",
    "agent": "a.",
    "object": "o.",
    "none": "",
    "cell": "here.",
}

_ARGUMENTS: Final = {
    "entity": "x", "entities": "x", "int": "n", "direction": "direction", "turn": "turn", "utterance": '"text"',
    "state": "state", "status": "status", "action": "action", "side": "side", "group": "d in group where c",
    "any": "e", "actions": "a \\| b", "sequence": "sequence",
}  # fmt: skip


def _words() -> Iterator[str]:
    from socialai_dsl.semantics.words import ACTIVITIES, EFFECTS, NAMES, PLACES, VALUES

    yield "## Words\n"
    yield (
        "`a` is a member of the cast or an object, `n` a member, `o` an object, `x` one of them, a cell or a group,\n"
        'any member of which suffices. "It" is what stands before the dot; in a frame that may be left out, and\n'
        "is then the member that follows the frame.\n"
        "[Expressions](language.md#expressions) has the rules for all of them.\n"
    )
    yield "### Conditions and values\n"
    yield "| word | gives | meaning |\n|---|---|---|"
    for value in VALUES.values():
        yield f"| `{_written(value)}` | {value.gives} | {_cell(value.doc)} |"
    yield ""
    yield "### Names\n"
    yield "| name | meaning |\n|---|---|"
    yield from (f"| `{name}` | {_cell(meaning)} |" for name, meaning in NAMES.items())
    yield ""
    others: dict[str, Iterable[Signature]] = {
        "Places": PLACES.values(), "Activities": ACTIVITIES.values(), "Effects": EFFECTS.values(),
    }  # fmt: skip
    for heading, words in others.items():
        yield f"### {heading}\n"
        yield "| word | meaning |\n|---|---|"
        for word in words:
            yield f"| `{_written(word)}` | {_cell(word.doc)} |"
        yield ""


_NAMED_ARGUMENTS: Final = {
    "rect": ["x0", "y0", "x1", "y1"],
    "column": ["x"],
    "row": ["y"],
    "each_wall": ["margin"],
}  # fmt: skip
"""Word -> its arguments, where their kinds would not tell them apart."""


def _written(signature: "Signature") -> str:
    takes = [_ARGUMENTS[kind] for kind in signature.takes]
    if signature.name in _NAMED_ARGUMENTS:
        takes = _NAMED_ARGUMENTS[signature.name]
    elif len(takes) == 2 and takes[0] == takes[1]:
        takes = [takes[0], takes[0].replace("n", "m").replace("x", "y")]
    elif signature.name == "nearest":
        takes = ["d in group where c to y"]
    subject = _SUBJECTS[signature.subject]
    if not takes:
        return subject + signature.name
    return f"{subject}{signature.name}({', '.join(takes)})"


# -- what comes with the engine ----------------------------------------------------------------------------------------


def _types() -> Iterator[str]:
    from socialai_dsl.library import prelude

    yield "## Object types\n"
    yield (
        "The image shows a status as its place among the statuses, from 0; the initial one is in *italics*.\n"
        "A toggle, a push and the end of a `timer` change the status as their columns say. In an *active* status the\n"
        "object works on what it `unlocks` or `opens`.\n"
    )
    titles = (
        "type",
        "code",
        "statuses",
        "can be entered",
        "can be seen through",
        "toggle",
        "push",
        "timer",
        "active",
        "colour",
    )
    yield f"| {' | '.join(titles)} |\n|{'---|' * len(titles)}"
    for name, type_ in prelude().types.items():
        statuses = [f"*{word}*" if i == type_.initial else word for i, word in enumerate(type_.states)]
        cells = [f"`{name}`", str(type_.code), ", ".join(statuses)]
        for allowed in (type_.walkable, type_.transparent):
            found = [type_.states[i] for i in sorted(allowed)]
            cells.append("always" if len(found) == len(statuses) else ", ".join(found) or "never")
        cells[3] += ", deadly" if type_.deadly else ""
        cells += [_changes(type_.states, becomes) for becomes in (type_.toggled, type_.pushed, type_.expired)]
        cells += [", ".join(type_.states[i] for i in sorted(type_.active)), prelude().colors[name]]
        yield f"| {' | '.join(cells)} |"
    yield ""


def _changes(states: Sequence[str], becomes: Mapping[int, int]) -> str:
    return ", ".join(f"{states[before]} -> {states[after]}" for before, after in becomes.items())


def _grammars() -> Iterator[str]:
    from socialai_dsl.library import shared_grammars
    from socialai_dsl.schema.scenario import UtteranceGrammar

    yield "## Shared grammars\n"
    yield "| name | templates | nouns |\n|---|---|---|"
    for name, written in shared_grammars().items():
        grammar = UtteranceGrammar.model_validate(written)
        templates = ", ".join(f"`{text}`" for text in grammar.templates)
        nouns = ", ".join(map(str, grammar.nouns))
        yield f"| `{name}` | {templates} | {nouns} |"
    yield ""


def main(argv: Sequence[str] | None = None) -> int:
    """Run this script and return its exit code."""
    return run_alone("python -m tools.reference", sys.modules[__name__], argv)


if __name__ == "__main__":
    sys.exit(main())

"""Write docs/reference.md, every key and word of the language as the engine has them: `make reference`."""

import argparse
import re
import sys
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from types import NoneType
from typing import TYPE_CHECKING, Any, Final, get_args, get_origin

from socialai_dsl.cli.errors import Exit
from socialai_dsl.cli.main import run_alone

if TYPE_CHECKING:
    from pydantic.fields import FieldInfo

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

Every key and every word of the language, as `make reference` takes them from the engine itself. What they are
for, and how they work together, is explained in [The scenario language](language.md).

"""


def reference_page() -> str:
    """The page as Markdown."""
    parts = [*_keys(), *_words(), *_types(), *_grammars()]
    return _INTRODUCTION + "\n".join(parts).rstrip("\n") + "\n"


# -- keys --------------------------------------------------------------------------------------------------------------


def _keys() -> Iterator[str]:
    from socialai_dsl.schema.annotations import CALLED

    yield "## Keys\n"
    for model, called in CALLED.items():
        yield f"### {_heading(called)}\n"
        yield _one_line(model.__doc__ or "") + "\n"
        yield "| key | value | default | meaning |\n|---|---|---|---|"
        for name, field in _fields(model):
            value = _AS_WRITTEN.get((called, name)) or _value(field.annotation, field)
            meaning = _cell(field.description or "")
            yield f"| `{field.alias or name}` | {value} | {_default(field)} | {meaning} |"
        yield from _READ_BEFORE.get(called, ())
        yield ""


_AS_WRITTEN: Final = {
    ("a member of the cast", "one_of"): "a file, or a list",
    ("an npc file", "one_of"): "a file, or a list",
    ("a scenario", "grammar"): "[a grammar](#grammar), or the name of [a shared one](#shared-grammars)",
}
"""What authors write where the models see something else."""

_EXTENDS: Final = "| `extends` | a file |  | the file it builds on; its own keys win |"
_READ_BEFORE: Final = {
    "a scenario": (_EXTENDS,),
    "an npc file": (_EXTENDS,),
    "a member of the cast": (
        "| `count` | a whole number, 1 to 16 |  | makes a group; `name`, `color`, `place`, `facing`, `at` may then be "
        "lists |",
    ),
}
"""Keys that are gone when the models see a file."""


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


def _value(annotation: Any, field: "FieldInfo | None" = None) -> str:
    """What may be written, in words."""
    from typing import Annotated, Literal

    from socialai_dsl.schema.annotations import CALLED

    origin, arguments = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        return _value(arguments[0])
    if annotation in CALLED:
        return f"[{CALLED[annotation]}](#{_anchor(CALLED[annotation])})"
    if annotation in _SCALARS:
        return _SCALARS[annotation] + _bounds(field)
    if origin is Literal:
        words = [f"`{word}`" for word in arguments]
        return " or ".join(words) if len(words) < 3 else "one of " + ", ".join(words)
    if origin is dict:
        return f"names, each with {_value(arguments[1])}"
    if origin in (list, tuple):
        item = _value(arguments[0])
        return f"{item}, or a list" if _one_will_do(field) else f"a list, each {item}"
    branches = [part for part in arguments if part is not NoneType]
    if {int, bool, str} <= set(map(_plain, branches)):
        rest = [part for part in branches if _plain(part) not in (int, bool, str, float)]
        scalars = "a value" if float in map(_plain, branches) else "an expression"
        return " or ".join([scalars, *map(_value, rest)])
    return " or ".join(dict.fromkeys(_value(part, field) for part in branches))


_SCALARS: Final = {
    int: "a whole number",
    float: "a number",
    bool: "`true` or `false`",
    str: "a text",
    Any: "anything",
}


def _one_will_do(field: "FieldInfo | None") -> bool:
    validators = [getattr(data, "func", None) for data in field.metadata] if field is not None else []
    return any(getattr(function, "__name__", "") == "_one_or_many" for function in validators)


def _plain(part: Any) -> Any:
    return part if isinstance(part, type) else str(part)


def _bounds(field: "FieldInfo | None") -> str:
    if field is None:
        return ""
    low = next((data.ge for data in field.metadata if hasattr(data, "ge")), None)
    high = next((data.le for data in field.metadata if hasattr(data, "le")), None)
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
    from socialai_dsl.semantics.words import ACTIVITIES, EFFECTS, PLACES, VALUES

    yield "## Words\n"
    yield (
        "`a` is anybody or anything in the room, `n` a member of the cast, `o` an object, `x` one of them, a cell or\n"
        "a group, of which any one suffices. In a frame what stands before the dot may be left out, and is then the\n"
        "NPC itself.\n"
    )
    yield "### Conditions and values\n"
    yield "| word | gives | meaning |\n|---|---|---|"
    for value in VALUES.values():
        yield f"| `{_written(value)}` | {value.gives} | {_cell(value.doc)} |"
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


def _written(signature: "Signature") -> str:
    takes = [_ARGUMENTS[kind] for kind in signature.takes]
    if signature.name in ("rect",):
        takes = ["x0", "y0", "x1", "y1"]
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
    yield "| type | code | statuses, the initial one first | can be entered | colour |\n|---|---|---|---|---|"
    for name, type_ in prelude().types.items():
        states = [type_.states[type_.initial], *(s for i, s in enumerate(type_.states) if i != type_.initial)]
        walkable = [type_.states[i] for i in sorted(type_.walkable)]
        always = len(walkable) == len(states)
        entered = "always" if always else ", ".join(walkable) or "never"
        yield f"| `{name}` | {type_.code} | {', '.join(states)} | {entered} | {prelude().colors[name]} |"
    yield ""


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

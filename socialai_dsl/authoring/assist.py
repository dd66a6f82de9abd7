"""Answers for editors: meanings, declarations, completions."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Literal

from pydantic import BaseModel

from socialai_dsl.authoring.cursor import Cursor, completion_at, word_at
from socialai_dsl.authoring.names import Name, frame_of, meant, part_at, visible
from socialai_dsl.library import prelude, shared_grammars
from socialai_dsl.loader.reader import yaml_files
from socialai_dsl.loader.resolved import taken_apart
from socialai_dsl.schema.annotations import annotation_at, held_at, literals, model_at, named_by_keys
from socialai_dsl.schema.files import ScenarioFile, model_of_file
from socialai_dsl.schema.holds import TEXTS, Holds
from socialai_dsl.schema.scenario import CastGroup
from socialai_dsl.semantics.dialogues import ENDS
from socialai_dsl.semantics.signatures import Signature
from socialai_dsl.semantics.typed import STANDING
from socialai_dsl.semantics.words import ACTIVITIES, EFFECTS, NAMES, PLACES, QUANTIFIERS, SIGNATURES, VALUES
from socialai_dsl.source import Data, DataPath, Node
from socialai_dsl.vocabulary import PRIMITIVES

Kind = Literal["key", "name", "verb", "word", "file"]


@dataclass(frozen=True)
class Offer:
    """Something that can be written: the text, what it is, and one line about it."""

    text: str
    kind: Kind
    about: str


# -- hover ---------------------------------------------------------------------------------------------------------


def explain(document: Node, data: Data, line: int, column: int) -> tuple[str, Cursor] | None:
    """The meaning of the word at a position, as Markdown, and its range; None if it is unknown.

    Args:
        document: the file.
        data: what the file is with everything it builds on, or its own data.
        line: from 1.
        column: from 1.
    """
    cursor = word_at(document, line, column)
    if cursor is None:
        return None
    about = _about_key(cursor, document.data) if cursor.is_key else None
    about = about or _about_word(cursor, data)
    return (about, cursor) if about else None


def _about_key(cursor: Cursor, data: Data) -> str | None:
    model = _model_of(data, cursor.path[:-1])
    for name, field in model.model_fields.items() if model is not None else ():
        if cursor.path[-1] == (field.alias or name) and field.description:
            examples = "".join(f"\n\nfor example `{example}`" for example in (field.examples or [])[:1])
            return f"**{cursor.path[-1]}**: {field.description}{examples}"
    return None


def _about_word(cursor: Cursor, data: Data) -> str | None:
    word = cursor.word.removeprefix("$")
    before = cursor.before + ("$" if cursor.word.startswith("$") else "")
    for name in [*meant(data, cursor.path, _held(cursor), before), *_declares(cursor)]:
        if name.word == word:
            return f"**{word}**: {name.kind}"
    for signature in _signatures(cursor):
        if signature.name == word:
            return f"**{usage(signature)}**: {signature.doc}"
    return f"**{word}**: {NAMES[word]}" if word in NAMES and not cursor.is_key else None


def _declares(cursor: Cursor) -> Iterator[Name]:
    """The name itself, at the place that declares it."""
    if cursor.is_key:
        yield from (name for name in visible(cursor.data, cursor.path) if name.path == cursor.path)


_TABLES: Final[dict[str, Mapping[str, Signature]]] = {
    "activity": ACTIVITIES, "effect": EFFECTS, "place": PLACES, "expression": VALUES, "interval": VALUES,
}  # fmt: skip
"""What a key holds -> the words of the language that stand there."""


def _held(cursor: Cursor) -> Holds | None:
    """What the place of a cursor holds; of a key, what it names."""
    root = _root(cursor.data) or ScenarioFile
    return named_by_keys(root, cursor.path[:-1]) if cursor.is_key else held_at(root, cursor.path)


def _signatures(cursor: Cursor) -> Iterable[Signature]:
    """The instructions that a word may be, those that fit its place first."""
    held = _held(cursor)
    if cursor.is_key or _is_prose(held) or (_is_text(held) and not _is_in_value(cursor)):
        return ()
    table = _TABLES.get(held.kind if held is not None else "", VALUES)
    return (*table.values(), *(s for s in SIGNATURES if s.name not in table))


def _is_text(held: Holds | None) -> bool:
    """Whether a text stands there, in which only values are expressions."""
    return held is not None and held.kind in TEXTS - {"state"}


def _is_in_value(cursor: Cursor) -> bool:
    """Whether a word of a text is part of a value in < >."""
    return cursor.before.rfind("<") > cursor.before.rfind(">")


def _is_prose(held: Holds | None) -> bool:
    """Whether a text for people stands there, in which words of the language mean nothing."""
    return held is not None and held.kind in ("prose", "told", "label")


def usage(signature: Signature) -> str:
    """How an instruction is written: `a.next_to(x)`."""
    subject = "" if signature.subject == "none" else "a."
    if signature.name in QUANTIFIERS:
        return f"{signature.name}(d in group where ...)"
    taken = ["x" if argument in ("entity", "entities") else argument for argument in signature.takes]
    least = len(taken) - signature.optional
    taken = taken[:least] + [f"{argument}?" for argument in taken[least:]]
    return f"{subject}{signature.name}" + (f"({', '.join(taken)})" if taken else "")


# -- definitions ---------------------------------------------------------------------------------------------------


def declaration(document: Node, data: Data, line: int, column: int) -> DataPath | Path | None:
    """Where the word at a position is declared: a path in `data`, or a file; None if nowhere."""
    cursor = word_at(document, line, column)
    if cursor is None:
        return None
    file = _named_file(document, cursor)
    if file is not None:
        return file
    word = cursor.word.removeprefix("$")
    before = cursor.before + ("$" if cursor.word.startswith("$") else "")
    names = meant(data, cursor.path, _held(cursor), before)
    return next((name.path for name in names if name.word == word), None)


def _named_file(document: Node, cursor: Cursor) -> Path | None:
    held, folder = _held(cursor), document.source.path.parent if document.source.path is not None else None
    value = cursor.path[-1] if cursor.is_key else part_at(document.data, cursor.path)
    if folder is None or held is None or held.kind != "file" or not isinstance(value, str):
        return None
    name = taken_apart(value, folder)[0]
    for candidate in (folder / name, folder / f"{name}.yaml"):
        if candidate.is_file():
            return candidate
    return None


# -- completion ----------------------------------------------------------------------------------------------------


def complete(text: str, whole: Data, folder: Path | None, line: int, column: int) -> list[Offer]:
    """The completions at a position.

    Args:
        text: the file as it is now, which need not be YAML.
        whole: the last data known of it with everything it builds on; None if there was none.
        folder: where it is.
        line: from 1.
        column: from 1.
    """
    cursor = completion_at(text, line, column)
    if cursor is None:
        return []
    offers = list(_offers(cursor, whole if whole is not None else cursor.data, folder))
    unique = {offer.text: offer for offer in reversed(offers)}
    return [offer for offer in unique.values() if offer.text.startswith(cursor.word.lstrip("$"))][::-1]


def _offers(cursor: Cursor, data: Data, folder: Path | None) -> Iterator[Offer]:
    if cursor.is_key:
        yield from _keys(cursor, cursor.path[:-1], data)
        return
    root, held = _root(cursor.data), _held(cursor)
    kind = held.kind if held is not None else ""
    if not cursor.before.strip():
        yield from _keys(cursor, cursor.path, data)
        words = literals(annotation_at(root, cursor.path)) if root is not None else []
        yield from (Offer(str(word), "word", "") for word in words)
    if cursor.word.startswith("$"):
        yield from _names(meant(data, cursor.path, held, "$"))
    elif kind == "file" and folder is not None:
        yield from (Offer(name, "file", "a file beside this one") for name in yaml_files(folder))
    elif kind in ("act", "utterance"):
        acts = (*PRIMITIVES, *STANDING[1:]) if kind == "act" else ()
        yield from (Offer(word, "word", "a movement") for word in acts)
        yield from _utterances(data)
    elif kind == "ending":
        yield from (Offer(word, "word", "how an episode ends") for word in (*ENDS, *_ids(data)))
    elif held == Holds("name", ("types",)):
        yield from (Offer(name, "word", "an object type") for name in prelude().types)
    elif held == Holds("name", ("grammars",)):
        yield from (Offer(name, "word", "a grammar that all can use") for name in shared_grammars())
    elif not _is_prose(held) and (not _is_text(held) or _is_in_value(cursor)):
        yield from _in_expression(cursor, data, held)


def _names(names: Iterable[Name]) -> Iterator[Offer]:
    return (Offer(name.word, "name", name.kind) for name in names)


def _keys(cursor: Cursor, path: DataPath, data: Data) -> Iterator[Offer]:
    """The keys that the mapping at a path does not have yet."""
    held = _held(cursor)
    if cursor.is_key and held is not None and held.kind == "name":
        yield from (Offer(name.word, "key", name.kind) for name in meant(data, cursor.path, held, ""))
        return
    given = part_at(cursor.data, path)
    model = _model_of(cursor.data, path)
    for name, field in model.model_fields.items() if model is not None else ():
        key = field.alias or name
        if not isinstance(given, dict) or key not in given:
            yield Offer(key, "key", field.description or "")


def _in_expression(cursor: Cursor, data: Data, held: Holds | None) -> Iterator[Offer]:
    kind = held.kind if held is not None else ""
    if cursor.before.endswith("."):
        table = _TABLES["effect" if kind == "effect" else "expression"]
        subject = cursor.before.removesuffix(".").split(" ")[-1].lstrip("(!<")
        yield from _verbs(table.values(), _kinds_of(subject, data))
        return
    yield from _names(meant(data, cursor.path, held, cursor.before))
    if cursor.before.endswith("is(") or kind in ("state", "name", "new name"):
        return
    inner = "(" in cursor.before or "<" in cursor.before
    tables = [_TABLES[kind]] if kind in ("place", "expression", "interval") else []
    tables += [ACTIVITIES] if kind == "activity" and "(" not in cursor.before else []
    tables += [VALUES] if inner and VALUES not in tables else []
    for table in tables:
        yield from _verbs(table.values(), {"none"} if table is not VALUES else {"none", "own"})
    if VALUES in tables or kind in ("effect", "place"):
        yield from (Offer(word, "word", about) for word, about in NAMES.items())


def _kinds_of(subject: str, data: Data) -> set[str]:
    """The kinds of subject that a name before a dot is."""
    if subject == "agent":
        return {"entity", "member", "agent", "cell"}
    if subject == "here":
        return {"cell"}
    objects = part_at(data, ("objects",))
    if isinstance(objects, dict) and subject.partition("[")[0] in objects:
        return {"entity", "object"}
    if frame_of(data, subject) is not None or part_at(data, ("cast", subject)) is not None:
        return {"entity", "member"}
    return {"entity", "member", "object", "agent"}


def _verbs(signatures: Iterable[Signature], subjects: set[str]) -> Iterator[Offer]:
    for signature in signatures:
        own = "own" in subjects and signature.subject in ("entity", "member")
        if signature.subject in subjects or own or (signature.cell and "cell" in subjects):
            yield Offer(signature.name, "verb", f"{usage(signature)}: {signature.doc}")


def _utterances(data: Data) -> Iterator[Offer]:
    """What the agent can say."""
    grammar = part_at(data, ("grammar",))
    if isinstance(grammar, str):
        grammar = shared_grammars().get(grammar)
    templates, nouns, slots = (part_at(grammar, (key,)) for key in ("templates", "nouns", "slots"))
    for template in templates if isinstance(templates, list) else ():
        for noun in nouns if isinstance(nouns, list) else ():
            yield Offer(str(template).replace("<noun>", str(noun)), "word", "what the agent can say")
        if isinstance(slots, dict):
            yield Offer(
                str(template), "word", "what the agent can say; `<slot>` is anything that can stand there"
            )
            for name, words in slots.items():
                found = words if isinstance(words, list) and f"<{name}>" in str(template) else ()
                for word in found:
                    yield Offer(
                        str(template).replace(f"<{name}>", str(word)), "word", "what the agent can say"
                    )


def _ids(data: Data) -> list[str]:
    """The names of the outcomes that have one."""
    outcomes = part_at(data, ("outcome",))
    listed = outcomes if isinstance(outcomes, list) else []
    return [str(one["id"]) for one in listed if isinstance(one, dict) and "id" in one]


def _root(data: Data) -> type[BaseModel] | None:
    """The model of a whole file."""
    return model_of_file(data) if isinstance(data, dict) else None


def _model_of(data: Data, path: DataPath) -> Any:
    """The model of the mapping at a path; of a member of the cast, that of a group of them."""
    root = _root(data)
    if root is None:
        return ScenarioFile if not path else None
    if root is ScenarioFile and len(path) == 2 and path[0] == "cast" and path[1] != "agent":
        return CastGroup
    return model_at(root, path)

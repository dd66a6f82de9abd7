"""Variants as patches: `remove`, then `set`, then `add`, each on a path such as `states.idle.then[greeting]`."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, Literal

from socialai_dsl.diagnostics import DiagnosticBag, did_you_mean
from socialai_dsl.loader.reader import MAX_PATCH_PATH
from socialai_dsl.schema.annotations import keys_of, keys_that_hold, sections_of
from socialai_dsl.schema.files import VariantFile
from socialai_dsl.schema.scenario import Scenario
from socialai_dsl.schema.suite import Suite
from socialai_dsl.source import Node, Span

_INDEX: Final = re.compile(r"\[([^\[\]]*)\]")
_KEY: Final = re.compile(r"[^.\[\]()]+(?:\([^()]*\))?")


@dataclass(frozen=True)
class Place:
    """An existing part, or a key that its mapping does not have yet."""

    parent: Node
    key: str | int
    node: Node | None


@dataclass(frozen=True)
class Miss:
    """A path that leads nowhere: the message, and what was probably meant."""

    message: str
    suggestion: str | None = None
    suggestion_place: str | None = None
    hint: str | None = None


def follow(root: Node, path: str) -> Place | Miss:
    """The part that a path leads to.

    A key with dots or brackets in it is found as it stands. The last key may be missing from its mapping: the
    place then has no node.
    """
    node, begin = root, 0
    while True:
        in_list = isinstance(node.children, list)
        step = _list_step(node, path, begin) if in_list else _key_step(node, path, begin)
        if isinstance(step, Miss):
            return step
        key, end = step
        part = node.entry(key)
        if end == len(path):
            return Place(node, key, part)
        if part is None:
            return missing(node, path[:begin], str(key))
        begin = end + 1 if path[end] == "." else end
        if path[end] not in ".[" or begin == len(path):
            return _no_path(path)
        node = part


def _key_step(node: Node, path: str, begin: int) -> tuple[str, int] | Miss:
    """The key of a mapping that the path goes on with, and where it ends in the path."""
    if not isinstance(node.children, dict):
        return Miss(f"`{_shown(path, begin)}` in {node.file} is {node.kind}, there is nothing below it")
    rest = path[begin:]
    ends = [len(rest), *(end for end in range(len(rest) - 1, -1, -1) if rest[end] in ".[")]
    for end in ends:
        if rest[:end] in node.children:
            return rest[:end], begin + end
    if path.startswith("[", begin):
        hint = f"write `{_shown(path, begin)}.` and the key"
        return Miss(f"`{_shown(path, begin)}` in {node.file} is a mapping, not a list", hint=hint)
    match = _KEY.match(path, begin)
    if not match:
        return _no_path(path)
    return match.group(), match.end()


def _list_step(node: Node, path: str, begin: int) -> tuple[int, int] | Miss:
    """The index in a list that the path goes on with, given as a number or as the `id` of the item."""
    items = [part for _, part in node.items()]
    match = _INDEX.match(path, begin)
    if not match:
        hint = f"write `{_shown(path, begin)}[0]` for its first item"
        return Miss(f"`{_shown(path, begin)}` in {node.file} is a list", hint=hint)
    wanted = match[1]
    ids = {item.text("id"): i for i, item in enumerate(items) if item.text("id") is not None}
    index = ids.get(wanted)
    if index is None and wanted.isascii() and wanted.isdigit() and len(wanted) <= 6:
        index = int(wanted)
    if index is None or index >= len(items):
        return _no_item(node, path, begin, match, {str(i) for i in ids})
    return index, match.end()


def _no_item(node: Node, path: str, begin: int, match: re.Match[str], ids: set[str]) -> Miss:
    count = len(node.children or ())
    items = (
        "is empty" if not count else "has one item, [0]" if count == 1 else f"has items [0] to [{count - 1}]"
    )
    named = did_you_mean(match[1], ids)
    suggestion = f"{path[:begin]}[{named}]" if named else None
    message = f"there is no `{path[: match.end()]}` in {node.file}; `{_shown(path, begin)}` {items}"
    return Miss(message, suggestion)


def _no_path(path: str) -> Miss:
    return Miss(f"`{path}` is not a path", hint="write it like `cast.anna.name` or `outcome[0].success`")


def missing(node: Node, prefix: str, key: str) -> Miss:
    """The message for a key that a mapping does not have; `prefix` is the path to the mapping, with its dot."""
    assert isinstance(node.children, dict), "internal: only a mapping misses a key"
    named = did_you_mean(key, node.children)
    message = f"there is no `{prefix}{key}` in {node.file}"
    if named:
        span = node.children[named].key_span()
        return Miss(message, f"{prefix}{named}", f"{span.file}:{span.line}")
    known = ", ".join(f"`{k}`" for k in list(node.children)[:12])
    return Miss(message, hint=f"`{prefix.rstrip('.')}` has {known}" if prefix and known else None)


def _shown(path: str, end: int) -> str:
    return path[:end].rstrip(".")


# -- patches -------------------------------------------------------------------------------------------------


VARIANT_KEYS: Final = tuple(keys_of(VariantFile))

PATCH_VERBS: Final = ("remove", "set", "add")

_DESCRIPTION: Final = keys_that_hold(VariantFile, "prose")

_MAPPINGS, _LISTS = map(frozenset, sections_of(Scenario))
_OF_SUITES = tuple(map(frozenset, sections_of(Suite)))
_OF_VARIANTS = sections_of(VariantFile)
_CHANGED: Final = frozenset(keys_of(Scenario))


def _sections(root: Node) -> tuple[frozenset[str], frozenset[str]]:
    """The mappings and the lists that every file of a kind has, if only empty: a patch may put something into them
    though the file has none.
    """
    return (_OF_SUITES[0], _OF_SUITES[1]) if root.entry("suite") is not None else (_MAPPINGS, _LISTS)


@dataclass(frozen=True)
class Edit:
    """One change that a patch made.

    Attributes:
        verb: what was done.
        path: to which path of the scenario, as written.
        span: where the patch says so.
        changes: False: it puts a value where there is an equal one.
    """

    verb: Literal["remove", "set", "add"]
    path: str
    span: Span
    changes: bool = True


def apply_patch(root: Node, patch: Node, found: DiagnosticBag) -> list[Edit]:
    """Change the tree `root` as the mapping `patch` says.

    Args:
        root: a scenario or suite.
        patch: a mapping with some of the keys `remove`, `set` and `add`; `about`, `notes` and `skills` replace those
            of the scenario, others are left alone.
        found: takes S501, S502 and S104; what they concern is not applied.
    """
    edits = _remove(root, patch, found)
    verb: Literal["set", "add"]
    for verb, change in (("set", _set), ("add", _add)):
        section = patch.entry(verb)
        if section is None:
            continue
        if not isinstance(section.children, dict):
            _not_a_mapping(verb, section, found)
            continue
        for path, value in section.children.items():
            edits += change(root, path, value, found)
    for key in _DESCRIPTION:
        entry = patch.entry(key)
        if entry is not None and isinstance(root.children, dict):
            root.children[key] = entry
    return edits


def rivals_of(root: Node) -> dict[str, Node]:
    """The strategies that a scenario names under `rivals`, each a frame."""
    written = root.entry("rivals")
    return written.children if written is not None and isinstance(written.children, dict) else {}


def let_play(root: Node, rival: str) -> bool:
    """Let the agent of a scenario follow one of its rivals; False: there is none of this name."""
    frame, cast = rivals_of(root).get(rival), root.entry("cast")
    agent = None if cast is None else cast.entry("agent")
    if frame is None or agent is None or not isinstance(root.children, dict):
        return False
    frames = root.children.setdefault("frames", Node(frame.span, children={}))
    for mapping, key, value in ((frames, rival, frame), (agent, "frame", Node(frame.span, rival))):
        mapping.children = {**(mapping.children if isinstance(mapping.children, dict) else {}), key: value}
    agent.children = {
        str(key): value for key, value in agent.items() if key != "with"
    }  # it fills slots of another
    return True


def let_follow(root: Node, frames: Mapping[str, str]) -> None:
    """Let members of the cast of a scenario follow other frames, by member, which have no slots."""
    cast = root.entry("cast")
    assert cast is not None, "internal: a scenario has a cast"
    for name, frame in frames.items():
        member = cast.entry(name)
        assert member is not None, "internal: a member of the cast"
        kept = {str(key): value for key, value in member.items() if key not in ("with", "frame")}
        member.children = {**kept, "frame": Node(member.span, frame)}


def _remove(root: Node, patch: Node, found: DiagnosticBag) -> list[Edit]:
    section = patch.entry("remove")
    if section is None:
        return []
    if not isinstance(section.children, list):
        message = f"`remove` is a list of paths, not {section.kind}"
        found.error("S104", message, section.value_span(), hint="remove: [cast.anna]")
        return []
    # All paths mean the scenario before anything is removed: indices do not shift.
    places: list[tuple[Place, Edit]] = []
    for item in section.children:
        if not isinstance(item.value, str):
            found.error("S104", f"a path is a text, not {item.kind}", item.value_span())
            continue
        place = _existing(root, item.value, item.value_span(), found)
        if place is None or place.node is None:
            continue
        edit = Edit("remove", item.value, item.value_span())
        if any(place.node is earlier.node for earlier, _ in places):
            found.error("S501", f"`{item.value}` is removed twice", edit.span)
        else:
            places.append((place, edit))
    for place, _ in places:
        siblings = place.parent.children
        if isinstance(siblings, dict):
            del siblings[str(place.key)]
        elif isinstance(siblings, list):
            place.parent.children = [part for part in siblings if part is not place.node]
    return [edit for _, edit in places]


def _set(root: Node, path: str, value: Node, found: DiagnosticBag) -> list[Edit]:
    span = value.key_span()
    place = _place(root, path, value, found)
    if place is None:
        return []
    changes = place.node is None or place.node.data != value.data
    if isinstance(place.parent.children, dict):
        place.parent.children[str(place.key)] = value
    elif isinstance(place.parent.children, list):
        place.parent.children[int(place.key)] = value
    return [Edit("set", path, span, changes)]


def _add(root: Node, path: str, value: Node, found: DiagnosticBag) -> list[Edit]:
    span = value.key_span()
    place = _place(root, path, value, found)
    if place is None:
        return []
    target = place.node or _empty_section(root, path, value)
    if target is None:
        _report(missing(place.parent, path[: -len(str(place.key))], str(place.key)), span, found)
        return []
    if isinstance(target.children, list):
        return _append(target, target.children, path, value, found)
    if isinstance(target.children, dict):
        return _add_keys(target.children, path, value, found)
    message = f"nothing can be added to `{path}`: it is {target.kind}"
    found.error("S104", message, span, hint="to replace it use `set`")
    return []


def _append(target: Node, items: list[Node], path: str, value: Node, found: DiagnosticBag) -> list[Edit]:
    if not isinstance(value.children, list):
        message = f"`{path}` in {target.file} is a list: give a list of items to add, not {value.kind}"
        found.error("S104", message, value.value_span())
        return []
    items.extend(value.children)
    return [Edit("add", path, value.key_span())]


def _add_keys(entries: dict[str, Node], path: str, value: Node, found: DiagnosticBag) -> list[Edit]:
    if not isinstance(value.children, dict):
        message = f"`{path}` is a mapping: give the keys to add with their values, not {value.kind}"
        found.error("S104", message, value.value_span())
        return []
    for key, part in value.children.items():
        if key in entries:
            there = entries[key].key_span()
            message = f"`{path}.{key}` exists already ({there.file}:{there.line})"
            found.error("S502", message, part.key_span(), hint="to replace it use `set`")
        else:
            entries[key] = part
    return [Edit("add", path, value.key_span())]


def _place(root: Node, path: str, value: Node, found: DiagnosticBag) -> Place | None:
    """Where a patch puts a value: an existing part, or a new key of an existing mapping."""
    if len(path) > MAX_PATCH_PATH:
        found.error("S004", f"a path has at most {MAX_PATCH_PATH} characters", value.key_span())
        return None
    place = follow(root, path)
    section = path.split(".", 1)[0]
    if isinstance(place, Miss) and root.entry(section) is None and section in _sections(root)[0]:
        _empty_section(root, section, value)
        place = follow(root, path)
    if isinstance(place, Miss):
        _report(_or_section(place, root, section, path), value.key_span(), found)
        return None
    return place


def _existing(root: Node, path: str, span: Span, found: DiagnosticBag) -> Place | None:
    place = follow(root, path) if len(path) <= MAX_PATCH_PATH else Miss("this path is too long")
    if isinstance(place, Place) and place.node is None:
        place = missing(place.parent, path[: -len(str(place.key))], str(place.key))
    if isinstance(place, Miss):
        _report(place, span, found)
        return None
    return place


def _or_section(miss: Miss, root: Node, section: str, path: str) -> Miss:
    """The same miss; if it is about the first key, the sections that may be empty are suggested as well."""
    if miss.suggestion or root.entry(section) is not None:
        return miss
    named = did_you_mean(section, frozenset.union(*_sections(root)))
    return Miss(miss.message, named + path[len(section) :] if named else None, None, miss.hint)


def _empty_section(root: Node, path: str, value: Node) -> Node | None:
    """A section that the scenario does not have, made empty; None if there is no section of this name."""
    mappings, lists = _sections(root)
    if not isinstance(root.children, dict) or path not in mappings | lists:
        return None
    section = Node(value.span, children={} if path in mappings else [])
    root.children[path] = section
    return section


def _report(miss: Miss, span: Span, found: DiagnosticBag) -> None:
    found.error(
        "S501",
        miss.message,
        span,
        hint=miss.hint,
        suggestion=miss.suggestion,
        suggestion_place=miss.suggestion_place,
    )


def check_variant(root: Node, found: DiagnosticBag) -> None:
    """The shape of a variant's file, which no model sees: its keys, `of`, and that it is a variant at all."""
    assert isinstance(root.children, dict), "internal: a variant is a mapping"
    for key, part in root.children.items():
        if key not in VARIANT_KEYS:
            suggestion = did_you_mean(key, VARIANT_KEYS)
            own = "a variant has `of`, `remove`, `set`, `add` and `about`"
            changes = f"`set: {{{key}: ...}}` changes the scenario's" if key in _CHANGED else own
            hint = None if suggestion else changes
            message = f"unknown key `{key}` in a variant"
            found.error("S101", message, part.key_span(), hint=hint, suggestion=suggestion)
    base = root.entry("of")
    if base is None:
        hint = "of: base.yaml, or `of: any` for every scenario"
        found.error("S105", "a variant needs `of`: what it is a variant of", root.key_span(), hint=hint)
    elif not isinstance(base.value, str):
        found.error("S104", f"`of` names a file, it is not {base.kind}", base.value_span())
    mappings, lists = _OF_VARIANTS
    for key in {*VARIANT_KEYS} - {"of", *mappings, *lists}:
        entry = root.entry(key)
        if entry is not None and not isinstance(entry.value, str):
            found.error("S104", f"`{key}` is a text, not {entry.kind}", entry.value_span())
    for key in lists:
        _check_texts(root, key, found)
    for key in mappings:
        section = root.entry(key)
        if section is not None and not isinstance(section.children, dict):
            _not_a_mapping(key, section, found)
        for path, node in section.walk() if section is not None else ():
            if node.is_empty and path:
                of_key = isinstance(path[-1], str)
                what = f"nothing is given for `{path[-1]}`" if of_key else "an item of this list is empty"
                found.error("S104", what, node.key_span(), hint="write a value, or leave the key out")


def _check_texts(root: Node, key: str, found: DiagnosticBag) -> None:
    section = root.entry(key)
    if section is None:
        return
    if not isinstance(section.children, list):
        hint = "remove: [cast.anna]" if key == "remove" else None
        what = "a list of paths" if key == "remove" else "a list of texts"
        found.error("S104", f"`{key}` is {what}, not {section.kind}", section.value_span(), hint=hint)
        return
    for item in section.children:
        if not isinstance(item.value, str):
            what = "a path" if key == "remove" else "a skill"
            found.error("S104", f"{what} is a text, not {item.kind}", item.value_span())


def _not_a_mapping(verb: str, section: Node, found: DiagnosticBag) -> None:
    message = f"`{verb}` is a mapping from paths to values, not {section.kind}"
    hint = f"{verb}: {{cast.anna.name: Anna}}"
    found.error("S104", message, section.value_span(), hint=hint)

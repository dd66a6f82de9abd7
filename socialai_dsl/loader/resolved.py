"""A scenario of a name as one tree: `extends`, variants and the files that it names put together."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterator, Mapping
from copy import copy
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final

from socialai_dsl.diagnostics import Diagnostic, DiagnosticBag, ScenarioError, did_you_mean
from socialai_dsl.loader.patches import PATCH_VERBS, Edit, apply_patch, check_variant, let_play, rivals_of
from socialai_dsl.loader.reader import (
    MAX_CHAIN,
    MAX_DEPTH,
    MAX_NAME,
    SUFFIXES,
    Library,
    display_name,
    followed,
    is_file,
    shipped_folder,
    yaml_files,
)
from socialai_dsl.schema.files import FILES
from socialai_dsl.source import DataPath, Node, Source, Span

TESTS: Final = ".tests.yaml"
"""The end of the name of a file with tests of the scenario beside it."""

ANY: Final = "any"
"""What a variant that fits every scenario is `of`."""

_DECLARED_NAME: Final = re.compile(r"[A-Za-z0-9_-]{1,80}")


# -- names ---------------------------------------------------------------------------------------------------


_VARIANT: Final = re.compile(r"[A-Za-z0-9_-]{1,80}")
_PARAMETER: Final = re.compile(r"[A-Za-z_][A-Za-z0-9_]{0,79}")


@dataclass(frozen=True)
class NamePart:
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

    base: NamePart
    variants: tuple[NamePart, ...]
    params: dict[str, NamePart]


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
        return ScenarioName(NamePart("", start), (), {})

    question = len(text) if _is_file(text, folder) else _index(text, "?", 0)
    plus = question
    if not _is_file(text[:question], folder):  # the first `+` of the last part of the path
        plus = min(question, _index(text, "+", text.rfind("/", 0, question) + 1))
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
            params[key] = NamePart(value, piece.span.shifted(len(key) + 1, max(1, len(value))))
    return ScenarioName(_part(text, 0, plus, start), variants, params)


def taken_apart(name: str, folder: Path | None = None) -> tuple[str, str]:
    """A name as its base, and the variants and parameters behind it as they are written.

    Args:
        name: from outside any file, or of a file in `folder`.
        folder: where relative paths start, by default the working directory.
    """
    base = parse_name(name, name_source(name).span(1, 1), DiagnosticBag(), folder or Path()).base.text
    return base, name[len(base) :]


def _is_file(text: str, folder: Path | None) -> bool:
    return folder is not None and is_file(folder / text)


def _index(text: str, character: str, begin: int) -> int:
    found = text.find(character, begin)
    return len(text) if found < 0 else found


def _pieces(text: str, separator: str, begin: int, end: int, start: Span) -> tuple[NamePart, ...]:
    """`text[begin:end]` split at the separator; nothing if `begin` lies behind `end`."""
    pieces = []
    while begin <= end:
        stop = min(end, _index(text, separator, begin))
        pieces.append(_part(text, begin, stop, start))
        begin = stop + 1
    return tuple(pieces)


def _part(text: str, begin: int, end: int, start: Span) -> NamePart:
    return NamePart(text[begin:end], start.shifted(begin, max(1, end - begin)))


# -- bases and variants --------------------------------------------------------------------------------------


def merge(base: Node, over: Node, key: str = "") -> Node:
    """`base` overlaid with `over`: mappings are merged key by key, all else is replaced.

    Keys of the base keep their place, those that only `over` has follow in its order. Of a grammar, `nouns` and `slots`
    replace each other. Both trees are used up; `key` is where in their files they stand.
    """
    if not isinstance(base.children, dict) or not isinstance(over.children, dict):
        return over
    for former, instead in (("nouns", "slots"), ("slots", "nouns")):
        if key == "grammar" and instead in over.children and former not in over.children:
            base.children.pop(former, None)
    for word, part in over.children.items():
        below = base.children.get(word)
        base.children[word] = part if below is None else merge(below, part, word)
    over.children = base.children
    return over


@dataclass
class Ancestor:
    """A scenario, or one that it is a variant of: variants are looked for by folder and stem.

    Attributes:
        folder: where its variants are.
        stem: what the names of their files begin with.
        path: its own file, resolved; None for a combination that has none.
    """

    folder: Path
    stem: str
    path: Path | None = None


@dataclass
class Build:
    """A scenario while it is put together.

    Attributes:
        tree: its data; changed in place.
        kind: one of `FILES`.
        name: canonical name, with the variants applied so far.
        path: the file that was named, resolved.
        lineage: itself and what it is a variant of, nearest first.
        edits: what patches changed, in order.
        passed_on: the variants that a suite passes on to its members.
        own_variants: those for which there was a file of its own.
    """

    tree: Node
    kind: str
    name: str
    path: Path
    lineage: list[Ancestor]
    edits: list[Edit] = field(default_factory=list)
    passed_on: list[NamePart] = field(default_factory=list)
    own_variants: list[str] = field(default_factory=list)

    def copy(self) -> Build:
        """The same, free to be changed further."""
        return replace(
            self,
            tree=self.tree.copy(),
            lineage=[*self.lineage],
            edits=[*self.edits],
            passed_on=[*self.passed_on],
            own_variants=[*self.own_variants],
        )


def _built(library: Library, path: Path, asked: Span | None = None, chain: tuple[Path, ...] = ()) -> Build:
    """A file with `extends` and, for a variant, with what it is a variant of.

    Args:
        library: reads the files.
        path: the file, resolved.
        asked: where its name is written; None if it was given from outside.
        chain: the files that build on it.

    Raises:
        ScenarioError: what is wrong with it or with a file it builds on.
    """
    if asked is not None:
        _check_chain(library, path, chain, asked)
    root, kind = _read(library, path, asked)
    declared = root.text(kind) or ""
    name = declared if _DECLARED_NAME.fullmatch(declared) else path.stem
    lineage = [Ancestor(path.parent, path.stem, path)]
    if kind == "variant" and root.text("of") != ANY:
        base = _base(library, root, "of", path, chain)
        _apply(library, base, root)
        built = Build(base.tree, base.kind, name, path, lineage + base.lineage, base.edits)
        if base.kind == "suite":
            _pass_on(built, base, root)
        return built
    if root.entry("extends") is not None:
        root = _extended(library, root, kind, path, chain)
    return Build(root, kind, name, path, lineage)


def _pass_on(built: Build, base: Build, root: Node) -> None:
    """A suite's variant that is named directly is passed on to the members like one that is named by `+`."""
    built.passed_on, built.own_variants = list(base.passed_on), list(base.own_variants)
    stem = base.lineage[0].stem + "_"
    declared = root.entry("variant")
    if declared is not None and built.path.stem.startswith(stem):
        variant = NamePart(built.path.stem.removeprefix(stem), declared.value_span())
        built.passed_on.append(variant)
        built.own_variants.append(variant.text)


def _read(library: Library, path: Path, asked: Span | None) -> tuple[Node, str]:
    """A file as a tree of its own, and its kind; a variant's shape is checked, since no model sees it."""
    root = library.read(path, asked)
    kind = _kind_of(library, root)
    if kind == "variant":
        found = DiagnosticBag()
        check_variant(root, found)
        found.raise_errors(library.sources)
    return root, kind


def _apply(library: Library, build: Build, patch: Node) -> None:
    """Apply a patch.

    Raises:
        ScenarioError: with everything that is wrong with it.
    """
    found = DiagnosticBag()
    edits = apply_patch(build.tree, patch, found)
    # A member of a sweep may be the scenario itself, and a variant of any scenario may change nothing of some.
    if patch.entry("variant") is None or patch.text("of") == ANY:
        edits = [replace(edit, changes=True) for edit in edits]
    build.edits += edits
    found.raise_errors(library.sources)
    _check_depth(library, build.tree)


def _check_chain(library: Library, path: Path, chain: tuple[Path, ...], asked: Span) -> None:
    """Whether `path` may be built on by the files of `chain`.

    Raises:
        ScenarioError: S506 if it is one of them, S507 if they are too many.
    """
    if path in chain:
        circle = " → ".join(p.name for p in (*chain[chain.index(path) :], path))
        raise library.error("S506", f"these files build on each other in a circle: {circle}", asked)
    if len(chain) >= MAX_CHAIN:
        raise library.error("S507", f"more than {MAX_CHAIN} files build on each other", asked)


def _base(library: Library, root: Node, key: str, path: Path, chain: tuple[Path, ...]) -> Build:
    """What the file named at `key` (`of` or `extends`) is."""
    entry = root.entry(key)
    assert entry is not None, "internal: the key was looked at before"
    span = entry.value_span()
    if not isinstance(entry.value, str):
        raise library.error("S104", f"`{key}` names one file, it is not {entry.kind}", span)
    build = _built(library, library.find(entry.value, path.parent, span), span, (*chain, path))
    if build.kind == "variant":
        message = f"`{entry.value}` is a variant of any scenario; nothing can be built on it"
        raise library.error("S108", message, span)
    return build


def _extended(library: Library, root: Node, kind: str, path: Path, chain: tuple[Path, ...]) -> Node:
    base = _base(library, root, "extends", path, chain)
    entry = root.entry("extends")
    assert entry is not None, "internal: the key was looked at before"
    if base.kind != kind:
        message = f"`{entry.value}` is a file of kind `{base.kind}`, this one is of kind `{kind}`"
        raise library.error("S108", message, entry.value_span())
    assert isinstance(base.tree.children, dict), "internal: a file is a mapping"
    assert isinstance(root.children, dict), "internal: a file is a mapping"
    # What a base says of itself alone; tests are all that a file of tests has.
    for own in ("abstract",) if kind == "tests_of" else ("abstract", "tests"):
        base.tree.children.pop(own, None)
    del root.children["extends"]
    merged = merge(base.tree, root)
    _check_depth(library, merged)
    return merged


def _kind_of(library: Library, root: Node) -> str:
    if not isinstance(root.children, dict):
        message = f"a scenario file is a mapping of keys; this one is {root.kind}"
        hint = "it starts with a key such as `scenario: name`"
        raise library.error("S108", message, root.value_span(), hint=hint)
    kinds = [key for key in root.children if key in FILES]
    if len(kinds) == 1:
        return kinds[0]
    if kinds:
        message = f"a file has only one of `{kinds[0]}` and `{kinds[1]}`"
        raise library.error("S107", message, root.children[kinds[1]].key_span())
    for key, part in root.children.items():
        near = did_you_mean(key, FILES)
        if near:
            message = f"unknown key `{key}`, and no key says what this file is"
            raise library.error("S108", message, part.key_span(), suggestion=near)
    hint = "give one of " + ", ".join(f"`{kind}: name`" for kind in FILES)
    raise library.error("S108", "no key says what this file is", root.value_span(), hint=hint)


def _check_depth(library: Library, tree: Node) -> None:
    """Whether a tree that was put together is shallow enough.

    Raises:
        ScenarioError: S004.
    """
    for path, node in tree.walk():
        if len(path) > MAX_DEPTH:
            message = f"put together, the scenario is nested more than {MAX_DEPTH} levels deep"
            raise library.error("S004", message, node.value_span())


_OF_ANY: Final = re.compile(r"^of: *any\b", re.MULTILINE)


def vary(library: Library, build: Build, variant: NamePart) -> None:
    """Apply a variant to what is built: the nearest file of that name, else one for any scenario.

    `<X>_V.yaml` comes first, then `<R>_V.yaml` of each scenario R that X is a variant of, then `V.yaml` with
    `of: any`; each beside the scenario, then among the shipped ones. A rival that the scenario itself names comes
    before the last of these. A suite is changed only by a variant of its own, and passes every variant on. What has the
    variant already stays as it is.

    Raises:
        ScenarioError: S503 if there is no such variant; what is wrong with its file.
    """
    if variant.text in build.name.split("+")[1:]:
        return
    direct = _direct(library, build, variant)
    if direct is not None:
        build.own_variants.append(variant.text)
        patches = _down_to(library, build, direct, variant)
        if not patches and build.kind != "suite":
            return
        for patch in patches:
            _apply(library, build, patch)
    if build.kind == "suite":
        build.passed_on.append(variant)
    elif direct is None and not let_play(build.tree, variant.text):
        _apply(library, build, _of_any(library, build, variant))
    _name(build, variant.text, direct)


def _name(build: Build, variant: str, file: Path | None) -> None:
    """Let what is built be known as a variant, for the variants that follow."""
    nearest = build.lineage[0]
    stem = f"{nearest.stem}_{variant}"
    if file is not None and file.stem != stem:
        build.lineage.insert(0, Ancestor(file.parent, file.stem, file))
    build.lineage.insert(0, Ancestor(nearest.folder, stem, file))
    build.name = f"{build.name}+{variant}"


def _direct(library: Library, build: Build, variant: NamePart) -> Path | None:
    for ancestor in build.lineage:
        for folder in dict.fromkeys((ancestor.folder, library.shipped)):
            path = library.resolved(folder / f"{ancestor.stem}_{variant.text}.yaml", variant.span)
            if is_file(path):
                return path
    return None


def _down_to(library: Library, build: Build, path: Path, variant: NamePart) -> list[Node]:
    """The patches that lead from what is built to the variant in a file, in the order to apply them."""
    known = {ancestor.path for ancestor in build.lineage}
    patches: list[Node] = []
    seen: tuple[Path, ...] = ()
    asked = variant.span
    while path not in known:
        _check_chain(library, path, seen, asked)
        seen = (*seen, path)
        patch = _variant_file(library, build, path, variant)
        patches.insert(0, patch)
        base = patch.text("of")
        if base is None or base == ANY:
            break
        asked = patch.value_span(("of",))
        path = library.find(base, path.parent, asked)
    return patches


def _of_any(library: Library, build: Build, variant: NamePart) -> Node:
    for folder in _folders(library, build):
        path = library.resolved(folder / f"{variant.text}.yaml", variant.span)
        if _is_of_any(path):
            return _variant_file(library, build, path, variant)
    known = _known(library, build)
    near = did_you_mean(variant.text, known)
    listed = "it has " + ", ".join(f"`{name}`" for name in known) if known else "it has none"
    message = f"`{build.name}` has no variant `{variant.text}`"
    raise library.error("S503", message, variant.span, None if near else listed, near)


def _variant_file(library: Library, build: Build, path: Path, variant: NamePart) -> Node:
    root, kind = _read(library, path, variant.span)
    if kind != "variant":
        message = f"`{variant.text}` is no variant of `{build.name}`: {display_name(path)} is a {kind}"
        raise library.error("S503", message, variant.span)
    return root


def _folders(library: Library, build: Build) -> list[Path]:
    return list(dict.fromkeys([*(ancestor.folder for ancestor in build.lineage), library.shipped]))


def _known(library: Library, build: Build) -> list[str]:
    """The variants that what is built has, sorted."""
    names = set(rivals_of(build.tree))
    for folder in _folders(library, build):
        stems = [name.removesuffix(".yaml") for name in yaml_files(folder) if name.endswith(".yaml")]
        stems = [stem for stem in stems if not f"{stem}.yaml".endswith(TESTS)]
        names.update(stem for stem in stems if _is_of_any(folder / f"{stem}.yaml"))
        for ancestor in build.lineage:
            prefix = ancestor.stem + "_"
            names.update(stem.removeprefix(prefix) for stem in stems if stem.startswith(prefix))
    return sorted(names)


def _is_of_any(path: Path) -> bool:
    """Whether a file looks like a variant of any scenario; links are not followed."""
    try:
        if path.is_symlink() or not path.is_file():
            return False
        with path.open(encoding="utf-8", errors="replace") as file:
            return _OF_ANY.search(file.read(4096)) is not None
    except OSError:
        return False


def names_in(folder: Path) -> list[str]:
    """The names of the files in a folder that can stand for themselves: no tests, no variants of any scenario."""
    files = [name for name in yaml_files(folder) if not name.endswith(TESTS)]
    return [name.rsplit(".", 1)[0] for name in files if not _is_of_any(folder / name)]


class ResolvedFile:
    """A scenario (or suite, npc, library) with `extends` and variants applied.

    Attributes:
        name: canonical name with variants, without parameters, e.g. `talkitout+unsocial`.
        kind: key of the file's kind; `variant` only for a variant of any scenario that was named alone.
        tree: its parts, each of which knows where it was written, patches included.
        data: the same as plain data; `extends` is gone, `abstract` is the file's own.
        params: parameter -> value as written behind `?`.
        edits: what variants changed, in order.
    """

    def __init__(self, library: Library, build: Build, given: Mapping[str, NamePart]) -> None:
        self.name = build.name
        self.kind = build.kind
        self.tree = build.tree
        self.data = build.tree.data
        self.params = {key: part.text for key, part in given.items()}
        self.edits = tuple(build.edits)
        self._library = library
        self._build = build
        self._given = given

    def mended(self, tree: Node) -> ResolvedFile:
        """The same file with the tree that its models were made of, in which misspelt keys are spelt right.

        Where a model has a value, this tree has a place for it.
        """
        found = copy(self)
        found.tree, found.data = tree, tree.data
        return found

    @property
    def files(self) -> dict[str, Source]:
        """Name -> source, for all files read so far for the scenario that was named."""
        return self._library.sources

    @property
    def path(self) -> Path:
        """The file that was named, resolved."""
        return self._build.path

    @property
    def passed_on(self) -> tuple[NamePart, ...]:
        """The variants that a suite passes on to its members, with the places where they are asked for."""
        return tuple(self._build.passed_on)

    @property
    def own_variants(self) -> tuple[str, ...]:
        """The variants for which there was a file of its own."""
        return tuple(self._build.own_variants)

    def given(self, name: str) -> NamePart | None:
        """A parameter's value as written behind `?`, with its place; None if it is not given."""
        return self._given.get(name)

    def error(
        self, code: str, message: str, span: Span, hint: str | None = None, suggestion: str | None = None
    ) -> ScenarioError:
        """The exception for one finding, with the sources read so far."""
        return self._library.error(code, message, span, hint, suggestion)

    def changed(self, *steps: Callable[[Node], None]) -> ResolvedFile:
        """This scenario after steps that change its tree."""
        build = self._build.copy()
        for step in steps:
            step(build.tree)
        return ResolvedFile(self._library, build, self._given)

    def param_span(self, name: str) -> Span:
        """The value that the parameter was given, in the name of the scenario."""
        return self._given[name].span

    def param_name_span(self, name: str) -> Span:
        """The parameter before the value that it was given, in the name of the scenario."""
        return self._given[name].span.shifted(-len(name) - 1, len(name))

    def include(self, path: DataPath) -> ResolvedFile:
        """The scenario or npc that the text at `path` names, relative to the file that text stands in.

        Raises:
            ScenarioError: whatever is wrong with the name or the file.
        """
        node = self.tree.at(path)
        if not isinstance(node.value, str):
            raise self.error("S104", "the name of a file is a text", node.value_span())
        return self._named(node.value, node.locate(), _folder(node))

    def continued(self, path: DataPath, base: str) -> ResolvedFile:
        """The scenario whose name is `base` with the `+variants?parameters` at `path`.

        Raises:
            ScenarioError: whatever is wrong with the name or the file.
        """
        node = self.tree.at(path)
        text, start = str(node.value), node.locate()
        if text[:1] not in ("+", "?"):
            hint = "write what follows the scenario's name: `+variant`, `?parameter=value`, or both"
            raise self.error("S508", f"`{text}` names no variant and no parameter", start, hint)
        return self._named(base + text, start.shifted(-len(base)), _folder(node))

    def include_key(self, path: DataPath) -> ResolvedFile:
        """The scenario that the key at `path` names, relative to the file that the key stands in.

        Raises:
            ScenarioError: whatever is wrong with the name or the file.
        """
        node = self.tree.at(path)
        return self._named(str(path[-1]), node.key_span(), _folder(node))

    def _named(self, text: str, start: Span, folder: Path) -> ResolvedFile:
        """The file of a name that is written in a file."""
        found = DiagnosticBag()
        name = parse_name(text, start, found)
        found.raise_errors(self.files)
        file = self._library.find(name.base.text, folder, name.base.span)
        return _resolved(self._library, file, name, name.base.span)

    def include_all(self, path: DataPath) -> tuple[ResolvedFile, ...]:
        """The files that the text or list of texts at `path` names.

        A list keeps its order; a text with `*` in its last part stands for the matching files, sorted by name.

        Raises:
            ScenarioError: whatever is wrong with a name or a file.
        """
        node = self.tree.at(path)
        if isinstance(node.children, list):
            return tuple(file for i in range(len(node.children)) for file in self.include_all((*path, i)))
        if not isinstance(node.value, str) or "*" not in node.value:
            return (self.include(path),)
        span = node.value_span()
        files = self._library.matching(node.value, _folder(node), span)
        names = [ScenarioName(NamePart(file.name, span), (), {}) for file in files]
        return tuple(_resolved(self._library, f, n, span) for f, n in zip(files, names, strict=True))

    def origins(self) -> Iterator[tuple[Span, DataPath, Any]]:
        """Where each value that is no container is written, its path, and itself; also in files that are drawn from.

        Raises:
            ScenarioError: see `with_drawn_files`.
        """
        whole = self.with_drawn_files() if self.kind == "scenario" else self
        for path, part in whole.tree.walk():
            if not part.children:
                yield part.value_span(), path, part.data

    def with_drawn_files(self) -> ResolvedFile:
        """This scenario with the npc files that each `one_of` of its cast names put in the place of their names.

        Raises:
            ScenarioError: whatever is wrong with a name or a file; S108 for a file of another kind.
        """
        cast = self.data.get("cast") if isinstance(self.data, dict) else None
        drawing = [
            name
            for name, member in (cast.items() if isinstance(cast, dict) else ())
            if isinstance(member, dict) and isinstance(member.get("one_of"), str | list)
        ]
        if not drawing:
            return self
        build = self._build.copy()
        for name in drawing:
            place: DataPath = ("cast", name, "one_of")
            node = build.tree.at(place)
            node.value, node.children = None, [file._build.tree for file in self._npc_files(place)]
        _check_depth(self._library, build.tree)
        return ResolvedFile(self._library, build, self._given)

    def _npc_files(self, place: DataPath) -> list[ResolvedFile]:
        """The npc files that are named at `place`; those that others build on are left out of a pattern."""
        found: list[ResolvedFile] = []
        named = self.tree.at(place).children
        places = [(*place, i) for i in range(len(named))] if isinstance(named, list) else [place]
        for one in places:
            files, span = self.include_all(one), self.tree.value_span(one)
            for file in files:
                if file.kind != "npc":
                    message = (
                        f"`{file.path.name}` is a file of the kind `{file.kind}`; only npc files can be drawn"
                    )
                    raise self.error("S108", message, span)
                abstract = isinstance(file.data, dict) and file.data.get("abstract") is True
                if abstract and len(files) == 1:
                    message = f"`{file.path.name}` is abstract: others build on it, nobody can be it"
                    raise self.error("S108", message, span)
                if not abstract:
                    found.append(file)
        return found

    def varied(self, variant: NamePart) -> ResolvedFile | None:
        """This scenario with a variant that a suite passes on; None if it has no such variant."""
        build = self._build.copy()
        try:
            vary(self._library, build, variant)
        except ScenarioError as error:
            if any(d.code != "S503" for d in error.diagnostics):
                raise
            return None
        return ResolvedFile(self._library, build, self._given)

    def patched(self, change: Node) -> ResolvedFile:
        """This scenario changed by a mapping (`remove`, `set`, `add`) of another file.

        Raises:
            ScenarioError: S501, S502, S104.
        """
        build, patch = self._build.copy(), change.copy()
        if isinstance(patch.children, dict):
            patch.children = {verb: part for verb, part in patch.children.items() if verb in PATCH_VERBS}
        _apply(self._library, build, patch)
        return ResolvedFile(self._library, build, self._given)

    def with_value(self, path: str, value: Node) -> ResolvedFile:
        """This scenario with a value of another file set at a path of it.

        Raises:
            ScenarioError: S501, S004.
        """
        values = Node(value.span, children={path: value})
        return self.patched(Node(value.span, children={"set": values}))

    def with_params(self, values: Mapping[str, tuple[str, Span]]) -> ResolvedFile:
        """This scenario with values for parameters, as if they were written behind `?`: name -> text and its place."""
        given = {name: NamePart(text, span) for name, (text, span) in values.items()}
        return ResolvedFile(self._library, self._build.copy(), {**self._given, **given})


def resolve(
    name: str,
    base: Path | None = None,
    texts: Mapping[Path, Source] | None = None,
    folder: Path | None = None,
) -> ResolvedFile:
    """The scenario of a name: `NAME(+VARIANT)*(?parameter=value(&parameter=value)*)?`.

    Args:
        name: a path or the name of a shipped scenario, with variants and parameters.
        base: where relative paths start, by default the working directory. If given, files of the scenario may
            come from anywhere below it, else only from the folder of the named file; and always from the shipped
            ones.
        texts: resolved path -> text that stands for the file, which need not exist.
        folder: where a name is looked for that is no path, by default as relative paths.

    Raises:
        ScenarioError: with everything found up to the first file that cannot be used.
    """
    source = name_source(name)
    found = DiagnosticBag()
    folder = folder if folder is not None else base if base is not None else Path()
    parsed = parse_name(name, source.span(1, 1), found, folder)
    found.raise_errors({source.name: source})
    path = _named_file(parsed.base, folder, source, texts or {})
    library = Library([path.parent] if base is None else [base, path.parent], texts)
    library.sources[source.name] = source
    return _resolved(library, path, parsed)


def shipped_names() -> list[str]:
    """The names of the shipped scenarios, suites, and variants that stand for themselves; sorted."""
    return names_in(shipped_folder())


def _resolved(library: Library, path: Path, name: ScenarioName, asked: Span | None = None) -> ResolvedFile:
    build = _built(library, path, asked)
    if len(name.variants) > MAX_CHAIN:
        message = f"at most {MAX_CHAIN} variants can be combined"
        raise library.error("S507", message, name.variants[-1].span)
    for variant in name.variants:
        vary(library, build, variant)
    return ResolvedFile(library, build, name.params)


def _folder(part: Node) -> Path:
    assert part.source.path is not None, "internal: a library's documents are files"
    return part.source.path.parent


def _named_file(part: NamePart, folder: Path, source: Source, texts: Mapping[Path, Source]) -> Path:
    """The file that a name from outside means.

    Raises:
        ScenarioError: S007 for a path that leads nowhere, S504 for anything else.
    """
    text = part.text
    beside, shipped = folder / text, shipped_folder() / text
    if looks_like_path(text):
        candidates = [beside, _with_suffix(beside), _with_suffix(shipped)]
    else:
        candidates = [_with_suffix(shipped), _with_suffix(beside)]
    for candidate in candidates:
        if is_file(candidate) or (texts and followed(candidate) in texts):
            return followed(candidate)
    if os.path.lexists(beside):
        # Reading it says what is wrong with it: a folder, a pipe, a link that leads nowhere.
        return followed(beside)
    found = DiagnosticBag()
    if looks_like_path(text):
        head = text[: text.rfind("/") + 1]
        # `did_you_mean` compares the first names only, so the likeliest come first.
        names = sorted(yaml_files(folder / head), key=lambda name: abs(len(head + name) - len(text)))
        near = did_you_mean(text, [head + name for name in names])
        found.error("S007", "there is no such file", Span(text, 1, 1, len(text)), suggestion=near)
    else:
        near = did_you_mean(text, [*shipped_names(), *names_in(folder)])
        hint = None if near else "a file is given by its path; shipped are " + ", ".join(shipped_names())
        found.error("S504", f"there is no scenario `{text}`", part.span, hint=hint, suggestion=near)
    raise ScenarioError(found, {source.name: source})


def _with_suffix(path: Path) -> Path:
    return path.parent / (path.name + ".yaml")

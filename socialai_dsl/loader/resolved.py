"""From a scenario's name to its data, with `extends`, variants, and the files it names."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

from socialai_dsl.diagnostics import DiagnosticBag, ScenarioError, did_you_mean
from socialai_dsl.loader.build import Build, Builder
from socialai_dsl.loader.document import Document, PositionedData
from socialai_dsl.loader.files import is_file
from socialai_dsl.loader.library import Library, yaml_files
from socialai_dsl.loader.limits import MAX_CHAIN
from socialai_dsl.loader.names import (
    Part,
    ScenarioName,
    looks_like_path,
    name_source,
    parse_name,
    shipped_folder,
)
from socialai_dsl.loader.patches import PATCH_VERBS
from socialai_dsl.loader.tree import Node
from socialai_dsl.loader.variants import names_in, vary
from socialai_dsl.source import DataPath, Source, Span


class Resolved(PositionedData):
    """A scenario (or suite, npc, library) with `extends` and variants applied.

    Behaves like a document; its parts know in which file they were written, patches included.

    Attributes:
        name: canonical name with variants, without parameters, e.g. `talkitout+unsocial`.
        kind: key of the file's kind; `variant` only for a variant of any scenario that was named alone.
        data: the data; `extends` is gone, `abstract` is the file's own.
        params: parameter -> value as written behind `?`.
        edits: what variants changed, in order.
    """

    def __init__(self, builder: Builder, build: Build, given: Mapping[str, Part]) -> None:
        self.name = build.name
        self.kind = build.kind
        self.data = build.tree.data()
        self.params = {key: part.text for key, part in given.items()}
        self.edits = tuple(build.edits)
        self._builder = builder
        self._build = build
        self._given = given
        self._parts = dict(build.tree.walk())

    @property
    def document(self) -> PositionedData:
        """The data with its positions, which is this object itself."""
        return self

    @property
    def files(self) -> dict[str, Source]:
        """Name -> source, for all files read so far for the scenario that was named."""
        return self._builder.library.sources

    @property
    def path(self) -> Path:
        """The file that was named, resolved."""
        return self._build.path

    @property
    def variants(self) -> tuple[str, ...]:
        """The variants that a suite passes on to its members."""
        return tuple(part.text for part in self._build.passed_on)

    @property
    def passed_on(self) -> tuple[Part, ...]:
        """The same, with the places where they are asked for."""
        return tuple(self._build.passed_on)

    @property
    def own_variants(self) -> tuple[str, ...]:
        """The variants for which there was a file of its own."""
        return tuple(self._build.own_variants)

    def given(self, name: str) -> Part | None:
        """A parameter's value as written behind `?`, with its place; None if it is not given."""
        return self._given.get(name)

    def error(
        self, code: str, message: str, span: Span, hint: str | None = None, suggestion: str | None = None
    ) -> ScenarioError:
        """The exception for one finding, with the sources read so far."""
        return self._builder.library.error(code, message, span, hint, suggestion)

    def with_parameter(self, name: str, text: str, span: Span) -> Resolved:
        """The same with a parameter given as behind `?`; `span` is the place of the value."""
        return Resolved(self._builder, self._build, {**self._given, name: Part(text, span)})

    def find(self, path: DataPath) -> tuple[Document, DataPath]:
        """The file and the path in it where the part at `path`, or its nearest ancestor, was written."""
        path = tuple(path)
        while path not in self._parts:
            path = path[:-1]
        part = self._parts[path]
        return part.document, part.path

    def origin(self, path: DataPath) -> Span:
        """Where the value at `path` was written."""
        return self.value_span(path)

    def param_span(self, name: str) -> Span:
        """Where the parameter was given a value, in the name of the scenario."""
        return self._given[name].span

    def include(self, path: DataPath) -> Resolved:
        """The scenario or npc that the text at `path` names, relative to the file that text stands in.

        Raises:
            ScenarioError: whatever is wrong with the name or the file.
        """
        document, there = self.find(path)
        library = self._builder.library
        text = self.part(path)
        if not isinstance(text, str):
            raise library.error("S104", "the name of a file is a text", document.value_span(there))
        return self._named(text, document.locate(there), _folder(document))

    def include_key(self, path: DataPath) -> Resolved:
        """The scenario that the key at `path` names, relative to the file that the key stands in.

        Raises:
            ScenarioError: whatever is wrong with the name or the file.
        """
        document, there = self.find(path)
        return self._named(str(path[-1]), document.key_span(there), _folder(document))

    def _named(self, text: str, start: Span, folder: Path) -> Resolved:
        """The file of a name that is written in a file."""
        library = self._builder.library
        found = DiagnosticBag()
        name = parse_name(text, start, found)
        found.raise_errors(library.sources)
        file = library.find(name.base.text, folder, name.base.span)
        return _resolved(self._builder, file, name, name.base.span)

    def include_all(self, path: DataPath) -> tuple[Resolved, ...]:
        """The files that the text or list of texts at `path` names.

        A list keeps its order; a text with `*` in its last part stands for the matching files, sorted by name.

        Raises:
            ScenarioError: whatever is wrong with a name or a file.
        """
        part = self.part(path)
        if isinstance(part, list):
            return tuple(file for i in range(len(part)) for file in self.include_all((*path, i)))
        if not isinstance(part, str) or "*" not in part:
            return (self.include(path),)
        document, there = self.find(path)
        span = document.value_span(there)
        files = self._builder.library.matching(part, _folder(document), span)
        names = [ScenarioName(Part(file.name, span), (), {}) for file in files]
        return tuple(_resolved(self._builder, f, n, span) for f, n in zip(files, names, strict=True))

    def with_drawn_files(self) -> Resolved:
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
        self._builder.check_depth(build.tree)
        return Resolved(self._builder, build, self._given)

    def _npc_files(self, place: DataPath) -> list[Resolved]:
        """The npc files that are named at `place`; those that others build on are left out of a pattern."""
        found: list[Resolved] = []
        part = self.part(place)
        places = [(*place, i) for i in range(len(part))] if isinstance(part, list) else [place]
        for one in places:
            files = self.include_all(one)
            for file in files:
                document, there = self.find(one)
                span = document.value_span(there)
                if file.kind != "npc":
                    message = (
                        f"`{file.path.name}` is a file of the kind `{file.kind}`; only npc files can be drawn"
                    )
                    raise self._builder.library.error("S108", message, span)
                abstract = isinstance(file.data, dict) and file.data.get("abstract") is True
                if abstract and len(files) == 1:
                    message = f"`{file.path.name}` is abstract: others build on it, nobody can be it"
                    raise self._builder.library.error("S108", message, span)
                if not abstract:
                    found.append(file)
        return found

    def varied(self, variant: Part) -> Resolved | None:
        """This scenario with a variant that a suite passes on; None if it has no such variant."""
        build = self._build.copy()
        try:
            vary(self._builder, build, variant)
        except ScenarioError as error:
            if any(d.code != "S503" for d in error.diagnostics):
                raise
            return None
        return Resolved(self._builder, build, self._given)

    def patched(self, holder: PositionedData, path: DataPath) -> Resolved:
        """This scenario changed by the mapping (`remove`, `set`, `add`) at `path` of another file.

        Raises:
            ScenarioError: S501, S502, S104.
        """
        build = self._build.copy()
        document, there = holder.find(path)
        patch = Node(document, there, document.part(there))
        if isinstance(patch.children, dict):
            patch.children = {verb: part for verb, part in patch.children.items() if verb in PATCH_VERBS}
        self._builder.patch(build, patch)
        return Resolved(self._builder, build, self._given)

    def with_value(self, path: str, holder: PositionedData, place: DataPath) -> Resolved:
        """This scenario with the value at `place` of another file set at a path of it.

        Raises:
            ScenarioError: S501, S004.
        """
        build = self._build.copy()
        document, there = holder.find(place)
        patch, values = Node(document, there, {}), Node(document, there, {})
        values.children = {path: Node(document, there, document.part(there))}
        patch.children = {"set": values}
        self._builder.patch(build, patch)
        return Resolved(self._builder, build, self._given)

    def with_params(self, values: Mapping[str, tuple[str, Span]]) -> Resolved:
        """This scenario with values for parameters, as if they were written behind `?`: name -> text and its place."""
        given = {name: Part(text, span) for name, (text, span) in values.items()}
        return Resolved(self._builder, self._build.copy(), {**self._given, **given})


def resolve(name: str, base: Path | None = None, texts: Mapping[Path, Source] | None = None) -> Resolved:
    """The scenario of a name: `NAME(+VARIANT)*(?parameter=value(&parameter=value)*)?`.

    Args:
        name: a path or the name of a shipped scenario, with variants and parameters.
        base: where relative paths start, by default the working directory. If given, files of the scenario may
            come from anywhere below it, else only from the folder of the named file; and always from the shipped
            ones.
        texts: resolved path -> text that stands for the file, which need not exist.

    Raises:
        ScenarioError: with everything found up to the first file that cannot be used.
    """
    source = name_source(name)
    found = DiagnosticBag()
    folder = base if base is not None else Path()
    parsed = parse_name(name, source.span(1, 1), found, folder)
    found.raise_errors({source.name: source})
    path = _named_file(parsed.base, folder, source, texts or {})
    library = Library([path.parent] if base is None else [base, path.parent], texts)
    library.sources[source.name] = source
    return _resolved(Builder(library), path, parsed)


def shipped_names() -> list[str]:
    """The names of the shipped scenarios, suites, and variants that stand for themselves; sorted."""
    return names_in(shipped_folder())


def _resolved(builder: Builder, path: Path, name: ScenarioName, asked: Span | None = None) -> Resolved:
    build = builder.built(path, asked)
    if len(name.variants) > MAX_CHAIN:
        message = f"at most {MAX_CHAIN} variants can be combined"
        raise builder.library.error("S507", message, name.variants[-1].span)
    for variant in name.variants:
        vary(builder, build, variant)
    return Resolved(builder, build, name.params)


def _folder(document: Document) -> Path:
    assert document.path is not None, "internal: a library's documents are files"
    return document.path.parent


def _named_file(part: Part, folder: Path, source: Source, texts: Mapping[Path, Source]) -> Path:
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
        if is_file(candidate) or (texts and candidate.resolve() in texts):
            return candidate.resolve()
    if os.path.lexists(beside):
        # Reading it says what is wrong with it: a folder, a pipe, a link that leads nowhere.
        return Path(os.path.realpath(beside))
    found = DiagnosticBag()
    if looks_like_path(text):
        head = text[: text.rfind("/") + 1]
        near = did_you_mean(text, [head + name for name in yaml_files(folder / head)])
        found.error("S007", "there is no such file", Span(text, 1, 1), suggestion=near)
    else:
        near = did_you_mean(text, [*shipped_names(), *names_in(folder)])
        hint = None if near else "a file is given by its path; shipped are " + ", ".join(shipped_names())
        found.error("S504", f"there is no scenario `{text}`", part.span, hint=hint, suggestion=near)
    raise ScenarioError(found, {source.name: source})


def _with_suffix(path: Path) -> Path:
    return path.parent / (path.name + ".yaml")

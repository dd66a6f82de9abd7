"""One scenario file and what it builds on, put together as a tree."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from socialai_dsl.diagnostics import DiagnosticBag, did_you_mean
from socialai_dsl.loader.library import Library
from socialai_dsl.loader.limits import MAX_CHAIN, MAX_DEPTH
from socialai_dsl.loader.names import Part
from socialai_dsl.loader.patches import Edit, apply_patch, check_variant
from socialai_dsl.loader.tree import Node, merge, tree_of
from socialai_dsl.source import Span

KINDS: Final = ("scenario", "npc", "variant", "suite", "library", "experiment")
"""The kinds of file; exactly one of these keys is present."""

ANY: Final = "any"
"""What a variant that fits every scenario is `of`."""

_DECLARED_NAME: Final = re.compile(r"[A-Za-z0-9_-]{1,80}")


@dataclass
class Ancestor:
    """What a scenario is, or is a variant of: variants are looked for by folder and stem.

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
        kind: one of `KINDS`.
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
    passed_on: list[Part] = field(default_factory=list)
    own_variants: list[str] = field(default_factory=list)

    def copy(self) -> Build:
        """The same, free to be changed further."""
        return Build(
            self.tree.copy(),
            self.kind,
            self.name,
            self.path,
            list(self.lineage),
            list(self.edits),
            list(self.passed_on),
            list(self.own_variants),
        )


class Builder:
    """Puts scenarios together from the files of one library."""

    def __init__(self, library: Library) -> None:
        self.library = library

    def built(self, path: Path, asked: Span | None = None, chain: tuple[Path, ...] = ()) -> Build:
        """A file with `extends` and, for a variant, with what it is a variant of.

        Args:
            path: the file, resolved.
            asked: where its name is written; None if it was given from outside.
            chain: the files that build on it.

        Raises:
            ScenarioError: what is wrong with it or with a file it builds on.
        """
        if asked is not None:
            self.check_chain(path, chain, asked)
        root, kind = self.read(path, asked)
        declared = root.text(kind) or ""
        name = declared if _DECLARED_NAME.fullmatch(declared) else path.stem
        lineage = [Ancestor(path.parent, path.stem, path)]
        if kind == "variant" and root.text("of") != ANY:
            base = self._base(root, "of", path, chain)
            self.patch(base, root)
            built = Build(base.tree, base.kind, name, path, lineage + base.lineage, base.edits)
            if base.kind == "suite":
                self._pass_on(built, base, root)
            return built
        if root.entry("extends") is not None:
            root = self._extended(root, kind, path, chain)
        return Build(root, kind, name, path, lineage)

    @staticmethod
    def _pass_on(built: Build, base: Build, root: Node) -> None:
        """A suite's variant that is named directly is passed on to the members like one that is named by `+`."""
        built.passed_on, built.own_variants = list(base.passed_on), list(base.own_variants)
        stem = base.lineage[0].stem + "_"
        declared = root.entry("variant")
        if declared is not None and built.path.stem.startswith(stem):
            variant = Part(built.path.stem.removeprefix(stem), declared.value_span())
            built.passed_on.append(variant)
            built.own_variants.append(variant.text)

    def read(self, path: Path, asked: Span | None) -> tuple[Node, str]:
        """A file as a tree of its own, and its kind; a variant's shape is checked, since no model sees it."""
        root = tree_of(self.library.read(path, asked))
        kind = self._kind(root)
        if kind == "variant":
            found = DiagnosticBag()
            check_variant(root, found)
            found.raise_errors(self.library.sources)
        return root, kind

    def patch(self, build: Build, patch: Node) -> None:
        """Apply a patch.

        Raises:
            ScenarioError: with everything that is wrong with it.
        """
        found = DiagnosticBag()
        build.edits += apply_patch(build.tree, patch, found)
        found.raise_errors(self.library.sources)
        self.check_depth(build.tree)

    def check_chain(self, path: Path, chain: tuple[Path, ...], asked: Span) -> None:
        """Whether `path` may be built on by the files of `chain`.

        Raises:
            ScenarioError: S506 if it is one of them, S507 if they are too many.
        """
        if path in chain:
            circle = " → ".join(p.name for p in (*chain[chain.index(path) :], path))
            raise self.library.error("S506", f"these files build on each other in a circle: {circle}", asked)
        if len(chain) >= MAX_CHAIN:
            raise self.library.error("S507", f"more than {MAX_CHAIN} files build on each other", asked)

    def _base(self, root: Node, key: str, path: Path, chain: tuple[Path, ...]) -> Build:
        """What the file named at `key` (`of` or `extends`) is."""
        entry = root.entry(key)
        assert entry is not None, "internal: the key was looked at before"
        span = entry.value_span()
        if not isinstance(entry.value, str):
            raise self.library.error("S104", f"`{key}` names one file, it is not {entry.kind}", span)
        build = self.built(self.library.find(entry.value, path.parent, span), span, (*chain, path))
        if build.kind == "variant":
            message = f"`{entry.value}` is a variant of any scenario; nothing can be built on it"
            raise self.library.error("S108", message, span)
        return build

    def _extended(self, root: Node, kind: str, path: Path, chain: tuple[Path, ...]) -> Node:
        base = self._base(root, "extends", path, chain)
        entry = root.entry("extends")
        assert entry is not None, "internal: the key was looked at before"
        if base.kind != kind:
            message = f"`{entry.value}` is a file of kind `{base.kind}`, this one is of kind `{kind}`"
            raise self.library.error("S108", message, entry.value_span())
        assert isinstance(base.tree.children, dict), "internal: a file is a mapping"
        assert isinstance(root.children, dict), "internal: a file is a mapping"
        base.tree.children.pop("abstract", None)
        del root.children["extends"]
        merged = merge(base.tree, root)
        self.check_depth(merged)
        return merged

    def _kind(self, root: Node) -> str:
        if not isinstance(root.children, dict):
            message = f"a scenario file is a mapping of keys; this one is {root.kind}"
            hint = "it starts with a key such as `scenario: name`"
            raise self.library.error("S108", message, root.value_span(), hint=hint)
        kinds = [key for key in root.children if key in KINDS]
        if len(kinds) == 1:
            return kinds[0]
        if kinds:
            message = f"a file has only one of `{kinds[0]}` and `{kinds[1]}`"
            raise self.library.error("S107", message, root.children[kinds[1]].key_span())
        for key, part in root.children.items():
            near = did_you_mean(key, KINDS)
            if near:
                message = f"unknown key `{key}`, and no key says what this file is"
                raise self.library.error("S108", message, part.key_span(), suggestion=near)
        hint = "give one of " + ", ".join(f"`{kind}: name`" for kind in KINDS)
        raise self.library.error("S108", "no key says what this file is", root.value_span(), hint=hint)

    def check_depth(self, tree: Node) -> None:
        """Whether a tree that was put together is shallow enough.

        Raises:
            ScenarioError: S004.
        """
        for path, node in tree.walk():
            if len(path) > MAX_DEPTH:
                message = f"put together, the scenario is nested more than {MAX_DEPTH} levels deep"
                raise self.library.error("S004", message, node.value_span())

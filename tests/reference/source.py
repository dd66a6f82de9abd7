"""The strings of a scenario as trees: parameters and defines written out in place, random choices numbered."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import fields, replace
from itertools import count
from typing import Any

from socialai_dsl.grammar import ast
from socialai_dsl.grammar.ast import ParseProblem, parse_expression, parse_text
from tests.reference.script import Belief, Frame, Script
from tests.reference.world import Entity


class Value:
    """An expression at its place in the scenario: the tree, and which of its nodes draw at random, numbered."""

    def __init__(self, site: str, tree: ast.Node) -> None:
        self.site, self.tree = site, tree
        drawing = [node for node in source_order(tree) if draws(node)]
        self.ordinals = {id(node): number for number, node in enumerate(drawing)}

    def __deepcopy__(self, memo: dict[int, Any]) -> Value:
        """A copied world shares its expressions: they never change, and their nodes are known by identity."""
        return self


def source_order(node: ast.Node) -> list[ast.Node]:
    """A node and all below it, from left to right as written."""
    if isinstance(node, ast.Call):
        parts: list[Any] = [*([node.subject] if node.subject else []), *node.args]
    else:
        parts = list(node.children())
    return [node, *(deeper for part in parts for deeper in source_order(part))]


def draws(node: ast.Node) -> bool:
    """Whether evaluating this node draws at random."""
    if isinstance(node, ast.Quantifier):
        return node.name == "pick"
    if isinstance(node, ast.Call):
        return node.subject is None and node.name in ("pick", "choose")
    return isinstance(node, ast.Name) and node.id == "wander"


class Sources:
    """Gives the tree of any value of one scenario; each is made once."""

    def __init__(self, scenario: Script) -> None:
        self.scenario = scenario
        self.fresh = count()
        self.known: dict[tuple[str, str], Value] = {}
        self.macros = {None: self._defines(scenario.define)}
        for name, frame in scenario.frames.items():
            self.macros[name] = {**self.macros[None], **self._defines(frame.define)}

    def expression(self, site: str, source: Any, frame: str | None = None) -> Value:
        """The value of a YAML scalar that holds an expression."""
        return self._value(site, "expression", source, frame)

    def text(self, site: str, source: Any, frame: str | None = None) -> Value:
        """The value of a YAML scalar that holds a text."""
        return self._value(site, "text", source, frame)

    def name(self, site: str, source: Any) -> Value:
        """A name: an expression (`pick(John | Jack)`) if it reads as one, else a text (`Old Sam`)."""
        try:
            return self._value(site, "expression", source, None)
        except ParseProblem:
            return self._value(site, "text", source, None)

    def frame_of(self, name: str | None) -> Frame | None:
        """The frame of that name."""
        return None if name is None else self.scenario.frames[name]

    def beliefs_of(self, member: Entity) -> Iterable[tuple[str, Belief]]:
        """What a member takes for true, by name; `one_of` as it was drawn."""
        versions = self.scenario.versions(member.key)
        drawn = (
            0 if member.drawn_from is None else list(self.scenario.files[member.key]).index(member.drawn_from)
        )
        return versions[drawn].beliefs.items()

    def _value(self, site: str, kind: str, source: Any, frame: str | None) -> Value:
        key = (site, f"{kind} {source!r}")
        if key not in self.known:
            tree = parse_text(str(source)) if kind == "text" else read(source)
            self.known[key] = Value(site, self._expand(tree, {}, frame))
        return self.known[key]

    def _defines(self, defines: dict[str, Any]) -> dict[str, tuple[list[str], ast.Node]]:
        macros = {}
        for head, body in defines.items():
            tree = parse_expression(head)
            arguments = (
                [a.id for a in tree.args if isinstance(a, ast.Name)] if isinstance(tree, ast.Call) else []
            )
            assert isinstance(tree, ast.Call | ast.Name)
            name = tree.name if isinstance(tree, ast.Call) else tree.id
            macros[name] = (arguments, read(body))
        return macros

    def _expand(self, node: Any, bound: dict[str, ast.Node], frame: str | None) -> Any:
        """A fresh copy of the tree, with nothing left that stands for something else.

        Variables of quantifiers get new names, so that what is put in cannot be captured.
        """
        macros = self.macros[frame]
        if isinstance(node, ast.Parameter):
            return self._expand(read(self._parameter(node.id)), {}, frame)
        if isinstance(node, ast.Name):
            if node.id in bound:
                return self._expand(bound[node.id], {}, frame)
            if node.id in macros:
                return self._expand(macros[node.id][1], {}, frame)
            return replace(node)
        if isinstance(node, ast.Call) and node.subject is None and node.name in macros:
            names, body = macros[node.name]
            arguments = [self._expand(argument, bound, frame) for argument in node.args]
            return self._expand(body, dict(zip(names, arguments, strict=True)), frame)
        if isinstance(node, ast.Quantifier):
            variable = f"{node.var}~{next(self.fresh)}"
            inner = {**bound, node.var: ast.Name(variable)}
            return replace(
                node,
                var=variable,
                group=self._expand(node.group, bound, frame),
                where=node.where and self._expand(node.where, inner, frame),
                to=node.to and self._expand(node.to, bound, frame),
            )
        if isinstance(node, ast.Call) and isinstance(node.subject, ast.Quantifier):
            # In what is done to `those(...)` the variable is each of them.
            those = self._expand(node.subject, bound, frame)
            inner = {**bound, node.subject.var: ast.Name(those.var)}
            arguments = [self._expand(argument, inner, frame) for argument in node.args]
            return replace(node, subject=those, args=tuple(arguments))
        changes: dict[str, Any] = {}
        for field in fields(node):
            value = getattr(node, field.name)
            if isinstance(value, ast.Node):
                changes[field.name] = self._expand(value, bound, frame)
            elif isinstance(value, tuple):
                changes[field.name] = tuple(
                    self._expand(item, bound, frame) if isinstance(item, ast.Node) else item for item in value
                )
        return replace(node, **changes)

    def _parameter(self, name: str) -> Any:
        return self.scenario.params[name]


def read(source: Any) -> ast.Node:
    """A YAML scalar as an expression."""
    if isinstance(source, bool):
        return ast.Truth(source)
    if isinstance(source, int):
        return ast.Number(source)
    return parse_expression(str(source))

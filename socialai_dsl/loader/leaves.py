"""The leaves of a suite's tree: which values are drawn together, how likely, and what each leaf is made of."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import Final

from socialai_dsl.diagnostics import DiagnosticBag
from socialai_dsl.loader.reader import Data, PositionedData
from socialai_dsl.source import DataPath

NODE_KEYS: Final = ("about", "scenario", "set", "remove", "add", "layout")
"""Keys of a value in a tree; every other key is a parameter below it."""

MAX_LEAVES: Final = 512


@dataclass(frozen=True)
class Leaf:
    """One way to give every parameter of a tree a value.

    Attributes:
        labels: parameter -> the value's label, in reading order. places: parameter -> where the value stands.
        weight: how likely an episode plays it, if every value of a parameter is equally likely.
        nodes: the mappings on its way, from the root on: each may change the scenario.
        scenario, layout: where they are named; None if nowhere.
    """

    labels: Mapping[str, str] = field(default_factory=dict)
    places: Mapping[str, DataPath] = field(default_factory=dict)
    weight: Fraction = Fraction(1)
    nodes: tuple[DataPath, ...] = ()
    scenario: DataPath | None = None
    layout: DataPath | None = None

    @property
    def name(self) -> str:
        """What people call it: `introduction=ask,problem=boxes`."""
        return ",".join(f"{parameter}={label}" for parameter, label in self.labels.items())


def label_of(value: Data) -> str:
    """How a value of a list is called, and written behind `?`."""
    return str(value).lower() if isinstance(value, bool) else str(value)


def leaves_of(tree: Data, places: PositionedData, found: DiagnosticBag) -> tuple[Leaf, ...]:
    """The leaves of a tree of the right shape, in reading order; reports S004, S107 and S213.

    Args:
        tree: the data at `tree`.
        places: where the parts of the suite's file stand.
        found: takes the findings.
    """
    count = _count(tree)
    if count > MAX_LEAVES:
        message = f"this tree has {count} leaves; at most {MAX_LEAVES} are played"
        found.error("S004", message, places.key_span(("tree",)))
        return ()
    return tuple(_below(tree, ("tree",), places, found))


def parameters_of(tree: Data, path: DataPath = ("tree",)) -> Iterator[tuple[str, DataPath, Data]]:
    """Every parameter of a tree with its place and its values."""
    for parameter, values in tree.items() if isinstance(tree, dict) else ():
        if parameter in NODE_KEYS:
            continue
        yield parameter, (*path, parameter), values
        for label, node in values.items() if isinstance(values, dict) else ():
            yield from parameters_of(node, (*path, parameter, label))


def _count(node: Data) -> int:
    count = 1
    for parameter, values in node.items() if isinstance(node, dict) else ():
        if parameter not in NODE_KEYS:
            below = map(_count, values.values()) if isinstance(values, dict) else [1] * len(_listed(values))
            count *= sum(below)
    return count


def _listed(values: Data) -> list[Data]:
    return values if isinstance(values, list) else []


def _below(node: Data, path: DataPath, places: PositionedData, found: DiagnosticBag) -> list[Leaf]:
    """The leaves at and below a value."""
    assert isinstance(node, dict), "internal: a value of a tree that is no mapping has no keys"
    own = Leaf(
        nodes=(path,),
        scenario=(*path, "scenario") if "scenario" in node else None,
        layout=(*path, "layout") if "layout" in node else None,
    )
    leaves = [own]
    for parameter, values in node.items():
        if parameter not in NODE_KEYS:
            chosen = _values(parameter, values, (*path, parameter), places, found)
            leaves = [_joined(own, one, other, places, found) for one in leaves for other in chosen]
    return leaves


def _values(
    parameter: str, values: Data, path: DataPath, places: PositionedData, found: DiagnosticBag
) -> list[Leaf]:
    """The leaves of one parameter: of each of its values."""
    made: list[Leaf] = []
    labels: list[tuple[str, DataPath, Data]] = (
        [(label, (*path, label), node) for label, node in values.items()]
        if isinstance(values, dict)
        else [(label_of(value), (*path, i), {}) for i, value in enumerate(_listed(values))]
    )
    seen: set[str] = set()
    for label, place, node in labels:
        if label in seen:
            found.error("S213", f"`{label}` is a value of `{parameter}` already", places.value_span(place))
            continue
        seen.add(label)
        below = _below(node, place, places, found) if node else [Leaf()]
        for leaf in below:
            if parameter in leaf.labels:
                message = f"`{parameter}` has a value already on the way to here"
                found.error("S213", message, places.key_span(leaf.places[parameter][:-1]))
            made.append(
                replace(
                    leaf,
                    labels={parameter: label} | dict(leaf.labels),
                    places={parameter: place} | dict(leaf.places),
                    weight=leaf.weight / len(labels),
                )
            )
    return made


def _joined(own: Leaf, one: Leaf, other: Leaf, places: PositionedData, found: DiagnosticBag) -> Leaf:
    """Two values that are drawn together below `own`; what is said deeper replaces what `own` says."""
    for word in ("scenario", "layout"):
        before, after = getattr(one, word), getattr(other, word)
        if after is not None and before not in (None, getattr(own, word)):
            first = places.key_span(before)
            message = f"two values of this leaf name a {word}; the other one stands in line {first.line}"
            found.error("S107", message, places.key_span(after))
    for parameter in one.labels.keys() & other.labels.keys():
        message = f"`{parameter}` has a value already in this leaf"
        found.error("S213", message, places.key_span(other.places[parameter][:-1]))
    return Leaf(
        {**one.labels, **other.labels},
        {**one.places, **other.places},
        one.weight * other.weight,
        (*one.nodes, *other.nodes),
        other.scenario or one.scenario,
        other.layout or one.layout,
    )

"""The members of a suite: those it lists, what it sweeps over, or the leaves of its tree; all of them or a split."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from itertools import product
from typing import Final

from socialai_dsl.diagnostics import DiagnosticBag, ScenarioError, did_you_mean
from socialai_dsl.loader.resolved import ResolvedFile
from socialai_dsl.schema.annotations import keys_of, keys_that_hold
from socialai_dsl.schema.suite import Value
from socialai_dsl.source import Data, DataPath, Node
from socialai_dsl.vocabulary import spelt

NODE_KEYS: Final = frozenset(keys_of(Value))
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
        """Its name: `introduction=ask,problem=boxes`."""
        return ",".join(f"{parameter}={label}" for parameter, label in self.labels.items())


def leaves_of(tree: Data, places: Node, found: DiagnosticBag) -> tuple[Leaf, ...]:
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


def _below(node: Data, path: DataPath, places: Node, found: DiagnosticBag) -> list[Leaf]:
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


def _values(parameter: str, values: Data, path: DataPath, places: Node, found: DiagnosticBag) -> list[Leaf]:
    """The leaves of one parameter: of each of its values."""
    made: list[Leaf] = []
    labels: list[tuple[str, DataPath, Data]] = (
        [(label, (*path, label), node) for label, node in values.items()]
        if isinstance(values, dict)
        else [(spelt(value), (*path, i), {}) for i, value in enumerate(_listed(values))]
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


def _joined(own: Leaf, one: Leaf, other: Leaf, places: Node, found: DiagnosticBag) -> Leaf:
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


# -- members -------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Member:
    """A scenario as a suite's file names it.

    Attributes:
        name: what the suite calls it: its name with the variants and parameters written there, or its leaf.
        scenario: with what the suite changes in it, and with the variants that the suite passes on.
        place: where it is named.
        weight: how likely an episode plays it, in proportion to the others.
        labels: of a leaf, parameter -> value.
        layout: where the suite's file says how its episodes start; None if they are drawn.
    """

    name: str
    scenario: ResolvedFile
    place: DataPath
    weight: Fraction = Fraction(1)
    labels: Mapping[str, str] = field(default_factory=dict)
    layout: DataPath | None = None


def members_of(suite: ResolvedFile) -> tuple[Member, ...]:
    """The members in order: of the split that `?split=` chooses, with the variants passed on.

    Raises:
        ScenarioError: whatever is wrong with the members; S503 if no member can take a variant; S206 if there is
            no such split.
    """
    split = _chosen_split(suite)
    found = DiagnosticBag()
    if _mapping(suite.data, "tree") is not None:
        members = _leaf_members(suite, split, found)
    else:
        members = [
            one for place in _member_places(suite, split) for one in _swept(suite, place, split, found)
        ]
    found.raise_errors(suite.files)
    return tuple(_with_variants(suite, members))


def check_splits(suite: ResolvedFile) -> None:
    """Whether every split names members, also those that are not chosen.

    Raises:
        ScenarioError: whatever is wrong with them.
    """
    found = DiagnosticBag()
    if _mapping(suite.data, "tree") is not None:
        leaves = leaves_of(_part(suite.data, "tree"), suite.tree, DiagnosticBag())
        if _are_known(suite, leaves, _held_out(suite), ("held_out",), found):
            for split in (None, *_splits(suite)):
                _split_leaves(suite, leaves, split, found)
            _check_held_out(suite, leaves, found)
    else:
        for split in _splits(suite):
            for place in _member_places(suite, split):
                if place[0] == "splits":
                    _member(suite, place, found)
    found.raise_errors(suite.files)


def _with_variants(suite: ResolvedFile, members: Sequence[Member]) -> Sequence[Member]:
    for variant in suite.passed_on:
        changed = [member.scenario.varied(variant) for member in members]
        if not any(changed) and variant.text not in suite.own_variants:
            message = f"no member of `{suite.name}` has a variant `{variant.text}`"
            raise suite.error("S503", message, variant.span)
        members = [
            replace(member, scenario=now or member.scenario)
            for now, member in zip(changed, members, strict=True)
        ]
    return members


# --- members that are listed ---


def _member(suite: ResolvedFile, place: DataPath, found: DiagnosticBag) -> Member | None:
    """The scenario that is named at a place; None if something is wrong with it."""
    entry = suite.tree.at(place).data if place[0] != "sweep" else None
    try:
        if not isinstance(entry, dict):
            scenario = suite.include_key(place) if place[0] == "sweep" else suite.include(place)
            member = Member(_called(scenario), scenario, place)
        else:
            named = (*place, "scenario")
            scenario = suite.include(named).patched(suite.tree.at(place))
            name = entry.get("name")
            layout = (*place, "layout") if "layout" in entry else None
            member = Member(str(name) if name else _called(scenario), scenario, named, layout=layout)
    except ScenarioError as error:
        found.extend(error.diagnostics)
        return None
    return member if _can_be_played(suite, member.scenario, member.place, found) else None


def _called(scenario: ResolvedFile) -> str:
    given = "&".join(f"{name}={value}" for name, value in scenario.params.items())
    return f"{scenario.name}?{given}" if given else scenario.name


def _can_be_played(
    suite: ResolvedFile, scenario: ResolvedFile, place: DataPath, found: DiagnosticBag
) -> bool:
    abstract = isinstance(scenario.data, dict) and scenario.data.get("abstract") is True
    if scenario.kind == "scenario" and not abstract:
        return True
    what = "an abstract scenario" if abstract else f"a file of the kind `{scenario.kind}`"
    written = place[-1] if place[0] == "sweep" else suite.tree.at(place).data
    message = f"`{written}` is {what}; the members of a suite are scenarios"
    found.error("S108", message, suite.tree.value_span(place))
    return False


def _member_places(suite: ResolvedFile, split: str | None) -> list[DataPath]:
    """Where the members of a split are named."""
    written, swept = _part(suite.data, "members"), _mapping(suite.data, "sweep")
    own: list[DataPath] = (
        [("members", i) for i in range(len(written))]
        if isinstance(written, list)
        else [("sweep", name) for name in swept or ()]
    )
    chosen = _splits(suite).get(split) if split is not None else None
    if not isinstance(chosen, dict) or split is None:
        return own
    others, swapped = chosen.get("members"), chosen.get("replace")
    if isinstance(others, list):
        return [("splits", split, "members", i) for i in range(len(others))]
    if not isinstance(swapped, dict):
        return own
    names = {place: _written_name(suite, place) for place in own}
    return [("splits", split, "replace", names[place]) if names[place] in swapped else place for place in own]


def _written_name(suite: ResolvedFile, place: DataPath) -> str:
    """What the file calls a member: its text, or its name."""
    entry = place[-1] if place[0] == "sweep" else suite.tree.at(place).data
    return str(entry.get("name", entry.get("scenario")) if isinstance(entry, dict) else entry)


# --- members that are swept over ---


def _swept(suite: ResolvedFile, place: DataPath, split: str | None, found: DiagnosticBag) -> Iterator[Member]:
    """A member once for each combination of the values that are swept over; they share its weight."""
    member = _member(suite, place, found)
    if member is None:
        return
    name = _written_name(suite, place)
    values = _mapping(_mapping(suite.data, "sweep") or {}, name)
    if not values:
        yield member
        return
    combinations = list(product(*([(path, i) for i in range(len(_listed(values[path])))] for path in values)))
    if len(combinations) > MAX_LEAVES:
        message = f"this sweep has {len(combinations)} members; at most {MAX_LEAVES} are played"
        found.error("S004", message, suite.tree.key_span(("sweep", name)))
        return
    for combination in combinations:
        scenario = member.scenario
        labels = {path: spelt(_listed(values[path])[i]) for path, i in combination}
        try:
            for path, i in combination:
                scenario = scenario.with_value(path, suite.tree.at(("sweep", name, path, i)))
        except ScenarioError as error:
            found.extend(d for d in error.diagnostics if str(d) not in map(str, found))
            continue
        text = ",".join(f"{path}={label}" for path, label in labels.items())
        weight = member.weight / len(combinations)
        yield replace(member, name=f"{member.name}[{text}]", scenario=scenario, weight=weight, labels=labels)


# --- leaves ---


def _leaf_members(suite: ResolvedFile, split: str | None, found: DiagnosticBag) -> list[Member]:
    tree = _part(suite.data, "tree")
    leaves = leaves_of(tree, suite.tree, found)
    scenarios: dict[DataPath, ResolvedFile | None] = {}
    for leaf in leaves:
        if leaf.scenario is None:
            place = list(leaf.places.values())[-1] if leaf.places else ("tree",)
            message = f"nothing says which scenario the leaf `{leaf.name}` is"
            hint = "give `scenario: file.yaml` at one of its values, or at the tree's own level"
            found.error("S105", message, suite.tree.value_span(place), hint=hint)
        elif leaf.scenario not in scenarios:
            member = _member(suite, leaf.scenario, found)
            scenarios[leaf.scenario] = member.scenario if member is not None else None
    _check_parameters(suite, tree, leaves, scenarios, found)
    played = _split_leaves(suite, leaves, split, found)
    made = (_leaf_member(suite, leaf, scenarios.get(leaf.scenario or ()), found) for leaf in played)
    return [member for member in made if member is not None]


def _leaf_member(
    suite: ResolvedFile, leaf: Leaf, scenario: ResolvedFile | None, found: DiagnosticBag
) -> Member | None:
    """A leaf as a member: its scenario, with the leaf's values for the parameters it declares, and its changes."""
    if scenario is None or leaf.scenario is None:
        return None
    try:
        for node in leaf.nodes:
            scenario = scenario.patched(suite.tree.at(node))
    except ScenarioError as error:
        known = set(map(str, found))
        found.extend(d for d in error.diagnostics if str(d) not in known)
        return None
    declared = _mapping(scenario.data, "params") or {}
    scenario = scenario.with_params(
        {
            name: (label, suite.tree.value_span(leaf.places[name]))
            for name, label in leaf.labels.items()
            if name in declared
        }
    )
    return Member(leaf.name, scenario, leaf.scenario, leaf.weight, leaf.labels, leaf.layout)


def _check_parameters(
    suite: ResolvedFile,
    tree: Data,
    leaves: Sequence[Leaf],
    scenarios: Mapping[DataPath, ResolvedFile | None],
    found: DiagnosticBag,
) -> None:
    """A parameter that no scenario below it declares, and whose values say nothing, is a mistake."""
    for parameter, place, values in parameters_of(tree):
        if isinstance(values, dict) and any(values.values()):
            continue
        below = [leaf for leaf in leaves if leaf.places.get(parameter, ())[: len(place)] == place]
        files = [scenarios.get(leaf.scenario or ()) for leaf in below]
        known = {name for file in files if file is not None for name in _mapping(file.data, "params") or {}}
        added = {
            name
            for leaf in below
            for node in leaf.nodes
            for verb in keys_that_hold(Value, "patch")
            for path in _mapping(suite.tree.at(node).data, verb) or {}
            for name in (path.removeprefix("params."), "params" if path == "params" else path)
        }
        if parameter not in known | added and "params" not in added and None not in files and files:
            near = did_you_mean(parameter, known)
            hint = None if near else "its values may be mappings that say what they change"
            message = f"no scenario has a parameter `{parameter}`, and its values change nothing"
            found.error("S206", message, suite.tree.key_span(place), suggestion=near, hint=hint)


def _split_leaves(
    suite: ResolvedFile, leaves: Sequence[Leaf], split: str | None, found: DiagnosticBag
) -> tuple[Leaf, ...]:
    """The leaves of a split, or of the suite itself.

    They have all the values of `only`, not all those of `without`, and none that is held out unless `only` names it.
    """
    chosen = _splits(suite).get(split) if split is not None else None
    kept, held = tuple(leaves), _held_out(suite)
    for word, has in (("only", True), ("without", False)):
        wanted = _mapping(chosen, word)
        if wanted is None:
            continue
        if not _are_known(suite, leaves, wanted, ("splits", str(split), word), found):
            return tuple(leaves)
        kept = tuple(leaf for leaf in kept if _has(leaf, wanted) is has)
        if has:
            held = {name: _besides(values, wanted.get(name)) for name, values in held.items()}
    kept = tuple(leaf for leaf in kept if not _has_some(leaf, held))
    if not kept and leaves:
        message = f"no leaf is in the split `{split}`" if split is not None else "every leaf is held out"
        place = ("splits", split) if split is not None else ("held_out",)
        found.error("S504", message, suite.tree.key_span(place))
    return kept


def _held_out(suite: ResolvedFile) -> dict[str, Data]:
    return _mapping(suite.data, "held_out") or {}


def _check_held_out(suite: ResolvedFile, leaves: Sequence[Leaf], found: DiagnosticBag) -> None:
    """A leaf that is held out differs from all that are not in more than its name."""
    held = _held_out(suite)
    scenarios = {
        leaf.scenario: _member(suite, leaf.scenario, DiagnosticBag())
        for leaf in leaves
        if held and leaf.scenario is not None
    }
    others: dict[str, Leaf] = {}
    for leaf in sorted(leaves, key=lambda leaf: _has_some(leaf, held)):
        named = scenarios.get(leaf.scenario or ())
        member = _leaf_member(suite, leaf, named.scenario, DiagnosticBag()) if named is not None else None
        if member is None:
            continue
        layout = suite.tree.at(member.layout).data if member.layout is not None else None
        played = repr(
            (member.scenario.path, member.scenario.data, sorted(member.scenario.params.items()), layout)
        )
        other = others.setdefault(played, leaf)
        if _has_some(leaf, held) and not _has_some(other, held):
            message = f"`{leaf.name}` is held out, and plays the same as `{other.name}`, which is not"
            found.error("S107", message, suite.tree.key_span(("held_out",)))
            return


def _besides(values: Data, named: Data) -> Data:
    """The values of a parameter that are not named."""
    return [label for label in _labels(values) if named is None or label not in _labels(named)]


def _has_some(leaf: Leaf, values: Mapping[str, Data]) -> bool:
    """Whether a leaf has one of the values of a parameter, whichever."""
    return any(leaf.labels.get(parameter) in _labels(labels) for parameter, labels in values.items())


def _has(leaf: Leaf, wanted: Mapping[str, Data]) -> bool:
    """Whether a leaf has one of the values that are wanted, for every parameter."""
    return all(leaf.labels.get(parameter) in _labels(values) for parameter, values in wanted.items())


def _labels(values: Data) -> list[str]:
    return [spelt(value) for value in (values if isinstance(values, list) else [values])]


def _are_known(
    suite: ResolvedFile,
    leaves: Sequence[Leaf],
    wanted: Mapping[str, Data],
    place: DataPath,
    found: DiagnosticBag,
) -> bool:
    """Whether the tree has these parameters with these values."""
    before = len(list(found))
    for parameter, values in wanted.items():
        known = list(dict.fromkeys(leaf.labels[parameter] for leaf in leaves if parameter in leaf.labels))
        span = suite.tree.key_span((*place, parameter))
        if not known:
            parameters = list(dict.fromkeys(name for leaf in leaves for name in leaf.labels))
            near = did_you_mean(parameter, parameters)
            hint = None if near else "its parameters are " + ", ".join(parameters)
            found.error("S504", f"the tree has no parameter `{parameter}`", span, suggestion=near, hint=hint)
            continue
        for i, label in enumerate(_labels(values)):
            if label not in known:
                near = did_you_mean(label, known)
                hint = None if near else "one of " + ", ".join(known)
                at = (*place, parameter, i) if isinstance(values, list) else (*place, parameter)
                message = f"`{label}` is no value of `{parameter}` in the tree"
                found.error("S504", message, suite.tree.value_span(at), suggestion=near, hint=hint)
    return len(list(found)) == before


# --- splits ---


def _splits(suite: ResolvedFile) -> dict[str, Data]:
    return _mapping(suite.data, "splits") or {}


def _chosen_split(suite: ResolvedFile) -> str | None:
    split, known = suite.given("split"), _splits(suite)
    if split is None or split.text in known:
        return split.text if split else None
    near = did_you_mean(split.text, known)
    hint = None if near else "it has " + ", ".join(known) if known else "it has none"
    message = f"`{suite.name}` has no split `{split.text}`"
    raise suite.error("S206", message, split.span, hint, near)


def _part(data: Data, key: str) -> Data:
    return data.get(key) if isinstance(data, dict) else None


def _mapping(data: Data, key: str) -> dict[str, Data] | None:
    """A mapping in a mapping; None if there is none."""
    part = _part(data, key)
    return part if isinstance(part, dict) else None

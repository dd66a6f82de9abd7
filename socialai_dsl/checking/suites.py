"""Checks a suite's file: its members, their meaning, and their shared action space."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from math import gcd, lcm

from socialai_dsl.checking.loaded import LoadedScenario, LoadedSuite, Start
from socialai_dsl.checking.scenarios import Draft, draft_of, meaning_of, naming_the_patch
from socialai_dsl.diagnostics import DiagnosticBag, ScenarioError, advice_on
from socialai_dsl.loader.members import NODE_KEYS, Member, check_splits, members_of, parameters_of
from socialai_dsl.loader.resolved import ResolvedFile
from socialai_dsl.schema.shape import model_of
from socialai_dsl.schema.suite import Entry, Split, Suite
from socialai_dsl.semantics.suite import shared_actions, shared_space
from socialai_dsl.source import DataPath


def check_suite(resolved: ResolvedFile, bag: DiagnosticBag) -> LoadedSuite | None:
    """A suite with its members; None if something is wrong with it or with one of them. `bag` takes the findings."""
    own = DiagnosticBag()
    suite = _right_shape(resolved, own)
    members = _members(suite, resolved, own) if suite is not None else ()
    loaded = _loaded(suite, members, bag) if suite is not None else ()
    made = None
    if suite is not None and not bag.has_errors:
        names = [member.name for member in members]
        checked = [scenario.checked for scenario in loaded]
        actions = shared_actions(suite, [scenario.scenario for scenario in loaded])
        space = shared_space(suite, names, checked, actions, resolved.tree, own)
        if not own.has_errors:
            made = LoadedSuite(
                resolved.name,
                tuple(loaded),
                tuple(names),
                tuple(member.labels for member in members),
                _weights(members),
                tuple(_start(member, resolved) for member in members),
                suite.draw == "in_sequence",
                space,
                suite,
                resolved,
            )
    bag.extend(naming_the_patch(finding, resolved) for finding in own)
    return replace(made, warnings=tuple(bag)) if made is not None else None


def _right_shape(resolved: ResolvedFile, own: DiagnosticBag) -> Suite | None:
    """The suite's models; None if the members cannot be looked at."""
    if not _has_parameters(resolved, own):
        return None
    shaped = model_of(Suite, resolved.tree, own, parameters=False)
    _check_parameters(resolved, own)
    if shaped.model is None or own.has_errors:
        return None
    if not _is_of_one_kind(shaped.model, resolved, own):
        return None
    return shaped.model


def _has_parameters(resolved: ResolvedFile, own: DiagnosticBag) -> bool:
    """Whether every other key of a tree has values, so that it can be a parameter."""
    tree = resolved.data.get("tree") if isinstance(resolved.data, dict) else None
    wrong = [
        (name, path) for name, path, values in parameters_of(tree) if not isinstance(values, list | dict)
    ]
    for name, path in wrong:
        advice = advice_on(name, NODE_KEYS, "a parameter has a list or a mapping of values")
        message = f"`{name}` is no key of a tree, and no parameter, which has values"
        own.error("S101", message, resolved.tree.key_span(path), **advice)
    return not wrong


def _is_of_one_kind(suite: Suite, resolved: ResolvedFile, bag: DiagnosticBag) -> bool:
    """Whether a suite has members (with or without a sweep over them) or a tree; `bag` says what is too much."""
    own = DiagnosticBag()
    if suite.members is None and suite.sweep is None and suite.tree is None:
        own.error(
            "S105",
            "a suite needs a key `members`",
            resolved.tree.key_span(()),
            hint="or a `tree`, or a `sweep`",
        )
    for word in ("members", "sweep"):
        if suite.tree is not None and getattr(suite, word) is not None:
            message = f"a suite has only one of `tree` and `{word}`"
            own.error("S107", message, resolved.tree.key_span((word,)))
    if suite.draw == "in_sequence":
        _check_acts(suite, resolved, own)
    bag.extend(own)
    return not own.has_errors


def _check_acts(suite: Suite, resolved: ResolvedFile, own: DiagnosticBag) -> None:
    """Acts are listed, and begin where the act before them ends."""
    for word in ("tree", "sweep"):
        if getattr(suite, word) is not None:
            message = f"the acts of an episode are listed in `members`; a `{word}` has no order"
            own.error("S107", message, resolved.tree.key_span((word,)))
    for i, member in enumerate(suite.members or ()):
        if isinstance(member, Entry) and member.layout is not None:
            message = "an act begins where the one before it ends, so it has no `layout`"
            own.error("S107", message, resolved.tree.key_span(("members", i, "layout")))


def _weights(members: Sequence[Member]) -> tuple[int, ...]:
    """The members' weights as whole numbers, as small as can be."""
    common = lcm(*(member.weight.denominator for member in members))
    whole = [int(member.weight * common) for member in members]
    return tuple(weight // gcd(*whole) for weight in whole)


def _start(member: Member, resolved: ResolvedFile) -> Start | None:
    if member.layout is None:
        return None
    layout = resolved.tree.at(member.layout).data
    assert isinstance(layout, dict), "internal: the shape of layouts was checked"
    return Start(layout, member.layout)


def _loaded(suite: Suite, members: Sequence[Member], bag: DiagnosticBag) -> list[LoadedScenario]:
    """The members that are right, with the suite's actions."""
    found = [_Found(member, draft_of(member.scenario, own := DiagnosticBag()), own) for member in members]
    scenarios = [f.draft.scenario for f in found if f.draft is not None]
    actions = shared_actions(suite, scenarios)
    horizon = None
    if suite.draw == "in_sequence":
        horizon = max((scenario.horizon for scenario in scenarios), default=None)
    return [scenario for one in found if (scenario := one.loaded(actions, horizon, bag)) is not None]


@dataclass(frozen=True)
class _Found:
    """A member on its way, with what was found in it so far."""

    member: Member
    draft: Draft | None
    own: DiagnosticBag

    def loaded(
        self, actions: tuple[str, ...], horizon: int | None, bag: DiagnosticBag
    ) -> LoadedScenario | None:
        """The member with the suite's actions and, of an act, the horizon of the whole episode.

        None if something is wrong with it, which `bag` then says.
        """
        draft = self.draft.with_actions(actions) if self.draft is not None else None
        if draft is not None and horizon is not None:
            draft = draft.with_horizon(horizon)
        checked = meaning_of(draft, self.own) if draft is not None else None
        findings = tuple(naming_the_patch(finding, self.member.scenario) for finding in self.own)
        # What is wrong with a part that members share is said once, though each names the patches of its own.
        said = {(d.code, d.span, d.text) for d in bag}
        bag.extend(d for d in findings if (d.code, d.span, d.text) not in said)
        if checked is None or draft is None:
            return None
        return LoadedScenario(checked.name, checked, draft.scenario, self.member.scenario, findings)


def _members(suite: Suite, resolved: ResolvedFile, own: DiagnosticBag) -> Sequence[Member]:
    """The members, which `own` says what is wrong with, as with the splits and sweeps that name them."""
    about = DiagnosticBag()
    _check_splits(suite, resolved, about)
    try:
        members = members_of(resolved)
    except ScenarioError as error:
        own.extend(error.diagnostics)
        misspelt = [d.message for d in error.diagnostics]
        own.extend(d for d in about if not any(f"`{d.suggestion}`" in message for message in misspelt))
        return ()
    own.extend(about)
    seen: set[str] = set()
    for member in members:
        if member.name in seen:
            message = f"`{member.name}` is a member already"
            own.error("S213", message, resolved.tree.value_span(member.place))
        seen.add(member.name)
    return members


def _check_parameters(resolved: ResolvedFile, bag: DiagnosticBag) -> None:
    """A suite has no parameters but its split; members are given theirs in its file."""
    for name in resolved.params:
        if name != "split":
            hint = "only `?split=NAME`; members get theirs in the file: `dance.yaml?length=2`"
            message = f"`{resolved.name}` is a suite and has no parameter `{name}`"
            bag.error("S206", message, resolved.param_name_span(name), **advice_on(name, ["split"], hint))


def _check_splits(suite: Suite, resolved: ResolvedFile, bag: DiagnosticBag) -> None:
    before = len(list(bag))
    for name, split in suite.splits.items():
        _check_split(suite, name, split, resolved, bag)
    if suite.held_out is not None and suite.tree is None:
        message = (
            "values of a `tree` are held out; a suite with `members` has splits with members of their own"
        )
        bag.error("S107", message, resolved.tree.key_span(("held_out",)))
    if suite.sweep is not None and suite.members is not None:
        _check_named(suite, suite.sweep, ("sweep",), resolved, bag)
    if len(list(bag)) > before:
        return
    try:
        check_splits(resolved)
    except ScenarioError as error:
        bag.extend(error.diagnostics)


def _check_split(suite: Suite, name: str, split: Split, resolved: ResolvedFile, bag: DiagnosticBag) -> None:
    of_trees, of_members = ("only", "without"), ("replace", "members")
    for word in of_members if suite.tree is not None else of_trees:
        if getattr(split, word):
            owner = "a tree's splits have" if suite.tree is not None else "splits of members have"
            words = of_trees if suite.tree is not None else of_members
            message = f"{owner} `{words[0]}` and `{words[1]}`, no `{word}`"
            bag.error("S107", message, resolved.tree.key_span(("splits", name, word)))
    if split.replace and split.members is not None:
        message = f"the split `{name}` has only one of `replace` and `members`"
        bag.error("S107", message, resolved.tree.key_span(("splits", name, "members")))
    if suite.tree is None:
        _check_named(suite, split.replace, ("splits", name, "replace"), resolved, bag)


def _check_named(
    suite: Suite, named: Iterable[str], path: DataPath, resolved: ResolvedFile, bag: DiagnosticBag
) -> None:
    """Report keys at a path that should be members of the suite."""
    names = _written(suite)
    for member in named:
        if member not in names:
            advice = advice_on(member, names, "its members are " + ", ".join(names))
            span = resolved.tree.key_span((*path, member))
            bag.error("S504", f"`{member}` is no member of this suite", span, **advice)


def _written(suite: Suite) -> list[str]:
    """What the file calls the members."""
    if suite.members is None:
        return list(suite.sweep or ())
    return [m if isinstance(m, str) else m.name or m.scenario for m in suite.members]

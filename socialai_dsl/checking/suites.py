"""A suite's file to its members, their meaning, and the action space they share."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from socialai_dsl.checking.loaded import LoadedScenario, LoadedSuite
from socialai_dsl.checking.scenarios import Draft, draft_of, meaning_of, naming_the_patch
from socialai_dsl.diagnostics import DiagnosticBag, ScenarioError, did_you_mean
from socialai_dsl.loader import Member, Resolved
from socialai_dsl.schema.shape import model_of
from socialai_dsl.schema.suite import Suite
from socialai_dsl.semantics.suite import shared_actions, shared_space


def check_suite(resolved: Resolved, bag: DiagnosticBag) -> LoadedSuite | None:
    """A suite with its members; None if something is wrong with it or with one of them. `bag` takes the findings."""
    own = DiagnosticBag()
    suite = _right_shape(resolved, own)
    members = _members(resolved, own) if suite is not None else ()
    loaded = _loaded(suite, members, bag) if suite is not None else ()
    made = None
    if suite is not None and not bag.has_errors:
        names = [member.name for member in members]
        checked = [scenario.checked for scenario in loaded]
        actions = shared_actions(suite, [scenario.scenario for scenario in loaded])
        space = shared_space(suite, names, checked, actions, resolved, own)
        if not own.has_errors:
            made = LoadedSuite(resolved.name, tuple(loaded), tuple(names), space, suite, resolved)
    bag.extend(naming_the_patch(finding, resolved) for finding in own)
    return replace(made, warnings=tuple(bag)) if made is not None else None


def _right_shape(resolved: Resolved, own: DiagnosticBag) -> Suite | None:
    """The suite's models; None if the members cannot be looked at."""
    shaped = model_of(Suite, resolved.data, resolved, own)
    _check_parameters(resolved, own)
    if shaped.model is None or own.has_errors:
        return None
    _check_splits(shaped.model, resolved, own)
    return shaped.model


def _loaded(suite: Suite, members: Sequence[Member], bag: DiagnosticBag) -> list[LoadedScenario]:
    """The members that are right, with the suite's actions."""
    found = [_Found(member, draft_of(member.scenario, own := DiagnosticBag()), own) for member in members]
    actions = shared_actions(suite, [f.draft.scenario for f in found if f.draft is not None])
    return [scenario for one in found if (scenario := one.loaded(actions, bag)) is not None]


@dataclass(frozen=True)
class _Found:
    """A member on its way, with what was found in it so far."""

    member: Member
    draft: Draft | None
    own: DiagnosticBag

    def loaded(self, actions: tuple[str, ...], bag: DiagnosticBag) -> LoadedScenario | None:
        """The member with the suite's actions; None if something is wrong with it, which `bag` then says."""
        draft = self.draft.with_actions(actions) if self.draft is not None else None
        checked = meaning_of(draft, self.own) if draft is not None else None
        findings = tuple(naming_the_patch(finding, self.member.scenario) for finding in self.own)
        bag.extend(findings)
        if checked is None or draft is None:
            return None
        return LoadedScenario(checked.name, checked, draft.scenario, self.member.scenario, findings)


def _members(resolved: Resolved, own: DiagnosticBag) -> Sequence[Member]:
    try:
        members = resolved.members()
    except ScenarioError as error:
        own.extend(error.diagnostics)
        return ()
    seen: set[str] = set()
    for member in members:
        if member.name in seen:
            message = f"`{member.name}` is a member already"
            own.error("S213", message, resolved.value_span(member.place))
        seen.add(member.name)
    return members


def _check_parameters(resolved: Resolved, bag: DiagnosticBag) -> None:
    """A suite has no parameters but its split; members are given theirs in its file."""
    for name in resolved.params:
        if name != "split":
            near = did_you_mean(name, ["split"])
            hint = (
                None if near else "only `?split=NAME`; members get theirs in the file: `dance.yaml?length=2`"
            )
            message = f"`{resolved.name}` is a suite and has no parameter `{name}`"
            bag.error("S206", message, resolved.param_span(name), suggestion=near, hint=hint)


def _check_splits(suite: Suite, resolved: Resolved, bag: DiagnosticBag) -> None:
    for name, split in suite.splits.items():
        if split.replace and split.members is not None:
            message = f"the split `{name}` has only one of `replace` and `members`"
            bag.error("S107", message, resolved.key_span(("splits", name, "members")))
        for member in split.replace:
            if member not in suite.members:
                near = did_you_mean(member, suite.members)
                hint = None if near else "its members are " + ", ".join(suite.members)
                span = resolved.key_span(("splits", name, "replace", member))
                bag.error("S504", f"`{member}` is no member of this suite", span, suggestion=near, hint=hint)
    try:
        resolved.check_splits()
    except ScenarioError as error:
        bag.extend(error.diagnostics)

"""A scenario's file to its meaning: parameters, the shape, then what it says."""

from __future__ import annotations

from dataclasses import dataclass, replace

from socialai_dsl.checking.groups import spread
from socialai_dsl.diagnostics import Diagnostic, DiagnosticBag, ScenarioError, Severity, did_you_mean
from socialai_dsl.library import prelude, shared_grammars
from socialai_dsl.loader import Resolved
from socialai_dsl.parameters import Substituted, substitute
from socialai_dsl.schema import Scenario
from socialai_dsl.schema.shape import Shaped, model_of
from socialai_dsl.semantics.check import check_meaning
from socialai_dsl.semantics.plans import Checked
from socialai_dsl.vocabulary import PRIMITIVES

_OF_THE_GRAMMAR = frozenset({"S401", "S402"})
"""What may be wrong because a patch changed the grammar."""

_OF_ALL_VARIANTS = frozenset({"W314", "W317"})
"""What a variant may leave without a use in parts that are there for the others."""

_MAY_FOLLOW = frozenset(
    {
        "S105",
        "S201",
        "S204",
        "S205",
        "S206",
        "S213",
        "S301",
        "S302",
        "S303",
        "S304",
        "S305",
        "S310",
        "S315",
        "S401",
        "S402",
    }
)
"""What may be wrong only because a part of the file was left out, which has been reported."""

_OF_WHOLE_FILES = frozenset({"S316"})
"""What can only be said of a file without other errors: whatever has one may be what would make it possible."""


@dataclass(frozen=True)
class Draft:
    """A scenario of which only the meaning is still to be checked.

    Attributes:
        scenario: its models. name: with variants.
        shaped: the data the models were made of. filled: its parameters. patched: whether a variant changed it.
    """

    scenario: Scenario
    name: str
    shaped: Shaped[Scenario]
    filled: Substituted
    patched: bool = False

    def with_actions(self, actions: tuple[str, ...]) -> Draft:
        """The same with other body actions, as a suite gives them to all its members."""
        given = tuple(action for action in PRIMITIVES if action in actions)
        return replace(self, scenario=self.scenario.model_copy(update={"actions": given}))

    def with_horizon(self, horizon: int) -> Draft:
        """The same with another horizon, as the acts of one episode share one."""
        return replace(self, scenario=self.scenario.model_copy(update={"horizon": horizon}))


def check_scenario(resolved: Resolved, bag: DiagnosticBag) -> tuple[Checked | None, Scenario | None]:
    """What a scenario means, and its models; None for what cannot be had. `bag` takes the findings."""
    draft = draft_of(resolved, bag)
    if draft is None:
        return None, None
    right_shape = not bag.has_errors
    return meaning_of(draft, bag), draft.scenario if right_shape else None


def draft_of(resolved: Resolved, bag: DiagnosticBag) -> Draft | None:
    """A scenario's models; None if it is abstract or has mistakes that keep its meaning from being looked at."""
    try:
        resolved = resolved.with_drawn_files()
    except ScenarioError as error:
        bag.extend(error.diagnostics)
        return None
    assert isinstance(resolved.data, dict), "internal: a file is a mapping"
    filled = substitute(resolved, bag)
    data = _with_grammar(filled, resolved, bag)
    abstract = data.get("abstract") is True
    groups = spread(data, resolved, filled.paths, bag)
    filled = replace(filled, paths=groups.paths)
    failed = bag.has_errors
    shaped = model_of(Scenario, groups.data, groups.places, bag, partial=abstract)
    if shaped.model is None or abstract or failed:
        return None
    return Draft(shaped.model, resolved.name, shaped, filled, bool(resolved.edits))


def meaning_of(draft: Draft, bag: DiagnosticBag) -> Checked | None:
    """What a scenario means; None if something is wrong, which `bag` then says.

    Args:
        draft: the scenario.
        bag: what was found in this scenario so far; takes the findings.
    """
    found = DiagnosticBag()
    shaped, filled = draft.shaped, draft.filled
    checked = check_meaning(
        draft.scenario, draft.name, shaped.places, found, prelude(), shaped.data, filled.values, filled.paths
    )
    if draft.patched:
        found = DiagnosticBag(d for d in found if d.code not in _OF_ALL_VARIANTS)
    if not bag.has_errors:
        bag.extend(found)
        return checked
    doubtful = _OF_WHOLE_FILES | (_MAY_FOLLOW if shaped.lost else frozenset())
    bag.extend(d for d in found if d.severity is Severity.ERROR and d.code not in doubtful)
    return None


def _with_grammar(filled: Substituted, resolved: Resolved, bag: DiagnosticBag) -> dict[str, object]:
    """The data with the name of a shared grammar replaced by the grammar."""
    data = dict(filled.data)
    name = data.get("grammar")
    if not isinstance(name, str):
        return data
    shared = shared_grammars()
    if name in shared:
        return {**data, "grammar": shared[name]}
    span = resolved.value_span(("grammar",))
    near = did_you_mean(name, shared)
    hint = None if near else "shared are " + ", ".join(shared) + "; else write `templates` and `nouns`"
    bag.error("S201", f"there is no shared grammar `{name}`", span, suggestion=near, hint=hint)
    return {**data, "grammar": next(iter(shared.values()))}


def naming_the_patch(finding: Diagnostic, resolved: Resolved) -> Diagnostic:
    """A mistake in a patched scenario says what it was patched by, since its file alone may be right."""
    if not resolved.edits or finding.severity is not Severity.ERROR:
        return finding
    edits = (
        [e for e in resolved.edits if e.path.startswith("grammar")] if finding.code in _OF_THE_GRAMMAR else []
    )
    patches = {f"{e.span.file}:{e.span.line}" for e in edits} or {e.span.file for e in resolved.edits}
    note = f"in `{resolved.name}`, patched by {', '.join(sorted(patches))}"
    return replace(finding, hint=f"{finding.hint}; {note}" if finding.hint else note)

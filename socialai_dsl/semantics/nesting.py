"""Nested `steps`: what is repeated, or left out together."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from socialai_dsl.schema.scenario import Step
from socialai_dsl.semantics.plans import NestedSteps, StepPlan
from socialai_dsl.semantics.resolver import INT, Resolver
from socialai_dsl.semantics.scope import Draws, PlayedFrame, ReportedError, Scope, dotted
from socialai_dsl.semantics.terms import Const, SitedTerm
from socialai_dsl.source import DataPath


@dataclass(frozen=True)
class NestedPlanner:
    """Nests the entries of a frame, by their numbers.

    Attributes:
        condition: the condition at a path, of steps with this address; None if none is written. steps: all entries.
    """

    resolver: Resolver
    played: PlayedFrame
    condition: Callable[[DataPath, object, str], SitedTerm | None]
    steps: Sequence[StepPlan]

    def plan(self) -> tuple[int | NestedSteps, ...]:
        """The numbers of the entries as they are nested, without what is left out for good."""
        frame = self.played.model
        numbers = {path: number for number, (path, _) in enumerate(frame.entries())}
        return tuple(self._nested(frame.steps or (), ("steps",), numbers))

    def _nested(
        self, written: Sequence[Step], path: DataPath, numbers: dict[DataPath, int]
    ) -> Iterator[int | NestedSteps]:
        for i, step in enumerate(written):
            place = (*path, i)
            if step.steps is None:
                if self.steps[numbers[place]].duration != 0:
                    yield numbers[place]
                continue
            within: DataPath = (*self.played.path, *place)
            address = f"{dotted(self.played.address)}.{dotted(place)}"
            rounds = self._rounds((*within, "repeat"), step.repeat, f"{address}.repeat")
            when = self.condition((*within, "when"), step.when, address)
            going = self.condition((*within, "while"), step.while_, address)
            until = self.condition((*within, "until"), step.until, address)
            body = tuple(self._nested(step.steps, (*place, "steps"), numbers))
            if body and rounds:
                numbered = ".".join(str(part) for part in place if part != "steps")
                counter = f"{self.played.member}.rounds[{numbered}]"
                yield NestedSteps(body, rounds, counter, when, going, until)

    def _rounds(self, path: DataPath, raw: object, site: str) -> int:
        """How often nested steps are done at most."""
        if raw is None:
            return 1
        findings, horizon = self.resolver.findings, self.resolver.symbols.scenario.horizon
        draws = Draws(f"{self.played.member}/{site}")
        scope = Scope(path, draws, member=self.played.member, frame=self.played)
        try:
            term = self.resolver.written(raw, INT, scope)  # type: ignore[arg-type]
        except ReportedError:
            return 1
        if isinstance(term, Const) and 0 <= term.value <= horizon:
            return term.value
        message = f"`repeat` is a known number of rounds within the horizon, 0 to {horizon}"
        hint = "fewer rounds by `while:` or `until:`" if not isinstance(term, Const) else None
        findings.error("S106", message, findings.at(path), hint=hint)
        return 1

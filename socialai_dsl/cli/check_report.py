"""This module puts what `socialai check` found into lines for people and objects for tools."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from socialai_dsl.envs.coverage import Coverage
    from socialai_dsl.envs.properties import Report
    from socialai_dsl.semantics.terms import PropertyPlan
    from socialai_dsl.source import Span


@dataclass(frozen=True)
class ScenarioReport:
    """What was found out about one scenario.

    Attributes:
        scenario: its name. rooms, seed: what was tried: rooms 0 to rooms - 1 of the seed.
        tried: its properties with what was found. coverage: if it has none, what of it never happens.
    """

    scenario: str
    rooms: int
    seed: int
    tried: "tuple[tuple[PropertyPlan, Report], ...]"
    coverage: "Coverage | None"

    def fails(self, strict: bool) -> bool:
        """Whether a property fails; with `strict` also whether something is undecided or never happens."""
        verdicts = {report.verdict.value for _, report in self.tried}
        missing = self.coverage is not None and bool(self.coverage.missing)
        return "fails" in verdicts or (strict and ("undecided" in verdicts or missing))

    def lines(self) -> Iterator[str]:
        """The report for people."""
        yield f"{self.scenario}: {self.rooms} rooms of seed {self.seed}"
        for plan, report in self.tried:
            yield f"  {report.verdict.value}: `{plan.text}`: {report.said}"
            if report.verdict.value != "holds":
                numbers = ", ".join(map(str, report.against))
                yield f"    at {_place(plan.span)}" + (f"; rooms {numbers}" if numbers else "")
        if self.coverage is not None:
            yield from _coverage(self.coverage)

    def as_object(self) -> dict[str, Any]:
        """The report for JSON."""
        missing = () if self.coverage is None else self.coverage.missing
        return {
            "scenario": self.scenario,
            "rooms": self.rooms,
            "seed": self.seed,
            "properties": [
                {
                    "property": plan.text,
                    **_place_as_object(plan.span),
                    "verdict": report.verdict.value,
                    "rooms": report.rooms,
                    "held": report.held,
                    "undecided": report.undecided,
                    "against": list(report.against),
                    "said": report.said,
                }
                for plan, report in self.tried
            ],
            "never_happens": [
                {"kind": part.kind, "name": part.name, **_place_as_object(part.span)} for part in missing
            ],
        }


def _coverage(found: "Coverage") -> Iterator[str]:
    happened = found.parts - len(found.missing)
    yield f"  {happened} of {found.parts} states, steps, rules and outcomes happen in some room"
    why = "in none of these rooms" if found.proven else "in no room, as far as they were searched"
    for part in found.missing:
        yield f"  {_place(part.span)}: warning: the {part.kind} `{part.name}` happens {why}"


def _place(span: "Span") -> str:
    return f"{span.file}:{span.line}:{span.column}"


def _place_as_object(span: "Span") -> dict[str, Any]:
    return {"file": span.file, "line": span.line, "column": span.column}

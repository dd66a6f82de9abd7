"""What was found out about a scenario by trying it, as lines for people, objects for tools, and findings."""

from collections.abc import Container, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from statistics import median_high
from typing import Any, Final

from socialai_dsl.analysis.alone import Alone
from socialai_dsl.analysis.coverage import Coverage
from socialai_dsl.analysis.depth import Depth
from socialai_dsl.analysis.effort import why_no_more
from socialai_dsl.analysis.properties import RIVAL_ROOMS
from socialai_dsl.analysis.reports import Report, rooms_text
from socialai_dsl.diagnostics import Diagnostic, Severity
from socialai_dsl.frontend import not_ignored, variant_of
from socialai_dsl.semantics.plans import PropertyPlan
from socialai_dsl.semantics.typed import trace_command
from socialai_dsl.source import Source, Span


@dataclass
class ScenarioReport:
    """The results for one scenario so far.

    Attributes:
        scenario: its name. rooms, seed: what was to be tried: rooms 0 to rooms - 1 of the seed.
        outcomes: where the outcomes are written.
        tried: its properties with what was found. coverage: what of it never happens, if that was tried.
        depth: what success takes, if that was tried.
        sources: the files of the scenario, whose comments may ignore warnings.
        complete: whether the check has ended. interrupted: whether the user stopped it.
        named: whether a command plays the scenario by its name.
    """

    scenario: str
    rooms: int
    seed: int
    outcomes: Span | None = None
    tried: tuple[tuple[PropertyPlan, Report], ...] = ()
    coverage: Coverage | None = None
    depth: Depth | None = None
    sources: Mapping[str, Source] = field(default_factory=dict)
    complete: bool = False
    interrupted: bool = False
    named: bool = True

    def findings(self) -> Iterator[Diagnostic]:
        """Failures as errors, undecided claims and parts that never happen as warnings, each at its place; without
        the warnings that comments ignore.
        """
        return not_ignored(self._found(), self.sources)

    def parts(self) -> Iterator[Diagnostic]:
        """The warnings of `findings` about parts that never happen."""
        return not_ignored(self._parts(), self.sources)

    def summary(self) -> Iterator[str]:
        """The lines of the report without its claims and findings, for the studio."""
        yield f"{self.scenario}: {self.rooms} rooms of seed {self.seed}"
        if self.coverage is not None:
            yield from _coverage(self.coverage, ())
        if self.depth is not None:
            yield from _depth(self.depth, self.rooms)
        if self.complete:
            yield from self._sufficed("socialai check ")

    def _found(self) -> Iterator[Diagnostic]:
        for plan, report in self.tried:
            hint = _listed(report.against) if report.against else None
            if report.against and self.named:
                hint = f"{hint}; to see it: {self._command(plan, report)}"
            if report.verdict.value == "fails":
                message = f"`{plan.text}` does not hold: {report.said}"
                yield Diagnostic("S801", message, plan.span, hint=hint)
            elif report.verdict.value == "undecided":
                message = f"`{plan.text}` is undecided: {report.said}"
                yield Diagnostic("W802", message, plan.span, Severity.WARNING, hint)
        yield from self._parts()
        if self._is_hopeless and self.outcomes is not None:
            message = f"no success can be reached in any of {self.depth.rooms if self.depth else 0} rooms"
            yield Diagnostic("S801", message, self.outcomes)

    def _parts(self) -> Iterator[Diagnostic]:
        if self.coverage is None:
            return
        never = _never(self.coverage, rooms_text(self.rooms))
        for part in self.coverage.missing:
            message = f"the {part.kind} `{part.address}` {never}"
            yield Diagnostic("W802", message, part.span, Severity.WARNING)

    @property
    def _is_hopeless(self) -> bool:
        """Whether no room can be solved."""
        if self.depth is None or not self.depth.rooms:
            return False
        return not (self.depth.steps or self.depth.undecided)

    def fails(self, strict: bool) -> bool:
        """Whether a property fails or no room can be solved; with `strict` also what is undecided or never happens,
        unless a comment ignores it.
        """
        found = list(self.findings())
        return any(d.severity is Severity.ERROR for d in found) or (strict and bool(found))

    def lines(self) -> Iterator[str]:
        """The report for people."""
        yield f"{self.scenario}: {self.rooms} rooms of seed {self.seed}"
        for plan, report in self.tried:
            yield f"  {report.verdict.value}: `{plan.text}`: {report.said}"
            yield from (f"    {line}" for line in lines_apart(plan, report))
            if report.verdict.value != "holds":
                numbers = ", ".join(map(str, report.against))
                yield f"    at {_place(plan.span)}" + (f"; rooms {numbers}" if numbers else "")
                if numbers and self.named:
                    yield f"    to see it: {self._command(plan, report)}"
        if self.coverage is not None:
            yield from _coverage(self.coverage, {finding.span for finding in self.findings()})
        if self.depth is not None:
            yield from _depth(self.depth, self.rooms)
        if self.complete:
            yield from self._sufficed()

    def _command(self, plan: PropertyPlan, report: Report) -> str:
        """What shows the first room that speaks against a claim; with the script, or the rival, if it is about one."""
        name = variant_of(self.scenario, plan.rival) if plan.rival else self.scenario
        room = ["--seed", str(self.seed), "--index", str(report.against[0])]
        return trace_command(name, room, report.acts)

    def _sufficed(self, command: str = "") -> Iterator[str]:
        """What there was time for, where there was not for all; see `why_no_more`."""
        counts = [(f"`{plan.text}`", report.rooms) for plan, report in self.tried if not plan.unasked]
        if self.depth is not None:
            counts.append(("shortest successes", self.depth.rooms))
            if self.depth.alone is not None:
                counts.append(("success without NPCs", self.depth.alone.rooms))
        short = [
            (what, count)
            for what, count in counts
            if count < self.rooms and (count > 0 or not self._is_for_nothing(what))
        ]
        if short:
            listed = ", ".join(f"{count} for {what}" for what, count in short)
            why = why_no_more(self.interrupted, command)
            yield f"  of {self.rooms} rooms there was time for {listed}; {why}"
        elif self.interrupted:
            yield "  it was interrupted before all was tried"

    def _is_for_nothing(self, what: str) -> bool:
        """Whether a property looks at no room at all, such as that of a script that is not there."""
        return any(f"`{plan.text}`" == what and plan.kind in ("oracle", "script") for plan, _ in self.tried)

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
                    "rests": report.rests,
                    "pairs": report.pairs,
                    "held": report.held,
                    "undecided": report.undecided,
                    "against": list(report.against),
                    "said": report.said,
                    "results_by": _apart(report),
                    **({} if report.schelling is None else {"schelling": report.schelling.figures()}),
                }
                for plan, report in self.tried
            ],
            "never_happens": [
                {"kind": part.kind, "name": part.address, **_place_as_object(part.span)} for part in missing
            ],
            "interrupted": self.interrupted,
            "success": None if self.depth is None else asdict(self.depth),
        }


def lines_apart(plan: PropertyPlan, report: Report) -> Iterator[str]:
    """What was found of a claim for each value of the draws by which results are told apart."""
    verb = "solves" if plan.kind in ("oracle", "rival") else "so in"
    for (draw, value), (so, rooms) in report.apart.items():
        yield f"{draw} {value}: {verb} {so} of {rooms_text(rooms)}"


def _apart(report: Report) -> dict[str, dict[str, dict[str, int]]]:
    found: dict[str, dict[str, dict[str, int]]] = {}
    for (draw, value), (so, rooms) in report.apart.items():
        found.setdefault(draw, {})[value] = {"so": so, "rooms": rooms}
    return found


def _coverage(found: Coverage, told: Container[Span]) -> Iterator[str]:
    happened = found.parts - len(found.missing)
    yield f"  {happened} of {found.parts} states, steps, rules and outcomes happen in some room"
    for part in found.missing:
        if part.span in told:
            never = _never(found, "these rooms")
            yield f"  {_place(part.span)}: warning: the {part.kind} `{part.address}` {never}"


def _never(found: Coverage, rooms: str) -> str:
    """How sure it is that something never happens in some rooms."""
    if found.proven:
        return f"happens in none of {rooms}"
    return f"was not seen in {rooms}; not all that can be done there was tried"


def _depth(found: Depth, rooms: int) -> Iterator[str]:
    solvable = len(found.steps)
    line = f"  a success can be reached in {solvable} of {found.rooms} rooms"
    if found.steps:
        middle, longest = median_high(found.steps), found.steps[-1]
        line += f", in {middle} steps in the median and {longest} at most"
    yield line
    for said, numbers in (("no way was found", found.unsolvable), ("undecided", found.undecided)):
        if numbers:
            yield f"    {said} in {_listed(numbers)}"
    if found.unsolved is not None:
        yield f"  the script solves {rooms - len(found.unsolved)} of {rooms} rooms"
        if found.unsolved:
            yield f"    not {_listed(found.unsolved)}"
    for name, share in found.rivals.items():
        yield f"  the rival `{name}` solves {share:.0%} of {rooms_text(max(rooms, RIVAL_ROOMS))}"
    if found.alone is not None:
        yield from _alone(found.alone)


def _alone(found: Alone) -> Iterator[str]:
    yield (
        f"  without seeing or hearing an NPC an agent can get at least {found.success:.1%} "
        f"± {2 * found.error:.1%} (two standard errors)"
    )
    if found.undecided:
        yield f"    {found.undecided} of {found.rooms} rooms were not decided and count as never solved"


_LISTED: Final = 8


def _listed(numbers: Sequence[int]) -> str:
    """The first of a list of rooms."""
    more = len(numbers) - _LISTED
    shown = ", ".join(map(str, numbers[:_LISTED]))
    word = "room" if len(numbers) == 1 else "rooms"
    return f"{word} {shown}" + (f" and {more} more" if more > 0 else "")


def _place(span: Span) -> str:
    return f"{span.file}:{span.line}:{span.column}"


def _place_as_object(span: Span) -> dict[str, Any]:
    return {"file": span.file, "line": span.line, "column": span.column}

"""The first pass: registers, utterance classes, lines and sites of a scenario, before any code."""

from __future__ import annotations

from dataclasses import dataclass, field

from socialai_dsl.compiler.assembler import Block, CodeTable, Sites
from socialai_dsl.compiler.classes import Classes
from socialai_dsl.compiler.consequences import ComputedStatuses
from socialai_dsl.compiler.expressions import Expressions
from socialai_dsl.compiler.folding import Facts
from socialai_dsl.compiler.homes import Homes
from socialai_dsl.compiler.lines import Lines, note_what_is_said
from socialai_dsl.compiler.probes import Probes
from socialai_dsl.compiler.registers import Registers
from socialai_dsl.semantics.plans import Checked


@dataclass(frozen=True)
class Allocation:
    """What code of one scenario is emitted with; lowering adds registers of its own, sites, lines and code.

    Attributes:
        inbox: the first register of the inboxes. inbox_of: that of the inbox of each member with a frame.
        inbox_size: entries of an inbox.
        rules: name of each counted rule, in the order of their counters.
    """

    checked: Checked
    probes: Probes
    registers: Registers
    classes: Classes
    lines: Lines
    homes: Homes
    computed: ComputedStatuses
    inbox: int
    inbox_of: dict[str, int]
    inbox_size: int
    sites: Sites = field(default_factory=Sites)
    code: CodeTable = field(default_factory=CodeTable)
    rules: list[str] = field(default_factory=list)

    def expressions(self, facts: Facts | None = None, inbox: int = -1) -> Expressions:
        """What emits into a fresh block, given these facts."""
        to = Expressions(Block(), self.checked, self.registers, self.classes, self.sites, inbox)
        to.facts = facts or to.facts
        return to


def allocate(checked: Checked, probes: Probes, numbered: Lines | None) -> Allocation:
    """Where everything of a scenario is; lines are numbered as in `numbered`, if that is given."""
    registers = Registers.of(checked)
    classes = Classes(checked)
    lines = Lines(checked, classes)
    if numbered is not None:
        lines.adopt(numbered)
    note_what_is_said(checked, lines, registers)
    homes = Homes(checked, registers)
    # A member hears each of the others at most once between two of its turns.
    inbox_size, entry_size = 1 + len(checked.frames), 3 if classes.speakers_matter else 1
    inbox = registers.reserve(0)
    inbox_of = {frame.member: registers.reserve(1 + entry_size * inbox_size) for frame in checked.frames}
    computed = ComputedStatuses(checked)
    return Allocation(
        checked, probes, registers, classes, lines, homes, computed, inbox, inbox_of, inbox_size
    )

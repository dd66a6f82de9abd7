"""Checked scenario to program, in four passes: allocate, lower, lay out, verify."""

from __future__ import annotations

from dataclasses import replace

from socialai_dsl.compiler.allocation import allocate
from socialai_dsl.compiler.lines import Lines
from socialai_dsl.compiler.lowering import lower
from socialai_dsl.compiler.probes import NO_PROBES, Probed, Probes, Recorder
from socialai_dsl.compiler.questions import Asking, notes_of
from socialai_dsl.compiler.tables import Tables
from socialai_dsl.compiler.verifier import verify
from socialai_dsl.program import Header, Program
from socialai_dsl.semantics.plans import Checked

__all__ = ["compile_asking", "compile_probed", "compile_scenario", "verify"]


def compile_scenario(checked: Checked) -> Program:
    """The program of a scenario in which nothing is wrong.

    Raises AssertionError("internal: ...") for our own mistakes only: an author's are found before.
    """
    program, _ = _compiled(checked, NO_PROBES, None)
    return program


def compile_probed(checked: Checked) -> Probed:
    """A program that does the same as that of the scenario, and notes why rules do not fire (`probes`)."""
    program, lines = _compiled(checked, NO_PROBES, None)
    recorder = Recorder(checked, program.header(Header.REGISTERS))
    probed, _ = _compiled(checked, recorder, lines)
    for word in _SAME:
        same = program.header(word) == probed.header(word)
        assert same, f"internal: {word.name} of a probed program is not that of the program"
    names = [name for name in probed.registers if name.register < recorder.first]
    assert tuple(names) == program.registers, "internal: registers of a probed program are not the program's"
    assert program.rules == probed.rules, "internal: rules of a probed program are not the program's"
    return Probed(probed, recorder.first, recorder.rules, recorder.outcomes)


_SAME = (
    *(Header.CLASSES, Header.LINES, Header.TOKENS, Header.INBOX, Header.INBOX_SIZE, Header.HEARD),
    *(Header.HEARD_SIZE, Header.LOG, Header.LOG_SIZE, Header.COUNTERS, Header.STATES, Header.FRAMES),
)


def compile_asking(checked: Checked) -> Asking:
    """A program that does the same as that of the scenario, and notes what its `probes` ask about."""
    own = {item.path: item for probe in checked.probes for item in probe.remembered}
    known = {item.path: item for item in checked.remembered}
    program, _ = _compiled(replace(checked, remembered=tuple((own | known).values())), NO_PROBES, None, True)
    names = {name.path: name for name in program.registers}
    return Asking(program, tuple(notes_of(plan, names) for plan in checked.probes))


def _compiled(
    checked: Checked, probes: Probes, numbered: Lines | None, asking: bool = False
) -> tuple[Program, Lines]:
    """The program and its lines, which are numbered as in `numbered`, if that is given."""
    # So that nothing that claims and probes are about is part of a program.
    checked = replace(checked, properties=(), probes=checked.probes if asking else ())
    allocation = allocate(checked, probes, numbered)
    lowered = lower(allocation)
    program = Tables(allocation, lowered).program()
    verify(program)
    return program, allocation.lines

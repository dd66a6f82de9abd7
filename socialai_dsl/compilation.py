"""Compiles loaded scenarios and suites to programs, in four passes: allocate, lower, lay out, verify."""

from __future__ import annotations

from dataclasses import replace
from typing import overload

from socialai_dsl.checking.loaded import Loaded, LoadedScenario, LoadedSuite
from socialai_dsl.compiler.expressions import Lines
from socialai_dsl.compiler.lowering import NO_NOTES, NoteTaker, allocate, lower
from socialai_dsl.compiler.notes import ConditionPart, Note, NotingProgram, Recorder, Value
from socialai_dsl.compiler.questions import Asking, ProbeNotes, notes_of
from socialai_dsl.compiler.questions import Text as NotedText
from socialai_dsl.compiler.tables import program_of, verify
from socialai_dsl.program import Header, Program
from socialai_dsl.program_suite import ProgramSuite
from socialai_dsl.semantics.plans import CheckedScenario

__all__ = [
    "ConditionPart",
    "Note",
    "NotedText",
    "NotingProgram",
    "ProbeNotes",
    "Value",
    "compile_asking",
    "compile_asking_loaded",
    "compile_loaded",
    "compile_noting",
    "compile_scenario",
    "scenarios_of",
]


@overload
def compile_loaded(loaded: LoadedScenario) -> Program: ...
@overload
def compile_loaded(loaded: LoadedSuite) -> ProgramSuite: ...
@overload
def compile_loaded(loaded: Loaded) -> Program | ProgramSuite: ...


def compile_loaded(loaded: Loaded) -> Program | ProgramSuite:
    """Compile a scenario to its program, or a suite to its programs.

    Args:
        loaded: what `load` returned.

    Raises:
        ValueError: it is something else, such as a name.
    """
    if isinstance(loaded, LoadedScenario):
        return compile_scenario(loaded.checked)
    if not isinstance(loaded, LoadedSuite):
        raise ValueError(f"compile: got {loaded!r}; expected what `load` returns")
    return _suite(loaded, tuple(compile_scenario(member.checked) for member in loaded.members))


def compile_asking_loaded(
    loaded: Loaded,
) -> tuple[Program | ProgramSuite, tuple[tuple[ProbeNotes, ...], ...]]:
    """Programs that do the same as those of `compile_loaded` and note what `probes` ask about; and where they do.

    Returns:
        The program or suite, and for each of its programs the notes of its probes.
    """
    asking = tuple(map(compile_asking, scenarios_of(loaded)))
    programs = tuple(one.program for one in asking)
    playable = _suite(loaded, programs) if isinstance(loaded, LoadedSuite) else programs[0]
    return playable, tuple(one.probes for one in asking)


def _suite(loaded: LoadedSuite, programs: tuple[Program, ...]) -> ProgramSuite:
    space = loaded.space
    return ProgramSuite(
        loaded.name,
        programs,
        loaded.member_names,
        space.actions,
        space.sentences,
        space.template_maps,
        space.slot_maps,
        loaded.labels,
        loaded.weights,
        tuple(None if start is None else start.layout for start in loaded.starts),
        loaded.in_sequence,
    )


def scenarios_of(loaded: Loaded) -> tuple[CheckedScenario, ...]:
    """The scenarios of what was loaded, in the order of the programs that `compile_loaded` makes of them."""
    return tuple(
        member.checked for member in (loaded.members if isinstance(loaded, LoadedSuite) else (loaded,))
    )


def compile_scenario(checked: CheckedScenario) -> Program:
    """The program of a scenario in which nothing is wrong.

    Raises AssertionError("internal: ...") for our own mistakes only: an author's are found before.
    """
    program, _ = _compiled(checked, NO_NOTES, None)
    return program


def compile_noting(checked: CheckedScenario) -> NotingProgram:
    """A program that does the same as that of the scenario, and notes why rules do not fire (`compiler.notes`)."""
    program, lines = _compiled(checked, NO_NOTES, None)
    recorder = Recorder(checked, program.header(Header.REGISTERS))
    noting, _ = _compiled(checked, recorder, lines)
    for word in _SAME:
        same = program.header(word) == noting.header(word)
        assert same, f"internal: {word.name} of a noting program is not that of the program"
    names = [name for name in noting.registers if name.register < recorder.first]
    assert tuple(names) == program.registers, "internal: registers of a noting program are not the program's"
    assert program.rules == noting.rules, "internal: rules of a noting program are not the program's"
    return NotingProgram(noting, recorder.first, recorder.rules, recorder.outcomes)


_SAME = (
    *(Header.CLASSES, Header.LINES, Header.TOKENS, Header.INBOX, Header.INBOX_SIZE, Header.HEARD),
    *(Header.HEARD_SIZE, Header.LOG, Header.LOG_SIZE, Header.COUNTERS, Header.STATES, Header.FRAMES),
)


def compile_asking(checked: CheckedScenario) -> Asking:
    """A program that does the same as that of the scenario, and notes what its `probes` ask about."""
    own = {item.path: item for probe in checked.probes for item in probe.remembered}
    known = {item.path: item for item in checked.remembered}
    program, _ = _compiled(replace(checked, remembered=tuple((own | known).values())), NO_NOTES, None, True)
    names = {name.path: name for name in program.registers}
    return Asking(program, tuple(notes_of(plan, names) for plan in checked.probes))


def _compiled(
    checked: CheckedScenario, notes: NoteTaker, numbered: Lines | None, asking: bool = False
) -> tuple[Program, Lines]:
    """The program and its lines, which are numbered as in `numbered`, if that is given."""
    # So that nothing that claims, tests and probes are about is part of a program.
    checked = replace(checked, properties=(), tests=(), probes=checked.probes if asking else ())
    allocation = allocate(checked, notes, numbered)
    lowered = lower(allocation)
    program = program_of(allocation, lowered)
    verify(program)
    return program, allocation.lines

"""Checked scenario to program: allocate, lower, lay out, verify."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from socialai_dsl.compiler.assembler import Block, CodeTable, Sites
from socialai_dsl.compiler.behaviour import Behaviour
from socialai_dsl.compiler.classes import Classes
from socialai_dsl.compiler.expressions import Expressions
from socialai_dsl.compiler.homes import Homes
from socialai_dsl.compiler.lines import Lines, note_what_is_said
from socialai_dsl.compiler.links import links
from socialai_dsl.compiler.memories import push_acts, remember
from socialai_dsl.compiler.outcomes import outcome_table
from socialai_dsl.compiler.probes import NO_PROBES, Probed, Probes, Recorder
from socialai_dsl.compiler.registers import Registers
from socialai_dsl.compiler.setup import require, reset
from socialai_dsl.compiler.statuses import ComputedStatuses
from socialai_dsl.compiler.tables import Tables
from socialai_dsl.compiler.timers import tick
from socialai_dsl.compiler.verifier import verify
from socialai_dsl.compiler.world_rules import world_rules
from socialai_dsl.program import Flag, Header, Program
from socialai_dsl.semantics.terms import Checked

__all__ = ["compile_probed", "compile_scenario", "verify"]


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


def _compiled(checked: Checked, probes: Probes, numbered: Lines | None) -> tuple[Program, Lines]:
    """The program and its lines, which are numbered as in `numbered`, if that is given."""
    checked = replace(checked, properties=())  # so that nothing they ask about is part of a program
    registers = Registers.of(checked)
    classes = Classes(checked)
    sites = Sites()
    lines = Lines(checked, classes)
    if numbered is not None:
        lines.adopt(numbered)
    note_what_is_said(checked, lines, registers)
    homes = Homes(checked, registers)
    code = CodeTable()
    tables = Tables(checked, registers, classes, sites, lines, code)
    computed = ComputedStatuses(checked)

    def entry(label: str, *emitters: Callable[[Expressions], None]) -> int:
        to = Expressions(Block(), checked, registers, classes, sites)
        for emit in emitters:
            emit(to)
        return code.add(to.block, label)

    entries = {Header.RESET_PC: entry("reset", lambda to: reset(to, computed, homes))}
    inboxes = tables.reserve_inboxes()
    behaviour = Behaviour(checked, registers, classes, sites, lines, homes, code, [], inboxes, probes)
    frames = [behaviour.frame(number, frame) for number, frame in enumerate(checked.frames)]
    entries |= {
        Header.REQUIRE_PC: entry("require", require),
        Header.BEFORE_PC: entry("before", remember),
        Header.LINKS_PC: entry("links", links),
        Header.SETTLE_PC: entry("settle", computed.settle),
        Header.RULES_PC: entry(
            "rules",
            push_acts,
            lambda to: world_rules(to, lines, homes, behaviour.rules, probes),
        ),
        Header.TICK_PC: entry("tick", tick),
    }
    outcomes = outcome_table(checked, registers, classes, sites, code, probes)
    if isinstance(probes, Recorder):
        probes.declare(registers)
    flags = Flag.SETTLE_ALWAYS if computed.settle_always else 0

    program = tables.program(entries, flags, frames, outcomes, tuple(behaviour.rules))
    verify(program)
    assert program.words.dtype == np.int32, "internal: a program is a vector of int32"
    return program, lines

"""Checked scenario to program: allocate, lower, lay out, verify."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from socialai_dsl.compiler.assembler import CodeTable, Sites
from socialai_dsl.compiler.behaviour import Behaviour
from socialai_dsl.compiler.classes import Classes
from socialai_dsl.compiler.lines import Lines
from socialai_dsl.compiler.outcomes import outcome_table
from socialai_dsl.compiler.registers import Registers
from socialai_dsl.compiler.setup import reset_code
from socialai_dsl.compiler.tables import Tables
from socialai_dsl.compiler.verifier import verify
from socialai_dsl.program import Program
from socialai_dsl.semantics.terms import Checked

__all__ = ["compile_loaded", "compile_scenario", "verify"]


def compile_scenario(checked: Checked) -> Program:
    """The program of a scenario in which nothing is wrong.

    Raises AssertionError("internal: ...") for our own mistakes only: an author's are found before.
    """
    registers = Registers.of(checked)
    classes = Classes(checked)
    sites = Sites()
    lines = Lines(checked, classes)
    code = CodeTable()
    tables = Tables(checked, registers, classes, sites, lines, code)

    reset_pc = code.add(reset_code(checked, registers, classes, sites), "reset")
    inboxes = tables.reserve_inboxes()
    behaviour = Behaviour(checked, registers, classes, sites, lines, code, [], inboxes)
    frames = [(frame, behaviour.rows(number, frame)) for number, frame in enumerate(checked.frames)]
    outcomes = outcome_table(checked, registers, classes, sites, code)

    program = tables.program(reset_pc, frames, outcomes, tuple(behaviour.rules))
    verify(program)
    assert program.words.dtype == np.int32, "internal: a program is a vector of int32"
    return program


class Loaded(Protocol):
    """What `load` returns, as far as the compiler reads it."""

    @property
    def checked(self) -> Checked:
        """The resolved scenario."""
        ...


def compile_loaded(scenario: Loaded) -> Program:
    """The program of a scenario that `load` returned."""
    return compile_scenario(scenario.checked)

"""The second pass: every part of a scenario to code, each once."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from socialai_dsl.compiler.allocation import Allocation
from socialai_dsl.compiler.behaviour import FrameCode, frame_code
from socialai_dsl.compiler.consequences import links, tick
from socialai_dsl.compiler.expressions import Expressions
from socialai_dsl.compiler.memories import push_acts, remember
from socialai_dsl.compiler.outcomes import outcome_table
from socialai_dsl.compiler.probes import Recorder
from socialai_dsl.compiler.questions import ask
from socialai_dsl.compiler.setup import require, reset
from socialai_dsl.compiler.world_rules import world_rules
from socialai_dsl.program import Header


@dataclass(frozen=True)
class Lowered:
    """Where the code of a scenario begins.

    Attributes:
        entries: header word -> address. frames: of each frame instance. outcomes: addresses by (class, action).
    """

    entries: dict[Header, int]
    frames: list[FrameCode]
    outcomes: list[int]


def lower(allocation: Allocation) -> Lowered:
    """The code of a scenario, collected in the allocation's table."""

    def entry(label: str, *emitters: Callable[[Expressions], None]) -> int:
        to = allocation.expressions()
        for emit in emitters:
            emit(to)
        return allocation.code.add(to.block, label)

    computed, homes, probes = allocation.computed, allocation.homes, allocation.probes
    entries = {Header.RESET_PC: entry("reset", lambda to: reset(to, computed, homes))}
    frames = [frame_code(allocation, number, frame) for number, frame in enumerate(allocation.checked.frames)]
    entries |= {
        Header.REQUIRE_PC: entry("require", require),
        Header.BEFORE_PC: entry("before", ask, remember),
        Header.LINKS_PC: entry("links", links),
        Header.SETTLE_PC: entry("settle", computed.settle),
        Header.RULES_PC: entry(
            "rules",
            push_acts,
            lambda to: world_rules(to, allocation.lines, homes, allocation.rules, probes),
        ),
        Header.TICK_PC: entry("tick", tick),
    }
    outcomes = outcome_table(allocation)
    if isinstance(probes, Recorder):
        probes.declare(allocation.registers)
    return Lowered(entries, frames, outcomes)

"""Rules of the world to code: once a step, after all turns, each that holds fires."""

from __future__ import annotations

from socialai_dsl.compiler.assembler import Label, constant
from socialai_dsl.compiler.effects import Effects
from socialai_dsl.compiler.expressions import Expressions, chance_word
from socialai_dsl.compiler.folding import FALSE, fold
from socialai_dsl.compiler.homes import Homes
from socialai_dsl.compiler.lines import Lines
from socialai_dsl.compiler.probes import NO_PROBES, Probes
from socialai_dsl.program import Op
from socialai_dsl.semantics.plans import RulePlan
from socialai_dsl.semantics.terms import BOOL


def world_rules(
    to: Expressions,
    lines: Lines,
    homes: Homes,
    counted: list[str],
    probes: Probes = NO_PROBES,
) -> None:
    """Emit the rules top to bottom, and add their names to those that are counted."""
    for rule in to.checked.rules:
        counted.append(rule.name)
        if rule.when is not None and fold(rule.when.term, to.facts, to.classes) == FALSE:
            if probes.recording:
                _ask_in_vain(to, rule, len(counted) - 1, probes)
            continue
        _rule(to, lines, homes, rule, len(counted) - 1, probes)


def _ask_in_vain(to: Expressions, rule: RulePlan, counter: int, probes: Probes) -> None:
    """Only note what keeps a rule from ever firing."""
    assert rule.when is not None, "internal: a rule without a condition can fire"
    following = Label()
    asked = probes.rule(to, counter, rule, None)
    asked.condition(to, "when", rule.when, following)
    asked.report(to, following)
    to.block.bind(following)


def _rule(
    to: Expressions,
    lines: Lines,
    homes: Homes,
    rule: RulePlan,
    counter: int,
    probes: Probes,
) -> None:
    assert not rule.hears, "internal: the world has no ears"
    assert rule.say is None, "internal: the world has no voice"
    assert rule.do is None, "internal: the world has no body"
    block = to.block
    following = Label()
    mark = block.taken
    fired = to.registers.add(f"world.fired.{rule.name}", BOOL) if rule.once else None
    block.span = rule.span
    asked = probes.rule(to, counter, rule, None)
    if fired is not None:
        block.test(Op.IF_EQ, fired, constant(0), asked.unless("once", following))
    if rule.when is not None:
        asked.condition(to, "when", rule.when, following)
    block.span = rule.span
    if rule.chance is not None:
        site = to.sites.row(f"{rule.site}.chance")
        block.test(Op.IF_CHANCE, chance_word(rule.chance), site, asked.unless("chance", following))
    Effects(to, lines, homes).emit(rule, counter, asked.nothing("values", following))
    if fired is not None:
        block.emit(Op.LOAD, fired, constant(1))
    asked.report(to, following)
    block.bind(following)
    block.release(mark)

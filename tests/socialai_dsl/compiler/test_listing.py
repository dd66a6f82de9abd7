"""The listing of a shipped scenario, compared with a golden file: a change of the compiler shows as a diff."""

from dataclasses import replace
from pathlib import Path

import pytest

import socialai_dsl as sd
from socialai_dsl.program import Header
from socialai_dsl.semantics.plans import RulePlan
from socialai_dsl.semantics.terms import CELL, DIRECTION, CellOf, Const, Quantification, Sees, SitedTerm
from socialai_dsl.semantics.terms import Test as Relation
from tests.socialai_dsl.compiler.workbench import (
    BOX,
    GUIDE,
    HERE,
    SPAN,
    cell,
    compiled,
    entity,
    listed,
    workbench,
)

GOLDENS = Path(__file__).parents[2] / "listings"


@pytest.mark.parametrize("name", ["talkitout", "talkitout_no_liar+oracle"])
def test_listing(name: str, update_goldens: bool) -> None:
    golden = GOLDENS / f"{name}.txt"
    listing = sd.compile(sd.load(name)).listing()
    if update_goldens:
        golden.parent.mkdir(exist_ok=True)
        golden.write_text(listing, encoding="utf-8")
    assert listing == golden.read_text(encoding="utf-8"), (
        f"{golden.name} changed: look, then `make update-goldens`"
    )


def test_every_instruction_of_a_rule_says_where_it_comes_from() -> None:
    program = sd.compile(sd.load("talkitout"))
    first_rule = min(pc for pc, label in program.labels.items() if label.endswith(".then"))
    spans = [span for span in program.source_map[first_rule:] if span is not None]
    assert {span.file.rsplit("/", 1)[-1] for span in spans} == {"talkitout.yaml"}
    assert len(spans) > 0.7 * len(program.source_map[first_rule:])


def test_cells_sets_and_entries_are_readable() -> None:
    nearest = Quantification(
        CELL, "nearest", "c", (), Relation("unobstructed", HERE, entity(BOX)), cell(5, 1), cells=True
    )
    seen = Sees(entity(GUIDE), CellOf(CELL, nearest), Const(DIRECTION, 2))
    # By chance, so that it does not wait for a status to change.
    rule = RulePlan("law", "rules[0]", SPAN, when=SitedTerm(seen, "rules[0].when", SPAN), chance=0.5)
    program = compiled(replace(workbench(), rules=(rule,)))
    start = program.header(Header.RULES_PC)
    assert f"rules at {start}" in program.listing().splitlines()[3]
    shown = [" ".join(line.split()[1:-1]) for line in listed(program, "rules")]
    assert shown[1:8] == [
        "B_FLOOR 0",
        f"EACH_CELL 0, %1, -> {start + 6}",
        f"IF_UNOBSTRUCTED %3, box, -> {start + 5}",
        f"SKIP -> {start + 6}",
        "DROP_CELL",
        "END_EACH",
        "NEAREST_CELL %1, 0, (5, 1)",
    ]
    assert shown[-5:-3] == ["SEES %0, guide, %3", f"IF_NE %0, #0, -> {start + 17}"]

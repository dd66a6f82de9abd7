"""The listing of a shipped scenario, compared with a golden file: a change of the compiler shows as a diff."""

from pathlib import Path

import pytest

import socialai_dsl as sd

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

"""Layouts written into files: what is written starts every episode, and nothing else in the file changes."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import pytest
import yaml

import socialai_dsl as sd
from socialai_dsl.studio.messages import RefusalError, Room
from socialai_dsl.studio.session import Session

SCENARIOS = Path(__file__).parents[3] / "scenarios"
FORMS = {
    "a word in a list": "members:\n  - talkitout.yaml  # first\n  - dance.yaml\n",
    "a word in brackets": "members: [talkitout.yaml, dance.yaml]\n",
    "braces": "members: [{scenario: talkitout.yaml, name: one}, dance.yaml]\n",
    "a mapping": "members:\n  - scenario: talkitout.yaml  # first\n    name: one\n  - dance.yaml\ndraw: uniform\n",
    "the last line": "members:\n  - dance.yaml\n  - name: one\n    scenario: talkitout.yaml",
    "another layout": (
        "members:\n  - layout:\n      room: {width: 5, height: 5}\n      # kept\n    scenario: talkitout.yaml\n"
    ),
    "a layout in braces": "members: [{layout: {room: {width: 5, height: 5}}, scenario: talkitout.yaml}]  # end\n",
}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name in ("talkitout.yaml", "dance.yaml", "social_env.yaml"):
        shutil.copy(SCENARIOS / name, tmp_path)
    return tmp_path


def drawn(path: Path, text: str, member: str = "talkitout") -> Session:
    """A session that shows a room of this member of a suite, or of a scenario."""
    session = Session()
    for seed in range(50):
        shown = session.draw(str(path), text, Room(seed=seed))
        assert shown["findings"] == []
        if shown["episode"]["trace"]["moments"][0].get("member") in (None, member, "one"):
            return session
    raise AssertionError(f"{member} was never drawn")


@pytest.mark.parametrize("form", FORMS)
def test_a_member_of_a_suite_gets_a_layout(folder: Path, form: str) -> None:
    path = folder / "some.yaml"
    before = "suite: some\n" + FORMS[form]
    session = drawn(path, before)
    layout = session.layout()["layout"]
    after = session.write_layout(before)["text"]
    for comment in ("# first", "# kept", "# end"):
        assert (comment in before) == (comment in after)
    old, new = yaml.safe_load(before), yaml.safe_load(after)
    (changed,) = [k for k, (a, b) in enumerate(zip(old["members"], new["members"], strict=True)) if a != b]
    entry = new["members"][changed]
    assert entry.pop("layout") == {
        key: value for key, value in layout.items() if key not in ("member", "t", "heard", "pending")
    }
    kept = old["members"][changed]
    assert entry == (
        {"scenario": kept} if isinstance(kept, str) else {k: v for k, v in kept.items() if k != "layout"}
    )
    again = drawn(path, after)
    assert again.layout()["layout"] == layout


def test_of_a_scenario_a_suite_is_made(folder: Path) -> None:
    path = folder / "talkitout.yaml"
    session = drawn(path, path.read_text())
    made = session.write_layout(path.read_text())
    (folder / made["name"]).write_text(made["suite"])
    env = sd.make(str(folder / made["name"])).unwrapped
    wanted: dict[str, Any] = session.layout()["layout"]
    for seed in range(3):
        env.reset(seed=seed)
        described = env.describe()  # type: ignore[attr-defined]
        assert {key: described[key] for key in wanted} == wanted


def test_members_that_are_acts_have_no_layout(folder: Path) -> None:
    text = "suite: some\ndraw: in_sequence\nmembers: [talkitout.yaml, dance.yaml]\n"
    session = drawn(folder / "some.yaml", text)
    with pytest.raises(RefusalError, match="by hand"):
        session.write_layout(text)

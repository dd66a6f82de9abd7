"""Dilemmas in reports: the diagram and the figures that `socialai check --pictures` has left."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from socialai_dsl.cli.main import main
from tests.socialai_dsl.reporting.page_reader import Page

GIFT = """
scenario: gift
about: Who gives a coin to the other loses one, and the other has two.
horizon: 4
actions: [toggle]
grammar: {templates: [<noun>], nouns: ["yes", "no"]}
room: {size: 5}
rules:
  - {when: agent.did(toggle), reward: {agent: -10, bob: 20}}
  - {when: bob.did(toggle), reward: {agent: 20, bob: -10}}
frames:
  give: {states: {giving: {do: toggle}}}
  keep: {states: {keeping: {}}}
cast:
  agent: {name: Ann}
  bob: {name: Bob, seat: open, frame: give}
outcome:
  - success: t == 4
check:
  - {dilemma: {cooperate: give, defect: keep}}
"""


def test_a_dilemma_that_was_drawn_is_a_section_of_a_report(tmp_path: Path) -> None:
    file = tmp_path / "gift.yaml"
    file.write_text(GIFT, encoding="utf-8")
    assert main(["check", str(file), "--pictures", str(tmp_path / "drawn"), "--rooms", "5"]) == 0
    figures = json.loads((tmp_path / "drawn" / "dilemmas.json").read_text(encoding="utf-8"))
    (found,) = figures["dilemmas"]
    assert main(["report", str(tmp_path / "drawn"), "--out", str(tmp_path / "report"), "--no-baselines"]) == 0
    text = (tmp_path / "report" / "index.html").read_text(encoding="utf-8")
    assert "Dilemma: gift" in text
    assert found["schelling"]["verdict"] in Page(text).text
    for paid in (*found["schelling"]["cooperators"], *found["schelling"]["defectors"]):
        assert f"{paid:.3f}" in text
    assert (tmp_path / "report" / "figures" / "dilemma1.svg").is_file()


def test_a_file_that_is_damaged(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = tmp_path / "drawn"
    folder.mkdir()
    (folder / "dilemmas.json").write_text('{"dilemmas": [{"scenario": "gift"}]}', encoding="utf-8")
    assert main(["report", str(folder), "--out", str(tmp_path / "report"), "--no-baselines"]) == 2
    assert "expected what `socialai check --pictures` writes" in capsys.readouterr().err

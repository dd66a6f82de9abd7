"""Claims that a scenario is a dilemma, of files that are one and of files that only look like it."""

from __future__ import annotations

from pathlib import Path

import pytest

from socialai_dsl.analysis.dilemma import Schelling, schelling
from socialai_dsl.frontend import check, load
from tests.tiny import Folder

GIFT = """
horizon: 2
grammar: {{templates: [Say <noun>], nouns: [hello]}}
cast:
  agent: {{at: [1, 1]}}
  bob: {{at: [3, 3], seat: open}}
  cat: {{at: [5, 5], seat: open}}
frames:
  give: {{states: {{giving: {{do: toggle}}}}}}
  keep: {{states: {{keeping: {{do: stay}}}}}}
rules:
  - {{when: agent.did(toggle), reward: {{agent: {own}, bob: {others}, cat: {others}}}}}
  - {{when: bob.did(toggle), reward: {{agent: {others}, bob: {own}, cat: {others}}}}}
  - {{when: cat.did(toggle), reward: {{agent: {others}, bob: {others}, cat: {own}}}}}
outcome: [{{failure: t == 2}}]
check: [{{dilemma: {{cooperate: give, defect: keep}}}}]
"""
"""Who gives pays `own`, less than nothing where it costs, and the others get something."""


def diagram(folder: Path, own: int, others: int) -> Schelling:
    path = Folder(folder).write("gift", GIFT.format(own=own, others=others))
    return schelling(load(str(path)), ("give", "keep"), 2, 0)


def test_a_gift_that_costs_the_giver_is_a_dilemma(tmp_path: Path) -> None:
    """Two steps: who gives loses 0.2, and each gift of another is worth 0.4."""
    found = diagram(tmp_path, -10, 20)
    assert found.cooperators == pytest.approx((-0.2, 0.2, 0.6))
    assert found.defectors == pytest.approx((0, 0.4, 0.8))
    assert found.is_dilemma


@pytest.mark.parametrize(
    ("own", "others", "why"),
    [
        (10, 20, "giving pays by itself"),
        (-10, 2, "all are worse off if all give"),
        (-10, 5, "all are as well off if nobody gives"),
    ],
)
def test_what_only_looks_like_one(tmp_path: Path, own: int, others: int, why: str) -> None:
    assert not diagram(tmp_path, own, others).is_dilemma, why


@pytest.mark.parametrize(
    ("entry", "code"),
    [
        ("{dilemma: {cooperate: give, defect: kep}}", "S201"),
        ("{dilemma: {cooperate: give}}", "S105"),
        ("{dilemma: {cooperate: give, defect: fill}}", "S204"),
    ],
)
def test_mistakes(tmp_path: Path, entry: str, code: str) -> None:
    text = GIFT.format(own=-10, others=20).replace("{dilemma: {cooperate: give, defect: keep}}", entry)
    text = text.replace("frames:\n", "frames:\n  fill: {slots: {n: int}, states: {a: {}}}\n")
    found = [d.code for d in check(str(Folder(tmp_path).write("gift", text))).diagnostics]
    assert code in found


def test_one_player_has_none(tmp_path: Path) -> None:
    text = GIFT.format(own=-10, others=20).replace(", seat: open", "")
    text = text[: text.index("rules:")] + text[text.index("outcome:") :]
    assert [d.code for d in check(str(Folder(tmp_path).write("gift", text))).diagnostics] == ["S107"]

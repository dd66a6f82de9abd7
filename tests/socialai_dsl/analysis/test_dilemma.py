"""Claims that a scenario is a dilemma, of files that are one and of files that only look like it."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import yaml

from socialai_dsl.analysis.dilemma import Schelling, schelling
from socialai_dsl.cli.main import main
from socialai_dsl.frontend import check, load
from socialai_dsl.reporting.dilemma import dilemma_figure
from socialai_dsl.reporting.records import SchellingRecord
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
    ("own", "others", "verdict"),
    [
        (
            -10,
            20,
            "a dilemma: defecting gains 0.200, however many others cooperate, and each is paid 0.600 if all cooperate",
        ),
        (10, 20, "no dilemma: if 0 of 2 others cooperate, defecting gains -0.200"),
        (-10, 2, "no dilemma: each is paid -0.120 if all cooperate, 0.000 if nobody does"),
    ],
)
def test_the_verdict_says_why(tmp_path: Path, own: int, others: int, verdict: str) -> None:
    assert diagram(tmp_path, own, others).verdict.startswith(verdict)


@pytest.mark.parametrize("seats", [2, 4, pytest.param(8, marks=pytest.mark.slow)])
def test_the_diagram_is_drawn_for_all_numbers_of_seats(
    tmp_path: Path, seats: int, capsys: pytest.CaptureFixture[str]
) -> None:
    players = ["agent", *(f"p{number}" for number in range(1, seats))]
    rules = [
        {"when": f"{one}.did(toggle)", "reward": {p: -10 if p == one else 15 for p in players}}
        for one in players
    ]
    others = {name: {"place": "anywhere", "seat": "open"} for name in players[1:]}
    text = GIFT.format(own=0, others=0)
    scenario = yaml.safe_load(text) | {"rules": rules, "cast": {"agent": {"at": [1, 1]}} | others}
    file = Folder(tmp_path).write("gift", yaml.safe_dump(scenario))
    command = ["check", str(file), "--rooms", "3", "--json", "--pictures", str(tmp_path / "drawn")]
    assert main(command) == 0
    printed = capsys.readouterr()
    found = json.loads(printed.out)[0]["properties"][0]["schelling"]
    assert found["is_dilemma"]
    assert found["cooperators"] == pytest.approx([0.3 * others - 0.2 for others in range(seats)])
    assert found["defectors"] == pytest.approx([0.3 * others for others in range(seats)])
    assert max(found["cooperators_se"]) < 1e-9, "rooms pay alike"
    assert sorted(path.name for path in (tmp_path / "drawn").iterdir()) == [
        "dilemmas.json",
        "gift_dilemma.png",
        "gift_dilemma.svg",
    ]
    (axes,) = dilemma_figure("gift", SchellingRecord.model_validate(found)).get_axes()
    assert list(axes.get_xticks()) == list(range(seats))


def test_nothing_is_drawn_of_what_claims_nothing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = Folder(tmp_path).write(
        "gift",
        GIFT.format(own=-10, others=20)
        .partition("check:")[0]
        .replace("t == 2}]", "t == 2}, {success: agent.spoke}]"),
    )
    main(["check", str(file), "--rooms", "1", "--pictures", str(tmp_path / "drawn")])
    assert "nothing to draw" in capsys.readouterr().err
    assert not (tmp_path / "drawn").exists()


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

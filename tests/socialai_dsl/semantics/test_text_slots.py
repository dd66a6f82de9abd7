"""A slot of type text is compared by others as by the member itself."""

from __future__ import annotations

from pathlib import Path

import socialai_dsl as sd
from socialai_dsl.frontend import check
from tests.agreement import agree

SCENARIO = """\
scenario: me
room: {size: 5}
earshot: room
grammar: {templates: [Hi]}
let: {whose: pick("red team" | "blue team")}
frames:
  f:
    slots: {me: text, n: int}
    let: {tally: {start: 0, range: 0..9}}
    states:
      s:
        then:
          - {when: me == whose, set: {tally: tally + 1}, say: I am <me>}
  g:
    let: {seen: {start: 0, range: 0..9}}
    states:
      s: {then: [{when: ann.me == whose, set: {seen: seen + 1}}]}
cast:
  ann: {frame: f, with: {me: red team, n: 1}}
  bob: {frame: f, with: {me: blue team, n: 2}}
  eve: {frame: g}
  agent: {}
outcome:
  - success: ann.me == whose and t > 3
  - failure: bob.me == whose and t > 5 and ann.me != bob.me
"""


def written(tmp_path: Path, text: str) -> str:
    (tmp_path / "me.yaml").write_text(text, encoding="utf-8")
    return str(tmp_path / "me.yaml")


def test_it_is_what_fills_the_slot(tmp_path: Path) -> None:
    path = written(tmp_path, SCENARIO)
    env, seen = sd.make(path), set()
    for seed in range(12):
        env.reset(seed=seed)
        ended = False
        while not ended:
            _, reward, ended, _, _ = env.step(env.action_space.sample())
        drawn = env.unwrapped.describe()["let"]
        seen.add((drawn["whose"], drawn["eve.seen"] > 0, drawn["ann.tally"] > 0, float(reward) > 0))
    assert seen == {("red team", True, True, True), ("blue team", False, False, False)}
    assert agree(path, episodes=4) > 12


def test_what_has_values_in_it_can_only_be_said(tmp_path: Path) -> None:
    path = written(tmp_path, SCENARIO.replace("me: red team", "me: team <n>"))
    assert any(
        found.code == "S204" and "`ann.me` is filled with a text that has <...>" in found.message
        for found in check(path).diagnostics
    )

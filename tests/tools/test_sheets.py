"""`make sheets`: what is committed is what would be written, and the command notices when it is not."""

import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import socialai_dsl
from socialai_dsl.analysis.data_sheet import page
from socialai_dsl.analysis.sheet_text import flow, frame, rule, table
from tools import sheets
from tools.sheets import INDEX, main, measure, stale_files
from tools.sheets_picture import picture

Capture = pytest.CaptureFixture[str]

SHEETS = Path(__file__).parents[2] / "docs" / "scenarios"
WRITTEN = sorted(
    path.relative_to(SHEETS).with_suffix("").as_posix() for path in SHEETS.rglob("*.md") if path.name != INDEX
)
LINK = re.compile(r"\]\((?!https?://|#)([^)\s]+)\)")


def test_the_sheets_are_up_to_date() -> None:
    assert "talkitout" in WRITTEN
    assert stale_files(WRITTEN, SHEETS) == [], "run `make sheets`"


def test_links_of_the_sheets_lead_somewhere() -> None:
    for name in WRITTEN:
        text = (SHEETS / f"{name}.md").read_text(encoding="utf-8")
        targets = [target for target in LINK.findall(text) if not target.endswith(".md")]
        folder = (SHEETS / name).parent
        assert f"{'../' * name.count('/')}../../scenarios/{name}.yaml" in targets
        assert [target for target in targets if not (folder / target).exists()] == [], name


@pytest.mark.parametrize("name", sheets.sheeted())
def test_every_shipped_scenario_has_a_page_and_a_picture(name: str) -> None:
    loaded = socialai_dsl.load(name)
    text = page(name, loaded, None)
    assert text.startswith(f"# {name}\n")
    assert "## Measured" not in text
    assert "None" not in text
    for line in text.splitlines():
        assert line.count("`") % 2 == 0 or line.startswith("```"), line
    drawn = picture(loaded)
    assert drawn.dtype == np.uint8
    assert drawn.shape[2] == 3
    assert drawn.std() > 10, "there is something in it"


def test_a_page_says_what_the_file_says() -> None:
    text = page("talkitout", socialai_dsl.load("talkitout"), None)
    for expected in (
        "Leave by the right one of four doors.",
        "| action | [8, 2, 4, 16]: body, speak or not, template, noun |",
        "| horizon | 100 steps |",
        "`SocialAI/TalkItOut-v1`",
        "`Where is <noun>` · `Open <noun>`",
        "| `wizard` | wizard | `Gandalf` |",
        "| `doors` (4) | door | `each_wall(2)` | `distinct` |",
        "* `exit: pick(doors)`",
        "| `stranger` | `stay` | `hears: How are you` → `say: I am fine.`, `goto: acquainted` |",
        "3. failure: `agent.action in toggle | done`",
        "* `talkitout+unsocial`: ",
        "  observe.image: before_npcs           # the picture is taken before the NPCs move",
    ):
        assert expected in text, expected


def test_what_was_measured() -> None:
    figures = measure("talkitout_no_liar", episodes=400, rooms=60)
    assert figures["random"]["episodes"] == 400
    assert 0 <= figures["random"]["success_rate"] < 0.05
    assert figures["oracle"]["rooms"] == 60
    assert 0.9 < figures["oracle"]["success_rate"] <= figures["oracle"]["ceiling"] <= 1
    text = page("talkitout_no_liar", socialai_dsl.load("talkitout_no_liar"), figures)
    assert "| random policy |" in text
    assert f"{figures['oracle']['success_rate']:.2%}" in text


def test_rooms_that_were_searched_are_told() -> None:
    script = {"rooms": 100, "success_rate": 0.9, "success_rate_se": 0.03, "mean_length": 9.0, "ceiling": 0.93}
    script["unsolved"] = {"unsolvable": 7, "solvable": 3, "undecided": 0}
    text = page("dance", socialai_dsl.load("dance"), {"oracle": script})
    assert "were searched: 7 unsolvable, 3 solvable. No policy succeeds in more than 93.00%" in text


def test_the_command(monkeypatch: pytest.MonkeyPatch, capsys: Capture, tmp_path: Path) -> None:
    monkeypatch.setattr(sheets, "_EPISODES", 50)
    monkeypatch.setattr(sheets, "_ROOMS", 20)
    folder, name = str(tmp_path / "sheets"), "talkitout_no_liar"
    assert main([name, "--check", folder]) == 1
    assert f"{name}.md: missing or out of date" in capsys.readouterr().err
    assert main([name, "--measure", folder, "--out", folder]) == 0
    assert main([name, "--check", folder]) == 0
    assert sorted(path.name for path in Path(folder).iterdir()) == [
        INDEX, "measured.json", f"{name}.md", f"{name}.png",
    ]  # fmt: skip
    assert "| random policy |" in (Path(folder) / f"{name}.md").read_text()
    assert main([name]) == 0
    assert capsys.readouterr().out.startswith(f"# {name}\n")


@pytest.mark.parametrize("file", ["dance.md", "dance.png", INDEX])
def test_what_is_out_of_date_is_noticed(file: str, capsys: Capture, tmp_path: Path) -> None:
    assert main(["dance", "--out", str(tmp_path)]) == 0
    changed = tmp_path / file
    if changed.suffix == ".png":
        Image.new("RGB", (256, 256)).save(changed)
    else:
        changed.write_text(changed.read_text() + "\n")
    assert main(["dance", "--check", str(tmp_path)]) == 1
    assert capsys.readouterr().err == f"{changed}: missing or out of date; run `make sheets`\n"


def test_usage(capsys: Capture) -> None:
    assert main(["nowhere"]) == 2
    assert "nowhere: no scenario with a sheet; there are talkitout, " in capsys.readouterr().err


def test_tables_drop_empty_columns_and_keep_bars() -> None:
    assert table(("a", "b", "c"), [("1", "", "x | y"), ("2", "", "")]) == [
        "| a | c |",
        "| --- | --- |",
        "| 1 | x \\| y |",
        "| 2 | |",
    ]


def test_values_as_in_the_file() -> None:
    assert flow({"at": [1, ["W - 1", 2]], "on": True}) == "{at: [1, [W - 1, 2]], on: true}"
    assert rule({"id": "x", "when": "t > 1", "say": "Hi"}) == "`when: t > 1` → `say: Hi`"
    assert rule({"goto": "there"}) == "`goto: there`"
    assert rule({"once": True}) == "`once: true`"


def test_frames() -> None:
    steps = frame("walk", {"slots": {"to": "object"}, "steps": [{"do": "go_to(to)"}, {"say": "Here"}]})
    assert steps == ["### `walk`", "", "* slots: `to: object`", "", "1. `do: go_to(to)`", "2. `say: Here`"]
    states = frame("sit", {"states": {"down": None, "up": {"first": {"when": "poked", "goto": "down"}}}})
    assert states[-2:] == ["| `down` | | `stay` |", "| `up` | `when: poked` → `goto: down` | `stay` |"]


def test_a_page_shows_what_studies_with_people_report() -> None:
    text = page("classics/helper_hinderer", socialai_dsl.load("classics/helper_hinderer"), None)
    assert "| infants of 10 months | reached for the helper | 88% | 16 | Hamlin, Wynn & Bloom 2007 |" in text


def test_whom_a_rule_listens_to_is_a_condition() -> None:
    assert (
        rule({"say": "Hi", "addressed": True, "hears": "Ann"})
        == "`hears: Ann`, `addressed: true` → `say: Hi`"
    )

"""Words in reports: a table for each situation of which a seat tells, with the figures of the command."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import pytest

from socialai_dsl.cli.main import main
from tests.socialai_dsl.reporting.page_reader import Page


def told(bits: float) -> dict[str, float]:
    return {"bits": bits, "possible": 1.0, "chance": 0.01, "p": 0.001 if bits > 0.01 else 0.4}


def said(**seats: Any) -> dict[str, Any]:
    return {"scenario": "together/game", "episodes": 80, "seats": seats, "left_out": ["clock"]}


TALKER = {
    "player": "runs/a",
    "success": 0.9,
    "spoke": 1.0,
    "utterances": 3.5,
    "messages": {f"word {k}": 0.1 for k in range(10)},
    "situations": [
        {
            "name": "meant",
            "same": ["meant.color"],
            "said": {"<b>": {"word 0": 20.0, "word 9": 20.0}, "green": {"word 1": 40.0}},
            "told": told(0.9),
            "more_than_chance": True,
        },
        {
            "name": "hat",
            "same": [],
            "said": {"a": {"word 0": 40.0}, "b": {"word 1": 40.0}},
            "told": told(0.0),
            "more_than_chance": False,
        },
    ],
    "topographic": {"similarity": 0.75, "p": 0.02},
}
SILENT = {
    "player": "script",
    "success": 0.9,
    "spoke": 0.0,
    "utterances": 0.0,
    "messages": {"(nothing)": 1.0},
    "situations": [],
    "topographic": None,
}


def write(folder: Path, content: Any) -> Path:
    folder.mkdir(parents=True)
    (folder / "words.json").write_text(json.dumps(content))
    return folder


def test_a_seat_that_speaks_has_a_table_and_a_silent_one_a_sentence(tmp_path: Path) -> None:
    folder = write(tmp_path / "words", said(agent=TALKER, bob=SILENT))
    for given in (folder, folder / "words.json"):
        out = tmp_path / "report"
        assert main(["report", str(given), "--no-baselines", "--out", str(out)]) == 0
        page = Page((out / "index.html").read_text(encoding="utf-8"))
    assert "Words of game." in page.text
    assert page.table("meant") == [
        ["<b>", "0.50", *["0.00"] * 7, "0.50"],
        ["green", "0.00", "1.00", *["0.00"] * 7],
    ]
    assert "meant = meant.color: the messages tell 0.90 of 1.00 bits" in page.text
    assert "It tells no more than by chance about hat." in page.text
    assert "Topographic similarity is 0.75 (p 0.020): 1 if" in page.text
    assert "It says the same everywhere: (nothing)." in page.text
    assert "too many values: clock" in page.text
    rows = list(csv.DictReader((out / "words.csv").read_text().splitlines()))
    assert [(row["situation"], row["value"], row["message"], row["bits"]) for row in rows] == [
        ("meant", "<b>", "word 0", "0.9"),
        ("meant", "<b>", "word 9", "0.9"),
        ("meant", "green", "word 1", "0.9"),
        ("hat", "a", "word 0", "0.0"),
        ("hat", "b", "word 1", "0.0"),
    ]


def test_what_the_command_leaves_is_what_a_report_reads(tmp_path: Path) -> None:
    there, out = tmp_path / "words", tmp_path / "report"
    command = ["words", "oracle", "--on", "together/reference_game_together", "--episodes", "30"]
    assert main([*command, "--out", str(there)]) == 0
    assert main(["report", str(there), "--no-baselines", "--out", str(out)]) == 0
    assert len(Page((out / "index.html").read_text(encoding="utf-8")).table("meant")) == 3


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ([], "words.json: expected what `socialai words --out` writes"),
        (said(agent=TALKER | {"spoke": 1.5}), "seats.agent.spoke: expected at most 1, got 1.5"),
    ],
)
def test_a_damaged_file_is_said(
    tmp_path: Path, content: Any, message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["report", str(write(tmp_path / "there", content)), "--out", str(tmp_path / "out")]) == 2
    assert message in capsys.readouterr().err

"""Cross-play in reports: pictures that can be read, a section of the page, and the success of every seat."""

import csv
import json
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg

from socialai_dsl.cli.main import main
from socialai_dsl.reporting.crossplay import matrices_figure
from socialai_dsl.reporting.records import CrossPlayRecord
from tests.socialai_dsl.reporting.page_reader import Page
from tests.socialai_dsl.reporting.synthetic import condition, write_experiment, write_run


def rate(value: float) -> dict[str, Any]:
    return {"success": value, "interval": [max(0.0, value - 0.1), min(1.0, value + 0.1)]}


def played(players: list[str], *seats: str) -> dict[str, Any]:
    """A cross-play in which everybody gets on with itself alone, and the last seat with nobody."""
    found = {}
    for seat in seats:
        shared = 0.9 if seat != seats[-1] or len(seats) == 2 else 0.1
        cells = [
            {"agent": a, "others": b, "episodes": 80, **rate(shared if a == b else 0.25)}
            for a in players
            for b in players
        ]
        others = rate(0.25) if len(players) > 1 else None
        found[seat] = {"with_themselves": rate(shared), "with_others": others, "cells": cells}
    return {"scenario": "together/game", "episodes": 80, "players": players, "seats": found}


UNPLAYED = {
    "bob": {
        "with_themselves": None,
        "with_others": None,
        "cells": [{"agent": "b", "others": "a", "episodes": 80, **rate(0.5)}],
    }
}


def write(folder: Path, content: Any) -> Path:
    folder.mkdir(parents=True)
    (folder / "crossplay.json").write_text(content if isinstance(content, str) else json.dumps(content))
    return folder


@pytest.mark.parametrize(
    ("players", "seats"),
    [
        (["script"], ["agent", "bob"]),
        (["script", "_a$b$", "a/rather_long_name_of_a_run-s0", "random"], ["agent", "bob", "cat"]),
        ([f"runs/a_name_that_is_longer_than_a_label_can_be-s{seed}" for seed in range(10)], ["agent", "bob"]),
    ],
    ids=["one player", "four players", "ten players"],
)
def test_figures_stay_in_their_cells_and_names_apart(players: list[str], seats: list[str]) -> None:
    record = CrossPlayRecord.model_validate(played(players, *seats))
    figure = matrices_figure(record)
    assert isinstance(figure.canvas, FigureCanvasAgg)
    figure.canvas.draw()
    matrices = [axes for axes in figure.get_axes() if axes.get_title(loc="left")]
    titles = [axes.get_title(loc="left") for axes in matrices]
    assert titles == ["success of agent and bob", *(["success of cat"] if len(seats) == 3 else [])]
    for axes in matrices:
        assert len(axes.texts) == 2 * len(players) ** 2
        assert all(_in_its_cell(axes, text) for text in axes.texts)
        names = [label.get_text() for label in axes.get_yticklabels()]
        assert len(set(names)) == len(players)
        boxes = [label.get_window_extent() for label in axes.get_yticklabels()]
        assert all(not one.overlaps(other) for one, other in pairwise(boxes))
        assert min(box.x0 for box in boxes) >= 0, "names are not cut off"


def test_pairs_that_did_not_play_are_empty_and_who_sat_nowhere_has_no_row(tmp_path: Path) -> None:
    content = played(["script", "rival", "random"], "agent", "bob")
    for found in content["seats"].values():
        found["cells"] = [
            cell for cell in found["cells"] if cell["others"] != "rival" and cell["agent"] != "random"
        ]
        found["cells"].pop()
        found["cells"][0]["episodes"] = 7
        found["with_themselves"] = None
    (axes, _) = matrices_figure(CrossPlayRecord.model_validate(content)).get_axes()
    assert [label.get_text() for label in axes.get_yticklabels()] == ["script", "rival"]
    assert [label.get_text() for label in axes.get_xticklabels()] == ["script", "random"]
    assert len(axes.texts) == 2 * 3
    assert [text.get_text() for text in axes.texts if "7 episodes" in text.get_text()] == [
        "0.80–1.00\n7 episodes"
    ]
    out = tmp_path / "report"
    assert main(["report", str(write(tmp_path / "there", content)), "--out", str(out)]) == 0
    page = Page((out / "index.html").read_text(encoding="utf-8"))
    assert page.table("with themselves")[0][1:] == ["–", "0.250 [0.150, 0.350]"]
    assert [row[2] for row in page.table("plays the others")] == ["7", "80", "80"]


def _in_its_cell(axes: Axes, text: Any) -> bool:
    box = text.get_window_extent().transformed(axes.transData.inverted())
    (left, right), (low, high) = sorted((box.x0, box.x1)), sorted((box.y0, box.y1))
    column, row = (int(place) for place in text.get_position())
    return column <= left and right <= column + 1 and row <= low and high <= row + 1


def test_it_is_a_section_beside_runs(tmp_path: Path) -> None:
    folder = write_experiment(tmp_path / "experiment", [condition("Game / PPO", [0.4, 0.6])])
    for seed in (0, 1):
        path = folder / "runs" / f"c0-s{seed}" / "result.json"
        result = json.loads(path.read_text())
        result["eval"]["seats"] = {"bob": {"episodes": 500, "success_rate": 0.25 + seed / 2}}
        path.write_text(json.dumps(result))
    there = write(tmp_path / "both", played(["script", "random"], "agent", "bob"))
    assert main(["report", str(folder), str(there), "--no-baselines"]) == 0
    out = folder / "report"
    page = Page((out / "index.html").read_text(encoding="utf-8"))
    assert "Cross-play of game." in page.text
    assert page.table("with themselves") == [
        ["agent and bob", "0.900 [0.800, 1.000]", "0.250 [0.150, 0.350]"]
    ]
    assert len(page.table("plays the others")) == 4
    assert "seat bob: 0.500 ± 0.354" in page.text
    assert (out / "figures" / "crossplay1-1.png").is_file()
    pairs = list(csv.DictReader((out / "crossplay.csv").read_text().splitlines()))
    assert (len(pairs), pairs[0]["seat"], pairs[0]["success_rate"]) == (8, "agent", "0.9")
    seats = list(csv.DictReader((out / "seats.csv").read_text().splitlines()))
    assert [(row["seat"], row["success_rate"]) for row in seats[:2]] == [("agent", "0.4"), ("bob", "0.25")]


def test_evaluations_with_other_partners_or_on_another_seat_are_other_conditions(tmp_path: Path) -> None:
    for number, (seat, partners) in enumerate(
        [
            ("agent", {"bob": ["script"]}),
            ("agent", {"bob": ["partners/bob-0-help.safetensors"]}),
            ("bob", {"agent": ["random"]}),
        ]
    ):
        run = write_run(tmp_path / f"run{number}", "game", 0, 0.5)
        for name, more in (
            ("config.json", {"agent": "oracle", "seats": partners}),
            ("result.json", {"seat": seat}),
        ):
            found = json.loads((run / name).read_text()) | more
            if name == "result.json":
                (other,) = partners
                found["eval"]["seats"] = {other: {"episodes": 500, "success_rate": 0.25}}
            (run / name).write_text(json.dumps(found))
    runs = sorted(map(str, tmp_path.glob("run*")))
    assert main(["report", *runs, "--no-baselines", "--out", str(tmp_path / "report")]) == 0
    page = Page((tmp_path / "report" / "index.html").read_text(encoding="utf-8"))
    for column in ("bob by script", "bob by help", "agent by random"):
        assert f"oracle, {column}" in page.text
    seats = list(csv.DictReader((tmp_path / "report" / "seats.csv").read_text().splitlines()))
    assert [(row["seat"], row["success_rate"]) for row in seats[-2:]] == [("bob", "0.5"), ("agent", "0.25")]


def test_it_stands_alone_and_with_runs_that_belong_to_no_experiment(tmp_path: Path) -> None:
    there = write(tmp_path / "both", played(["script"], "agent", "bob"))
    for given in ([there / "crossplay.json"], [there, write_run(tmp_path / "run", "help", 0, 0.5)]):
        out = tmp_path / "report"
        assert main(["report", *map(str, given), "--no-baselines", "--out", str(out)]) == 0
        page = Page((out / "index.html").read_text(encoding="utf-8"))
        assert page.table("with themselves")[0][2] == "–"


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("[]", "crossplay.json: expected what `socialai crossplay --out` writes"),
        (played(["a"], "agent") | {"players": ["a", "b"]}, "cells of each of the players"),
        (
            played(["a"], "agent") | {"seats": {**played(["a"], "agent")["seats"], **UNPLAYED}},
            "a cell of bob for each pair that played",
        ),
    ],
)
def test_a_damaged_file_is_said(
    tmp_path: Path, content: Any, message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["report", str(write(tmp_path / "there", content)), "--out", str(tmp_path / "out")]) == 2
    assert message in capsys.readouterr().err

"""From runs to what a report says, on experiments with known figures."""

import json
import shutil
from pathlib import Path
from typing import Any

import pytest

from socialai_dsl.reporting.analysis import THRESHOLDS, Analysis, analyse
from socialai_dsl.reporting.collect import read_experiment
from socialai_dsl.reporting.tables import tables
from tests.socialai_dsl.reporting.synthetic import (
    condition,
    write_experiment,
    write_rooms,
    write_run,
    write_tests,
)


def analysed(folder: Path, *conditions: dict[str, Any]) -> Analysis:
    return analyse(read_experiment(write_experiment(folder, conditions)), {})


def test_columns_of_a_row_are_compared_and_corrected_together(tmp_path: Path) -> None:
    analysis = analysed(
        tmp_path,
        condition("A / x", [0.1, 0.2, 0.3]),
        condition("A / y", [0.4, 0.6, 0.8]),
        condition("B / x", [0.1, 0.2, 0.3]),
        condition("B / y", [0.3, 0.4, 0.5]),
        condition("C / x", [0.5]),
        condition("C / y", []),
    )
    (table,) = analysis.sections
    assert [(c["first"], c["second"]) for c in table.comparisons] == [("A / x", "A / y"), ("B / x", "B / y")]
    for comparison in table.comparisons:
        assert comparison["p_bonferroni"] == pytest.approx(min(1.0, 2 * comparison["p"]))


def test_rows_of_a_case_study_are_compared_as_well(tmp_path: Path) -> None:
    cells = [condition(f"{row} / {column}", [0.1, 0.2], group="tags") for row in "AB" for column in "xy"]
    tables, case = analysed(tmp_path, *cells[:2], condition("T / x", [0.1, 0.2]), *cells[2:]).sections
    assert (tables.is_table, case.is_table) == (True, False), "tables come first"
    pairs = {(c["first"], c["second"]) for c in case.comparisons}
    assert pairs == {("A / x", "A / y"), ("B / x", "B / y"), ("A / x", "B / x"), ("A / y", "B / y")}


def test_panels_of_a_case_study_stay_readable(tmp_path: Path) -> None:
    few = [condition(f"{row} / {column}", [0.1], group="few") for row in "AB" for column in "xy"]
    many = [condition(f"{row} / {column}", [0.1], group="many") for row in "CD" for column in "xyz"]
    single = [condition(f"E / {column}", [0.1], group="single") for column in "xyz"]
    drawn = {
        section.group: {
            panel: [section.label(s) for s in members] for panel, members in section.panels.items()
        }
        for section in analysed(tmp_path, *few, *many, *single).sections
    }
    assert drawn == {
        "few": {"few": ["A / x", "A / y", "B / x", "B / y"]},
        "many": {"x": ["C", "D"], "y": ["C", "D"], "z": ["C", "D"]},
        "single": {"E": ["x", "y", "z"]},
    }


def test_no_condition_hides_another_in_the_same_place(tmp_path: Path) -> None:
    twice = [condition(name, [0.1], row="A", column="x") for name in ("one", "two")]
    (table,) = analysed(tmp_path, *twice, condition("A / y", [0.1])).sections
    assert list(table.by("row")) == ["one", "two", "A"]


def test_interquartile_means_of_all_rows_and_of_those_in_common(tmp_path: Path) -> None:
    (table,) = analysed(
        tmp_path,
        condition("A / x", [0.2, 0.2]),
        condition("B / x", [0.8, 0.8]),
        condition("A / y", [0.4, 0.4]),
    ).sections
    assert table.common_rows == 1
    x, y = table.columns
    found = (x["rows"], x["runs"], x["iqm"].value, x["common"].value)
    assert found == (2, 4, pytest.approx(0.5), pytest.approx(0.2))
    assert (y["rows"], y["iqm"].value) == (1, pytest.approx(0.4))


def test_conditions_are_paired_by_room(tmp_path: Path) -> None:
    """Of rooms that all seeds of both list, over whose seeds success is averaged."""
    write_experiment(
        tmp_path, [condition("A / x", [0.5, 0.5]), condition("A / y", [0.5]), condition("A / z", [0.5])]
    )
    runs = tmp_path / "runs"
    write_rooms(runs / "c0-s0", {0: True, 1: True, 2: False, 3: True})
    write_rooms(runs / "c0-s1", {0: True, 1: False, 2: False})
    write_rooms(runs / "c1-s0", {1: False, 2: True, 0: False, 7: True})
    (pairing,) = analyse(read_experiment(tmp_path), {}).sections[0].rooms
    assert (pairing["first"], pairing["second"], pairing["rooms"]) == ("A / x", "A / y", 3)
    assert (pairing["first_better"], pairing["second_better"]) == (2, 1)
    value, low, high = (pairing[name] for name in ("difference", "difference_low", "difference_high"))
    assert value == pytest.approx((1.0 + 0.5 - 1.0) / 3)
    assert -1 <= low < value < high <= 1


def test_rooms_of_a_session_are_paired_as_one(tmp_path: Path) -> None:
    """So episodes that repeat those before them make nobody surer; the difference itself is that of the rooms."""

    def pairing(session: int) -> dict[str, float]:
        folder = tmp_path / str(session)
        write_experiment(folder, [condition("A / x", [0.5]), condition("A / y", [0.5])])
        for name, shift in (("c0-s0", 0), ("c1-s0", 1)):
            won = {room: (room // session + shift) % 3 > 0 for room in range(12 * session)}
            write_rooms(folder / "runs" / name, won)
            result = json.loads((folder / "runs" / name / "result.json").read_text())
            result["eval"]["session"] = session
            (folder / "runs" / name / "result.json").write_text(json.dumps(result))
        (found,) = analyse(read_experiment(folder), {}).sections[0].rooms
        return {name: found[name] for name in ("difference", "difference_low", "difference_high")}

    assert pairing(5) == pytest.approx(pairing(1))


def test_rooms_of_other_programs_are_other_rooms(tmp_path: Path) -> None:
    write_experiment(tmp_path, [condition("A / x", [0.5]), condition("A / y", [0.5])])
    for name in ("c0-s0", "c1-s0"):
        write_rooms(tmp_path / "runs" / name, {0: True})
    assert len(analyse(read_experiment(tmp_path), {}).sections[0].rooms) == 1
    result = tmp_path / "runs" / "c1-s0" / "result.json"
    result.write_text(result.read_text().replace("b" * 64, "c" * 64))
    assert analyse(read_experiment(tmp_path), {}).sections[0].rooms == []


def test_further_tests_are_spread_over_the_seeds_that_have_them(tmp_path: Path) -> None:
    folder = write_experiment(tmp_path, [condition("Help / PPO", [0.9, 0.9, 0.9], tests=["other"])])
    for seed, rate in ((0, 0.1), (2, 0.3)):
        write_tests(folder / "runs" / f"c0-s{seed}", {"other": rate})
    analysis = analyse(read_experiment(folder), {})
    (summary,) = analysis.summaries
    assert list(summary.tests["other"]) == [0.1, 0.3]
    assert list(summary.carried("other")) == pytest.approx([0.1 / 0.9, 0.3 / 0.9])
    row = tables(analysis)["carried"].iloc[0]
    assert (row.condition, row.test, row.seeds_done) == ("Help / PPO", "other", 2)
    assert row.carried_mean == pytest.approx(0.2 / 0.9)


def test_too_short(tmp_path: Path) -> None:
    folder = write_experiment(
        tmp_path, [condition("A / x", [0.4, 0.4, 0.4]), condition("A / y", [0.4]), condition("A / z", [0.4])]
    )
    shutil.rmtree(folder / "runs" / "c0-s1")
    stopped = folder / "runs" / "c1-s0"
    shutil.rmtree(stopped)
    write_run(stopped, "help", 0, 0.4, frames=500)
    missing, early, enough = analyse(read_experiment(folder), {}).summaries
    assert missing.short == ["1 of 3 seeds without a result"]
    assert early.short == ["a seed stopped at 500 of 1,000 frames"]
    assert enough.short == []


def test_a_curve_that_still_rises_is_too_short_unless_it_is_solved(tmp_path: Path) -> None:
    folder = write_experiment(tmp_path, [condition("A / x", [0.6]), condition("A / y", [0.97])])
    for run in ("c0-s0", "c1-s0"):
        path = folder / "runs" / run / "metrics.jsonl"
        lines = path.read_text().splitlines(keepends=True)[:5]  # the part that rises
        path.write_text("".join(lines))
    rising, solved = analyse(read_experiment(folder), {}).summaries
    # Bins end at 0.12, 0.24, ... 0.6: the last fifth is 0.6, the one before 0.48.
    assert rising.short == ["success still rises, by 0.12 in the last fifth of training"]
    assert solved.short == []


def test_sample_efficiency(tmp_path: Path) -> None:
    (summary,) = analysed(tmp_path, condition("A / x", [0.6, 0.2])).summaries
    # Success rises by 0.12 each 100 frames up to 0.6, or by 0.04 up to 0.2.
    assert [summary.reached(level) for level in THRESHOLDS] == [
        [300, None],
        [500, None],
        [None] * 2,
        [None] * 2,
    ]
    # (0.12 + 0.24 + 0.36 + 0.48 + 6 * 0.6) / 10, and a third of it.
    assert list(summary.areas) == pytest.approx([0.48, 0.16])


def test_successes_are_told_by_results_and_else_by_name(tmp_path: Path) -> None:
    folder = write_experiment(tmp_path, [condition("A / x", [0.6]), condition("A / y", [0.6])])
    (folder / "runs" / "c1-s0" / "result.json").unlink()
    for summary in analyse(read_experiment(folder), {}).summaries:
        assert summary.successes == {"success@56"}

"""The learning curves of several runs in one picture."""

import json
from pathlib import Path

import numpy as np
import pytest

from socialai_dsl.cli.main import main
from socialai_dsl.reporting.analysis import Summary
from socialai_dsl.reporting.collect import read_runs
from socialai_dsl.reporting.plots import conditions_figure
from socialai_dsl.reporting.seeds import align, mean_over_seeds, read_updates
from tests.socialai_dsl.reporting.synthetic import figures


def row(update: int, episodes: int, success: float | None, asked: float | None = None) -> str:
    rates = {"outcomes": {"success@9": success, "timeout": None if success is None else 1 - success}}
    return json.dumps(
        {
            "update": update,
            "frames": 100 * update,
            "episodes": episodes,
            "success": success,
            **rates,
            "rules": {"ask": asked},
        }
    )


def write_metrics(path: Path, rows: list[str]) -> Path:
    path.write_text("".join(line + "\n" for line in rows))
    return path


def test_a_bin_counts_episodes_and_does_not_average_rates(tmp_path: Path) -> None:
    rows = [row(1, 10, 0.5, 2.0), row(2, 30, 0.1, 0.0), row(3, 0, None), row(4, 4, 1.0, 1.0)]
    seeds = align([read_updates(write_metrics(tmp_path / "m.jsonl", rows))], bins=2)
    assert seeds.frames.tolist() == [200, 400]
    assert seeds.success.tolist() == [[(5 + 3) / 40, 1.0]]
    assert seeds.rates["rules/ask"].tolist() == [[20 / 40, 1.0]]
    assert list(seeds.means("outcomes")) == ["success@9", "timeout"]


def test_a_bin_without_episodes_is_unknown(tmp_path: Path) -> None:
    metrics = write_metrics(tmp_path / "m.jsonl", [row(1, 0, None), row(2, 2, 0.5)])
    seeds = align([read_updates(metrics)])
    assert np.isnan(seeds.success[0, 0])
    assert seeds.success[0, 1] == 0.5


def test_a_shorter_run_is_unknown_after_its_end(tmp_path: Path) -> None:
    long = write_metrics(tmp_path / "long.jsonl", [row(n, 1, 1.0) for n in range(1, 9)])
    short = write_metrics(tmp_path / "short.jsonl", [row(n, 1, 0.0) for n in range(1, 5)])
    seeds = align([read_updates(long), read_updates(short)])
    assert seeds.frames[-1] == 800
    assert seeds.success[0].tolist() == [1.0] * 8
    assert seeds.success[1, :4].tolist() == [0.0] * 4
    assert np.isnan(seeds.success[1, 4:]).all()
    assert mean_over_seeds(seeds.success).tolist() == [0.5] * 4 + [1.0] * 4


def make_run(folder: Path, scenario: str, seed: int, rate: float, bonus: str = "none") -> Path:
    run = folder / f"{scenario}-{bonus}-{seed}"
    run.mkdir()
    settings = {"scenario": scenario, "seed": seed, "net": "fast", "bonus": bonus, "curriculum": "none"}
    (run / "config.json").write_text(json.dumps(settings))
    (run / "result.json").write_text(json.dumps({"frames": 300, "eval": figures(rate)}))
    write_metrics(run / "metrics.jsonl", [row(n, 10, rate, 1.0) for n in range(1, 4)])
    return run


def test_seeds_of_one_condition_share_a_column_and_a_table(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    runs = [make_run(tmp_path, "talkitout", seed, 0.2 + seed / 10) for seed in (0, 1)]
    runs.append(make_run(tmp_path, "talkitout", 0, 0.9, bonus="lang"))
    picture = tmp_path / "curves.png"
    assert main(["report", *map(str, runs), "--curves", str(picture)]) == 0
    printed = capsys.readouterr().out
    assert "talkitout / ppo\n\n| frames | run 1 | run 2 | success@9 | timeout | ask |" in printed
    assert "| 0.00 M | 0.20 | 0.30 | 0.25 | 0.75 | 1.00 |" in printed
    assert "test set: 0.200, 0.300" in printed
    assert "talkitout / ppo, bonus lang\n" in printed
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_runs_with_other_hyper_parameters_are_another_condition(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    runs = [make_run(tmp_path, "talkitout", seed, 0.5) for seed in (0, 1)]
    settings = json.loads((runs[1] / "config.json").read_text())
    (runs[1] / "config.json").write_text(json.dumps(settings | {"lr": 0.1, "entropy_coef": 0.02}))
    assert main(["report", *map(str, runs), "--curves", str(tmp_path / "curves.png")]) == 0
    printed = capsys.readouterr().out
    assert "talkitout / ppo\n" in printed
    assert "talkitout / ppo, lr=0.1, entropy_coef=0.02\n" in printed


def test_titles_tell_conditions_apart_that_differ_in_their_last_option(tmp_path: Path) -> None:
    runs = [make_run(tmp_path, "talkitout", 0, 0.5), make_run(tmp_path, "talkitout", 1, 0.5)]
    for run, rate in zip(runs, (0.01, 0.02), strict=True):
        settings = json.loads((run / "config.json").read_text())
        settings |= {"net": "paper", "bptt": 8, "gae_lambda": 0.99, "entropy_coef": rate}
        (run / "config.json").write_text(json.dumps(settings))
    summaries = [Summary(condition) for condition in read_runs(runs).conditions]
    titles = [axes.get_title(loc="left").replace("\n", " ") for axes in conditions_figure(summaries).axes]
    shown = [title for title in titles if title]
    assert [title.rpartition(", ")[2] for title in shown] == ["gae_lambda=0.99", "entropy_coef=0.02"]


def test_what_is_no_finished_run_is_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["report", str(tmp_path), "--curves", "c.png"]) == 2
    assert "expected the folder of a run, with its config.json" in capsys.readouterr().err


def test_an_empty_log_is_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run = make_run(tmp_path, "talkitout", 0, 0.5)
    (run / "metrics.jsonl").write_text("")
    assert main(["report", str(run), "--curves", str(tmp_path / "c.png")]) == 2
    assert "expected the folder of a run that has learned" in capsys.readouterr().err

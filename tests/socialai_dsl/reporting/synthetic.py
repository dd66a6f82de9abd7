"""Writes folders of experiments with known figures, as the runner would leave them."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

FRAMES = 1000
UPDATES = 10


def condition(name: str, rates: Sequence[float], group: str | None = "table2", **more: Any) -> dict[str, Any]:
    """A condition `row / column` whose seeds get these success rates; what else its entry shall hold in `more`."""
    row, _, column = name.partition(" / ")
    entry = {"name": name, "row": row, "column": column, "group": group, "scenario": "help", "agent": "ppo",
             "frames": FRAMES, "options": {}, "tests": [], "reference": None, "test_references": {}}  # fmt: skip
    return entry | more | {"rates": list(rates)}


def write_experiment(folder: Path, conditions: Sequence[Mapping[str, Any]], about: str = "") -> Path:
    """Write `experiment.json` and the folders of all runs, which are `c<condition>-s<seed>`."""
    entries, runs = [], []
    for number, one in enumerate(conditions):
        entry = dict(one)
        for seed, rate in enumerate(entry.pop("rates")):
            run = f"c{number}-s{seed}"
            runs.append({"id": run, "condition": entry["name"], "seed": seed})
            write_run(folder / "runs" / run, entry["scenario"], seed, rate)
        entries.append(entry)
    record = {"format": 1, "name": "synthetic", "profile": None, "about": about, "source_sha256": "a" * 64,
              "conditions": entries, "runs": runs}  # fmt: skip
    (folder / "experiment.json").write_text(json.dumps(record), encoding="utf-8")
    return folder


def write_run(run: Path, scenario: str, seed: int, rate: float, frames: int = FRAMES) -> Path:
    """A finished run whose success grows evenly up to `rate` in the first half of training and stays there."""
    run.mkdir(parents=True)
    settings = {"scenario": scenario, "agent": "ppo", "seed": seed, "net": "fast", "frames": frames}
    _write(run / "config.json", settings)
    lines = []
    for update in range(1, UPDATES + 1):
        success = rate * min(1.0, 2 * update / UPDATES)
        outcomes = {"success@56": success, "timeout": 1 - success}
        row = {"update": update, "frames": frames * update // UPDATES, "episodes": 10, "success": success,
               "outcomes": outcomes, "rules": {"jill.look": 2 * success}}  # fmt: skip
        lines.append(json.dumps(row) + "\n")
    (run / "metrics.jsonl").write_text("".join(lines), encoding="utf-8")
    result = {"frames": frames, "train_seconds": 90.0, "frames_per_second": 11.1, "eval": figures(rate),
              "program_sha256": "b" * 64, "versions": {"python": "3.11.7", "torch": "2.13.0"}}  # fmt: skip
    _write(run / "result.json", result)
    start = {"time": "", "torch": "2.13.0", "cpu": "AVX2", "device": "cpu", "threads": 1}
    (run / "starts.jsonl").write_text(json.dumps(start) + "\n", encoding="utf-8")
    _write(run / "status.json", {"state": "done", "attempts": [{}], "message": None})
    return run


def write_rooms(run: Path, successes: Mapping[int, bool]) -> None:
    """A list of the test episodes of a run."""
    lines = [f"{number},{int(success)},x,9,0\n" for number, success in successes.items()]
    (run / "episodes.csv").write_text(
        "episode,success,outcome,length,return\n" + "".join(lines), encoding="utf-8"
    )


def write_tests(run: Path, rates: Mapping[str, float]) -> None:
    """Further tests of a run, by scenario."""
    _write(run / "tests.json", {name: figures(rate) for name, rate in rates.items()})


def figures(rate: float) -> dict[str, Any]:
    """The object `eval` of a result."""
    endings = [
        {"outcome": "success@56", "success": True, "text": "success: any(d in doors where exiter.at(d))",
         "file": "scenarios/help.yaml", "line": 56, "episodes": int(500 * rate), "share": rate},
        {"outcome": "timeout", "success": False, "text": "out of time", "file": None, "line": None,
         "episodes": 500 - int(500 * rate), "share": 1 - rate},
    ]  # fmt: skip
    outcomes = {ending["outcome"]: ending["share"] for ending in endings}
    return {"episodes": 500, "success_rate": rate, "mean_length": 9.5, "mean_return": rate / 2, "outcomes": outcomes,
            "endings": endings, "rules": {"jill.look": 0.5}}  # fmt: skip


def _write(path: Path, content: Mapping[str, Any]) -> None:
    path.write_text(json.dumps(content), encoding="utf-8")

"""The statistics of the small replication again, from its runs as they are kept with docs/replication.md."""

import json
from pathlib import Path

import pandas as pd
import pytest

from socialai_dsl.reporting.analysis import Analysis, analyse
from socialai_dsl.reporting.collect import read_experiment
from socialai_dsl.reporting.tables import tables
from tests.socialai_dsl.reporting.page_reader import Page

RESULTS = Path(__file__).parents[3] / "docs" / "results"


@pytest.fixture(scope="module", params=["paper_small", "case_small"])
def kept(request: pytest.FixtureRequest) -> Path:
    folder: Path = RESULTS / request.param
    return folder


@pytest.fixture(scope="module")
def analysis(kept: Path, tmp_path_factory: pytest.TempPathFactory) -> Analysis:
    """Of an experiment's folder made from the tables: everything but the learning curves."""
    folder = tmp_path_factory.mktemp(kept.name)
    runs, outcomes = pd.read_csv(kept / "runs.csv"), pd.read_csv(kept / "outcomes.csv")
    for _, run in runs.drop_duplicates("id").iterrows():
        place = folder / "runs" / run.id
        place.mkdir(parents=True)
        ended = outcomes[(outcomes.id == run.id) & (outcomes.condition == run.condition)]
        of_kind = {
            kind: ended[ended.kind == kind].set_index("name").per_episode for kind in ("outcome", "rule")
        }
        placed = ended[ended.file.notna()]
        endings = [
            {"outcome": name, "success": False, "text": "", "file": file, "line": line, "share": share}
            for name, file, line, share in zip(
                placed.name, placed.file, placed.line, placed.per_episode, strict=True
            )
        ]
        figures = {
            "episodes": int(run.test_episodes), "success_rate": run.success_rate, "mean_length": run.mean_length,
            "mean_return": run.mean_return, "endings": endings, "outcomes": of_kind["outcome"].to_dict(),
            "rules": of_kind["rule"].to_dict(),
        }  # fmt: skip
        result = {"frames": int(run.frames), "eval": figures, "program_sha256": run.program_sha256}
        (place / "result.json").write_text(json.dumps(result))
        if isinstance(run.tests, str):
            rates = (test.rsplit("=", 1) for test in run.tests.split("; "))
            tests = {name: figures | {"success_rate": float(rate)} for name, rate in rates}
            (place / "tests.json").write_text(json.dumps(tests))
    entries = []
    for _, one in pd.read_csv(kept / "conditions.csv").astype(object).iterrows():
        entry = one[["group", "row", "column", "scenario", "agent"]].to_dict() | {"name": one.condition}
        if pd.notna(one.published_mean):
            std = one.published_std if pd.notna(one.published_std) else None
            entry["reference"] = {"mean": one.published_mean, "std": std, "source": one.published_source}
        tests = one.tests.split("; ") if isinstance(one.tests, str) else []
        entries.append(entry | {"tests": [test.rsplit("=", 1)[0] for test in tests]})
    listed = runs[["id", "condition", "seed"]].to_dict("records")
    record = {"format": 1, "name": kept.name, "conditions": entries, "runs": listed}
    (folder / "experiment.json").write_text(json.dumps(record))
    return analyse(read_experiment(folder), {})


@pytest.mark.parametrize(
    ("name", "columns"),
    [
        ("conditions", "condition group row column seeds seeds_done success_mean success_std success_low success_high "
                       "published_mean published_std published_source tests"),
        ("comparisons", "group first second difference welch_t degrees_of_freedom p p_bonferroni hedges_g"),
        ("outcomes", "condition id seed kind name per_episode file line"),
        ("runs", "condition id seed frames success_rate mean_return mean_length test_episodes tests program_sha256"),
    ],
)  # fmt: skip
def test_the_tables_are_those_that_were_published(
    kept: Path, analysis: Analysis, tmp_path: Path, name: str, columns: str
) -> None:
    tables(analysis)[name].to_csv(tmp_path / "again.csv", index=False)
    found, expected = pd.read_csv(tmp_path / "again.csv"), pd.read_csv(kept / f"{name}.csv")
    chosen = columns.split()
    pd.testing.assert_frame_equal(found[chosen], expected[chosen], rtol=1e-9, check_dtype=False)


def test_the_interquartile_means_are_those_that_were_published(kept: Path, analysis: Analysis) -> None:
    page = Page((kept / "index.html").read_text(encoding="utf-8"))
    rows = [row for table in page.tables for row in table if len(row) == 5]
    found = [one for section in analysis.sections for one in section.columns if one["rows"] > 1]
    for one in found:
        value, low, high = one["iqm"]
        said = [one["column"], str(one["rows"]), str(one["runs"]), f"{value:.3f} [{low:.3f}, {high:.3f}]"]
        assert said in [row[:4] for row in rows]
    assert bool(found) == (kept.name == "paper_small")

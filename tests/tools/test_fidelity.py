"""`make fidelity`: the statistics, the figures, the page; and, slowly, the comparisons themselves."""

import json
from math import comb
from pathlib import Path

import pytest

from socialai_dsl.errors import UsageError
from socialai_dsl.evaluation.chance import Sample
from tools import fidelity
from tools.fidelity import chosen, main
from tools.fidelity_page import page
from tools.fidelity_statistics import Published, compare, fisher_exact

Capture = pytest.CaptureFixture[str]


def exactly(successes: int, trials: int, others: int, other_trials: int) -> float:
    both = successes + others
    ways = {k: comb(trials, k) * comb(other_trials, both - k) for k in range(min(trials, both) + 1)}
    return sum(way for way in ways.values() if way <= ways[successes]) / sum(ways.values())


@pytest.mark.parametrize(("table", "p"), [((3, 4, 1, 4), 34 / 70), ((1, 12, 9, 12), 0.002759456)])
def test_fishers_test_on_tables_from_textbooks(table: tuple[int, int, int, int], p: float) -> None:
    assert fisher_exact(*table) == pytest.approx(p, rel=1e-6)


@pytest.mark.parametrize("table", [(0, 5, 0, 9), (5, 5, 0, 9), (2, 30, 9, 40), (7, 19, 7, 19), (0, 9, 4, 9)])
def test_fishers_test_on_counted_ways(table: tuple[int, int, int, int]) -> None:
    assert fisher_exact(*table) == pytest.approx(exactly(*table), rel=1e-9)


def test_fishers_test_on_large_samples() -> None:
    assert fisher_exact(46, 20_000, 920, 400_000) == pytest.approx(1.0)
    assert fisher_exact(46, 20_000, 1840, 400_000) < 1e-6
    assert fisher_exact(0, 4000, 0, 400_000) == 1.0


def test_impossible_counts_are_refused() -> None:
    with pytest.raises(ValueError, match="got 5 of 4"):
        fisher_exact(5, 4, 1, 4)


def test_a_difference_of_lengths_is_found() -> None:
    published = Published(20_000, 100, 8.00, 4.0, 0.1)
    near = compare(published, Sample(400_000, 2000, 8.05, 4.0, 0.1))
    assert near.distance == pytest.approx(0.05 / (16 / 20_000 + 16 / 400_000 + 1e-4 / 12) ** 0.5)
    assert near.agrees
    far = compare(published, Sample(400_000, 2000, 8.15, 4.0, 0.1))
    assert not far.agrees
    assert far.p > 0.9, "and only that"


def test_an_unknown_deviation_is_taken_to_be_ours() -> None:
    known = compare(Published(4000, 9, 4.0, 3.4), Sample(8000, 18, 4.02, 3.4, 0.0))
    assert compare(Published(4000, 9, 4.0), Sample(8000, 18, 4.02, 3.4, 0.0)).distance == known.distance


def test_a_difference_of_successes_is_found() -> None:
    published = Published(20_000, 100, 8.00, 4.0, 0.1)
    comparison = compare(published, Sample(400_000, 3000, 8.0, 4.0, 0.1))
    assert not comparison.agrees
    assert abs(comparison.distance) < 1


def test_every_scenario_of_the_paper_has_figures() -> None:
    names = [name for name, _ in chosen([])]
    assert len(names) == len(set(names)) == 19
    assert all("+as_coded" in name for name in names)
    for name, figures in chosen([]):
        assert 0 <= figures.successes < figures.episodes, name
        assert (figures.sd_length is None) == name.endswith("+unsocial"), name


def test_a_scenario_is_named_with_or_without_its_variant() -> None:
    assert list(chosen(["talkitout+as_coded"])) == list(chosen(["talkitout"]))
    assert [name for name, _ in chosen(["talkitout"])] == [
        "talkitout+as_coded",
        "talkitout+as_coded+unsocial",
    ]
    with pytest.raises(UsageError, match="talk: no figures to compare with; there are those of talkitout"):
        list(chosen(["talk"]))


def test_page() -> None:
    published, ours = Published(20_000, 100, 8.00, 4.0, 0.1), Sample(400_000, 2000, 8.5, 4.0, 0.1)
    text = page(
        {"x+as_coded": compare(published, ours), "x+as_coded+unsocial": compare(published, ours)},
        *(400_000, 3, "2026-11-23", "0a1b2c3"),
    )
    assert "400,000 episodes each, seed 3,\n  measured on 2026-11-23 at commit 0a1b2c3" in text
    rows = [line for line in text.splitlines() if line.startswith("| `x")]
    assert [row.split(" | ")[-1] for row in rows] == ["**differs** |", "**differs** |"]
    header = next(line for line in text.splitlines() if line.startswith("| scenario"))
    assert {line.count("|") for line in rows} == {header.count("|")}


def test_the_page_that_is_committed() -> None:
    """It has every comparison, with the figures that are compared with, and none that differs."""
    text = (Path(__file__).parents[2] / "docs" / "fidelity.md").read_text(encoding="utf-8")
    rows = {line.split("`")[1]: line for line in text.splitlines() if line.startswith("| `")}
    assert set(rows) == {name for name, _ in chosen([])}
    for name, figures in chosen([]):
        assert f"| `{name}` | {figures.successes / figures.episodes:.5f} ± " in rows[name]
        assert f"| {figures.mean_length:.2f}" in rows[name]
        assert rows[name].endswith("| agrees |"), name


def test_the_command(monkeypatch: pytest.MonkeyPatch, capsys: Capture, tmp_path: Path) -> None:
    """A difference is found with the exit code, the page and the JSON."""
    figures = tmp_path / "figures.yaml"
    figures.write_text(
        "scenarios: {talkitout: {episodes: 20000, successes: 46, mean_length: 9.0, sd_length: 3.4, mean_reward: 0.0}}"
    )
    monkeypatch.setattr(fidelity, "_FIGURES", figures)
    written = tmp_path / "page.md"
    options = ["--episodes", "500", "--seed", "2"]
    assert main(["talkitout", *options, "--json", "--out", str(written)]) == 1
    printed = capsys.readouterr()
    (comparison,) = json.loads(printed.out)
    assert comparison["scenario"] == "talkitout+as_coded"
    assert comparison["ours"]["episodes"] == 500
    assert comparison["distance"] < -3.5
    assert not comparison["agrees"]
    assert printed.err == "differs from the paper's code: talkitout+as_coded\n"
    assert "**differs**" in written.read_text()


def test_usage(capsys: Capture) -> None:
    assert main(["--episodes", "0"]) == 2
    assert main(["--seed", "-1"]) == 2
    assert main(["nowhere"]) == 2


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name, _ in chosen([]) if not name.endswith("+unsocial")])
def test_scenarios_agree_with_the_papers_code(name: str, capsys: Capture) -> None:
    assert main([name, "--episodes", "40000"]) == 0, capsys.readouterr()

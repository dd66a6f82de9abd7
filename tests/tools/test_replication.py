"""`make replication`: the page holds what the kept runs and the experiments' files say."""

from pathlib import Path

import pytest

from tools.replication import main

PAGE = Path(__file__).parents[2] / "docs" / "replication.md"


def test_the_tables_of_the_page_are_up_to_date(tmp_path: Path, update_goldens: bool) -> None:
    page = PAGE.read_text(encoding="utf-8")
    stale = tmp_path / "page.md"
    stale.write_text(page.replace("| TalkItOut / PPO |", "| stale |"), encoding="utf-8")
    assert main(["--out", str(PAGE if update_goldens else stale)]) == 0
    assert update_goldens or stale.read_text(encoding="utf-8") == page, "run: make replication"


def test_each_condition_has_a_line_in_one_table(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([]) == 0
    printed = capsys.readouterr().out
    for name in ("TalkItOut / PPO", "CoinThief with tags / PPO", "Help / PPO, paper's network"):
        assert printed.count(f"| {name} |") == 1

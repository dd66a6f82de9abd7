"""The five commands of docs/language_models.md lead to a table of three players on two scenarios."""

import csv
import re
import shlex
from pathlib import Path
from typing import Any

import pytest

from socialai_dsl import load
from socialai_dsl.checking.loaded import LoadedScenario
from socialai_dsl.cli.main import main
from socialai_dsl.llm import Episode
from tests import shipped
from tests.socialai_dsl.llm.endpoint import endpoint
from tests.socialai_dsl.reporting.page_reader import Page

pytest.importorskip("httpx", reason="language models need the extra llm")

PAGE = Path(__file__).parents[1] / "docs" / "language_models.md"


def test_five_commands_lead_to_a_table(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    found = re.search(r"```console\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    assert found is not None
    install, *commands = [line.removeprefix("$ ") for line in found[1].splitlines()]
    assert install.startswith("pip install")
    assert len(commands) == 4
    with endpoint(lambda _: "Act: done") as stub:
        for command in commands:
            words = shlex.split(command.replace("http://localhost:8080/v1", stub.url))[1:]
            named = [sorted(map(str, Path().glob(word))) if "*" in word else [word] for word in words]
            assert main([word for words in named for word in words]) == 0
    report = Page((tmp_path / "report" / "index.html").read_text(encoding="utf-8"))
    assert "6 of 6 runs done" in report.text
    (probe,) = [row for row in report.table("by chance") if "promise" in row]
    assert probe[1:] == ["promise", "20", "0.000", "0.500", "0.000"]  # it answers nothing
    (_, *players), *rows = report.tables[0]
    assert set(players) == {"llm:qwen3-8b", "oracle", "random"}
    assert [row for row, *_ in rows] == ["help", "talkitout"]
    for _, *cells in rows:
        results = dict(zip(players, cells, strict=True))
        assert results["oracle"].startswith("1.000")
        assert results["llm:qwen3-8b"].startswith("0.000")  # it gives up at once
    with open("report/rooms.csv", newline="", encoding="utf-8") as file:
        pairs = {(row["first"], row["second"]): row for row in csv.DictReader(file)}
    assert len(pairs) == 6
    pair = pairs["help / oracle", "help / llm:qwen3-8b"]
    assert (pair["rooms"], pair["first_better"], pair["second_better"]) == ("20", "20", "0")
    assert float(pair["difference"]) == 1.0
    (pairing,) = [row for row in report.table("rooms") if row[:2] == ["help / oracle", "help / llm:qwen3-8b"]]
    assert pairing[2:5] == ["20", "20", "0"]
    assert pairing[5].startswith("+1.000 [")
    assert ["help / llm:qwen3-8b", "20", "20", "0.0%", "200", "40", "–"] in report.table("replies")


def test_the_page_shows_the_first_observation(update_goldens: bool) -> None:
    page = PAGE.read_text(encoding="utf-8")
    begun, rest = page.split("The first observation:\n\n```text\n")
    shown, _, rest = rest.partition("```")
    text = Episode("talkitout").reset(test_episode=0) + "\n"
    if update_goldens:
        PAGE.write_text(f"{begun}The first observation:\n\n```text\n{text}```{rest}", encoding="utf-8")
        shown = text
    assert shown == text, "if the new text is meant, run pytest --update-goldens"


@pytest.mark.thorough("plays many episodes in text")
def test_the_command_about_probes_prints_such_a_table(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], update_goldens: bool
) -> None:
    """A model that takes the first answer each time, waits until it was asked, and then names the red box."""
    monkeypatch.chdir(tmp_path)
    page = PAGE.read_text(encoding="utf-8")
    section = page.partition("## What a model knows\n")[2].partition("\n## ")[0]
    (command,) = re.findall(r"```console\n\$ (.*?)\n```", section)
    (table,) = re.findall(r"```text\n(.*?)```", section, re.DOTALL)

    def respond(request: Any) -> str:
        asked = request["messages"][-1]["content"]
        if "A question, apart from your turns" in asked:
            return f"Answer: {re.search(r'The answer is one of: ([^;]+);', asked)[1]}"  # type: ignore[index]
        heard = any("Max: Where will Sally look" in message["content"] for message in request["messages"][1:])
        return 'Act: say "In the red"' if heard else "Act: none"

    with endpoint(respond) as stub:
        assert main(shlex.split(command.replace("http://localhost:8080/v1", stub.url))[1:]) == 0
    printed = capsys.readouterr().out
    found = (
        "probes, apart from success\n"
        + printed.partition("probes, apart from success\n")[2].partition("\n\n")[0]
    )
    if update_goldens:
        PAGE.write_text(page.replace(table, found + "\n"), encoding="utf-8")
        table = found + "\n"
    assert table == found + "\n", "if the new text is meant, run pytest --update-goldens"
    assert "of 20 right, by chance 50.0%" in found


def test_the_page_names_the_scenarios_with_probes() -> None:
    named = re.search(r"These scenarios have probes: (.*)\.", PAGE.read_text(encoding="utf-8"))
    assert named is not None
    loaded = {name: load(name) for name in shipped.scenarios()}
    asked = {name for name, one in loaded.items() if isinstance(one, LoadedScenario) and one.scenario.probes}
    assert set(re.findall(r"`(.*?)`", named[1])) == asked

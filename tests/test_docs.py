"""The examples in the documents run, the scenarios in them are sound, and the links lead somewhere."""

import contextlib
import io
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

import socialai_dsl
from socialai_dsl import frontend

ROOT = Path(__file__).parents[1]
DOCUMENTS = [ROOT / name for name in ("README.md", "ARCHITECTURE.md", "CHANGELOG.md")]

BLOCK = re.compile(r"^```(\w+)\n(.*?)^```", re.MULTILINE | re.DOTALL)
LINK = re.compile(r"\]\((?!https?://|#)([^)\s]+)\)")


def blocks(path: Path, language: str) -> Iterator[str]:
    for found, text in BLOCK.findall(path.read_text(encoding="utf-8")):
        if found == language:
            yield text


@pytest.fixture
def reader(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder as a reader of the README would have it: the scenarios it shows are saved under their names."""
    monkeypatch.chdir(tmp_path)
    for text in blocks(ROOT / "README.md", "yaml"):
        first = text.splitlines()[0]
        (tmp_path / first.removeprefix("# ")).write_text(text, encoding="utf-8")
    return tmp_path


def test_readme_examples_run(reader: Path) -> None:
    examples = list(blocks(ROOT / "README.md", "python"))
    assert len(examples) >= 2
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        for number, example in enumerate(examples):
            exec(compile(example, f"README.md, example {number + 1}", "exec"), {})
    assert "(7, 7, 4)" in printed.getvalue()
    assert "Ada: After you." in printed.getvalue(), "the keeper of the example's door answers"


def test_readme_scenarios_have_no_findings(reader: Path) -> None:
    files = sorted(reader.glob("*.yaml"))
    assert files
    for file in files:
        result = frontend.check(str(file))
        assert result.scenario is not None
        assert [str(diagnostic) for diagnostic in result.diagnostics] == []


def test_readme_scenario_can_be_won(reader: Path) -> None:
    """Ask for the door from below it, with the keeper looking, then walk out."""
    env = socialai_dsl.make("gatekeeper.yaml")
    layout = {
        "room": {"width": 6, "height": 6},
        "agent": {"at": [2, 1], "facing": "right"},
        "keeper": {"at": [3, 1], "facing": "left"},
        "gate": {"at": [2, 0]},
    }
    env.reset(seed=0, options={"layout": layout})
    encode = env.unwrapped.encode_action
    info, terminated = {}, False
    for action in [(None, "Please open the door"), ("left", None), ("forward", None)]:
        *_, terminated, _, info = env.step(encode(action))
    assert terminated
    assert info["success"]


@pytest.mark.parametrize("path", DOCUMENTS, ids=lambda path: path.name)
def test_links_lead_somewhere(path: Path) -> None:
    for target in LINK.findall(path.read_text(encoding="utf-8")):
        assert (ROOT / target.split("#")[0]).exists(), f"{path.name} links to {target}, which is not there"


def test_architecture_names_files_that_exist() -> None:
    text = (ROOT / "ARCHITECTURE.md").read_text(encoding="utf-8")
    names = set(re.findall(r"`([\w./-]+(?:\.py|\.yaml|\.lark|/))`", text))
    assert len(names) > 10
    missing = [
        name
        for name in sorted(names)
        if not any((ROOT / root / name).exists() for root in ("", "socialai_dsl"))
    ]
    assert missing == []


def test_architecture_stays_short() -> None:
    assert len((ROOT / "ARCHITECTURE.md").read_text(encoding="utf-8").splitlines()) < 150

"""`socialai show`: the resolved scenario, its origins, its program."""

from pathlib import Path

import pytest
import yaml

from socialai_dsl.cli.main import main

Capture = pytest.CaptureFixture[str]


@pytest.fixture
def scenario(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """A scenario from `socialai new` and a variant of it that takes six steps off its time."""
    monkeypatch.chdir(tmp_path)
    assert main(["new", "corridor"]) == 0
    Path("corridor_short.yaml").write_text(
        "variant: short\nof: corridor\nset:\n  horizon: 34\n", encoding="utf-8"
    )
    return "corridor.yaml+short"


def test_the_resolved_scenario_is_yaml(scenario: str, capsys: Capture) -> None:
    capsys.readouterr()
    assert main(["show", scenario]) == 0
    shown = yaml.safe_load(capsys.readouterr().out)
    assert (shown["scenario"], shown["horizon"]) == ("corridor", 34)


def test_what_is_shown_is_a_scenario_again(scenario: str, capsys: Capture) -> None:
    capsys.readouterr()
    assert main(["show", scenario]) == 0
    Path("again.yaml").write_text(capsys.readouterr().out, encoding="utf-8")
    assert main(["validate", "--strict", "again.yaml"]) == 0


def test_origins_name_the_file_of_each_value(scenario: str, capsys: Capture) -> None:
    capsys.readouterr()
    assert main(["show", "--origin", scenario]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert any(line.startswith("corridor_short.yaml:4:12: horizon = 34") for line in lines)
    assert any(line.startswith("corridor.yaml:1:11: scenario = ") for line in lines)


def test_the_program_is_listed(scenario: str, capsys: Capture) -> None:
    capsys.readouterr()
    assert main(["show", "--program", scenario]) == 0
    listing = capsys.readouterr().out
    assert "horizon 34" in listing
    assert "Ada: After you." in listing

"""`socialai new` writes files that are sound as they stand, and a script that solves the scenario."""

import json
from pathlib import Path

import jsonschema
import pytest

from socialai_dsl.authoring.templates import TEMPLATES, template_files
from socialai_dsl.cli.main import main
from socialai_dsl.evaluation.scripts import play_script
from socialai_dsl.loader.reader import read_document

Capture = pytest.CaptureFixture[str]


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


@pytest.mark.parametrize("name", ["corridor", "corridor.yaml"])
def test_the_file_has_its_name_and_no_findings(name: str, capsys: Capture) -> None:
    assert main(["new", name]) == 0
    assert "\nscenario: corridor\n" in Path("corridor.yaml").read_text(encoding="utf-8")
    capsys.readouterr()
    assert main(["validate", "--strict", "."]) == 0
    assert capsys.readouterr().out == "3 files checked: 0 errors, 0 warnings\n"


@pytest.mark.parametrize("template", TEMPLATES)
def test_every_template_is_sound_and_commented(template: str, capsys: Capture) -> None:
    assert main(["new", "corridor", "--template", template]) == 0
    capsys.readouterr()
    assert main(["validate", "--strict", "."]) == 0, capsys.readouterr().out
    text = Path("corridor.yaml").read_text(encoding="utf-8")
    commented = [line for line in text.splitlines()[1:] if "#" in line]
    assert len(commented) >= 8, "an author finds out what the keys mean"
    assert all("my_scenario" not in path.read_text(encoding="utf-8") for path in Path().glob("*.yaml"))


@pytest.mark.parametrize("template", TEMPLATES)
def test_every_template_is_solved_by_its_script(template: str) -> None:
    main(["new", "corridor", "--template", template])
    scenarios = ["corridor.yaml"] + ["corridor.yaml+swapped"] * Path("corridor_swapped.yaml").exists()
    for scenario in scenarios:
        report = play_script(scenario, rooms=200, seed=3, states=0)
        assert report.success_rate == 1, (scenario, report.unsolved)


@pytest.mark.parametrize("template", TEMPLATES)
def test_what_every_template_claims_holds_and_can_be_known(template: str, capsys: Capture) -> None:
    main(["new", "corridor", "--template", template])
    for scenario in ["corridor.yaml"] + ["corridor_swapped.yaml"] * Path("corridor_swapped.yaml").exists():
        assert main(["check", scenario, "--rooms", "3", "--seconds", "0"]) == 0, capsys.readouterr().out
        assert "  holds: `knowable: true`" in capsys.readouterr().out


def test_only_one_template_has_two_parts() -> None:
    swapped = [name for name in TEMPLATES if Path("x_swapped.yaml") in template_files(name, "x")]
    assert swapped == ["role-swap"]


@pytest.mark.parametrize("template", TEMPLATES)
def test_editors_find_the_schema_beside_the_files(template: str) -> None:
    main(["new", "corridor", "--template", template])
    for path in Path().glob("*.yaml"):
        modeline, _, _ = path.read_text(encoding="utf-8").partition("\n")
        start, _, target = modeline.partition("$schema=")
        assert start == "# yaml-language-server: "
        schema = json.loads(path.with_name(target).read_text(encoding="utf-8"))
        errors = jsonschema.Draft7Validator(schema).iter_errors(read_document(path).data)
        assert [error.message for error in errors] == []


def test_the_templates_are_listed(capsys: Capture) -> None:
    assert main(["new", "--list"]) == 0
    assert [line.split()[0] for line in capsys.readouterr().out.splitlines()] == list(TEMPLATES)
    assert main(["new", "gate", "--list"]) == 2
    assert "NAME: --list lists the templates" in capsys.readouterr().err
    assert list(Path().iterdir()) == []
    assert main(["new"]) == 2
    assert "expected a NAME" in capsys.readouterr().err


@pytest.mark.parametrize("existing", ["corridor.yaml", "corridor_oracle.yaml"])
def test_existing_files_stay(existing: str, capsys: Capture) -> None:
    Path(existing).write_text("mine")
    assert main(["new", "corridor"]) == 2
    assert [path.name for path in Path().iterdir()] == [existing]
    assert Path(existing).read_text() == "mine"
    assert capsys.readouterr().err == f"socialai: {existing} exists already\n"


def test_a_schema_that_is_there_stays() -> None:
    Path("socialai.schema.json").write_text("mine")
    assert main(["new", "corridor"]) == 0
    assert Path("socialai.schema.json").read_text() == "mine"


@pytest.mark.parametrize("name", ["", "a b", "../x", "1a", "x" * 41])
def test_a_name_that_is_no_word_is_refused(name: str, capsys: Capture) -> None:
    assert main(["new", name]) == 2
    assert "expected letters, digits and underscores" in capsys.readouterr().err

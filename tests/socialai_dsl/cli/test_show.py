"""`socialai show`: the resolved scenario, its origins, its program."""

import json
import shutil
from pathlib import Path

import pytest
import yaml

from socialai_dsl.cli.main import main

DATA = Path(__file__).parents[2] / "data"

Capture = pytest.CaptureFixture[str]


@pytest.fixture
def scenario(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """A scenario from `socialai new` and a variant of it that takes six steps off its time."""
    monkeypatch.chdir(tmp_path)
    shutil.copy(DATA / "corridor.yaml", "corridor.yaml")
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


@pytest.mark.parametrize(
    ("asked", "defaults"),
    [
        ("n=2", {"n": 2}),
        ("word=5&flag=false", {"word": "5", "flag": False}),
        ("wall=left", {"wall": "left"}),
        ("side=right", {"side": "right"}),
    ],
)
def test_what_is_shown_has_the_parameters_that_were_asked_for(
    asked: str, defaults: dict[str, object], scenario: str, capsys: Capture
) -> None:
    """So what is shown plays as that name does."""
    params = {
        "n": 1,
        "word": "Hello",
        "flag": True,
        "wall": {"default": "top", "values": {"top": "wall(top)", "left": "wall(left)"}},
        "side": {"default": "left", "values": ["left", "right"]},
    }
    Path("asked.yaml").write_text(
        f"scenario: asked\nextends: corridor.yaml\nparams: {json.dumps(params)}\n", encoding="utf-8"
    )
    capsys.readouterr()
    assert main(["show", f"asked.yaml?{asked}"]) == 0
    Path("again.yaml").write_text(shown := capsys.readouterr().out, encoding="utf-8")
    assert main(["validate", "again.yaml"]) == 0
    found = {
        name: value["default"] if isinstance(value, dict) else value
        for name, value in yaml.safe_load(shown)["params"].items()
    }
    assert found == {"n": 1, "word": "Hello", "flag": True, "wall": "top", "side": "left"} | defaults


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


def test_origins_lead_into_files_that_are_drawn_from(capsys: Capture) -> None:
    assert main(["show", "--origin", "diverse_exit"]) == 0
    files = {line.partition(".yaml:")[0].rpartition("/")[2] for line in capsys.readouterr().out.splitlines()}
    assert files >= {"diverse_exit", "teacher", "npc_00", "npc_11"}


def test_origins_of_variants_and_suites(capsys: Capture) -> None:
    assert main(["show", "--origin", "talkitout+unsocial"]) == 0
    assert 'unsocial.yaml:3:21: observe.npcs = "hidden"' in capsys.readouterr().out
    assert main(["show", "--origin", "social_env"]) == 0
    assert "social_env.yaml:" in capsys.readouterr().out
    assert main(["show", "--program", "social_env?split=test"]) == 0
    assert "=== help_as_helper ===" in capsys.readouterr().out


@pytest.mark.parametrize("name", ["diverse_exit/npc_03.yaml", "unsocial.yaml", "school/base.yaml"])
def test_other_kinds_of_files_are_shown_but_have_no_program(name: str, capsys: Capture) -> None:
    path = str(Path(__file__).parents[3] / "scenarios" / name)
    assert main(["show", path]) == 0
    assert yaml.safe_load(capsys.readouterr().out)
    assert main(["show", "--origin", path]) == 0
    assert Path(name).name + ":1:" in capsys.readouterr().out
    assert main(["show", "--program", path]) == 1
    assert "S108" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("name", "said"), [("nowhere", "S504 there is no scenario `nowhere`"), ("talkitout+nope", "S503")]
)
@pytest.mark.parametrize("option", [[], ["--origin"], ["--program"]])
def test_names_that_do_not_exist(name: str, said: str, option: list[str], capsys: Capture) -> None:
    assert main(["show", *option, name]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert said in captured.err

"""Options of all commands: no number ends in a traceback, and nothing is accepted and ignored."""

import argparse
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path

import pytest

from socialai_dsl.cli.main import _COMMANDS, main
from socialai_dsl.cli.model_options import MODEL_OPTIONS
from socialai_dsl.model_options import meanings
from socialai_dsl.trainer.config import HYPER

Capture = pytest.CaptureFixture[str]

NO_NUMBERS = {None, str, Path, "identifier", "known_room", "_parameter"}
"""Types of options that are words; every other type is held to be a number."""
POSITIONALS = {
    "evaluate": {"run": "llm:m"},
    "experiment plan": {"file": "any.yaml"},
    "experiment run": {"file": "any.yaml"},
    "report": {"folders": "any"},
}
"""What to name where a command takes something else than the scenario."""
FROM_ZERO = {"--seconds", "--seed", "--index", "--test-episode", "--port", "--temperature", "--fail-under"}
NEVER = ["-1", "nan", "-inf", "1e999", "9" * 30, "9" * 5000, "\u0661x", "many", ""]


def parsers(parser: argparse.ArgumentParser, name: str) -> Iterator[tuple[str, argparse.ArgumentParser]]:
    found = [a for a in parser._actions if isinstance(a, argparse._SubParsersAction)]
    for action in found:
        for sub, command in action.choices.items():
            yield from parsers(command, f"{name} {sub}")
    if not found:
        yield name, parser


def numeric_options() -> Iterator[tuple[str, str]]:
    for name in _COMMANDS:
        whole = argparse.ArgumentParser()
        import_module(f"socialai_dsl.cli.{name}").add_arguments(whole)
        for command, parser in parsers(whole, name):
            for action in parser._actions:
                kind = getattr(action.type, "__name__", None)
                if action.option_strings and action.type not in NO_NUMBERS and kind not in NO_NUMBERS:
                    yield command, action.option_strings[-1]


NUMERIC = list(numeric_options())


@pytest.fixture(autouse=True)
def corridor(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Capture) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["new", "corridor"]) == 0
    capsys.readouterr()


def refused(words: list[str], option: str, capsys: Capture) -> str:
    """What a command line is told that is refused in a sentence, which names the option, and leaves nothing behind."""
    before = set(Path().rglob("*"))
    assert main(words) == 2, words
    told = capsys.readouterr().err
    assert f"{option}: " in told
    assert "Traceback" not in told
    assert len(told.splitlines()[-1]) < 400
    assert set(Path().rglob("*")) == before
    return told


def test_every_option_of_language_models_has_a_meaning() -> None:
    assert tuple(meanings()) == MODEL_OPTIONS


def test_the_numbers_of_every_command_are_looked_at() -> None:
    assert len(NUMERIC) > 35
    assert {"--frames", "--seconds", "--episodes", "--timeout", "--workers"} <= {
        option for _, option in NUMERIC
    }


@pytest.mark.parametrize(("command", "option"), NUMERIC)
def test_a_number_that_cannot_be_is_refused_by_name(command: str, option: str, capsys: Capture) -> None:
    words = [*command.split(), *POSITIONALS.get(command, {"scenario": "corridor.yaml"}).values()]
    zero = [] if option in FROM_ZERO or (command, option) == ("evaluate", "--record") else ["0"]
    for value in [*NEVER, *zero]:
        assert "expected" in refused([*words, f"{option}={value}"], option, capsys)


@pytest.mark.parametrize(
    "value", ["nan", "NaN", "-Infinity", "1e999", "9" * 5000, "[" * 20_000, '{"a": 1}', "-1e9"]
)
def test_no_option_of_the_trainer_takes_what_is_no_value(value: str, capsys: Capture) -> None:
    for name in HYPER:
        refused(["run", "dance", "--hyper", f"{name}={value}", "--out", "run"], f"--hyper {name}", capsys)


@pytest.mark.parametrize(
    "words",
    [
        *(f"--budget {amount}" for amount in ("0", "0usd", "-1", "nan", "inf", "1e9", "9" * 400, "1usd")),
        *(f"--prices {amounts}" for amounts in ("1", "nan,1", "inf,inf", "-1,1", "1,2,3", f"{'9' * 400},1")),
    ],
)
def test_amounts_of_money_and_tokens(words: str, capsys: Capture) -> None:
    command = [
        "evaluate",
        "llm:m",
        "--base-url",
        "http://localhost:9/v1",
        "--on",
        "corridor.yaml",
        "--out",
        "out",
    ]
    assert main([*command, *words.split()]) == 2
    assert f"{words.split()[0]}: " in capsys.readouterr().err


MODEL = "base-url http://localhost|key-from K|style json|mode json|history 2|temperature 1|max-tokens 9|on-invalid fail"
MODEL += "|goal win|grammar|probes off|concurrency 2|timeout 3|budget 9|prices 1,1"


@pytest.mark.parametrize(
    ("command", "idle"),
    [
        *(("evaluate random --on corridor.yaml", option) for option in MODEL.split("|")),
        ("evaluate shipped:talkitout", "style json"),
        ("evaluate shipped:talkitout", "participant ada"),
        *(
            ("evaluate random --on corridor.yaml", option)
            for option in ("greedy", "device cpu", "net a:B", "participant a")
        ),
        *(
            ("evaluate oracle --on corridor.yaml", option)
            for option in ("greedy", "device cpu", "net a:B", "seed 1")
        ),
        *(
            ("evaluate human --on corridor.yaml", option)
            for option in ("greedy", "device cpu", "seed 1", "style json")
        ),
        *(
            ("evaluate llm:m --on corridor.yaml", option)
            for option in ("greedy", "device cpu", "net a:B", "seed 1")
        ),
        ("evaluate llm:m --base-url http://localhost:9 --on corridor.yaml --mode json", "grammar"),
        *(
            ("run corridor.yaml --agent random", option)
            for option in ("frames 9", "device cpu", "net fast", "hyper lr=1")
        ),
        ("run corridor.yaml --agent human", "json"),
        *(
            ("run corridor.yaml --guide none", f"hyper {one}")
            for one in ("guide_share=0.5", "imitation_coef=1")
        ),
        *(("run corridor.yaml", f"hyper {one}") for one in ("bonus_c=1", "bonus_m=1", "bonus_t=1")),
        *(("run corridor.yaml --bonus lines", f"hyper {one}") for one in ("bonus_m=1", "bonus_t=1")),
        *(("check corridor.yaml", option) for option in ("agent random", "episodes 9", "fail-under 5")),
        *(
            ("check corridor.yaml --part coverage", option)
            for option in ("rooms 3", "states 9", "deep", "strict")
        ),
        *(
            ("check corridor.yaml --part script", option)
            for option in ("agent random", "strict", "deep", "episodes 9")
        ),
        *(("validate corridor.yaml", option) for option in ("rooms 3", "seconds 3", "stdin-filename a.yaml")),
        *(
            ("replay episodes.json", option)
            for option in ("agent random", "episodes 3", "record 2", "greedy")
        ),
        ("replay episodes.json", "test-episode 3"),
        *(("replay corridor.yaml --test-episode 1", option) for option in ("episodes 3", "record 2")),
        *(("replay corridor.yaml --agent random", option) for option in ("greedy",)),
        *(("replay corridor.yaml", option) for option in ("agent human", "agent llm:m")),
        ("trace corridor.yaml --test-episode 3 --do forward", "seed 3"),
        *(("report here --curves c.png", option) for option in ("out there", "no-baselines")),
        ("new --list", "template empty"),
        ("experiment status here --json", "each"),
        ("experiment plan corridor.yaml --json", "each"),
    ],
)
def test_what_would_be_ignored_is_refused_by_name(command: str, idle: str, capsys: Capture) -> None:
    Path("episodes.json").write_text("[]")
    option, *value = f"--{idle}".split(" ", 1)
    named = f"--{idle.partition('=')[0]}" if option == "--hyper" else option
    refused([*command.split(), option, *value], named, capsys)


SETTINGS = "frames: 1000, seeds: 1, envs: 4"
BAD = [
    *(
        f"{key}: {value}"
        for key in ("frames", "envs", "eval_episodes")
        for value in ("0", "-1", ".nan", ".inf", "1.5", "9" * 30)
    ),
    *(f"seeds: {value}" for value in ("0", "-1", ".nan", "[-1]", f"[{'9' * 30}]", "[]")),
    *(
        f"hyper: {{{pair}}}"
        for pair in ("lr: .nan", "lr: .inf", "lr: -1", "gamma: 2", "horizon: 0", f"epochs: {'9' * 30}")
    ),
    "frame: 1000",
    "hyper: {learning: 1}",
]


@pytest.mark.parametrize("setting", BAD)
def test_an_experiment_s_numbers_are_findings(setting: str, capsys: Capture) -> None:
    given = dict(pair.split(": ") for pair in SETTINGS.split(", "))
    given[setting.partition(": ")[0]] = setting.partition(": ")[2]
    lines = "".join(f"  {key}: {value}\n" for key, value in given.items())
    Path("some.yaml").write_text(
        f"experiment: some\nset:\n{lines}conditions:\n  - {{name: one, scenario: corridor.yaml}}\n"
    )
    assert main(["experiment", "plan", "some.yaml"]) == 1
    told = capsys.readouterr().err
    assert "some.yaml:" in told
    assert "Traceback" not in told

"""Evaluations in rooms beside the test set: those of a seed, and known ones from a file."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import socialai_dsl as sd
from socialai_dsl.cli.main import main
from socialai_dsl.episodes import RoomSet
from socialai_dsl.errors import OptionError, UsageError
from socialai_dsl.loader.shipped import shipped_scenarios
from tests.socialai_dsl.llm.endpoint import endpoint


def layouts_of(name: str, rooms: RoomSet, count: int) -> list[dict[str, Any]]:
    env = sd.make(name).unwrapped
    found = []
    for number in range(count):
        env.reset(**rooms.reset(number))
        found.append(env.describe())
    return found


@pytest.mark.parametrize("name", sorted(shipped_scenarios())[::12])
def test_a_vector_begins_the_rooms_that_a_single_environment_begins(name: str, tmp_path: Path) -> None:
    seed = RoomSet.of_seed(7)
    file = tmp_path / "rooms.json"
    file.write_text(json.dumps(layouts_of(name, seed, 4)), encoding="utf-8")
    single = sd.make(name).unwrapped
    many = sd.make_vec(name, num_envs=3, autoreset_mode="Disabled").unwrapped
    for rooms in (RoomSet(), seed, RoomSet.named(file)):
        many.reset(**rooms.reset_many(np.ones(3, np.bool_), np.arange(3)))
        many.reset(**rooms.reset_many(np.array([False, True, False]), np.array([0, 3, 2])))
        for environment, number in enumerate((0, 3, 2)):
            single.reset(**rooms.reset(number))
            assert many.describe(environment) == single.describe(), rooms.title(number)


def test_a_file_of_layouts_plays_as_the_rooms_that_it_was_made_from(tmp_path: Path) -> None:
    file = tmp_path / "rooms.json"
    file.write_text(json.dumps(layouts_of("talkitout", RoomSet.of_seed(3), 12)), encoding="utf-8")
    known = sd.evaluate("oracle", "talkitout", rooms=file)
    drawn = sd.evaluate("oracle", "talkitout", 12, rooms="seed:3")
    assert known.result.episodes == 12
    assert known.result.success.tolist() == drawn.result.success.tolist()
    assert known.result.lengths.tolist() == drawn.result.lengths.tolist()
    assert known.figures()["rooms"].startswith("rooms.json (")
    assert drawn.figures()["rooms"] == "seed:3"


def test_rooms_beside_the_test_set_are_other_rooms() -> None:
    test = sd.evaluate("random", "talkitout", 30)
    other = sd.evaluate("random", "talkitout", 30, rooms="seed:0")
    again = sd.evaluate("random", "talkitout", 30, rooms="seed:0")
    assert other.result.lengths.tolist() == again.result.lengths.tolist()
    layouts = layouts_of("talkitout", RoomSet(), 30), layouts_of("talkitout", RoomSet.of_seed(0), 30)
    assert not any(one == two for one, two in zip(*layouts, strict=True))
    assert test.figures()["rooms"] == "test"


def test_what_was_played_is_replayed_in_its_rooms(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "kept"
    assert (
        main(
            [
                "evaluate",
                "oracle",
                "--on",
                "talkitout",
                "--rooms",
                "seed:5",
                "--episodes",
                "8",
                "--out",
                str(out),
            ]
        )
        == 0
    )
    assert "8 in rooms of seed 5" in capsys.readouterr().out
    place = out / "talkitout"
    assert json.loads((place / "rooms.json").read_text(encoding="utf-8")) == {
        "name": "seed:5",
        "seed": 5,
        "layouts": None,
    }
    assert [trace.episode for trace in sd.replay(place, test_episodes=[6])] == ["seed 5, room 6"]
    assert {trace.episode[:12] for trace in sd.replay(place)} == {"seed 5, room"}
    # The same folder with the test set: nothing of the other rooms is left.
    assert main(["evaluate", "oracle", "--on", "talkitout", "--episodes", "8", "--out", str(out)]) == 0
    assert not (place / "rooms.json").exists()


def test_a_report_does_not_join_rooms_of_one_number_from_different_sets(tmp_path: Path) -> None:
    for name, agent, rooms in (("a", "oracle", "test"), ("b", "random", "test"), ("c", "oracle", "seed:1")):
        sd.evaluate(agent, "talkitout", 10, rooms=rooms, out=tmp_path / name, record=0)
    out = tmp_path / "report"
    folders = [str(tmp_path / name / "talkitout") for name in "abc"]
    assert main(["report", *folders, "--out", str(out)]) == 0
    joined = (out / "rooms.csv").read_text(encoding="utf-8").splitlines()[1:]
    assert len(joined) == 1
    assert "seed:1" not in joined[0]
    assert "rooms of seed:1" in (out / "runs.csv").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("rooms", "said"),
    [
        ("seed:x", "rooms: got 'seed:x', expected seed:N"),
        ("seed:-1", "rooms: got 'seed:-1', expected seed:N"),
        ("tests", "rooms: got 'tests', expected test, seed:N"),
    ],
)
def test_a_set_of_rooms_that_does_not_exist_is_refused(rooms: str, said: str) -> None:
    with pytest.raises(OptionError) as caught:
        sd.evaluate("random", "talkitout", 5, rooms=rooms)
    assert str(caught.value).startswith(said)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("[]", "expected a list of layouts"),
        ("[3]", "expected a list of layouts"),
        ("{", "is no JSON"),
        ('[{"wizzard": {}}]', "room 0 of rooms.json"),
        ('[{}, {"agent": {"at": [99, 1]}}]', "room 1 of rooms.json"),
    ],
)
def test_a_file_without_rooms_of_the_scenario_is_refused_before_anybody_plays(
    content: str, said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file, out = tmp_path / "rooms.json", tmp_path / "out"
    file.write_text(content, encoding="utf-8")
    words = ["evaluate", "random", "--on", "talkitout", "--rooms", str(file), "--out", str(out)]
    assert main(words) == 2
    error = capsys.readouterr().err
    assert error.startswith("socialai: --rooms: ")
    assert said in error
    assert not out.exists()


def test_more_episodes_than_a_file_has_rooms_are_refused(tmp_path: Path) -> None:
    file = tmp_path / "rooms.yaml"
    file.write_text("- agent: {facing: up}\n- {}\n", encoding="utf-8")
    with pytest.raises(UsageError, match="episodes: got 3, expected a whole number from 1 to 2"):
        sd.evaluate("random", "talkitout", 3, rooms=file)
    assert sd.evaluate("random", "talkitout", rooms=file).result.episodes == 2


def test_a_language_model_goes_on_in_its_rooms_and_in_no_others(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "kept"
    with endpoint(lambda _: "Act: forward") as stub:
        command = [
            "evaluate",
            "llm:stub",
            "--on",
            "help",
            "--episodes",
            "2",
            "--out",
            str(out),
            "--base-url",
            stub.url,
        ]
        assert main([*command, "--rooms", "seed:4"]) == 0
        asked = len(stub.requests)
        assert main([*command, "--rooms", "seed:4"]) == 0
        assert len(stub.requests) == asked, "answers are kept"
        capsys.readouterr()
        assert main(command) == 2
        assert "holds episodes of seed:4; choose another folder" in capsys.readouterr().err
        assert len(stub.requests) == asked
    replayed = sd.replay(out / "help", test_episodes=[1])[0]
    drawn = sd.trace("help", "random", seed=4, index=1).moments[0]
    assert (replayed.moments[0].cells, replayed.moments[0].state) == (drawn.cells, drawn.state)
    assert replayed.episode == "seed 4, room 1"

"""What pages send has the types that it should have, exactly: nothing is taken for something else."""

from __future__ import annotations

import json
from typing import Any

import pytest

from socialai_dsl.study.messages import joining, parsed

RIGHT: dict[str, dict[str, Any]] = {
    "beat": {"do": "beat"},
    "go": {"do": "go", "on": "1.0"},
    "decline": {"do": "decline", "on": "0.0"},
    "act": {"do": "act", "on": "g1.0.0", "movement": "left", "said": "Hi", "shown": 1.5, "acted": 2},
    "answers": {"do": "answers", "on": "3.0", "answers": {"how": "well", "hard": 3}},
    "join": {"do": "join", "id": "abc", "code": "0f", "consented": True, "simulated": False},
}
OTHERS = [None, True, False, 0, 1, 1.0, 2.5, "1", "true", "", [], ["a"], {}, {"a": 1}]
MAY_BE: dict[str, tuple[type, ...]] = {
    "on": (str,),
    "movement": (str, type(None)),
    "said": (str, type(None)),
    "shown": (int, float),
    "acted": (int, float),
    "answers": (dict,),
    "id": (str, type(None)),
    "code": (str, type(None)),
    "simulated": (bool,),
}


def read(message: dict[str, Any]) -> Any:
    text = json.dumps(message)
    return joining(text) if message["do"] == "join" else parsed(text)


def fits(key: str, value: Any) -> bool:
    """Whether a message may have this value; of a bool and of an int, which Python takes for each other, too."""
    if key == "consented":
        return value is True
    if key == "id" and value == "":
        return False
    kinds = MAY_BE[key]
    return isinstance(value, kinds) and (bool in kinds or not isinstance(value, bool))


@pytest.mark.parametrize("do", RIGHT)
def test_a_message_is_read_as_it_is(do: str) -> None:
    found = read(RIGHT[do])
    assert found is not None
    assert {**found.model_dump(), "do": do} == RIGHT[do]


@pytest.mark.parametrize(
    ("do", "key"), [(do, key) for do, message in RIGHT.items() for key in message if key != "do"]
)
def test_a_value_of_another_type_is_refused(do: str, key: str) -> None:
    taken = [value for value in OTHERS if read({**RIGHT[do], key: value}) is not None]
    assert [repr(value) for value in taken] == [repr(value) for value in OTHERS if fits(key, value)]


@pytest.mark.parametrize("answer", [True, False, 1.0, 2.5, None, [], {}])
def test_an_answer_is_a_text_or_a_whole_number(answer: Any) -> None:
    assert read({**RIGHT["answers"], "answers": {"how": answer}}) is None


@pytest.mark.parametrize("time", ["NaN", "Infinity", "-Infinity", "-1", "1e11"])
def test_a_time_is_one(time: str) -> None:
    text = json.dumps(RIGHT["act"]).replace("1.5", time)
    assert parsed(text) is None

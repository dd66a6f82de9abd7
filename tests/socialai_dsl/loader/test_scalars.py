"""What plain words mean; the table is the contract."""

from __future__ import annotations

import math

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from socialai_dsl.loader.reader import read_plain

REFUSED = object()

TABLE: dict[str, object] = {
    "": None,
    "null": None,
    "Null": REFUSED,
    "~": REFUSED,
    "true": True,
    "false": False,
    "True": REFUSED,
    "FALSE": REFUSED,
    "yes": REFUSED,
    "No": REFUSED,
    "on": REFUSED,
    "OFF": REFUSED,
    "y": REFUSED,
    "N": REFUSED,
    "yEs": "yEs",
    "0": 0,
    "-7": -7,
    "+7": 7,
    "100": 100,
    "9999999999": 9_999_999_999,
    "10000000000": REFUSED,
    "9" * 5000: REFUSED,
    "010": REFUSED,
    "00": REFUSED,
    "0x1F": REFUSED,
    "0o17": REFUSED,
    "0b11": REFUSED,
    "1_000": REFUSED,
    "1:30": REFUSED,
    "12:30:45": REFUSED,
    "0.9": 0.9,
    "-1.5": -1.5,
    ".5": 0.5,
    "1.5e+3": 1500.0,
    "5.": REFUSED,
    "1e3": REFUSED,
    "1.5e3": REFUSED,
    "01.5": REFUSED,
    ".inf": REFUSED,
    "-.INF": REFUSED,
    ".nan": REFUSED,
    "1.0e+999": REFUSED,
    "2024-01-31": REFUSED,
    "2024-13-45": REFUSED,
    "2024-01-31 10:00:00": REFUSED,
    "=": REFUSED,
    "<<": REFUSED,
    "5..8": "5..8",
    "1.2.3": "1.2.3",
    "W - 1": "W - 1",
    "-": "-",
    "+": "+",
    ".": ".",
    "nobody": "nobody",
    "no liar": "no liar",
    "infinity": "infinity",
    "-inf": "-inf",
    "12 monkeys": "12 monkeys",
    "Where is the exit": "Where is the exit",
    "<answer>": "<answer>",
    "==": "==",
}


@pytest.mark.parametrize(("text", "expected"), TABLE.items(), ids=[text[:24] for text in TABLE])
def test_table(text: str, expected: object) -> None:
    plain = read_plain(text)
    if expected is REFUSED:
        assert plain.code in ("S003", "S004")
    else:
        assert plain.code is None
        assert plain.value == expected
        assert type(plain.value) is type(expected)


def test_refusals_say_what_to_write() -> None:
    plain = read_plain("yes")
    assert plain.code == "S003"
    assert plain.message == "`yes` is `true` for some YAML tools and text for others"
    assert (plain.instead, plain.also) == ("true", 'if you mean the text, quote it: "yes"')
    assert [read_plain(text).instead for text in ("060", "+007", "0x10", "1_000", "-08")] == [
        "60", "7", None, None, "-8",
    ]  # fmt: skip


WORD = st.text(alphabet="0123456789._-+:eExobnyNfaT~=<", min_size=1, max_size=8)


@given(WORD)
def test_what_is_accepted_means_the_same_to_a_yaml_1_1_tool(text: str) -> None:
    plain = read_plain(text)
    if plain.code is not None:
        return
    try:
        node = yaml.compose(f"- {text}", Loader=yaml.SafeLoader)
    except yaml.YAMLError:
        return
    item = node.value[0]
    if not isinstance(item, yaml.ScalarNode) or item.value != text or item.tag.endswith("str"):
        # PyYAML follows YAML 1.1 but for `y` and `n`; what it takes for text we must take for text.
        if isinstance(item, yaml.ScalarNode) and item.value == text:
            assert isinstance(plain.value, str)
        return
    other = yaml.safe_load(f"- {text}")[0]
    assert type(plain.value) is type(other)
    assert plain.value == other or (isinstance(other, float) and math.isclose(other, plain.value))

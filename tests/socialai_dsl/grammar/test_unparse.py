"""Trees as text: parsing the text gives the tree again."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import socialai_dsl as sd
from socialai_dsl.checking.loaded import LoadedSuite
from socialai_dsl.grammar import ast
from socialai_dsl.grammar.ast import parse_expression, unparse

ROOT = Path(__file__).parents[3]


def without_offsets(value: Any) -> Any:
    """A tree as nested tuples that say nothing about where it stands."""
    if isinstance(value, tuple):
        return tuple(map(without_offsets, value))
    if not isinstance(value, ast.Node):
        return value
    names = [name for name in value.__dataclass_fields__ if name not in ("at", "end", "name_at")]
    return (type(value).__name__, *(without_offsets(getattr(value, name)) for name in names))


@pytest.mark.parametrize(
    "text",
    [
        "a and (b or not c) and d",
        "not (a and b)",
        "(a or b) and c",
        "1 - (2 - 3) * (4 + 5) // 6",
        "-(a + b) % 3",
        "x in a | b and y not in 2..4",
        "distance(agent) <= 2",
        "any(d in doors where agent.next_to(d) and d.state == open)",
        "nearest(c in coins where not gone(c) to thief).color != red",
        'agent.said("Here is <wanted>") or (a == b) == (c == d)',
        "opa(noun)",
        "pick(x in (a or b) where true)",
        "left_half where here.x > 2",
        "5 if a or b else 8 if c else 10",
        "(1 if a else 2) if (b if c else d) else (3 if e else 4)",
        "2 * (a if b else c) + 1 < 3 and (d if e else f)",
    ],
)
def test_a_tree_survives(text: str) -> None:
    tree = parse_expression(text)
    assert without_offsets(parse_expression(unparse(tree))) == without_offsets(tree)


@pytest.mark.parametrize("text", ["a and b or c", "-1 + 2 * x", "doors.color", "not eye_contact(agent)"])
def test_text_without_superfluous_brackets_stays(text: str) -> None:
    assert unparse(parse_expression(text)) == text


@pytest.mark.parametrize("name", ["talkitout", "help", "social_env", "novel/shop", "school/apple_stealing"])
def test_everything_in_shipped_scenarios_survives(name: str) -> None:
    loaded = sd.load(name if "/" not in name else str(ROOT / "scenarios" / f"{name}.yaml"))
    members = loaded.members if isinstance(loaded, LoadedSuite) else [loaded]
    seen = 0
    for member in members:
        assert member.checked.readings is not None
        for root in member.checked.readings.roots.values():
            for reading in root.walk():
                if not any(isinstance(node, ast.Text) for node in reading.node.walk()):
                    parsed = parse_expression(unparse(reading.node))
                    assert without_offsets(parsed) == without_offsets(reading.node)
                    seen += 1
    assert seen > 30

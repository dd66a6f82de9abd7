"""Expressions and texts: trees with offsets, and one message for each kind of slip."""

from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from socialai_dsl.grammar import ast
from socialai_dsl.grammar.ast import MAX_DEPTH, MAX_LENGTH, ParseProblem, parse_expression, parse_text


def shape(node: ast.Expr | str) -> object:
    """A tree without its offsets, for reading in a test."""
    match node:
        case str():
            return node
        case ast.Name() | ast.Parameter():
            return node.id
        case ast.Number() | ast.Truth():
            return node.value
        case ast.Text():
            return [shape(part) for part in node.parts]
    head = getattr(node, "op", None) or getattr(node, "name", None) or type(node).__name__
    return (head, *(shape(child) for child in node.children()))


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("a or b and not c", ("or", "a", ("and", "b", ("Not", "c")))),
        ("a and b and c", ("and", "a", "b", "c")),
        ("1 + 2 * 3 - 4", ("-", ("+", 1, ("*", 2, 3)), 4)),
        ("W // 2 - 1", ("-", ("//", "W", 2), 1)),
        ("5..8", ("Interval", 5, 8)),
        ("left | right | 2 * forward", ("Alternatives", "left", "right", ("*", 2, "forward"))),
        ("a in b | c", ("Member", "a", ("Alternatives", "b", "c"))),
        ("exit.color == red", ("==", ("color", "exit"), "red")),
        ("next_to(exit)", ("next_to", "exit")),
        ("agent.would_see(c, left)", ("would_see", "agent", "c", "left")),
        (
            "pick(n in A | B where n != x.name)",
            ("pick", ("Alternatives", "A", "B"), ("!=", "n", ("name", "x"))),
        ),
        ("nearest(d in doors to me)", ("nearest", "doors", "me")),
        (
            "anywhere where not here.in_front_of(doors)",
            ("FilteredRegion", "anywhere", ("Not", ("in_front_of", "here", "doors"))),
        ),
        ('agent.said("Here is <wanted>")', ("said", "agent", ["Here is ", "wanted"])),
        ("pick(doors).color", ("color", ("pick", "doors"))),
        ("-$n", ("Negative", "n")),
        ("a\n  and b", ("and", "a", "b")),
    ],
)
def test_trees(text: str, expected: object) -> None:
    assert shape(parse_expression(text)) == expected


@pytest.mark.parametrize(
    ("text", "code", "offset", "words"),
    [
        ("a && b", "S203", 2, "write `and`"),
        ("a || b", "S203", 2, "write `or`"),
        ("!a", "S203", 0, "write `not`"),
        ("a = b", "S203", 2, "write `==`"),
        ("1 < d <= 2", "S207", 6, "do not chain"),
        ("d in doors == b", "S207", 11, "write `d in doors and doors == b`"),
        ("t > 3 and < 5", "S210", 10, "missing before `<`"),
        ("(== 3)", "S210", 1, "missing before `==`"),
        ("5 if == t else 6", "S210", 5, "missing before `==`"),
        ("a == == b", "S210", 5, "missing before `==`"),
        ("push(marble, east", "S202", 4, "not closed"),
        ("a)", "S202", 1, "not opened"),
        ('said("Open)', "S202", 5, "not closed"),
        ("a and", "S210", 5, "ends too early"),
        ("", "S210", 0, "ends too early"),
        ("a b", "S210", 2, "did not expect `b`"),
        ("x / 2", "S203", 2, "//"),
        ("é", "S203", 0, "means nothing here"),
        ("a where b where c", "S210", 10, "where"),
        ("1" * 12, "S004", 0, "too large"),
    ],
)
def test_slips(text: str, code: str, offset: int, words: str) -> None:
    with pytest.raises(ParseProblem) as caught:
        parse_expression(text)
    assert (caught.value.code, caught.value.offset) == (code, offset)
    assert words in str(caught.value)


@pytest.mark.parametrize(
    "bomb",
    [
        "(" * 200 + "a" + ")" * 200,
        "not " * 100 + "a",
        "-" * 200 + "1",
        "1+" * 200 + "1",
        "a" * (MAX_LENGTH + 1),
    ],
)
def test_bombs_are_refused(bomb: str) -> None:
    with pytest.raises(ParseProblem) as caught:
        parse_expression(bomb)
    assert caught.value.code == "S004"


def test_the_deepest_allowed_expression_is_accepted() -> None:
    assert parse_expression("not " * (MAX_DEPTH - 1) + "a")


def test_texts_have_parts_with_offsets_into_the_whole() -> None:
    text = parse_text("Go to the <exit.color> door.")
    assert shape(text) == ["Go to the ", ("color", "exit"), " door."]
    part = text.parts[1]
    assert isinstance(part, ast.Attribute)
    assert (part.at, part.name_at) == (11, 16)
    assert parse_text("Open sesame").plain == "Open sesame"
    assert text.plain is None


@pytest.mark.parametrize(
    "slot",
    ["1 if t > 3 else 2", "1 if t < 3 else 2", "1 if 2 < t and t >= 1 or t > 5 else 3 if t < 2 else 4"],
)
def test_a_conditional_value_in_a_text_may_compare(slot: str) -> None:
    text = parse_text(f"Now <t> and <{slot}>, then <noun>.")
    assert text.parts[3] == ast.moved(parse_expression(slot), lambda at: at + 13)
    assert (text.parts[0], text.parts[4]) == ("Now ", ", then ")


@pytest.mark.parametrize(
    ("text", "offset"),
    [("a < b", 2), ("a > b", 2), ("<>", 0), ("Is <x > 2> red", 9)],
)
def test_stray_marks_in_texts(text: str, offset: int) -> None:
    with pytest.raises(ParseProblem) as caught:
        parse_text(text)
    assert (caught.value.code, caught.value.offset) == ("S202", offset)


def test_a_condition_in_a_text_needs_its_else() -> None:
    with pytest.raises(ParseProblem, match="`if` without `else`") as caught:
        parse_text("Is <a if x > 2> red")
    assert (caught.value.code, caught.value.offset) == ("S210", 11)


@given(st.text(alphabet='ab1 ().,|+-*/<>=!&"$_\n\tdoornotandinwhereifelse', max_size=60))
def test_any_text_gives_a_tree_or_one_problem(text: str) -> None:
    for parse in (parse_expression, parse_text):
        places = offsets(parse, text)
        assert all(0 <= place <= len(text) for place in places), places


def offsets(parse: Callable[[str], ast.Expr], text: str) -> list[int]:
    """Where the nodes of the tree stand, or the problem."""
    try:
        return [node.at for node in parse(text).walk()]
    except ParseProblem as problem:
        return [problem.offset]

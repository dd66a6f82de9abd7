"""Playing from the keyboard: what is typed becomes an action."""

import pytest

from socialai_dsl.cli.play import split_line

ACTIONS = ("left", "right", "forward", "pickup", "drop", "toggle", "done")


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("", (None, None)),
        ("left", ("left", None)),
        ("f", ("forward", None)),
        ("Forward", ("forward", None)),
        ("forward How are you", ("forward", "How are you")),
        ("Open sesame", (None, "Open sesame")),
        ("t  Open sesame", ("toggle", "Open sesame")),
        ("d", (None, "d")),
        ("do", ("done", None)),
        ("Le mot", (None, "Le mot")),
    ],
)
def test_a_line_is_a_movement_an_utterance_or_both(
    line: str, expected: tuple[str | None, str | None]
) -> None:
    assert split_line(line, ACTIONS) == expected

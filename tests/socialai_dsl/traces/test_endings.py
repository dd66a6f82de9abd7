"""Endings in the words of the file."""

from pathlib import Path

import pytest

import socialai_dsl as sd
from socialai_dsl.traces.endings import endings_of
from tests.tiny import Folder


@pytest.mark.parametrize(
    ("line", "text"),
    [
        ('success: agent.said("Yes")', 'success: agent.said("Yes")'),
        ('success: agent.said("Yes")   # as it should be', 'success: agent.said("Yes")'),
        ('{success: agent.said("Yes"), reward: 60}  # {less}', 'success: agent.said("Yes"), reward: 60'),
        ("""success: 'agent.said("Yes")'  # quoted""", """success: 'agent.said("Yes")'"""),
        ('{success: agent.said("Yes"),  # the rest\n     reward: 60}', '{success: agent.said("Yes"),'),
    ],
)
def test_an_ending_is_told_without_its_comment(line: str, text: str, tmp_path: Path) -> None:
    written = f"grammar: {{templates: [Yes, No]}}\ncast: {{agent: {{}}}}\noutcome:\n  - {line}\n"
    loaded = sd.load(Folder(tmp_path).write("endings", written))
    assert endings_of(loaded, sd.compile(loaded))[0].text == text

"""How texts are compared is the same for checking a file and for playing it."""

from pathlib import Path

import pytest

from socialai_dsl.vocabulary import normal, words
from tests.tiny import Folder


@pytest.mark.parametrize(
    "text", ["Open the door", " open  the\tdoor ", "OPEN THE DOOR!", "Open the door .", "Open the door?!"]
)
def test_case_blanks_and_final_marks_do_not_count(text: str) -> None:
    assert normal(text) == "open the door"


def test_words_are_runs_of_letters_digits_and_apostrophes() -> None:
    assert words("Don't  go_to room 7!") == ["don't", "go", "to", "room", "7"]


@pytest.mark.parametrize("said", ["Say  hello", '"Say  <what>"'])
def test_blanks_do_not_count_in_what_a_script_says_and_others_hear(tmp_path: Path, said: str) -> None:
    episode = Folder(tmp_path)(
        f"""\
        let: {{what: pick("hello" | "bye")}}
        frames:
          script: {{states: {{a: {{then: [{{say: {said}}}]}}}}}}
          doorman: {{states: {{b: {{then: [{{hears: Say <noun>, say: Welcome  back}}]}}}}}}
        cast:
          agent: {{frame: script}}
          porter: {{frame: doorman, at: [3, 3]}}
        """,
    )
    episode.act(episode.env.unwrapped.scripted_action()).step()
    assert "Porter: Welcome  back" in episode.info["history"]

"""Dialogues in suites as they read: what the agent does and says, what it hears, how it ends. Those of scenarios are
tests in the files beside them, see `test_dialogues.py`.

`> [body action][, say SENTENCE]` is a step, `< LINE` what is heard in it, `= success|failure|timeout REWARD` its
end; a step without `<` is silent, one without `=` ends nothing. The header is `scenario:` and a `layout:` in JSON,
which may go on over several lines.
"""

import json
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

from tests.scenarios.playing import made

FOLDER = Path(__file__).parent / "transcripts"
FILES = sorted(FOLDER.glob("*.txt"))


@dataclass
class Turn:
    line: int
    action: tuple[str | None, str | None]
    heard: list[str] = field(default_factory=list)
    end: str | None = None


def read(path: Path) -> tuple[str, dict[str, Any], list[Turn]]:
    head, layout, turns = "", "", []
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
        mark, _, rest = line.partition(" ")
        if line.startswith("scenario: "):
            head = rest
        elif line.startswith(("layout: ", "  ")):
            layout += line.removeprefix("layout: ")
        elif mark == ">":
            body, _, sentence = re.sub("^say ", ", say ", rest).partition(", say ")
            turns.append(Turn(number, (body or None, sentence or None)))
        elif mark == "<":
            turns[-1].heard.append(rest)
        elif mark == "=":
            turns[-1].end = rest
        else:
            assert mark == "#", f"{path.name}:{number}: what is this? {line}"
    return head, json.loads(layout), turns


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_transcript(path: Path) -> None:
    name, layout, turns = read(path)
    env = made(name)
    # What the layout leaves open must not matter.
    for seed in range(5):
        env.reset(seed=seed, options={"layout": layout})
        for turn in turns:
            _, reward, terminated, truncated, info = env.step(env.encode_action(turn.action))
            where = f"{path.name}:{turn.line}, seed {seed}"
            assert info["utterance"] == ("\n".join(turn.heard) or "NA"), where
            ended = None
            if terminated or truncated:
                word = "timeout" if truncated else "success" if info["success"] else "failure"
                ended = f"{word} {reward:g}"
            assert ended == turn.end, where

"""docs/metrics.md names every field that a run writes, and no other."""

import json
import re
from pathlib import Path

import pytest

import socialai_dsl
from socialai_dsl import evaluate
from socialai_dsl.episodes.players import Player
from socialai_dsl.trainer.config import RunConfig
from socialai_dsl.trainer.training import train

PAGE = Path(__file__).parents[1] / "docs" / "metrics.md"


LOSS = """
from socialai_dsl.trainer.auxiliary import AuxiliaryLoss
class Loss(AuxiliaryLoss):
    def forward(self, frames, outputs, net):
        return outputs.memory.square().mean()
"""


def tables() -> list[list[str]]:
    """The first column of each table of fields, in order."""
    found: list[list[str]] = []
    for line in PAGE.read_text(encoding="utf-8").splitlines():
        if line.startswith("| field "):
            found.append([])
        elif match := re.match(r"\| `(\w+)` \|", line):
            found[-1].append(match[1])
    return found


def test_every_field_of_a_row_is_named_in_its_order(tmp_path: Path) -> None:
    envs = socialai_dsl.make_vec("help+oracle", num_envs=16, copy=False, autoreset_mode="SameStep")
    (tmp_path / "mine.py").write_text(LOSS, encoding="utf-8")
    for guide, left_out in (("script", set()), ("none", {"imitation_loss", "aux_loss", "led", "agreement"})):
        run = tmp_path / guide
        own = {"aux": "mine:Loss", "scenario": str(tmp_path / "x.yaml")} if guide == "script" else {}
        train(RunConfig(frames=512, envs=16, guide=guide, tensorboard=False, **own), envs, run)
        row = json.loads((run / "metrics.jsonl").read_text(encoding="utf-8").splitlines()[-1])
        assert list(row) == [field for field in tables()[0] if field not in left_out]


def test_every_figure_of_an_evaluation_is_named_in_its_order() -> None:
    figures = evaluate(Player("oracle"), "social_env", 20).figures()
    assert list(figures) == tables()[1]


@pytest.mark.parametrize("table", range(2))
def test_every_field_has_a_meaning(table: int) -> None:
    text = PAGE.read_text(encoding="utf-8")
    for field in tables()[table]:
        (line,) = [line for line in text.splitlines() if line.startswith(f"| `{field}` |")][-1:]
        assert len(line.split("|")[3].split()) >= 2, field

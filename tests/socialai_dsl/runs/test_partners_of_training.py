"""Runs in which others sit on some of the seats: they stay as they are, and take turns from game to game."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import pytest

import socialai_dsl as sd
from socialai_dsl.errors import UsageError

LEVERS = "together/levers_together"
OPTIONS: dict[str, Any] = {"envs": 8, "eval_episodes": 8, "threads": 1, "recipe": "plain", "horizon": 32}


@pytest.fixture(scope="module")
def partner(tmp_path_factory: pytest.TempPathFactory) -> sd.Run:
    return sd.train(LEVERS, out=tmp_path_factory.mktemp("runs") / "partner", frames=512, seed=3, **OPTIONS)


def rows(run: sd.Run) -> list[dict[str, Any]]:
    lines = (run.folder / "metrics.jsonl").read_text(encoding="utf-8").splitlines()
    return [
        {name: value for name, value in json.loads(line).items() if name != "frames_per_second"}
        for line in lines
    ]


@pytest.mark.parametrize("own", ["agent", "partner"])
def test_a_run_with_partners_goes_on_as_one_that_never_stopped(
    own: str, partner: sd.Run, tmp_path: Path
) -> None:
    """Also where the folder was moved meanwhile, and the partner's own folder is gone."""
    lent = tmp_path / "lent"
    shutil.copytree(partner.folder, lent)
    other = {"agent": "partner", "partner": "agent"}[own]
    options = {**OPTIONS, "seats": {other: [str(lent), "random", "script"]}}
    whole = sd.train(LEVERS, out=tmp_path / "whole", frames=1024, **options)
    short = sd.train(LEVERS, out=tmp_path / "short", frames=512, **options)
    shutil.rmtree(lent)
    moved = shutil.move(short.folder, tmp_path / "elsewhere")
    again = sd.resume(moved, frames=1024)
    assert rows(again) == rows(whole)
    found = [json.loads((run.folder / "result.json").read_text(encoding="utf-8")) for run in (again, whole)]
    for one in found:
        assert one["seat"] == own
        assert one["partners"] == {other: f"partners/{other}-0-lent.safetensors"}
        assert one["eval"]["with"].keys() == {f"{other}=random", f"{other}=script"}
        one["eval"].pop("seats")
    assert found[0]["eval"] == found[1]["eval"]


def test_what_partners_remember_goes_on_as_in_a_run_that_never_stopped(tmp_path: Path) -> None:
    """To the bit, also where a run stops in the middle of a session, in which they remember earlier episodes."""
    import torch

    from socialai_dsl.trainer import checkpoint as checkpoints

    text = (Path(sd.__file__).parents[1] / "scenarios" / f"{LEVERS}.yaml").read_text(encoding="utf-8")
    text = text.replace(f"scenario: {Path(LEVERS).name}", "scenario: sessions").replace(
        "horizon: 30", "horizon: 9"
    )
    file = tmp_path / "sessions.yaml"
    file.write_text(text + "let: {luck: pick(1 | 2)}\nsession: {episodes: 5, same: luck}\n", encoding="utf-8")
    few = OPTIONS | {"eval_episodes": 5}
    partner = sd.train(file, out=tmp_path / "partner", frames=256, **few)
    options = {**few, "seats": {"partner": [str(partner.folder)]}}
    whole = sd.train(file, out=tmp_path / "whole", frames=1024, **options)
    short = sd.train(file, out=tmp_path / "short", frames=512, **options)
    again = sd.resume(short.folder, frames=1024)
    one, other = (checkpoints.read_agent(run.folder).tensors for run in (whole, again))
    assert one["partners.partner.0.memory"].any()
    assert one.keys() == other.keys()
    assert [name for name in one if not torch.equal(one[name], other[name])] == []


def test_the_partners_stay_as_they_are(partner: sd.Run, tmp_path: Path) -> None:
    """The network of a partner is not that which learns, though it began as the same."""
    run = sd.train(
        LEVERS, out=tmp_path / "run", frames=512, seats={"partner": str(partner.folder)}, **OPTIONS
    )
    from socialai_dsl.trainer import checkpoint as checkpoints

    kept = checkpoints.read_agent(run.folder / "partners" / "partner-0-partner.safetensors")
    assert kept.tensors.keys() == {name for name in kept.tensors if name.startswith("net.")}
    card = (run.folder / "model_card.md").read_text(encoding="utf-8")
    assert "| on the seat partner | `partners/partner-0-partner.safetensors` |" in card
    assert f"socialai-run {LEVERS} --seat partner=partners/partner-0-partner.safetensors --recipe" in card
    original = checkpoints.read_agent(partner.folder).tensors
    assert all((value == original[name]).all() for name, value in kept.tensors.items())


def test_a_pattern_is_all_that_it_matches(partner: sd.Run, tmp_path: Path) -> None:
    """Earlier selves of a run, whose checkpoints lie in its folder."""
    pattern = f"{partner.folder}/checkpoints/*.safetensors"
    run = sd.train(LEVERS, out=tmp_path / "run", frames=256, seats={"partner": pattern}, **OPTIONS)
    names = sorted(file.name for file in (run.folder / "partners").iterdir())
    assert names == [
        "partner-0-partner-0.safetensors",
        "partner-1-partner-512.safetensors",
    ]


@pytest.mark.parametrize(
    ("seats", "words"),
    [
        ({"parnter": "script"}, "got 'parnter', expected one of agent, partner; did you mean 'partner'"),
        ({"partner": "nowhere/at/all"}, "nowhere/at/all"),
        ({"partner": "nowhere/*"}, "matches no file or folder"),
        ({"partner": "human"}, "expected script, random or a trained agent"),
        ({"partner": "script", "agent": "script"}, "expected one seat left"),
        ({"partner": []}, "expected the name of a player, or several"),
        ({"partner": ["nobody"] * 9}, "got 9 players that take turns, expected at most 8"),
        ("script", "expected players by member of the cast"),
    ],
)
def test_partners_that_cannot_be(seats: Any, words: str, tmp_path: Path) -> None:
    with pytest.raises(UsageError) as raised:
        sd.train(LEVERS, out=tmp_path / "run", frames=256, seats=seats, **OPTIONS)
    assert words in str(raised.value)
    assert not (tmp_path / "run").exists(), "the same folder can be named again"

"""One scenario, every kind of mind, the same rooms: one form of result, and one report that joins them by room."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

import socialai_dsl as sd
from socialai_dsl.play.game import FinishedEpisode, Game
from socialai_dsl.play.journal import FILE, Journal
from tests.socialai_dsl.llm.endpoint import endpoint

pytest.importorskip("httpx", reason="language models need the extra llm")
pytest.importorskip("torch", reason="trained agents need the extra train")

EPISODES = 4


def a_person_who_walks_on(
    scenario: str,
    episodes: Callable[[int], tuple[str, dict[str, Any]] | None],
    folder: Path,
    about: Mapping[str, Any],
    briefing: Any,
    view: str,
    practice: bool,
    seats: Any,
    loaded: Any,
) -> list[FinishedEpisode]:
    """In place of the terminal: the same game and journal, without a screen."""
    played: list[FinishedEpisode] = []
    game = Game(scenario, briefing, seats, loaded)
    with Journal(folder / FILE, {**about, **game.briefing.record(), "view": view}) as game.journal:
        for number in range(EPISODES):
            asked = episodes(number)
            assert asked is not None
            game.begin(*asked)
            while game.now.ended is None:
                game.act("forward", None)
            done = game.played()
            assert done is not None
            played.append(done)
    game.close()
    return played


@pytest.fixture(scope="module")
def folders(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Kind of mind -> the folder of its evaluation on Dance."""
    place = tmp_path_factory.mktemp("minds")

    def own(seen: Any) -> Any:
        return np.tile([2, 0, 0, 0], (len(seen["tokens"]), 1))

    with pytest.MonkeyPatch.context() as patch, endpoint(lambda request: "Act: left") as stub:
        patch.setenv("OPENAI_API_KEY", "none")
        patch.setattr("socialai_dsl.play.play", a_person_who_walks_on)
        played = [
            sd.evaluate("oracle", "dance", EPISODES, out=place / "script"),
            sd.evaluate("random", "dance", EPISODES, out=place / "chance"),
            sd.evaluate("shipped", "dance", EPISODES, out=place / "network"),
            sd.evaluate(own, "dance", EPISODES, out=place / "policy"),
            sd.evaluate("llm:stub", "dance", EPISODES, out=place / "model", base_url=stub.url),
            sd.evaluate("human", "dance", EPISODES, out=place / "person"),
        ]
    found = {}
    for one in played:
        assert one.folder is not None
        found[one.player.kind] = one.folder
    return found


def test_every_kind_of_mind_has_one_form_of_result(folders: dict[str, Path]) -> None:
    assert set(folders) == {"script", "chance", "network", "policy", "model", "person"}
    results = {kind: json.loads((folder / "result.json").read_text()) for kind, folder in folders.items()}
    forms = {kind: set(result) - {"told", "language"} for kind, result in results.items()}
    assert len(set(map(frozenset, forms.values()))) == 1, forms
    assert {kind: result["kind"] for kind, result in results.items()} == {kind: kind for kind in folders}
    assert len({result["program_sha256"] for result in results.values()}) == 1
    common = set.intersection(*(set(result["eval"]) for result in results.values()))
    assert {"episodes", "success_rate", "success_interval", "mean_length", "outcomes", "endings"} <= common
    assert {(r["eval"]["episodes"], r["view"]) for r in results.values()} == {(EPISODES, "seat")}
    told = {kind for kind, result in results.items() if result["feedback"] == "outcome"}
    assert told == {"person"}, "a model is told how an episode ended where another one follows"


def test_every_kind_of_mind_lists_films_and_replays_its_episodes(folders: dict[str, Path]) -> None:
    for kind, folder in folders.items():
        rooms = pd.read_csv(folder / "episodes.csv")
        assert rooms.episode.tolist() == list(range(EPISODES)), kind
        assert list(folder.glob("*.gif")), kind
        assert (folder / "episode.html").stat().st_size < 400_000, kind
        if kind == "policy":
            with pytest.raises(ValueError, match="'own' played there, which is not found from here"):
                sd.replay(folder, test_episodes=[1])
        else:
            (trace,) = sd.replay(folder, test_episodes=[1])
            assert len(trace.moments) == rooms.length[1] + 1, kind


def test_who_played_in_a_folder_plays_again(folders: dict[str, Path]) -> None:
    for kind in ("script", "chance", "network"):
        before = json.loads((folders[kind] / "result.json").read_text())
        again = sd.evaluate(folders[kind], episodes=EPISODES)
        assert (again.player.kind, again.figures()) == (kind, before["eval"])
    for kind in ("model", "person"):
        with pytest.raises(ValueError, match="played there, which `socialai replay` shows"):
            sd.evaluate(folders[kind], episodes=EPISODES)


def test_one_report_joins_all_of_them_by_room(folders: dict[str, Path], tmp_path: Path) -> None:
    page = sd.report(list(folders.values()), tmp_path / "report", baselines=False)
    text = page.read_text(encoding="utf-8")
    pairs = pd.read_csv(page.parent / "rooms.csv")
    assert len(pairs) == 6 * 5 / 2, "everybody with everybody"
    assert (pairs.rooms == EPISODES).all()
    for kind in folders:
        assert f">{kind}<" in text


@pytest.mark.parametrize("agent", ["oracle", "random", "human", "llm:stub", "shipped:dance"])
def test_what_a_mind_would_ignore_is_refused_by_name(agent: str) -> None:
    options = {"greedy": True, "style": "json", "view": "room"}
    own = {"human": "view", "llm:stub": "style", "shipped:dance": "greedy"}.get(agent)
    for name in options.keys() - {own}:
        with pytest.raises(ValueError, match=f"{name}: the agent '{agent}' has no use for it"):
            sd.evaluate(agent, "dance", 1, **{name: options[name]})
    with pytest.raises(ValueError, match="greed: got True, but evaluate has no such option"):
        sd.evaluate(agent, "dance", 1, greed=True)

"""Sessions: some draws stay the same for several episodes, whoever plays them and however they are begun."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import socialai_dsl as sd
from socialai_dsl.draws import TEST_DOMAIN, below, draw, episode_key, site
from socialai_dsl.episodes.results import wilson_interval
from socialai_dsl.errors import OptionError
from socialai_dsl.evaluation.summary import summary_rows
from socialai_dsl.frontend import check

BOXES = Path(__file__).parents[2] / "data" / "agreement" / "sessions.yaml"
STRANGER = Path(__file__).parents[3] / "experiments" / "sessions" / "stranger.yaml"
KEPT = ("secret", "mood", "dance")


def lets(env: Any) -> dict[str, Any]:
    found: dict[str, Any] = env.describe()["let"]
    return found


def lets_of(envs: Any, row: int) -> dict[str, Any]:
    found: dict[str, Any] = envs.describe(int(row))["let"]
    return found


def in_threes(found: list[dict[str, Any]]) -> None:
    """What is kept is equal within each three episodes in a row and differs between some; the rest differs within."""
    threes = [found[first : first + 3] for first in range(0, len(found), 3)]
    for name in KEPT:
        assert all(len({str(one[name]) for one in three}) == 1 for three in threes)
        assert len({str(three[0][name]) for three in threes}) > 1
    assert any(len({str(one["other"]) for one in three}) > 1 for three in threes)


def test_test_episodes_in_a_row_share_draws() -> None:
    env = sd.make(str(BOXES)).unwrapped
    found = []
    for number in range(30):
        env.reset(options={"test_episode": number})
        found.append(lets(env))
    in_threes(found)
    for number, one in enumerate(found):
        bits = draw(episode_key(TEST_DOMAIN, 0, number - number % 3), site("let.secret"), 0, 0)
        assert one["secret"] == f"boxes[{below(bits, 3)}]"


def test_episodes_in_a_row_of_an_environment_share_draws() -> None:
    envs = sd.make_vec(str(BOXES), num_envs=3, autoreset_mode="SameStep").unwrapped
    envs.reset(seed=4)
    envs.action_space.seed(0)
    found = [[lets_of(envs, row)] for row in range(3)]
    while min(map(len, found)) < 24:
        _, _, terminated, truncated, _ = envs.step(envs.action_space.sample())
        for row in np.flatnonzero(terminated | truncated):
            found[row].append(lets_of(envs, row))
    for one in found:
        in_threes(one[:24])


def test_rooms_that_are_refused_change_nothing_of_what_is_kept(tmp_path: Path) -> None:
    text = BOXES.read_text(encoding="utf-8")
    path = tmp_path / "sessions.yaml"
    path.write_text(
        text + "require: [agent.distance(ann) > 3, secret.distance(agent) > 1]\n", encoding="utf-8"
    )
    env, picky = sd.make(str(BOXES)).unwrapped, sd.make(str(path)).unwrapped
    for number in range(12):
        for one in (env, picky):
            one.reset(options={"test_episode": number})
        assert [lets(env)[name] for name in KEPT] == [lets(picky)[name] for name in KEPT]


def test_players_remember_a_session_unless_asked_otherwise() -> None:
    class Counts:
        """Counts how often it is told to forget."""

        forgot = 0

        def reset(self, mask: Any, numbers: Any) -> None:
            self.forgot += int(np.sum(mask))

        def act(self, observation: Any) -> Any:
            return np.zeros((len(observation["tokens"]), 4), np.int64)

    found = {}
    for trials in (None, 1, 5):
        player = Counts()
        asked = {} if trials is None else {"trials": trials}
        played = sd.evaluate(player, str(BOXES), 10, **asked)  # type: ignore[arg-type]
        found[trials] = (
            player.forgot,
            played.trials,
            [one["episodes"] for one in played.figures().get("trials", [])],
        )
    assert found == {None: (4, 3, [4, 3, 3]), 1: (10, 1, []), 5: (2, 5, [2] * 5)}


class Asker:
    """Asks the stranger in each step, who shares in all episodes of a session or in none."""

    def act(self, observations: dict[str, Any]) -> Any:
        return np.tile([0, 1, 0, 0], (len(observations["image"]), 1))

    def reset(self, mask: Any = None, numbers: Any = None) -> None:
        """It remembers nothing."""


def test_an_interval_counts_sessions_whose_episodes_are_alike() -> None:
    """Each of a hundred sessions counts once, also for a player that remembers nothing."""
    played = sd.evaluate(Asker(), str(STRANGER), 500)
    won = int(played.result.success.sum())
    assert 0 < won < 500
    assert won % 5 == 0
    assert played.result.success_interval == pytest.approx(wilson_interval(won // 5, 100), abs=0.003)
    figures = played.figures()
    assert figures["session"] == 5
    assert figures["success_rate_se"] == pytest.approx((won / 500 * (1 - won / 500) / 100) ** 0.5, rel=0.03)
    assert figures["trials"][0]["success_interval"] == list(wilson_interval(won // 5, 100))
    assert "over sessions of 5 episodes" in dict(summary_rows(figures))["success"]
    assert replace(played.result, session=1).success_interval == wilson_interval(won, 500)


@pytest.mark.parametrize("episodes", [1, 2, 4])
def test_fewer_episodes_than_a_session_has_are_told_by_the_trials_that_there_were(episodes: int) -> None:
    figures = sd.evaluate("random", str(BOXES), episodes).figures()
    assert [one["episodes"] for one in figures["trials"]] == {1: [1], 2: [1, 1], 4: [2, 1, 1]}[episodes]


def test_rooms_of_a_seed_are_first_episodes_and_therefore_refused() -> None:
    with pytest.raises(
        OptionError, match="got seed:3, but sessions has sessions, which the test set alone has"
    ):
        sd.evaluate("random", str(BOXES), 6, rooms="seed:3")


@pytest.mark.parametrize(
    ("session", "said"),
    [
        ("{episodes: 3, same: [secret, oter]}", "S201 `oter` is not drawn in `let`"),
        ("{episodes: 3, same: nearby}", "S201 `nearby` is not drawn in `let`"),
        ("{episodes: 1, same: secret}", "S106"),
        ("{episodes: 3, same: []}", "S106"),
        ("{episodes: 3}", "S105"),
        ("{same: secret}", "S105"),
    ],
)
def test_mistakes(session: str, said: str, tmp_path: Path) -> None:
    text = BOXES.read_text(encoding="utf-8").replace("{episodes: 3, same: [secret, mood, dance]}", session)
    text = text.replace("let:\n", "let:\n  nearby: nearest(b in boxes to agent)\n")
    (tmp_path / "sessions.yaml").write_text(text, encoding="utf-8")
    found = [f"{one.code} {one.message}" for one in check(tmp_path / "sessions.yaml").diagnostics]
    assert any(line.startswith(said) for line in found), found


@pytest.mark.parametrize(
    ("block", "said"),
    [
        ("episodes: 6", None),
        ("episodes: 6, shuffle: true", "S107 `shuffle` parts the 3 episodes of a session of `sessions`"),
        ("episodes: 7", "S106 7 episodes are no multiple of the 3 episodes of a session of `sessions`"),
    ],
)
def test_a_study_keeps_sessions_together(block: str, said: str | None, tmp_path: Path) -> None:
    (tmp_path / "sessions.yaml").write_text(BOXES.read_text(encoding="utf-8"), encoding="utf-8")
    study = f"study: boxes\nconsent: I agree.\nblocks: [{{scenario: sessions.yaml, {block}}}]\n"
    (tmp_path / "boxes.yaml").write_text(study, encoding="utf-8")
    found = [f"{one.code} {one.message}" for one in check(tmp_path / "boxes.yaml").diagnostics]
    assert found == ([] if said is None else [said])

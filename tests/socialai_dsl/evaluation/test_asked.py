"""Who was asked, and who answered: what the engine says of the rules that fired is found in what was said and heard."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import socialai_dsl as sd
from socialai_dsl.evaluation.asked import asked_in


def answers_by_rules(scenario: str, actions: list[Any], number: int) -> list[tuple[int, str]]:
    """Step and member of each rule that hears something and says something, as the engine explains the episode."""
    env = sd.make(scenario)
    env.reset(options={"test_episode": number})
    found = []
    for t, action in enumerate(actions, start=1):
        env.step(action)
        for rule in env.unwrapped.explain()["fired"]:
            if rule["kind"] == "rule" and "hears: " in rule["words"] and "say: " in rule["words"]:
                found.append((t, rule["who"]))
    env.close()
    return found


@pytest.mark.parametrize("agent", ["oracle", "random", "rival:first_answer"])
def test_who_answers_is_whose_rule_fires(agent: str) -> None:
    evaluation = sd.evaluate(agent, "talkitout", 30)
    answers, utterances = asked_in(evaluation)
    assert sum(map(len, answers)) > (0 if agent == "random" else 60)
    for number, found in enumerate(answers):
        actions = evaluation.actions[number]
        assert [(one.step, one.by) for one in found] == answers_by_rules("talkitout", actions, number)
        assert utterances[number] == sum(int(action[1]) for action in actions)
        assert all(
            one.answer.startswith("I am fine" if "How" in one.said else ("Ask", "Go")) for one in found
        )


def test_who_speaks_anyway_answers_nobody() -> None:
    """In the classic of two informants all is said whatever the player says."""
    answers, utterances = asked_in(sd.evaluate("random", "classics/selective_trust", 20))
    assert sum(utterances) > 50
    assert answers == [[]] * 20


def test_members_of_a_suite_answer_as_they_do_alone() -> None:
    evaluation = sd.evaluate("oracle", "social_env", 40)
    answers, utterances = asked_in(evaluation)
    assert sum(utterances) == sum(int(action[1]) for some in evaluation.actions.values() for action in some)
    assert {"teacher", "wizard", "honest"} <= {one.by for some in answers for one in some}


def test_who_sits_on_a_seat_answers_in_a_later_step() -> None:
    """One says something every third step, the other in the step behind that."""

    def speaks_at(turn: int) -> Any:
        class Speaks:
            t = 0

            def reset(self, mask: Any, episodes: Any = None) -> None:
                self.t = 0

            def act(self, observation: Any) -> Any:
                self.t += 1
                speaks = self.t % 3 == turn
                actions = np.zeros((len(observation["tokens"]), heads), np.int64)
                actions[:, 0], actions[:, 1] = still, speaks
                return actions

        return Speaks()

    scenario = "together/reference_game_together"
    env = sd.make(scenario)
    heads, still = len(env.action_space.nvec), len(env.unwrapped.program.actions)
    env.close()
    evaluation = sd.evaluate(speaks_at(1), scenario, 2, seats={"listener": sd_player(speaks_at(2))})
    answers, _ = asked_in(evaluation)
    assert all(one.by == "listener" and one.step % 3 == 1 for one in answers[0])
    assert len(answers[0]) == sum(int(step[0][1]) for step in evaluation.actions[0][:-1])


def sd_player(policy: Any) -> Any:
    from socialai_dsl.episodes.players import player_of

    return player_of(policy, "")


def test_an_evaluation_lists_answers_beside_episodes(tmp_path: Path) -> None:
    evaluation = sd.evaluate("oracle", "talkitout", 6, out=tmp_path, record=0, trials=3)
    assert evaluation.folder is not None
    with open(evaluation.folder / "asked.csv", newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    answers, utterances = asked_in(evaluation)
    assert [
        (int(row["episode"]), int(row["step"]), row["by"], row["said"], row["answer"]) for row in rows
    ] == [
        (number, one.step, one.by, one.said, one.answer)
        for number, some in enumerate(answers)
        for one in some
    ]
    with open(evaluation.folder / "episodes.csv", newline="", encoding="utf-8") as file:
        assert [int(row["utterances"]) for row in csv.DictReader(file)] == utterances

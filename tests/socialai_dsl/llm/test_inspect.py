"""Scenarios as a task of Inspect AI, offline: a model that knows the script scores what the script scores."""

import gc
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import socialai_dsl as sd
from socialai_dsl.llm import Episode, TextView
from socialai_dsl.llm.episode import scripted_reply

pytest.importorskip("inspect_ai", reason="Inspect AI needs the extra inspect")

from inspect_ai import eval as evaluate
from inspect_ai.model import ModelOutput, ModelUsage, get_model

pytestmark = pytest.mark.filterwarnings("ignore")  # of the libraries


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.chdir(tmp_path)
    yield
    gc.collect()  # Inspect leaves streams open; that is noticed here, where warnings of libraries are ignored


def run(respond: Any, **arguments: Any) -> Any:
    def output(messages: list[Any], *_: Any) -> ModelOutput:
        said = respond(messages)
        content, stop_reason = said if isinstance(said, tuple) else (said, "stop")
        found = ModelOutput.from_content("mockllm/model", content, stop_reason)
        # Without it, the mock would look for a tokenizer on the network.
        found.usage = ModelUsage(input_tokens=10, output_tokens=2, total_tokens=12)
        return found

    model = get_model("mockllm/model", custom_outputs=output)
    (log,) = evaluate(
        "socialai_dsl/scenario", model=model, task_args=arguments, display="none", log_format="json"
    )
    return log


def test_the_task_of_the_entry_point_scores_what_the_script_reaches() -> None:
    playing: dict[str, Episode] = {}
    for number in range(6):
        episode = Episode("talkitout+oracle")
        playing[episode.reset(test_episode=number)] = episode

    def script(messages: list[Any]) -> str:
        episode = playing[messages[1].text]
        reply = scripted_reply(episode)
        episode.step(reply)
        return reply

    log = run(script, scenario="talkitout", episodes=6)
    assert log.status == "success", log.error
    values = {score.name: {m: v.value for m, v in score.metrics.items()} for score in log.results.scores}
    results = [episode.result() for episode in playing.values()]
    assert values["success"]["mean"] == sum(result.success for result in results) / 6
    assert values["steps"]["mean"] == pytest.approx(sum(result.steps for result in results) / 6)
    assert values["return"]["mean"] == pytest.approx(sum(result.total for result in results) / 6)
    assert values["invalid_rate"]["mean"] == 0
    scores = [sample.scores["outcome"] for sample in log.samples]
    assert {score.answer for score in scores} == {result.ending for result in results}
    assert (log.eval.task_version, log.eval.metadata["text"]) == (TextView.version, TextView.version)
    assert log.eval.metadata["program_sha256"] == sd.compile(sd.load("talkitout")).sha256


def test_invalid_replies_and_a_short_history() -> None:
    lengths, first = [], []

    def respond(messages: list[Any]) -> str:
        lengths.append(len(messages))
        first.append(messages[1].text)
        return "hm" if len(lengths) % 2 else "Act: left"

    log = run(respond, scenario="talkitout", episodes=1, history=3)
    (sample,) = log.samples
    assert sample.scores["outcome"].value == {"success": 0, "return": 0.0, "steps": 100, "invalid_rate": 0.5}
    assert max(lengths) == 6
    assert "left out" not in first[2]
    assert first[3].startswith("(1 earlier turn is left out here, ")
    assert first[-1].startswith("(97 earlier turns are left out here, ")
    assert "Your reply was not understood" in sample.messages[3].text


def test_what_the_server_ends_counts_apart() -> None:
    replies = iter([("I see", "max_tokens"), ("", "content_filter"), "hm", ("Act: left", "max_tokens")])
    log = run(
        lambda _: next(replies, ("The prompt is too long.", "model_length")), scenario="talkitout", episodes=1
    )
    (sample,) = log.samples
    found = sample.scores["outcome"].metadata
    assert (found["ending"], found["steps"], found["invalid"], found["stopped"]) == ("context full", 4, 1, 2)


def test_a_history_is_a_number_of_observations() -> None:
    with pytest.raises(Exception, match="history: got 0"):
        run(lambda _: "Act: left", scenario="talkitout", history=0)


def test_a_scenario_that_is_not_there_is_told_of() -> None:
    with pytest.raises(Exception, match="there is no scenario `talkitour`"):
        run(lambda _: "Act: left", scenario="talkitour")


def test_a_seat_beside_others_is_played() -> None:
    log = run(lambda _: "Act: left", scenario="together/help_together", episodes=2, seats={"agent": "script"})
    assert log.status == "success", log.error
    assert (log.eval.metadata["seat"], log.eval.metadata["seats"]) == ("jill", {"agent": "script"})
    assert "You are Jill, one of two players" in log.samples[0].messages[0].text

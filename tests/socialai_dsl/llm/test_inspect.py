"""Scenarios as tasks of Inspect AI, offline: a model that knows the script scores what the script scores."""

import gc
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import socialai_dsl as sd
from socialai_dsl.llm import Episode, TextView
from socialai_dsl.llm.episode import scripted_reply
from tests.socialai_dsl.llm.endpoint import Stub, endpoint

pytest.importorskip("inspect_ai", reason="Inspect AI needs the extra inspect")

from inspect_ai import eval as evaluate
from inspect_ai import eval_retry, eval_set, score
from inspect_ai.log import bundle_log_dir
from inspect_ai.model import ChatMessageAssistant, GenerateConfig, ModelOutput, ModelUsage, get_model
from inspect_ai.tool import ToolCall

from socialai_dsl.llm import inspect_task
from socialai_dsl.llm.inspect_task import outcome

pytestmark = pytest.mark.filterwarnings("ignore")  # of the libraries


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.chdir(tmp_path)
    yield
    gc.collect()  # Inspect leaves streams open; that is noticed here, where warnings of libraries are ignored


def run(respond: Any, task: str = "scenario", **arguments: Any) -> Any:
    def output(messages: list[Any], tools: Any, choice: Any, config: Any) -> ModelOutput:
        said = respond(messages) if respond.__code__.co_argcount == 1 else respond(messages, tools, config)
        content, stop_reason = said if isinstance(said, tuple) else (said, "stop")
        if isinstance(content, list):
            message = ChatMessageAssistant(content="", tool_calls=content)
            found = ModelOutput.from_message(message, "tool_calls")
        else:
            found = ModelOutput.from_content("mockllm/model", content, stop_reason)
        # Without it, the mock would look for a tokenizer on the network.
        found.usage = ModelUsage(input_tokens=10, output_tokens=2, total_tokens=12)
        return found

    model = get_model("mockllm/model", custom_outputs=output)
    (log,) = evaluate(
        f"socialai_dsl/{task}", model=model, task_args=arguments, display="none", log_format="json"
    )
    return log


def metrics(log: Any) -> dict[str, dict[str, float]]:
    return {
        score.name: {name: found.value for name, found in score.metrics.items()}
        for score in log.results.scores
    }


def events(sample: Any) -> list[dict[str, Any]]:
    return [event.data for event in sample.events if event.event == "info"]


def scripts(*scenarios: str, episodes: int) -> tuple[dict[str, Episode], Any]:
    """Episodes by their first observations, and a model that plays their scripts."""
    playing: dict[str, Episode] = {}
    for scenario in scenarios:
        for number in range(episodes):
            episode = Episode(f"{scenario}+oracle")
            playing[episode.reset(test_episode=number)] = episode

    def script(messages: list[Any]) -> str:
        episode = playing[messages[1].text]
        reply = scripted_reply(episode)
        episode.step(reply)
        return reply

    return playing, script


def test_the_task_of_the_entry_point_scores_what_the_script_reaches() -> None:
    playing, script = scripts("talkitout", episodes=6)
    log = run(script, scenario="talkitout", episodes=6, probes="off")
    assert log.status == "success", log.error
    values = metrics(log)
    results = [episode.result() for episode in playing.values()]
    assert values["success"]["mean"] == sum(result.success for result in results) / 6
    assert values["steps"]["mean"] == pytest.approx(sum(result.steps for result in results) / 6)
    assert values["return"]["mean"] == pytest.approx(sum(result.total for result in results) / 6)
    assert values["invalid_rate"]["mean"] == values["stopped_rate"]["mean"] == 0
    assert values["success"]["grouped_talkitout"] == values["success"]["mean"]
    assert values["success"]["socialai_dsl/by_skill_inferring_intent"] == values["success"]["mean"]
    scores = [sample.scores["outcome"] for sample in log.samples]
    assert {score.answer for score in scores} == {
        'success: agent.said("Open sesame") and agent.next_to(exit)'
    }
    assert [score.metadata["episodes"][0]["ending"] for score in scores] == [
        result.ending for result in results
    ]
    assert (log.eval.task_version, log.eval.metadata["text"]) == (TextView.version, TextView.version)
    assert log.eval.metadata["program_sha256"] == sd.compile(sd.load("talkitout")).sha256
    known = {
        key: log.samples[5].metadata[key] for key in ("test_episode", "member", "horizon", "cast", "seat")
    }
    assert known == {
        "test_episode": 5,
        "member": None,
        "horizon": 100,
        "cast": ["agent", "wizard", "honest", "liar"],
        "seat": "agent",
    }
    assert log.samples[5].metadata["skills"] == ["intertwined_multimodality", "inferring_intent"]


def test_a_log_can_be_scored_again_without_a_model() -> None:
    log = run(lambda _: "Act: left", scenario="novel/sally_anne", episodes=2, trials=2)
    again = score(log, outcome(), action="overwrite", display="none")
    assert metrics(again) == metrics(log)
    assert [sample.scores["outcome"].answer for sample in again.samples] == ["out of time; out of time"]
    assert log.eval.scorers[0].options == {}, "nothing but the log is needed"


def test_a_turn_is_an_event_with_action_reward_and_what_was_wrong() -> None:
    _, script = scripts("help", episodes=1)
    first, waits = iter([True]), "Act: none"

    def respond(messages: list[Any]) -> Any:
        return (
            ("I see", "max_tokens")
            if next(first, False)
            else script(messages)
            if len(messages) == 2
            else waits
        )

    log = run(respond, scenario="help", episodes=1, mode="text")
    (sample,) = log.samples
    told = events(sample)
    assert told[0] == {
        "trial": 1,
        "step": 1,
        "action": None,
        "reward": 0.0,
        "error": told[0]["error"],
        "stop": "length",
        "ending": "",
    }
    assert told[1] == {**told[0], "step": 2, "action": waits, "error": "", "stop": ""}
    assert (len(told), told[-1]["ending"]) == (20, "timeout")
    assert sample.scores["outcome"].answer == "out of time"
    assert "The episode is over, without success." in sample.messages[-1].text


def test_invalid_replies_and_a_short_history() -> None:
    lengths, first = [], []

    def respond(messages: list[Any]) -> str:
        lengths.append(len(messages))
        first.append(messages[1].text)
        return "hm" if len(lengths) % 2 else "Act: left"

    log = run(respond, scenario="talkitout", episodes=1, history=3, probes="off")
    (sample,) = log.samples
    assert sample.scores["outcome"].value == {
        **{"success": 0, "return": 0.0, "steps": 100, "invalid_rate": 0.5, "stopped_rate": 0},
    }
    assert max(lengths) == 6
    assert "left out" not in first[2]
    assert first[3].startswith("(1 earlier turn is left out here, ")
    assert first[-1].startswith("(97 earlier turns are left out here, ")
    assert "Your reply was not understood" in sample.messages[3].text


def test_what_the_server_ends_counts_apart() -> None:
    replies = iter([("I see", "max_tokens"), ("", "content_filter"), "hm", ("Act: left", "max_tokens")])
    full = ("The prompt is too long.", "model_length")
    log = run(lambda _: next(replies, full), scenario="talkitout", episodes=1, probes="off")
    (sample,) = log.samples
    (found,) = sample.scores["outcome"].metadata["episodes"]
    assert (found["ending"], found["steps"], found["invalid"], found["stopped"]) == ("context full", 4, 1, 2)
    assert sample.scores["outcome"].answer == "a conversation longer than the model's context"
    assert events(sample)[-1]["stop"] == "context"


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ({"history": 0}, "history: got 0"),
        ({"scenario": "talkitour"}, "there is no scenario `talkitour`"),
        ({"episodes": 0}, "episodes: got 0"),
        ({"episodes": 501}, "episodes: got 501, expected at most the 500 of the test set"),
        ({"episodes": 3, "trials": 2}, "episodes: got 3, expected a multiple of the 2 trials"),
        ({"probes": "on"}, "probes: got 'on', expected one of apart, kept, off"),
        ({"mode": "xml"}, "mode: got 'xml', expected one of text, json, tools"),
        ({"seed": -1}, "seed: got -1"),
    ],
)
def test_an_argument_that_is_none_is_told_before_anything_is_played(
    arguments: dict[str, Any], said: str
) -> None:
    with pytest.raises(Exception, match=said):
        run(lambda _: "Act: left", **arguments)


def test_a_seat_beside_others_is_played() -> None:
    log = run(lambda _: "Act: left", scenario="together/help_together", episodes=2, seats={"agent": "script"})
    assert log.status == "success", log.error
    assert (log.samples[0].metadata["seat"], log.eval.metadata["seats"]) == ("jill", {"agent": "script"})
    assert "You are Jill, one of two players" in log.samples[0].messages[0].text


def test_a_response_schema_holds_replies_to_objects() -> None:
    schemas = []

    def respond(messages: list[Any], _: Any, config: GenerateConfig) -> str:
        assert config.response_schema is not None
        schemas.append(config.response_schema)
        asked = "A question, apart from your turns" in messages[-1].text
        return '{"answer": "yes"}' if asked else '{"move": "left", "say": null}'

    log = run(respond, scenario="talkitout", episodes=1, mode="json")
    schema = schemas[0].json_schema
    assert (schemas[0].name, schemas[0].strict, schema.additionalProperties) == ("action", True, False)
    assert schema.properties["move"].enum[:3] == ["left", "right", "forward"]
    assert "Open sesame" in schema.properties["say"].enum
    assert [
        (one.name, one.json_schema.properties["answer"].enum) for one in schemas[1:] if one.name != "action"
    ] == [("answer", ["no", "yes"])]
    assert metrics(log)["invalid_rate"]["mean"] == 0


def test_tools_are_called_and_answered() -> None:
    calls = iter(range(1000))

    def respond(messages: list[Any], tools: Any, _: Any) -> Any:
        assert [tool.name for tool in tools] == ["move", "say"]
        assert tools[0].parameters.properties["direction"].enum[0] == "left"
        number = next(calls)
        if number == 2:
            return "Act: done"
        wrong = {"direction": "up"} if number else {"direction": "left"}
        return [ToolCall(id=f"c{number}", function="move", arguments=wrong)]

    log = run(respond, scenario="talkitout", episodes=1, mode="tools", probes="off")
    (sample,) = log.samples
    roles = [message.role for message in sample.messages]
    assert roles == ["system", *["user", "assistant", "tool"] * 2, "user", "assistant", "user"]
    assert [message.text for message in sample.messages if message.role == "tool"] == [
        "done",
        "not understood",
    ]
    assert [event["action"] for event in events(sample)] == ["Act: left", None, "Act: done"]


@pytest.mark.parametrize("probes", ["apart", "kept", "off"])
def test_probes_are_asked_and_change_nothing_unless_they_are_kept(probes: str) -> None:
    asked: list[str] = []
    following = Episode("novel/sally_anne", probes=sd.load("novel/sally_anne"))
    following.reset(test_episode=0)

    def respond(messages: list[Any]) -> str:
        asked.append("\n".join(message.text for message in messages))
        if "A question, apart from your turns" not in messages[-1].text:
            following.step("Act: none")
            return "Act: none"
        question = following.question
        assert question is not None
        following.answer(question.right)
        return f"Answer: {question.right if question.probe == 'belief' else 'it is me'}"

    log = run(respond, scenario="novel/sally_anne", episodes=1, probes=probes)
    (sample,) = log.samples
    found, values = [event for event in events(sample) if "probe" in event], metrics(log)
    if probes == "off":
        assert not found
        assert not [name for name in values if name.startswith("probe")]
        return
    assert [event["probe"] for event in found] == ["belief", "reality", "memory"]
    assert (found[0]["given"], found[1]["given"]) == (found[0]["right"], None)
    assert values["probe belief"]["mean"] == values["probe belief"]["grouped_novel/sally_anne"] == 1
    assert (values["probe reality"]["mean"], values["chance belief"]["mean"]) == (0, 0.5)
    assert ("it is me" in asked[-1]) == (probes == "kept")


def test_a_sample_of_several_trials_is_one_conversation() -> None:
    log = run(lambda messages: "Act: left", scenario="dance", episodes=4, trials=2)
    assert [sample.metadata["rooms"] for sample in log.samples] == [
        [{"test_episode": 0}, {"test_episode": 1}],
        [{"test_episode": 2}, {"test_episode": 3}],
    ]
    told = [message.text for message in log.samples[0].messages]
    assert "You play 2 episodes in a row" in told[0]
    (second,) = [text for text in told if "Episode 2 of 2 begins" in text]
    assert "The episode is over" in second.split("Episode 2 of 2 begins")[0]
    assert len(told) == 1 + 2 * 2 * 20 + 1
    assert {name for name in metrics(log) if name.startswith("trial")} == {"trial 1", "trial 2"}


def test_a_sample_is_a_session_of_the_scenario_unless_asked_otherwise() -> None:
    sessions = str(Path(__file__).parents[2] / "data" / "agreement" / "sessions.yaml")
    log = run(lambda messages: "Act: done", "suite", scenarios=["help", sessions], episodes=6)
    assert log.status == "success", log.error
    assert Counter(len(sample.metadata["rooms"]) for sample in log.samples) == {1: 6, 3: 2}
    assert len(run(lambda messages: "Act: done", scenario=sessions, episodes=2, trials=1).samples) == 2
    with pytest.raises(ValueError, match="sessions, which the test set alone has"):
        inspect_task.scenario(sessions, episodes=3, seed=1)
    with pytest.raises(ValueError, match="expected a multiple of the 3 trials"):
        inspect_task.scenario(sessions, episodes=4)


def test_rooms_of_a_seed_are_others_than_those_of_the_test_set() -> None:
    log = run(lambda _: "Act: done", scenario="talkitout", episodes=2, seed=7, probes="off")
    episode = Episode("talkitout")
    assert [sample.input for sample in log.samples] == [episode.reset(seed=7), episode.reset(seed=8)]
    assert [sample.metadata["seed"] for sample in log.samples] == [7, 8]


def test_a_suite_has_figures_of_each_scenario_and_skill() -> None:
    playing, script = scripts("help", "dance", episodes=2)
    log = run(script, "suite", scenarios=["help", "dance"], episodes=2)
    assert log.status == "success", log.error
    assert {sample.id for sample in log.samples} == {"help 0", "help 1", "dance 0", "dance 1"}
    success = metrics(log)["success"]
    results = [episode.result().success for episode in playing.values()]
    assert success["mean"] == sum(results) / 4
    assert success["grouped_help"] == sum(results[:2]) / 2
    assert success["grouped_dance"] == success["socialai_dsl/by_skill_imitation"] == sum(results[2:]) / 2
    assert set(log.eval.metadata["scenarios"]) == {"help", "dance"}


def test_a_member_of_a_suite_is_told_of() -> None:
    log = run(lambda _: "Act: done", scenario="social_env", episodes=4, probes="off")
    members = {sample.metadata["member"]: sample.metadata["horizon"] for sample in log.samples}
    loaded = sd.load("social_env")
    horizons = dict(
        zip(loaded.member_names, (member.checked.horizon for member in loaded.members), strict=True)
    )
    assert members == {member: horizons[member] for member in members}


# -- with a server -----------------------------------------------------------------------------------------------------


@pytest.fixture
def key(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("STUB_API_KEY", "none")


def served(stub: Stub) -> dict[str, Any]:
    """A model behind a stub, and no display."""
    return {"model": "openai-api/stub/m", "model_base_url": stub.url, "display": "none"}


TALK = {"scenario": "talkitout", "probes": "off"}


@pytest.mark.usefixtures("key")
def test_sampling_arguments_reach_the_model() -> None:
    with endpoint(lambda _: "Act: done") as stub:
        arguments = {**TALK, "episodes": 1, "mode": "json"}
        sampling = {"temperature": 0.25, "top_p": 0.5, "max_tokens": 33, "seed": 5}
        (log,) = evaluate("socialai_dsl/scenario", task_args=arguments, **sampling, **served(stub))  # type: ignore[arg-type]
    assert log.status == "success", log.error
    (request,) = stub.requests
    assert {name: request[name] for name in ("temperature", "top_p", "seed")} == {
        **{"temperature": 0.25, "top_p": 0.5, "seed": 5}
    }
    assert 33 in (request.get("max_tokens"), request.get("max_completion_tokens"))
    assert request["response_format"]["json_schema"]["name"] == "action"


@pytest.mark.usefixtures("key")
def test_a_retry_plays_what_is_left() -> None:
    broken = [True]

    def respond(request: dict[str, Any]) -> Any:
        return (
            (400, {}, b'{"error": {"message": "No."}}')
            if broken[0] and len(stub.requests) > 2
            else "Act: done"
        )

    with endpoint(respond) as stub:
        options: dict[str, Any] = {"task_args": {**TALK, "episodes": 4}, "max_samples": 1, **served(stub)}
        (log,) = evaluate("socialai_dsl/scenario", **options)
        assert log.status == "error"
        played = len(stub.requests)
        broken[0] = False
        (log,) = eval_retry(log, display="none")
        assert log.status == "success", log.error
        assert len(stub.requests) == played + 2, "the two samples that were over are not played again"
    assert len(log.samples or ()) == 4


@pytest.mark.usefixtures("key")
def test_a_set_of_scenarios_becomes_a_bundle() -> None:
    with endpoint(lambda _: "Act: done") as stub:
        good, logs = eval_set(
            "socialai_dsl/scenario", "logs", task_args={**TALK, "episodes": 2}, **served(stub)
        )
        assert good
        asked = len(stub.requests)
        good, logs = eval_set(
            "socialai_dsl/scenario", "logs", task_args={**TALK, "episodes": 2}, **served(stub)
        )
        assert len(stub.requests) == asked, "what is done is not played again"
    assert [log.status for log in logs] == ["success"]
    bundle_log_dir("logs", "site")
    assert (Path("site") / "index.html").is_file()

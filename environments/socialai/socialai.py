"""Any scenario of socialai-dsl as tasks of verifiers: each task is a room, and each turn of the conversation a step."""

from collections.abc import Iterator
from contextlib import closing
from typing import Any, Literal

import verifiers.v1 as vf
from openai import APIStatusError, AsyncOpenAI
from verifiers.v1.dialects.chat import message_to_wire
from verifiers.v1.harnesses.utils.compaction import is_context_overflow

from socialai_dsl.llm import Episode


class RoomData(vf.TaskData):
    """A room, and how it is played."""

    scenario: str
    style: Literal["prose", "grid", "json"]
    room: dict[str, int]


class SocialaiConfig(vf.TasksetConfig):
    """Which rooms there are."""

    scenario: str = "talkitout"
    """A path or a name, with +variants and ?parameters."""
    episodes: int = 20
    """How many rooms."""
    seed: int | None = None
    """Of the first room, further ones of those that follow; none: the test set, which belongs to evaluation."""
    style: Literal["prose", "grid", "json"] = "prose"
    """How observations are written."""


class RoomTask(vf.Task[RoomData]):
    """A room."""


class SocialaiTaskset(vf.Taskset[RoomTask, SocialaiConfig]):
    """Rooms of a scenario."""

    def load(self) -> Iterator[RoomTask]:
        """Each room as a task."""
        asked = self.config
        for number in range(asked.episodes):
            room = {"test_episode": number} if asked.seed is None else {"seed": asked.seed + number}
            data = RoomData(
                name=f"{asked.scenario}#{number}",
                prompt=None,
                scenario=asked.scenario,
                style=asked.style,
                room=room,
            )
            yield RoomTask(data, asked.task)


class SocialaiHarness(vf.Harness[vf.HarnessConfig]):
    """The model alone, asked from this process: `null` of verifiers starts a program for each turn."""

    APPENDS_SYSTEM_PROMPT = True
    SUPPORTS_RESUME = True
    EXECUTES_CODE = False
    NEEDS_CONTAINER = False

    async def launch(
        self,
        ctx: vf.ModelContext,
        trace: vf.Trace,
        runtime: vf.Runtime,
        endpoint: str,
        secret: str,
        mcp_urls: dict[str, str],
        data: vf.TaskData,
    ) -> vf.ProgramResult:
        """Ask for one reply; a conversation that has outgrown the model's context ends without one."""
        system, prompt = self.resolve_prompt(data)
        told = [] if system is None else [{"role": "system", "content": system}]
        said = [vf.UserMessage(content=prompt)] if isinstance(prompt, str) else prompt or []
        messages: Any = [*told, *map(message_to_wire, said)]
        async with AsyncOpenAI(base_url=endpoint, api_key=secret) as client:
            try:
                await client.chat.completions.create(model=ctx.model, messages=messages)
            except APIStatusError as error:
                return vf.ProgramResult(0 if is_context_overflow(error) else 1, "", str(error))
        return vf.ProgramResult(0, "", "")


class SocialaiEnvConfig(vf.EnvConfig):
    """Who plays."""

    player: vf.AgentConfig = vf.AgentConfig()


class SocialaiEnv(vf.Env[SocialaiEnvConfig]):
    """The other side of the conversation: what is seen and heard. The reward is the scenario's."""

    async def run(self, task: Any, agents: Any) -> None:
        """Play a room to its end."""
        data = task.data
        with closing(Episode(data.scenario, data.style)) as episode:
            seen = episode.reset(**data.room)
            async with agents.player.interaction(task) as interaction:
                segment = await interaction.turn(f"{episode.instructions}\n\n{seen}")
                while not segment.terminated:
                    turn = episode.step(segment.last_reply)
                    if turn.done:
                        break
                    segment = await interaction.turn(turn.text)
            result = episode.result()
        trace = interaction.trace
        trace.record_reward("scenario_reward", result.total)
        figures = {"success": result.success, "steps": result.steps, "invalid_replies": result.invalid}
        trace.record_metrics({name: float(value) for name, value in figures.items()})


__all__ = ["SocialaiConfig", "SocialaiEnv", "SocialaiEnvConfig", "SocialaiHarness", "SocialaiTaskset"]

"""Language models on seats of a study: what they are shown and answer, and how long anybody waits for them."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Container, Iterable, Mapping, Sequence
from dataclasses import asdict, fields, replace
from typing import Any

import httpx
import numpy as np
from numpy.typing import NDArray

from socialai_dsl.episodes.play import Observer, Rooms, Seat, Step
from socialai_dsl.llm.actions import Action as Words
from socialai_dsl.llm.asked import budget_of, endpoint_of
from socialai_dsl.llm.endpoint import Answer, ContextFull, EndpointError, Usage
from socialai_dsl.llm.episode import CUT_SHORT, Decision, TextSeat
from socialai_dsl.llm.players import Conversation
from socialai_dsl.llm.prompting import PromptOptions
from socialai_dsl.model_options import ModelOptions
from socialai_dsl.study.arena import Action, Arena

Record = dict[str, Any]
"""What the log has of a reply."""

_KEPT_ELSEWHERE = ("observation", "session", "time")


class ModelFailed(Exception):  # noqa: N818 - it says what happened
    """A model does not answer, or not with an action; the message says why."""


class Endpoints:
    """Where the models of a study are asked.

    Args:
        named: `llm:MODEL` of each.
        options: how they are asked.

    Raises:
        UsageError: an option is not what was expected, or there is no key.
    """

    def __init__(self, named: Iterable[str], options: ModelOptions) -> None:
        self._endpoints = {who: endpoint_of(who, options) for who in named}
        self._clients: dict[str, httpx.AsyncClient] = {}
        prices = next((one.prices for one in self._endpoints.values()), None)
        self._budget, self._spent = budget_of(options.budget, prices), Usage()
        self._answered: set[str] = set()
        asked: dict[str, Any] = {
            one.name: getattr(options, one.name) for one in fields(PromptOptions) if one.name != "trials"
        }
        self.prompting = PromptOptions(**asked)

    async def ask(self, who: str, conversation: Conversation) -> Answer:
        """The answer of a model; also that the conversation has outgrown its context.

        Raises:
            ModelFailed: there is none.
        """
        if self._budget.is_spent(self._spent):
            raise ModelFailed("the budget is spent")
        endpoint = self._endpoints[who]
        try:
            if who not in self._clients:
                self._clients[who] = endpoint.client()
            messages, more = conversation.messages(), conversation.constraints()
            answer = await endpoint.ask(self._clients[who], messages, more, who in self._answered)
        except ContextFull:
            return Answer("", stop="context")
        except EndpointError as error:
            raise ModelFailed(str(error)) from None
        self._answered.add(who)
        self._spent += answer.usage
        return answer

    @property
    def spent(self) -> dict[str, Any]:
        """What all answers took, failed ones too, as the log has it."""
        return asdict(self._spent)

    def spent_before(self, spent: Mapping[str, Any]) -> None:
        """Take it that so much was spent before, as the log says, so that a budget outlives the server."""
        before = Usage(**spent)
        if before.tokens > self._spent.tokens:
            self._spent = before

    async def close(self) -> None:
        """Let the connections go."""
        for client in self._clients.values():
            await client.aclose()


class ModelSeat(Observer):
    """A seat that a model has in a session, or may take over: then it is shown all that came before.

    Args:
        arena: what is played. seat: which one. who: `llm:MODEL`. endpoints: where it is asked.
        session: how many episodes it remembers at most.
    """

    def __init__(self, arena: Arena, seat: Seat, who: str, endpoints: Endpoints, session: int) -> None:
        self._arena, self._seat, self._who, self._endpoints = arena, seat, who, endpoints
        self._prompting = replace(endpoints.prompting, trials=session)
        self._text = TextSeat(
            arena.program,
            **self._prompting.of_episodes,
            briefing=arena.briefing,
            seat=seat,
            loaded=arena.loaded,
        )
        self._rooms: Rooms
        self._conversation: Conversation
        self._before: Conversation | None = None
        self._trial = 0
        self._decision: Decision | None = None

    def began(self, rooms: Rooms, begun: NDArray[np.bool_]) -> None:
        """See `Observer.began`."""
        self._rooms, self._decision = rooms, None
        begins = self._text.begin(rooms)
        self._conversation = Conversation(
            self._text, self._prompting, self._trial, None, begins, self._before
        )
        self._before = self._conversation
        self._trial += 1

    async def act(self) -> tuple[list[Record], Action]:
        """What the model answers, and what it does in the next step.

        Raises:
            ModelFailed: it does not answer, or ends its part in the episode.
        """
        records: list[Record] = []
        while True:
            answer = await self._endpoints.ask(self._who, self._conversation)
            records.append(
                {k: v for k, v in self._conversation.record(answer).items() if k not in _KEPT_ELSEWHERE}
            )
            if self._took(records[-1:]):
                assert self._decision is not None, "internal: it has just been made"
                assert self._decision.action is not None, "internal: it is one"
                return records, self._rooms.encoded(self._decision.action).tolist()

    def again(self, records: Sequence[Record]) -> None:
        """Take it that the model gave these answers, before the step that followed is played again."""
        self._took(records)

    def passed(self) -> None:
        """Take it that somebody else chooses in the next step, whatever was answered."""
        self._decision = None

    def _took(self, records: Sequence[Record]) -> bool:
        """Whether answers end with an action."""
        for record in records:
            decision = self._conversation.take(record)
            if ending := self._text.result().ending:
                raise ModelFailed(CUT_SHORT[ending])
            self._decision = decision if decision is not None and decision.action is not None else None
        return self._decision is not None

    def stepped(self, rooms: Rooms, step: Step) -> None:
        """See `Observer.stepped`."""
        if self._seat not in step.actions or self._text.result().ending:
            return  # it is out of this episode
        decision = self._decision
        if decision is None:
            done = Words(*self._arena.words(step.actions[self._seat][0].tolist()))
            self._conversation.did(done)
            decision = Decision(done)
        self._conversation.saw(self._text.saw(rooms, decision, step))
        self._decision = None


class Thinking:
    """The models of a game that goes on: who is asked, has answered, or is out to the end of the episode.

    Args:
        seats: the models by seat.
        limit: seconds that people wait for one.

    Attributes:
        ready: of each seat that has answered its answers, and what it does in the next step.
        out: of each seat that has failed why.
    """

    def __init__(self, seats: Mapping[Seat, ModelSeat], limit: float) -> None:
        self.seats, self._limit = seats, limit
        self.ready: dict[Seat, tuple[list[Record], Action]] = {}
        self.out: dict[Seat, str] = {}
        self._asked: dict[Seat, float] = {}
        self._tasks: set[asyncio.Task[None]] = set()

    def begin(self) -> None:
        """Take it that an episode begins: those who were out may play again."""
        self.stop()
        self.out.clear()

    def again(self, replies: Mapping[Seat, Sequence[Record]], missed: Mapping[Seat, str]) -> None:
        """Take it that models gave these answers before a step that is played again, and that these were out."""
        self.out |= missed
        for seat, records in replies.items():
            self.seats[seat].again(records)

    def ask(self, seat: Seat, now: float, then: Callable[[], Awaitable[None]]) -> None:
        """Ask a model what it does in the next step, once.

        Args:
            seat: whose.
            now: the present time.
            then: what is to happen when it has answered, or failed.
        """
        if seat in self._asked:
            return
        self._asked[seat] = now

        async def think() -> None:
            try:
                self.ready[seat] = await self.seats[seat].act()
            except ModelFailed as failed:
                self.out[seat] = str(failed)
            self._tasks.discard(task)  # so that what follows, which may play the step, does not end it
            await then()

        task = asyncio.get_running_loop().create_task(think())
        self._tasks.add(task)

    def give_up(self, now: float, since: float) -> bool:
        """Do without those who have not answered in time; whether there are such.

        Args:
            now: the present time.
            since: when people began to wait.
        """
        late = [
            seat
            for seat, asked in self._asked.items()
            if seat not in self.ready and seat not in self.out and now - max(asked, since) >= self._limit
        ]
        self.out |= dict.fromkeys(late, f"no answer within {self._limit:g} s")
        return bool(late)

    def step(self, acting: Container[Seat]) -> None:
        """Ask nobody any more about the step that is played now, in which these have chosen."""
        for seat, model in self.seats.items():
            if seat not in acting:
                model.passed()
        self.stop()

    def stop(self) -> None:
        """Ask nobody any more."""
        for task in self._tasks:
            task.cancel()
        self._tasks.clear()
        self._asked.clear()
        self.ready.clear()

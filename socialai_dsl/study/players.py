"""Who plays in a study besides people: trained agents and language models, which are there before they are needed."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Mapping
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from socialai_dsl.checking.loaded import session_of
from socialai_dsl.checking.studies import (
    PRACTICE,
    LoadedStudy,
    asked_by,
    is_model,
    is_trained,
    models_of,
    players_of,
)
from socialai_dsl.episodes.play import Seat
from socialai_dsl.errors import UsageError
from socialai_dsl.study.arena import Arena, Episode
from socialai_dsl.trainer.shipped import PREFIX

if TYPE_CHECKING:  # it needs httpx, which is only there if language models were asked for
    from socialai_dsl.study.models import Endpoints, Thinking


class Players:
    """The agents and models of a study.

    Args:
        loaded: the study. arenas: what is played, by the number of the block.

    Raises:
        UsageError: one cannot sit where it is to, or what it needs is not installed.
    """

    def __init__(self, loaded: LoadedStudy, arenas: Mapping[int, Arena]) -> None:
        self._loaded, self._study, self._arenas = loaded, loaded.study, arenas
        self._policies: defaultdict[tuple[int, Seat], list[Any]] = defaultdict(list)
        self._check()
        self._endpoints = self._asked_models()

    def _check(self) -> None:
        """See that the trained agents that are named can sit where they are to. Raises UsageError."""
        for number in range(len(self._study.blocks)):
            env = self._arenas[number].take()
            try:
                for seat, make in self.agents(number, env).items():
                    self._policies[number, seat].append(make())
            except ValueError as error:
                raise UsageError(f"block {number + 1}: {error}") from None
            self._arenas[number].give(env)

    def _others(self, block: int) -> dict[Seat, str]:
        """Who may choose the acts of seats in a block besides people."""
        return {} if block == PRACTICE else players_of(self._study.blocks[block])

    def agents(self, block: int, env: Any) -> dict[Seat, Callable[[], Any]]:
        """What makes the trained agents that may play in a block; one that is free is taken again."""

        def make(seat: Seat, who: str) -> Any:
            free = self._policies[block, seat]
            return free.pop() if free else agent_of(who, self._loaded.folder, env)

        trained = {seat: who for seat, who in self._others(block).items() if is_trained(who)}
        return {seat: partial(make, seat, who) for seat, who in trained.items()}

    def _asked_models(self) -> Endpoints | None:
        """Where the language models of the study are asked; None if it has none. Raises UsageError."""
        named = models_of(self._study)
        if not named:
            return None
        require_models()
        from socialai_dsl.study.models import Endpoints

        return Endpoints(named, asked_by(self._study, self._loaded.folder))

    def thinking(self, block: int) -> Thinking | None:
        """The language models that may play in a game of a block; None if there are none."""
        models = {seat: who for seat, who in self._others(block).items() if is_model(who)}
        if not models or self._endpoints is None:
            return None
        from socialai_dsl.study.models import ModelSeat, Thinking

        arena, endpoints = self._arenas[block], self._endpoints
        session = session_of(self._loaded.played[block])
        seats = {seat: ModelSeat(arena, seat, who, endpoints, session) for seat, who in models.items()}
        return Thinking(seats, self._study.blocks[block].act_within)

    @property
    def spent(self) -> dict[str, Any] | None:
        """What the language models have taken so far; None if there are none."""
        return None if self._endpoints is None else self._endpoints.spent

    def spent_before(self, spent: Mapping[str, Any]) -> None:
        """Take it that the language models have taken so much before."""
        if self._endpoints is not None:
            self._endpoints.spent_before(spent)

    def give(self, block: int, episode: Episode) -> None:
        """Take back the agents that have played in a session of a block."""
        for seat, policy in episode.acting.items():
            self._policies[block, seat].append(policy)

    async def close(self) -> None:
        """Let the connections to models go."""
        if self._endpoints is not None:
            await self._endpoints.close()


def require_models() -> None:
    """Say how to install what language models need if it is missing. Raises UsageError."""
    if find_spec("httpx") is None:
        raise UsageError("language models need httpx: pip install 'socialai-dsl[llm]'")


def agent_of(who: str, folder: Path, env: Any) -> Any:
    """The policy of a trained agent.

    Args:
        who: `shipped:NAME`, or the path of a checkpoint or a run's folder, relative to the folder of the study's file.
        folder: see above.
        env: what it is to play.

    Raises:
        UsageError: the trainer is not installed, or somebody else played in the folder.
        ValueError: the agent does not fit.
    """
    from socialai_dsl.episodes.players import Player, make_policy, played_again, require_trainer

    require_trainer()
    player = Player(played_again(who if who.startswith(PREFIX) else str(folder / who)))
    if not player.is_trained:
        raise UsageError(f"{who}: {player.agent!r} played there, expected a trained agent")
    return make_policy(player, env)[0]

"""A study to take part in, a clock that stands still, and a participant who looks at screens."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from socialai_dsl.checking.studies import LoadedStudy
from socialai_dsl.frontend import load_study
from socialai_dsl.study.live import Live
from socialai_dsl.study.messages import Screen
from socialai_dsl.study.pages import Page

ALONE = """\
study: alone
consent: "I agree. <b>Tags</b> are *words*."
instructions: [Walk.]
blocks:
- {name: one, scenario: talkitout_no_liar, episodes: 2}
questions:
- {id: how, ask: How was it?}
- {id: hard, ask: How hard?, kind: scale, from: 1, to: 5}
- {id: what, ask: What?, kind: choice, options: [this, that], optional: true}
pay: {base: 1, bonus: 0.5}
end: {code: DONE}
"""

TOGETHER = """\
study: together
consent: I agree.
blocks:
- scenario: together/help_together
  episodes: 2
  seats: {agent: person, jill: person}
  wait: 30
  away: 5
  act_within: 20
"""


@cache
def loaded_study(text: str, folder: Path) -> LoadedStudy:
    file = folder / "study.yaml"
    file.write_text(text, encoding="utf-8")
    return load_study(file)


class Clock:
    """Seconds that pass when they are told to."""

    def __init__(self) -> None:
        self.now = 1000.0

    def __call__(self) -> float:
        return self.now


class Taking:
    """A participant with an open page."""

    def __init__(self, live: Live, person: str) -> None:
        self.live, self.person = live, person
        self.screens: list[Screen] = []
        self.closed: list[int] = []
        self.page: Page | None = None

    async def come(self) -> Taking:
        self.page = await self.live.come(
            self.person, self.screens.append, lambda code, why: self.closed.append(code)
        )
        return self

    @property
    def now(self) -> Screen:
        return self.screens[-1]

    async def send(self, **message: Any) -> Screen:
        import json

        assert self.page is not None
        await self.live.hear(self.page, json.dumps({"on": self.now["on"], **message}))
        return self.now

    async def go(self) -> Screen:
        return await self.send(do="go")

    async def act(self, movement: str | None = None, said: str | None = None, **more: Any) -> Screen:
        return await self.send(do="act", movement=movement, said=said, shown=1.0, acted=2.5, **more)

    async def beat(self) -> None:
        assert self.page is not None
        await self.live.hear(self.page, '{"do":"beat"}')


async def newcomer(live: Live) -> Taking:
    return await Taking(live, await live.join()).come()


async def meet(live: Live) -> dict[str, Taking]:
    """Two who play together, by seat."""
    people = [await newcomer(live) for _ in range(2)]
    for one in people:
        await one.go()
    await live.tick()
    (game,) = live.progress.games.values()
    return {seat: next(one for one in people if one.person == who) for seat, who in game.seats.items()}


async def pass_time(live: Live, clock: Clock, seconds: int, *there: Taking) -> None:
    for _ in range(seconds):
        clock.now += 1
        for one in there:
            await one.beat()
        await live.tick()


async def until(one: Taking, kind: str) -> Screen:
    """Go on to a screen of this kind, without playing."""
    while one.now["do"] != kind:
        await one.go()
    return one.now


def run(made: Callable[[], Coroutine[Any, Any, Any]]) -> Any:
    return asyncio.run(made())


@pytest.fixture(scope="session")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("studies")

"""A study that goes on: what pages ask for becomes events, which are stored, and then what is shown."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from contextlib import suppress
from pathlib import Path
from typing import Final

from socialai_dsl.checking.studies import PRACTICE, LoadedStudy, persons_of
from socialai_dsl.schema.study import Question
from socialai_dsl.study.arena import Arena
from socialai_dsl.study.games import Games
from socialai_dsl.study.journal import Journal
from socialai_dsl.study.messages import Act, Answers, Beat, Decline, Go, Screen, parsed
from socialai_dsl.study.pages import Page
from socialai_dsl.study.players import Players
from socialai_dsl.study.progress import Participant, Progress
from socialai_dsl.study.replay import tell_of
from socialai_dsl.study.screens import Screens

_DROPPED: Final = 3600
"""Seconds without a sign of somebody who has not come to the end, after which another one may take part instead."""
TAKEN: Final = 4409
FAST: Final = 4429
"""Codes with which the connection of a page is closed: a newer page is open, or it sends too much."""


class Live:
    """A study with all its participants.

    Args:
        loaded: the study. folder: holds its log and everything else that is stored; it is there.
        clock: seconds that never go back.
        simulated: whether those who take part are simulated, which the log says.

    Attributes:
        arenas: what is played, by the number of the block.
        pages: id of a participant -> the page that is open.

    Raises:
        OSError: the folder cannot be written.
        UsageError: it holds another study, or this one as it was before a scenario or the file was changed.
    """

    def __init__(
        self,
        loaded: LoadedStudy,
        folder: Path,
        clock: Callable[[], float] = time.monotonic,
        simulated: bool = False,
    ) -> None:
        self._study, self._clock = loaded.study, clock
        self.arenas = {
            number: Arena(one, tell_of(loaded, number), loaded.study.language)
            for number, one in loaded.played.items()
        }
        self.pages: dict[str, Page] = {}
        self._waiting: dict[int, dict[str, float]] = {}
        self._began = clock()
        self._left: dict[str, float] = {}  # when a page was closed that this server had
        self._players = Players(loaded, self.arenas)
        self._journal = Journal(loaded, folder, self.arenas, simulated)
        self._players.spent_before(self._journal.spent)
        self._games = Games(
            loaded, self.arenas, self._players, self._journal, self._show, self.pages, self.is_there, clock
        )
        self._screens = Screens(loaded, self.arenas, self._journal, self._games, self.full, self._waited)
        self._games.resume()

    @property
    def progress(self) -> Progress:
        """Where everybody is."""
        return self._journal.progress

    # -- what is shown ----------------------------------------------------------------------------------------

    async def _show(self, people: Iterable[str]) -> None:
        """Show people where they are once everything that led there is stored."""
        pages = [self.pages[person] for person in dict.fromkeys(people) if person in self.pages]
        screens = [(page, page.will_show(self._screens.screen(page))) for page in pages]
        try:
            await self._journal.flushed()
        except OSError:
            self._forget()
            for page in tuple(self.pages.values()):
                page.show_at_once({**self._screens.screen(page), "notice": "disk"})
            return
        for page, due in screens:
            page.show(due)

    def _waited(self, person: str, block: int) -> float:
        """Seconds that a participant has waited for others in the room before a block."""
        now = self._clock()
        return now - self._waiting.get(block, {}).get(person, now)

    def _forget(self) -> None:
        """Be where the disk says, after something could not be stored."""
        self._games.forget()
        self._waiting.clear()
        self._journal.read()
        for page in self.pages.values():
            page.knows = None
        self._games.resume()
        for person in self.progress.people.values():
            self._enter(person)

    async def close(self) -> None:
        """Store what is left, and let the log go."""
        self._games.stop()
        await self._players.close()
        with suppress(OSError):
            await self._journal.flushed()
        self._journal.close()

    # -- who comes and goes -----------------------------------------------------------------------------------

    async def join(self) -> str:
        """A new participant, by id.

        Raises:
            OSError: that cannot be stored.
        """
        number = len(self.progress.people) + 1
        person = f"p{number:04d}"
        self._journal.do("joined", participant=person, number=number)
        try:
            await self._journal.flushed()
        except OSError:
            self._forget()
            raise
        return person

    def agree(self, person: str, at: str, simulated: bool) -> bool:
        """Take it that a participant has agreed on a page of somebody else; whether they take part.

        Args:
            person: who it is; whoever was asked before is not asked again.
            at: the origin of that page.
            simulated: whether it says that nobody sits there.
        """
        one = self.progress.people[person]
        if self.progress.stage(one)[0] == "consent":
            if self.full():
                return False
            group = self.progress.next_group(self._dropped())
            self._journal.do("agreed", participant=person, group=group, at=at, simulated=simulated)
        return True

    async def come(
        self,
        person: str,
        send: Callable[[Screen], None],
        leave: Callable[[int, str], None],
        elsewhere: bool = False,
    ) -> Page:
        """Let a participant's page take part; one that was open before is closed."""
        former = self.pages.get(person)
        if former is not None:
            former.leave(TAKEN, "")
        connection = self.progress.people[person].connections + 1
        page = self.pages[person] = Page(person, send, leave, connection, self._clock(), elsewhere=elsewhere)
        self._journal.do("came", participant=person, connection=connection)
        self._enter(self.progress.people[person])
        await self._show([person])
        return page

    def go(self, page: Page) -> None:
        """Let a page go, which was closed."""
        if self.pages.get(page.person) is page:
            del self.pages[page.person]
            self._left[page.person] = self._clock()
            self._journal.do("left", participant=page.person, connection=page.connection)

    def full(self) -> bool:
        """Whether nobody else can take part, unless somebody drops out."""
        return self.progress.full(self._dropped())

    def _dropped(self) -> set[str]:
        """Those who have not come to the end, and whose page has not been heard for an hour."""
        return {
            person.id
            for person in self.progress.people.values()
            if person.ended is None and not self._heard_lately(person.id)
        }

    def _heard_lately(self, person: str) -> bool:
        page = self.pages.get(person)
        heard = page.sign if page is not None else self._left.get(person, self._began)
        return self._clock() - heard < _DROPPED

    def is_there(self, person: str, away: float) -> bool:
        """Whether a participant has an open page that was heard in the last so many seconds."""
        page = self.pages.get(person)
        if page is None:
            return self._clock() - self._began < away  # after a new start pages come back by themselves
        return self._clock() - page.sign < away

    # -- what pages ask for -----------------------------------------------------------------------------------

    async def hear(self, page: Page, content: str | bytes) -> None:
        """Take a message of a page."""
        if self.pages.get(page.person) is not page:
            return
        if not page.may_speak(self._clock()):
            page.leave(FAST, "")
            return
        message = parsed(content)
        person = self.progress.people[page.person]
        if isinstance(message, Beat):
            if page.on != self._screens.on(person):  # others went on while it was not heard
                await self._show([person.id])
            return
        others: Iterable[str] = ()
        if message is not None and message.on == self._screens.on(person):
            others = self._taken(person, page, message)
        await self._show([person.id, *others])

    def _taken(self, person: Participant, page: Page, message: Go | Decline | Act | Answers) -> Iterable[str]:
        """Do what a message asks for if the screen has it; who else sees something new."""
        stage, _ = self.progress.stage(person)
        match message, stage:
            case Go(), "consent" if not self.full():
                self._journal.do(
                    "agreed", participant=person.id, group=self.progress.next_group(self._dropped())
                )
                self._enter(person)
            case Decline(), "consent":
                self._journal.do("declined", participant=person.id)
            case Go(), "page":
                self._journal.do("read", participant=person.id)
                self._enter(person)
            case Answers(), "asked":
                answers = self._answered(person, message)
                if answers is not None:
                    self._journal.do("answered", participant=person.id, answers=answers)
                    self._enter(person)
            case Act(), "play" if person.game is not None:
                return self._games.act(person, page.connection, message)
            case Go(), "play" if person.game is not None:
                others = self._games.ready(person)
                self._enter(person)
                return others
        return ()

    def _answered(self, person: Participant, message: Answers) -> dict[str, str | int] | None:
        """Answers that fit the questions; None if some do not."""
        asked = {question.id: question for question in self.progress.questions(person)}
        if set(message.answers) - set(asked):
            return None
        for name, question in asked.items():
            answer = message.answers.get(name)
            if answer is None or answer == "":
                if not question.optional:
                    return None
            elif not _fits(question, answer):
                return None
        return {name: answer for name, answer in message.answers.items() if answer != ""}

    # -- who plays with whom ----------------------------------------------------------------------------------

    def _enter(self, person: Participant) -> None:
        """Let a participant begin what comes now: a game for one begins at once, for several they wait."""
        stage, block = self.progress.stage(person)
        if stage != "play" or person.game is not None:
            return
        if block == PRACTICE or len(persons_of(self._study.blocks[block])) == 1:
            self._games.begin(block, [person.id])
        elif person.id in self.pages:
            self._waiting.setdefault(block, {}).setdefault(person.id, self._clock())

    async def tick(self) -> None:
        """Do what time asks for: match those who wait, let others stand in for those who have left or are late."""
        told: list[str] = []
        for block, waiting in self._waiting.items():
            told += self._match(block, waiting)
        told += self._games.watch()
        if told:
            await self._show(told)

    def _match(self, block: int, waiting: dict[str, float]) -> list[str]:
        study, now = self._study.blocks[block], self._clock()
        for person in [one for one in waiting if one not in self.pages]:
            del waiting[person]  # whoever comes back waits anew
        there = [person for person in waiting if self.is_there(person, study.away)]
        told: list[str] = []
        count = len(persons_of(study))
        while there:
            people, there = there[:count], there[count:]
            if len(people) < count and now - waiting[people[0]] < study.wait:
                break
            for person in people:
                del waiting[person]
            self._games.begin(block, people)
            told += people
        return told


def _fits(question: Question, answer: str | int) -> bool:
    match question.kind:
        case "text":
            return isinstance(answer, str)
        case "choice":
            return answer in (question.options or ())
    assert question.start is not None, "internal: scales have been checked"
    assert question.to is not None, "internal: scales have been checked"
    return isinstance(answer, int) and question.start <= answer <= question.to

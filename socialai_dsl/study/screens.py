"""What the pages of a study show: of a room what the seat observes, and nothing else."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final

from markdown_it import MarkdownIt

from socialai_dsl.checking.studies import PRACTICE, LoadedStudy
from socialai_dsl.schema.study import PERSON
from socialai_dsl.study.arena import Arena
from socialai_dsl.study.games import Games, Running
from socialai_dsl.study.journal import Journal
from socialai_dsl.study.messages import Screen
from socialai_dsl.study.pages import Page
from socialai_dsl.study.progress import Game, Participant, Progress, done_on
from socialai_dsl.study.replay import Row

MOST_LINES: Final = 200
"""How many of the last lines that were heard a page shows."""


class Screens:
    """What participants see.

    Args:
        loaded: the study. arenas: what is played, by the number of the block.
        journal: where everybody is. games: what is played now.
        full: whether nobody else can take part.
        waited: seconds that a participant has waited for others in the room before a block.
    """

    def __init__(
        self,
        loaded: LoadedStudy,
        arenas: Mapping[int, Arena],
        journal: Journal,
        games: Games,
        full: Callable[[], bool],
        waited: Callable[[str, int], float],
    ) -> None:
        self._full, self._waited = full, waited
        self._loaded, self._study = loaded, loaded.study
        self._arenas, self._journal, self._games = arenas, journal, games
        self._markdown = MarkdownIt("commonmark", {"html": False, "breaks": False})
        # By their addresses in HTML, in which blanks and letters such as ä are escaped.
        self._pictures = {
            self._markdown.normalizeLink(name): number for number, name in enumerate(loaded.pictures)
        }

    @property
    def _progress(self) -> Progress:
        return self._journal.progress

    def on(self, person: Participant) -> str:
        """The name of the screen that a participant is at."""
        game = self._progress.games.get(person.game or "")
        if game is None or game.episode is None:
            return f"{person.stage}.{person.rounds}"
        if game.episode.ended is not None:
            return f"{game.id}.{game.episode.number}.end"
        return f"{game.id}.{game.episode.number}.{len(game.episode.steps)}"

    def screen(self, page: Page) -> Screen:
        """What a participant's page shows now: of a room what the seat observes, and nothing else."""
        person = self._progress.people[page.person]
        stage, number = self._progress.stage(person)
        if person.game is not None:
            self._games.of(self._progress.games[person.game])  # which may find that an episode has ended
        on = {"on": self.on(person)}
        match stage:
            case "consent":
                return {
                    "do": "consent",
                    **on,
                    "html": self._html(self._loaded.consent),
                    "full": self._full(),
                }
            case "page":
                pages = self._loaded.instructions
                return {
                    "do": "page",
                    **on,
                    "html": self._html(pages[number]),
                    "number": number + 1,
                    "of": len(pages),
                }
            case "asked":
                asked = [question.model_dump(by_alias=True) for question in self._progress.questions(person)]
                return {"do": "asked", **on, "questions": asked}
            case "play" if person.game is not None:
                return self._play_screen(person, page) | on
            case "play":
                seconds = max(0, round(self._study.blocks[number].wait - self._waited(person.id, number)))
                return {"do": "room", **on, "seconds": seconds}
        return {"do": "end", **on, **self._end_screen(person)}

    def _end_screen(self, person: Participant) -> Screen:
        if person.declined:
            return {"declined": True}
        end, pay = self._study.end, self._study.pay
        paid = None
        if pay is not None:
            paid = {"sum": f"{pay.base + self._progress.bonus(person):.2f}", "currency": pay.currency}
        say = "" if end.say is None else self._html(end.say)
        return {"declined": False, "code": end.code, "html": say, "link": end.link, "paid": paid}

    def _play_screen(self, person: Participant, page: Page) -> Screen:
        game = self._progress.games[person.game or ""]
        running = self._games.of(game)
        episode, played = running.episode, game.episode
        assert played is not None, "internal: a game begins with an episode"
        seat = self._progress.seat_of(game, person.id)
        practice = game.block == PRACTICE
        block = None if practice else self._study.blocks[game.block]
        ended = episode.ending is not None
        seen = episode.picture(seat)
        if block is not None and block.view == "picture":
            del seen["seen"]
        elif block is not None and block.view == "words":
            del seen["view"]
        if ended and block is not None and block.feedback == "none":
            seen.pop("seen", None)  # whose last line says how it ended
        found: Screen = {
            "do": "play",
            "practice": practice,
            "episode": played.number + 1,
            "episodes": self._progress.episodes(game),
            "t": episode.t,
            "told": episode.told(seat),
            "heard": episode.heard[seat][-MOST_LINES:],
            "waiting": seat in running.chosen or person.id in running.ready,
            **seen,
        }
        if ended:
            assert episode.ending is not None, "internal: the episode has ended"
            told = practice or (block is not None and block.feedback == "outcome")
            found |= {"ended": True, "success": episode.ending.success[seat] if told else None}
            if page.elsewhere:
                found["record"] = self._record(person, game, running, told)
        if page.knows != game.id:
            page.knows = game.id
            arena = self._arenas[game.block]
            found |= {"actions": list(arena.actions), "phrases": arena.phrases}
        return found

    def _record(self, person: Participant, game: Game, running: Running, told: bool) -> Row:
        """What the tables have of an episode that has ended, as far as whoever played it may know it.

        Args:
            person: who played it.
            game: that it belongs to.
            running: the episode.
            told: whether it is told how it ended.
        """
        played, episode, seat = game.episode, running.episode, self._progress.seat_of(game, person.id)
        assert played is not None, "internal: a game begins with an episode"
        assert episode.ending is not None, "internal: the episode has ended"
        acts = []
        for step in played.steps:
            lines = [line for t, line in episode.heard[seat] if t == step["t"] + 1]
            acts.append({**done_on(seat, step, episode.arena.actions), "heard": "\n".join(lines)})
        return {
            "participant": person.id,
            "game": game.id,
            "position": self._progress.position(person, game),
            "trial": played.number + 1,
            "trials": self._progress.episodes(game),
            "episode": person.played,
            "more": self._progress.has_more(person, game),
            "steps": episode.t,
            "own_steps": sum(act["by"] == PERSON for act in acts),
            "success": episode.ending.success[seat] if told else None,
            "outcome": episode.ending.outcome if told else None,
            "return": episode.ending.returns[seat] if told else None,
            "acts": acts,
        }

    def _html(self, text: str) -> str:
        """Markdown as HTML, in which tags are shown as they are written."""
        found = self._markdown.parse(text)
        for piece in (inner for token in found for inner in token.children or () if inner.type == "image"):
            number = self._pictures.get(str(piece.attrs["src"]))
            if number is not None:
                piece.attrs["src"] = f"/picture/{number}"
        made: str = self._markdown.renderer.render(found, self._markdown.options, {})
        return made

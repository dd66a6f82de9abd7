"""A person plays a scenario in the terminal, moving and speaking."""

import os
import sys
from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from socialai_dsl.errors import UsageError

if TYPE_CHECKING:
    from socialai_dsl.checking.briefing import Briefing
    from socialai_dsl.frontend import Loaded
    from socialai_dsl.play.game import FinishedEpisode, Sight
    from socialai_dsl.play.screen import Episodes

__all__ = ["play"]


def play(
    scenario: str,
    episodes: "Episodes",
    folder: Path,
    about: Mapping[str, Any] = MappingProxyType({}),
    briefing: "Briefing | None" = None,
    view: "Sight" = "room",
    practice: bool = True,
    seats: Mapping[str, Any] | None = None,
    loaded: "Loaded | None" = None,
) -> "list[FinishedEpisode]":
    """Let a person at the terminal play; the episodes that were played to their end.

    Everything is in `folder/played.jsonl` before it is shown, so it survives whatever ends the process.

    Args:
        scenario: a path or a name.
        episodes: which ones.
        folder: is made, and holds no other session.
        about: what the file says of the session.
        briefing: what the person is told of the task; None: what the scenario's file says.
        view: whether the person sees what its seat sees, or the whole room.
        practice: whether steps may be taken back and the like.
        seats: who fills other seats, as `make` takes it; the person has the first that is left.
        loaded: what is played, if that is loaded already.

    Raises:
        ScenarioError: the scenario has mistakes.
        UsageError: there is no terminal, or Textual is not installed.
        OSError: the file cannot be written, or is there already.
    """
    if find_spec("textual") is None:
        raise UsageError("playing in a terminal needs textual: pip install 'socialai-dsl[play]'")
    _require_terminal()
    from socialai_dsl.play.game import Game
    from socialai_dsl.play.journal import FILE, Journal
    from socialai_dsl.play.screen import PlayApp

    game = Game(scenario, briefing, seats, loaded)
    session = {**about, "seat": game.own, **game.briefing.record(), "view": view, "practice": practice}
    try:
        with Journal(folder / FILE, session) as game.journal:
            first = episodes(0)
            assert first is not None, "internal: there is at least one episode to play"
            game.begin(*first)
            app = PlayApp(game, episodes, practice, view)
            done = app.run() or []
            if app.failure is not None:
                raise app.failure
            return done
    finally:
        game.close()


def _require_terminal() -> None:
    """Say so where nobody could see or type anything.

    Raises:
        UsageError: standard input, output or error output is no terminal, or one that shows lines only.
    """
    streams = {"input": sys.stdin, "output": sys.stdout, "error output": sys.stderr}
    for name, stream in streams.items():
        if not stream.isatty():
            raise UsageError(
                f"playing needs a terminal, and standard {name} is none; "
                "`socialai trace SCENARIO --do forward --do ...` plays given steps without one"
            )
    if os.environ.get("TERM", "dumb") in ("dumb", "unknown"):
        raise UsageError(
            f"playing needs a terminal that can move its cursor; TERM is {os.environ.get('TERM')!r}"
        )

"""Playing from the keyboard, on a screen of 80x24: in this process, and through a real terminal of another."""

import asyncio
import contextlib
import json
import os
import re
import shutil
import signal
import sys
import time
from collections.abc import Callable, Iterator
from datetime import datetime
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pyte
import pytest
from pexpect import EOF, TIMEOUT, spawn
from textual.pilot import Pilot
from textual.widgets import Input, Static

import socialai_dsl
from socialai_dsl.cli.main import main, run_main
from socialai_dsl.engine.calls import RoomError
from socialai_dsl.envs.view import ahead
from socialai_dsl.episodes.policies import RandomPolicy, ReplayedPolicy
from socialai_dsl.evaluation.people import play_seed
from socialai_dsl.play.game import Game, Sight, finished_episodes
from socialai_dsl.play.journal import Journal, read_journal
from socialai_dsl.play.screen import PlayApp

BARE = """\
horizon: 9
grammar: {templates: [Say <noun>], nouns: [hello]}
room: {size: 6}
cast: {agent: {}}
outcome: [{success: t == 5}]
"""
SEED = 0
ROWS, COLUMNS = 24, 80
ARROWS = {"left": "\x1b[D", "right": "\x1b[C", "forward": "\x1b[A"}


def script(scenario: str, seed: int) -> list[tuple[str, str | None]]:
    """What the scenario's oracle does: body action and utterance of each step."""
    env = socialai_dsl.make(f"{scenario}+oracle").unwrapped
    program = socialai_dsl.compile(socialai_dsl.load(scenario))
    env.reset(seed=seed)
    steps, ended = [], False
    while not ended:
        action = env.scripted_action()
        _, _, terminated, truncated, info = env.step(action)
        ended = terminated or truncated
        body, speaks, template, noun = action.tolist()
        said = program.templates[template].replace("<noun>", program.nouns[noun]) if speaks else None
        steps.append(([*program.actions, "none"][body], said))
    assert info["success"], "the test needs an episode that the oracle solves"
    return steps


# -- a real terminal ------------------------------------------------------------------------------------------------


class Terminal:
    """A command in a pseudo-terminal, with what its screen shows."""

    def __init__(self, *words: str) -> None:
        environment = {**os.environ, "TERM": "xterm-256color", "LANG": "C.UTF-8"}
        environment.pop("NO_COLOR", None)
        self._screen = pyte.Screen(COLUMNS, ROWS)
        self._stream = pyte.Stream(self._screen)
        self.child = spawn(
            sys.executable,
            ["-m", "socialai_dsl", *words],
            dimensions=(ROWS, COLUMNS),
            env=environment,
            encoding="utf-8",
            timeout=60,
            preexec_fn=partial(
                signal.signal, signal.SIGHUP, signal.SIG_DFL
            ),  # also where the tests run under nohup
        )
        self.written = ""
        self._latest = time.monotonic() + 120

    def press(self, keys: str) -> None:
        self.child.send(keys)

    def shows(self, *patterns: str) -> str:
        """Wait until the screen shows all of them; what it shows then."""
        while not all(re.search(pattern, self.text) for pattern in patterns):
            if not self._read() or time.monotonic() > self._latest:
                pytest.fail(f"the screen never showed {patterns}:\n{self.text}")
        return self.text

    @property
    def text(self) -> str:
        return "\n".join(self._screen.display)

    def ends(self) -> int:
        """Wait for the end of the command; its exit code."""
        while self._read():
            pass
        self.child.close()
        assert self.child.exitstatus is not None, f"ended by signal {self.child.signalstatus}"
        return int(self.child.exitstatus)

    def _read(self) -> bool:
        try:
            chunk = self.child.read_nonblocking(65536, timeout=0.25)
        except TIMEOUT:
            return True
        except EOF:
            return False
        self.written += chunk
        # The stand-in for a terminal does not know these questions, which xterm ignores or answers.
        self._stream.feed(
            re.sub(r"\x1b\[[?>=<][0-9;]*[$]?[pu]|\x1b\[>[0-9;]*[a-zA-Z]|\x1b_.*?\x1b\\", "", chunk)
        )
        return True


@pytest.fixture
def terminal() -> Iterator[Callable[..., Terminal]]:
    opened: list[Terminal] = []

    def start(*words: str) -> Terminal:
        opened.append(Terminal(*words))
        return opened[-1]

    yield start
    for one in opened:
        one.child.close(force=True)


def test_talkitout_is_played_to_success_in_a_terminal(
    terminal: Callable[..., Terminal], tmp_path: Path
) -> None:
    steps = script("talkitout", SEED)
    screen = terminal("play", "talkitout", "--seed", str(SEED), "--out", str(tmp_path))
    first = screen.shows("step 0 ", "q quit")
    assert "Leave by the right one" not in first, "that is for authors"
    assert "An episode ends with success, with failure" in first

    # A step too many, and back; the states of frames shown, and hidden.
    screen.press(ARROWS["left"])
    screen.shows("step 1 ")
    screen.press("u")
    screen.shows("step 0 ", "one step back")
    screen.press("s")
    screen.shows(r"wizard +\d,\d +down +stranger")
    screen.press("s")
    screen.shows("in view")

    for t, (movement, said) in enumerate(steps, start=1):
        if said is not None:
            screen.press("/" + " ".join([movement, said] if movement != "none" else [said]) + "\r")
        else:
            screen.press(ARROWS.get(movement, "."))
        screen.shows(f"step {t} ")
    screen.shows("success:", f"after {len(steps)} steps", r"\d+ You: Open sesame")

    # The last step is undone and done again, with a slip that Tab puts right.
    screen.press("u")
    screen.shows(f"step {len(steps) - 1} ")
    screen.press("/Open sesme\r")
    screen.shows("'Open sesme' cannot be said; did you mean 'Open sesame'")
    screen.press("\t\r")
    screen.shows("success:")

    screen.press("q")
    assert screen.ends() == 0
    left = screen.written.rfind("\x1b[?1049l")
    assert left > 0, "the other screen of the terminal is left"
    assert "\x1b[?25h" in screen.written, "the cursor is shown again"
    assert "\x1b[?1000l" in screen.written, "the mouse is let go"
    assert f"talkitout, seed {SEED}: success (" in screen.written[left:]
    assert "Traceback" not in screen.written

    kept = events(tmp_path)
    assert [event["event"] for event in kept[:4]] == ["session", "episode", "step", "undo"]
    assert [event["success"] for event in kept if event["event"] == "end"] == [True, True]


def events(folder: Path) -> list[dict[str, Any]]:
    """The events of the only session below the folder, in which every time is one, and none goes back."""
    (file,) = folder.rglob("played.jsonl")
    found = [json.loads(line) for line in file.read_text(encoding="utf-8").splitlines()]
    times = [datetime.fromisoformat(event["time"]) for event in found]
    assert times == sorted(times)
    assert all(time.tzinfo is not None for time in times)
    return found


@pytest.mark.parametrize("end", ["hang up", "SIGHUP", "SIGTERM", "SIGKILL"])
def test_what_was_played_survives_whatever_ends_the_terminal(
    end: str, terminal: Callable[..., Terminal], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Of an evaluation every step is on disk before its picture; the next person gets a folder of their own."""
    out = ["--out", str(tmp_path / "study")]
    for participant in ("ada", "ada"):
        screen = terminal("evaluate", "human", "--on", "talkitout", "--participant", participant, *out)
        screen.shows("test episode 0", "step 0 ")
        screen.press("x")
        screen.shows("no success")
        screen.press("n")
        screen.shows("test episode 1")
        screen.press(ARROWS["left"])
        screen.shows("step 1 ")
        if end == "hang up":
            screen.child.close(force=False)  # as when a window is closed
        else:
            screen.child.kill(getattr(signal, end))
        screen.child.wait()

    sessions = sorted((tmp_path / "study").iterdir())
    assert len(sessions) == 2
    assert len({event["session"] for session in sessions for event in events(session)[:1]}) == 2
    for session in sessions:
        assert session.name.startswith("ada-")
        first, *played = events(session)
        assert (first["format"], first["session"], first["scenario"]) == (
            "socialai-played/1",
            session.name,
            "talkitout",
        )
        assert (first["tell"], first["view"], first["practice"]) == ("nothing", "seat", False)
        kinds = [event["event"] for event in played]
        assert kinds == ["episode", "step", "end", "episode", "step"]
        assert (played[2]["success"], played[4]["did"]) == (False, "left")
    shutil.move(sessions[0], tmp_path / "sent")
    page = tmp_path / "page.html"
    assert main(["replay", str(tmp_path / "sent" / "talkitout"), "--out", str(page)]) == 0
    assert "1 episode written" in capsys.readouterr().out


def test_without_a_terminal(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    assert main(["play", "talkitout"]) == 2
    assert "playing needs a terminal, and standard input is none" in capsys.readouterr().err
    assert run_main(["talkitout", "--agent", "human", "--out", os.devnull]) == 2
    for stream in ("stdin", "stdout", "stderr"):
        monkeypatch.setattr(getattr(sys, stream), "isatty", lambda: True, raising=False)
    monkeypatch.setenv("TERM", "dumb")
    assert main(["play", "talkitout"]) == 2
    assert "TERM is 'dumb'" in capsys.readouterr().err


# -- the screen, in this process ------------------------------------------------------------------------------------


def episode(number: int) -> tuple[str, dict[str, Any]]:
    return f"seed {number}", {"seed": number}


def played(
    scenario: str,
    player: Callable[[PlayApp, Pilot[Any]], Any],
    practice: bool = True,
    episodes: Any = episode,
    view: Sight = "room",
    size: tuple[int, int] = (COLUMNS, ROWS),
) -> PlayApp:
    """Let a function play on a screen of 80x24, or of another size."""
    game = Game(scenario)
    game.begin(*episodes(0))
    app = PlayApp(game, episodes, practice, view)

    async def run() -> None:
        async with app.run_test(size=size) as pilot:
            await player(app, pilot)

    asyncio.run(run())
    game.close()
    return app


def shown(app: PlayApp, place: str) -> str:
    return str(app.query_one(place, Static).render())


async def typed(pilot: Pilot[Any], text: str) -> None:
    await pilot.press(*("space" if c == " " else c for c in text), "enter")


@pytest.mark.thorough("plays in a terminal")
def test_keys_lists_and_lines() -> None:
    async def play(app: PlayApp, pilot: Pilot[Any]) -> None:
        await pilot.press("up", "full_stop", "a", "space")
        assert "step 4 " in shown(app, "#title")
        await pilot.press("c", "down", "down", "enter", "enter")  # the third template with the first noun
        assert "step 5 " in shown(app, "#title")
        assert app._game.now.lines[-1].text == "Which is sesame"
        await pilot.press("c", "right", "down", "escape", "escape")
        assert len(app.screen_stack) == 1
        assert "step 5 " in shown(app, "#title")
        await pilot.press("slash")
        await typed(pilot, "left Which is the wall")
        assert (app._game.steps, app._game.now.lines[-1].text) == (6, "Which is the wall")
        await pilot.press("enter")
        await typed(pilot, "Sing")
        assert "'Sing' cannot be said" in shown(app, "#message")
        assert app.query_one(Input).value == "Sing"
        await pilot.press("left", "up")
        assert app._game.steps == 6, "arrows move the cursor of the line"
        await pilot.press("escape", "question_mark")
        assert len(app.screen_stack) == 2
        await pilot.press("z", "up")
        assert app._game.steps == 7

    played("talkitout", play)


@pytest.mark.parametrize("columns", [1, 5, 10])
def test_lists_are_shown_in_a_terminal_of_any_width(columns: int) -> None:
    async def play(app: PlayApp, pilot: Pilot[Any]) -> None:
        await pilot.press("c", "down", "down", "enter", "enter")
        assert app._game.steps == 1

    played("talkitout", play, size=(columns, ROWS))


@pytest.mark.thorough("plays in a terminal")
def test_steps_are_taken_back_with_their_chance_and_played_again() -> None:
    async def play(app: PlayApp, pilot: Pilot[Any]) -> None:
        def now() -> tuple[Any, ...]:
            return app._game.room(), app._game.now.lines, tuple(app._game.backstage())

        keys = ["up", "left", "space", "up", "right", "up", "space", "space", "up", "left"]
        seen = [now()]
        for key in keys:
            await pilot.press(key)
            seen.append(now())
        assert len(set(seen)) > 5, "the peer dances"
        for before in reversed(seen[:-1]):
            await pilot.press("u")
            assert now() == before
        await pilot.press("u")
        assert "no step to take back" in shown(app, "#message")
        for key, after in zip(keys, seen[1:], strict=True):
            await pilot.press(key)
            assert now() == after
        await pilot.press("r")
        assert now() == seen[0]
        await pilot.press("n")
        assert "seed 1 " in shown(app, "#title")

    played("dance", play)


def test_the_end_is_told_and_nothing_is_played_after_it() -> None:
    async def play(app: PlayApp, pilot: Pilot[Any]) -> None:
        await pilot.press("x")
        assert "no success: failure: agent.action in toggle | done\nafter 1 steps" in shown(app, "#message")
        await pilot.press("up")
        assert app._game.steps == 1
        await pilot.press("u", "t", "n", "q")

    app = played("talkitout", play)
    (only,) = app.return_value or []
    assert (only.title, len(only.actions), only.ended.success) == ("seed 0", 1, False)


def test_an_evaluation_gives_nothing_away() -> None:
    def two(number: int) -> tuple[str, dict[str, Any]] | None:
        return (f"test episode {number}", {"options": {"test_episode": number}}) if number < 2 else None

    async def play(app: PlayApp, pilot: Pilot[Any]) -> None:
        for key, told in (("u", "taken back"), ("r", "played once"), ("s", "not shown"), ("n", "has ended")):
            await pilot.press(key)
            assert told in shown(app, "#message")
        await pilot.press("x", "n", "x", "n")

    app = played("talkitout", play, practice=False, episodes=two)
    assert [one.title for one in app.return_value or []] == ["test episode 0", "test episode 1"]


def test_players_of_a_suite_are_told_the_instructions_of_its_member(tmp_path: Path) -> None:
    for name, instructions in (("walk", "Walk on."), ("wait", "Wait here.")):
        (tmp_path / f"{name}.yaml").write_text(
            f"scenario: {name}\nabout: Nobody is told this.\ninstructions: {instructions}\n{BARE}"
        )
    (tmp_path / "both.yaml").write_text("suite: both\nmembers: [walk.yaml, wait.yaml]\n")

    async def play(app: PlayApp, pilot: Pilot[Any]) -> None:
        told = {shown(app, "#lines")}
        for _ in range(6):
            await pilot.press("n")
            told.add(shown(app, "#lines"))
        turns = "An episode ends with success, with failure, or after 9 turns."
        assert told == {f"{turns} Walk on.", f"{turns} Wait here."}

    played(str(tmp_path / "both.yaml"), play)


def test_the_view_of_the_seat_is_that_of_a_model_and_nothing_else() -> None:
    async def play(app: PlayApp, pilot: Pilot[Any]) -> None:
        await pilot.press("up", "left")
        seen = shown(app, "#fact")
        assert seen == re.sub(r"\x1b\[[0-9;]*m", "", app._game.now.seen)
        assert seen.startswith("You see:\n")
        assert seen.endswith("You hear nothing.")
        assert not app.query_one("#left").display
        assert shown(app, "#room") == ""
        assert shown(app, "#title") == "seed 0 · step 2"
        await pilot.press("question_mark")
        assert "Directions of others are those of a compass" in str(
            app.screen.query_one("#help", Static).render()
        )
        await pilot.press("z", "x")
        assert shown(app, "#message").split("   ")[0] == "no success\nafter 3 steps"

    played("talkitout", play, practice=False, view="seat")


def test_a_room_that_cannot_be_and_what_is_our_fault(monkeypatch: pytest.MonkeyPatch) -> None:
    async def play(app: PlayApp, pilot: Pilot[Any]) -> None:
        with monkeypatch.context() as patched:
            patched.setattr(app._game._env, "reset", lambda **_: (_ for _ in ()).throw(RoomError("no room")))
            await pilot.press("n")
            assert "no room" in shown(app, "#message")
            assert "seed 0 " in shown(app, "#title")
        monkeypatch.setattr(app._game, "act", lambda *_: 1 / 0)
        app.simulate_key("up")  # a pilot would wait for a screen that is left

    app = played("talkitout", play)
    assert isinstance(app.failure, ZeroDivisionError)


@pytest.mark.parametrize(
    ("code", "words"),
    [
        ((1, 0, 0), "nothing"),
        ((4, 1, 2), "green door, locked"),
        ((2, 5, 0), "wall"),
        ((11, 3, 0), "somebody, purple"),
        ((19, 0, 1), "red remote door, closed"),
        ((200, 0, 0), "something"),
    ],
)
def test_what_is_ahead(code: tuple[int, int, int], words: str) -> None:
    view = np.zeros((7, 7, 4), np.uint8)
    view[3, 5, :3] = code
    assert ahead(view) == words


def test_names_reach_the_screen_as_text(tmp_path: Path) -> None:
    """A scenario's name and texts are no markup, whatever brackets they have."""
    file = tmp_path / "[red]x.yaml"
    file.write_text((Path(__file__).parents[3] / "scenarios" / "talkitout.yaml").read_text())

    async def play(app: PlayApp, pilot: Pilot[Any]) -> None:
        assert "[red]x" in shown(app, "#title")

    def titled(number: int) -> tuple[str, dict[str, Any]]:
        return f"{file}, seed {number}", {"seed": number}

    played(str(file), play, episodes=titled)


# -- another seat -----------------------------------------------------------------------------------------------------

TOGETHER = "together/help_together"
TWO = """\
scenario: two
horizon: 20
earshot: room
grammar: {templates: [Say <noun>], nouns: [hello, goodbye]}
actions: [left, right, forward]
room: {width: 7, height: 6}
cast:
  agent: {name: Ann, place: anywhere}
  bob: {name: Bob, place: anywhere, seat: open, frame: turns}
frames:
  turns: {states: {on: {do: turn(right), then: [{hears: Say hello, say: Hi.}]}}}
outcome: [{success: t == 9, for: bob, reward: {bob: 50}}]
"""


@pytest.fixture
def two(tmp_path: Path) -> str:
    path = tmp_path / "two.yaml"
    path.write_text(TWO, encoding="utf-8")
    return str(path)


def test_another_seat_is_played_and_the_journal_is_replayed_to_the_same_bits(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, two: str
) -> None:
    """With a policy that draws on the agent's seat: steps back take its draws with them."""
    sizes = tuple(socialai_dsl.make(two).action_space.nvec.tolist())
    seated: Any = (socialai_dsl.load(two), {"agent": RandomPolicy(sizes, 5)})
    monkeypatch.setattr("socialai_dsl.evaluation.people.seating", lambda *_: seated)
    monkeypatch.setattr("socialai_dsl.play._require_terminal", lambda: None)
    heard: list[Any] = []

    async def keys(app: PlayApp, pilot: Pilot[Any]) -> None:
        assert "you are Bob" in shown(app, "#title")
        others = []
        for _ in range(2):
            await pilot.press("up", "a", "d")
            others.append([moment.others["agent"].tolist() for moment in app._game._moments[1:]])
            await pilot.press("u", "u", "u")
        assert others[0] == others[1], "the agent's draws are taken back as well"
        await pilot.press("up", "a", "slash")
        await typed(pilot, "forward Say goodbye")
        await pilot.press("d", "d", "d", "d", "d", "d")
        heard.extend(app._game.now.lines)
        assert "success: " in shown(app, "#message")
        assert "reward 0.2" in shown(app, "#message"), "its own: half of what the agent would be paid"
        await pilot.press("q")

    def run(app: PlayApp) -> Any:
        async def playing() -> None:
            async with app.run_test(size=(COLUMNS, ROWS)) as pilot:
                await keys(app, pilot)

        asyncio.run(playing())
        return app.return_value

    monkeypatch.setattr(PlayApp, "run", run)
    ((one,), folder) = play_seed(two, 3, tmp_path / "kept", seats=[("agent", "random")])
    assert {line.speaker for line in heard} == {"You", "Ann"}

    (read,) = finished_episodes(folder / "played.jsonl")
    assert str(read) == str(one)
    first, *_, last = events(folder)
    assert (first["seat"], first["seats"]) == ("bob", {"agent": "random"})
    env = socialai_dsl.make(two, seats={"agent": ReplayedPolicy(read.others["agent"])})
    _, info = env.reset(seed=3)
    said = []
    for action in read.actions:
        *_, info = env.step(action)
        said += [] if info["utterance"] == "NA" else info["utterance"].split("\n")
    assert said == [f"Ann: {line.text}" for line in heard if line.speaker == "Ann"]
    ended = info["outcome"], info["success"], len(read.actions)
    assert ended == (last["outcome"], last["success"], last["steps"]) == ("success@12", True, 9)


@pytest.mark.parametrize("told", ["Leave.\u2028Be quick.", "\x85\u2029", "a\nb\r\n", "ä"])
def test_a_journal_is_read_again_whatever_was_told(told: str, tmp_path: Path) -> None:
    """Also signs that end lines of text, which JSON may hold as they are."""
    file = tmp_path / "played.jsonl"
    with Journal(file, {"told": told}) as journal:
        journal.note("episode", title=told)
    with open(file, "a", encoding="utf-8") as cut_off:
        cut_off.write('{"event": "step", "t": 1')
    assert [event.get("told", event.get("title")) for event in read_journal(file)] == [told, told]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--seat", "jil=random"], "expected one of agent, jill; did you mean 'jill'"),
        (["--seat", "jill=random", "--seat", "jill=script"], "got 2 players for jill, expected one"),
        (["--seat", "jill=random", "--seat", "agent=random"], "expected one seat left"),
        (["--seat", "jill"], "expected NAME=PLAYER"),
        (["--seat", "jill=runs/nowhere"], "runs/nowhere"),
    ],
)
def test_mistakes_about_seats_are_one_sentence(
    words: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with contextlib.suppress(SystemExit):
        assert main(["play", TOGETHER, *words]) == 2
    told = capsys.readouterr().err
    assert said in told
    assert "Traceback" not in told


def test_a_seat_without_a_script_has_none(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "bare.yaml"
    bare = f"scenario: bare\n{BARE}".replace("{agent: {}}", "{agent: {}, bob: {seat: open, name: Bob}}")
    path.write_text(bare, encoding="utf-8")
    assert main(["play", str(path), "--seat", "bob=script"]) == 2
    assert "got 'script' for bob, which follows no frame" in capsys.readouterr().err
    assert main(["play", str(path), "--seat", "agent=script"]) == 2
    assert "the agent of bare has no frame, and there is no variant `oracle`" in capsys.readouterr().err

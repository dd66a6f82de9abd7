"""Several people share a game: a step is taken when all have chosen, and nobody gets more than the own seat's."""

from __future__ import annotations

import shutil
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings

import socialai_dsl as sd
from socialai_dsl.llm import TextView

for module in ("uvicorn", "starlette", "websockets"):
    pytest.importorskip(module, reason="no test of the studio's server without the extra `studio`")

from websockets.exceptions import ConnectionClosed  # noqa: E402

from tests.socialai_dsl.studio.clients import Client, Window, serving  # noqa: E402
from tests.socialai_dsl.studio.hostile import FILES, GAME, texts  # noqa: E402

NAME = "levers_together.yaml"
FILE = Path(__file__).parents[3] / "scenarios" / "together" / NAME


@pytest.fixture
def client(tmp_path: Path) -> Iterator[Client]:
    for name in (NAME, "levers_together_oracle.yaml"):
        shutil.copy(FILE.with_name(name), tmp_path)
    with serving(tmp_path, NAME, 3) as found:
        yield found


@contextmanager
def host(client: Client) -> Iterator[Window]:
    """A window with the game of seed 3, in which it is the agent."""
    with client.window() as opened:
        window = Window(opened)
        assert "episode" in window.ask("draw", path=NAME, text=FILE.read_text(), room={"seed": 3})
        yield window


@contextmanager
def guest(client: Client, code: str) -> Iterator[Window]:
    with client.window(f"seat?code={code}") as opened:
        yield Window(opened)


def moments(answer: dict[str, Any]) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = answer["more"]["moments"]
    return found


def test_a_step_is_taken_when_all_have_chosen(client: Client) -> None:
    beside = sd.make(str(FILE), seats={"agent": "random"}).unwrapped
    observation, info = beside.reset(seed=3)
    reads = TextView(beside.program, "grid")  # type: ignore[attr-defined]
    with host(client) as window:
        code = window.ask("invite", seat="partner")["code"]
        assert window.ask("invite", seat="partner")["code"] == code
        with guest(client, code) as other:
            seen = other.hears("glance", t=0)
            assert seen["seen"] == reads.observe(observation, info)
            assert (seen["name"], seen["seat"], seen["success"]) == ("Bob", "partner", None)
            assert "scenario" not in seen, "nothing of the file"
            window.hears("guests", chosen={"partner": False}, own=False)

            asked = window.say("act", line="left now")
            other.hears("guests", chosen={"partner": False}, own=True)
            assert other.ask("choose", movement="jump")["refused"].startswith("'jump' can be neither")
            assert "action" in other.ask("choose", movement="right")
            (moment,) = moments(window.answer(asked))
            assert (moment["did"], moment["said"], moment["seats"][0]["did"]) == ("left", "now", "right")
            after = other.hears("glance", t=1)
            assert after["heard"] == ["Ann: now"]
            assert "Ann: now" in after["seen"]

            other.ask("choose", line="ready")
            window.hears("guests", chosen={"partner": True}, own=False)
            step = window.ask("act")
            assert moments(step)[0]["seats"][0]["said"] == "ready"
            assert step["more"]["players"] == {"partner": "a person"}
            assert other.hears("glance", t=2)["heard"] == ["Ann: now"]


def test_who_leaves_or_is_late_is_stood_in_for(client: Client) -> None:
    with host(client) as window:
        scripted = [moments(window.ask("act"))[0]["seats"][0]["did"] for _ in range(3)]
        window.ask("begin", room={"seed": 3})
        code = window.ask("invite", seat="partner", seconds=1.0)["code"]
        with guest(client, code) as other:
            other.hears("glance")
            assert moments(window.ask("act"))[0]["seats"][0]["did"] == scripted[0], "after a second"
            other.hears("glance", t=1)
            # Who waits for the window waits no longer either; it has no script, so it stays.
            assert "action" in other.ask("choose")
            late = window.hears("act")
            assert moments(late)[0]["did"] == "none"
            window.ask("invite", seat="partner")
            asked = window.say("act")
        assert moments(window.answer(asked))[0]["t"] == 3, "as soon as the other has left"
        assert "more" in window.ask("act")
        window.ask("begin", room={"seed": 3})
        again = [moments(window.ask("act"))[0]["seats"][0]["did"] for _ in range(3)]
        assert again == scripted


def test_nothing_is_played_for_one_who_has_left(client: Client) -> None:
    with host(client) as window:
        code = window.ask("invite", seat="partner", seconds=1.0)["code"]
        with guest(client, code) as other:
            other.hears("glance")
            other.ask("choose")
        window.hears("guests", chosen={})
        time.sleep(1.5)
        assert moments(window.ask("act"))[0]["t"] == 1
        assert window.told == []


def test_what_was_chosen_for_a_step_counts_for_no_other(client: Client) -> None:
    with host(client) as window:
        code = window.ask("invite", seat="partner")["code"]
        with guest(client, code) as other:
            other.hears("glance")
            window.hears("guests", chosen={"partner": False})
            asked = window.say("act", movement="left")
            begun = window.say("begin", room={"seed": 4})
            assert window.answer(asked)["refused"] == "the step was given up"
            assert "episode" in window.answer(begun)
            other.hears("glance", t=0)
            first = window.say("act", movement="left")
            second = window.say("act", movement="right")
            assert window.answer(first)["refused"] == "you have chosen anew"
            other.ask("choose", movement="right")
            assert moments(window.answer(second))[0]["did"] == "right"
            other.hears("glance", t=1)
            assert window.ask("back", to=0) == {"length": 0}
            other.hears("glance", t=0)


def test_nobody_is_waited_for_whose_seat_is_not_played(client: Client) -> None:
    with host(client) as window:
        code = window.ask("invite", seat="partner")["code"]
        with guest(client, code) as other:
            other.hears("glance")
            alone = FILE.read_text().replace(", seat: open", "")
            assert "episode" in window.ask("draw", path=NAME, text=alone)
            assert "nobody else can have the seat of partner" in other.hears("refused")["refused"]
            assert "more" in window.ask("act")
            window.ask("draw", path=NAME, text=FILE.read_text())
            other.hears("glance", t=0)


def test_after_the_end_nobody_is_waited_for(client: Client) -> None:
    with host(client) as window:
        code = window.ask("invite", seat="partner")["code"]
        with guest(client, code) as other:
            other.hears("glance")
            for t in range(1, 31):
                asked = window.say("act")
                other.ask("choose")
                assert "more" in window.answer(asked)
                seen = other.hears("glance", t=t)
            assert seen["success"] is False
            assert "has ended" in window.ask("act")["refused"]
            assert "another one begins" in other.ask("choose")["refused"]


def test_a_link_gives_one_seat_as_long_as_the_window_is_open(client: Client) -> None:
    with host(client) as window:
        code = window.ask("invite", seat="partner")["code"]
        with guest(client, code) as other:
            other.hears("glance")
            for asked in ("list", "read", "draw", "glance", "layout", "invite"):
                assert "refused" in other.ask(asked, seat="agent", name=NAME)
            with guest(client, code) as third, pytest.raises(ConnectionClosed) as full:
                third.hears("glance")
            assert full.value.rcvd is not None
            assert full.value.rcvd.code == 4409
    for wrong in (code, "", "0" * 32):
        with guest(client, wrong) as nobody, pytest.raises(ConnectionClosed) as closed:
            nobody.hears("glance")
        assert closed.value.rcvd is not None
        assert closed.value.rcvd.code == 4404
    with pytest.raises(Exception, match="403"), client.window(f"seat?code={code}", "http://evil.example"):
        pass
    assert client.get("/guest?code=x").status == 200
    assert client.get("/guest?code=x", host="evil.example").status == 403


def test_whatever_a_guest_sends_is_refused_and_the_game_goes_on(client: Client) -> None:
    with host(client) as window:
        code = window.ask("invite", seat="partner")["code"]
        with guest(client, code) as other:
            other.hears("glance")

            @settings(max_examples=100, derandomize=True, deadline=None)
            @given(texts([{"do": "choose", "movement": "left"}, *GAME, *FILES]))
            def each(text: str) -> None:
                with suppress(UnicodeEncodeError):
                    other.opened.send(text)

            each()
            other.opened.send(b"\xff\x00")
            assert "action" in other.ask("choose", movement="right")
            assert moments(window.ask("act"))[0]["seats"][0]["did"] == "right"


def test_the_others_are_told_when_the_window_is_closed(client: Client) -> None:
    with host(client) as window:
        code = window.ask("invite", seat="partner")["code"]
        with guest(client, code) as other:
            other.hears("glance")
            window.opened.close()
            with pytest.raises(ConnectionClosed, match="the window of this game was closed"):
                other.hears("act")

"""A replay from the disk, without a network: it plays, steps, scrubs, and says why."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import pytest

import socialai_dsl as sd
from socialai_dsl.cli.main import main
from socialai_dsl.episodes import trace_of

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page


@pytest.fixture(scope="module")
def address(tmp_path_factory: pytest.TempPathFactory) -> str:
    file = tmp_path_factory.mktemp("replay") / "episode.html"
    assert main(["replay", "talkitout", "--episodes", "40", "--record", "2", "-o", str(file)]) == 0
    return file.as_uri()


@pytest.fixture
def replay(page: Page, address: str) -> Page:
    page.context.set_offline(True)
    asked: list[str] = []
    page.on("request", lambda request: asked.append(request.url))
    page.goto(address)
    page.get_by_role("button", name="play").wait_for()
    assert asked == [address]
    return page


def step(page: Page) -> str:
    return page.locator(".controls output").inner_text().split(" ·")[0]


def test_it_plays_steps_and_scrubs(replay: Page) -> None:
    assert step(replay).startswith("step 0 of ")
    last = int(step(replay).rpartition(" ")[2])
    replay.keyboard.press("ArrowRight")
    replay.get_by_role("button", name="a step on").click()
    assert step(replay).startswith("step 2 of ")
    replay.get_by_label("step", exact=True).fill("5")
    assert step(replay).startswith("step 5 of ")
    replay.keyboard.press("End")
    assert step(replay).startswith(f"step {last} of ")
    replay.get_by_label("step", exact=True).fill(str(last - 4))
    replay.get_by_label("steps a second").select_option("8")
    replay.get_by_role("button", name="play").click()
    replay.locator(".controls output", has_text=f"step {last} of").wait_for()
    replay.locator(".controls .main", has_text="play").wait_for()  # it stops at the end
    replay.get_by_label("steps a second").select_option("1")
    replay.locator(".controls .main").click()
    replay.locator(".controls .main", has_text="pause").wait_for()
    replay.keyboard.press("Space")
    assert replay.locator(".controls .main").inner_text() == "▶ play"


def test_a_link_leads_to_a_step_and_arrows_to_other_episodes(replay: Page, address: str) -> None:
    replay.goto(f"{address}#e2s4")
    assert step(replay).startswith("step 4 of ")
    assert replay.locator(".episodes [aria-current]").count() == 1
    replay.keyboard.press("ArrowDown")
    assert replay.evaluate("location.hash") == "#e3s0"
    replay.goto(f"{address}#e99s999")
    assert replay.evaluate("location.hash").startswith("#e")
    assert step(replay).split()[1] == step(replay).split()[3]


def test_it_says_what_was_said_and_why(replay: Page) -> None:
    replay.locator(".episodes button", has_text="success").last.click()
    replay.keyboard.press("End")
    lines = replay.locator(".transcript li").all_inner_texts()
    assert any("Gandalf" in line for line in lines)
    assert replay.locator(".rules li.fired").count() >= 1
    replay.keyboard.press("Home")
    for _ in range(60):
        if replay.locator(".bubble").count():
            break
        replay.keyboard.press("ArrowRight")
    assert replay.locator(".bubble").first.is_visible()
    replay.get_by_label("whose rules").select_option("wizard")
    assert set(replay.locator(".rules li b").all_inner_texts()) == {"wizard"}
    assert replay.locator(".stage canvas").get_attribute("aria-label").count("doors[") == 4  # type: ignore[union-attr]


def test_a_phone_shows_all_of_it(browser: Browser, address: str) -> None:
    context = browser.new_context(viewport={"width": 390, "height": 844}, device_scale_factor=2, offline=True)
    page = context.new_page()
    page.goto(address)
    page.get_by_role("button", name="play").wait_for()
    assert page.evaluate("document.documentElement.scrollWidth") <= 390
    context.close()


def test_nothing_of_a_scenario_is_read_as_html(page: Page, tmp_path: Path) -> None:
    hostile = tmp_path / "hostile.yaml"
    hostile.write_text(
        """scenario: hostile
about: "</script><img src=x onerror=document.title='broken'>"
horizon: 5
grammar: {templates: [Say <noun>], nouns: [hello]}
room: {size: 6}
cast: {agent: {place: anywhere}, other: {place: anywhere}}
outcome: [{failure: agent.did(done)}]
"""
    )
    file = tmp_path / "page.html"
    assert main(["replay", str(hostile), "--agent", "random", "--episodes", "3", "-o", str(file)]) == 0
    page.goto(file.as_uri())
    page.get_by_role("button", name="play").wait_for()
    assert "</script>" in page.locator("header").inner_text()
    assert page.locator("img").count() == 0
    assert "hostile" in page.title()


def test_a_notebook_shows_an_episode_in_a_frame(page: Page) -> None:
    env = sd.make("talkitout")
    forward = env.unwrapped.encode_action(("forward", "How are you"))  # type: ignore[attr-defined]
    trace = trace_of(env, [forward] * 3, {"seed": 7}, scenario="talkitout", agent="me", episode="seed 7")
    page.set_content(trace._repr_html_())
    frame = page.frame_locator("iframe[title='an episode']")
    frame.get_by_role("button", name="last step").click()
    frame.locator(".controls output", has_text="step 3 of 3").wait_for()
    assert frame.locator(".transcript b.own").count() == 3


def test_all_seats_are_shown_and_one_of_them_chosen(page: Page, tmp_path: Path) -> None:
    file = tmp_path / "together.html"
    assert main(["replay", "together/levers_together", "--test-episode", "0", "-o", str(file)]) == 0
    page.goto(f"{file.as_uri()}#e1s0")
    page.get_by_role("button", name="play").wait_for()
    rows = page.locator(".seats tbody tr")
    assert [text.split()[0] for text in rows.all_inner_texts()] == ["agent", "partner"]
    canvas, room = page.locator(".sight canvas"), page.locator(".stage canvas")
    agents = canvas.evaluate("one => one.toDataURL()"), room.evaluate("one => one.toDataURL()")
    page.get_by_label("whose view").select_option("partner")
    assert canvas.get_attribute("aria-label") == "Bob's own view, 7 by 7 cells; who sees it looks up"
    assert agents[0] != canvas.evaluate("one => one.toDataURL()")
    assert agents[1] != room.evaluate("one => one.toDataURL()"), "its sight is marked"
    page.keyboard.press("End")
    assert all("✓ success" in text for text in rows.all_inner_texts())
    assert "toggle" in rows.last.inner_text()
    assert {"Ann: ", "Bob: "} >= set(page.locator(".transcript li b").all_inner_texts())

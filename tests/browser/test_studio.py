"""The studio in a real browser, from the first key to a replay on the disk."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

import socialai_dsl as sd

pytest.importorskip("starlette", reason="no test of the studio without the extra `studio`")

if TYPE_CHECKING:
    from playwright.sync_api import Page

SCENARIOS = Path(__file__).parents[2] / "scenarios"
KEYS = {
    "left": "ArrowLeft",
    "right": "ArrowRight",
    "forward": "ArrowUp",
    "toggle": "t",
    "done": "x",
    "none": ".",
}
SEED = 3


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name in ("talkitout.yaml", "talkitout_oracle.yaml"):
        shutil.copy(SCENARIOS / name, tmp_path)
    return tmp_path


@pytest.fixture
def studio(page: Page, folder: Path) -> Iterator[Page]:
    command = [
        sys.executable,
        "-m",
        "socialai_dsl",
        "studio",
        str(folder / "talkitout.yaml"),
        "--no-browser",
        "--port",
        "0",
    ]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    try:
        found = re.search(r"http://\S+", process.stdout.readline())
        assert found is not None
        page.goto(found.group(0))
        drawn(page)
        yield page
        page.close()  # before the server, whose end it would complain about
    finally:
        process.terminate()
        process.wait(20)
        process.stdout.close()


def drawn(page: Page) -> None:
    """Wait for the room of what is written."""
    page.locator(".stage:not(.stale) canvas[aria-label]").wait_for()


def step(page: Page) -> int:
    return int(page.locator(".controls output").inner_text().split()[1])


def reach(page: Page, number: int) -> None:
    page.locator(".controls output", has_text=f"step {number} ·").wait_for()


def room(page: Page) -> str:
    return page.locator(".stage canvas").get_attribute("aria-label") or ""


def begin(page: Page, seed: int) -> None:
    page.get_by_label("seed of the room").fill(str(seed))
    page.keyboard.press("Tab")
    page.keyboard.press("Escape")
    reach(page, 0)


def solution() -> list[tuple[str, str | None]]:
    """What the script does in a room, as movement and sentence."""
    env = sd.make("talkitout+oracle").unwrapped
    env.reset(seed=SEED)
    done: list[tuple[str, str | None]] = []
    ended = False
    while not ended:
        _, _, terminated, truncated, _ = env.step(env.scripted_action())  # type: ignore[attr-defined]
        last = env.describe()["last"]  # type: ignore[attr-defined]
        done.append((last["action"], last["said"]))
        ended = terminated or truncated
    return done


def play(page: Page, steps: list[tuple[str, str | None]]) -> None:
    """Play by the keyboard alone."""
    for movement, sentence in steps:
        before = step(page)
        if sentence is None:
            page.keyboard.press(KEYS[movement])
        else:
            page.keyboard.press("/")
            page.keyboard.type(sentence if movement == "none" else f"{movement} {sentence}")
            page.keyboard.press("Enter")
            page.keyboard.press("Escape")
        reach(page, before + 1)


def test_a_mistake_is_underlined_and_the_last_good_room_stays(studio: Page, folder: Path) -> None:
    shown = room(studio)
    studio.locator(".cm-content").get_by_text("horizon", exact=True).click()
    studio.keyboard.press("Home")
    studio.keyboard.type("z")
    studio.locator(".stage.stale").wait_for()
    studio.locator(".cm-lintRange-error").first.wait_for()
    assert "unknown key `zhorizon`" in studio.locator(".findings").inner_text()
    assert room(studio) == shown
    studio.keyboard.press("Backspace")
    drawn(studio)
    assert studio.locator(".findings li").count() == 0

    studio.keyboard.press("End")
    studio.keyboard.type(" # typed")
    studio.get_by_text("not saved; a draft is kept").wait_for()
    studio.keyboard.press("Control+s")
    studio.get_by_text("saved", exact=True).wait_for()
    assert "horizon: 100 # typed" in (folder / "talkitout.yaml").read_text()


def test_what_was_not_saved_is_there_after_a_reload(studio: Page, folder: Path) -> None:
    studio.locator(".cm-content").get_by_text("horizon", exact=True).click()
    studio.keyboard.press("End")
    studio.keyboard.type(" # a thought")
    draft = folder / ".studio" / "talkitout.yaml"
    for _ in range(100):
        if draft.exists() and "a thought" in draft.read_text():
            break
        studio.wait_for_timeout(100)
    studio.on("dialog", lambda dialog: dialog.accept())
    studio.reload()
    drawn(studio)
    studio.locator(".cm-content", has_text="# a thought").wait_for()
    assert "a thought" not in (folder / "talkitout.yaml").read_text()


def test_two_windows_do_not_write_over_each_other(studio: Page, folder: Path) -> None:
    (folder / "talkitout.yaml").write_text((folder / "talkitout.yaml").read_text() + "# theirs\n")
    studio.locator(".cm-content").get_by_text("horizon", exact=True).click()
    studio.keyboard.press("End")
    studio.keyboard.type(" # mine")
    studio.keyboard.press("Control+s")
    studio.get_by_text("was changed elsewhere").wait_for()
    assert "# theirs" in (folder / "talkitout.yaml").read_text()
    studio.get_by_role("button", name="Keep mine").click()
    studio.get_by_text("saved", exact=True).wait_for()
    assert "# mine" in (folder / "talkitout.yaml").read_text()


def test_talkitout_is_played_stepped_back_and_ends_elsewhere(studio: Page, tmp_path: Path) -> None:
    begin(studio, SEED)
    steps = solution()
    play(studio, steps)
    studio.locator(".message.good", has_text="success").wait_for()
    assert studio.locator(".rules li.fired").count() >= 1
    for _ in range(10):
        before = step(studio)
        studio.keyboard.press("u")
        reach(studio, before - 1)
    assert step(studio) == len(steps) - 10
    studio.keyboard.press("x")
    studio.locator(".message.bad", has_text="no success").wait_for()

    with studio.expect_download() as download:
        studio.get_by_role("button", name="Replay").click()
    page = tmp_path / "exported.html"
    download.value.save_as(page)
    studio.context.set_offline(True)
    replay = studio.context.new_page()
    replay.goto(page.as_uri())
    replay.get_by_label("step", exact=True).fill("4")
    assert replay.locator(".controls output").inner_text().startswith("step 4 of ")


def test_the_wizard_is_dragged(studio: Page) -> None:
    begin(studio, SEED)
    at = re.search(r"wizard \([^)]*\) at (\d+), (\d+)", room(studio))
    size = re.search(r"Room of (\d+) by (\d+)", room(studio))
    assert at is not None
    assert size is not None
    width, height = map(int, size.groups())
    x, y = map(int, at.groups())
    taken = {tuple(map(int, pair)) for pair in re.findall(r"at (\d+), (\d+)", room(studio))}
    free = next((i, j) for i in range(1, width - 1) for j in range(1, height - 1) if (i, j) not in taken)
    box = studio.locator(".stage canvas").bounding_box()
    assert box is not None
    cell = box["width"] / width
    studio.mouse.move(box["x"] + (x + 0.5) * cell, box["y"] + (y + 0.5) * cell)
    studio.mouse.down()
    studio.mouse.move(box["x"] + (free[0] + 0.5) * cell, box["y"] + (free[1] + 0.5) * cell)
    studio.mouse.up()
    studio.get_by_text(f"wizard was put at {free[0]}, {free[1]}").wait_for()
    assert re.search(rf"wizard \([^)]*\) at {free[0]}, {free[1]}", room(studio))


def test_the_script_is_watched_and_sentences_are_built(studio: Page) -> None:
    studio.get_by_label("template", exact=True).select_option("How are <noun>")
    studio.get_by_label("noun").select_option("you")
    studio.get_by_role("button", name="Say").click()
    studio.locator(".transcript li", has_text="How are you").wait_for()
    studio.get_by_label("who plays").select_option("script")
    reach(studio, 0)
    studio.get_by_role("button", name="watch").click()
    studio.locator(".controls output").filter(has_text=re.compile(r"step ([2-9]|\d\d) ·")).wait_for()
    assert studio.locator(".counts li").count() >= 1


def test_a_template_becomes_a_file(studio: Page, folder: Path) -> None:
    studio.get_by_role("button", name="New…").click()
    studio.get_by_label("name").fill("mine")
    studio.get_by_role("button", name="Begin with the template").click()
    studio.locator("h1", has_text="mine.yaml").wait_for()
    drawn(studio)
    assert (folder / "mine.yaml").exists()

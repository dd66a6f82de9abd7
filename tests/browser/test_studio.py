"""The studio in a real browser, from the first key to a replay on the disk."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

import socialai_dsl as sd
from socialai_dsl.cli.main import run_main
from socialai_dsl.llm import Episode, TextView
from socialai_dsl.llm.view import LastStep

pytest.importorskip("starlette", reason="no test of the studio without the extra `studio`")

from tests.socialai_dsl.studio.shy import SHY

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page, WebSocketRoute

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


@dataclass(frozen=True)
class Server:
    """A studio, which all tests share: its folder, and its address."""

    folder: Path
    address: str


@contextmanager
def served(file: Path, state: Path, *more: str) -> Iterator[str]:
    """The address of a studio that runs; what it remembers is in `state`."""
    command = [sys.executable, "-m", "socialai_dsl", "studio", str(file), "--no-browser", *more]
    environment = {**os.environ, "XDG_STATE_HOME": str(state)}
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment)
    assert process.stdout is not None
    try:
        found = re.search(r"http://\S+", process.stdout.readline())
        assert found is not None
        yield found.group(0)
    finally:
        process.terminate()
        process.wait(20)
        process.stdout.close()


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    folder = tmp_path_factory.mktemp("studio")
    fill(folder)
    with served(folder / "talkitout.yaml", tmp_path_factory.mktemp("state"), "--port", "0") as address:
        yield Server(folder, address)


def fill(folder: Path) -> None:
    """Put two scenarios into the folder, and nothing else."""
    for path in folder.iterdir():
        shutil.rmtree(path) if path.is_dir() else path.unlink()
    for name in ("talkitout.yaml", "talkitout_oracle.yaml"):
        shutil.copy(SCENARIOS / name, folder)


@pytest.fixture
def folder(server: Server) -> Path:
    fill(server.folder)
    return server.folder


@pytest.fixture
def studio(page: Page, server: Server, folder: Path) -> Page:
    page.goto(server.address)
    drawn(page)
    return page


def drafts(folder: Path) -> str:
    """All that is kept as drafts."""
    return "".join(path.read_text() for path in (folder / ".studio").glob("*.json"))


def drawn(page: Page) -> None:
    """Wait for the room of what is written."""
    page.locator(".stage:not(.stale) canvas[aria-label]").wait_for()


def until(page: Page, holds: Callable[[], bool]) -> None:
    """Wait for something that the page does not show."""
    deadline = time.monotonic() + 30
    while not holds():
        assert time.monotonic() < deadline
        page.wait_for_timeout(20)


def step(page: Page) -> int:
    return int(page.locator(".controls output").inner_text().split()[1])


def reach(page: Page, number: int) -> None:
    page.locator(".controls output", has_text=f"step {number} ·").wait_for()


def room(page: Page) -> str:
    return page.locator(".stage canvas").get_attribute("aria-label") or ""


def rooms(page: Page) -> int:
    """How many rooms the page has shown."""
    return int(page.locator("body").get_attribute("data-rooms") or 0)


@contextmanager
def another_room(page: Page) -> Iterator[None]:
    """Wait for the room that something leads to."""
    before = rooms(page)
    yield
    until(page, lambda: rooms(page) > before)


def begin(page: Page, seed: int) -> None:
    with another_room(page):
        page.get_by_label("seed of the room").fill(str(seed))
        page.keyboard.press("Tab")
        page.keyboard.press("Escape")


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
    assert "unknown key zhorizon" in studio.locator(".findings").inner_text()
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


def test_a_file_with_mistakes_does_not_show_the_room_of_another_one(studio: Page, folder: Path) -> None:
    (folder / "empty.yaml").write_text("")
    (folder / "other.yaml").write_text("scenario: other\n")
    studio.reload()
    drawn(studio)
    files = studio.get_by_label("scenario", exact=True).first
    for name in ("other.yaml", "empty.yaml"):
        files.select_option(name)
        studio.get_by_text("the room is shown when the mistakes are mended").wait_for()
        for part in (".stage canvas", ".controls output", ".cast"):
            assert not studio.locator(part).first.is_visible(), part
    files.select_option("talkitout.yaml")
    drawn(studio)
    assert studio.locator(".controls output").first.is_visible()


def test_long_names_fit_the_screen(studio: Page, folder: Path) -> None:
    name = "long" * 45 + ".yaml"
    shutil.copy(folder / "talkitout.yaml", folder / name)
    studio.reload()
    drawn(studio)
    studio.get_by_label("scenario", exact=True).first.select_option(name)
    studio.get_by_role("heading", name=name).wait_for()
    for width in (1280, 900, 375):
        studio.set_viewport_size({"width": width, "height": 800})
        assert studio.evaluate("document.documentElement.scrollWidth") <= width


def test_the_fields_have_the_numbers_of_the_room_that_is_shown(studio: Page) -> None:
    begin(studio, SEED)
    for field, wrong in (("seed of the room", "-3"), ("number of the room", "1.5")):
        studio.get_by_label(field).fill(wrong)
        studio.keyboard.press("Tab")
        studio.locator(".message", has_text=wrong).wait_for()
        assert studio.get_by_label("seed of the room").input_value() == str(SEED)
        assert studio.get_by_label("number of the room").input_value() == "0"


def test_a_finding_has_its_cure_and_its_page_and_leads_to_its_place(studio: Page) -> None:
    studio.locator(".cm-content").get_by_text("horizon", exact=True).click()
    studio.keyboard.press("End")
    studio.keyboard.type("x")
    finding = studio.locator(".findings li.error")
    finding.first.wait_for()
    assert studio.get_by_role("tab", name="Findings 1").get_attribute("aria-selected") == "true"
    place, code = finding.get_by_role("button").all()
    studio.locator(".cm-content").press("Control+Home")
    place.click()
    studio.keyboard.type("y")
    studio.locator(".cm-content", has_text="horizon: y100x").wait_for()
    title = f"{code.inner_text()}: "
    code.click()
    studio.locator("dialog h2", has_text=title).wait_for()
    studio.get_by_role("button", name="Close").click()
    assert not studio.locator("dialog").is_visible()


def width(page: Page) -> float:
    box = page.locator(".writing").bounding_box()
    assert box is not None
    return box["width"]


def test_the_text_is_made_wider_by_mouse_and_keyboard_and_stays_so(studio: Page) -> None:
    usual, handle = width(studio), studio.get_by_role("separator", name="width of the text")
    assert usual > 0.4 * 1280
    handle.focus()
    studio.keyboard.press("ArrowRight")
    until(studio, lambda: 0.015 * 1280 < width(studio) - usual < 0.025 * 1280)
    assert room(studio), "it is no move of the game"
    assert step(studio) == 0
    box = handle.bounding_box()
    assert box is not None
    studio.mouse.move(box["x"] + 3, 300)
    studio.mouse.down()
    studio.mouse.move(500, 300)
    studio.mouse.up()
    until(studio, lambda: abs(width(studio) - 490) < 10)
    wide = studio.get_by_role("checkbox", name="wrap lines")
    scroller = "document.querySelector('.cm-scroller').scrollWidth > document.querySelector('.cm-scroller').clientWidth"
    assert not studio.evaluate(scroller)
    wide.uncheck()
    until(studio, lambda: bool(studio.evaluate(scroller)))
    studio.reload()
    drawn(studio)
    assert abs(width(studio) - 490) < 10
    assert not wide.is_checked()
    assert studio.evaluate(scroller)
    studio.get_by_role("separator").focus()
    studio.keyboard.press("Enter")
    until(studio, lambda: abs(width(studio) - usual) < 3)
    studio.keyboard.press("End")  # the room keeps its place
    assert (studio.locator("main").bounding_box() or {"width": 0})["width"] >= 299


def test_a_file_is_shown_from_its_beginning(studio: Page) -> None:
    studio.get_by_role("checkbox", name="wrap lines").uncheck()
    studio.evaluate("document.querySelector('.cm-scroller').scrollTo(300, 400)")
    files = studio.get_by_label("scenario", exact=True).and_(studio.locator("select"))
    for name in ("talkitout_oracle.yaml", "talkitout.yaml"):
        with another_room(studio):
            files.select_option(name)
        scrolled = (
            "(({scrollLeft, scrollTop}) => [scrollLeft, scrollTop])(document.querySelector('.cm-scroller'))"
        )
        assert studio.evaluate(scrolled) == [0, 0]
        studio.evaluate("document.querySelector('.cm-scroller').scrollTo(300, 400)")


def test_nothing_hides_a_message(studio: Page) -> None:
    for size in ((1280, 800), (1440, 900), (1000, 700), (500, 800)):
        studio.set_viewport_size({"width": size[0], "height": size[1]})
        studio.evaluate("document.querySelector('.message').textContent = 'a long message '.repeat(20)")
        studio.locator(".message").scroll_into_view_if_needed()
        covered = studio.evaluate(
            """() => {
              const box = document.querySelector('.message').getBoundingClientRect();
              return [0.1, 0.5, 0.9].filter((part) =>
                !document.elementFromPoint(box.left + 20, box.top + part * box.height)?.closest('.message'));
            }"""
        )
        assert covered == [], size


def test_what_was_not_saved_is_there_after_a_reload(studio: Page, folder: Path) -> None:
    studio.locator(".cm-content").get_by_text("horizon", exact=True).click()
    studio.keyboard.press("End")
    studio.keyboard.type(" # a thought")
    until(studio, lambda: "a thought" in drafts(folder))
    studio.on("dialog", lambda dialog: dialog.accept())
    studio.reload()
    drawn(studio)
    studio.locator(".cm-content", has_text="# a thought").wait_for()
    assert "a thought" not in (folder / "talkitout.yaml").read_text()


def test_what_is_typed_while_another_file_is_read_is_kept(page: Page, server: Server, folder: Path) -> None:
    held: list[tuple[WebSocketRoute, str]] = []

    def connect(ours: WebSocketRoute) -> None:
        def pass_on(said: str | bytes) -> None:
            if isinstance(said, str) and '"read"' in said and "variant: talkitout_oracle" in said:
                held.append((ours, said))
            else:
                ours.send(said)

        ours.connect_to_server().on_message(pass_on)

    page.route_web_socket(re.compile("/session"), connect)
    page.goto(server.address)
    drawn(page)
    files = page.get_by_label("scenario", exact=True).first
    files.select_option("talkitout_oracle.yaml")
    until(page, lambda: bool(held))
    page.locator(".cm-content").click()
    page.keyboard.type("# typed meanwhile")
    ((route, said),) = held
    with another_room(page):
        route.send(said)
    until(page, lambda: "# typed meanwhile" in drafts(folder))
    with another_room(page):
        files.select_option("talkitout.yaml")
    assert "# typed meanwhile" in page.locator(".cm-content").inner_text()
    assert page.get_by_text("not saved; a draft is kept").is_visible()


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


def type_at_the_end_of(page: Page, word: str, text: str) -> None:
    page.locator(".cm-content").get_by_text(word, exact=True).click()
    page.keyboard.press("End")
    page.keyboard.type(text)
    page.get_by_text("not saved; a draft is kept").wait_for()


def test_what_each_of_two_windows_has_typed_is_kept(studio: Page, server: Server, folder: Path) -> None:
    other = studio.context.new_page()
    other.goto(server.address)
    drawn(other)
    type_at_the_end_of(studio, "horizon", " # mine")
    type_at_the_end_of(other, "horizon", " # theirs")
    other.keyboard.press("Control+s")
    other.get_by_text("saved", exact=True).wait_for()
    studio.on("dialog", lambda dialog: dialog.accept())
    studio.reload()
    studio.locator(".cm-content", has_text="# mine").wait_for()
    studio.get_by_text("the file was changed elsewhere since").wait_for()
    studio.locator(".cm-content").focus()
    studio.keyboard.press("Control+s")
    studio.get_by_text("was changed elsewhere since it was opened here").wait_for()
    studio.get_by_role("button", name="Keep mine").click()
    studio.get_by_text("saved", exact=True).wait_for()
    assert "# mine" in (folder / "talkitout.yaml").read_text()
    studio.get_by_role("button", name="Another draft").click()
    studio.get_by_role("button", name="Open the draft of").click()
    studio.locator(".cm-content", has_text="# theirs").wait_for()
    studio.get_by_text("not saved; a draft is kept").wait_for()
    other.close()


def test_a_window_that_is_open_goes_on_after_a_new_start(browser: Browser, tmp_path: Path) -> None:
    folder, state = tmp_path / "folder", tmp_path / "state"
    folder.mkdir()
    fill(folder)
    page = browser.new_page()
    with served(folder / "talkitout.yaml", state, "--port", "0") as address:
        page.goto(address)
        drawn(page)
    page.get_by_text("the connection to the studio was lost").wait_for()
    page.locator(".cm-content").get_by_text("horizon", exact=True).click()
    page.keyboard.press("Home")
    page.keyboard.type("z")
    page.get_by_text("not saved; there is no connection").wait_for()
    with served(folder, state) as again:
        assert again == address
        page.locator(".stage.stale").wait_for()
        until(page, lambda: "zhorizon" in drafts(folder))
        page.locator(".cm-lintRange-error").first.wait_for()  # the language server is there again, too
        page.keyboard.press("Backspace")
        drawn(page)
        page.keyboard.press("Escape")
        page.keyboard.press("ArrowUp")
        reach(page, 1)
    page.close()


def test_one_window_too_many_is_told_and_comes_in_when_another_is_closed(
    browser: Browser, tmp_path: Path
) -> None:
    folder = tmp_path / "folder"
    folder.mkdir()
    fill(folder)
    first, second = browser.new_page(), browser.new_page()
    with served(folder / "talkitout.yaml", tmp_path / "state", "--port", "0", "--windows", "1") as address:
        first.goto(address)
        drawn(first)
        second.goto(address)
        second.get_by_text("as many windows are open as may be (1); close one").wait_for()
        first.close()
        drawn(second)
    second.close()


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
    studio.locator(".message.bad", has_text="✗ failure").wait_for()

    with studio.expect_download() as download:
        studio.get_by_role("button", name="Replay").click()
    page = tmp_path / "exported.html"
    download.value.save_as(page)
    studio.context.set_offline(True)
    replay = studio.context.new_page()
    replay.goto(page.as_uri())
    replay.get_by_label("step", exact=True).fill("4")
    assert replay.locator(".controls output").inner_text().startswith("step 4 of ")


def test_as_the_agent_sees_it_there_is_no_room(studio: Page) -> None:
    begin(studio, SEED)
    studio.get_by_role("checkbox", name="as the agent sees it").check()
    beside = Episode("talkitout")
    seen = studio.locator(".seat pre")
    assert (
        seen.text_content() == f"{TextView(beside.env.program, 'grid').observe(*beside.env.reset(seed=SEED))}"
    )
    assert (
        "An episode ends with success, with failure, or after 100 turns"
        in studio.locator(".seat p").inner_text()
    )
    for hidden in (".stage", ".cast", ".why", ".counts", ".writing", ".sight"):
        assert not studio.locator(hidden).first.is_visible()
    studio.keyboard.press("x")
    studio.locator(".message.bad", has_text="✗ no success").wait_for()
    assert studio.locator(".controls output").inner_text() == "step 1"
    studio.get_by_role("checkbox", name="as the agent sees it").uncheck()
    studio.locator(".message.bad", has_text="✗ failure").wait_for()
    assert studio.locator(".stage").is_visible()


def free_cell(page: Page) -> tuple[int, int]:
    """A cell beside the walls where nobody is."""
    size = re.search(r"Room of (\d+) by (\d+)", room(page))
    assert size is not None
    width, height = map(int, size.groups())
    taken = {tuple(map(int, pair)) for pair in re.findall(r"at (\d+), (\d+)", room(page))}
    return next((i, j) for i in range(1, width - 1) for j in range(1, height - 1) if (i, j) not in taken)


def place(page: Page, who: str) -> tuple[int, int]:
    at = re.search(rf"{who} \([^)]*\) at (\d+), (\d+)", room(page))
    assert at is not None
    return int(at[1]), int(at[2])


@pytest.fixture
def shy(page: Page, server: Server, folder: Path) -> Page:
    """The studio with a scenario of which claims and tests fail."""
    (folder / "talkitout.yaml").rename(folder / "other.yaml")
    (folder / "talkitout_oracle.yaml").unlink()
    (folder / "talkitout.yaml").write_text(SHY)
    page.goto(server.address)
    drawn(page)
    return page


def test_a_violated_claim_stands_beside_its_line_and_opens_its_room(shy: Page) -> None:
    shy.get_by_role("button", name="Check the claims").click()
    claim = shy.get_by_role("list", name="claims").get_by_role("listitem").filter(has_text="never")
    claim.get_by_text("✗ fails").wait_for(timeout=90_000)
    assert "it can happen in 100 of 100 rooms" in claim.inner_text()
    assert shy.get_by_role("tab", name="Claims 2 of 4").get_attribute("aria-selected") == "true"
    box = claim.bounding_box()
    assert box is not None
    assert box["y"] + box["height"] < 800, "it is seen without scrolling"
    shy.locator(".cm-line", has_text="check:").locator(".cm-verdict", has_text="✗ fails").first.wait_for()
    claim.get_by_role("button", name="Show room 0 of seed 0").click()
    reach(shy, 2)
    shy.locator(".cast td.changed", has_text="helped").wait_for()
    shy.locator(".transcript li.now", has_text="Go to the green door.").wait_for()
    rival = shy.get_by_role("listitem").filter(has_text="rival: hasty")
    rival.get_by_role("button", name="Show room").click()
    shy.locator(".message.good", has_text="success").wait_for()
    assert shy.get_by_label("who plays").input_value() == "+hasty"
    # What is found is about the text as it was.
    shy.locator(".cm-content").get_by_text("horizon", exact=True).click()
    shy.keyboard.press("End")
    shy.keyboard.type("0")
    until(shy, lambda: shy.locator(".cm-verdict").count() == 0)
    assert "outdated" in (shy.locator("#claims-panel > div").get_attribute("class") or "")


def test_a_failing_test_opens_at_its_step_and_play_becomes_a_test(shy: Page, folder: Path) -> None:
    shy.get_by_role("button", name="Run the tests").click()
    failing = shy.get_by_role("list", name="tests").get_by_role("listitem").filter(has_text="told_from_afar")
    failing.get_by_text("distance(agent) <= 2 is false: distance(agent) is 3").wait_for()
    shy.get_by_role("listitem").filter(has_text="gives_up").get_by_text("✓ passes").wait_for()
    failing.get_by_role("button", name="Show room 0 of seed 0").click()
    reach(shy, 2)
    shy.locator(".transcript li.now", has_text="Where is the exit").wait_for()
    shy.keyboard.press("ArrowUp")
    reach(shy, 3)

    beside = folder / "talkitout.tests.yaml"
    shy.get_by_role("button", name="Make a test…").click()
    shy.get_by_label("name of the test").fill("from_afar")
    assert "from_afar:" in shy.get_by_label("the test", exact=True).inner_text()
    assert not beside.exists()
    with another_room(shy):
        shy.get_by_role("button", name="Put it into talkitout.tests.yaml").click()
    shy.get_by_text("talkitout.tests.yaml was made, with the test").wait_for()
    first = beside.read_text()
    assert "from_afar:" in first

    # Another one is put into the text, and is written when that is saved.
    shy.locator(".stage").click()
    shy.keyboard.press("x")
    reach(shy, 1)
    shy.get_by_role("button", name="Make a test…").click()
    shy.get_by_label("name of the test").fill("gives_up")
    shy.get_by_role("button", name="Put it into talkitout.tests.yaml").click()
    shy.get_by_text("not saved; a draft is kept").wait_for()
    assert beside.read_text() == first
    shy.get_by_role("button", name="Run the tests").click()
    shy.get_by_role("tab", name="Tests ✓").wait_for()
    assert shy.get_by_role("list", name="tests").get_by_role("listitem").count() == 2
    shy.locator(".cm-content").focus()
    shy.keyboard.press("Control+s")
    until(shy, lambda: "gives_up:" in beside.read_text())
    assert first.removesuffix("\n") in beside.read_text()


def test_the_view_of_a_member_of_the_cast_is_shown(shy: Page) -> None:
    views, words = shy.get_by_label("whose view"), shy.locator(".sight p")
    sight, stage = shy.locator(".sight canvas"), shy.locator(".stage canvas")
    pixels = "one => one.toDataURL()"
    assert "the agent's own view" in (sight.get_attribute("aria-label") or "")
    of_agent = sight.evaluate(pixels), stage.evaluate(pixels)
    views.select_option("guide")
    words.filter(has_text="guide sees door.").wait_for()
    assert stage.evaluate(pixels) != of_agent[1], "what it sees is marked in the room"
    shy.locator(".message").click()
    shy.keyboard.press("ArrowUp")
    reach(shy, 1)
    words.filter(has_text="guide sees agent, door.").wait_for()
    # The guide, which looks left, has the agent straight ahead and the door to its right.

    def cell(column: int, row: int) -> str:
        place = f"{32 * column + 4}, {32 * row + 4}, 24, 24"
        return str(sight.evaluate(f"one => [...one.getContext('2d').getImageData({place}).data].join()"))

    floor = cell(3, 5)
    assert cell(3, 3) != floor
    assert cell(6, 4) != floor
    assert cell(4, 5) == floor
    shy.keyboard.press("u")
    reach(shy, 0)
    words.filter(has_text="guide sees door.").wait_for()
    views.select_option("the agent")
    until(shy, lambda: (sight.evaluate(pixels), stage.evaluate(pixels)) == of_agent)


def test_the_wizard_is_dragged(studio: Page) -> None:
    begin(studio, SEED)
    (x, y), free = place(studio, "wizard"), free_cell(studio)
    size = re.search(r"Room of (\d+)", room(studio))
    box = studio.locator(".stage canvas").bounding_box()
    assert box is not None
    assert size is not None
    cell = box["width"] / int(size[1])
    studio.mouse.move(box["x"] + (x + 0.5) * cell, box["y"] + (y + 0.5) * cell)
    studio.mouse.down()
    studio.mouse.move(box["x"] + (free[0] + 0.5) * cell, box["y"] + (free[1] + 0.5) * cell)
    assert studio.locator(".target").is_visible()
    studio.mouse.up()
    studio.get_by_text(f"wizard was put at {free[0]}, {free[1]}").wait_for()
    assert place(studio, "wizard") == free


def move_by_keys(page: Page, who: str, to: tuple[int, int]) -> None:
    x, y = place(page, who)
    page.keyboard.press("m")
    page.keyboard.type(who)
    page.keyboard.press("Tab")
    page.keyboard.press("Enter")
    page.get_by_text(f"{who} to {x}, {y}").wait_for()
    for key, times in (
        ("ArrowRight", to[0] - x),
        ("ArrowLeft", x - to[0]),
        ("ArrowDown", to[1] - y),
        ("ArrowUp", y - to[1]),
    ):
        for _ in range(times):
            page.keyboard.press(key)
    page.get_by_text(f"{who} to {to[0]}, {to[1]}").wait_for()
    page.keyboard.press("Enter")
    page.get_by_text(f"{who} was put at {to[0]}, {to[1]}").wait_for()


def test_a_thing_is_moved_by_the_keyboard_and_its_room_becomes_a_suite(studio: Page, folder: Path) -> None:
    begin(studio, SEED)
    free = free_cell(studio)
    move_by_keys(studio, "wizard", free)
    assert place(studio, "wizard") == free
    studio.get_by_role("button", name="Layout…").click()
    with another_room(studio):
        studio.get_by_role("button", name="Begin so in a new suite").click()
    assert studio.locator("h1").inner_text() == "talkitout_known.yaml"
    begin(studio, 77)
    assert place(studio, "wizard") == free

    # In a suite the layout is changed in the text, and that can be undone.
    file = folder / "talkitout_known.yaml"
    written = file.read_text()
    other = free_cell(studio)
    move_by_keys(studio, "wizard", other)
    studio.get_by_role("button", name="Layout…").click()
    studio.get_by_role("button", name="Write it into the text").click()
    studio.get_by_text("not saved; a draft is kept").wait_for()
    studio.keyboard.press("Control+s")
    studio.get_by_text("saved", exact=True).wait_for()
    line = f"wizard: {{at: [{other[0]}, {other[1]}],"
    assert line in file.read_text()
    assert line not in written
    studio.locator(".cm-content").focus()
    studio.keyboard.press("Control+z")
    studio.keyboard.press("Control+s")
    until(studio, lambda: file.read_text() == written)


def test_the_script_is_watched_and_sentences_are_built(studio: Page) -> None:
    unasked = studio.locator(".counts li", has_text="not asked yet")
    assert "0× honest.courtesy.acquainted.then[0]" in unasked.all_inner_texts()[3]
    studio.get_by_label("template", exact=True).select_option("How are <noun>")
    studio.get_by_label("noun").select_option("you")
    studio.get_by_role("button", name="Say").click()
    studio.locator(".transcript li", has_text="How are you").wait_for()
    with another_room(studio):
        studio.get_by_label("who plays").select_option("script")
    studio.get_by_role("button", name="watch").click()
    studio.locator(".controls output").filter(has_text=re.compile(r"step ([2-9]|\d\d) ·")).wait_for()
    fired = studio.locator(".counts li", has_text=re.compile("^[1-9]"))
    fired.first.wait_for()
    # What fired is counted over the episodes since the text was changed.
    studio.get_by_role("button", name="Another room").click()
    studio.locator(".counts small", has_text=re.compile(r"[1-9]× in 3 episodes")).first.wait_for()


def test_who_can_play_comes_first(shy: Page) -> None:
    players = shy.get_by_label("who plays")
    assert players.locator("> option").all_inner_texts() == ["me", "random"]
    first, *_, last = players.locator("optgroup").evaluate_all("all => all.map(one => one.label)")
    assert (first, last) == ("rivals, which lack the skill", "trained on other scenarios")
    with another_room(shy):
        players.select_option("rival hasty")
    shy.get_by_role("button", name="watch").click()
    shy.locator(".message.good", has_text="success").wait_for()
    with another_room(shy):
        shy.get_by_role("button", name="Another room").click()
    assert players.input_value() == "+hasty"
    with another_room(shy):
        players.select_option("me")
    with another_room(shy):
        shy.get_by_label("scenario", exact=True).and_(shy.locator("select")).select_option("other.yaml")
    assert "trained on it" in players.locator("optgroup").evaluate_all("all => all.map(one => one.label)")


def test_a_recipe_of_the_cookbook_is_copied(studio: Page, folder: Path) -> None:
    studio.get_by_role("button", name="New…").click()
    copies = studio.get_by_label("scenario to copy")
    headings = copies.locator("optgroup").evaluate_all("all => all.map(one => one.label)")
    assert "the cookbook: one idea each" in headings
    assert "new scenarios" in headings
    copies.select_option("cookbook/shy")
    with another_room(studio):
        studio.get_by_role("button", name="Open a copy").click()
    assert (folder / "shy.yaml").exists()


def test_a_template_becomes_a_file(studio: Page, folder: Path) -> None:
    studio.get_by_role("button", name="New…").click()
    studio.get_by_label("name").fill("mine")
    with another_room(studio):
        studio.get_by_role("button", name="Begin with the template").click()
    assert studio.locator("h1").inner_text() == "mine.yaml"
    assert (folder / "mine.yaml").exists()


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a run that has learnt next to nothing."""
    pytest.importorskip("torch", reason="no trained agent without the extra `train`")
    out = tmp_path_factory.mktemp("run") / "tiny"
    words = [
        "--frames",
        "1024",
        "--envs",
        "16",
        "--eval-episodes",
        "2",
        "--device",
        "cpu",
        "--recipe",
        "plain",
    ]
    assert run_main([str(SCENARIOS / "talkitout.yaml"), *words, "--out", str(out)]) == 0
    return out


def test_a_trained_agent_is_watched_with_what_it_expects(
    run: Path, page: Page, server: Server, folder: Path
) -> None:
    shutil.copytree(run, folder / "runs" / "tiny")
    page.goto(server.address)
    drawn(page)
    with another_room(page):
        page.get_by_label("who plays").select_option("runs/tiny")
    page.get_by_role("button", name="watch").click()
    page.locator(".controls output").filter(has_text=re.compile(r"step [1-9]")).wait_for()
    page.locator(".mind", has_text="expecting a return of").wait_for()
    assert page.locator(".mind caption", has_text="moves").count() == 1
    page.locator(
        ".message", has_text=re.compile("[✓✗]")
    ).wait_for()  # it plays to the end, and stops by itself
    page.get_by_role("button", name="watch").wait_for()
    last = step(page)
    page.get_by_role("button", name="step back").click()
    reach(page, last - 1)
    page.get_by_role("button", name="one step").click()
    reach(page, last)


def test_a_window_closed_in_the_middle_of_a_save_loses_nothing(
    studio: Page, server: Server, folder: Path
) -> None:
    file = folder / "talkitout.yaml"
    before = file.read_text()
    typed = before.replace("horizon: 100", "horizon: 100 # typed in haste")
    studio.locator(".cm-content").get_by_text("horizon", exact=True).click()
    studio.keyboard.press("End")
    studio.keyboard.type(" # typed in haste")
    until(studio, lambda: "# typed in haste" in drafts(folder))
    studio.keyboard.press("Control+s")
    studio.close()
    page = studio.context.new_page()
    page.goto(server.address)
    drawn(page)
    page.locator(".cm-content", has_text="# typed in haste").wait_for()
    assert file.read_text() in (before, typed)


NAMELESS = """() => [...document.querySelectorAll("button, input, select, canvas[role], svg[role], [tabindex]")]
  .filter((one) => !one.ariaLabel && !one.labels?.length && !one.textContent.trim() && !one.title)
  .map((one) => one.outerHTML)"""


def test_who_waits_for_the_first_room_is_told_what_for(page: Page, server: Server, folder: Path) -> None:
    """On a new machine the engine is compiled first; until then nothing was found to be right either."""
    kept: list[str] = []
    held = True

    def connect(ours: WebSocketRoute) -> None:
        theirs = ours.connect_to_server()
        theirs.on_message(lambda said: kept.append(said) if held and '"draw"' in said else ours.send(said))
        routes.append(ours)

    routes: list[WebSocketRoute] = []
    page.route_web_socket(re.compile("/session"), connect)
    page.goto(server.address)
    page.get_by_text("while the engine is compiled").wait_for()
    assert not page.get_by_text("Nothing is wrong in this file.").is_visible()
    until(page, lambda: bool(kept))
    held = False
    routes[0].send(kept[0])
    drawn(page)
    assert page.get_by_text("Nothing is wrong in this file.").is_visible()
    assert not page.get_by_text("while the engine is compiled").is_visible()


def test_everything_has_a_name_for_screen_readers(studio: Page) -> None:
    nameless = studio.evaluate(NAMELESS)
    assert nameless == []
    tree = studio.locator("body").aria_snapshot()
    assert '- img "Room of' in tree
    assert '- combobox "who plays"' in tree
    assert '- textbox "text of talkitout.yaml"' in tree


def test_the_keyboard_leaves_the_text_as_the_page_says(studio: Page) -> None:
    studio.get_by_label("text of talkitout.yaml").focus()
    studio.keyboard.press("Escape")
    studio.keyboard.press("Tab")
    assert studio.evaluate("document.activeElement.closest('.text')") is None
    assert studio.evaluate("document.activeElement !== document.body")
    studio.get_by_text("Keys and colours").click()
    assert studio.get_by_text("In the text Tab indents; Esc leaves it.").is_visible()
    assert studio.get_by_text("saved", exact=True).is_visible()


def test_a_folder_without_scenarios_offers_templates(page: Page, server: Server, folder: Path) -> None:
    for file in folder.glob("*.yaml"):
        file.unlink()
    page.goto(server.address)
    page.get_by_text("Begin with a template").wait_for()
    with another_room(page):
        page.get_by_role("button", name="Open a copy").click()
    assert page.locator("h1").inner_text().endswith(".yaml")


def test_a_file_that_is_no_text_is_refused_and_the_open_one_stays(studio: Page, folder: Path) -> None:
    (folder / "binary.yaml").write_bytes(bytes(range(256)))
    studio.reload()
    drawn(studio)
    studio.get_by_label("scenario", exact=True).and_(studio.locator("select")).select_option("binary.yaml")
    studio.locator(".message", has_text="binary.yaml").wait_for()
    assert studio.locator("h1").inner_text() == "talkitout.yaml"
    assert "scenario: talkitout" in studio.locator(".cm-content").inner_text()


@pytest.fixture
def levers(page: Page, server: Server, folder: Path) -> Page:
    """The studio with a scenario of two seats."""
    for name in ("levers_together.yaml", "levers_together_oracle.yaml"):
        shutil.copy(SCENARIOS / "together" / name, folder)
    page.goto(server.address)
    drawn(page)
    with another_room(page):
        page.get_by_label("scenario", exact=True).and_(page.locator("select")).select_option(
            "levers_together.yaml"
        )
    return page


def test_a_person_plays_another_seat_beside_a_script(levers: Page, tmp_path: Path) -> None:
    beside = sd.make("together/levers_together+oracle", seats={"agent": "script"}).unwrapped
    observation, info = beside.reset(seed=SEED)
    reads = TextView(beside.program, "grid")  # type: ignore[attr-defined]
    begin(levers, SEED)
    with another_room(levers):
        levers.get_by_label("whose seat").select_option("partner")
    assert levers.get_by_label("who plays agent").input_value() == "script"
    levers.get_by_role("checkbox", name="as Bob sees it").check()
    assert levers.locator(".seat h2").inner_text().lower() == "as bob sees it"
    assert levers.locator(".seat pre").text_content() == reads.observe(observation, info)
    for hidden in (".stage", ".seats", ".why"):
        assert not levers.locator(hidden).first.is_visible()
    levers.keyboard.press("ArrowUp")
    levers.locator(".controls output", has_text="step 1").wait_for()
    before = observation
    observation, _, _, _, info = beside.step(beside.encode_action(("forward", None)))  # type: ignore[attr-defined]
    seen = reads.observe(observation, info, LastStep("forward", before["image"]))
    assert levers.locator(".seat pre").text_content() == seen

    levers.get_by_role("checkbox", name="as Bob sees it").uncheck()
    rows = levers.locator(".seats tbody tr").all_inner_texts()
    assert ["script" in rows[0], "me" in rows[1], "forward" in rows[1]] == [True] * 3
    with levers.expect_download() as download:
        levers.get_by_role("button", name="Replay").click()
    page = tmp_path / "exported.html"
    download.value.save_as(page)
    replay = levers.context.new_page()
    replay.goto(page.as_uri())
    assert replay.locator(".seats tbody tr").count() == 2
    replay.close()


def test_the_other_seat_is_left_empty_and_a_script_is_watched_on_it(levers: Page) -> None:
    with another_room(levers):
        levers.get_by_label("who plays partner").select_option("nobody")
    levers.keyboard.press("ArrowUp")
    reach(levers, 1)
    assert levers.locator(".seats tbody tr").nth(1).locator("td").nth(1).inner_text() == "none"
    with another_room(levers):
        levers.get_by_label("whose seat").select_option("partner")
    with another_room(levers):
        levers.get_by_label("who plays", exact=True).select_option("script")
    levers.get_by_role("button", name="watch").click()
    levers.locator(".message.good", has_text="success").wait_for()
    assert levers.evaluate(NAMELESS) == []
    with another_room(levers):
        levers.get_by_role("button", name="again").click()
    assert levers.get_by_label("whose seat").input_value() == "partner"
    assert levers.get_by_label("who plays agent").input_value() == "script"


def test_where_one_plays_alone_there_are_no_seats_to_choose(studio: Page) -> None:
    assert not studio.get_by_label("whose seat").is_visible()
    assert not studio.locator(".seats").is_visible()


def test_two_people_play_in_browsers_of_their_own(levers: Page, browser: Browser) -> None:
    begin(levers, SEED)
    levers.get_by_role("button", name="Invite…").click()
    link = levers.get_by_label("link to the seat of partner").input_value()
    levers.get_by_role("button", name="Close").click()
    context = browser.new_context(viewport={"width": 900, "height": 900})
    other = context.new_page()
    failures: list[str] = []
    other.on("pageerror", lambda error: failures.append(str(error)))
    other.goto(link)
    other.get_by_role("heading", name="You are Bob").wait_for()
    levers.get_by_text("Bob is here").wait_for()
    assert "token" not in other.content()

    levers.keyboard.press("ArrowLeft")
    levers.get_by_text("waiting for the others").wait_for()
    other.get_by_text("the others wait for you").wait_for()
    assert step(levers) == 0
    other.keyboard.press("/")
    other.keyboard.type("right ready")
    other.keyboard.press("Enter")
    reach(levers, 1)
    rows = levers.locator(".seats tbody tr").all_inner_texts()
    assert ["left" in rows[0], "a person" in rows[1], "right" in rows[1], "ready" in rows[1]] == [True] * 4
    other.get_by_role("heading", name="Step 1").wait_for()

    other.keyboard.press("Escape")
    forward = other.get_by_role("button", name="forward")
    forward.press("Enter")
    other.get_by_text("you have chosen; waiting for the others").wait_for()
    levers.get_by_text("Bob is here and has chosen").wait_for()
    levers.get_by_label("what to do or say").fill("forward now")
    levers.get_by_label("what to do or say").press("Enter")
    reach(levers, 2)
    other.locator(".transcript li", has_text="Ann: now").wait_for()
    assert forward.evaluate("button => button === document.activeElement"), (
        "the next step can be chosen likewise"
    )

    levers.reload()
    drawn(levers)
    other.get_by_text("nobody else can have the seat of partner").wait_for()
    with another_room(levers):
        levers.get_by_label("scenario", exact=True).and_(levers.locator("select")).select_option(
            "levers_together.yaml"
        )
    other.get_by_role("heading", name="Step 0").wait_for()
    context.close()
    assert failures == []
    levers.keyboard.press("Escape")
    levers.keyboard.press("ArrowUp")
    reach(levers, 1)

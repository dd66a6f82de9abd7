"""The page of a study in a real browser: by the keyboard alone, in each language, on a phone, and loaded again."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from socialai_dsl.frontend import check
from socialai_dsl.study.words import words_of

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

ROOT = Path(__file__).parents[2]


def test_a_participant_comes_to_the_end_by_the_keyboard_alone(page: Page, link: Callable[[str], str]) -> None:
    words = words_of("en")
    page.goto(link("en"))
    for button in (words["agree"], words["next"]):
        page.get_by_role("button", name=button).wait_for()
        for _ in range(10):
            if page.evaluate("document.activeElement.textContent") == button:
                break
            page.keyboard.press("Tab")
        page.keyboard.press("Enter")
    page.get_by_text("Round 1 of 1").wait_for()
    page.keyboard.press("ArrowUp")
    page.get_by_text("Step 1").wait_for()
    assert page.get_by_role("img", name=words["sees"]).is_visible()
    page.reload()
    page.get_by_text("Step 1").wait_for()
    page.keyboard.press("/")
    page.keyboard.press("ArrowDown")
    page.keyboard.press("Tab")
    page.keyboard.press("Enter")
    page.get_by_text("Step 2").wait_for()
    page.get_by_role("heading", level=1).focus()
    page.keyboard.press("x")  # done, which ends this scenario
    page.get_by_text(words["failure"]).wait_for()
    page.keyboard.press("Enter")  # the button to go on has the focus
    page.get_by_text("How was it?").wait_for()
    page.get_by_role("button", name=words["next"]).click()
    assert page.get_by_text(words["answer"]).count() == 2
    page.get_by_role("textbox").fill("well")
    page.get_by_role("radio", name="2").check()
    page.get_by_role("button", name=words["next"]).click()
    page.get_by_text("DONE-1").wait_for()


READ = """async ([words, heard]) => {
  const { Screen } = await import("/static/screen.js");
  const screen = new Screen(words, () => {}, {}), read = [];
  for (const [t, lines] of heard.entries()) {
    const listed = new Set(screen.heard.children);
    screen.hear({ t, heard: lines });
    read.push([...screen.heard.children].filter((item) => !listed.has(item)).map((item) => item.textContent));
  }
  return [read, [...screen.heard.children].map((item) => item.textContent)];
}"""


def test_a_screen_reader_is_given_new_lines_alone(page: Page, link: Callable[[str], str]) -> None:
    """It reads what is added to the list of what was heard, and the list keeps its last lines only."""
    words = words_of("en")
    page.goto(link("en"))
    page.get_by_role("button", name=words["agree"]).wait_for()
    assert page.get_by_role("main").get_attribute("aria-live") == "polite"  # a new page is read
    hello, again, bye = [1, "Ann: Hello"], [3, "Ann: Hello"], [3, "Bob: Bye"]
    heard = [[], [hello], [hello], [hello, again, bye], [again, bye], [again, bye, [5, "Ann: Hello"]], []]
    read, listed = page.evaluate(READ, [words, heard])
    nothing = words["nothing_heard"]
    assert read == [[nothing], ["Ann: Hello"], [], ["Ann: Hello", "Bob: Bye"], [], ["Ann: Hello"], [nothing]]
    assert listed == [nothing]
    for button in ("agree", "next"):
        page.get_by_role("button", name=words[button]).click()
    page.get_by_text("Round 1 of 1").wait_for()
    assert page.get_by_role("main").get_attribute("aria-live") == "off"


@pytest.mark.parametrize("language", ["de", "fr"])
def test_the_page_speaks_the_language_of_the_study_and_fits_a_phone(
    browser: Browser, link: Callable[[str], str], language: str
) -> None:
    words = words_of(language)
    context = browser.new_context(viewport={"width": 360, "height": 740})
    page = context.new_page()
    page.goto(link(language))
    assert page.evaluate("document.documentElement.lang") == language
    page.get_by_role("button", name=words["agree"]).click()
    page.get_by_role("button", name=words["next"]).click()
    page.get_by_role("button", name=words["forward"]).click()
    page.get_by_text(words["step"].format(number=1)).wait_for()
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    context.close()


OLD = {
    "cannot read the scripts": lambda page: page.route(
        "**/study.js", lambda route: route.fulfill(body="class { ??= }", content_type="text/javascript")
    ),
    "knows no sockets": lambda page: page.add_init_script("delete window.WebSocket"),
    "lacks what the scripts use": lambda page: page.add_init_script(
        "delete Element.prototype.replaceChildren"
    ),
    "cannot get the scripts": lambda page: page.route("**/screen.js", lambda route: route.abort()),
}


@pytest.mark.parametrize(("lacks", "language"), [*zip(OLD, ("en", "de", "fr", "en"), strict=True)])
def test_a_browser_that_cannot_show_the_page_says_what_is_needed(
    lacks: str, language: str, browser: Browser, link: Callable[[str], str]
) -> None:
    context = browser.new_context()
    old = context.new_page()
    OLD[lacks](old)
    old.goto(link(language))
    assert old.inner_text("body").strip() == words_of(language)["script"]
    assert old.get_attribute("html", "lang") == language
    context.close()


def test_a_browser_without_scripts_says_so_and_one_that_can_shows_the_page(
    browser: Browser, page: Page, link: Callable[[str], str]
) -> None:
    address = link("de")
    without = browser.new_context(java_script_enabled=False)
    other = without.new_page()
    other.goto(address)
    assert other.inner_text("noscript") == words_of("de")["script"]
    without.close()
    page.goto(address)
    page.wait_for_selector(".study")
    assert words_of("de")["script"] not in page.inner_text("body")


def test_what_says_so_is_written_for_browsers_of_any_age() -> None:
    """No word or sign that came with ECMAScript 2015 or later, which would keep it from being read at all."""
    text = (ROOT / "socialai_dsl" / "study" / "static" / "old.js").read_text(encoding="utf-8")
    assert (
        re.findall(
            r"=>|`|\?\.|\?\?|\.\.\.|\b(?:let|const|class|async|await|import|export|for\s*\(\w+ of)\b", text
        )
        == []
    )


def test_every_language_has_every_text() -> None:
    english = words_of("en")
    for language in ("de", "fr"):
        own = words_of(language)
        assert own.keys() == english.keys()
        for name, text in own.items():
            assert text.count("{") == english[name].count("{"), name


@pytest.mark.parametrize(
    "file", sorted((ROOT / "experiments" / "studies").glob("*.yaml")), ids=lambda f: f.stem
)
def test_what_ships_has_no_findings(file: Path) -> None:
    assert [str(one) for one in check(file).diagnostics] == []

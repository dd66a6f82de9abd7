"""Pages on a screen and on a telephone, light and dark: axe finds nothing serious, and the keyboard reaches all."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from socialai_dsl.cli.main import main
from tests.browser.test_studio import SCENARIOS, drawn, served
from tests.socialai_dsl.reporting.synthetic import condition, write_experiment

if TYPE_CHECKING:
    from playwright.sync_api import Page

ROOT = Path(__file__).parents[2]
AXE = ROOT / "node_modules" / "axe-core" / "axe.min.js"
READ = ["index", "gallery", "tutorial", "commands"]
"""Pages of the site with all that pages have: pictures, a table, code, and outputs."""
Opener = Callable[["Page", pytest.FixtureRequest, Path], None]
"""Opens a page in a browser, if need be with files in a folder."""


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Some pages of the site; the others, to which their menus lead, are left out."""
    for package in ("sphinx", "myst_parser", "furo", "sphinx_copybutton"):
        pytest.importorskip(package, reason="install the extra docs")
    built = tmp_path_factory.mktemp("site")
    some = "include_patterns=" + ",".join(f"{name}.md" for name in READ)
    command = [sys.executable, "-m", "sphinx", "-Q", "-D", some, str(ROOT / "docs"), str(built)]
    subprocess.run(command, check=True, timeout=200)
    return built


def findings(page: Page) -> list[str]:
    """What axe calls serious or critical, each with the first place."""
    # Without preload, since a page from the disk may not read its own style sheets.
    page.evaluate(AXE.read_text(encoding="utf-8"))
    found = page.evaluate("axe.run({ preload: false })")["violations"]
    return [
        f"{one['id']}: {one['nodes'][0]['html']}" for one in found if one["impact"] in ("serious", "critical")
    ]


CONTROLS = """() => [...document.querySelectorAll("a[href], button, input, select, textarea, summary, [tabindex='0']")]
  .filter((one) => one.tabIndex >= 0 && !one.disabled && one.getClientRects().length
    && one.checkVisibility({ visibilityProperty: true }))"""
UNREACHED = f"() => ({CONTROLS})().filter((one) => !window.reached.has(one)).map((one) => one.outerHTML.slice(0, 120))"


@pytest.fixture
def studio(tmp_path: Path) -> Iterator[str]:
    (tmp_path / "talkitout.yaml").write_text((SCENARIOS / "talkitout.yaml").read_text(encoding="utf-8"))
    with served(tmp_path / "talkitout.yaml", tmp_path / "state", "--port", "0") as address:
        yield address


def open_site(name: str) -> Opener:
    def opened(page: Page, request: pytest.FixtureRequest, folder: Path) -> None:
        page.goto((request.getfixturevalue("site") / f"{name}.html").as_uri())

    return opened


def open_report(page: Page, request: pytest.FixtureRequest, folder: Path) -> None:
    names = [f"{row} / {column}" for row in ("Help", "Dance") for column in ("PPO", "Unsocial")]
    write_experiment(folder, [condition(name, [0.4, 0.5, 0.6]) for name in names])
    assert main(["report", str(folder), "--no-baselines"]) == 0
    page.goto((folder / "report" / "index.html").as_uri())


def open_replay(page: Page, request: pytest.FixtureRequest, folder: Path) -> None:
    file = folder / "episode.html"
    assert main(["replay", "talkitout", "--episodes", "4", "--record", "1", "-o", str(file)]) == 0
    page.goto(file.as_uri())
    page.get_by_role("button", name="play").wait_for()


def open_study(page: Page, request: pytest.FixtureRequest, folder: Path) -> None:
    page.goto(request.getfixturevalue("link")("en"))
    for _ in range(2):  # what people agree to, and the instructions
        page.get_by_role("button").first.click()
    page.get_by_role("img").first.wait_for()


def open_studio(page: Page, request: pytest.FixtureRequest, folder: Path) -> None:
    page.goto(request.getfixturevalue("studio"))
    drawn(page)


PAGES: dict[str, Opener] = {
    **{f"site: {name}": open_site(name) for name in READ},
    "report": open_report,
    "replay": open_replay,
    "study": open_study,
    "studio": open_studio,
}


@pytest.mark.skipif(not AXE.exists(), reason="npm ci brings axe")
@pytest.mark.parametrize("name", PAGES)
def test_everybody_can_use_a_page(
    page: Page, name: str, request: pytest.FixtureRequest, tmp_path: Path
) -> None:
    PAGES[name](page, request, tmp_path)
    for width in (375, 1280):
        page.set_viewport_size({"width": width, "height": 800})
        for scheme in ("light", "dark"):
            page.emulate_media(color_scheme=scheme)
            assert findings(page) == [], f"{width} px, {scheme}"
        assert page.evaluate("document.documentElement.scrollWidth") == width
    page.evaluate("window.reached = new Set(); document.activeElement.blur()")
    for _ in range(page.evaluate(f"({CONTROLS})().length") + 5):
        if page.evaluate("document.activeElement.isContentEditable"):
            page.keyboard.press("Escape")  # leaves the editor, in which the tabulator indents
        page.keyboard.press("Tab")
        page.evaluate("window.reached.add(document.activeElement)")
    assert page.evaluate(UNREACHED) == []

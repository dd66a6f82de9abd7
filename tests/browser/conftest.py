"""A real browser, Debian's Chromium or the one that `CHROMIUM` names; without one these tests are skipped."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

_QUIET = ["--disable-quic", "--no-first-run", "--disable-background-networking", "--disable-component-update"]
STUDY = """\
study: paged
language: {language}
consent: I agree.
instructions: [Walk.]
blocks:
- {{scenario: talkitout_no_liar, episodes: 1}}
questions:
- {{id: how, ask: How was it?}}
- {{id: hard, ask: How hard?, kind: scale, from: 1, to: 3}}
end: {{code: DONE-1}}
"""


@pytest.fixture(scope="session")
def browser() -> Iterator[Browser]:
    sync_api = pytest.importorskip("playwright.sync_api", reason="no browser test without Playwright")
    path = os.environ.get("CHROMIUM") or shutil.which("chromium") or shutil.which("chromium-browser")
    if path is None:
        pytest.skip("no browser test without Chromium")
    # The sandbox of Chromium cannot be had as root.
    root = ["--no-sandbox"] if os.geteuid() == 0 else []
    with sync_api.sync_playwright() as playwright:
        started = playwright.chromium.launch(executable_path=path, args=[*_QUIET, *root])
        yield started
        started.close()


@pytest.fixture
def page(browser: Browser) -> Iterator[Page]:
    """A window of its own, in which no script may fail."""
    context = browser.new_context(viewport={"width": 1280, "height": 800}, offline=False)
    opened = context.new_page()
    failures: list[str] = []
    opened.on("pageerror", lambda error: failures.append(str(error)))
    opened.on("console", lambda said: failures.append(said.text) if said.type == "error" else None)
    yield opened
    context.close()
    assert failures == []


@pytest.fixture
def link(tmp_path: Path) -> Iterator[Callable[[str], str]]:
    """Starts a server of a study in a language, and returns the link of a participant."""
    started: list[subprocess.Popen[str]] = []

    def start(language: str) -> str:
        (tmp_path / "study.yaml").write_text(STUDY.format(language=language), encoding="utf-8")
        command = [sys.executable, "-m", "socialai_dsl", "study", "run", "study.yaml"]
        process = subprocess.Popen(
            [*command, "--port", "0", "--out", str(tmp_path / "out"), "--links", "1"],
            cwd=tmp_path,
            stdout=subprocess.PIPE,
            text=True,
        )
        started.append(process)
        assert process.stdout is not None
        return [process.stdout.readline().strip() for _ in range(4)][3]

    yield start
    for process in started:
        process.terminate()
        process.wait(20)
        assert process.stdout is not None
        process.stdout.close()

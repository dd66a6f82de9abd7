"""The page of a report in a real browser: it fits a telephone, and nothing of it is lost there."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from socialai_dsl.cli.main import main
from tests.socialai_dsl.reporting.synthetic import condition, write_experiment

if TYPE_CHECKING:
    from playwright.sync_api import Page


@pytest.mark.parametrize("width", [375, 1280])
def test_the_page_is_as_wide_as_the_screen(tmp_path: Path, page: Page, width: int) -> None:
    """Wide tables scroll within the page; figures, which are drawn for the narrow one, fit."""
    names = [f"{row} / {column}" for row in ("Help", "Dance") for column in ("PPO", "PPO+Explo", "Unsocial")]
    reference = {"mean": 0.45, "std": 0.05, "source": "paper, Table 2"}
    write_experiment(tmp_path, [condition(name, [0.4, 0.5, 0.6], reference=reference) for name in names])
    assert main(["report", str(tmp_path), "--no-baselines"]) == 0
    page.set_viewport_size({"width": width, "height": 800})
    page.goto((tmp_path / "report" / "index.html").as_uri())
    page.evaluate("document.querySelectorAll('details').forEach(part => part.open = true)")
    assert page.evaluate("document.documentElement.scrollWidth") == width
    for table in page.locator(".scroll").all():
        box = table.bounding_box()
        assert box is not None
        assert box["x"] + box["width"] <= width
    images = page.locator("img").all()
    assert len(images) == 10
    for image in images:
        shown = image.evaluate("image => [image.naturalWidth > 0, image.getBoundingClientRect().right]")
        assert shown[0], "the browser drew it"
        assert shown[1] <= width

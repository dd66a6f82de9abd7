"""`make picture`: the picture of the README can be drawn again, from the README's scenario and the page of a study."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from PIL import Image

if TYPE_CHECKING:
    from playwright.sync_api import Browser

ROOT = Path(__file__).parents[2]
MOST_BYTES = 300_000


def test_the_picture_can_be_drawn_again(browser: Browser, tmp_path: Path) -> None:
    """Fonts differ between machines, so that its size need only be about that of the committed one."""
    assert browser.is_connected()
    drawn = subprocess.run(
        [sys.executable, "-m", "tools.minds_picture", "--out", str(tmp_path)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert drawn.returncode == 0, drawn.stderr
    for file in ("one_room.png", "one_room_phone.png"):
        with Image.open(tmp_path / file) as new, Image.open(ROOT / "docs" / file) as kept:
            assert new.width == kept.width
            assert abs(new.height - kept.height) < 0.2 * kept.height
        assert (tmp_path / file).stat().st_size < MOST_BYTES

"""Files with a mistake that is a slip in a right file, as `tests/diagnostics/*.slips` tell them.

`shop.slips` tells those in `shop.yaml`, each under its name: lines that are there, of which those behind a minus sign
go, and behind plus signs the lines that come after them.
"""

from __future__ import annotations

import re
import shutil
from pathlib import Path

FOLDER = Path(__file__).parent / "diagnostics"


def _slips() -> dict[str, str]:
    """The name and the text of each file that slips make."""
    found = {}
    for file in FOLDER.glob("*.slips"):
        right = file.with_suffix(".yaml").read_text(encoding="utf-8")
        for slip in file.read_text(encoding="utf-8").split("\n\n"):
            name, _, changes = slip.partition(":\n")
            found[name] = _slipped(right, changes)
    return found


def _slipped(text: str, changes: str) -> str:
    """The text after some changes, each of which is about lines that are there once."""
    for change in re.findall(r"(?:[ -].*\n)+(?:\+.*\n)*", f"{changes}\n"):
        lines = [(line[0], line[1:]) for line in change.splitlines(keepends=True)]
        before = "".join(line for mark, line in lines if mark != "+")
        after = "".join(line for mark, line in lines if mark != "-")
        assert f"\n{text}".count(f"\n{before}") == 1, before
        text = f"\n{text}".replace(f"\n{before}", f"\n{after}")[1:]
    return text


SLIPS = _slips()


def write_mistakes(folder: Path) -> None:
    """Fill a folder with all files that have a mistake, and with those that they name."""
    shutil.copytree(
        FOLDER,
        folder,
        ignore=shutil.ignore_patterns("*.out", "*.py", "*.slips", "found.txt"),
        dirs_exist_ok=True,
    )
    for name, text in SLIPS.items():
        (folder / f"{name}.yaml").write_text(text, encoding="utf-8")

"""The pages of the docs make a site: every page is in its index, and Sphinx has nothing to warn of."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[1] / "docs"


def listed(index: Path) -> set[Path]:
    """The pages that an index leads to."""
    pages: set[Path] = set()
    for tree in re.findall(
        r"^```\{toctree\}\n(.*?)^```", index.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL
    ):
        for line in tree.splitlines():
            if line and not line.startswith(":"):
                pages |= set(index.parent.glob(f"{line}.md"))
    return pages


def test_every_page_is_in_an_index() -> None:
    pages = set(DOCS.rglob("*.md")) - {DOCS / "index.md"}
    indices = (DOCS / "index.md", DOCS / "diagnostics" / "index.md", DOCS / "api" / "index.md")
    assert pages - set().union(*map(listed, indices)) == set()


@pytest.mark.slow
def test_the_site_is_built_without_a_warning(tmp_path: Path) -> None:
    pytest.importorskip("sphinx", reason="install the extra docs")
    pytest.importorskip("myst_parser", reason="install the extra docs")
    command = [sys.executable, "-m", "sphinx", "-q", "-W", "-n", "--keep-going", str(DOCS), str(tmp_path)]
    built = subprocess.run(command, capture_output=True, text=True, timeout=280)
    assert built.returncode == 0, built.stderr
    assert "Small scenarios, each about one idea" in (tmp_path / "cookbook.html").read_text(encoding="utf-8")

"""The pages of the docs make a site: every page is in its index, and Sphinx has nothing to warn of."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[1] / "docs"


TREE = re.compile(r"^```\{toctree\}\n(.*?)^```", re.MULTILINE | re.DOTALL)
INDEX = DOCS / "index.md"
MOST_IN_THE_MENU = 28


def led_to(page: Path) -> set[Path]:
    """The pages that a page's own menus lead to."""
    lines = "\n".join(TREE.findall(page.read_text(encoding="utf-8"))).splitlines()
    names = [line for line in lines if line and not line.startswith(":")]
    found = {name: set(page.parent.glob(f"{name}.md")) for name in names}
    assert [name for name, pages in found.items() if not pages] == [], (
        f"{page.name} leads to pages that are not there"
    )
    return set().union(*found.values())


def test_the_menu_leads_to_every_page_and_is_short() -> None:
    menu = led_to(INDEX)
    assert 10 < len(menu) <= MOST_IN_THE_MENU
    reached, new = {INDEX}, menu
    while new:
        reached |= new
        new = set().union(*map(led_to, new)) - reached
    assert set(DOCS.rglob("*.md")) - reached == set()


@pytest.mark.parametrize(
    "page", sorted((DOCS / "results").rglob("*.html")), ids=lambda page: page.parent.name
)
def test_what_a_report_beside_the_pages_links_to_is_there(page: Path) -> None:
    """Their runs are not kept, so no report may lead to the episodes of one."""
    text = page.read_text(encoding="utf-8")
    inside, named = set(re.findall(r' id="([^"]+)"', text)), re.findall(r' (?:href|src)="([^":]+)"', text)
    assert named
    missing = [
        link
        for link in named
        if (link[1:] not in inside if link.startswith("#") else not (page.parent / link).exists())
    ]
    assert missing == []


@pytest.mark.slow
def test_the_site_is_built_without_a_warning(tmp_path: Path) -> None:
    pytest.importorskip("sphinx", reason="install the extra docs")
    pytest.importorskip("myst_parser", reason="install the extra docs")
    command = [sys.executable, "-m", "sphinx", "-q", "-W", "-n", "--keep-going", str(DOCS), str(tmp_path)]
    built = subprocess.run(command, capture_output=True, text=True, timeout=280)
    assert built.returncode == 0, built.stderr
    assert "Small scenarios, each about one idea" in (tmp_path / "cookbook.html").read_text(encoding="utf-8")

"""`make gallery`: every shipped scenario is in it, what is committed is what would be written, its episodes play."""

import re
from pathlib import Path

import pytest

from socialai_dsl.loader.shipped import catalogue
from tools.gallery import AGENTS, DOCS, RELATIONS, SUITES, Line, lines, listed, page, pictures, write_replays
from tools.sheets import alike

GALLERY = (DOCS / "gallery.md").read_text(encoding="utf-8")


def test_the_gallery_has_every_shipped_scenario() -> None:
    assert listed() == {one.name for one in catalogue()}
    for name in listed():
        assert f"`{name}`" in GALLERY or f"`{name}+color`" in GALLERY, name


def test_the_gallery_is_up_to_date() -> None:
    assert page() == GALLERY, "run `make gallery`"
    assert [file for file, drawn in pictures().items() if not alike(file, drawn)] == [], "run `make gallery`"


@pytest.mark.parametrize(
    ("name", "figure", "place"),
    [
        *((name, figure, place) for name, (figure, place) in AGENTS.items()),
        *((name, figure, AGENTS[name][1]) for name, figure in RELATIONS.items()),
    ],
)
def test_success_of_agents_is_as_another_page_has_it(name: str, figure: str, place: str) -> None:
    """In the row of the scenario, or where the page has it in sentences, in the section."""
    page_name, _, heading = place.partition("#")
    text = (DOCS / page_name).read_text(encoding="utf-8")
    if page_name == "mastery.md":
        assert heading == "school-and-novel-scenarios"
        section = text.partition("## School and novel scenarios\n")[2].partition("\n## ")[0]
        assert re.search(rf"(?<!\d){re.escape(figure)}(?!\d)", section)
    else:
        rows = [row for row in text.splitlines() if f"`{name.partition('/')[2]}`" in row]
        assert any(re.search(rf"(?<![\d.]){re.escape(figure)}(?!\d)", row) for row in rows)


def test_every_line_has_a_page_on_which_it_plays() -> None:
    linked = re.findall(r'<a href="replays/([^"]+)">', GALLERY)
    assert sorted(linked) == sorted(f"{line.file}.html" for line in lines())
    assert len(linked) + len(SUITES) > 60


@pytest.mark.parametrize("shown", ["school/boxes+color", "together/help_together"])
def test_a_page_on_which_a_line_plays(tmp_path: Path, shown: str) -> None:
    line = Line(shown)
    write_replays(tmp_path, [line])
    text = (tmp_path / f"{line.file}.html").read_text(encoding="utf-8")
    assert f"<title>{shown}" in text
    assert "3 episodes</title>" in text
    assert "://" not in re.sub(r"http://www\.w3\.org/\S+", "", text.split("<script", 1)[0])

"""Npc files that a `one_of` names are put in the place of their names, and keep the places where they were written."""

from __future__ import annotations

from pathlib import Path

import pytest

from socialai_dsl.diagnostics import ScenarioError
from socialai_dsl.loader.resolved import ResolvedFile, resolve

FILES = {
    "play.yaml": "scenario: play\ncast:\n  guide:\n    name: Gus\n    one_of: npcs/g_*.yaml\n  agent: {}\n",
    "play_short.yaml": "variant: play_short\nof: play.yaml\nset: {cast.guide.one_of: [npcs/g_2.yaml]}\n",
    "play_red.yaml": "variant: play_red\nof: play.yaml\nset: {cast.guide.color: red}\n",
    "npcs/g.yaml": "npc: g\nabstract: true\nkind: base\nframes:\n  lead: {steps: [{do: stay}]}\n",
    "npcs/g_base.yaml": "npc: g_base\nextends: g.yaml\nabstract: true\nview: 3\n",
    "npcs/g_2.yaml": "npc: g_2\nextends: g_base.yaml\nkind: two\n",
    "npcs/g_1.yaml": "npc: g_1\nextends: g.yaml\ncolor: green\n",
}
"""What is read; `g_base` matches the pattern, but nobody can be it."""

FILES_OF_GUIDE = ("cast", "guide", "one_of")


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with the files, in which we work."""
    for name, text in FILES.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def drawn(name: str) -> ResolvedFile:
    return resolve(name).with_drawn_files()


def with_one_of(folder: Path, written: str) -> str:
    """A scenario whose guide draws from what is written."""
    text = FILES["play.yaml"].replace("npcs/g_*.yaml", written)
    (folder / "other.yaml").write_text(text.replace("scenario: play", "scenario: other"), encoding="utf-8")
    return "other.yaml"


def test_a_pattern_stands_for_the_files_that_somebody_can_be_in_order_of_their_names() -> None:
    found = drawn("play.yaml")
    assert [file["npc"] for file in found.tree.at(FILES_OF_GUIDE).data] == ["g_1", "g_2"]
    assert resolve("play.yaml").tree.at(FILES_OF_GUIDE).data == "npcs/g_*.yaml"


def test_a_list_keeps_its_order(folder: Path) -> None:
    found = drawn(with_one_of(folder, "[npcs/g_2.yaml, npcs/g_1.yaml]"))
    assert [file["npc"] for file in found.tree.at(FILES_OF_GUIDE).data] == ["g_2", "g_1"]


def test_files_have_what_they_build_on() -> None:
    _, two = drawn("play.yaml").tree.at(FILES_OF_GUIDE).data
    assert (two["kind"], two["view"], list(two["frames"])) == ("two", 3, ["lead"])
    assert "extends" not in two
    assert not two.get("abstract")


def test_each_part_knows_the_file_it_was_written_in() -> None:
    found = drawn("play.yaml")
    spans = {
        path: (Path(span.file).name, span.line)
        for path in [("cast", "guide", "name"), (*FILES_OF_GUIDE, 0, "color"), (*FILES_OF_GUIDE, 1, "view"),
                     (*FILES_OF_GUIDE, 1, "frames", "lead", "steps", 0, "do")]
        for span in [found.tree.value_span(path)]
    }  # fmt: skip
    assert list(spans.values()) == [("play.yaml", 4), ("g_1.yaml", 3), ("g_base.yaml", 4), ("g.yaml", 5)]


def test_all_files_are_sources() -> None:
    found = drawn("play.yaml")
    assert {Path(name).name for name in found.files} >= {
        "play.yaml",
        "g.yaml",
        "g_base.yaml",
        "g_1.yaml",
        "g_2.yaml",
    }


def test_variants_come_first() -> None:
    assert [file["npc"] for file in drawn("play+short").tree.at(FILES_OF_GUIDE).data] == ["g_2"]
    assert drawn("play+red").tree.at(("cast", "guide", "color")).data == "red"


def test_nothing_to_draw_leaves_everything_as_it_is(folder: Path) -> None:
    (folder / "alone.yaml").write_text(
        "scenario: alone\ncast: {guide: {name: Gus}, agent: {}}\n", encoding="utf-8"
    )
    found = resolve("alone.yaml")
    assert found.with_drawn_files() is found


@pytest.mark.parametrize("written", ["3", "{a: 1}", "true"])
def test_what_names_no_files_is_left_to_the_schema(folder: Path, written: str) -> None:
    assert not isinstance(drawn(with_one_of(folder, written)).tree.at(FILES_OF_GUIDE).data, list | str)


@pytest.mark.parametrize(
    ("written", "code", "said"),
    [
        ("[play.yaml]", "S108", "`play.yaml` is a file of the kind `scenario`; only npc files can be drawn"),
        ("npcs/g_base.yaml", "S108", "`g_base.yaml` is abstract: others build on it, nobody can be it"),
        ("npcs/m_*.yaml", "S504", "no file matches `npcs/m_*.yaml`"),
        ("[npcs/g_1.yaml, npcs/g_11.yaml]", "S504", "there is no file `npcs/g_11.yaml` in ."),
        ("[{npc: one}]", "S104", "the name of a file is a text"),
        ("../elsewhere/g_*.yaml", "S505", ""),
    ],
)
def test_mistakes(folder: Path, written: str, code: str, said: str) -> None:
    name = with_one_of(folder, written)
    with pytest.raises(ScenarioError) as raised:
        drawn(name)
    (found,) = raised.value.diagnostics
    assert (found.code, found.span.file, found.span.line) == (code, "other.yaml", 5)
    assert found.message.startswith(said)

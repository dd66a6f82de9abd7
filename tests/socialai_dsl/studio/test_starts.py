"""What a new scenario begins with: a copy works as it is, beside others of its name too."""

from __future__ import annotations

from pathlib import Path

import pytest

from socialai_dsl.evaluation.scenario_tests import play_tests
from socialai_dsl.frontend import check, closest_script, load
from socialai_dsl.studio import messages
from socialai_dsl.studio.files import FileError, Folder
from socialai_dsl.studio.filing import Filing
from socialai_dsl.studio.starts import offered


def copy(folder: Path, name: str) -> str:
    answer = Filing(Folder(folder), "0" * 16, frozenset()).answer(
        messages.Copy(id=1, do="copy", shipped=name)
    )
    return str(answer["name"])


def files(folder: Path) -> dict[str, str]:
    return {path.relative_to(folder).as_posix(): path.read_text() for path in folder.rglob("*.yaml")}


def test_everything_that_ships_and_the_cookbook_are_offered_with_what_they_are_about() -> None:
    found = dict(offered())
    headings = [
        "templates",
        "new scenarios",
        "the cookbook: one idea each",
        "the paper's scenarios",
        "the School",
    ]
    assert [one for one in found if one in headings] == headings
    assert "novel/sally_anne" in found["new scenarios"]
    assert "cookbook/shy" in found["the cookbook: one idea each"]
    assert "talkitout" in found["the paper's scenarios"]
    assert all(about for names in found.values() for about in names.values())


@pytest.mark.parametrize(
    "name",
    [
        "classics/director_task",
        "talkitout",
        "diverse_exit",
        "novel/sally_anne",
        "school/boxes",
        "cookbook/random_cast",
        "social_env",
    ],
)
def test_a_copy_is_sound_has_its_script_and_is_made_again_beside_itself(tmp_path: Path, name: str) -> None:
    stem = name.rpartition("/")[2]
    assert copy(tmp_path, name) == f"{stem}.yaml"
    first = files(tmp_path)
    assert copy(tmp_path, name) == f"{stem}_2.yaml"
    both = files(tmp_path)
    assert {name: both[name] for name in first} == first
    for file in both:
        if file.startswith(stem):
            assert not check(str(tmp_path / file)).has_errors, file
    for called in (f"{stem}.yaml", f"{stem}_2.yaml"):
        script = closest_script(str(tmp_path / called))
        assert {path.parent for path in (script.loaded.resolved.path,)} == {tmp_path}
        assert script.loaded.resolved.path.name in (called, called.replace(".yaml", "_oracle.yaml"))


def test_the_tests_of_a_copy_pass(tmp_path: Path) -> None:
    copy(tmp_path, "novel/sally_anne")
    copy(tmp_path, "novel/sally_anne")
    for name in ("sally_anne.yaml", "sally_anne_2.yaml"):
        played = play_tests([str(tmp_path / name)])
        assert played
        assert not any(one.fails for one in played)
        assert load(str(tmp_path / name)).resolved.path.name == name


def test_what_a_copy_needs_is_never_written_over(tmp_path: Path) -> None:
    (tmp_path / "people").mkdir()
    own = tmp_path / "people" / "formal.yaml"
    own.write_text("npc: mine\n")
    with pytest.raises(FileError, match=r"formal\.yaml exists already"):
        copy(tmp_path, "cookbook/random_cast")
    assert files(tmp_path) == {"people/formal.yaml": "npc: mine\n"}
    for unknown in ("../x", "cookbook/nothing", "talkitout_oracle", ""):
        with pytest.raises(FileError, match="no such scenario to copy"):
            copy(tmp_path, unknown)

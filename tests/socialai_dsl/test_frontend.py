"""From a name to a checked scenario or to findings."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

import socialai_dsl
from socialai_dsl.diagnostics import ScenarioError
from socialai_dsl.frontend import check, load
from socialai_dsl.loader.reader import shipped_folder
from socialai_dsl.source import Source
from tests.fuzzing.playground import listening

ROOT = Path(__file__).parent.parent.parent
SHIPPED = sorted(set(ROOT.glob("scenarios/talkitout*.yaml")) - set(ROOT.glob("scenarios/*.tests.yaml")))
SMALL = ROOT / "tests" / "diagnostics" / "small.yaml"


@pytest.fixture
def write(tmp_path):
    def written(text, name="mine.yaml"):
        file = tmp_path / name
        file.write_text(text)
        return file

    return written


def small(**changes):
    text = SMALL.read_text()
    for old, new in changes.values():
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    return text


@pytest.mark.parametrize("file", SHIPPED, ids=lambda file: file.stem)
def test_shipped_scenarios_are_right_and_short(file):
    result = check(file)
    assert result.diagnostics == ()
    assert result.checked is not None
    scenario, *_ = file.read_text().partition("\nrivals:")
    assert len(scenario.splitlines()) < 60


@pytest.mark.parametrize(
    "name",
    [
        "talkitout+unsocial",
        "talkitout+oracle",
        "talkitout+as_coded",
        "talkitout_no_liar+oracle",
        "talkitout_no_liar+as_coded+unsocial",
    ],
)
def test_variants_resolve(name):
    loaded = load(name)
    assert loaded.name == name
    assert loaded.checked.name == name


def test_the_no_liar_variant_has_one_guide_called_john():
    checked = load("talkitout_no_liar").checked
    assert [e.key for e in checked.entities[:3]] == ["agent", "wizard", "honest"]
    assert checked.entities[2].name.type.words == ("John",)


def test_load_raises_everything_at_once(write):
    file = write(
        small(
            a=("horizon: 50", "horizont: 50"),
            b=("goto: acquainted", "goto: acquaintd"),
            c=("(exit)", "(exitt)"),
        )
    )
    with pytest.raises(ScenarioError) as caught:
        load(file)
    assert [d.code for d in caught.value.diagnostics] == ["S101", "S301", "S201"]
    assert any(name.endswith("mine.yaml") for name in caught.value.sources)


def test_mistakes_of_shape_do_not_hide_those_of_meaning(write):
    file = write(small(a=("horizon: 50", "horizon: soon"), b=("(exit)", "(exitt)")))
    assert [d.code for d in check(file).diagnostics] == ["S104", "S201"]


def test_what_follows_from_a_lost_part_is_not_reported(write):
    file = write(small(a=("let:\n  exit: pick(doors)\n", "let: exit\n")))
    assert [d.code for d in check(file).diagnostics] == ["S104"]


def test_a_renamed_section_is_read_and_its_mistakes_are_found_in_place(write):
    file = write(small(a=("outcome:", "outcomes:"), b=("(exit)", "(exitt)")))
    found = check(file).diagnostics
    assert [(d.code, d.span.line) for d in found] == [("S101", 29), ("S201", 30)]


def test_warnings_do_not_keep_a_scenario_from_running(write):
    text = small(a=("cast:\n", "  lazy:\n    states: {a: {}, b: {}}\ncast:\n"))
    loaded = load(write(text))
    assert [d.code for d in loaded.warnings] == ["W317", "W306"]


def test_a_variant_of_any_scenario_is_right_but_cannot_run():
    result = check(ROOT / "scenarios" / "unsocial.yaml")
    assert result.diagnostics == ()
    assert result.checked is None
    with pytest.raises(ScenarioError, match="S108"):
        load(ROOT / "scenarios" / "unsocial.yaml")


def test_an_abstract_scenario_is_checked_for_its_shape_alone(write):
    assert check(write("scenario: base\nabstract: true\nlet: {exit: pick(doors)}\n")).diagnostics == ()
    found = check(write("scenario: base\nabstract: true\nlett: {exit: pick(doors)}\n")).diagnostics
    assert [d.code for d in found] == ["S101"]


def test_the_prelude_is_a_library_like_any_other():
    for library in (ROOT / "socialai_dsl" / "prelude").glob("*.yaml"):
        assert check(library).diagnostics == ()


# -- parameters ----------------------------------------------------------------------------------------------------

PARAMS = """params:
  pause: {default: 2, values: [0, 2, 5]}
  wall: {default: top, values: {top: wall(top), any: wall(pick(top | left))}}
  who: Zed
  share: 0.5
let:
  number: $pause + 1
"""


def with_params():
    return small(
        a=("let:\n", PARAMS),
        b=("place: each_wall(2), color: distinct", "place: $wall, color: distinct"),
        c=("name: pick(John | Jack)", "name: $who"),
        d=("say: I am fine.", "chance: $share, say: I am fine."),
    )


def test_parameters_stand_for_whole_values_and_inside_expressions(write):
    loaded = load(write(with_params()))
    honest = loaded.checked.entities[1]
    assert honest.name.type.words == ("Zed",)
    assert loaded.checked.frames[0].states[0].then[0].chance == 0.5
    (number,) = [s for s in loaded.checked.setup if getattr(s, "path", "") == "let.number"]
    assert number.value.term.value == 3


def test_parameters_are_set_behind_the_name(write):
    loaded = load(f"{write(with_params())}?pause=5&who=Amy&wall=any")
    assert loaded.checked.entities[1].name.type.words == ("Amy",)
    (number,) = [s for s in loaded.checked.setup if getattr(s, "path", "") == "let.number"]
    assert number.value.term.value == 6


@pytest.mark.parametrize(
    ("asked", "message"),
    [
        ("pauze=5", "has no parameter `pauze`; did you mean `pause`?"),
        ("pause=3", "`3` is none of the values of `pause`"),
        ("wall=tops", "`tops` is none of the values of `wall`; did you mean `top`?"),
        ("share=much", "`much` is not of the kind of the default of `share`"),
    ],
)
def test_wrong_parameters(write, asked, message):
    found = check(f"{write(with_params())}?{asked}").diagnostics
    assert [d.code for d in found] == ["S206"]
    assert message in found[0].text


def test_mistakes_inside_a_parameters_value_are_shown_where_it_is_used(write):
    text = small(a=("let:\n", "params: {where: rect(1)}\nlet:\n"), b=("place: each_wall(2)", "place: $where"))
    (found,) = check(write(text)).diagnostics
    assert (found.code, found.span.column) == ("S211", 40)


# -- speed ---------------------------------------------------------------------------------------------------------


def test_only_what_was_loaded_is_compiled():
    with pytest.raises(ValueError, match=r"compile: got 'talkitout'; expected what `load` returns"):
        socialai_dsl.compile("talkitout")


def test_checking_needs_none_of_the_heavy_libraries():
    code = (
        "import sys; from socialai_dsl.frontend import check; assert check('talkitout').checked; "
        "print([m for m in ('numba', 'torch', 'gymnasium', 'numpy') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT, check=True)
    assert done.stdout.strip() == "[]"


# -- what lies outside -------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "named",
    ["../outside/secret.yaml", "linked/secret.yaml", "link.yaml", "{out}/secret.yaml", "./circle.yaml"],
)
@pytest.mark.parametrize(
    "text",
    [
        "experiment: e\nconditions: [{{name: a, scenario: {0}, frames: 1000}}]\n",
        "experiment: e\nconditions: [{{name: a, scenario: help, tests: [{0}], frames: 1000}}]\n",
        "experiment: e\nconditions: [{{name: a, scenario: help, curriculum: {0}, frames: 1000}}]\n",
        "study: s\nconsent: I agree.\nblocks: [{{scenario: {0}, episodes: 1}}]\n",
        "study: s\nconsent: I agree.\npractice: {{scenario: {0}}}\nblocks: [{{scenario: help, episodes: 1}}]\n",
    ],
)
def test_no_file_reads_what_lies_outside_its_folder(named: str, text: str, tmp_path: Path) -> None:
    assert found_outside(text, named, tmp_path) == "S505"


@pytest.mark.parametrize("named", ["../outside/page.md", "linked/page.md", "{out}/page.md", "circle.md"])
@pytest.mark.parametrize("text", ["consent: {0}", "consent: I agree.\ninstructions: [{0}]"])
def test_no_study_shows_what_lies_outside_its_folder(named: str, text: str, tmp_path: Path) -> None:
    text = f"study: s\n{text}\nblocks: [{{{{scenario: help, episodes: 1}}}}]\n"
    assert found_outside(text, named, tmp_path) == "S903"


def found_outside(text: str, named: str, place: Path) -> str:
    """The one finding of a file that names another, which is not opened."""
    own, out = place / "own", place / "outside"
    own.mkdir()
    out.mkdir()
    (out / "secret.yaml").write_text("scenario: secret\nabout: The number is 666.\n")
    (out / "page.md").write_text("The number is 666.\n")
    (own / "linked").symlink_to(out)
    (own / "link.yaml").symlink_to(out / "secret.yaml")
    for name in ("circle.yaml", "circle.md"):
        (own / name).symlink_to(own / name)
    (own / "f.yaml").write_text(text.format(named.format(out=out)))
    with listening() as ear:
        (found,) = check(own / "f.yaml").diagnostics
    assert found.span.file.endswith("f.yaml")
    assert not [path for path in ear.opened if os.path.realpath(path).startswith(str(out))]
    return found.code


@pytest.mark.parametrize("named", ["circle.yaml", "circle"])
def test_links_in_a_circle_are_followed_nowhere_beside_an_unsaved_file(
    named: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("circle.yaml").symlink_to("circle.yaml")
    unsaved = {tmp_path / "draft.yaml": Source("draft.yaml", "scenario: draft\n")}
    assert {found.code for found in check(named, unsaved).diagnostics} <= {"S007", "S504"}
    assert check(named, unsaved).has_errors


@pytest.mark.parametrize("folder", ["ab", "a+b", "c++ d"])
def test_a_folder_may_have_a_plus_in_its_name(folder: str, tmp_path: Path) -> None:
    """Scenarios are named beside the file, and in a folder below it."""
    scenario = (shipped_folder() / "help.yaml").read_text(encoding="utf-8")
    for place in (tmp_path / folder, tmp_path / folder / folder):
        place.mkdir()
        (place / "door.yaml").write_text(
            scenario.replace("scenario: help", "scenario: door"), encoding="utf-8"
        )
    (tmp_path / folder / "study.yaml").write_text(
        "study: doors\nconsent: I agree.\nblocks:\n- {scenario: door.yaml+unsocial, episodes: 1}\n"
        f"- {{scenario: {folder}/door.yaml, episodes: 1}}\n"
    )
    (tmp_path / folder / "experiment.yaml").write_text(
        "experiment: doors\nabout: Two.\nset: {agent: random}\nconditions:\n"
        f"- {{name: one, scenario: door.yaml+unsocial}}\n- {{name: two, scenario: {folder}/door.yaml}}\n"
    )
    for name in ("study", "experiment"):
        found = check(tmp_path / folder / f"{name}.yaml")
        assert [str(one) for one in found.diagnostics if one.severity.name == "ERROR"] == []

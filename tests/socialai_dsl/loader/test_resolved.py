"""Scenarios by name: bases, variants, the files they name, and no file outside their folders."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from socialai_dsl.diagnostics import ScenarioError
from socialai_dsl.loader import reader, resolved
from socialai_dsl.loader.members import check_splits, members_of
from socialai_dsl.loader.reader import MAX_CHAIN, MAX_FILES, MAX_MATCHES
from socialai_dsl.loader.resolved import resolve, shipped_names
from tests.fuzzing.playground import listening

FILES = {
    "shipped/market.yaml": "scenario: market\nhorizon: 10\ncast:\n  anna: {name: Anna}\n  bob: {name: Bob}\n",
    "shipped/market_quiet.yaml": "variant: market_quiet\nof: market.yaml\nremove: [cast.bob]\n",
    "shipped/market.tests.yaml": "tests_of: market.yaml\n",
    "shipped/market_quiet.tests.yaml": "tests_of: market_quiet.yaml\n",
    "shipped/market_quiet_late.yaml": "variant: market_quiet_late\nof: market_quiet.yaml\nset: {horizon: 99}\n",
    "shipped/market_swap.yaml": "variant: market_swap\nof: market.yaml\nset: {cast.anna.name: Swapped}\n",
    "shipped/garden.yaml": "scenario: garden\nhorizon: 20\n",
    "shipped/hidden.yaml": "variant: hidden\nof: any\nset: {observe.npcs: hidden}\n",
    "shipped/both.yaml": "suite: both\nmembers: [market.yaml, garden.yaml]\nsplits:\n  train: {}\n"
    "  test: {replace: {garden.yaml: market_swap.yaml}}\n",
    "shipped/both_tuned.yaml": "variant: both_tuned\nof: both.yaml\nset: {draw: uniform}\n",
    "shipped/deep/inner.yaml": "scenario: inner\nextends: base.yaml\nhorizon: 5\nroom: {size: 6}\n",
    "shipped/deep/base.yaml": "scenario: base\nabstract: true\nroom: {size: 5, occlusion: true}\nskills: [a, b]\n",
    "user/mine.yaml": "scenario: mine\nhorizon: 1\ncast:\n  zoe: {one_of: zoes/z_*.yaml}\n"
    "  yan: {one_of: [zoes/z_2.yaml, zoes/z_1.yaml]}\n",
    "user/mine_loud.yaml": "variant: mine_loud\nof: mine.yaml\nset: {horizon: 2}\n",
    "user/loud.yaml": "variant: loud\nof: any\nset: {horizon: 3}\n",
    "user/dark.yaml": "variant: dark\nof: any\nset: {horizon: 4}\n",
    "user/zoes/z_2.yaml": "npc: z_2\nextends: z.yaml\nkind: two\n",
    "user/zoes/z_1.yaml": "npc: z_1\nkind: one\n",
    "user/zoes/z.yaml": "npc: z\nabstract: true\nkind: base\ncolor: red\n",
    "user/ours.yaml": "variant: ours\nof: market.yaml\nset: {horizon: 7}\n",
    "outside/secret.yaml": "scenario: secret\nhorizon: 666\n",
}

Write = Callable[[str, str], None]


@pytest.fixture(autouse=True)
def write(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Write:
    """A shipped folder and a user's folder, in which we work."""

    def write_file(name: str, text: str) -> None:
        file = tmp_path / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text, encoding="utf-8")

    for name, text in FILES.items():
        write_file(name, text)
    for module in (reader, resolved):
        monkeypatch.setattr(module, "shipped_folder", lambda: tmp_path / "shipped")
    monkeypatch.chdir(tmp_path / "user")
    return write_file


def data(name: str) -> dict[str, Any]:
    found = resolve(name).data
    assert isinstance(found, dict)
    return found


def findings(name: str) -> list[str]:
    with pytest.raises(ScenarioError) as raised:
        resolve(name)
    assert str(raised.value)
    return [str(d) for d in raised.value.diagnostics]


def test_by_shipped_name_and_by_path(tmp_path: Path) -> None:
    assert data("market")["scenario"] == "market"
    assert data("mine.yaml")["scenario"] == "mine"
    assert data("mine")["scenario"] == "mine"
    assert data(str(tmp_path / "shipped" / "market.yaml"))["scenario"] == "market"
    assert data("deep/inner")["scenario"] == "inner"
    assert resolve("mine.yaml", tmp_path / "user").name == "mine"
    assert resolve("user/mine.yaml", tmp_path).path == (tmp_path / "user" / "mine.yaml").resolve()


def test_a_shipped_name_wins_over_a_file_of_the_same_name(write: Write) -> None:
    write("user/market.yaml", "scenario: market\nhorizon: 1234\n")
    assert data("market")["horizon"] == 10
    assert data("market.yaml")["horizon"] == 1234


def test_names_of_variants_and_parameters() -> None:
    found = resolve("market+quiet+hidden?a=1&b=x y")
    assert (found.name, found.kind) == ("market+quiet+hidden", "scenario")
    assert found.params == {"a": "1", "b": "x y"}
    assert found.param_name_span("b").column == len("market+quiet+hidden?a=1&") + 1
    assert found.param_span("b").column == len("market+quiet+hidden?a=1&b=") + 1
    assert list(data("market+quiet")["cast"]) == ["anna"]
    assert resolve("market_quiet").name == "market_quiet"
    assert data("market_quiet") == data("market+quiet")
    assert data("market+hidden")["observe"] == {"npcs": "hidden"}


def test_the_nearest_variant_is_taken() -> None:
    # Of the variant itself, then of what it is a variant of, then for any, beside before shipped.
    assert data("market_quiet+late")["horizon"] == 99
    assert data("market+quiet+late") == data("market_quiet+late")
    found = data("market_quiet+swap")
    assert found["cast"] == {"anna": {"name": "Swapped"}}
    assert data("mine+loud")["horizon"] == 2
    assert data("mine+dark")["horizon"] == 4
    assert data("ours+swap")["cast"]["anna"] == {"name": "Swapped"}
    assert data("ours+dark")["horizon"] == 4
    assert data("mine+hidden")["observe"] == {"npcs": "hidden"}


def test_a_variant_of_a_variant_brings_what_lies_between() -> None:
    found = resolve("market+quiet_late")
    assert found.data == data("market_quiet_late")
    assert [edit.path for edit in found.edits] == ["cast.bob", "horizon"]


def test_a_variant_twice_is_the_variant_once() -> None:
    assert data("market+hidden+hidden") == data("market+hidden")
    assert resolve("market_quiet+quiet").data == data("market_quiet")


def test_unknown_names_are_answered_with_known_ones() -> None:
    assert "S504 there is no scenario `markt`; did you mean `market`?" in findings("markt")[0]
    assert "S504 there is no scenario `mines`; did you mean `mine`?" in findings("mines")[0]
    assert "1:8: S503 `market` has no variant `quit`; did you mean `quiet`?" in findings("market+quit")[0]
    assert "did you mean `hidden`?" in findings("market+hiden")[0]
    assert findings("mines.yaml") == ["mines.yaml:1:1: S007 there is no such file; did you mean `mine.yaml`?"]
    assert "S503 `market` has no variant `garden`" in findings("market+garden")[0]
    with pytest.raises(ScenarioError, match="it has `hidden`, `quiet`, `quiet_late`, `swap`"):
        resolve("market+xyzzy")


def test_what_is_no_file() -> None:
    assert "S007 this is a folder" in findings("zoes")[0]
    assert "S007 this is a folder" in findings("../..")[0]
    os.mkfifo("pipe.yaml")
    assert "S007 this is a pipe" in findings("pipe.yaml")[0]
    assert "S007" in findings("/dev/zero")[0]
    assert "S007" in findings("x" * 3000 + ".yaml")[0]
    os.symlink("loop.yaml", "loop.yaml")
    assert "S007" in findings("loop.yaml")[0]


def test_origins_point_into_the_file_that_wrote_it() -> None:
    found = resolve("market+swap+hidden")
    assert str(found.tree.value_span(("cast", "anna", "name"))).endswith("market_swap.yaml:3:23")
    assert str(found.tree.key_span(("cast", "anna", "name"))).endswith("market_swap.yaml:3:7")
    assert str(found.tree.value_span(("cast", "bob", "name"))).endswith("market.yaml:5:15")
    assert str(found.tree.locate(("observe", "npcs"), 3)).endswith("hidden.yaml:3:24")
    assert str(found.tree.key_span(("cast", "anna", "nothing"))).endswith("market.yaml:4:3")
    assert found.tree.at(("cast", "bob", "name")).data == "Bob"
    assert {Path(name).name for name in found.files if name != "scenario name"} == {
        "market.yaml",
        "market_swap.yaml",
        "hidden.yaml",
    }


def test_extends_merges_mappings_and_replaces_lists() -> None:
    found = resolve("deep/inner")
    assert found.data == {
        "scenario": "inner",
        "room": {"size": 6, "occlusion": True},
        "skills": ["a", "b"],
        "horizon": 5,
    }
    assert str(found.tree.value_span(("room", "occlusion"))).endswith("base.yaml:3:28")
    assert str(found.tree.value_span(("room", "size"))).endswith("inner.yaml:4:14")
    assert data("deep/base")["abstract"] is True


def test_suites_pass_variants_on() -> None:
    found = resolve("both+hidden+quiet")
    assert [part.text for part in found.passed_on] == ["hidden", "quiet"]
    assert "observe" not in data("both+hidden+quiet")
    assert [member.scenario.name for member in members_of(found)] == ["market+hidden+quiet", "garden+hidden"]
    assert [member.name for member in members_of(found)] == ["market", "garden"]
    assert [member.name for member in members_of(resolve("both?split=test"))] == ["market", "market_swap"]
    assert [member.name for member in members_of(resolve("both?split=train"))] == ["market", "garden"]
    tuned = resolve("both+tuned")
    assert data("both+tuned")["draw"] == "uniform"
    assert [member.name for member in members_of(tuned)] == ["market", "garden"]


def test_a_suites_own_variant_is_passed_on_however_it_is_named(write: Write) -> None:
    write("shipped/both_quiet.yaml", "variant: both_quiet\nof: both.yaml\nset: {about: Quiet.}\n")
    for name in ("both+quiet", "both_quiet", "both_quiet+quiet"):
        found = resolve(name)
        assert data(name)["about"] == "Quiet."
        assert [member.scenario.name for member in members_of(found)] == ["market+quiet", "garden"], name


def test_members_with_parameters_and_whole_splits(write: Write) -> None:
    write(
        "user/three.yaml",
        "suite: three\nmembers: [market, garden?n=1, market+quiet]\nsplits: {one: {members: [deep/inner]}}\n",
    )
    members = members_of(resolve("three"))
    assert [member.name for member in members] == ["market", "garden?n=1", "market+quiet"]
    assert members[1].place == ("members", 1)
    assert [member.name for member in members_of(resolve("three?split=one"))] == ["inner"]


def test_what_is_wrong_with_members_is_said_in_one_go(write: Write) -> None:
    write(
        "user/bad.yaml",
        "suite: bad\nmembers: [marke, hidden, deep/base, zoes/z_1, market]\n"
        "splits: {a: {replace: {market: nowhere}}, b: {members: [both]}}\n",
    )
    with pytest.raises(ScenarioError) as raised:
        members_of(resolve("bad"))
    assert [str(d).removeprefix("bad.yaml:") for d in raised.value.diagnostics] == [
        "2:11: S504 there is no file `marke` in .",
        "2:18: S108 `hidden` is a file of the kind `variant`; the members of a suite are scenarios",
        "2:26: S108 `deep/base` is an abstract scenario; the members of a suite are scenarios",
        "2:37: S108 `zoes/z_1` is a file of the kind `npc`; the members of a suite are scenarios",
    ]
    with pytest.raises(ScenarioError) as raised:
        check_splits(resolve("bad"))
    assert [d.code for d in raised.value.diagnostics] == ["S504", "S108"]


def test_a_suite_none_of_whose_members_has_the_variant() -> None:
    found = resolve("both+nothing")
    with pytest.raises(ScenarioError, match="S503 no member of `both\\+nothing` has a variant `nothing`"):
        members_of(found)
    with pytest.raises(ScenarioError, match="S206 `both` has no split `tset`; did you mean `test`"):
        members_of(resolve("both?split=tset"))


def test_files_that_a_scenario_names() -> None:
    found = resolve("mine")
    zoes = found.include_all(("cast", "zoe", "one_of"))
    assert [(npc.name, npc.kind) for npc in zoes] == [("z_1", "npc"), ("z_2", "npc")]
    assert zoes[1].data == {"npc": "z_2", "kind": "two", "color": "red"}
    assert [npc.name for npc in found.include_all(("cast", "yan", "one_of"))] == ["z_2", "z_1"]
    assert found.include(("cast", "yan", "one_of", 0)).name == "z_2"
    assert any(name.endswith("z_1.yaml") for name in found.files)


def test_included_names_are_relative_to_the_file_they_stand_in(write: Write) -> None:
    write(
        "user/mine_other.yaml",
        "variant: mine_other\nof: mine.yaml\nset: {cast.zoe.one_of: [zoes/z_1.yaml]}\n",
    )
    write("shipped/far.yaml", "scenario: far\ncast: {zoe: {one_of: deep/npc.yaml}}\n")
    write("shipped/deep/npc.yaml", "npc: from_shipped\n")
    assert [npc.name for npc in resolve("mine+other").include_all(("cast", "zoe", "one_of"))] == ["z_1"]
    assert resolve("far").include(("cast", "zoe", "one_of")).name == "from_shipped"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("zoes/nothing.yaml", "S504 there is no file `zoes/nothing.yaml`"),
        ("zoes/z_3.yaml", "did you mean `zoes/z_1.yaml`?"),
        ("zoes/q_*.yaml", "S504 no file matches"),
        ("z*/z_1.yaml", "S504 this is not the name of files"),
        ("zoes/z_1.yaml+nope", "S503"),
        ("zoes", "S504 there is no file"),
        ("", "S508"),
        ("7", "S104 the name of a file is a text"),
    ],
)
def test_included_names_that_are_wrong(text: str, message: str, write: Write) -> None:
    quoted = text if text == "7" else f"'{text}'"
    write("user/bad.yaml", f"scenario: bad\ncast:\n  a: {{one_of: {quoted}}}\n")
    with pytest.raises(ScenarioError) as raised:
        resolve("bad").include_all(("cast", "a", "one_of"))
    (found,) = raised.value.diagnostics
    assert message in str(found)
    assert (found.span.file, found.span.line) == ("bad.yaml", 3)


def test_patches_from_another_file(write: Write) -> None:
    write(
        "user/tree.yaml",
        "suite: tree\nleaves:\n  - {set: {horizon: 42}, remove: [cast.bob]}\n  - {set: {horizn.x: 1}}\n",
    )
    tree, market = resolve("tree"), resolve("market")
    changed = market.patched(tree.tree.at(("leaves", 0)))
    assert isinstance(changed.data, dict)
    assert changed.data["horizon"] == 42
    assert list(changed.data["cast"]) == ["anna"]  # type: ignore[arg-type]
    assert str(changed.tree.value_span(("horizon",))) == "tree.yaml:3:21"
    assert market.data == data("market")
    with pytest.raises(ScenarioError, match=r"tree.yaml:4:12: S501 there is no `horizn`"):
        market.patched(tree.tree.at(("leaves", 1)))


KINDS = {
    "": "S108 a scenario file is a mapping of keys; this one is empty",
    "- a": "S108 a scenario file is a mapping of keys; this one is a list",
    "just text": "S108",
    "scenaro: x": "1:1: S108 unknown key `scenaro`, and no key says what this file is; did you mean `scenario`?",
    "horizon: 3": "S108 no key says what this file is",
    "scenario: a\nnpc: b": "2:1: S107 a file has only one of `scenario` and `npc`",
    "variant: a": "1:1: S105 a variant needs `of`",
    "variant: a\nof: [b]": "2:5: S104 `of` names a file, it is not a list",
    "variant: a\nof: market.yaml\nsett: {}": "3:1: S101 unknown key `sett` in a variant; did you mean `set`?",
    "variant: a\nof: markt.yaml": "2:5: S504 there is no file `markt.yaml`",
    "variant: a\nof: hidden.yaml": "2:5: S108 `hidden.yaml` is a variant of any scenario",
    "variant: a\nof: market.yaml\nremove: [cast.ana]": "did you mean `cast.anna`",
    "scenario: a\nextends: 3": "2:10: S104 `extends` names one file, it is not a number",
    "scenario: a\nextends: zoes/z_1.yaml": "2:10: S108 `zoes/z_1.yaml` is a file of kind `npc`",
    "npc: a\nextends: ours.yaml": "2:10: S108 `ours.yaml` is a file of kind `scenario`",
}


@pytest.mark.parametrize("text", KINDS)
def test_files_that_do_not_fit(text: str, write: Write) -> None:
    write("user/f.yaml", text)
    assert KINDS[text] in findings("f.yaml")[0]


def test_a_variant_of_something_else_is_not_taken(write: Write) -> None:
    write("user/mine_odd.yaml", "variant: mine_odd\nof: market.yaml\n")
    write("user/mine_full.yaml", "scenario: mine_full\n")
    assert "S503 `odd` is no variant of `mine`" in findings("mine+odd")[0]
    assert "S503 `full` is no variant of `mine`: mine_full.yaml is a scenario" in findings("mine+full")[0]


# -- limits, circles, and the folders -----------------------------------------------------------------------------


@pytest.mark.parametrize("count", [1, 2, 5, 50])
@pytest.mark.parametrize("link", ["scenario: s{i}\nextends: s{next}.yaml", "variant: s{i}\nof: s{next}.yaml"])
def test_circles_are_named(count: int, link: str, write: Write) -> None:
    for i in range(count):
        write(f"user/s{i}.yaml", link.format(i=i, next=(i + 1) % count))
    start = time.perf_counter()
    (found,) = findings("s0.yaml")
    # Against hanging; how fast it is a benchmark's business.
    assert time.perf_counter() - start < 20.0
    if count <= MAX_CHAIN:
        circle = " → ".join(f"s{i % count}.yaml" for i in range(count + 1))
        assert f"S506 these files build on each other in a circle: {circle}" in found
    else:
        assert "S507" in found


def test_circles_of_variants(write: Write) -> None:
    write("user/mine_a.yaml", "variant: mine_a\nof: mine_b.yaml\n")
    write("user/mine_b.yaml", "variant: mine_b\nof: mine_a.yaml\n")
    assert "S506" in findings("mine+a")[0]


def test_chain_length_is_exact(write: Write) -> None:
    for i in range(MAX_CHAIN):
        write(f"user/c{i}.yaml", f"scenario: c{i}\n" + (f"extends: c{i - 1}.yaml\n" if i else ""))
    assert data(f"c{MAX_CHAIN - 1}.yaml")["scenario"] == f"c{MAX_CHAIN - 1}"
    write("user/last.yaml", f"scenario: last\nextends: c{MAX_CHAIN - 1}.yaml\n")
    assert "S507" in findings("last.yaml")[0]
    assert "S507" in findings("market" + "".join(f"+v{i}" for i in range(MAX_CHAIN + 1)))[0]


def test_number_and_size_of_files(write: Write) -> None:
    for i in range(MAX_FILES):
        write(f"user/many/{i // MAX_MATCHES}/n{i}.yaml", f"npc: n{i}\n")
    several = "".join(f"  a{i}: {{one_of: many/{i}/n*.yaml}}\n" for i in range(MAX_FILES // MAX_MATCHES))
    write("user/many.yaml", f"scenario: many\ncast:\n{several}")
    many, last = resolve("many"), MAX_FILES // MAX_MATCHES - 1
    for i in range(last):
        many.include_all(("cast", f"a{i}", "one_of"))
    with pytest.raises(ScenarioError, match="S507 a scenario or suite is made of at most 512 files"):
        many.include_all(("cast", f"a{last}", "one_of"))
    write("user/many/0/n.yaml", "npc: n\n")
    with pytest.raises(ScenarioError, match=r"S507 `many/0/n\*.yaml` matches more than 64 files"):
        resolve("many").include_all(("cast", "a0", "one_of"))
    for i in range(6):
        write(f"user/large/n{i}.yaml", f"npc: n{i}\n" + "#" * 900_000)
    write("user/large.yaml", "scenario: large\ncast: {a: {one_of: large/n*.yaml}}\n")
    with pytest.raises(ScenarioError, match="S507 the files of a scenario have more than 4 MiB together"):
        resolve("large").include_all(("cast", "a", "one_of"))


def test_depth_after_merging_is_limited(write: Write) -> None:
    deep = "set:\n  cast.bob.name: " + "[" * 29 + "]" * 29 + "\n"
    write("user/ok.yaml", "variant: ok\nof: market.yaml\n" + deep)
    assert resolve("ok.yaml").kind == "scenario"
    further = "cast.bob.name" + "[0]" * 28
    write("user/bad.yaml", f"variant: bad\nof: ok.yaml\nset:\n  {further}: {'[' * 20 + ']' * 20}\n")
    assert "S004 put together, the scenario is nested" in findings("bad.yaml")[0]


VECTORS = [
    "../outside/secret.yaml",
    "../outside/secret",
    "zoes/../../outside/secret.yaml",
    "./../outside/secret.yaml",
    "{tmp}/outside/secret.yaml",
    "/{tmp}/outside/secret.yaml",
    "link.yaml",
    "link",
    "linked/secret.yaml",
    "linked/../../outside/secret.yaml",
    "zoes/../linked/secret.yaml",
    "file:{tmp}/outside/secret.yaml",
    "file:///{tmp}/outside/secret.yaml",
    "..\\outside\\secret.yaml",
    "~/secret.yaml",
    "$HOME/secret.yaml",
    "/etc/passwd",
    "/dev/zero",
    "/proc/self/environ",
    "../user2/secret.yaml",
    "../user.yaml",
    "%2e%2e/outside/secret.yaml",
    "....//outside/secret.yaml",
    "zoes/%00.yaml",
    "loop.yaml",
    "../outside/*.yaml",
    "linked/*.yaml",
    "*link.yaml",
    "../*/secret.yaml",
    "{tmp}/outside/s*.yaml",
    "zoes/../zoes/../../outside/secret.yaml",
    "zoes//..//..//outside/secret.yaml",
    "./link.yaml",
    "zoes/../link",
    "linked/./secret",
    "linked/secret.yaml+x",
    "../outside/secret.yaml+x?n=1",
    "../outside/../outside/secret",
    "/proc/self/cwd/../outside/secret.yaml",
    "//{tmp}/outside/secret.yaml",
    "\\..\\..\\outside\\secret.yaml",
    "..%2foutside%2fsecret.yaml",
]


@pytest.mark.parametrize("vector", VECTORS)
@pytest.mark.parametrize("form", ["extends", "of", "one_of", "member"])
def test_nothing_outside_the_folders_is_opened(vector: str, form: str, write: Write, tmp_path: Path) -> None:
    write("user2/secret.yaml", "scenario: secret\n")
    write("user.yaml", "scenario: secret\n")
    os.symlink(tmp_path / "outside" / "secret.yaml", "link.yaml")
    os.symlink(tmp_path / "outside", "linked")
    os.symlink("loop.yaml", "loop.yaml")
    text = vector.replace("{tmp}", str(tmp_path)).replace("\\", "\\\\")
    forms = {
        "extends": f'scenario: f\nextends: "{text}"\n',
        "of": f'variant: f\nof: "{text}"\n',
        "one_of": f'scenario: f\ncast: {{a: {{one_of: "{text}"}}}}\n',
        "member": f'suite: f\nmembers: ["{text}"]\n',
    }
    write("user/f.yaml", forms[form])
    with listening() as ear, pytest.raises(ScenarioError) as raised:
        members_of(resolve("f.yaml")) if form == "member" else resolve("f.yaml").with_drawn_files()
    seen = ear.opened
    assert {d.code for d in raised.value.diagnostics} <= {"S504", "S505"}
    inside = (tmp_path / "user").resolve(), (tmp_path / "shipped").resolve()
    opened = [
        Path(os.path.realpath(path)) for path in seen if path.startswith(str(tmp_path)) or "secret" in path
    ]
    assert Path(os.path.realpath("f.yaml")) in [Path(os.path.realpath(path)) for path in seen]
    assert all(any(path.is_relative_to(folder) for folder in inside) for path in opened)
    assert "666" not in str(raised.value)


def test_the_folder_given_is_the_border(tmp_path: Path, write: Write) -> None:
    write("user/sub/f.yaml", "scenario: f\nextends: ../mine.yaml\n")
    assert "S505" in findings("sub/f.yaml")[0]
    assert resolve("sub/f.yaml", tmp_path / "user").name == "f"
    with pytest.raises(ScenarioError, match="S505"):
        resolve("f.yaml", tmp_path / "user" / "sub")


def test_variants_do_not_leave_the_folders_either(tmp_path: Path) -> None:
    os.symlink(tmp_path / "outside" / "secret.yaml", "mine_x.yaml")
    os.symlink(tmp_path / "outside" / "secret.yaml", "y.yaml")
    with listening() as ear:
        assert "S505" in findings("mine+x")[0]
        assert "S505" in findings("mine+y")[0]
        assert "S503" in findings("mine+zzz")[0]
    assert not [path for path in ear.opened if "secret" in os.path.realpath(path)]


def test_shipped_names_leave_out_variants_of_any_scenario() -> None:
    found = shipped_names()
    assert "market" in found
    assert "market_quiet" in found
    assert "hidden" not in found


def test_the_shipped_folder_is_beside_or_in_the_package(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.undo()
    package = Path(reader.__file__).parents[1]
    assert reader.shipped_folder() in (package / "scenarios", package.parent / "scenarios")


def test_resolving_is_quick() -> None:
    def seconds() -> float:
        start = time.perf_counter()
        resolve("market+quiet+hidden")
        return time.perf_counter() - start

    assert min(seconds() for _ in range(10)) < 0.05

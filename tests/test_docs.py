"""The examples in the documents run, the scenarios in them are sound, and the links lead somewhere."""

import contextlib
import io
import re
import shlex
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import get_args

import pytest

import socialai_dsl
from socialai_dsl import frontend
from socialai_dsl.cli import main
from socialai_dsl.library import prelude, shared_grammars
from socialai_dsl.program import Field, Flag, FrameColumn, Header, Op, TypeColumn
from socialai_dsl.schema.annotations import CALLED, keys_of
from socialai_dsl.schema.curriculum import Curriculum
from socialai_dsl.schema.experiment import Experiment
from socialai_dsl.schema.library import GrammarLibrary, ObjectLibrary, ObjectTypeModel
from socialai_dsl.schema.scenario import SlotType
from socialai_dsl.schema.study import Study
from socialai_dsl.semantics.words import RESERVED, SIGNATURES
from socialai_dsl.vocabulary import COLORS, DIRECTIONS, PRIMITIVES
from tests.tiny import Folder

ROOT = Path(__file__).parents[1]
PAGES = sorted((ROOT / "docs").glob("*.md"))
TUTORIAL = ROOT / "docs" / "tutorial.md"  # its steps are followed one by one: tests/test_tutorial.py
INTEROP = ROOT / "docs" / "interop.md"  # it needs other libraries: tests/test_interop.py
DOCUMENTS = [
    ROOT / name
    for name in (
        "README.md",
        "ARCHITECTURE.md",
        "CHANGELOG.md",
        "CONTRIBUTING.md",
        "SECURITY.md",
        "CODE_OF_CONDUCT.md",
    )
]
DOCUMENTS += sorted((ROOT / "docs").rglob("*.md"))
FINDINGS = ROOT / "docs" / "diagnostics"  # their commands and files are wrong on purpose: tests/diagnostics
REFERENCE = "\n".join(
    (ROOT / "docs" / name).read_text(encoding="utf-8") for name in ("language.md", "reference.md")
)

BLOCK = re.compile(r"^```(\w+)\n(.*?)^```", re.MULTILINE | re.DOTALL)
LINK = re.compile(r"\]\((?!https?://)([^)\s]+)\)")


def blocks(path: Path, language: str) -> Iterator[str]:
    for found, text in BLOCK.findall(path.read_text(encoding="utf-8")):
        if found == language:
            yield text


NAMED = re.compile(r"# (\w+\.yaml)\n")
"""The first line of a file that a page shows and its examples use."""


def save_files(page: Path, folder: Path) -> None:
    """Save the files that a page shows under their names."""
    for text in blocks(page, "yaml"):
        if (first := NAMED.match(text)) is not None:
            (folder / first[1]).write_text(text, encoding="utf-8")


@pytest.fixture
def reader(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder as a reader of the README would have it: the scenarios it shows are saved under their names."""
    monkeypatch.chdir(tmp_path)
    save_files(ROOT / "README.md", tmp_path)
    return tmp_path


def test_readme_examples_run(reader: Path) -> None:
    examples = list(blocks(ROOT / "README.md", "python"))
    assert len(examples) >= 2
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        for number, example in enumerate(examples):
            exec(compile(example, f"README.md, example {number + 1}", "exec"), {})
    assert "(1024, 7, 7, 4)" in printed.getvalue()
    assert "Ada: After you." in printed.getvalue(), "the keeper of the example's door answers"


def test_readme_scenarios_have_no_findings(reader: Path) -> None:
    files = sorted(reader.glob("*.yaml"))
    assert files
    for file in files:
        result = frontend.check(str(file))
        assert result.scenario is not None
        assert [str(diagnostic) for diagnostic in result.diagnostics] == []


def test_readme_scenario_can_be_won(reader: Path) -> None:
    """Ask for the door from below it, with the keeper looking, then walk out."""
    env = socialai_dsl.make("gatekeeper.yaml")
    layout = {
        "room": {"width": 6, "height": 6},
        "agent": {"at": [2, 1], "facing": "right"},
        "keeper": {"at": [3, 1], "facing": "left"},
        "gate": {"at": [2, 0]},
    }
    env.reset(seed=0, options={"layout": layout})
    encode = env.unwrapped.encode_action  # type: ignore[attr-defined]
    info: dict[str, object] = {}
    terminated = False
    for action in [(None, "Please open the door"), ("left", None), ("forward", None)]:
        *_, terminated, _, info = env.step(encode(action))
    assert terminated
    assert info["success"]


def test_the_gallery_names_every_file_that_can_be_played_and_every_variant_for_all() -> None:
    text = (ROOT / "docs" / "gallery.md").read_text(encoding="utf-8")
    files = [path for path in (ROOT / "scenarios").rglob("*.yaml") if not path.name.endswith(".tests.yaml")]
    of_any = {
        path.stem
        for path in files
        if path.parent.name == "scenarios" and "\nof: any" in path.read_text("utf-8")
    }
    assert {"unsocial", "seats"} <= of_any
    for name in (*of_any, "oracle", "as_coded"):
        assert f"`+{name}`" in text
    named = {word.partition("+")[0] for word in re.findall(r"`([\w/+]+)`", text)}
    played = {
        path.relative_to(ROOT / "scenarios").with_suffix("").as_posix()
        for path in files
        if _can_be_played(path)
    }
    assert len(played) > 60
    assert played - named == set()


def _can_be_played(path: Path) -> bool:
    """Whether a file is a scenario or suite of its own, and no base of others."""
    text = path.read_text(encoding="utf-8")
    return text.startswith(("scenario:", "suite:")) and "\nabstract: true" not in text


@pytest.mark.parametrize("path", DOCUMENTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_links_lead_somewhere(path: Path) -> None:
    for target in LINK.findall(path.read_text(encoding="utf-8")):
        file, _, heading = target.partition("#")
        there = path.parent / file if file else path
        assert there.exists(), f"{path.name} links to {target}, which is not there"
        if heading:
            assert heading in headings(there), f"{path.name} links to {target}, which has no such heading"


def headings(path: Path) -> set[str]:
    """What the headings of a page are called in links."""
    lines = re.findall(r"^#+ (.+)$", path.read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w -]", "", line.lower()).replace(" ", "-") for line in lines}


KINDS = ("scenario", "npc", "variant", "suite", "library", "experiment", "study")


def kind(text: str) -> str | None:
    """What a block of YAML is; None for a part of a scenario."""
    first = text.split(":", 1)[0]
    return first if first in KINDS else None


@pytest.mark.parametrize(
    "text",
    [text for page in PAGES for text in blocks(page, "yaml") if kind(text)],
    ids=lambda text: text.split("\n", 1)[0],
)
def test_files_in_the_pages_have_no_findings(text: str, tmp_path: Path) -> None:
    result = frontend.check(str(Folder(tmp_path).save("shown", text)))
    assert [str(diagnostic) for diagnostic in result.diagnostics] == []


@pytest.mark.parametrize(
    "text", [text for text in blocks(ROOT / "docs" / "language.md", "yaml") if not kind(text)]
)
def test_parts_in_the_reference_are_sound(text: str, tmp_path: Path) -> None:
    """Each in a room with an agent and nothing else."""
    path = Folder(tmp_path).write("shown", text)
    assert [str(diagnostic) for diagnostic in frontend.check(str(path)).diagnostics] == []
    env = socialai_dsl.make(str(path))
    env.reset(seed=0)
    env.step(env.action_space.sample())


@pytest.mark.parametrize(
    "page", [page for page in PAGES if page not in (TUTORIAL, INTEROP)], ids=lambda page: page.name
)
def test_python_in_the_pages_runs(page: Path, reader: Path) -> None:
    save_files(page, reader)
    for number, example in enumerate(blocks(page, "python")):
        if "stable_baselines3" in example:
            pytest.importorskip("stable_baselines3", reason="Stable-Baselines3 is not installed")
        exec(compile(example, f"{page.name}, example {number + 1}", "exec"), {})


def commands(path: Path) -> Iterator[list[str]]:
    """The commands of the package that a document shows."""
    for text in blocks(path, "console"):
        for line in text.replace("\\\n", " ").splitlines():
            if line.startswith("$ "):
                words = shlex.split(line.removeprefix("$ "), comments=True)
                if words[0].startswith("socialai"):
                    yield words


def test_commands_in_the_documents_are_understood(
    reader: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """`validate` is run; of what would train or search for minutes only the options are looked at."""
    shown = [
        words
        for path in DOCUMENTS
        if path.parent != FINDINGS and path != TUTORIAL
        for words in commands(path)
    ]
    assert len(shown) >= 3
    save_files(ROOT / "docs" / "partners.md", reader)
    for program, *words in shown:
        if program == "socialai" and words[0] == "validate" and "--deep" not in words:
            assert main.main(words) == 0, words
            continue
        helped = words if program == "socialai" else ["run", *words]
        assert main.main([*helped, "--help"]) == 0, words
    capsys.readouterr()


def test_what_the_page_about_reasons_shows_is_printed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Every command there that is followed by its output prints just that."""
    page = ROOT / "docs" / "explain.md"
    monkeypatch.chdir(tmp_path)
    for text in blocks(page, "yaml"):
        Path(text.split(maxsplit=2)[1] + ".yaml").write_text(text, encoding="utf-8")
    shown = [text.partition("\n") for text in blocks(page, "console")]
    with_output = [(command, output) for command, _, output in shown if output and not output.startswith("$")]
    assert len(with_output) == 2
    for command, output in with_output:
        assert main.main(shlex.split(command)[2:]) == 0
        assert capsys.readouterr().out.rstrip() == output.rstrip(), command


def test_what_the_page_about_tests_shows_is_printed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """All but the seconds; the scenarios are one that ships and that of the page about reasons."""
    monkeypatch.chdir(tmp_path)
    shutil.copy(ROOT / "scenarios" / "talkitout.yaml", tmp_path)
    (guide,) = blocks(ROOT / "docs" / "explain.md", "yaml")
    Path("shy_guide.yaml").write_text(guide, encoding="utf-8")
    page = ROOT / "docs" / "tests.md"
    for text in blocks(page, "yaml"):
        Path(text.split()[1].replace(".yaml", ".tests.yaml")).write_text(text, encoding="utf-8")
    shown = [text.partition("\n") for text in blocks(page, "console")]
    with_output = [(command, output) for command, _, output in shown if output and not output.startswith("$")]
    assert len(with_output) == 2
    for command, output in with_output:
        main.main(shlex.split(command)[2:])
        printed = capsys.readouterr().out.splitlines()
        assert printed[:-1] == output.splitlines()[:-1]
        assert printed[-1].rpartition(",")[0] == output.splitlines()[-1].rpartition(",")[0]


# -- the reference is complete ------------------------------------------------------------------------------------


def mentioned(text: str = REFERENCE) -> set[str]:
    """Every word that stands in code in the guide and the reference of the language, or on another page."""
    code = re.findall(r"`([^`\n]+)`", re.sub(r"```.*?```", "", text, flags=re.DOTALL))
    return {word for text in code for word in re.findall(r"[A-Za-z_]\w*", text)}


@pytest.mark.parametrize("name", sorted({signature.name for signature in SIGNATURES}))
def test_the_reference_has_every_instruction(name: str) -> None:
    assert name in mentioned()


MODELS = [*CALLED, ObjectLibrary, ObjectTypeModel, GrammarLibrary]
PAGES = {
    Experiment.__module__: "experiments.md",
    Curriculum.__module__: "curricula.md",
    Study.__module__: "studies.md",
}
"""Module of models -> the page about its files, if that is not the one about the language."""


@pytest.mark.parametrize("model", MODELS, ids=lambda model: model.__name__)
def test_the_reference_has_every_key(model: type) -> None:
    page = PAGES.get(model.__module__)
    text = (ROOT / "docs" / page).read_text(encoding="utf-8") if page else REFERENCE
    assert [key for key in keys_of(model) if key not in mentioned(text)] == []


def test_the_reference_has_every_word() -> None:
    """Words without a key or an instruction of their own: those of expressions, of types, and what is built in."""
    written = set(re.findall(r"[A-Za-z_]\w*", REFERENCE))
    vocabularies = [*PRIMITIVES, *COLORS, *DIRECTIONS, *get_args(SlotType), *shared_grammars()]
    types = [*prelude().types, *(state for type_ in prelude().types.values() for state in type_.states)]
    assert {*RESERVED, *vocabularies, *types} - written == set()


def _constructs() -> set[str]:
    """Every word that stands in code on the page of constructs."""
    text = (ROOT / "docs" / "constructs.md").read_text(encoding="utf-8")
    return {
        word
        for code in re.findall(r"`([^`\n]+)`", text)
        for word in re.findall(r"[A-Za-z_][\w./]*\w|\w", code)
    }


def test_constructs_have_every_instruction() -> None:
    """Every one of the language, and every one of the engine that it is lowered to."""
    words = _constructs()
    assert {signature.name for signature in SIGNATURES} - words == set()
    assert {op.name for op in Op} - words == set()


def test_constructs_name_what_there_is() -> None:
    known = {name for kind in (Op, Header, Flag, Field, TypeColumn, FrameColumn) for name in kind.__members__}
    known |= {name.removesuffix("_AT") for name in known} | {f"Flag.{flag.name}" for flag in Flag} | {"FILE"}
    words = _constructs()
    assert {word for word in words if word.removeprefix("Flag.").isupper() and len(word) > 1} - known == set()
    files = [word for word in words if word.endswith(".py")]
    roots = (ROOT, ROOT / "socialai_dsl")
    assert [file for file in files if not any((root / file).exists() for root in roots)] == []


def test_architecture_names_files_that_exist() -> None:
    text = (ROOT / "ARCHITECTURE.md").read_text(encoding="utf-8")
    names = set(re.findall(r"`([\w./-]+(?:\.py|\.yaml|\.lark|/))`", text))
    assert len(names) > 10
    missing = [
        name
        for name in sorted(names)
        if not any((ROOT / root / name).exists() for root in ("", "socialai_dsl"))
    ]
    assert missing == []


def test_architecture_stays_short() -> None:
    assert len((ROOT / "ARCHITECTURE.md").read_text(encoding="utf-8").splitlines()) < 150


def test_every_key_in_the_reference_has_a_meaning() -> None:
    """No cell of a column `meaning` is empty, in any table of the page."""
    columns: list[str] = []
    meanings = 0
    for number, line in enumerate((ROOT / "docs" / "reference.md").read_text("utf-8").splitlines(), 1):
        if not line.startswith("|"):
            columns = []
            continue
        cells = [cell.strip() for cell in re.split(r"(?<!\\)\|", line)[1:-1]]
        if not columns:
            columns = cells
        elif "meaning" in columns and set(cells[0]) != {"-"}:
            assert len(cells) == len(columns), f"docs/reference.md:{number}: {line}"
            assert cells[columns.index("meaning")], f"docs/reference.md:{number}: no meaning: {line}"
            meanings += 1
    assert meanings > 100

"""The project's own files: what is locked, what a wheel carries, what the readme promises."""

import json
import os
import re
import subprocess
import sys
import tomllib
import zipfile
from collections.abc import Iterator
from email import message_from_string
from pathlib import Path

import pytest
import yaml
from pexpect import EOF, spawn

from tests.socialai_dsl.llm.endpoint import endpoint

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))


def normalised(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()


def locked() -> dict[str, str]:
    lines = (ROOT / "requirements.lock").read_text(encoding="utf-8").splitlines()
    pins = dict(line.split("==") for line in lines if line and not line.startswith("#"))
    return {normalised(name): version for name, version in pins.items()}


UNLOCKED = {"inspect", "openenv", "trl"}
"""Extras that ask for other versions than the lock has: `make test-models` installs them apart, they are bounded."""


def test_every_dependency_is_locked() -> None:
    wanted = list(PROJECT["project"]["dependencies"]) + list(PROJECT["build-system"]["requires"])
    for extra, packages in PROJECT["project"]["optional-dependencies"].items():
        if extra in UNLOCKED:
            assert all("<" in package for package in packages), extra
        else:
            wanted += packages
    names = [normalised(re.split(r"[<>=!~\[; ]", requirement)[0]) for requirement in wanted]
    assert [name for name in names if name not in locked()] == []


def test_locked_dependencies_are_plain_pins() -> None:
    """No host, no address, no build of one machine: any index the user has configured will do."""
    for name, version in locked().items():
        assert re.fullmatch(r"[0-9][0-9a-z.]*", version), f"{name}=={version}"


def test_make_lists_its_targets() -> None:
    result = subprocess.run(
        ["make", "help"], cwd=ROOT, capture_output=True, text=True, check=True, timeout=60
    )
    listed = {line.split()[0] for line in result.stdout.splitlines() if line}
    assert {"run", "test", "test-all", "test-long", "lint", "bench", "update-goldens"} <= listed


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A wheel of the checkout."""
    folder = tmp_path_factory.mktemp("wheel")
    command = [sys.executable, "-m", "pip", "wheel", "-qq", "--no-deps", "-w", str(folder), str(ROOT)]
    subprocess.run(command, check=True, timeout=280)
    (built,) = folder.glob("*.whl")
    return built


@pytest.mark.thorough("builds a wheel")
def test_a_wheel_carries_the_scenarios_and_the_data_files(wheel: Path) -> None:
    names = set(zipfile.ZipFile(wheel).namelist())
    sources = list((ROOT / "scenarios").rglob("*.yaml"))
    assert sources
    for path in sources:
        assert f"socialai_dsl/scenarios/{path.relative_to(ROOT / 'scenarios')}" in names
    for path in (ROOT / "experiments").rglob("*.yaml"):
        assert f"socialai_dsl/experiments/shipped/{path.relative_to(ROOT / 'experiments')}" in names
    weights = list((ROOT / "agents").rglob("*.safetensors"))
    assert weights
    for path in weights:
        assert f"socialai_dsl/trainer/agents/{path.relative_to(ROOT / 'agents')}" in names
    for path in (ROOT / "docs" / "diagnostics").glob("*.md"):
        assert f"socialai_dsl/pages/{path.name}" in names
    for path in (ROOT / "docs" / "cookbook").rglob("*.yaml"):
        assert f"socialai_dsl/cookbook/{path.relative_to(ROOT / 'docs' / 'cookbook')}" in names
    for folder, place in (("socialai_dsl", Path()), ("trainer", Path("socialai_dsl"))):
        for path in (ROOT / folder).rglob("*"):
            if path.is_file() and "__pycache__" not in path.parts:
                assert str(place / path.relative_to(ROOT)) in names
    tops = {name.split("/")[0] for name in names}
    assert {top for top in tops if not top.endswith(".dist-info")} == {"socialai_dsl"}, (
        "no other name is taken"
    )
    assert not [name for name in names if name.startswith(("tests/", "runs/", "benchmarks/"))]


@pytest.mark.thorough("builds a wheel")
def test_an_index_shows_the_readme_with_links_that_lead_somewhere(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        (name,) = [name for name in archive.namelist() if name.endswith("/METADATA")]
        metadata = message_from_string(archive.read(name).decode("utf-8"))
    assert metadata["Description-Content-Type"] == "text/markdown"
    shown, source = metadata.get_payload(), PROJECT["project"]["urls"]["Source"]
    assert isinstance(shown, str)
    found = re.findall(r'\]\(([^)]+)\)|(?:src|srcset|href)="([^"]+)"', shown)
    addresses = [written or quoted for written, quoted in found]
    assert len(addresses) > 40
    assert [address for address in addresses if not address.startswith("https://")] == []
    ours = [address.removeprefix(f"{source}/") for address in addresses if address.startswith(f"{source}/")]
    assert {"raw/main/docs/one_room.png", "blob/main/docs/gallery.md"} <= set(ours)
    for path in ours:
        (kind, _, file), picture = path.split("#")[0].split("/", 2), path.endswith(".png")
        assert (kind == "raw") is picture, path
        assert (ROOT / file).exists(), path
    line = re.search(r"^\*\*(.+)\.\*\*$", shown, re.MULTILINE)
    assert line is not None
    assert metadata["Summary"] == line[1]


@pytest.mark.thorough("builds a wheel, and starts its commands")
def test_the_commands_of_a_wheel_need_no_checkout(wheel: Path, tmp_path: Path) -> None:
    """Unpacked in front of everything else that is installed; in plain Python, which has nothing to compile."""
    installed = tmp_path / "installed"
    zipfile.ZipFile(wheel).extractall(installed)
    environment = {**os.environ, "PYTHONPATH": str(installed), "NUMBA_DISABLE_JIT": "1"}

    def command(name: str, *words: str) -> str:
        code = f"import sys, socialai_dsl.cli.main as cli; print(cli.__file__); sys.exit(cli.{name}())"
        result = subprocess.run(
            [sys.executable, "-c", code, *words],
            cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=280,
        )  # fmt: skip
        assert result.returncode == 0, result.stderr
        place, _, said = result.stdout.partition("\n")
        assert place.startswith(str(installed))
        return said

    assert "validate" in command("main", "--help")
    assert "1 file checked: 0 errors" in command("main", "validate", "talkitout")
    assert command("main", "explain", "S101").startswith("# S101")
    random = ["--agent", "random", "--eval-episodes", "2", "--out", "run"]
    assert "2 of the test set" in command("run_main", "cointhief", *random)


# -- what others wrote -----------------------------------------------------------------------------------------------


def packages_behind(file: Path) -> Iterator[dict[str, str]]:
    """The entries of package-lock.json for what a script imports, and for what that imports."""
    lock = json.loads((ROOT / "package-lock.json").read_text(encoding="utf-8"))["packages"]
    found: set[str] = set()
    wanted = re.findall(r'^import .* from "([^."][^"]*)"', file.read_text(encoding="utf-8"), re.MULTILINE)
    while wanted:
        name = wanted.pop()
        if name not in found:
            found.add(name)
            wanted += lock[f"node_modules/{name}"].get("dependencies", {})
    return ({"name": name, **lock[f"node_modules/{name}"]} for name in sorted(found))


UNUSED = {
    "@codemirror/streamparser",
    "vscode-jsonrpc",
    "vscode-languageserver-protocol",
    "vscode-languageserver-types",
}
"""What packages of the editor ask for, of which nothing is in the bundle: they are types, or not called."""


def test_notices_name_every_package_in_the_editor() -> None:
    """`tests/browser/test_bundles.py` compares them with the bundle itself, where there is Node."""
    notices = (ROOT / "THIRD_PARTY_NOTICES").read_text(encoding="utf-8")
    named = set(re.findall(r"^-{80}\n\n(\S+ \S+), .+$", notices, re.MULTILINE))
    behind = {f"{one['name']} {one['version']}" for one in packages_behind(ROOT / "editor" / "editor.js")}
    assert named <= behind
    assert {package.rpartition(" ")[0] for package in behind - named} == UNUSED
    assert len(named) > 10
    assert notices.count("Permission is hereby granted") >= len(named)


# -- what a host reads -------------------------------------------------------------------------------------------------


def test_files_for_citing_and_for_a_host_say_the_same_as_the_project() -> None:
    project = PROJECT["project"]
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert (citation["version"], citation["license"]) == (project["version"], project["license"])
    assert [author["name"] for author in citation["authors"]] == [one["name"] for one in project["authors"]]
    workflow = yaml.safe_load((ROOT / ".github" / "workflows" / "ci.yml").read_text(encoding="utf-8"))
    pythons = [entry.split()[-1] for entry in project["classifiers"] if re.search(r":: 3\.\d+$", entry)]
    assert workflow["jobs"]["test"]["strategy"]["matrix"]["python"] == pythons
    assert project["requires-python"] == f">={pythons[0]}"
    container = json.loads((ROOT / ".devcontainer" / "devcontainer.json").read_text(encoding="utf-8"))
    made = [container["postCreateCommand"], container["postAttachCommand"]]
    made += [step["run"] for job in workflow["jobs"].values() for step in job["steps"] if "run" in step]
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8").replace("$(STAMP):", ".venv/.installed:")
    for command in made:
        make, target = command.split()
        assert make == "make"
        assert re.search(rf"^{re.escape(target)}:", makefile, re.MULTILINE), target


def test_templates_of_issues_ask_for_something() -> None:
    """The shape that GitHub wants; a field that is asked for has a name of its own."""
    forms = [
        path for path in (ROOT / ".github" / "ISSUE_TEMPLATE").glob("*.yml") if path.name != "config.yml"
    ]
    assert len(forms) == 3
    for path in forms:
        form = yaml.safe_load(path.read_text(encoding="utf-8"))
        assert {"name", "description", "body"} <= form.keys()
        assert {field["type"] for field in form["body"]} <= {"textarea", "input"}
        assert len({field["id"] for field in form["body"]}) == len(form["body"])
        assert all(field["attributes"]["label"] for field in form["body"])
        assert any(field.get("validations", {}).get("required") for field in form["body"])


# -- extras one by one, in environments of their own -----------------------------------------------------------------

STUDY = ROOT / "experiments" / "studies" / "asking.yaml"
RESULTS = "evaluate oracle --on cointhief --episodes 2 --out results"
PARALLEL = (
    "import socialai_dsl as sd; print(sd.make_parallel('together/help_together').reset(seed=1)[0].keys())"
)
TRIED = {
    "": ["socialai validate talkitout", "socialai evaluate random --on cointhief --episodes 2"],
    "lsp": ["socialai lsp"],  # whose input ends at once
    "report": [f"socialai {RESULTS}", "socialai report results/cointhief"],
    "pettingzoo": [["python", "-c", PARALLEL]],
    "studio": [f"socialai study rehearse {STUDY} --participants 2 --speed 1000"],
    "train": ["socialai-run cointhief --frames 512 --eval-episodes 2 --out run"],
}
"""Extra -> commands that succeed with it alone."""
UNCOMPILED = {**os.environ, "NUMBA_DISABLE_JIT": "1"}
"""Each environment would compile the engine anew, which takes longer than all that is tried."""


@pytest.fixture
def environment(wheel: Path, tmp_path: Path, request: pytest.FixtureRequest) -> Path:
    """The programs of an empty environment with the wheel and one extra, in the versions of the lock."""
    made = tmp_path / "environment"
    subprocess.run([sys.executable, "-m", "venv", made], check=True, timeout=120)
    wanted = f"{wheel}[{request.param}]" if request.param else str(wheel)
    install = [made / "bin" / "python", "-m", "pip", "install", "-qq", "--disable-pip-version-check"]
    subprocess.run([*install, "-c", ROOT / "requirements.lock", wanted], check=True, timeout=900)
    return made / "bin"


@pytest.mark.slow
@pytest.mark.timeout(1200)
@pytest.mark.parametrize(("environment", "commands"), TRIED.items(), indirect=["environment"], ids=[*TRIED])
def test_an_extra_is_all_that_its_commands_need(
    environment: Path, commands: list[str | list[str]], tmp_path: Path
) -> None:
    for command in commands:
        program, *words = command if isinstance(command, list) else command.split()
        ended = subprocess.run(
            [environment / program, *words],
            cwd=tmp_path, env=UNCOMPILED, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=280,
        )  # fmt: skip
        assert ended.returncode == 0, f"{command}: {ended.stderr}"


@pytest.mark.slow
@pytest.mark.timeout(1200)
@pytest.mark.parametrize("environment", ["llm"], indirect=True)
def test_llm_is_all_that_a_language_model_needs(environment: Path, tmp_path: Path) -> None:
    with endpoint(lambda _: "Act: done") as stub:
        command = f"evaluate llm:stub --base-url {stub.url} --on cointhief --episodes 2".split()
        ended = subprocess.run(
            [environment / "socialai", *command],
            cwd=tmp_path, env=UNCOMPILED, capture_output=True, text=True, timeout=280,
        )  # fmt: skip
    assert ended.returncode == 0, ended.stderr
    assert stub.requests


@pytest.mark.slow
@pytest.mark.timeout(1200)
@pytest.mark.parametrize("environment", ["play"], indirect=True)
def test_play_is_all_that_a_player_needs(environment: Path, tmp_path: Path) -> None:
    screen = spawn(
        str(environment / "socialai"), ["play", "cointhief"],
        cwd=str(tmp_path), dimensions=(24, 80), timeout=120, env={**UNCOMPILED, "TERM": "xterm-256color"},
    )  # fmt: skip
    screen.expect("in view")
    screen.send("q")
    screen.expect(EOF)
    screen.close()
    assert screen.exitstatus == 0

"""The project's own files: what is locked, what a wheel carries, what the readme promises."""

import os
import re
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest

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

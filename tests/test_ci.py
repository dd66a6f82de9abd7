"""What the project offers to those who check scenarios on every change works as the page says."""

import json
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from socialai_dsl.cli.main import main

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs" / "ci.md").read_text(encoding="utf-8")

Capture = pytest.CaptureFixture[str]


def block(language: str, containing: str) -> str:
    found = re.findall(rf"^```{language}\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)
    (one,) = [text for text in found if containing in text]
    return str(one)


@pytest.fixture(autouse=True)
def repository(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Capture) -> Path:
    """A repository with a folder of sound scenarios, and the command `socialai`."""
    scenarios = tmp_path / "scenarios"
    scenarios.mkdir()
    monkeypatch.chdir(scenarios)
    for template in ("ask-a-guide", "role-swap"):
        assert main(["new", template.replace("-", "_"), "--template", template]) == 0
    (scenarios / "late_visitor.yaml").write_text(block("yaml", "late_visitor"), encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    command = tmp_path / "bin" / "socialai"
    command.parent.mkdir()
    code = "import sys; from socialai_dsl.cli.main import main; sys.exit(main())"
    command.write_text(f'#!/bin/sh\nexec {shlex.quote(sys.executable)} -c {shlex.quote(code)} "$@"\n')
    command.chmod(0o755)
    monkeypatch.setenv("PATH", os.pathsep.join([str(command.parent), os.environ["PATH"]]))
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")]))
    capsys.readouterr()
    return tmp_path


def shell(script: str) -> int:
    return subprocess.run(["sh", "-c", script], timeout=120, capture_output=True, check=False).returncode


def break_one(folder: Path) -> None:
    path = folder / "scenarios" / "ask_a_guide.yaml"
    path.write_text(path.read_text(encoding="utf-8").replace("horizon:", "horizn:"), encoding="utf-8")


def test_the_script_for_anywhere(repository: Path) -> None:
    script = block("sh", "report.xml")
    assert shell(script) == 0
    assert (repository / "report.xml").read_text(encoding="utf-8").startswith("<?xml")
    break_one(repository)
    assert shell(script) == 1
    assert "S101" in (repository / "report.xml").read_text(encoding="utf-8")


def test_the_workflow(repository: Path, capsys: Capture) -> None:
    workflow = yaml.safe_load(block("yaml", "actions/checkout"))
    steps = workflow["jobs"]["validate"]["steps"]
    commands = [shlex.split(step["run"]) for step in steps if step.get("run", "").startswith("socialai")]
    assert len(commands) == 3
    assert [main(words[1:]) for words in commands] == [0, 0, 0]
    break_one(repository)
    capsys.readouterr()
    assert main(commands[1][1:]) == 1
    assert capsys.readouterr().out.startswith("::error file=scenarios/ask_a_guide.yaml,line=4,col=1,")


def test_the_hooks(repository: Path) -> None:
    hooks = yaml.safe_load((ROOT / ".pre-commit-hooks.yaml").read_text(encoding="utf-8"))
    shown = yaml.safe_load(block("yaml", "repos:"))["repos"][0]["hooks"]
    assert {hook["id"] for hook in hooks} == {hook["id"] for hook in shown}
    files = [str(path.relative_to(repository)) for path in (repository / "scenarios").glob("*.yaml")]
    assert all(re.search(hook["files"], file) for hook in shown for file in files)
    for hook in hooks:
        assert {"id", "name", "entry", "language"} <= set(hook)
        assert main([*shlex.split(hook["entry"])[1:], *files]) == 0
    break_one(repository)
    assert main(["validate", *files]) == 1


def test_the_problem_matcher(repository: Path, capsys: Capture) -> None:
    """Its patterns find errors and warnings in the text report, and nothing else."""
    matchers = json.loads((ROOT / "docs" / "problem_matcher.json").read_text(encoding="utf-8"))[
        "problemMatcher"
    ]
    break_one(repository)
    late = repository / "scenarios" / "late_visitor.yaml"
    late.write_text(late.read_text(encoding="utf-8").replace("# socialai", "#"), encoding="utf-8")
    assert main(["validate", "scenarios"]) == 1
    report = capsys.readouterr().out.splitlines()
    found = []
    for matcher in matchers:
        (pattern,) = matcher["pattern"]
        for line in report:
            match = re.search(pattern["regexp"], line)
            if match:
                parts = (match.group(pattern[name]) for name in ("file", "line", "column", "code"))
                found.append((matcher["severity"], *parts))
    assert ("error", "scenarios/ask_a_guide.yaml", "4", "1", "S101") in found
    assert ("warning", "scenarios/late_visitor.yaml", "11", "7", "W306") in found
    assert len(found) == sum(": S" in line or ": W" in line for line in report)


def test_sarif_is_what_scanners_take(repository: Path, capsys: Capture) -> None:
    """The parts that SARIF 2.1.0 requires, with places counted from 1 and paths as relative addresses."""
    break_one(repository)
    assert main(["validate", "scenarios", "--format", "sarif"]) == 1
    log = json.loads(capsys.readouterr().out)
    assert log["version"] == "2.1.0"
    (run,) = log["runs"]
    driver = run["tool"]["driver"]
    rules = {rule["id"] for rule in driver["rules"]}
    assert driver["name"] == "socialai"
    assert run["results"]
    for result in run["results"]:
        assert result["ruleId"] in rules
        assert result["level"] in ("error", "warning")
        assert result["message"]["text"]
        (location,) = result["locations"]
        place = location["physicalLocation"]
        assert not place["artifactLocation"]["uri"].startswith("/")
        assert min(place["region"].values()) >= 1

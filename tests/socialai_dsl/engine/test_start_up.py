"""Processes that start cold: with changed sources, and many at once."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from socialai_dsl.engine.jit import is_interpreted

ROOT = Path(__file__).parents[3]
PROCESSES = 4
NOTICE = "socialai: compiling the engine, once for this machine: 20 to 70 seconds\n"
LOOK = """
import socialai_dsl as sd
env = sd.make("talkitout")
env.reset(seed=3)
for action in (0, 2, 2, 1, 2, 2):
    observation, *_ = env.step([action, 0, 0, 0])
print(observation["image"].tobytes().hex(), env.describe()["agent"])
"""

pytestmark = [
    pytest.mark.skipif(is_interpreted(), reason="nothing is compiled"),
    pytest.mark.slow,
    pytest.mark.timeout(1800),
]


def start(root: Path, cache_folder: Path) -> subprocess.Popen[str]:
    """A process that compiles, or loads, the engine of a copy of the project and plays a little."""
    environment = {**os.environ, "PYTHONPATH": str(root), "SOCIALAI_CACHE_DIR": str(cache_folder)}
    return subprocess.Popen(
        [sys.executable, "-c", LOOK],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=root,
        env=environment,
    )


def seen(process: subprocess.Popen[str]) -> str:
    out, err = process.communicate(timeout=1700)
    assert process.returncode == 0, err
    assert err in ("", NOTICE)
    return out


def test_a_changed_helper_changes_what_happens_at_once(tmp_path: Path) -> None:
    for folder in ("socialai_dsl", "scenarios"):
        shutil.copytree(ROOT / folder, tmp_path / folder, ignore=shutil.ignore_patterns("__pycache__"))
    before = seen(start(tmp_path, tmp_path / "cache"))
    assert seen(start(tmp_path, tmp_path / "cache")) == before, "the same code does the same"
    helper = tmp_path / "socialai_dsl" / "engine" / "entities.py"
    text = helper.read_text(encoding="utf-8")
    first, _, rest = text.partition("def step_x(")
    signature, _, body = rest.partition("\n")
    assert body, "there is no such helper any more"
    documented, quote, statements = body.partition('"""\n')
    assert quote
    helper.write_text(
        f"{first}def step_x({signature}\n{documented}{quote}    return direction - direction\n{statements}",
        encoding="utf-8",
    )
    after = seen(start(tmp_path, tmp_path / "cache"))
    assert after != before
    helper.write_text(text, encoding="utf-8")
    assert seen(start(tmp_path, tmp_path / "cache")) == before
    assert len(list((tmp_path / "cache").iterdir())) == 2, "one folder for each state of the sources"


def test_many_processes_that_start_cold_at_once_all_succeed(tmp_path: Path) -> None:
    processes = [start(ROOT, tmp_path / "cache") for _ in range(PROCESSES)]
    first, *others = [seen(process) for process in processes]
    assert all(other == first for other in others)
    (folder,) = (tmp_path / "cache").iterdir()
    kept = [path.name for path in folder.rglob("*") if path.is_file()]
    assert {name.partition("-")[0] for name in kept} == {"kernel.serve"}
    assert {name.rpartition(".")[2] for name in kept} == {"nbi", "nbc"}, "nothing is left over"
    assert seen(start(ROOT, tmp_path / "cache")) == first, "what they left behind is sound"

"""Twice the file takes about twice the work: `python -m tests.fuzzing.scaling` shows all figures."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from tests.fuzzing.bombs import DOCUMENTS, SCENARIOS
from tests.fuzzing.playground import Playground
from tests.fuzzing.scaling import MOST, ratio, read, seconds, work
from tests.quick import one_in

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Playground:
    place = Playground(tmp_path_factory.mktemp("scaling"))
    read("outcomes", SCENARIOS["outcomes"].text(1), place)
    return place


EFFORT = ("misspelt names among many", "places in rooms of many sizes")
"""All are compared with all, up to a fixed effort, which is beyond the sizes of the short test."""


@pytest.mark.thorough("compiles large scenarios")
@pytest.mark.parametrize(
    "name",
    one_in(
        15,
        [name for name in SCENARIOS if name not in EFFORT],
        "counts the calls while it checks large files",
    ),
)
def test_the_work_grows_with_the_scenario(name: str, place: Playground) -> None:
    """Functions called, which no load of the machine changes."""
    most = SCENARIOS[name].most
    size = max(min(most // 20, 40), min(most // 2, 24))
    assert work(name, 2 * size, place) < MOST * work(name, size, place)


@pytest.mark.slow
@pytest.mark.timeout(600)
@pytest.mark.parametrize("name", [*DOCUMENTS, *SCENARIOS])
def test_the_time_grows_with_the_file(name: str, place: Playground) -> None:
    most = (DOCUMENTS | SCENARIOS)[name].most
    found = [ratio(seconds(name, most // 2, place), seconds(name, most, place)) for _ in range(3)]
    assert min(found) < MOST, found


def test_the_ratio_shows_what_grows_with_the_square() -> None:
    assert ratio(0.1, 0.4) > MOST > ratio(0.1, 0.2)


# -- memory --------------------------------------------------------------------------------------------------------

_REFUSED = """
import json, os, re, time
from pathlib import Path
from socialai_dsl.frontend import check
from socialai_dsl.diagnostics import render_text

with open("flat.yaml", "w") as file:
    file.writelines(f"key{i}: value\\n" for i in range(6_000_000))
with open("items.yaml", "w") as file:
    file.write("- 1\\n" * 1_000_000)
with open("many.yaml", "w") as file:  # as many as a file has room for
    file.write("- 1\\n" * 250_000)
with open("quoted.yaml", "w") as file:
    file.write('a: "' + "x" * 1_000_000 + '"\\n')
with open("nested.yaml", "w") as file:
    file.write("[" * 50_000)
with open("wide.yaml", "w") as file:
    file.write("[" + "yes," * 24_000 + "]")
os.mkfifo("pipe.yaml")
os.symlink("/dev/zero", "zero.yaml")
def peak():  # of this program alone; what getrusage says includes whoever started it
    return int(re.search(r"VmHWM:\\s+(\\d+) kB", Path("/proc/self/status").read_text())[1])

check("talkitout")
before = peak()
took = {}
for name in ("flat", "items", "many", "quoted", "nested", "wide", "pipe", "zero"):
    start = time.process_time()
    result = check(f"{name}.yaml")
    render_text(result.diagnostics, result.sources)
    took[name] = [result.diagnostics[0].code, time.process_time() - start]
size = os.path.getsize("flat.yaml")
print(json.dumps([before, peak(), size, took]))
"""


@pytest.fixture(scope="module")
def refused(tmp_path_factory: pytest.TempPathFactory) -> tuple[int, int, int, dict[str, tuple[str, float]]]:
    """Most memory before and after reading what is too large (KiB), the largest file's bytes; name: code, seconds."""
    done = subprocess.run(
        [sys.executable, "-c", _REFUSED],
        cwd=tmp_path_factory.mktemp("large"),
        env={"PYTHONPATH": str(ROOT), "PATH": "/usr/bin:/bin"},
        capture_output=True,
        text=True,
        check=True,
        timeout=120,
    )
    before, after, size, took = json.loads(done.stdout)
    return before, after, size, took


@pytest.mark.thorough("writes and reads files of megabytes")
def test_what_is_too_large_is_refused_in_little_memory(refused) -> None:
    _, most, size, took = refused
    assert size > 100e6
    codes = {name: code for name, (code, _) in took.items()}
    assert codes == {
        **dict.fromkeys(("flat", "items", "many", "quoted", "nested"), "S004"),
        "wide": "S003",
        **dict.fromkeys(("pipe", "zero"), "S007"),
    }
    assert most < 200 * 1024, f"{most} KiB"


@pytest.mark.slow
def test_what_is_too_large_is_refused_in_a_second(refused) -> None:
    assert max(seconds for _, seconds in refused[3].values()) < 1

"""In an installation without extras every command works, or says in one line which extra it lacks."""

import json
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
OPTIONAL = """
torch safetensors tensorboard matplotlib rich textual wandb pygls lsprotocol httpx openenv fastapi inspect_ai trl
transformers jinja2 pandas scipy pyarrow minigrid sb3_contrib stable_baselines3 pettingzoo ray submitit playwright
markdown_it starlette uvicorn websockets
""".split()
"""What only extras bring, as it is imported."""
CHANCE = """\
experiment: tiny
set: {eval_episodes: 2}
conditions: [{name: chance, scenario: cointhief, agent: random}]
"""
LACKING = {
    "play talkitout": "play",
    "evaluate human --on talkitout": "play",
    "run cointhief --frames 100": "train",
    "evaluate shipped:cointhief --on cointhief": "train",
    "crossplay shipped:help oracle --on together/help_together": "train",
    "words shipped:help --on together/help_together": "train",
    "trace cointhief --agent shipped": "train",
    "export shipped:cointhief --out exported": "train",
    "run cointhief --agent shipped": "train",
    "experiment run trained.yaml": "train",
    "evaluate llm:some --on cointhief": "llm",
    "report runs/x": "report",
    "check cointhief --pictures pictures --rooms 2": "report",
    "crossplay oracle random --on together/help_together --out crossed": "report",
    "serve talkitout --port 0": "openenv",
    "studio --port 0": "studio",
    "study run studies/asking.yaml --port 0": "studio",
    "study rehearse studies/asking.yaml": "studio",
    "study data studies/asking.yaml": "studio",
    "lsp": "lsp",
}
WORKING = [
    "--help",
    "--print-completion bash",
    "new bakery",
    "validate cointhief",
    "show cointhief",
    "trace cointhief",
    "replay cointhief --out page.html",
    "test cointhief",
    "evaluate oracle --on cointhief --episodes 2",
    "crossplay oracle random --on together/help_together --episodes 2",
    "experiment plan tiny.yaml",
    "run cointhief --agent random --eval-episodes 2",
    "run cointhief --agent oracle --eval-episodes 2",
]
HIDDEN = f"import sys; sys.modules.update(dict.fromkeys({OPTIONAL!r}))\n"
COMMANDS = """
import io, json
from contextlib import redirect_stderr, redirect_stdout
from socialai_dsl.cli.main import main
ended = {}
for typed in json.loads(sys.argv[1]):
    with redirect_stdout(io.StringIO()) as out, redirect_stderr(io.StringIO()) as err:
        code = int(main(typed.split()))
    ended[typed] = code, out.getvalue(), err.getvalue()
print(json.dumps(ended))
"""


def bare(folder: Path, code: str, *words: str) -> subprocess.CompletedProcess[str]:
    """Python in which nothing of an extra can be imported."""
    return subprocess.run(
        [sys.executable, "-c", HIDDEN + code, *words],
        cwd=folder, capture_output=True, text=True, stdin=subprocess.DEVNULL, timeout=250,
    )  # fmt: skip


@pytest.fixture(scope="module")
def ended(tmp_path_factory: pytest.TempPathFactory) -> dict[str, tuple[int, str, str]]:
    """What came of all commands, in one process: exit code, standard output, standard error."""
    folder = tmp_path_factory.mktemp("bare")
    (folder / "tiny.yaml").write_text(CHANCE, encoding="utf-8")
    (folder / "trained.yaml").write_text(CHANCE.replace("agent: random", "frames: 512"), encoding="utf-8")
    shutil.copytree(ROOT / "experiments" / "studies", folder / "studies")
    process = bare(folder, COMMANDS, json.dumps([*LACKING, *WORKING]))
    assert process.returncode == 0, process.stderr
    return {typed: (code, out, err) for typed, (code, out, err) in json.loads(process.stdout).items()}


@pytest.mark.parametrize("typed", LACKING)
def test_a_command_says_which_extra_it_lacks(typed: str, ended: dict[str, tuple[int, str, str]]) -> None:
    code, out, err = ended[typed]
    assert (code, out) == (2, ""), err
    (said,) = err.splitlines()
    assert said.endswith(f": pip install 'socialai-dsl[{LACKING[typed]}]'")
    assert LACKING[typed] in PROJECT["optional-dependencies"]


@pytest.mark.parametrize("typed", WORKING)
def test_a_command_needs_no_extra(typed: str, ended: dict[str, tuple[int, str, str]]) -> None:
    code, _, err = ended[typed]
    assert code == 0, err


def test_a_function_says_which_extra_it_lacks(tmp_path: Path) -> None:
    process = bare(tmp_path, "import socialai_dsl; socialai_dsl.make_parallel('together/help_together')")
    assert "make_parallel needs pip install 'socialai-dsl[pettingzoo]'" in process.stderr


def test_a_part_of_an_extra_is_not_enough(tmp_path: Path) -> None:
    """Many have PyTorch already, and nothing of what trains beside it."""
    pytest.importorskip("torch")
    code = "del sys.modules['torch']; from socialai_dsl.cli.main import main; sys.exit(int(main(['run', 'help'])))"
    process = bare(tmp_path, code)
    assert (process.returncode, process.stdout) == (2, "")
    assert process.stderr == (
        "socialai: training and evaluating need safetensors: pip install 'socialai-dsl[train]'\n"
    )


def test_a_report_on_chance_needs_the_extra_report_alone(tmp_path: Path) -> None:
    """Its baselines are played by the script and at random."""
    pytest.importorskip("jinja2", reason="reports need the extra report")
    # Not as a module that is None, which SciPy takes for PyTorch.
    hidden = """import sys
class Hidden:
    def find_spec(self, name, *_):
        if name in ("torch", "safetensors", "tensorboard"):
            raise ModuleNotFoundError(name)
sys.meta_path.insert(0, Hidden())
"""
    typed = ["evaluate random --on cointhief --episodes 2 --out played", "report played/cointhief --out page"]
    done = subprocess.run(
        [sys.executable, "-c", hidden + COMMANDS, json.dumps(typed)],
        capture_output=True,
        check=True,
        cwd=tmp_path,
        text=True,
    )
    assert [code for code, *_ in json.loads(done.stdout).values()] == [0, 0]
    assert json.loads((tmp_path / "page" / "baselines.json").read_text())

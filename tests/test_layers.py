"""Imports point one way, and checking a file stays light: the layer table of ARCHITECTURE.md, executed."""

import ast
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]

TEXT_SIDE = {
    "source",
    "cures",
    "diagnostics",
    "draws",
    "vocabulary",
    "widths",
    "grammar",
    "schema",
    "semantics",
    "loader",
    "library",
    "checking",
    "frontend",
}

CONFIG = "socialai_dsl.trainer.config"
"""The options of a run: pydantic models without anything of the trainer behind them."""

SHIPPED = "socialai_dsl.trainer.shipped"
"""The names and folders of the agents that ship, likewise."""

FILES = "socialai_dsl.trainer.files"
"""The names of what training writes, likewise."""

# layer, a module or a package -> (layers of socialai_dsl it may import, third-party packages it may import)
MAY_IMPORT: dict[str, tuple[set[str], set[str]]] = {
    "atomic": ({"errors"}, set()),
    "baselines": (set(), set()),
    "errors": (set(), set()),
    "model_options": ({"errors"}, set()),
    "runs.lock": (set(), {"filelock"}),
    "runs.status": ({"atomic", "errors"}, set()),
    "runs.versions": (set(), set()),
    "runs.folder": ({"atomic", "errors", "runs.lock", "runs.status"}, {"pydantic", CONFIG, FILES}),
    "source": (set(), set()),
    "cures": ({"source"}, set()),
    "diagnostics": ({"source", "cures", "vocabulary"}, set()),
    "draws": (set(), {"numpy", "numba"}),
    "vocabulary": (set(), set()),
    "widths": (set(), set()),
    "grammar": ({"source", "diagnostics", "vocabulary", "widths"}, {"lark"}),
    "schema": (
        {"source", "cures", "diagnostics", "errors", "model_options", "vocabulary", "grammar"},
        {"pydantic", "pydantic_core", CONFIG},
    ),
    "semantics": (
        {"source", "cures", "diagnostics", "draws", "vocabulary", "widths", "grammar", "schema"},
        {CONFIG},
    ),
    "loader": (
        TEXT_SIDE - {"frontend", "checking", "library"} | {"errors"},
        {"yaml", "pydantic", "pydantic_core"},
    ),
    "library": (TEXT_SIDE - {"frontend", "checking"}, {"pydantic"}),
    "checking": (TEXT_SIDE - {"frontend"} | {"errors", "model_options"}, {SHIPPED, CONFIG}),
    "frontend": (TEXT_SIDE, set()),
    "authoring": (TEXT_SIDE | {"errors"}, {"pydantic", "yaml", "pygls", "lsprotocol"}),
    "program": ({"source", "vocabulary", "widths"}, {"numpy"}),
    "program_suite": ({"program", "vocabulary"}, set()),
    "compiler": (
        TEXT_SIDE - {"loader", "library", "checking", "frontend"} | {"program"},
        {"numpy"},
    ),
    "compilation": (TEXT_SIDE - {"frontend"} | {"program", "program_suite", "compiler"}, set()),
    "engine": ({"program", "draws", "vocabulary", "widths"}, {"numpy", "numba"}),
    "render": ({"program", "library", "vocabulary"}, {"numpy", "PIL"}),
    "envs": (
        TEXT_SIDE | {"program", "program_suite", "compilation", "engine", "render"},
        {"numpy", "gymnasium", "pettingzoo"},
    ),
    "analysis": (
        TEXT_SIDE | {"program", "program_suite", "compilation", "engine", "envs"},
        {"numpy"},
    ),
    "traces": (
        TEXT_SIDE | {"program", "program_suite", "compilation", "envs", "render"},
        {"numpy", "pydantic", "PIL"},
    ),
    "episodes": (
        TEXT_SIDE
        | {"errors", "baselines", "model_options", "program", "program_suite", "envs", "render", "traces"}
        | {"runs.folder"},
        {"numpy", "gymnasium", "PIL", "trainer", "torch", SHIPPED},
    ),
    "play": (
        TEXT_SIDE
        | {"errors", "program", "program_suite", "engine", "envs", "render", "traces", "episodes"}
        | {"llm"},
        {"numpy", "rich", "textual"},
    ),
    "evaluation": (
        TEXT_SIDE
        | {"errors", "atomic", "baselines", "model_options"}
        | {"authoring", "program", "program_suite", "compilation", "envs", "analysis"}
        | {"episodes", "traces", "llm", "play", "experiments", "runs.folder", "runs.versions"},
        {"numpy", "gymnasium", "pydantic", "yaml", "torch", "trainer"},
    ),
    "llm": (
        TEXT_SIDE
        | {"atomic", "errors", "model_options", "program", "program_suite", "envs", "episodes", "render"}
        | {"traces"},
        {"numpy", "httpx", "fastapi", "inspect_ai", "openenv", "pydantic", CONFIG},
    ),
    "web": ({"traces"}, {"starlette"}),
    "study.columns": (set(), set()),
    "study.log": ({"errors"}, set()),
    "study.progress": (TEXT_SIDE | {"study.log"}, set()),
    "study.arena": (
        TEXT_SIDE | {"errors", "program", "program_suite", "envs", "episodes", "traces", "llm"},
        {"numpy"},
    ),
    "study.replay": (
        TEXT_SIDE
        | {
            "errors",
            "envs",
            "episodes",
            "traces",
            "study.columns",
            "study.log",
            "study.progress",
            "study.arena",
        },
        set(),
    ),
    "study.exported": (
        TEXT_SIDE | {"atomic", "errors", "traces", "study.columns", "study.replay"},
        set(),
    ),
    "study": (
        TEXT_SIDE
        | {"study.columns", "study.log", "study.progress", "study.arena", "study.replay", "study.exported"}
        | {
            "errors",
            "atomic",
            "program",
            "program_suite",
            "envs",
            "episodes",
            "traces",
            "llm",
            "model_options",
            "web",
            "runs.lock",
        },
        {
            "httpx",
            "numpy",
            "pydantic",
            "markdown_it",
            "starlette",
            "uvicorn",
            "websockets",
            "pyarrow",
            SHIPPED,
        },
    ),
    "runs.options": (
        TEXT_SIDE | {"errors"},
        {"pydantic", "torch", "yaml", CONFIG},
    ),
    "runs": (
        TEXT_SIDE
        | {"errors", "atomic", "program_suite", "compilation", "envs", "episodes", "traces", "evaluation"}
        | {"baselines", "experiments", "model_options", "reporting"}
        | {"runs.folder", "runs.options", "runs.versions", "study.log", "study.replay", "study.exported"},
        {"pydantic", "yaml", "trainer"},
    ),
    "experiments": (
        TEXT_SIDE
        | {"atomic", "compilation", "errors", "runs.folder", "runs.lock", "runs.options", "runs.status"},
        {"pydantic", "ray", "submitit", "yaml", CONFIG, FILES, SHIPPED},
    ),
    "reporting": (
        {"errors", "experiments", "baselines", "model_options", "runs.folder"},
        {"numpy", "pandas", "scipy", "matplotlib", "pydantic", "jinja2", "markupsafe", CONFIG},
    ),
    "sb3": (set(), {"numpy", "gymnasium", "stable_baselines3"}),
    "_gymnasium_hook": ({"envs"}, set()),
    "__main__": ({"cli"}, set()),
    "": (
        TEXT_SIDE
        | {"program", "program_suite", "compilation", "engine", "envs", "episodes", "runs", "runs.folder"}
        | {"_gymnasium_hook"},
        set(),
    ),
}

# What the trainer may use: environments, curricula, what plays episodes, and the words of the language, such as the
# names of colours; no scenario's insides.
FACADE = {
    f"socialai_dsl.{name}"
    for name in ("envs.factory", "episodes.policies", "frontend", "schema.curriculum", "vocabulary")
}


def modules(package: str) -> list[Path]:
    return sorted((ROOT / package).rglob("*.py"))


@cache
def parsed(path: Path) -> ast.Module:
    """A module as a syntax tree."""
    return ast.parse(path.read_text(encoding="utf-8"))


def layer(path: Path) -> str:
    """`socialai_dsl/compiler/lower.py` -> `compiler`; the facade is ''."""
    return layer_of(name_of(path).removeprefix("socialai_dsl").removeprefix("."))


def layer_of(name: str) -> str:
    """`compiler.lower` -> `compiler`, `runs.folder.Run` -> `runs.folder`: a module of the table, or its package."""
    module = ".".join(name.split(".")[:2])
    return module if module in MAY_IMPORT else name.split(".")[0]


@cache
def imported(path: Path) -> tuple[tuple[str, int], ...]:
    """Dotted names of what is imported anywhere in it, `from package import name` as both, with the line."""
    return tuple(_imported(parsed(path)))


def _imported(tree: ast.Module) -> Iterator[tuple[str, int]]:
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from ((alias.name, node.lineno) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"line {node.lineno}: imports are absolute in this project"
            assert node.module is not None
            if node.module == "socialai_dsl":
                yield from ((f"socialai_dsl.{alias.name}", node.lineno) for alias in node.names)
            else:
                yield node.module, node.lineno


def violations(path: Path, own: str) -> Iterator[str]:
    internal, third_party = MAY_IMPORT[own]
    for name, line in imported(path):
        root, _, rest = name.partition(".")
        place = f"{path.relative_to(ROOT)}:{line}"
        if rest.split(".")[0] == "trainer":
            if not {"trainer", name} & third_party:
                yield f"{place}: layer {own!r} must not import {name}"
        elif root == "socialai_dsl":
            target = layer_of(rest)
            if target not in internal | {own}:
                yield f"{place}: layer {own!r} must not import {name}"
        elif root not in sys.stdlib_module_names and not {root, name} & third_party:
            yield f"{place}: layer {own!r} must not import {name}"


def test_imports_point_one_way() -> None:
    above = (
        "cli",
        "studio",
    )  # everything: that they start light, and that no other imports `cli`, is proved below
    paths = [path for path in modules("socialai_dsl") if layer(path) not in above]
    assert [str(path) for path in paths if layer(path) not in MAY_IMPORT] == [], "no layer of the table"
    assert [wrong for path in paths for wrong in violations(path, layer(path))] == []


def test_the_trainer_sees_only_the_facade() -> None:
    found = [(path, name, line) for path in modules("trainer") for name, line in imported(path)]
    assert len(found) > 100
    for path, name, line in found:
        root, place = name.split(".")[0], f"{path.relative_to(ROOT)}:{line}"
        assert root not in {"numba", "llvmlite", "ctypes"}, f"{place}: imports {name}"
        if name.startswith("socialai_dsl.trainer"):
            root = "trainer"
        if path.name in ("config.py", "files.py", "shipped.py"):
            allowed = root == "pydantic" or root in sys.stdlib_module_names
            assert allowed, f"{place}: imports {name}"
        if root == "socialai_dsl":
            assert name in FACADE, f"{place}: the trainer must not import {name}"


def test_environments_are_played_in_rooms_alone() -> None:
    """Whoever plays, plays in `episodes.Rooms`; the trainer collects, and what lies below looks into the engine."""
    above = ("episodes", "evaluation", "llm", "play", "runs", "studio", "study", "cli", "traces")
    found = [
        f"{path.relative_to(ROOT)}:{node.lineno}"
        for package in above
        for path in modules(f"socialai_dsl/{package}")
        for node in ast.walk(parsed(path))
        if isinstance(node, ast.Call)
        and isinstance(node.func, ast.Attribute)
        and node.func.attr == "step"
        and ast.unparse(node.func.value).rpartition(".")[2].strip("_") in ("env", "envs")
    ]
    own = {path.relative_to(ROOT).as_posix() for path in modules("socialai_dsl/episodes")}
    assert [place for place in found if place.partition(":")[0] not in own] == []
    assert found, "Rooms is found"


@cache
def graph(*packages: str) -> dict[str, set[str]]:
    """Module -> the modules of these packages that it imports anywhere: in functions and for typing as well."""
    paths = {name_of(path): path for package in packages for path in modules(package)}
    found: dict[str, set[str]] = {}
    for name, path in paths.items():
        named = set()
        for node in ast.walk(parsed(path)):
            if isinstance(node, ast.Import):
                named |= {alias.name for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and node.module is not None:
                submodules = {f"{node.module}.{alias.name}" for alias in node.names} & paths.keys()
                named |= submodules or {node.module}
        found[name] = named & paths.keys() - {name}
    return found


def name_of(path: Path) -> str:
    """`socialai_dsl/compiler/__init__.py` -> `socialai_dsl.compiler`, `trainer/a.py` -> `socialai_dsl.trainer.a`."""
    parts = path.relative_to(ROOT).with_suffix("").parts
    if parts[0] == "trainer":
        parts = ("socialai_dsl", *parts)
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def test_no_module_imports_itself_by_way_of_others() -> None:
    """Not in functions and not for typing only either: a circle is one thing cut into several files."""
    TopologicalSorter(
        graph("socialai_dsl", "trainer")
    ).prepare()  # raises CycleError, which names the modules


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_every_module_can_be_imported_first() -> None:
    names = [name for name in graph("socialai_dsl", "trainer") if not name.endswith(("__main__", ".sb3"))]
    script = f"""
import importlib, sys
for name in {names!r}:
    for own in [own for own in sys.modules if own.split(".")[0] == "socialai_dsl"]:
        del sys.modules[own]
    try:
        importlib.import_module(name)
    except ModuleNotFoundError as error:
        if error.name.split(".")[0] == "socialai_dsl":
            raise  # others are libraries of an extra that is not installed
"""
    subprocess.run([sys.executable, "-c", script], check=True, cwd=ROOT, timeout=900)


def test_nothing_but_programs_imports_the_commands() -> None:
    """What commands do is a function of some layer below, which Python users and the studio call as well."""
    users = {
        name
        for name, named in graph("socialai_dsl", "trainer").items()
        if any(other.startswith("socialai_dsl.cli") for other in named)
    }
    assert {name for name in users if not name.startswith("socialai_dsl.cli")} == {"socialai_dsl.__main__"}


def test_engine_and_compiler_do_not_know_each_other() -> None:
    """The point of the table, said on its own so that nobody relaxes it by editing a set."""
    for own, other in (("engine", "compiler"), ("compiler", "engine")):
        assert other not in MAY_IMPORT[own][0]
        assert not MAY_IMPORT["engine"][0] & (TEXT_SIDE - {"draws", "vocabulary", "widths"})


@pytest.mark.parametrize(
    "statement",
    [
        "import socialai_dsl.frontend",
        "import socialai_dsl.cli.main",
        "import socialai_dsl.experiments.document, socialai_dsl.experiments.driver, socialai_dsl.cli.experiment",
    ],
)
def test_checking_a_file_loads_nothing_heavy(statement: str) -> None:
    heavy = ("numba", "torch", "gymnasium", "matplotlib", "PIL", "textual", "rich")
    script = f"{statement}\nimport sys\nprint([name for name in {heavy!r} if name in sys.modules])"
    result = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True, cwd=ROOT, timeout=60
    )
    assert result.stdout.strip() == "[]"

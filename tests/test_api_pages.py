"""The pages of the Python API show every public name."""

import re
from importlib import import_module
from pathlib import Path

import pytest

API = Path(__file__).parents[1] / "docs" / "api"
SHOWN = {
    name
    for page in API.glob("*.md")
    for name in re.findall(r"^\.\. auto\w+:: ([\w.]+)", page.read_text(encoding="utf-8"), re.MULTILINE)
}


@pytest.mark.parametrize(
    "module",
    [
        "socialai_dsl",
        "socialai_dsl.episodes",
        "socialai_dsl.evaluation",
        "socialai_dsl.llm",
        "socialai_dsl.traces",
    ],
)
def test_every_public_name_has_its_place(module: str) -> None:
    public = {name for name in import_module(module).__all__ if not name.isupper()}
    assert {name for name in public if f"{module}.{name}" not in SHOWN} == set()


def test_everything_shown_is_documented() -> None:
    for name in SHOWN - {"socialai_dsl.llm.trl.social_env"}:
        module, _, attribute = name.rpartition(".")
        found = getattr(import_module(module), attribute) if module else import_module(name)
        assert found.__doc__, f"{name} has no docstring"

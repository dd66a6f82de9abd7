"""docs/agents.md has the tables of all options of a run and of the recipe, as `trainer/config.py` declares them."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

from socialai_dsl.trainer.config import FLAGS, HYPER, RECIPES, RunConfig

PAGE = Path(__file__).parents[1] / "docs" / "agents.md"


def options() -> list[str]:
    lines = ["| option | default | meaning |", "|---|---|---|"]
    for name in (*FLAGS, *HYPER):
        field = RunConfig.model_fields[name]
        typed = f"--{name.replace('_', '-')}" if name in FLAGS else f"--hyper {name}=..."
        lines.append(f"| `{typed}` | {written(field.default)} | {field.description} |")
    return lines


def recipe(values: Mapping[str, Any]) -> list[str]:
    lines = ["| option | value | otherwise |", "|---|---|---|"]
    for name, value in values.items():
        otherwise = written(RunConfig.model_fields[name].default) or "unchanged"
        lines.append(f"| `{name}` | {written(value)} | {otherwise} |")
    return lines


def written(value: Any) -> str:
    return "" if value is None else str(value).lower()


@pytest.mark.parametrize(
    ("name", "lines"), [("options", options()), ("guided", recipe(RECIPES["guided"].values))]
)
def test_the_page_has_the_table(name: str, lines: list[str], update_goldens: bool) -> None:
    begin, end = f"<!-- {name}: made from trainer/config.py -->\n", f"<!-- end of {name} -->\n"
    before, _, rest = PAGE.read_text(encoding="utf-8").partition(begin)
    shown, _, after = rest.partition(end)
    assert after, f"{PAGE.name} has no place for the table of {name}"
    table = "\n".join(lines) + "\n"
    if update_goldens:
        PAGE.write_text(before + begin + table + end + after, encoding="utf-8")
        return
    assert shown == table, "run `make update-goldens`"

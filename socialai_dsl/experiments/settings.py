"""A run's configuration with every automatic option resolved."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import yaml

from trainer.config import RunConfig, configure

_BONUS_C: Final = {"lang": 7.0, "cell": 3.0}
_TABLE: Final = Path(__file__).with_name("paper_bonus.yaml")


def resolved_config(given: Mapping[str, Any]) -> RunConfig:
    """The configuration of a run from its options, `recipe` among them.

    `bonus` may be `auto`, and its scale is the paper's unless it is given.

    Raises:
        pydantic.ValidationError: see `trainer.config.configure`.
    """
    bonus = resolved_bonus(str(given.get("bonus", "none")), str(given.get("scenario", "")))
    return configure(**(bonus | {name: value for name, value in given.items() if name != "bonus"}))


def resolved_bonus(kind: str, scenario: str) -> dict[str, Any]:
    """Kind and scale of an exploration bonus; `auto` is the kind that the paper gives the scenario, if any."""
    name = Path(scenario.partition("?")[0].partition("+")[0]).name.removesuffix(".yaml").removesuffix(".yml")
    table = yaml.safe_load(_TABLE.read_text(encoding="utf-8"))
    listed = table.get(name, {"kind": "none"})
    if kind == "auto":
        kind = listed["kind"]
    if kind not in _BONUS_C:
        return {"bonus": kind}
    scale = listed["c"] if kind == listed["kind"] else _BONUS_C[kind]
    return {"bonus": kind, "bonus_c": float(scale)}

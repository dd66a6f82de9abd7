"""The shipped scenarios by name, with their variants and the values of their parameters; found without loading any."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache

from socialai_dsl.loader.reader import shipped_folder
from socialai_dsl.loader.shipped import catalogue

CUES = ("color", "pointing", "feedback", "emulation", "scaffolding")
OF_ALL = ("unsocial", "oracle", "as_coded")


@cache
def suites() -> tuple[str, ...]:
    """What ships and plays several scenarios."""
    return tuple(one.name for one in catalogue() if _text(one.name).startswith("suite:"))


@cache
def scenarios() -> tuple[str, ...]:
    """What ships, can be played and is one scenario, as it is."""
    return tuple(one.name for one in catalogue() if one.name not in suites())


def everything() -> Iterator[str]:
    """Every scenario as it is, with its variants, and with each value of its parameters."""
    for one in catalogue():
        if one.name in suites():
            continue
        yield one.name
        yield from (f"{one.name}+{variant}" for variant in _variants(one.name, one.variants))
        for name, values in one.parameters.items():
            yield from (f"{one.name}?{name}={value}" for value in values[1:])


def _variants(name: str, named: tuple[str, ...]) -> Iterator[str]:
    yield from (variant for variant in named if variant in (OF_ALL if "/" not in name else OF_ALL[1:2]))
    if "/" not in name:
        yield "as_coded+unsocial"
    if "\nextends: information_seeking_base.yaml\n" in _text(name):
        yield from (*CUES, "alone")
    if (shipped_folder() / f"{name}_asocial_oracle.yaml").exists():
        yield "asocial+oracle"


def _text(name: str) -> str:
    return (shipped_folder() / f"{name}.yaml").read_text(encoding="utf-8")

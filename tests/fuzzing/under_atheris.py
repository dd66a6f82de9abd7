"""The process in which atheris drives a target: TARGET PLANTED-OR-EMPTY and options of libFuzzer."""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import atheris

with atheris.instrument_imports(include=["socialai_dsl"]):
    from tests.fuzzing import planted, targets
    from tests.fuzzing.inputs import seeds
    from tests.fuzzing.playground import Playground

import pytest


def main() -> None:
    """Fuzz until libFuzzer ends the process."""
    name, plant = sys.argv[1:3]
    run = targets.TARGETS[name]
    folder = tempfile.TemporaryDirectory()
    place = Playground(Path(folder.name))
    warm_up(run, place)
    if plant:
        planted.PLANTED[plant][1](pytest.MonkeyPatch())

    def one(data: bytes) -> None:
        run(data, place)

    atheris.Setup([sys.argv[0], *sys.argv[3:]], one)
    atheris.Fuzz()


def warm_up(run: targets.Target, place: Playground) -> None:
    """Let everything be imported that is imported late, which would look like code from a file."""
    if run is targets.whole:
        from socialai_dsl.frontend import check

        for name in ("small.yaml", "rich.yaml", "town.yaml", "talkitout", "social_env", "school/marbles"):
            check(place.folder / name if name.endswith(".yaml") else name)
    for seed in seeds("expression"):
        targets.expression(seed, place)


if __name__ == "__main__":
    main()

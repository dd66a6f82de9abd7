"""Whatever an author writes, there is a finding or a scenario, never an exception."""

from __future__ import annotations

import copy
import random
import re
import shutil
from contextlib import suppress
from pathlib import Path

import pytest
import yaml

from socialai_dsl.compilation import compile_scenario
from socialai_dsl.diagnostics import ScenarioError, render_text
from socialai_dsl.frontend import check
from socialai_dsl.loader.reader import read_document, shipped_folder
from tests.quick import one_in

PIECES = [
    "(",
    ")",
    "|",
    "..",
    "<",
    ">",
    "pick(",
    "doors",
    "exit",
    "0",
    '"',
    "where",
    "not",
    "here",
    "left",
    ":",
    "$x",
    "t",
    "W",
    "null",
]


def mutated(text, rng):
    """The text with a word replaced by another, a line doubled or taken out, or a piece put in."""
    kind = rng.random()
    if kind < 0.6:
        words = list(re.finditer(r"\w+\([^()]*\)|\w+|[=<>|+-]+", text))
        old, new = rng.choice(words), rng.choice(words)
        return text[: old.start()] + new.group() + text[old.end() :]
    if kind < 0.8:
        lines = text.split("\n")
        at = rng.randrange(len(lines))
        lines[at : at + 1] = rng.choice([[], [lines[at]] * 2])
        return "\n".join(lines)
    at = rng.randrange(len(text))
    return text[:at] + rng.choice(PIECES) + text[at:]


DIAGNOSTICS = Path(__file__).parent.parent / "diagnostics"
SHIPPED = sorted(str(path.relative_to(shipped_folder())) for path in shipped_folder().rglob("*.yaml"))
WHOLE = ("rich.yaml", "town.yaml")
VALUES = [
    *(0, -1, 3, True, None, "", [], {}, 0.5, [1, 2], {"sequence": 2, "moves": ["left"]}),
    *(
        "agent",
        "doors",
        "pick(doors)",
        "cells",
        "dance",
        "nowhere",
        "it",
        "prev(t)",
        "attempt == dance",
        "locked",
        "peers",
        "toy.inside",
        "keeper.believes.toy_in",
        "dar(red)",
        "speaker",
        "1..3",
    ),
    {"start": 3, "range": "0..5"},
]


class Plainly(yaml.SafeDumper):
    """Writes what is there twice twice: the language has no anchors."""

    def ignore_aliases(self, data):
        return True


def paths(data, path=()):
    """The path of every part of some data."""
    for key in data if isinstance(data, dict) else range(len(data)) if isinstance(data, list) else ():
        yield (*path, key)
        yield from paths(data[key], (*path, key))


def part(data, path):
    for key in path:
        data = data[key]
    return data


def rebuilt(data, other, rng):
    """Change one part: take it out, put another part in its place or beside it, rename it, or give it another value."""
    *before, key = rng.choice(list(paths(data)))
    parent, kind = part(data, before), rng.random()
    donor = rng.choice((data, other))
    *_, name = found = rng.choice(list(paths(donor)))
    given = copy.deepcopy(part(donor, found))
    if kind < 0.25:
        del parent[key]
    elif kind < 0.55:
        parent[key] = given
    elif kind < 0.7 and isinstance(parent, dict):
        parent[str(name)] = given
    elif kind < 0.85 and isinstance(parent, dict):
        parent[str(name)] = parent.pop(key)
    else:
        parent[key] = copy.deepcopy(rng.choice(VALUES))


@pytest.fixture
def scenarios(tmp_path, monkeypatch):
    """A copy of the shipped scenarios beside those with everything in them, in which we work."""
    folder = tmp_path / "scenarios"
    shutil.copytree(shipped_folder(), folder)
    shutil.copytree(DIAGNOSTICS / "guides", folder / "guides")
    for name in WHOLE:
        shutil.copy(DIAGNOSTICS / name, folder)
    monkeypatch.chdir(folder)
    return folder


def data_of(file):
    """A file as plain data, as the language reads it: other readers of YAML take less."""
    return copy.deepcopy(read_document(file).data)


def mutilated(file, scenarios, rng):
    """The text of a scenario with a few parts changed, or a few words."""
    changes = rng.choice((1, 1, 2, 3))
    if rng.random() < 0.6:
        data, other = data_of(file), data_of(scenarios / rng.choice([*SHIPPED, *WHOLE]))
        for _ in range(changes):
            rebuilt(data, other, rng)
            if not data:
                break
        return yaml.dump(data, Dumper=Plainly, sort_keys=False)
    text = file.read_text(encoding="utf-8")
    for _ in range(changes):
        text = mutated(text, rng)
    return text


@pytest.mark.parametrize("seed", one_in(4, range(12), "compiles forty mutilated scenarios"))
def test_a_mutilated_scenario_is_a_finding_or_a_program(seed, scenarios):
    rng = random.Random(seed)
    for _ in range(40):
        name = rng.choice([*SHIPPED, *WHOLE * 8])
        file = scenarios / name
        whole = file.read_text(encoding="utf-8")
        text = mutilated(file, scenarios, rng)
        file.write_text(text, encoding="utf-8")
        result = check("diverse_exit.yaml" if name.startswith("diverse_exit/") else name)
        needs_no_meaning = result.resolved is not None and (
            result.resolved.kind != "scenario" or result.resolved.data.get("abstract") is True
        )
        assert result.diagnostics or result.checked or needs_no_meaning, text
        assert bool(render_text(result.diagnostics, result.sources)) == bool(result.diagnostics)
        if result.checked is not None:
            with suppress(ScenarioError):  # the size of the room, for instance, is looked at only there
                compile_scenario(result.checked)
        file.write_text(whole, encoding="utf-8")

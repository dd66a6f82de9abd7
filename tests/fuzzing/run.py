"""Runs atheris on a target in a process of its own and says what came of it: `python -m tests.fuzzing.run --help`."""

from __future__ import annotations

import argparse
import os
import re
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

from tests.fuzzing.inputs import write_corpus, write_dictionary

FOUND = Path("build/fuzz")
"""Where inputs go that broke something."""


@dataclass(frozen=True)
class Outcome:
    """What a run of the fuzzer came to.

    Attributes:
        executions: how many inputs. edges: of our code that they went through. seconds: it took.
        finding: what broke, in a line; None if nothing did. where: the input that did it.
    """

    executions: int
    edges: int
    seconds: float
    finding: str | None
    where: str | None


def fuzz(target: str, seconds: int, plant: str | None = None, seed: int = 1) -> Outcome:
    """Run the fuzzer on a target for so many seconds, or until something breaks."""
    FOUND.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        corpus, dictionary = Path(folder, "corpus"), Path(folder, "dictionary")
        corpus.mkdir()
        write_corpus(corpus, target)
        write_dictionary(dictionary)
        options = [
            *(f"-dict={dictionary}", f"-max_total_time={seconds}", f"-seed={seed}", "-max_len=6000"),
            *("-timeout=20", "-rss_limit_mb=1500", "-print_final_stats=1", f"-artifact_prefix={FOUND}/"),
        ]
        command = [
            sys.executable,
            "-m",
            "tests.fuzzing.under_atheris",
            target,
            plant or "",
            *options,
            str(corpus),
        ]
        environment = {**os.environ, "PYTHONUTF8": "1"}  # what was found may be written in any letters
        start = time.monotonic()
        done = subprocess.run(
            command, capture_output=True, text=True, errors="replace", check=False, env=environment
        )
        took = time.monotonic() - start
    said = done.stdout + done.stderr
    executions = [int(n) for n in re.findall(r"number_of_executed_units: (\d+)", said)]
    executions += [int(n) for n in re.findall(r"^#(\d+)\s", said, re.MULTILINE)]
    edges = [int(n) for n in re.findall(r"cov: (\d+)", said)]
    where = re.search(r"Test unit written to (\S+)", said)
    finding = None
    if done.returncode:
        lines = re.findall(r"^[\w.]*(?:Error|Violation|Exception|Interrupt)\b.*", said, re.MULTILINE)
        finding = next(iter(lines), f"ended with {done.returncode}: {said[-500:]}")
    return Outcome(
        max(executions, default=0), max(edges, default=0), took, finding, where[1] if where else None
    )


def main() -> int:
    """Fuzz the targets that are named."""
    parser = argparse.ArgumentParser(description="Throw made-up files at the loader.")
    parser.add_argument("targets", nargs="*", default=["document", "whole", "expression"])
    parser.add_argument("--seconds", type=int, default=60, help="for each target (default: 60)")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--planted", action="store_true", help="instead, look for each planted mistake")
    arguments = parser.parse_args()
    if arguments.planted:
        from tests.fuzzing.planted import PLANTED

        jobs = [(target, name) for name, (target, _) in PLANTED.items()]
    else:
        jobs = [(target, None) for target in arguments.targets]
    broken = False
    for target, plant in jobs:
        outcome = fuzz(target, arguments.seconds, plant, arguments.seed)
        broken |= outcome.finding is not None and plant is None
        name = f"{target}: {plant}" if plant else target
        speed = outcome.executions / outcome.seconds
        print(
            f"{name}: {outcome.executions} executions in {outcome.seconds:.0f} s ({speed:.0f}/s), "
            f"{outcome.edges} edges; {outcome.finding or 'nothing found'}"
            + (f" [{outcome.where}]" if outcome.where else ""),
            flush=True,
        )
    return int(broken)


if __name__ == "__main__":
    sys.exit(main())

"""How the time to read a file grows with the file: `python -m tests.fuzzing.scaling` measures every bomb."""

from __future__ import annotations

import gc
import sys
import tempfile
import time
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

from socialai_dsl.diagnostics import ScenarioError, render_text
from socialai_dsl.frontend import check
from socialai_dsl.grammar.ast import parse_expression, parse_text
from socialai_dsl.loader.reader import decoded, read_document
from tests.fuzzing.bombs import DOCUMENTS, SCENARIOS
from tests.fuzzing.playground import Playground

MOST = 2.5
"""What twice the file may take, of what half of it does; 2 is in proportion."""

LEAST = 0.005
"""Seconds below which there is nothing to compare."""


def read(name: str, text: str, place: Playground) -> int:
    """Read and report a bomb; how many findings there were."""
    try:
        source = decoded(text.encode(), "fuzz.yaml")
        if name in DOCUMENTS:
            read_document(source)
            return 0
        result = check(place.file, {place.file: source})
        found, sources = result.diagnostics, result.sources
    except ScenarioError as error:
        found, sources = error.diagnostics, error.sources
    render_text(found, sources)
    return len(found)


def work(name: str, size: int, place: Playground) -> int:
    """How many functions are called to read a bomb, which is the same every time."""
    calls = 0

    def count(frame: Any, event: str, argument: Any) -> None:
        nonlocal calls
        calls += event in ("call", "c_call")

    def run() -> None:
        sys.setprofile(count)
        try:
            read(name, text, place)
        finally:
            sys.setprofile(None)

    text = (DOCUMENTS | SCENARIOS)[name].text(size)
    _afresh(run)
    return calls


def seconds(name: str, size: int, place: Playground, most: int = 5) -> float:
    """The least processor time to read a bomb, of several."""
    text = (DOCUMENTS | SCENARIOS)[name].text(size)
    return min(_afresh(lambda: read(name, text, place)) for _ in range(most))


def _afresh(run: Callable[[], object]) -> float:
    """The processor time without what was remembered, and without the collector, whose rounds come when they like."""
    parse_expression.cache_clear()
    parse_text.cache_clear()
    gc.collect()
    gc.disable()
    try:
        start = time.process_time()
        run()
        return time.process_time() - start
    finally:
        gc.enable()


def ratio(small: float, large: float) -> float:
    """How much longer twice the file takes."""
    return large / max(small, LEAST)


def main() -> int:
    """Measure all bombs, or those that are named."""
    worst = []
    with tempfile.TemporaryDirectory() as folder:
        place = Playground(Path(folder))
        for name, bomb in (DOCUMENTS | SCENARIOS).items():
            if sys.argv[1:] and name not in sys.argv[1:]:
                continue
            sizes = [bomb.most // 4, bomb.most // 2, bomb.most]
            took = [seconds(name, size, place) for size in sizes]
            ratios = [ratio(small, large) for small, large in pairwise(took)]
            worst.append((max(ratios), name))
            times = " ".join(f"{1000 * each:8.1f}" for each in took)
            print(f"{name:38} {bomb.most:8} {times} ms  " + " ".join(f"{r:5.2f}" for r in ratios), flush=True)
    print("worst:", ", ".join(f"{name} {r:.2f}" for r, name in sorted(worst, reverse=True)[:5]))
    return int(max(worst)[0] >= MOST)


if __name__ == "__main__":
    sys.exit(main())

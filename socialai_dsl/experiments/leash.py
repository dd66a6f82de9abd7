"""Run a Python module as a program that ends with its parent, or as soon as somebody else has taken over its run.

`python -m socialai_dsl.experiments.leash CLAIM CORES MODULE ARGUMENT...`, with a pipe from the parent as its input.
The pipe closes when the parent dies in whatever way, so a killed worker leaves nobody behind that writes into its run.
"""

from __future__ import annotations

import os
import runpy
import sys
import threading
import time
from pathlib import Path

from socialai_dsl.experiments.claims import is_overtaken

_SECONDS_BETWEEN_LOOKS = 1.0


def main(arguments: list[str]) -> None:
    """Tie this process to its parent and to its claim, then become the module."""
    claim, cores, module, *rest = arguments
    if cores and hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, map(int, cores.split(",")))
    threading.Thread(target=_end_with_parent, daemon=True).start()
    threading.Thread(target=_end_when_overtaken, args=(Path(claim),), daemon=True).start()
    sys.argv = [module, *rest]
    runpy.run_module(module, run_name="__main__", alter_sys=True)


def _end_with_parent() -> None:
    # Unbuffered, and without Python's own object for it, which the module may want to use.
    while os.read(0, 1024):
        pass
    os._exit(1)


def _end_when_overtaken(claim: Path) -> None:
    while not is_overtaken(claim):
        time.sleep(_SECONDS_BETWEEN_LOOKS)
    os._exit(1)


if __name__ == "__main__":
    main(sys.argv[1:])

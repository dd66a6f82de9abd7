"""Run a Python module as a program that ends with its parent.

`python -m socialai_dsl.experiments.ends_with_parent MODULE ARGUMENT...`, with a pipe from the parent as its input. The
pipe closes when the parent dies in whatever way, so a killed worker leaves no process behind that writes into its run.
"""

from __future__ import annotations

import os
import runpy
import sys
import threading


def main(arguments: list[str]) -> None:
    """Tie this process to its parent, then become the module."""
    threading.Thread(target=_end_with_parent, daemon=True).start()
    sys.argv = arguments
    runpy.run_module(arguments[0], run_name="__main__", alter_sys=True)


def _end_with_parent() -> None:
    # Unbuffered, and without Python's own object for it, which the module may want to use.
    while os.read(0, 1024):
        pass
    os._exit(1)


if __name__ == "__main__":
    main(sys.argv[1:])

"""This module records every start of a run, and what of the surroundings decides about its last bits."""

from __future__ import annotations

import json
import os
import time
import warnings
from pathlib import Path
from typing import Any

import torch

FILE_NAME = "starts.jsonl"
SURROUNDINGS = ("torch", "cpu", "device", "threads", "processes")


def surroundings(device: str, threads: int, processes: int) -> dict[str, Any]:
    """What must be equal for two runs to be equal to the bit, `SURROUNDINGS` by name."""
    # The instructions that torch uses here; other processors may round sums differently.
    cpu = torch.backends.cpu.get_cpu_capability()
    return dict(zip(SURROUNDINGS, (str(torch.__version__), cpu, device, threads, processes), strict=True))


def record(run_dir: Path, update: int, frames: int, around: dict[str, Any]) -> None:
    """Append one line: when, from where on, and in what surroundings; warn if the last start had others.

    The file is never cut back: it tells how often a run was stopped.

    Raises:
        OSError: it cannot be written.
    """
    path = run_dir / FILE_NAME
    text = path.read_text(encoding="utf-8", errors="replace") if path.exists() else ""
    known = _rows(text)
    if known and update > 0:
        changed = [
            f"{name} {known[-1].get(name)} -> {around[name]}"
            for name in SURROUNDINGS
            if known[-1].get(name) != around[name]
        ]
        if changed:
            warnings.warn(
                f"the run goes on under other conditions ({', '.join(changed)}), so it need not equal, to the last "
                "bit, one that never stopped",
                stacklevel=3,
            )
    row = {"time": time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime()), "update": update, "frames": frames}
    with path.open("a", encoding="utf-8") as file:
        unfinished = "\n" if text and not text.endswith("\n") else ""  # by a process killed while writing
        file.write(unfinished + json.dumps(row | around) + "\n")
        file.flush()
        os.fsync(file.fileno())


def _rows(text: str) -> list[dict[str, Any]]:
    """The lines that are whole."""
    rows = []
    for line in text.splitlines():
        try:
            row = json.loads(line)
        except ValueError:
            continue
        if isinstance(row, dict):
            rows.append(row)
    return rows

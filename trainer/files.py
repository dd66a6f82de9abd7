"""The names of what training writes into the folder of a run."""

from __future__ import annotations

from pathlib import Path
from typing import Final

METRICS: Final = "metrics.jsonl"
"""A row of figures for each update."""

STARTS: Final = "starts.jsonl"
"""A line for each process that trained."""

CHECKPOINTS: Final = "checkpoints"
"""The folder of the newest checkpoints."""

SUFFIX: Final = ".safetensors"


def checkpoint_files(folder: Path) -> list[Path]:
    """The checkpoints that lie in a folder, the oldest first; the name of each is its number of frames."""
    return sorted(folder.glob(f"*{SUFFIX}"))
